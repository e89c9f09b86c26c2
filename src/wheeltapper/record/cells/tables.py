"""Cells that share the tables of a track: those of one speed march in step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.notes import Shared
from wheeltapper.lower.many import EPSILON
from wheeltapper.lower.numbers import Units
from wheeltapper.lower.plane_cells import PlaneCells
from wheeltapper.lower.plane_turns import not_turned, turn_along
from wheeltapper.march.common import program as contract
from wheeltapper.march.general import ensemble
from wheeltapper.march.general.task import march_alone
from wheeltapper.record.cells.base import Asked, Block, Cells
from wheeltapper.record.record import Record
from wheeltapper.record.trains.of_record import trains_of
from wheeltapper.record.trains.rates import Along, Rates
from wheeltapper.record.trains.trains import Trains

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.lower.lowered.plane import LoweredPlane
    from wheeltapper.march.general.ensemble import MarchedCells
    from wheeltapper.march.general.gradients import Tangents
    from wheeltapper.march.general.task import Marched as MarchedAlone
    from wheeltapper.record.features import Feature

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
T = TypeVar("T")


class CellsSharingTables(Cells):
    """Cells of the general march."""

    @staticmethod
    def has_tangents(scenario: Scenario, paths: Sequence[str], features: Sequence[Feature]) -> bool:
        """Return whether marches with tangents know the derivatives of some features by some fields."""
        return not any(not_turned(scenario, path) for path in paths) and not any(one.of_heights for one in features)

    @staticmethod
    def is_dear(path: str) -> bool:
        """Return whether cells that differ in a field have tables of their own."""
        return path == "speed" or path.startswith("track.") or path.partition(".")[2] == "wheelbase"

    @cached_property
    def _many(self) -> PlaneCells:
        return PlaneCells(self.scenario, self.changed, self.method)

    @property
    def notes(self) -> tuple[Shared, ...]:
        """What the user should know of all cells, one note for each cause."""
        return self._many.notes

    def march(self, asked: Asked, threads: int, read: Callable[[Block], None], along: Sequence[str] = ()) -> None:
        """March all cells, with tangents along some fields, and hand each block to `read`; the threads do both."""
        tasks = self._many.tasks

        def read_block(cells: IntArray, marched: MarchedCells) -> None:
            read(Block(cells, marched.status, self._trains(cells, marched)))

        def read_cell(cell: int, marched: MarchedAlone) -> None:
            lowered = self._many.lowered(cell)
            is_whole = marched.status == contract.DONE
            trains = trains_of(Record(lowered, self.method, marched), asked.tally) if is_whole else None
            block = Block(np.array([cell]), np.array([marched.status]), trains)
            if along:
                block = block._replace(gentlest=lowered.gentlest(marched))
            read(_turned(block, along, lowered, marched) if along and is_whole else block)

        if along or asked.tally or tasks[0].memory is not None:
            self._many.lowered(max(range(self.count), key=lambda cell: tasks[cell].duration)).check_room()
            march_alone(tasks, threads, read_cell)
        else:
            ensemble.march_all(tasks, threads, read_block, ensemble.Until(asked.impact, asked.loss))

    def margins(self, losses: int, threads: int) -> FloatArray:
        """Return how far each cell is from the `losses`-th loss of any wheel, m; NaN where a march broke off."""
        from wheeltapper.march.general.margin import margins_of

        return margins_of(self._many.tasks, losses, threads)

    def each(self, cells: IntArray, read: Callable[[Trains], T]) -> Iterable[T]:
        """Return what is read of the trains of some cells, which are marched once more, each alone."""
        out = dict[int, T]()

        def read_cell(place: int, marched: MarchedAlone) -> None:
            record = Record(self._many.lowered(int(cells[place])), self.method, marched)
            out[place] = read(trains_of(record, False))

        march_alone([self._many.tasks[cell] for cell in cells], 1, read_cell)
        return [out[place] for place in range(len(cells))]

    def _trains(self, cells: IntArray, marched: MarchedCells) -> Trains:
        """Return the impact trains of all contacts of some cells, in SI units, cell after cell."""
        from wheeltapper.march.wheel.ensemble import Marched

        static = self._many.static_force[cells]
        wheels = static.shape[1]
        trains = np.arange(static.size)
        of_event = marched.events[:, contract.EVENT_CONTACT].astype(np.int64)
        peak_time, peak_force, peak_train = marched.peaks.T
        of_peak = peak_train.astype(np.int64)
        events = np.zeros((len(of_event), contract.EVENT_COLUMNS))
        events[:, : contract.EVENT_CAUSE] = marched.events[:, : contract.EVENT_CAUSE]
        peaks = np.zeros((len(of_peak), contract.PEAK_COLUMNS))
        peaks[:, contract.PEAK_TIME], peaks[:, contract.PEAK_FORCE] = peak_time, peak_force * self._many.rails
        hits = events[:, contract.EVENT_KIND] == contract.IMPACT
        onsets = events[hits, contract.EVENT_TIME]
        peaks[:, contract.PEAK_IMPACT] = _impacts_before(of_event[hits], onsets, of_peak, peaks)
        event_ends, peak_ends = (np.searchsorted(owner, trains, side="right") for owner in (of_event, of_peak))
        firsts = np.append(0, event_ends)[:-1]
        begun = firsts < event_ends
        airborne = np.zeros(len(trains))
        airborne[begun] = events[firsts[begun], contract.EVENT_KIND] == contract.IMPACT
        one = np.ones(len(trains))
        found = Marched(
            np.repeat(marched.status, wheels), np.repeat(marched.end, wheels), events, peaks, event_ends, peak_ends,
            airborne,
        )  # fmt: skip
        positions = np.concatenate([self._many.vehicles[cell].plane.positions for cell in cells])
        units = Units(one, one, one, static.ravel(), one)
        return Trains(found, units, **self.beyond(cells, wheels, positions))


def _impacts_before(of_hit: IntArray, hits: FloatArray, of_peak: IntArray, peaks: FloatArray) -> FloatArray:
    """Return how many impacts of its train came before each force maximum."""
    both = np.concatenate([hits, peaks[:, contract.PEAK_TIME]])
    owner = np.concatenate([of_hit, of_peak])
    is_hit = np.arange(len(both)) < len(hits)
    order = np.lexsort((~is_hit, both, owner))  # an impact counts at its own time
    before = np.empty(len(both))
    before[order] = np.cumsum(is_hit[order])
    first = np.searchsorted(of_hit, of_peak)
    return before[len(hits) :] - first


def _turned(block: Block, along: Sequence[str], lowered: LoweredPlane, marched: MarchedAlone) -> Block:
    """Return a cell with how it changes along some fields."""
    turns = [turn_along(lowered.scenario, path, lowered) for path in along]
    found, trains, changes = marched.tangents(turns), block.trains, list[Along]()
    assert trains is not None
    for lane, (path, turn) in enumerate(zip(along, turns, strict=True)):
        static: Any = trains.static_force + 1j * EPSILON * turn.static * lowered.force
        units = replace(trains.units, static_force=static)
        changes.append(Along(trains, _rates(trains, lowered, marched, found, lane), float(path == "duration"), units))
    return block._replace(along=changes, amplification=_amplification(lowered, marched, found))


def _rates(trains: Trains, lowered: LoweredPlane, marched: MarchedAlone, found: Tangents, lane: int) -> Rates:
    """Return derivatives along one direction in the order of the trains."""
    by_train = np.argsort(marched.events[:, contract.EVENT_CONTACT], kind="stable")
    of_peaks = np.argsort(marched.peaks[:, contract.PEAK_CONTACT], kind="stable")
    events, peaks = found.events[by_train, :, lane], found.peaks[of_peaks, :, lane].copy()
    peaks[:, 1] *= lowered.force  # the first is the time
    cells, tally = trains.cell_count, trains.marched.impulses is not None
    impulses = np.full(len(events) if tally else 0, np.nan)
    first = 0
    for contact in range(cells if tally else 0):
        own = marched.impulse_rates(found, contact)[:, lane] * lowered.force
        impulses[first : first + len(own)] = own
        first += int(np.sum(marched.events[:, contract.EVENT_CONTACT] == contact))
    return Rates(events, peaks, np.full(cells if tally else 0, np.nan), impulses)


def _amplification(lowered: LoweredPlane, marched: MarchedAlone, found: Tangents) -> float:
    """Return how much a small change of the start has grown at the end: of all wheels' heights or velocities alike."""
    length, speed = marched.static_indentation, float(lowered.speeds(marched).mean())
    freedoms = len(lowered.plane.freedoms)
    scale = np.repeat([length, speed], [freedoms, found.of_starts.shape[1] - freedoms])
    grown = found.of_starts / scale * np.array([[length], [speed]])
    return float(np.linalg.svd(grown, compute_uv=False)[0] / np.sqrt(len(lowered.static_force)))
