"""The rate at which a small deviation of a motion grows over a periodic irregularity: the largest Lyapunov exponent."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.section import Section
from wheeltapper.march import run
from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]
BATCHES = 20
"""Parts of a motion, the scatter of which gives the standard error."""
SETTLING = 10
"""One wave of so many is marched before the growth is measured."""


class Growth(NamedTuple):
    """Exponents of cells, 1/s, and their standard errors, each (cells,)."""

    exponent: FloatArray
    error: FloatArray


def growth_of(scenario: Scenario, changed: dict[str, FloatArray], method: str, waves: int) -> Growth:
    """Return how fast small deviations grow in cells of a scenario, on the mean of some waves.

    NaN where there is no periodic irregularity, or no march with tangents that takes the scenario.
    """
    from wheeltapper.march.wheel.orbits import growths, sections

    count = max((len(values) for values in changed.values()), default=1)
    found = Growth(np.full(count, np.nan), np.full(count, np.nan))
    if run.fastest_march(run.ORBITS, scenario.needs) is None:
        return found
    try:
        section = Section(scenario, method)
    except InputError:  # nothing repeats
        return found
    cells, _, period = section.cells(changed)
    if np.isfinite(cells.numbers[0, contract.DECK_FROM]) and cells.numbers[0, contract.DECK_MASS] > 0.0:
        return found
    for cell in range(count):
        one, state = cells.part(slice(cell, cell + 1)), np.zeros((1, 4))
        state[0, :2] = one.numbers[0, [contract.START_HEIGHT, contract.START_VELOCITY]]
        sections(one, state, waves // SETTLING, 0)
        change = np.array([1.0, 1.0, 0.0, 0.0])
        program = section.cells({path: values[[cell]] for path, values in changed.items()}).program(0)
        rates = growths(program, state[0], change, waves) / period[cell]
        means = np.array([part.mean() for part in np.array_split(rates, BATCHES)])
        found.exponent[cell] = rates.mean()
        found.error[cell] = means.std(ddof=1) / np.sqrt(BATCHES)
    return found
