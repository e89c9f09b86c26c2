"""A law of one's own as a table: N = δ^e·s(v, δ'), v = sqrt(δ/δ_most), s in cells."""

from __future__ import annotations

from functools import lru_cache
from math import log2
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.march.general import contract as general
from wheeltapper.march.general.laws import switch, tabulated
from wheeltapper.march.wagon.contact_laws import OWN_RULE

FloatArray = NDArray[np.float64]
FASTEST, RATES = 5.0, (-5.0, 7.5)
"""Largest rate of the indentation up to which a table is said to hold, and the rates between which its cells lie, m/s.
However often they are halved, no border of theirs comes nearer to rest, 2/5 of the way, than a fifth of a cell. At rest
the rate is zero but for rounding, and would cross a border there again and again."""
TERMS, SEVERAL = (1, 2, 3, 5, 7, 10), 6
"""Of a cell's polynomial, in v or in the rate: numbers that are tried, fewest first, and that with several cells, of
which each evaluation reads one."""
MOST_ALONG, MOST_CELLS = 256, 2048
"""Most cells in v or in the rate, and of a table."""
CHECKS = TERMS[-1] + 3
"""Places along a cell at which its polynomial is compared with the function."""
SLICES = 7
"""Values of one variable at which the table's cells in the other one are chosen."""
EXACT, USABLE = 1e-10, 1e-3
"""Error of a table over the function's size below which it is not refined, and beyond which it is refused."""
NEAR = 1e-6
"""Indentation over the largest at which the power of the force is checked."""
SLOPE = 0.05
"""Allowed difference of that power from the exponent."""
DOUBTFUL_TABLE = 1e-5
"""Error of a table over the function's size from which on a run is doubtful."""
LEAST_DEPTH = 1e-9
"""Smallest indentation, m, at which a wheel is looked for."""
WHEELS = 2.0
"""Of a wheelset, whose force the function is."""
ASIDE = 1e-3
"""Rate at which the damping of a law at rest is found, m/s."""


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


def tabulated_law(law: ForceLaw, rails: float = 1.0) -> tuple[general.Law, LawTable]:
    """Return one rail's part of a law for the general march, and the table of the whole."""
    table = law_table(law)
    numbers = [law.exponent, law.largest, *table.shape[:2], 0.0, 0.0, *table.shape[2:]]
    return general.Law(switch.TABULATED, np.array(numbers), table.cells / rails), table


def table_note(error: float) -> Note:
    """Return what the user should know of a table with an error over the function's size."""
    text = f"the table of the contact's law differs from the function by at most {error:.2g} of its force"
    return Note(text, "own law", error, doubtful=error > DOUBTFUL_TABLE)


def flat_law(law: ForceLaw) -> tuple[FloatArray, LawTable]:
    """Return the rows of one wheel's part of a law, as the wagon's march takes them, and the table of the whole.

    The first row holds the numbers. The others are the cells, with the work of indenting up to each of them in the last
    column, J.
    """
    made, table = tabulated_law(law, WHEELS)
    width = max(made.table.shape[1], tabulated.TABLE_RATE_TERMS) + 1
    rows = np.zeros((1 + len(made.table), width))
    rows[0, 1 : 1 + len(made.numbers)] = made.numbers
    rows[1:, : made.table.shape[1]] = made.table
    rows[1:, -1] = np.tile(_work_before(law, made.table, table.shape), table.shape[4])
    return rows, table


def _work_before(law: ForceLaw, cells: FloatArray, shape: tuple[int, int, float, float, int, int]) -> FloatArray:
    """Return the work of indenting up to each cell in v at rest, J."""
    many, terms, slowest, width, bands, rate_terms = shape
    band, rho = _at_rest(slowest, width)
    at_rest = cells.reshape(bands, many, terms, rate_terms)[band] @ rho ** np.arange(rate_terms)
    place, weight = np.array(OWN_RULE).T
    v = (np.arange(many)[:, None] + place) / many
    share = np.maximum(at_rest @ _powers(2.0 * place - 1.0, terms).T, 0.0)
    work = (weight * 2.0 * v * law.largest * (law.largest * v**2) ** law.exponent * share).sum(axis=1) / many
    return np.concatenate([[0.0], np.cumsum(work)[:-1]])


def _at_rest(slowest: float, width: float) -> tuple[int, float]:
    """Return the band in which the rate is zero, and where in it, from -1 to 1."""
    band = int(-slowest / width)
    return band, 2.0 * (-slowest / width - band) - 1.0


def indentation_under(law: ForceLaw, force: float) -> float:
    """Return the smallest indentation at which the law of a wheelset bears a force, N, at rest, m."""
    from scipy.optimize import brentq

    depths = np.geomspace(LEAST_DEPTH, law.largest, 400)
    borne = np.flatnonzero(law.values(depths, np.zeros(len(depths))) >= force)
    if len(borne) == 0:  # its table goes on with the power
        return float(law.largest * (force / law.values(depths[-1:], np.zeros(1))[0]) ** (1.0 / law.exponent))
    if borne[0] == 0:
        return LEAST_DEPTH
    ends = float(depths[borne[0] - 1]), float(depths[borne[0]])
    return float(brentq(lambda depth: float(law.values(np.array([depth]), np.zeros(1))[0]) - force, *ends))


