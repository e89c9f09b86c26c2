"""A law from a table: N = δ^e·s(v, δ'), v = sqrt(δ/δ_most), s in pieces of polynomials.

A row of the table is one cell in v and in the rate: Σ_ij row[i·(RATE_TERMS) + j]·ξ^i·ρ^j, ξ and ρ from -1 to 1 over
the cell. The cells are equal in v and in the rate, those of one rate behind each other. A force of the indentation
alone has one cell in the rate, and terms with j = 0 only. Beyond δ_most s stays what it is there. Beyond the rates of
the table it goes on straight: where it stayed, a solve that passes through high rates would not find back.
"""

from __future__ import annotations

from math import sqrt

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray

(
    TABLE_EXPONENT, TABLE_LARGEST, TABLE_CELLS, TABLE_V_TERMS, TABLE_FIRST, TABLE_FORCE, TABLE_SLOWEST, TABLE_WIDTH,
    TABLE_RATES, TABLE_RATE_TERMS,
) = range(1, 11)  # fmt: skip
"""Columns: e, δ_most, cells in v, terms in v, first row, unit of the force, lowest rate, width of a cell in the rate,
cells in the rate, terms in the rate."""


@inlined_uncounted_kernel
def tabulated_share(delta: float, rate: float, numbers: FloatArray, table: FloatArray) -> tuple[float, float, float]:
    """Return s of an indentation and its rate, and its derivatives by v and by the rate."""
    v = sqrt(max(delta, 0.0) / numbers[TABLE_LARGEST])
    beyond = v > 1.0
    v = min(v, 1.0)
    cells = numbers[TABLE_CELLS]
    cell = min(int(v * cells), int(cells) - 1)
    xi = 2.0 * (v * cells - cell) - 1.0
    rates = int(numbers[TABLE_RATES])
    wanted = (rate - numbers[TABLE_SLOWEST]) / numbers[TABLE_WIDTH]
    along = min(max(wanted, 0.0), float(rates))
    band = min(int(along), rates - 1)
    rho = 2.0 * (along - band) - 1.0
    row = int(numbers[TABLE_FIRST]) + band * int(cells) + cell
    width = int(numbers[TABLE_RATE_TERMS])
    share = 0.0
    by_v = 0.0
    by_rate = 0.0
    for i in range(int(numbers[TABLE_V_TERMS]) - 1, -1, -1):
        value = 0.0
        slope = 0.0
        for j in range(width - 1, -1, -1):
            slope = slope * rho + value
            value = value * rho + table[row, i * width + j]
        by_v = by_v * xi + share
        share = share * xi + value
        by_rate = by_rate * xi + slope
    by_rate *= 2.0
    share += by_rate * (wanted - along)
    return share, 0.0 if beyond else 2.0 * cells * by_v, by_rate / numbers[TABLE_WIDTH]


@inlined_uncounted_kernel
def tabulated_forces(
    n: int, delta: FloatArray, rate: FloatArray, factor: FloatArray, numbers: FloatArray, table: FloatArray,
    N: FloatArray, slope: FloatArray, viscous: FloatArray,
) -> None:  # fmt: skip
    """Write forces at n nodes, times the factor of the path, and their derivatives by indentation and rate.

    They are negative where a law that depends on the rate would pull; those of one that does not never are.
    """
    exponent = numbers[TABLE_EXPONENT]
    rated = numbers[TABLE_RATE_TERMS] > 1.0 or numbers[TABLE_RATES] > 1.0
    scale = 0.5 / sqrt(numbers[TABLE_LARGEST])
    for k in range(n):
        share, by_v, by_rate = tabulated_share(delta[k], rate[k], numbers, table)
        if delta[k] <= 0.0 or (share <= 0.0 and not rated):
            share, by_v, by_rate = 0.0, 0.0, 0.0
        pressed = max(delta[k], 0.0)
        root = sqrt(pressed)
        power = root
        if exponent != 1.5:
            power = pressed ** (exponent - 1.0)
        steep = factor[k] * numbers[TABLE_FORCE] * power
        N[k] = steep * delta[k] * share
        slope[k] = steep * (exponent * share + scale * root * by_v)
        viscous[k] = steep * delta[k] * by_rate
