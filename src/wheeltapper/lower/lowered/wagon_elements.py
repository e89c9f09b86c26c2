"""Events of what is not linear between the bodies of a wagon: of dry friction, and of springs that only press."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.lowered.base import NO_ELEMENTS, ElementEvents
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import TO_RATE

if TYPE_CHECKING:
    from wheeltapper.lower.lowered.wagon import LoweredWagon
    from wheeltapper.march.wagon.march import Marched

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
STICK, SLIP, LEAVE, MEET, WITHIN, BEYOND = range(6)
"""Numbers of the kinds: the order is that of `record.elements.ELEMENT_KINDS`."""


def element_events(lowered: LoweredWagon, march: Marched) -> ElementEvents:
    """Return where friction sticks and slides, and leaves and meets what presses it; and changes of springs that press.

    These leave and meet, and go beyond the corners of their characteristics and back. Extension is where the first end
    goes forth on the element's direction.
    """
    both = [*_of_springs(lowered, march), *_of_sliders(lowered, march)]
    if not both:
        return NO_ELEMENTS
    joined = [np.concatenate(columns) for columns in zip(*both, strict=True)]
    order = np.argsort(joined[0], kind="stable")
    return ElementEvents(*(column[order] for column in joined))


class _Changes(NamedTuple):
    """Changes of pieces: at which steps, of which elements, and the pieces before and after."""

    step: IntArray
    which: IntArray
    before: FloatArray
    after: FloatArray

    def told(
        self, lowered: LoweredWagon, march: Marched, items: Sequence[Any], kind: IntArray, side: NDArray[Any]
    ) -> ElementEvents:
        """Return them as events of elements."""
        places = lowered.layout.displacement_places[: len(lowered.structure.motions)] + TO_RATE
        names, rows = np.array([item.name for item in items]), np.array([item.row for item in items])
        rate = -(march.states[:, places][self.step] * rows[self.which]).sum(axis=1)
        times = march.steps[self.step, asm.STEP_TIME]
        return ElementEvents(times, names[self.which], kind, side.astype(np.int64), rate)


def _changes(first: FloatArray, pieces: FloatArray) -> _Changes:
    """Return the changes of pieces from step to step, (steps, elements), which begin with the first ones."""
    pieces = np.vstack([first, pieces])
    step, which = np.nonzero(pieces[1:] != pieces[:-1])
    return _Changes(step, which, pieces[step, which], pieces[step + 1, which])


def _of_springs(lowered: LoweredWagon, march: Marched) -> list[ElementEvents]:
    """Return the events of springs that only press, if there are any."""
    numbers = [number for number, law in enumerate(lowered.structure.characteristics) if law.one_way]
    if not numbers:
        return []
    laws = [lowered.structure.characteristics[number] for number in numbers]
    pieces = march.steps[:, [asm.STEP_ELEMENTS + number for number in numbers]]
    found = _changes(pieces[0], pieces)
    free = np.array([len(law.force) - 1.0 for law in laws])[found.which]
    kind = np.where(found.after > found.before, WITHIN, BEYOND)
    kind = np.where(found.before == free, MEET, np.where(found.after == free, LEAVE, kind))
    return [found.told(lowered, march, laws, kind, np.ones(len(kind)))]


def _of_sliders(lowered: LoweredWagon, march: Marched) -> list[ElementEvents]:
    """Return the events of dry friction, if there is any."""
    sliders, end = lowered.structure.sliders, asm.STEP_ELEMENTS + len(lowered.assembly.element_inside)
    if not sliders:
        return []
    pieces = march.steps[:, end - len(sliders) : end].copy()
    pieces[(pieces > asm.FORTH) & (pieces != asm.PARTED)] = asm.STICKS
    found = _changes(np.where(pieces[0] == asm.PARTED, asm.PARTED, float(asm.STICKS)), pieces)
    before, after = found.before, found.after
    kind = np.where(after == asm.STICKS, STICK, SLIP)
    kind = np.where(before == asm.PARTED, MEET, np.where(after == asm.PARTED, LEAVE, kind))
    slides = np.where((after == asm.STICKS) | (after == asm.PARTED), before, after)
    return [found.told(lowered, march, sliders, kind, slides == asm.BACK)]
