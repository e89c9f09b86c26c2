"""The check at the end of every run: whether work and energy of wheel and deck balance.

Every step is checked from the states at its ends (march/wheel/balance.py). This costs a small part of the march. The
missing energy is divided by the exchanged energy: the largest kinetic energy, the largest work of the contact in one
step, the magnitudes of all works and losses, and the energy of the contact at rest.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground import progress
from wheeltapper.ground.notes import Note
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program

if TYPE_CHECKING:
    from wheeltapper.march.wheel.march import Marched as MarchedWheel

FloatArray = NDArray[np.float64]

LIMIT = 1e-5
"""Share of the exchanged energy that may be missing. If more is missing, a run means nothing, and its outcome says
so."""
NOTABLE = 1e-6
"""Share of the exchanged energy from which on a note reports what is missing."""
UNBALANCED = 100
"""Status of a march with more energy missing than LIMIT. Kernels never return it."""
AT_REST = 0.4
"""Elastic energy of the contact at rest, in units of the program, for Hertz's law; for a linear contact it is 0.5. It
is part of the energy with which what is missing is compared."""
CHUNK = 100_000
"""Number of steps that are checked between two reports of progress, about a hundredth of a second of work."""


def missing_part(march: MarchedWheel) -> float:
    """Return the largest missing share of the exchanged energy at any time of a march; NaN if it is undefined."""
    from wheeltapper.march.wheel import balance

    sums = np.zeros(balance.SUMS)
    for first in range(0, len(march.steps), CHUNK):
        progress.report("checking the energy", first, len(march.steps))
        march.add_balance(first, first + CHUNK, sums)
    exchanged = sums[balance.WORKED] + sums[balance.LARGEST_KINETIC] + sums[balance.LARGEST_ELASTIC] + AT_REST
    missing = sums[balance.LARGEST_MISSING] if np.isfinite(sums[balance.MISSING]) else np.nan
    return float(missing / exchanged)


def missing_parts(programs: Iterable[Program]) -> FloatArray:
    """Return the largest missing share for each of some programs, which are marched for it."""
    return np.array([missing_part(run.march(program)) for program in programs])


def judged_balance(status: int, missing: float) -> tuple[int, tuple[Note, ...]]:
    """Return the status of a finished march, and notes on its energy for the user."""
    if status != contract.DONE or missing <= NOTABLE:
        return status, ()
    text = (
        f"the energy balance of the run is wrong by {missing:.2g} of the energy exchanged (usual: below {NOTABLE:g}): "
        'its results are less accurate than usual; compare with method="strict"'
    )
    return (status if missing <= LIMIT else UNBALANCED), (Note(text, "imbalance", missing),)
