"""Impact trains: events and force maxima of one run or of many cells, for features."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.march.common import program as contract

if TYPE_CHECKING:
    from wheeltapper.lower.numbers import Units
    from wheeltapper.march.wheel.ensemble import Marched
    from wheeltapper.record.trains.growth import Growth

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Values = NDArray[Any]  # floats, or complex numbers whose imaginary parts are derivatives


NO_MAXIMUM = Note(
    "the force has no maximum within the run: the largest one is that at the run's start or end, without a derivative",
    "no maximum",
)


def _group_starts(*keys: NDArray[Any]) -> IntArray:
    """Return the positions in sorted columns at which a new combination of entries begins."""
    if len(keys[0]) == 0:
        return np.zeros(0, dtype=np.int64)
    new = np.zeros(len(keys[0]), dtype=bool)
    new[0] = True
    for key in keys:
        new[1:] |= key[1:] != key[:-1]
    return np.flatnonzero(new)


def _largest_of_each(values: FloatArray, begins: IntArray) -> IntArray:
    """Return the position of the largest entry (the first of equals) of each group; groups begin at `begins`."""
    if len(begins) == len(values):
        return begins
    sizes = np.diff(begins, append=len(values))
    largest = np.flatnonzero(values == np.repeat(np.maximum.reduceat(values, begins), sizes))
    return largest[np.searchsorted(largest, begins)]


def notes_of_cells(notes: Iterable[tuple[int, Note]], wheels: int = 1) -> tuple[Shared, ...]:
    """Return notes on trains, one for each cause; so many trains in a row are of one cell."""
    worst: dict[tuple[str, int], Note] = {}
    for train, note in notes:
        held = worst.setdefault((note.cause, train // wheels), note)
        if note.severity > held.severity:
            worst[note.cause, train // wheels] = note
    return shared_notes([Shared(note, 1) for note in worst.values()])


@dataclass(frozen=True)
class Rows:
    """Rows of a table of many cells, sorted by cell."""

    first: IntArray  # (cells + 1,): the first row of each cell, and the end of all rows
    columns: dict[str, Values]

    @cached_property
    def row_counts(self) -> IntArray:
        """Number of rows of each cell."""
        return np.diff(self.first)

    @cached_property
    def row_cells(self) -> IntArray:
        """The cell of each row."""
        return np.repeat(np.arange(len(self.first) - 1), self.row_counts)

    def nth_entry(self, column: str, n: int) -> Values:
        """Return a column's entry in each cell's n-th row, counted from one; NaN where there are fewer."""
        values = np.append(self.columns[column], np.nan)
        return values[np.where(self.row_counts >= n, self.first[:-1] + n - 1, -1)]

    def last_entry(self, column: str) -> Values:
        """Return a column's entry in each cell's last row; NaN where there is none."""
        values = np.append(self.columns[column], np.nan)
        return values[np.where(self.row_counts > 0, self.first[1:] - 1, -1)]

    def largest_entry(self, column: str) -> Values:
        """Return a column's largest entry in each cell; NaN where there is none."""
        values, owner = self.columns[column], self.row_cells
        rows = _largest_of_each(values.real, _group_starts(owner))
        out = np.full(len(self.first) - 1, np.nan, dtype=values.dtype)
        out[owner[rows]] = values[rows]
        return out

    def total_over_rows(self, values: Values) -> Values:
        """Return the sum of one value per row over each cell's rows."""
        out = np.zeros(len(self.first) - 1, dtype=values.dtype)
        np.add.at(out, self.row_cells, values)
        return out


