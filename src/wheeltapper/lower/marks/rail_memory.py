"""What wheels that yield leave on the rail for those that follow: surfaces, and the pieces of the paths over them.

Each wheel meets the surface that those before it have left. A march stops before a wheel comes to a place whose surface
is not known yet, tells how deep each wheel has pressed, and goes on over new pieces.

Places s count along the rail from where the surface begins, at or behind the last wheel at time zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from wheeltapper.lower.laws.plastic import PlasticLaw
from wheeltapper.lower.marks.marks import SEMI_AXIS, MarkedPath, Surface
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray

BEHIND = 8
"""Intervals of the surface by which a wheel stays behind the marks that it does not know yet: two patches."""


@dataclass(frozen=True, eq=False)
class RailMemory:
    """The wheels of a vehicle, one behind the other, over one rail that yields.

    Attributes
    ----------
    laws
        The plastic law of each wheel, over its own δ_Y and N_Y.
    offsets
        Where each wheel stands at time zero, m; the leading wheel stands farthest.
    share
        Share of a permanent indentation in the rail.
    hardening
        1: a place yields again only beyond its largest indentation so far. 0: it yields as early as a virgin one.
    before
        The surface before the run; indentations are those of its onset.
    marked
        Paths of the wheels over s, on which there will be marks; none where new paths are not wanted.
    end
        What each wheel rolls over, m.
    """

    laws: tuple[PlasticLaw, ...]
    offsets: tuple[float, ...]
    share: float
    hardening: float
    before: Surface
    marked: tuple[MarkedPath, ...]
    end: float

    @property
    def reach(self) -> float:
        """How far the wheels may roll before they must know more of the marks ahead, m."""
        gaps = -np.diff(sorted(self.offsets, reverse=True))
        return float(min(gaps, default=np.inf) - BEHIND * self.before.interval)

    def begin(self) -> Marking:
        """Return the state at the start of a run."""
        return Marking(self)


class Marking:
    """The surfaces of a run under way; surface k is the one that wheel k of the order meets.

    Attributes
    ----------
    work
        Plastic work so far, one loading for every patch's length of rail, J.
    pressures
        Forces over N_Y at the samples that were passed, wheel after wheel.
    """

    def __init__(self, memory: RailMemory) -> None:
        self._memory = memory
        self._order = sorted(range(len(memory.offsets)), key=lambda wheel: -memory.offsets[wheel])
        self._surfaces = [memory.before] * (len(self._order) + 1)
        self._fronts = [self._sample(memory.offsets[wheel]) for wheel in self._order]
        self.work, self.pressures = 0.0, list[FloatArray]()

    def _sample(self, s: float) -> int:
        """Return the number of samples that lie before a place."""
        return int(np.searchsorted(self._memory.before.sample_positions, s))

    def ahead(self, way: float) -> Iterator[tuple[int, FloatArray]]:
        """Return each wheel with the samples that it has passed since the last time when it has rolled so far, m."""
        for k, wheel in enumerate(self._order):
            last = self._sample(self._memory.offsets[wheel] + min(way, self._memory.end))
            yield wheel, self._memory.before.sample_positions[self._fronts[k] : last]

    def take(self, wheel: int, depths: FloatArray, pressures: FloatArray) -> None:
        """Take how deep a wheel has indented the virgin surface, m, at the samples ahead of it, and its forces there.

        Wheels are taken in the order of `ahead`; forces are over N_Y.
        """
        k = self._order.index(wheel)
        self._surfaces[k + 1] = self._yielded(k, self._fronts[k], depths)
        self._fronts[k] += len(depths)
        self.pressures.append(pressures)

    def _yielded(self, k: int, first: int, depths: FloatArray) -> Surface:
        """Return surface k + 1, on which wheel k of the order has pressed samples from `first` on so deep, m."""
        memory, before, after = self._memory, self._surfaces[k], self._surfaces[k + 1]
        own, unit = memory.laws[self._order[k]], memory.before.onset
        law, behind, share = own._replace(length=unit), slice(first, first + len(depths)), own.length / unit
        reached = before.yield_reached(first, depths / share)
        made = before.after_yielding(first, reached, law, memory.hardening)
        borne, left = after.borne.copy(), after.left.copy()
        borne[behind] = made.borne[behind]
        left[behind] = before.left[behind] + (made.left - before.left)[behind] * share
        grown = reached > before.borne[behind]
        done = law.dissipated_by(reached[grown]) - law.dissipated_by(before.borne[behind][grown])
        patch = 2.0 * SEMI_AXIS * before.interval
        self.work += float(done.sum()) * share * before.sample_spacing / patch
        return replace(after, borne=borne, left=left)

    def pieces(self) -> list[FloatArray]:
        """Return the pieces of all paths over the surfaces as they are known."""
        memory, unit = self._memory, self._memory.before.onset
        out = [np.empty(0)] * len(self._order)
        for surface, wheel in zip(self._surfaces, self._order, strict=False):
            law = memory.laws[wheel]
            rows = memory.marked[wheel].shortened_pieces(surface, law._replace(length=unit), memory.share)
            for first in (contract.RESIDUAL, contract.BEARS):
                rows[:, first : first + contract.TERMS] *= law.length / unit
            out[wheel] = rows
        return out

    def left(self) -> Surface:
        """Return the rail as all wheels have left it so far."""
        out, at = self._surfaces[0], np.arange(len(self._memory.before.borne))
        borne, left = out.borne.copy(), out.left.copy()
        for surface, front in zip(self._surfaces[1:], self._fronts, strict=True):
            passed = at < front
            borne[passed], left[passed] = surface.borne[passed], surface.left[passed]
        return replace(out, borne=borne, left=left)