def loss_at(law: ForceLaw, depth: float) -> float:
    """Return by how much of the force at rest the force changes with a rate of the indentation, s/m; its size."""
    slow, rest, fast = law.values(np.full(3, depth), ASIDE * np.array([-1.0, 0.0, 1.0]))
    return float(abs(fast - slow) / (2.0 * ASIDE * max(rest, fast, slow)))


@lru_cache(maxsize=16)
def law_table(law: ForceLaw) -> LawTable:
    """Return the coarsest table that is exact, or the finest one that is tried.

    Raises
    ------
    InputError
        If the force does not grow as δ^exponent near zero, or no table comes near it.
    """
    _check_exponent(law)
    cells, terms = _along(law, False)
    bands, rate_terms = _along(law, True) if law.takes_rate else (1, 1)
    best: LawTable | None = None
    while True:
        found = _fitted(law, cells, bands, terms, rate_terms)
        best = found if best is None or found.error < best.error else best
        if best.error <= EXACT or 4 * cells * bands > MOST_CELLS:
            break
        cells, bands = 2 * cells, 2 * bands if law.takes_rate else 1
    if best.error > USABLE:
        found_text = f"a function that its table misses by {best.error:.2g} of the force"
        at_rates = ", at every rate" if law.takes_rate else ""
        allowed = f"one of which N/δ^{law.exponent:g} (`exponent`) is smooth from 0 to `largest`{at_rates}"
        raise InputError("contact", "force", found_text, allowed)
    return best


def _check_exponent(law: ForceLaw) -> None:
    delta = law.largest * NEAR * np.array([1.0, 2.0])
    low, high = law.values(delta, np.zeros(2))
    power = np.log2(high / low) if low > 0.0 and high > 0.0 else np.nan
    if not abs(power - law.exponent) <= SLOPE:
        raise InputError(
            "contact", "exponent", f"{law.exponent:g} for a force that grows as the power {power:.4g} near zero",
            "that power",
        )  # fmt: skip


def _along(law: ForceLaw, by_rate: bool) -> tuple[int, int]:
    """Return the fewest cells and terms in v, or in the rate, that are exact at some values of the other variable."""
    across, check = 0.5 + 0.5 * chebyshev.chebpts1(SLICES), chebyshev.chebpts1(CHECKS)
    cells, terms = 1, 1
    for cells, terms in [(1, one) for one in TERMS] + [(2**k, SEVERAL) for k in range(1, int(log2(MOST_ALONG)) + 1)]:
        inner, error = chebyshev.chebpts1(terms), 0.0
        for cell in range(cells):
            values, exact = (
                _slices(law, (cell + 0.5 + 0.5 * places) / cells, across, by_rate) for places in (inner, check)
            )
            found = _powers(check, terms) @ np.linalg.solve(_powers(inner, terms), values)
            error = max(error, float(np.abs(found - exact).max() / np.abs(exact).max()))
        if error <= EXACT:
            break
    return cells, terms


def _powers(places: FloatArray, terms: int) -> FloatArray:
    return np.asarray(places[:, None] ** np.arange(terms))


def _slices(law: ForceLaw, along: FloatArray, across: FloatArray, by_rate: bool) -> FloatArray:
    """Return N/δ^e at parts of the table's extent in v, or in the rate, and parts of the other one's."""
    v, rate = (across, along) if by_rate else (along, across)
    shares = _shares(law, v, RATES[0] + (RATES[1] - RATES[0]) * rate if law.takes_rate else np.zeros(1))
    return shares.T if by_rate else shares


def _fitted(law: ForceLaw, cells: int, bands: int, terms: int, rate_terms: int) -> LawTable:
    """Return a table with some cells and bands, and polynomials of some terms."""
    slowest, width = (RATES[0], (RATES[1] - RATES[0]) / bands) if law.takes_rate else (0.0, 1.0)
    inner, across = (chebyshev.chebpts1(n) for n in (terms, rate_terms))
    check, beside = (chebyshev.chebpts1(n) for n in (CHECKS, CHECKS if law.takes_rate else 1))
    to_powers, rate_powers = (np.linalg.inv(_powers(one, len(one))) for one in (inner, across))
    rows, error = [], 0.0
    for band in range(bands):
        for cell in range(cells):
            values, exact = (
                _shares(law, (cell + 0.5 + 0.5 * v) / cells, slowest + width * (band + 0.5 + 0.5 * rate))
                for v, rate in ((inner, across), (check, beside))
            )
            rows.append(to_powers @ values @ rate_powers.T)
            found = _powers(check, terms) @ rows[-1] @ _powers(beside, rate_terms).T
            error = max(error, float(np.abs(found - exact).max() / np.abs(exact).max()))
    band, rho = _at_rest(slowest, width)
    constant = float(_powers(-np.ones(1), terms)[0] @ rows[band * cells] @ rho ** np.arange(rate_terms))
    shape = cells, terms, slowest, width, bands, rate_terms
    return LawTable(np.array([row.ravel() for row in rows]), shape, error, constant)


def _shares(law: ForceLaw, v: FloatArray, rate: FloatArray) -> FloatArray:
    """Return N/δ^e, (v, rate)."""
    delta, rates = np.meshgrid(law.largest * v**2, rate, indexing="ij")
    return np.asarray(law.values(delta, rates) / delta**law.exponent)
