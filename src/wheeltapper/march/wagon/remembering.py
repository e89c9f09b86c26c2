"""Rails that remember what the wheels of a vehicle with many bodies have left on them, while its march is under way.

A march stops before any wheel comes to a place whose surface is not known yet. A memory reads how deep the wheels have
pressed from the accepted steps, and hands out new paths, which are the same so far. The march goes on over these.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import passing, searching
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import LANES, Assembly, FlatAssembly, with_paths
from wheeltapper.march.wagon.pressing import contact_forces
from wheeltapper.march.wagon.wheel_paths import set_piece

if TYPE_CHECKING:
    from wheeltapper.march.general.tables import Grid


class Paths(NamedTuple):
    """Lanes and pieces of an assembly: all paths."""

    lanes: FloatArray
    pieces: FloatArray


class WagonMarking(Protocol):
    """What the wheels of a vehicle leave on their way for others, while a march is under way."""

    def press(self, found: Any) -> None:
        """Take what the wheels have done up to the end of a march that goes on, over the paths of its assembly."""
        ...

    def paths(self) -> Paths:
        """Return the paths of all wheels as they are known now, up to the memory's `reach`."""
        ...


class WagonMemory(Protocol):
    """Two rails that remember."""

    @property
    def reach(self) -> float:
        """How far the wheels may roll before they must be told of new paths, m."""
        ...

    def begin(self) -> WagonMarking:
        """Return what a march begins with."""
        ...


class OverMarks(NamedTuple):
    """A vehicle that meets its own marks: what is marched, and what its rails remember."""

    program: Any
    memory: WagonMemory

    @property
    def assembly(self) -> Assembly:
        """The vehicle."""
        found: Assembly = getattr(self.program, "assembly", self.program)
        return found


@kernel
def change_paths(
    data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray, events: FloatArray, peaks: FloatArray,
    kept: FloatArray, S: FloatArray,
) -> None:  # fmt: skip
    """Go over to the paths that the data hold now, which are the same so far; what changes here is switched."""
    t = S[passing.RUN_TIME]
    searching.keep_contacts(wheels, kept)
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for column in PATH_COLUMNS:
            for i in range(LANES):
                L[column * LANES + i] = data[plan[asm.AT_LANES] + (o * asm.LANE_COLUMNS + column) * LANES + i]
        for i in range(LANES):
            L[wheel.ROW_PIECE + i] = L[asm.FIRST_PIECE * LANES + i]
            L[wheel.ROW_SHIFT + i] = 0.0
            set_piece(i, data, plan, L)
    passing.pass_breaks(t * (1.0 - passing.SAME), data, plan, wheels)
    hardest = passing.pass_breaks(t, data, plan, wheels)
    contact_forces(t, data, plan, w, wheels)
    S[passing.ANEW] = 1.0
    if hardest != contract.SOFT:  # a joint just here
        passing.switch_contacts(t, data, wheels, events, S)
        contact_forces(t, data, plan, w, wheels)
        if passing.switch_stretches(t, data, wheels, events, S):
            contact_forces(t, data, plan, w, wheels)
        searching.log_corners(t, data[asm.PULSE], 1.0, wheels, kept, peaks, S)
        S[passing.NEXT_LENGTH] = passing.FIRST_STEP * data[asm.PULSE]


PATH_COLUMNS = (asm.FIRST_PIECE, asm.LAST_PIECE, asm.PATH_LOOP, asm.PATH_LOOP_JOIN)
"""Columns of a lane that tell its path."""


class Laying:
    """The marks of a march under way.

    Attributes
    ----------
    assembly
        The vehicle on its paths as they are known now.
    until
        Time up to which they are known, s.
    """

    def __init__(self, memory: WagonMemory | None, assembly: Assembly, grid: Grid | None = None) -> None:
        self.assembly, self._end = assembly, float(assembly.numbers[asm.RUN_END])
        self._marking, self._lasts, self._grid = None, np.inf, grid
        speed = float(assembly.numbers[asm.SPEED])
        if memory is not None and speed > 0.0:
            self._marking, self._lasts = memory.begin(), memory.reach / speed
        self._step, self.until = 0, 0.0
        self.until = self._next()

    def _next(self) -> float:
        """Return until when the march may go on; on rails that give way these are whole macro steps."""
        known = min(self._end, self.until + self._lasts)
        if self._grid is None or known == self._end:
            return known
        step = int(self._grid.steps(np.array(known)) + 1e-9)
        self._step = max(step, self._step + 1)
        return min(self._end, float(self._grid.times(np.array(self._step))))

    def goes_on(self, status: int) -> bool:
        """Return whether a march has come to where new paths are needed."""
        return status == contract.DONE and self.until < self._end

    def lay(self, found: Any, flat: FlatAssembly) -> FlatAssembly:
        """Lay the marks of a march so far; return the vehicle on its new paths."""
        assert self._marking is not None
        self._marking.press(found)
        paths = self._marking.paths()
        self.assembly = self.assembly._replace(lanes=paths.lanes, pieces=paths.pieces)
        self.until = self._next()
        return with_paths(flat, *paths)


def log_first_yields(work: Any) -> None:
    """Log the contacts that yield as they stand at time zero."""
    S = work.S
    for lane in np.flatnonzero(work.wheels[:, wheel.STRETCH : wheel.STRETCH + LANES].ravel() > 0.0):
        row = work.events[int(S[passing.RUN_EVENTS])]
        row[contract.EVENT_TIME], row[contract.EVENT_RATE] = 0.0, 0.0
        row[contract.EVENT_KIND], row[contract.EVENT_CONTACT] = contract.YIELD, lane
        S[passing.RUN_EVENTS] += 1.0
