"""Results for an elastic-plastic contact: residual indentation, stored energy, notes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower.build import Lowered
from wheeltapper.lower.plastic import left_after, loading_force, stored_below
from wheeltapper.march import program as contract

if TYPE_CHECKING:
    from wheeltapper.march.single import March

FloatArray = NDArray[np.float64]


def permanent_indentation(lowered: Lowered, rows: FloatArray) -> FloatArray:
    """Return the residual indentation after unloading, m, from rows of the dense output."""
    from wheeltapper.march import dense

    depth = np.maximum(rows[:, dense.OUT_DELTA], 0.0) + rows[:, dense.OUT_RESIDUAL]
    return np.maximum(left_after(lowered.program.law, depth), rows[:, dense.OUT_RESIDUAL]) * lowered.length


def stored_energy(lowered: Lowered, ends: FloatArray) -> FloatArray:
    """Return the energy (scaled) that a yielding contact returns on unloading, from rows of the dense output.

    For a spot with a memory this is the work of unloading. Over virgin rail unloading follows the loading curve, and
    all energy is returned.
    """
    from wheeltapper.march import dense

    program = lowered.program
    depth = ends[..., dense.OUT_DELTA] + ends[..., dense.OUT_RESIDUAL]
    if program.numbers[contract.MEMORY] == 0.0:
        return stored_below(program.law, depth)
    return np.asarray(0.4 * ends[..., dense.OUT_FORCE] * (depth - left_after(program.law, depth)))


def beyond_law(scenario: Scenario, lowered: Lowered, march: March) -> tuple[Note, ...]:
    """Return what the user should know of a march whose contact force goes beyond what the law was stated for."""
    return beyond_force(
        scenario.contact, lowered, float(march.peaks[:, contract.PEAK_FORCE].max(initial=0.0)) * lowered.force
    )


def beyond_force(contact: Any, lowered: Lowered, reached: float) -> tuple[Note, ...]:
    """Return the same of the largest force, N; nothing where the contact is elastic."""
    law = lowered.program.law
    if not len(law):
        return ()
    bound = np.asarray(contact.limit * law[0, contract.LAW_START])
    allowed = float(loading_force(law, bound)) * lowered.force
    if reached <= allowed:
        return ()
    text = (
        f"the contact force reaches {reached / 1e3:.4g} kN, but {type(contact).__name__} holds up to "
        f"{contact.limit:g} times the indentation at yield, {allowed / 1e3:.4g} kN"
    )
    return (Note(text, "beyond the law", reached / allowed, doubtful=True),)