@dataclass(frozen=True)
class Trains:
    """Losses, impacts and force maxima of computed cells, in SI units; each is prepared when it is first read."""

    marched: Marched
    units: Units
    missing_energy: Callable[[], FloatArray]  # (cells,): share of the exchanged energy that is missing
    growth: Callable[[int], Growth]  # of small deviations, over so many waves
    meets: Callable[[float], FloatArray]  # (cells,) when the wheel is at a position (m), s
    force_histories: Callable[[float], Iterable[FloatArray]]  # N of each cell, so many times in a second
    at_rest: bool  # whether the runs begin in equilibrium
    end_forces: Callable[[IntArray], FloatArray]  # of some cells, the larger one of those at both ends of the run, N
    notes: list[tuple[int, Note]] = field(default_factory=list)  # what features say of a train, by its number
    # Of what has no derivative the imaginary part, over its real one: who depends on it has no derivative either. A NaN
    # would make the real parts NaN, too.
    unknown_part: float = 0.0

    @property
    def cell_count(self) -> int:
        """Number of cells."""
        return len(self.marched.end)

    @property
    def end_time(self) -> Values:
        """(cells,) end of the computed time of each cell, s."""
        return self.marched.end * self.units.time

    @property
    def static_force(self) -> Values:
        """(cells,) N0, N."""
        return self.units.static_force

    @property
    def is_airborne_at_start(self) -> NDArray[np.bool_]:
        """(cells,) True where the run began in flight."""
        return np.asarray(self.marched.airborne == 1.0)

    @property
    def highest_position(self) -> Values:
        """(cells,) highest displacement of the wheel, m."""
        highest = self.marched.highest
        assert highest is not None
        return highest * self.units.length

    @cached_property
    def is_complete(self) -> NDArray[np.bool_]:
        """(cells,) True if the run was computed to its end, or as far as was necessary."""
        return np.asarray((self.marched.status == contract.DONE) | (self.marched.status == contract.ENOUGH))

    @cached_property
    def losses(self) -> Rows:
        """Losses of contact: columns `time` (s) and `rate` (of the indentation, m/s)."""
        return self._rows_of_kind(contract.LOSS)

    @cached_property
    def impacts(self) -> Rows:
        """Impacts: columns `time` (s) and `rate` (of the indentation, m/s)."""
        return self._rows_of_kind(contract.IMPACT)

    def impact_impulse(self, n: int) -> Values:
        """Return the impulse (N s) of the contact that begins with impact n; NaN if it lasts beyond the run."""
        assert self.marched.impulses is not None
        held = self.impacts.row_counts >= n
        rows = np.append(0, self.marched.event_ends)[:-1] + n - 1
        values = np.append(self.marched.impulses, np.nan)[np.where(held, rows, -1)]
        return values * self.units.force * self.units.time

    @cached_property
    def peaks(self) -> Rows:
        """Force maxima: columns `time` (s), `force` (N) and `impact` (number of impacts before)."""
        peaks, units = self.marched.peaks, self.units
        first = np.append(0, self.marched.peak_ends)
        count = np.diff(first)
        columns = {
            "time": peaks[:, contract.PEAK_TIME] * np.repeat(units.time, count),
            "force": peaks[:, contract.PEAK_FORCE] * np.repeat(units.force, count),
            "impact": peaks[:, contract.PEAK_IMPACT].real,
        }
        return Rows(first, columns)

    @cached_property
    def largest_force(self) -> Values:
        """(cells,) largest maximum of the force, N; where the run has none, the larger force of its two ends.

        Its derivatives are not known at the ends.
        """
        found = self.peaks.largest_entry("force")
        without = np.flatnonzero(self.lacks_maxima)
        if len(without):
            found[without] = self.end_forces(without) * (1.0 + 1j * self.unknown_part if self.has_rates else 1.0)
        if len(without) and self.has_rates:
            self.notes.extend((int(cell), NO_MAXIMUM) for cell in without)
        return found

    @property
    def has_rates(self) -> bool:
        """Whether imaginary parts are derivatives."""
        return np.iscomplexobj(self.marched.peaks)

    @property
    def lacks_maxima(self) -> NDArray[np.bool_]:
        """(cells,) True where the run has reached its end without any maximum of the force."""
        return np.asarray(self.is_complete & (self.peaks.row_counts == 0))

    def _rows_of_kind(self, kind: int) -> Rows:
        events, units = self.marched.events, self.units
        among = events[:, contract.EVENT_KIND] == kind
        rows = np.flatnonzero(among)
        first = np.append(0, np.cumsum(among))[np.append(0, self.marched.event_ends)]
        count = np.diff(first)
        columns = {
            "time": events[rows, contract.EVENT_TIME] * np.repeat(units.time, count),
            "rate": events[rows, contract.EVENT_RATE] * np.repeat(units.length / units.time, count),
        }
        return Rows(first, columns)

    def first_peak_after(self, place: float) -> Values:
        """Return the first maximum of the force (N) after the wheel is at a place (m); NaN if there is none."""
        peaks = self.peaks
        later = peaks.columns["time"].real > self.meets(place)[peaks.row_cells]
        rows = np.flatnonzero(later)
        rows = rows[_group_starts(peaks.row_cells[rows])]
        values = peaks.columns["force"]
        out = np.full(self.cell_count, np.nan, dtype=values.dtype)
        out[peaks.row_cells[rows]] = values[rows]
        return out

    def impact_peak(self, n: int, column: str) -> Values:
        """Return time or force of the largest force between impact n and the next; NaN if there is none."""
        among = self.impact_peaks
        rows = among.columns["impact"] == n
        values = among.columns[column]
        out = np.full(self.cell_count, np.nan, dtype=values.dtype)
        out[among.row_cells[rows]] = values[rows]
        return out

    @cached_property
    def impact_peaks(self) -> Rows:
        """Time and force of the largest force after every impact, if there is one."""
        rows = np.flatnonzero(self.peaks.columns["impact"] >= 1)
        owner, impact = self.peaks.row_cells[rows], self.peaks.columns["impact"][rows]
        best = rows[_largest_of_each(self.peaks.columns["force"].real[rows], _group_starts(owner, impact))]
        first = np.append(0, np.cumsum(np.bincount(self.peaks.row_cells[best], minlength=self.cell_count)))
        return Rows(first, {name: self.peaks.columns[name][best] for name in ("time", "force", "impact")})
