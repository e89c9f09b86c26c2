"""The march of a wagon, and what can be asked of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import happened
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.telling import Tell, report_nothing
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import multibody, replay
from wheeltapper.march.wagon.assembly import Assembly
from wheeltapper.march.wagon.remembering import OverMarks
from wheeltapper.march.wagon.wheel_rows import DELTA_RATE, ROW_DELTA

if TYPE_CHECKING:
    from wheeltapper.march.wagon.rails.march import OnRails
    from wheeltapper.march.wagon.rails.replay import RailsReplay


BEHIND = np.linspace(0.0, 1.0, 17)
"""Times behind a maximum of a damped force at which its indentation is read, in radians of phase of a wheelset."""


class Marched(multibody.MultibodyMarch):
    """A march of a wagon, in SI units."""

    __slots__ = ()

    @property
    def spans(self) -> FloatArray:
        """Time and length of each step, (steps, 2)."""
        return np.asarray(self.steps[:, [asm.STEP_TIME, asm.STEP_LENGTH]])

    def without_force(self, contacts: IntArray) -> NDArray[np.bool_]:
        """Return where some contacts have no force, (steps, contacts)."""
        return np.asarray(np.floor(self.steps[:, [asm.STEP_CLOSED]] / 2.0**contacts) % 2.0 == 0.0)

    def at(self, times: FloatArray, rows: IntArray) -> tuple[FloatArray, ...]:
        """Return states and rates (times, states) and some rows of contacts (times, rows, lanes) at rising times."""
        return replay.replay(self, times, rows)

    def works(self, damping: FloatArray, places: IntArray) -> tuple[FloatArray, ...]:
        """Return each step's works (steps, POWERS_KEPT), impulses (steps, lanes), and elastic energies at its ends.

        These are those of contacts and of nonlinear elements, (steps, 2) both. `damping` acts on the velocities of the
        displacements at `places`; the last one is a deck's where there is one.
        """
        return replay.works(self, damping, places)

    def rails_below(self, program: OnRails) -> RailsReplay:
        """Return what tells what both rails below do."""
        from wheeltapper.march.wagon.rails.replay import RailsReplay

        return RailsReplay(program, self)

    def extremes(self) -> tuple[float, float]:
        """Return the largest indentation of the treads, m, and its largest rate either way, m/s.

        They are read at events, where it is fastest, and at maxima of forces and what follows: contacts whose force
        knows the rate are deepest a little later.
        """
        A, peaks = self.assembly, self.peaks[:, [contract.PEAK_TIME]]
        rated = A.numbers[asm.CONTACT_LAW] == asm.OWN_RATED
        behind = (peaks + A.numbers[asm.PULSE] * BEHIND[: len(BEHIND) if rated else 1]).ravel()
        times = np.concatenate([[0.0], behind[behind <= self.end], self.events[:, contract.EVENT_TIME]])
        _, _, found = self.at(np.unique(times), np.array([ROW_DELTA, DELTA_RATE]))
        treads = np.flatnonzero(A.lanes[: int(A.numbers[asm.TREADS]), asm.SIDE].ravel())
        delta, rate = np.moveaxis(found[:, :, treads], 1, 0)
        return float(delta.max()), float(np.abs(rate[delta >= 0.0]).max(initial=0.0))

    def happened(self) -> list[FloatArray]:
        """Return what happens to each contact, to each void and to each nonlinear element, in its order."""
        pieces = self.steps[:, asm.STEP_ELEMENTS :].T[:, :, None]
        met = [happened.by_contact(rows, contract.EVENT_KIND) for rows in (self.events, self.seat_events)]
        return [*met, *(happened.without_repeats(one) for one in pieces)]

    def gentlest(self) -> float:
        """Return the smallest rate of indentation at an event, m/s."""
        return happened.slowest(self.events)


def march(program: Assembly | OnRails | OverMarks, tell: Tell = report_nothing) -> Marched:
    """March a wagon from its start to its end; one that meets its own marks lays them on the way."""
    memory, plain = (program.memory, program.program) if isinstance(program, OverMarks) else (None, program)
    if isinstance(plain, Assembly):
        return Marched(*multibody.march(plain, tell, memory))
    from wheeltapper.march.wagon.rails.march import march

    return Marched(*march(plain, tell, memory))
