"""A law of one's own as a table for the general march: N = δ^e·s(v, δ'), v = sqrt(δ/δ_most), s in cells."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from wheeltapper.describe.contact.law import Law
from wheeltapper.ground.errors import InputError
from wheeltapper.march.general import contract as general
from wheeltapper.march.general.laws import switch

FloatArray = NDArray[np.float64]
FASTEST = 5.0
"""Largest rate of the indentation that a table knows, m/s."""
CELLS, BANDS = (1, 2, 4, 8, 16, 32, 64, 128), (1, 2, 4, 8, 16, 32)
"""Numbers of cells in v and in the rate that are tried."""
TERMS, RATE_TERMS = 10, 6
"""Of a cell's polynomial, in v and in the rate."""
EXACT, USABLE = 1e-10, 1e-3
"""Error of a table over the function's size below which it is not refined, and beyond which it is refused."""
NEAR = 1e-6
"""Indentation over the largest at which the power of the force is checked."""
SLOPE = 0.05
"""Allowed difference of that power from the exponent."""


class LawTable(NamedTuple):
    """The table of a law.

    Attributes
    ----------
    cells
        Coefficients, (bands·cells, terms·rate terms), as `march/general/laws/tabulated.py` takes them.
    shape
        Cells and terms in v, lowest rate and width of a band, bands and terms in the rate.
    error
        Largest difference from the function between the samples, over the largest force of that rate.
    constant
        N/δ^e as δ goes to zero at rest, N/m^e.
    """

    cells: FloatArray
    shape: tuple[int, int, float, float, int, int]
    error: float
    constant: float


def tabulated_law(law: Law, rails: float = 1.0) -> tuple[general.Law, LawTable]:
    """Return one rail's part of a law for the general march, and the table of the whole."""
    table = law_table(law)
    numbers = [law.exponent, law.largest, *table.shape[:2], 0.0, 0.0, *table.shape[2:]]
    return general.Law(switch.TABULATED, np.array(numbers), table.cells / rails), table


@lru_cache(maxsize=16)
def law_table(law: Law) -> LawTable:
    """Return the coarsest table that is exact, or the finest one that is tried.

    Raises
    ------
    InputError
        If the force does not grow as δ^exponent near zero, or no table comes near it.
    """
    _check_exponent(law)
    bands, terms = (BANDS, RATE_TERMS) if law.takes_rate else ((1,), 1)
    best: LawTable | None = None
    for count in zip(CELLS, (*bands, *[bands[-1]] * len(CELLS)), strict=False):
        found = _fitted(law, *count, terms)
        best = found if best is None or found.error < best.error else best
        if best.error <= EXACT:
            break
    assert best is not None
    if best.error > USABLE:
        found_text = f"a function that its table misses by {best.error:.2g} of the force"
        raise InputError("contact", "force", found_text, "one that is smooth between 0 and `largest`")
    return best


def _check_exponent(law: Law) -> None:
    delta = law.largest * NEAR * np.array([1.0, 2.0])
    low, high = law.values(delta, np.zeros(2))
    power = np.log2(high / low) if low > 0.0 and high > 0.0 else np.nan
    if not abs(power - law.exponent) <= SLOPE:
        raise InputError(
            "contact", "exponent", f"{law.exponent:g} for a force that grows as the power {power:.4g} near zero",
            "that power",
        )  # fmt: skip


def _fitted(law: Law, cells: int, bands: int, terms: int) -> LawTable:
    """Return a table with some cells and bands."""
    slowest, width = (-FASTEST, 2.0 * FASTEST / bands) if terms > 1 else (0.0, 1.0)
    inner, across = (0.5 + 0.5 * chebyshev.chebpts1(n) for n in (TERMS, terms))
    check, beside = (0.5 + 0.5 * chebyshev.chebpts1(n) for n in (TERMS + 3, terms + 3 if terms > 1 else 1))
    to_powers = np.linalg.inv(inner[:, None] ** np.arange(TERMS))
    rate_powers = np.linalg.inv(across[:, None] ** np.arange(terms))
    rows, error = [], 0.0
    for band in range(bands):
        for cell in range(cells):
            values = _shares(law, (cell + inner) / cells, slowest + width * (band + across))
            rows.append(to_powers @ values @ rate_powers.T)
            exact = _shares(law, (cell + check) / cells, slowest + width * (band + beside))
            found = check[:, None] ** np.arange(TERMS) @ rows[-1] @ (beside[:, None] ** np.arange(terms)).T
            error = max(error, float(np.abs(found - exact).max() / np.abs(exact).max()))
    at_rest = rows[(bands // 2) * cells][0] if terms > 1 else rows[0][0]
    centre = (0.0 - slowest) / width - bands // 2 if terms > 1 else 0.0
    constant = float(at_rest @ centre ** np.arange(terms))
    shape = cells, TERMS, slowest, width, bands, terms
    return LawTable(np.array([row.ravel() for row in rows]), shape, error, constant)


def _shares(law: Law, v: FloatArray, rate: FloatArray) -> FloatArray:
    """Return N/δ^e, (v, rate)."""
    delta, rates = np.meshgrid(law.largest * v**2, rate, indexing="ij")
    return np.asarray(law.values(delta, rates) / delta**law.exponent)
