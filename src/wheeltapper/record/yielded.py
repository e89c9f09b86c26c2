"""Results for an elastic-plastic contact: residual indentation, stored energy, notes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower.build import Lowered
from wheeltapper.lower.laws.plastic import left_after, loading_force, stored_below
from wheeltapper.lower.marks.wagon_marks import onset_of
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.law_columns import PLASTIC_ONSET
from wheeltapper.march.general.contract import Contact, Law
from wheeltapper.march.wagon import assembly as asm

if TYPE_CHECKING:
    from wheeltapper.lower.on_rails import LoweredOnRails
    from wheeltapper.lower.wagon import LoweredWagon
    from wheeltapper.march.general.task import Marched
    from wheeltapper.march.wagon.assembly import Assembly
    from wheeltapper.march.wagon.march import Marched as MarchedWagon
    from wheeltapper.march.wheel.march import Marched as MarchedWheel

FloatArray = NDArray[np.float64]


def permanent_indentation(lowered: Lowered, rows: FloatArray) -> FloatArray:
    """Return the residual indentation after unloading, m, from rows of the dense output."""
    from wheeltapper.march.wheel import dense

    depth = np.maximum(rows[:, dense.OUT_DELTA], 0.0) + rows[:, dense.OUT_RESIDUAL]
    return np.maximum(left_after(lowered.program.law, depth), rows[:, dense.OUT_RESIDUAL]) * lowered.length


def stored_energy(lowered: Lowered, ends: FloatArray) -> FloatArray:
    """Return the energy (scaled) that a yielding contact returns on unloading, from rows of the dense output.

    For a spot with a memory this is the work of unloading. Over virgin rail unloading follows the loading curve, and
    all energy is returned.
    """
    from wheeltapper.march.wheel import dense

    program = lowered.program
    depth = ends[..., dense.OUT_DELTA] + ends[..., dense.OUT_RESIDUAL]
    if program.numbers[contract.MEMORY] == 0.0:
        return stored_below(program.law, depth)
    return np.asarray(0.4 * ends[..., dense.OUT_FORCE] * (depth - left_after(program.law, depth)))


def permanent_on_rails(contact: Contact, delta: FloatArray, x: FloatArray) -> FloatArray:
    """Return the residual indentation after unloading, m, of a contact of the general march; x in its path's table."""
    from wheeltapper.march.general.replay import surface_along

    onset, (before, _) = float(contact.law.numbers[PLASTIC_ONSET - 1]), surface_along(contact, x)
    depth = np.maximum(delta, 0.0) + before
    return np.asarray(np.maximum(left_after(contact.law.table, depth / onset) * onset, before))


def beyond_law(scenario: Scenario, lowered: Lowered, march: MarchedWheel) -> tuple[Note, ...]:
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
    return _beyond(contact, float(loading_force(law, bound)) * lowered.force, reached)


def beyond_law_on_rails(scenario: Scenario, lowered: LoweredOnRails, march: Marched) -> tuple[Note, ...]:
    """Return the same of a general march."""
    notes, forces = list[Note](), march.peaks[:, contract.PEAK_FORCE] * lowered.force
    for number, one in enumerate(lowered.program.system.wheels):
        own = forces[march.peaks[:, contract.PEAK_CONTACT] == number]
        notes += beyond_force_on_rails(scenario.contact, one.law, float(own.max(initial=0.0)), lowered.force)
    return tuple(notes[:1])


def permanent_of_wagon(assembly: Assembly, delta: FloatArray, left: FloatArray) -> FloatArray:
    """Return the residual indentation after unloading, m, of treads over what earlier wheels have left, m."""
    onset = onset_of(assembly)
    depth = np.maximum(delta, 0.0) + left
    return np.asarray(np.maximum(left_after(assembly.law, depth / onset) * onset, left))


def beyond_law_of_wagon(scenario: Scenario, lowered: LoweredWagon, march: MarchedWagon) -> tuple[Note, ...]:
    """Return the same of the march of a wagon; its forces are those of wheelsets, as if both wheels pressed alike."""
    treads = march.peaks[:, contract.PEAK_CONTACT] < lowered.assembly.numbers[asm.TREADS] * asm.LANES
    reached = 2.0 * float(march.peaks[treads, contract.PEAK_FORCE].max(initial=0.0))
    return beyond_force_of_wagon(scenario.contact, lowered, reached)


def beyond_force_of_wagon(contact: Any, lowered: LoweredWagon, reached: float) -> tuple[Note, ...]:
    """Return the same of the largest force of a wheelset, N."""
    bound = float(loading_force(lowered.assembly.law, np.asarray(contact.limit)))
    return _beyond(contact, 2.0 * bound * lowered.contact_constant * onset_of(lowered.assembly) ** 1.5, reached)


def beyond_force_on_rails(contact: Any, law: Law, reached: float, rails: float) -> tuple[Note, ...]:
    """Return the same of the largest force of a wheelset, N, on so many equal rails."""
    constant, onset, *_ = law.numbers
    bound = float(loading_force(law.table, np.asarray(contact.limit)))
    return _beyond(contact, bound * constant * onset**1.5 * rails, reached)


def _beyond(contact: Any, allowed: float, reached: float) -> tuple[Note, ...]:
    if reached <= allowed:
        return ()
    text = (
        f"the contact force reaches {reached / 1e3:.4g} kN, but {type(contact).__name__} holds up to "
        f"{contact.limit:g} times the indentation at yield, {allowed / 1e3:.4g} kN"
    )
    return (Note(text, "beyond the law", reached / allowed, doubtful=True),)
