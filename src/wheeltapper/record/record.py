"""The record of a simulation: outcome, tables of events, peaks and impacts, and the dense solution."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper._version import __version__
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_path, as_quantity
from wheeltapper.ground.errors import InputError, shown
from wheeltapper.ground.outcome import Outcome
from wheeltapper.ground.progress import report, watched
from wheeltapper.lower.build import Lowered
from wheeltapper.march import program as contract
from wheeltapper.march import run
from wheeltapper.record import balanced, damper, energy, extent, yielded
from wheeltapper.record.arrays import as_array
from wheeltapper.record.labels import EVENT_KINDS, HISTORY, dataset

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.single import March

FloatArray = NDArray[np.float64]

OUTCOMES = {
    contract.DONE: Outcome.COMPLETED,
    contract.FULL: Outcome.OUT_OF_MEMORY,
    balanced.UNBALANCED: Outcome.UNBALANCED,
    contract.TOO_MANY_EVENTS: Outcome.EVENT_LIMIT,
    contract.NOT_FINITE: Outcome.NOT_FINITE,
    contract.STALLED: Outcome.STALLED,
    contract.END_OF_PATH: Outcome.END_OF_PATH,
}


class Record:
    """Results of a simulation; every table is an `xarray.Dataset` in SI units.

    Attributes
    ----------
    scenario
        The simulated scenario.
    method
        "default" or "strict".
    notes
        What the user should know: contact at two points, edges, warnings with numbers.
    """

    _share = "wheelset"
    """The object whose force is given."""

    def __init__(self, scenario: Scenario, method: str, lowered: Lowered, march: March) -> None:
        self.scenario, self.method = scenario, method
        self._lowered, self._march = lowered, march
        self.notes = lowered.notes

    @property
    def outcome(self) -> Outcome:
        """Outcome of the computation."""
        return OUTCOMES[self._march.status]

    @property
    def end(self) -> float:
        """End of the computed time, s."""
        return float(self._march.state[contract.TIME] * self._lowered.time)

    @property
    def static_force(self) -> float:
        """Static contact force N0 of the wheelset, N."""
        return self._lowered.static_force

    @property
    def contact_constant(self) -> float:
        """Contact constant of the wheelset on a smooth rail: N/m^1.5, of a linear contact N/m."""
        return self._lowered.contact_constant

    @property
    def provenance(self) -> dict[str, str]:
        """Versions and method that made this record."""
        import numba

        return {"wheeltapper": __version__, "numba": numba.__version__, "numpy": np.__version__, "method": self.method}

    # -- tables ---------------------------------------------------------------------------------------------------

    @cached_property
    def events(self) -> xr.Dataset:
        """Losses of contact, impacts and onsets of yield: time, kind, contact, position, indentation rate."""
        rows, units = self._march.events, self._lowered
        time = rows[:, contract.EVENT_TIME] * units.time
        kinds = np.array(EVENT_KINDS)[rows[:, contract.EVENT_KIND].astype(int)]
        return dataset(
            "event",
            time=time,
            kind=kinds,
            contact=np.zeros(len(rows), dtype=int),
            position=self.scenario.speed * time,
            indentation_rate=rows[:, contract.EVENT_RATE] * units.length / units.time,
        )

    @cached_property
    def peaks(self) -> xr.Dataset:
        """Maxima of the contact force; `corner` is True if a kink of the input causes the maximum."""
        rows, units = self._march.peaks, self._lowered
        return dataset(
            "peak",
            time=rows[:, contract.PEAK_TIME] * units.time,
            contact=np.zeros(len(rows), dtype=int),
            normal_force=rows[:, contract.PEAK_FORCE] * units.force,
            corner=rows[:, contract.PEAK_CORNER] == 1.0,
        )

    @cached_property
    def impacts(self) -> xr.Dataset:
        """Impacts with what follows each: closing speed, largest force until the next, duration, impulse, interval.

        `interval` is the time from this onset of contact to the next. `force_ratio` is the ratio of this impact's
        largest force to that of the next one (r_N of the paper). Both are NaN if there is no next impact. `duration`
        and `impulse` are NaN if the contact lasts beyond the end of the run.
        """
        events = self.events
        is_impact = events.kind.values == "impact"
        time = events.time.values[is_impact]
        losses = events.time.values[events.kind.values == "loss"]
        until = np.append(time[1:], self.end)[: len(time)]
        peak = self._largest_between(time, until)
        after = np.searchsorted(losses, time, side="right")
        ends = np.append(losses, np.nan)[np.minimum(after, len(losses))]
        missing = np.full(min(len(time), 1), np.nan)
        return dataset(
            "impact",
            time=time,
            closing_speed=events.indentation_rate.values[is_impact],
            peak_force=peak,
            duration=ends - time,
            impulse=self._impulses(time, ends),
            interval=np.append(np.diff(time), missing),
            force_ratio=np.append(peak[:-1] / peak[1:], missing),
        )

    @cached_property
    def damper_events(self) -> xr.Dataset:
        """Events of a damper with play: its end reaches a stop ("reached") or leaves it ("left"); time, kind, side."""
        run.choose(run.DAMPER_EVENTS, self.scenario.needs)
        return damper.events(self._lowered, self._march.stops)

    def _largest_between(self, start: FloatArray, end: FloatArray) -> FloatArray:
        times, forces = self.peaks.time.values, self.peaks.normal_force.values
        out = np.full(len(start), np.nan)
        for i, (a, b) in enumerate(zip(np.searchsorted(times, start), np.searchsorted(times, end), strict=True)):
            if b > a:
                out[i] = forces[a:b].max()
        return out

    def _impulses(self, start: FloatArray, end: FloatArray) -> FloatArray:
        units = self._lowered
        begins = self._march.steps[:, contract.TIME] * units.time
        total = np.append(0.0, np.cumsum(self._integrals.impulse)) * units.force * units.time
        margin = 1e-12 * max(self.end, 1e-300)
        first = np.searchsorted(begins, start - margin)
        last = np.searchsorted(begins, np.nan_to_num(end) - margin)
        return np.where(np.isnan(end), np.nan, total[last] - total[first])

    # -- the dense solution -----------------------------------------------------------------------------------------

    def history(self, rate: float | str | None = None) -> xr.Dataset:
        """Return all variables at uniform times.

        Parameters
        ----------
        rate
            Samples per second, Hz or as "20 kHz". By default there are about 20 000 samples.
        """
        rate = 20_000 / self.end if rate is None else as_quantity(rate, "rate", "frequency")
        extent.check_samples("rate", f"{rate:g} per second", self.end * rate + 1.0, self._sample_columns)
        return self.at(np.arange(int(np.floor(self.end * rate * (1 + 1e-12))) + 1) / rate)

    def at(self, times: ArrayLike) -> xr.Dataset:
        """Return all variables at the given times (s, or as "1 ms"), from the series of the solution."""
        wanted = _seconds(times)
        if len(wanted) and not (np.all(wanted >= 0.0) and np.all(wanted <= self.end * (1 + 1e-12))):
            raise InputError("", "times", f"times from {wanted.min():g} to {wanted.max():g} s", f"0 to {self.end:g} s")
        extent.check_samples("times", "too many", len(wanted), self._sample_columns)
        return self._labelled_at(wanted)

    @property
    def _sample_columns(self) -> int:
        """Number of numbers in memory for each sample of the dense solution."""
        return 40

    def _labelled_at(self, wanted: FloatArray) -> xr.Dataset:
        order = np.argsort(wanted, kind="stable")
        out = run.sample(self._lowered.program, self._march, wanted[order] / self._lowered.time)
        rows = np.empty_like(out)
        rows[order] = out
        return self._labelled(wanted, rows)

    def _labelled(self, times: FloatArray, rows: FloatArray) -> xr.Dataset:
        from wheeltapper.march import dense

        units = self._lowered
        speed, acceleration = units.length / units.time, units.length / units.time**2
        columns: dict[str, Any] = {
            "wheel_displacement": rows[:, dense.OUT_WHEEL_Y] * units.length,
            "wheel_velocity": rows[:, dense.OUT_WHEEL_V] * speed,
            "wheel_acceleration": rows[:, dense.OUT_WHEEL_A] * acceleration,
            "normal_force": rows[:, dense.OUT_FORCE] * units.force,
            "indentation": rows[:, dense.OUT_DELTA] * units.length,
            "constraint": rows[:, dense.OUT_PATH_Y] * units.length,
        }
        if len(units.program.law):
            columns["permanent_indentation"] = yielded.permanent(units, rows)
        if program_has_deck(units):
            columns |= {
                "deck_displacement": rows[:, dense.OUT_DECK_Y] * units.length,
                "deck_velocity": rows[:, dense.OUT_DECK_V] * speed,
                "deck_acceleration": rows[:, dense.OUT_DECK_A] * acceleration,
            }
        if len(units.program.damper):
            columns |= damper.columns(units, rows)
        assert set(columns) <= set(HISTORY)
        return dataset("time", time=times, **columns)

    # -- energy and summary -----------------------------------------------------------------------------------------

    @cached_property
    def _integrals(self) -> energy.Integrals:
        with watched(True):
            report("integrating over every step", 0.0, 0.0)
            return energy.integrate(self._lowered, self._march)

    @cached_property
    def energy(self) -> xr.Dataset:
        """Energy balance over the whole run, J: kinetic, elastic, dissipated, works, and the imbalance."""
        return energy.balance(self._lowered, self._integrals)

    @property
    def time_in_air(self) -> float:
        """Total time without contact force, s."""
        free = np.isin(self._march.steps[:, contract.PHASE], (contract.FLIGHT, contract.RELEASED))
        rows = self._march.steps[free]
        return float(rows[:, contract.LENGTH].sum() * self._lowered.time)

    def _summary(self) -> tuple[int, float | None]:
        """Return the number of impacts, and the ratio of the largest to the static force."""
        impacts = int((self._march.events[:, contract.EVENT_KIND] == contract.IMPACT).sum())
        forces = self._march.peaks[:, contract.PEAK_FORCE] * self._lowered.force
        return impacts, (float(forces.max() / self.static_force) if len(forces) else None)

    def __str__(self) -> str:
        impacts, largest = self._summary()
        peak = "no force maximum"
        if largest is not None:
            peak = (
                f"largest force {largest:.3f} of static ({largest * self.static_force / 1e3:.1f} kN per {self._share})"
            )
        plural = "impact" if impacts == 1 else "impacts"
        state = self.outcome.sentence if self.outcome is not Outcome.COMPLETED else f"completed, {self.end:.6g} s"
        onsets = int((self._march.events[:, contract.EVENT_KIND] == contract.YIELD).sum())
        yields = f", {onsets} onset{'' if onsets == 1 else 's'} of yield" if onsets else ""
        return f"{state}: {impacts} {plural}, {peak}{yields}, {1e3 * self.time_in_air:.3f} ms in the air"

    def __repr__(self) -> str:
        return f"<Record {self}>"

    def comfort(self, *_: Any, **__: Any) -> xr.Dataset:
        """Ride comfort exists for wagons only: see `wheeltapper.record.wagon_record.WagonRecord.comfort`."""
        raise run.refusal(run.COMFORT, self.scenario.needs)

    def save(self, path: str | Path) -> None:
        """Write the record as netCDF (.nc); it opens in plain xarray, and with `wheeltapper.load`."""
        from wheeltapper.record.store import save

        path = as_path(path, "path", "a path with the suffix .nc")
        if path.suffix != ".nc":
            raise InputError(str(path), "", f"the suffix {path.suffix!r}", ".nc (netCDF)")
        save(self, path)


def _seconds(times: Any) -> FloatArray:
    """Return times as an array in s."""
    allowed = 'times in s, or as "1 ms": one, or a list'
    wanted = np.atleast_1d(as_array(times, "times", allowed, "time"))
    if wanted.ndim != 1:
        raise InputError("", "times", shown(times), allowed)
    return wanted


def program_has_deck(lowered: Lowered) -> bool:
    """Return True if the program has a deck."""
    return bool(lowered.program.numbers[contract.DECK_MASS] > 0.0)
