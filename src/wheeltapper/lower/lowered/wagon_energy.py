"""The energy balance of a wagon's run.

Change of (kinetic + elastic) = works of the loads, of the irregularity, of the changing shape of the contacts and of
the drive, less the energy that dampers, the contacts' friction and dry friction in elements dissipate. The elastic
energy of a contact is 0.4·N·δ, 0.5·N·δ of a linear one; one that yields goes back along its loading curve while it
rolls, and stores the work of it. What a contact with hysteresis takes beyond that is dissipated, also where it recovers
without a force. If its constant changes because the wheel shifts or the curvature of the rail varies, or what earlier
wheels have left changes along the rail, the shape of the contact does work. The
drive keeps the speed constant; it does the work of the creep forces that the slip does not dissipate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.lowered.balanced import NOTABLE
from wheeltapper.lower.lowered.base import DECK, Terms
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import TO_RATE

if TYPE_CHECKING:
    from wheeltapper.lower.lowered.wagon import LoweredWagon
    from wheeltapper.march.wagon.march import Marched as MarchedWagon

FloatArray = NDArray[np.float64]
SIGNS = np.array([1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0])
"""Sign with which each work of `march.replay` (load, path, shape, damper, friction, drive, stand-in, rails, sliders,
material, a deck's bearing) enters the change of energy."""
EVERY = 16
"""At the end of each run one step in this many is checked. A check repeats the step, which costs more than its march
did."""


def missing_part(lowered: LoweredWagon, march: MarchedWagon) -> float:
    """Return the missing share of the exchanged energy: from one step in EVERY, or where that is NOTABLE from all."""
    if len(march.steps) == 0:
        return 0.0
    estimate = _missing_in(lowered, march, EVERY)
    return _missing_in(lowered, march, 1) if not estimate < NOTABLE else estimate


def _missing_in(lowered: LoweredWagon, march: MarchedWagon, every: int) -> float:
    """Return the missing share of the exchanged energy, from one step in so many."""
    sample = march._replace(steps=march.steps[::every], states=march.states[::every])
    done, _, contacts, elements = works(lowered, sample)
    elastic = contacts + elements
    states = np.vstack([march.states[1::every], march.state])[: len(sample.states)]
    kinetic, springs = _stored_energies(lowered, sample.states)
    kinetic_after, springs_after = _stored_energies(lowered, states)
    change = kinetic_after - kinetic + springs_after - springs + elastic[:, 1] - elastic[:, 0]
    missing = float(np.abs(np.cumsum(change - done @ SIGNS)).max())
    exchanged = float(kinetic.max() + elastic.max() + every * np.abs(done).sum())
    return every * missing / exchanged


def works(lowered: LoweredWagon, march: MarchedWagon) -> tuple[FloatArray, ...]:
    """Return works (steps, POWERS_KEPT), impulses (steps, lanes) and elastic energies (steps, 2) of some steps.

    These are those of contacts, and of nonlinear elements.
    """
    structure, layout = lowered.structure, lowered.layout
    count = len(layout.motions)
    damping = np.zeros((count, count))
    damping[: len(structure.motions), : len(structure.motions)] = structure.damping
    if DECK in layout.bodies:
        damping[-1, -1] = lowered.scenario.track.damping
    return march.works(damping, layout.displacement_places)


def _stored_energies(lowered: LoweredWagon, states: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return kinetic energy and that of the linear springs, the deck's included, in some states."""
    mass, stiffness = lowered.structure.mass, lowered.structure.stiffness
    if DECK in lowered.layout.bodies:
        mass = np.append(mass, lowered.scenario.track.mass)
        stiffness = np.pad(stiffness, (0, 1))
        stiffness[-1, -1] = lowered.scenario.track.stiffness
    q, v = states[:, lowered.layout.displacement_places], states[:, lowered.layout.displacement_places + TO_RATE]
    return 0.5 * (v**2) @ mass, 0.5 * np.einsum("ti,ij,tj->t", q, stiffness, q)


def _energy_of_slips(lowered: LoweredWagon, march: MarchedWagon) -> float:
    """Return the energy that springs of friction lose where their force falls as it begins to slide, J."""
    A = lowered.assembly
    springs = len(A.sliders) - len(A.yields)
    pieces = march.steps[:, asm.STEP_ELEMENTS + len(A.element_inside) - len(A.sliders) :][:, :springs]
    step, which = np.nonzero((pieces[:-1] == asm.STICKS) & (pieces[1:] <= asm.FORTH) & (pieces[1:] != asm.STICKS))
    stiffness, total = A.sliders[:springs, asm.SLIDER_STIFFNESS], 0.0
    q = march.states[:, lowered.layout.displacement_places[: len(lowered.structure.motions)]]
    for now, number in zip(step + 1, which, strict=True):
        side = pieces[now, number] - asm.STICKS
        force, limit = lowered.structure.bounds_of(lowered.structure.sliders[number], side, q[now])
        total += 0.5 * (limit**2 - force**2) / stiffness[number]
    return float(total)


def _changes_stretch(lowered: LoweredWagon, march: MarchedWagon) -> NDArray[np.bool_]:
    """Return whether any tread begins or ends to yield between each step and the next one.

    There the energy of a contact over marks jumps by what these have done to it before (`march.contact_laws`).
    """
    columns = march.steps.shape[1] - lowered.assembly.stretch_columns
    stretches = march.steps[:, columns:]
    return np.asarray((stretches[1:] != stretches[:-1]).any(axis=1))


def balance(lowered: LoweredWagon, march: MarchedWagon, works: tuple[FloatArray, ...]) -> Terms:
    """Return the energy balance over the whole run."""
    from wheeltapper.march.wagon import replay

    done, _, contacts, elements = works
    kinetic, springs = _stored_energies(lowered, np.vstack([march.states, march.state]))
    in_contacts = contacts[-1, 1] - contacts[0, 0]
    elastic = contacts + elements
    jumped = elastic[1:, 0] - elastic[:-1, 1]
    yielded = _changes_stretch(lowered, march)
    total, slipped = done.sum(axis=0), _energy_of_slips(lowered, march)
    terms = {
        "kinetic": kinetic[-1] - kinetic[0],
        "elastic": springs[-1] - springs[0] + elastic[-1, 1] - elastic[0, 0],
        "elastic_contact": in_contacts,
        "dissipated_suspension": total[replay.DAMPER_POWER],
        "dissipated_friction": total[replay.SLIDER_POWER] + slipped,
        "dissipated_deck": total[replay.BEARING_POWER],
        "dissipated_contact": total[replay.MATERIAL_POWER],
        "dissipated_creep": total[replay.FRICTION_POWER],
        "work_of_load": total[replay.LOAD_POWER] + total[replay.STAND_IN_POWER],
        "work_of_irregularity": total[replay.PATH_POWER] + float(jumped[~yielded].sum()) + slipped,
        "work_of_shape": total[replay.SHAPE_POWER] + float(jumped[yielded].sum()),
        "work_of_drive": total[replay.DRIVE_POWER],
    }
    if lowered.below is not None:
        terms["into_track"] = total[replay.RAIL_POWER]
    return Terms(terms, float(kinetic.max() + elastic.max() + np.abs(done).sum()))
