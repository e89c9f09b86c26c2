"""A law from a table: N = δ^e·s(v, δ'), v = sqrt(δ/δ_most), s in pieces of polynomials.

A row of the table is one cell in v and in the rate: Σ_ij row[i·(RATE_TERMS) + j]·ξ^i·ρ^j, ξ and ρ from 0 to 1 over the
cell. The cells are equal in v and in the rate, those of one rate behind each other. A force of the indentation alone
has one cell in the rate, and terms with j = 0 only. Beyond δ_most, and beyond the rates of the table, s stays what
it is there.
"""

from __future__ import annotations

from math import sqrt

from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray

(
    TABLE_EXPONENT, TABLE_LARGEST, TABLE_CELLS, TABLE_V_TERMS, TABLE_FIRST, TABLE_FORCE, TABLE_SLOWEST, TABLE_WIDTH,
    TABLE_RATES, TABLE_RATE_TERMS,
) = range(1, 11)  # fmt: skip
"""Columns: e, δ_most, cells in v, terms in v, first row, unit of the force, lowest rate, width of a cell in the rate,
cells in the rate, terms in the rate."""


@kernel
def tabulated_share(delta: float, rate: float, numbers: FloatArray, table: FloatArray) -> tuple[float, float, float]:
    """Return s of an indentation and its rate, and its derivatives by v and by the rate."""
    v = sqrt(max(delta, 0.0) / numbers[TABLE_LARGEST])
    beyond = v > 1.0
    v = min(v, 1.0)
    cells = numbers[TABLE_CELLS]
    cell = min(int(v * cells), int(cells) - 1)
    xi = v * cells - cell
    rates = int(numbers[TABLE_RATES])
    along = (rate - numbers[TABLE_SLOWEST]) / numbers[TABLE_WIDTH]
    outside = along < 0.0 or along > rates
    along = min(max(along, 0.0), float(rates))
    band = min(int(along), rates - 1)
    rho = along - band
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
    return share, 0.0 if beyond else cells * by_v, 0.0 if outside else by_rate / numbers[TABLE_WIDTH]


@kernel
def tabulated_force(delta: float, rate: float, numbers: FloatArray, table: FloatArray) -> tuple[float, float, float]:
    """Return the force of an indentation and its rate, and its derivatives by both.

    It is negative where a law that depends on the rate would pull; one that does not never is.
    """
    if delta <= 0.0:
        return 0.0, 0.0, 0.0
    share, by_v, by_rate = tabulated_share(delta, rate, numbers, table)
    if share <= 0.0 and numbers[TABLE_RATE_TERMS] <= 1.0 and numbers[TABLE_RATES] <= 1.0:
        return 0.0, 0.0, 0.0
    exponent = numbers[TABLE_EXPONENT]
    power = delta * sqrt(delta)
    if exponent != 1.5:
        power = delta**exponent
    force = numbers[TABLE_FORCE] * power
    v = min(sqrt(delta / numbers[TABLE_LARGEST]), 1.0)
    return force * share, force / delta * (exponent * share + 0.5 * v * by_v), force * by_rate
