"""Impact trains: events and force maxima of one run or of many cells, as features read them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march import program as contract

if TYPE_CHECKING:
    from wheeltapper.lower.numbers import Units
    from wheeltapper.march.ensemble import Marched

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Values = NDArray[Any]  # of floats; complex where they carry a derivative


@dataclass(frozen=True)
class Rows:
    """Rows of a table that belongs to many cells, one cell after the other."""

    first: IntArray  # (cells + 1,): where each cell's rows begin, and the end of all
    columns: dict[str, Values]

    @property
    def count(self) -> IntArray:
        """Number of rows of each cell."""
        return np.diff(self.first)

    @property
    def owner(self) -> IntArray:
        """The cell of each row."""
        return np.repeat(np.arange(len(self.first) - 1), self.count)

    def nth(self, column: str, n: int) -> Values:
        """Return a column's entry in each cell's n-th row, counted from one; NaN where there are fewer."""
        values = np.append(self.columns[column], np.nan)
        return values[np.where(self.count >= n, self.first[:-1] + n - 1, -1)]

    def last(self, column: str) -> Values:
        """Return a column's entry in each cell's last row; NaN where there is none."""
        values = np.append(self.columns[column], np.nan)
        return values[np.where(self.count > 0, self.first[1:] - 1, -1)]

    def largest(self, column: str) -> Values:
        """Return a column's largest entry in each cell; NaN where there is none."""
        values, owner = self.columns[column], self.owner
        order = np.lexsort((values.real, owner))
        ends = order[np.flatnonzero(np.diff(owner[order], append=-1))]
        out = np.full(len(self.first) - 1, np.nan, dtype=values.dtype)
        out[owner[ends]] = values[ends]
        return out

    def total(self, values: Values) -> Values:
        """Return the sum of one value per row over each cell's rows."""
        out = np.zeros(len(self.first) - 1, dtype=values.dtype)
        np.add.at(out, self.owner, values)
        return out


@dataclass(frozen=True)
class Trains:
    """Losses, impacts and force maxima of cells, in SI units.

    Attributes
    ----------
    losses, impacts
        Columns `time` (s) and `rate` (indentation rate, m/s); impacts also `impulse` (N s, of the contact that follows;
        NaN where it outlasts the run, or was not asked for).
    peaks
        Columns `time` (s), `force` (N) and `impact` (how many impacts came before).
    end
        (cells,) time in s up to which each cell was computed.
    static_force
        (cells,) N0, N.
    airborne
        (cells,) True where the run began in flight.
    highest
        (cells,) highest displacement of the wheel, m; NaN where it was not asked for.
    whole
        (cells,) True where the run was computed to its end, or as far as was asked.
    """

    losses: Rows
    impacts: Rows
    peaks: Rows
    end: Values
    static_force: Values
    airborne: NDArray[np.bool_]
    highest: Values
    whole: NDArray[np.bool_]

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.end)

    def impact_peak(self, n: int, column: str) -> Values:
        """Return time or force of the largest force between impact n and the next; NaN where there is none."""
        return self._largest(self.peaks.columns["impact"] == n).nth(column, 1)

    def impact_peaks(self) -> Rows:
        """Return time and force of the largest force after every impact, where there is one."""
        return self._largest(self.peaks.columns["impact"] >= 1)

    def _largest(self, among: NDArray[np.bool_]) -> Rows:
        """Return the largest of the chosen maxima that follow the same impact of the same cell."""
        rows = np.flatnonzero(among)
        owner, impact = self.peaks.owner[rows], self.peaks.columns["impact"][rows]
        order = np.lexsort((self.peaks.columns["force"].real[rows], impact, owner))
        rows, owner, impact = rows[order], owner[order], impact[order]
        best = np.append((np.diff(owner) != 0) | (np.diff(impact) != 0), len(rows) > 0)[: len(rows)]
        rows = rows[best]
        first = np.searchsorted(owner[best], np.arange(self.cells + 1))
        return Rows(first, {name: self.peaks.columns[name][rows] for name in ("time", "force", "impact")})


def trains_of(marched: Marched, units: Units) -> Trains:
    """Return the trains of cells that were marched, `units` being theirs."""
    events, peaks = marched.events, marched.peaks
    event_first = np.append(0, marched.event_ends)
    peak_first = np.append(0, marched.peak_ends)
    event_owner = np.repeat(np.arange(len(marched.end)), np.diff(event_first))
    peak_owner = np.repeat(np.arange(len(marched.end)), np.diff(peak_first))
    time = events[:, contract.EVENT_TIME] * units.time[event_owner]
    rate = events[:, contract.EVENT_RATE] * (units.length / units.time)[event_owner]

    def kind(which: int) -> Rows:
        mine = np.flatnonzero(events[:, contract.EVENT_KIND].real == which)
        first = np.searchsorted(mine, event_first)
        return Rows(first, {"time": time[mine], "rate": rate[mine]})

    losses, impacts = kind(contract.LOSS), kind(contract.IMPACT)
    number = np.arange(impacts.first[-1]) - impacts.first[:-1][impacts.owner]
    impulse = marched.impulses[event_first[impacts.owner] + number]
    impacts.columns["impulse"] = impulse * (units.force * units.time)[impacts.owner]

    columns = {
        "time": peaks[:, contract.PEAK_TIME] * units.time[peak_owner],
        "force": peaks[:, contract.PEAK_FORCE] * units.force[peak_owner],
        "impact": peaks[:, contract.PEAK_IMPACT].real,
    }
    whole = np.isin(marched.status, (contract.DONE, contract.ENOUGH))
    return Trains(
        losses, impacts, Rows(peak_first, columns), marched.end * units.time, units.static_force,
        marched.airborne == 1.0, marched.highest * units.length, whole,
    )  # fmt: skip
