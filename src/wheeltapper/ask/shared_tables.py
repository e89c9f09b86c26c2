"""Computing the cells of a study on rails that give way: those of one speed share the tables of the track."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.computed import STATUS_OF_MARCH, ComputedCells, last_events
from wheeltapper.ground.notes import Shared, shared_notes
from wheeltapper.ground.progress import progress_counter
from wheeltapper.lower.cells_on_rails import CellsOnRails
from wheeltapper.lower.numbers import Units
from wheeltapper.march.common import program as contract
from wheeltapper.march.general import ensemble
from wheeltapper.march.general.task import march_alone
from wheeltapper.record.trains.growth import Growth
from wheeltapper.record.trains.of_record import end_forces_of, missing_energy_of
from wheeltapper.record.trains.trains import Trains, notes_of_cells

if TYPE_CHECKING:
    from wheeltapper.ask.study import Study
    from wheeltapper.march.general.ensemble import MarchedCells
    from wheeltapper.march.general.task import Marched as MarchedAlone
    from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def computed_with_tables(asked: Study, changed: dict[str, FloatArray], threads: int) -> ComputedCells:
    """Compute some cells of a study: those in which the varied fields have the given values."""
    many = CellsOnRails(asked.scenario, changed, asked.method)
    alone = asked.needs_tally or many.tasks[0].memory is not None
    values = np.empty((len(asked.features), *asked.wheel_shape, many.cells))
    status = np.empty(many.cells, dtype=np.int64)
    count, said = progress_counter("cells", many.cells), list[Shared]()

    def read_block(numbers: IntArray, marched: MarchedCells) -> None:
        trains = trains_of(many, numbers, marched)
        for row, feature in zip(values, asked.features, strict=True):
            row[..., numbers] = feature(trains).reshape(len(numbers), *asked.wheel_shape).T
        said.extend(notes_of_cells(trains.notes, trains.cell_count // len(numbers)))
        status[numbers] = STATUS_OF_MARCH[marched.status]
        count(len(numbers))

    def read_cell(number: int, marched: MarchedAlone) -> None:
        record = _record(many, number, marched)
        for row, feature in zip(values, asked.features, strict=True):
            found, notes = feature._of_record(record)
            row[..., number] = found.values
            said.extend(Shared(note, 1) for note in notes)
        status[number] = STATUS_OF_MARCH[marched.status]
        count(1)

    if alone:
        march_alone(many.tasks, threads, read_cell)
    else:
        ensemble.march_all(many.tasks, threads, read_block, ensemble.Until(*last_events(asked)))
    empty = np.empty((len(asked.features), 0, many.cells))
    return ComputedCells(
        values, status, empty, np.zeros(many.cells, dtype=np.int64), np.full(many.cells, np.nan),
        shared_notes((*many.notes, *said)),
    )  # fmt: skip


def _record(many: CellsOnRails, number: int, marched: MarchedAlone) -> Record:
    """Return the record of one cell."""
    from wheeltapper.record.record import Record

    return Record(many.lowered(number), many.method, marched)


def trains_of(many: CellsOnRails, numbers: IntArray, marched: MarchedCells) -> Trains:
    """Return the impact trains of all contacts of some cells, in SI units, cell after cell."""
    from wheeltapper.march.wheel.ensemble import Marched

    static = many.static_force[numbers]
    cells, wheels = static.shape
    trains = np.arange(cells * wheels)
    of_event = marched.events[:, contract.EVENT_CONTACT].astype(np.int64)
    peak_time, peak_force, peak_train = marched.peaks.T
    of_peak = peak_train.astype(np.int64)
    events = np.zeros((len(of_event), contract.EVENT_COLUMNS))
    events[:, : contract.EVENT_CAUSE] = marched.events[:, : contract.EVENT_CAUSE]
    peaks = np.zeros((len(of_peak), contract.PEAK_COLUMNS))
    peaks[:, contract.PEAK_TIME], peaks[:, contract.PEAK_FORCE] = peak_time, peak_force * many.rails
    hits = events[:, contract.EVENT_KIND] == contract.IMPACT
    peaks[:, contract.PEAK_IMPACT] = _impacts_before(of_event[hits], events[hits, contract.EVENT_TIME], of_peak, peaks)
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
    units = Units(one, one, one, static.ravel(), one)
    positions = np.concatenate([many.vehicles[number].plane.positions for number in numbers])
    speeds = np.repeat([many.tasks[number].system.speed for number in numbers], wheels)

    def meets(place: float) -> FloatArray:
        with np.errstate(divide="ignore", invalid="ignore"):  # of a wheel that does not roll
            return np.asarray((place - positions) / speeds)

    def of_each(read: Callable[[Record], FloatArray]) -> FloatArray:
        """March each cell once more, alone, and return what is read of its record, (trains, ...)."""
        out = [np.empty(0)] * cells

        def read_cell(number: int, marched: MarchedAlone) -> None:
            out[number] = read(_record(many, int(numbers[number]), marched))

        march_alone([many.tasks[number] for number in numbers], 1, read_cell)
        return np.concatenate(out)

    def force_histories(rate: float) -> Iterable[FloatArray]:
        return of_each(lambda record: record.history(rate).normal_force.values.reshape(-1, wheels).T)

    def missing_energy() -> FloatArray:
        return of_each(lambda record: np.full(wheels, missing_energy_of(record)))

    return Trains(
        found, units, missing_energy, lambda waves: Growth(np.nan * one, np.nan * one), meets, force_histories,
        isinstance(many.scenario.start, str),
        lambda cells: of_each(end_forces_of)[cells],
    )  # fmt: skip


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
