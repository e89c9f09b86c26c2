"""What is not linear in suspensions, in the general march: its events, forces, states and energies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.lowered.base import ElementEvents, Variables
from wheeltapper.march.common import program as contract
from wheeltapper.march.general.replay import Replayed
from wheeltapper.march.general.task import Marched

if TYPE_CHECKING:
    from wheeltapper.lower.lowered.plane import LoweredPlane

FloatArray = NDArray[np.float64]


def element_events(lowered: LoweredPlane, march: Marched) -> ElementEvents:
    """Return all elements' events."""
    rows, elements = march.seat_events, lowered.plane.elements
    number = rows[:, contract.EVENT_CONTACT].astype(np.int64) - (lowered.first_element - len(lowered.plane.wheelsets))
    rows, number = rows[number >= 0], number[number >= 0]
    outwards = rows[:, contract.EVENT_KIND] == contract.IMPACT
    rate = rows[:, contract.EVENT_RATE]
    kind, side = np.zeros((2, len(rows)), dtype=np.int64)
    for i, element in enumerate(elements):
        mine = number == i
        family = 0 if element.slider[0] else 1 if element.is_bumpstop else 2
        kind[mine] = 2 * family + outwards[mine]
        side[mine] = (rate[mine] > 0.0) == (outwards[mine] | element.by_rate)
        if element.slider[0]:  # it sticks where it has slipped; the rate is zero there
            slips = np.maximum.accumulate(np.where(outwards[mine], np.arange(mine.sum()), 0))
            side[mine] = side[mine][slips]
    names = np.array([element.name for element in elements])
    return ElementEvents(
        rows[:, contract.EVENT_TIME], names[number] if len(number) else number.astype(str), kind, side, rate
    )


def element_motion(lowered: LoweredPlane, found: Replayed) -> Variables:
    """Return forces, N, compressions, m, and slips, m, of all elements, (times, elements) each; {} without elements."""
    elements, first = lowered.plane.elements, lowered.first_element
    if not elements:
        return {}
    along = ("time", "element")
    compression = found.indentation[:, first:].copy()
    force, slip = found.force[:, first:] * lowered.force, np.zeros(compression.shape)
    shapes = lowered.program.system.bodies.shapes[:, first:]
    for i, element in enumerate(elements):
        if element.slider[0]:
            slip[:, i] = compression[:, i] - force[:, i] / element.slider[1]
        stiffness, damping = element.linear
        force[:, i] += stiffness * compression[:, i] + damping * (found.velocity @ shapes[:, i])
    out: Variables = {
        "element": (("element",), np.array([element.name for element in elements])),
        "element_force": (along, force), "element_compression": (along, compression),
    }  # fmt: skip
    return out | ({"element_slip": (along, slip)} if any(element.slider[0] for element in elements) else {})


def element_energies(lowered: LoweredPlane, march: Marched, taken: FloatArray) -> tuple[float, float, float]:
    """Return what elements store, and what their dampers and their dry friction dissipate, J, of one rail.

    It is what they do beyond the matrices; `taken` is what each contact took from the bodies.
    """
    elements, first = lowered.plane.elements, lowered.first_element
    springs = dampers = friction = 0.0
    ends = march.at(np.array([march.end])).force[0, first:] if elements else ()
    for element, work, force in zip(elements, taken[first:].tolist(), ends, strict=True):
        if element.slider[0]:
            stored = 0.5 * float(force) ** 2 * lowered.force / element.slider[1]
            springs, friction = springs + stored, friction + work - stored
        elif element.by_rate:
            dampers += work
        else:
            springs += work
    return springs, dampers, friction
