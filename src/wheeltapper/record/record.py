"""The record of a simulation: outcome, tables of events, peaks and impacts, and the dense solution."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper._version import __version__
from wheeltapper.ground.arguments import as_path, as_quantity, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.notes import Note
from wheeltapper.ground.outcome import Outcome
from wheeltapper.ground.progress import progress_shown, report
from wheeltapper.ground.shown import Shown
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower import extent
from wheeltapper.lower.contacts import Contacts
from wheeltapper.lower.lowered.base import LoweredScenario, Variables, Works
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.march import March
from wheeltapper.record import elements
from wheeltapper.record.again import fits, marched_again, witness
from wheeltapper.record.arrays import as_array
from wheeltapper.record.labels import EVENT_KINDS, NO_SEAT, attributes_of, dataset
from wheeltapper.record.outcomes import OUTCOMES

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.describe.sensor.base import Sensor
    from wheeltapper.describe.site import Site
    from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]


class Record(Shown):
    """Results of a simulation; every table is an `xarray.Dataset` in SI units.

    For a wagon, tables of events, peaks and impacts name the wheelset (from 1), the side and the surface; histories
    have wheelset and side as axes, and contain the motions of the bodies by name.

    Attributes
    ----------
    scenario
        The simulated scenario.
    method
        "default" or "strict".
    notes
        What the user should know: contact at two points, edges, warnings with numbers.
    """

    def __init__(self, lowered: LoweredScenario, method: str, march: March) -> None:
        self.scenario, self.method, self._lowered = lowered.scenario, method, lowered
        self._kept_march = march
        self.notes = lowered.notes
        self._of_file: tuple[str, FloatArray] | None = None

    @classmethod
    def of_file(
        cls, lowered: LoweredScenario, method: str, march: March, notes: tuple[Note, ...], made_by: str,
        witness: FloatArray,
    ) -> Self:  # fmt: skip
        """Return a record from what a file has kept, by whom it was made, and its witness (again.py)."""
        record = cls(lowered, method, march)
        record.notes, record._of_file = notes, (made_by, witness)
        return record

    @cached_property
    def _march(self) -> Any:
        """The march behind everything but tables of events; who reads a track or marks asks for more than `March`."""
        if self._of_file is None or fits(self._of_file[1], self._new_witness()):
            return self._kept_march
        again, note = marched_again(self._lowered, self._kept_march.events, self._of_file[0])
        warn_of([note])
        self.notes += (note,)
        return again

    def _new_witness(self) -> FloatArray:
        return witness(self._lowered, self._kept_march)

    @property
    def _witness(self) -> FloatArray:
        return self._new_witness() if self._of_file is None else self._of_file[1]

    @property
    def outcome(self) -> Outcome:
        """Outcome of the computation."""
        return OUTCOMES[self._kept_march.status]

    @property
    def end(self) -> float:
        """End of the computed time, s."""
        return float(self._kept_march.end * self._lowered.time)

    @property
    def static_force(self) -> float:
        """Static contact force N0 of the wheelset, N; of a wagon that of the most heavily loaded wheel."""
        return float(self._contacts.static_force.max())

    @property
    def static_forces(self) -> xr.DataArray:
        """Static contact force of each wheel, N; of a single wheelset one number."""
        return self._per_wheel(self._contacts.static_force, attributes_of("static_force", self._contacts.has_sides))

    @property
    def contact_constant(self) -> float:
        """Contact constant of the wheelset (of a wagon: of a wheel) on a smooth rail: N/m^1.5, if linear N/m."""
        return float(self._lowered.contact_constant)

    @property
    def provenance(self) -> dict[str, str]:
        """Versions and method that made this record."""
        import numba

        return {"wheeltapper": __version__, "numba": numba.__version__, "numpy": np.__version__, "method": self.method}

    # -- the march's rows over the axis `contact` -------------------------------------------------------------------

    @cached_property
    def _contacts(self) -> Contacts:
        return self._lowered.contacts

    @cached_property
    def _events(self) -> Columns:
        rows, units = self._kept_march.events, self._lowered
        return {
            "time": rows[:, contract.EVENT_TIME] * units.time,
            "kind": rows[:, contract.EVENT_KIND].astype(int),
            "contact": self._contacts.contact_of_rows(rows),
            "indentation_rate": rows[:, contract.EVENT_RATE] * units.length / units.time,
        }

    @cached_property
    def _seat_events(self) -> Columns | None:
        found = self._lowered.void_events(self._kept_march)
        return None if found is None else elements.void_columns(self.scenario, found)

    @cached_property
    def _peaks(self) -> Columns:
        rows, units = self._kept_march.peaks, self._lowered
        return {
            "time": rows[:, contract.PEAK_TIME] * units.time,
            "contact": self._contacts.contact_of_rows(rows),
            "normal_force": rows[:, contract.PEAK_FORCE] * units.force,
            "corner": rows[:, contract.PEAK_CORNER] == 1.0,
        }

    @property
    def _step_starts(self) -> FloatArray:
        """Time of each step, s."""
        return np.asarray(self._march.spans[:, 0] * self._lowered.time)

    def _free_steps(self) -> NDArray[np.bool_]:
        """Return (steps, wheels) where a tread has no contact force."""
        return np.asarray(self._kept_march.without_force(self._contacts.lanes[: len(self._contacts.static_force)]))

    # -- tables ---------------------------------------------------------------------------------------------------

    def _public_table(self, dimension: str, columns: Columns) -> xr.Dataset:
        """Return a table as it is in public: several contacts have names."""
        contact = columns["contact"]
        labels = self._contacts.public_labels.items()
        names = {
            name: np.where(contact == NO_SEAT, columns.get(name, all_of.dtype.type()), all_of[contact])
            for name, all_of in labels
        }
        held = {name: (dimension, values) for name, values in (columns | names).items()}
        return dataset(held, names, self._contacts.has_sides)

    @cached_property
    def events(self) -> xr.Dataset:
        """Losses of contact, impacts and onsets of yield: time, kind, contact, position, indentation rate.

        On a track with voids, the closing and the opening of a void are events, too. Such an event has the number of
        the `seat`, the seat's position, the rate of the sleeper's deflection instead of the indentation rate, and -1
        for the contact. Below a wagon it also has the side of the sleeper. Events of wheels have the seat -1.
        """
        held = dict(self._events)
        rate = held.pop("indentation_rate")
        held["position"] = self._positions(held["time"], held["contact"])
        held["indentation_rate"] = rate
        if self._seat_events is not None:
            held["seat"] = np.full(len(rate), NO_SEAT)
            seated = self._seat_events | {"contact": np.full(len(self._seat_events["time"]), NO_SEAT)}
            held |= {name: np.zeros(len(rate), seated[name].dtype) for name in seated.keys() - held.keys()}
            order = np.argsort(np.append(held["time"], seated["time"]), kind="stable")
            held = {name: np.append(values, seated[name])[order] for name, values in held.items()}
        return self._public_table("event", held | {"kind": np.array(EVENT_KINDS)[held["kind"]]})

    def _positions(self, time: FloatArray, contact: Any) -> FloatArray:
        """Return where wheels are along the rail at some times; `contact` is a number, or one for each time."""
        place = self._contacts.position
        return np.asarray(self.scenario.speed * time + place[contact % len(place)])

    @cached_property
    def peaks(self) -> xr.Dataset:
        """Maxima of the contact force; `corner` is True if a kink of the input causes the maximum."""
        return self._public_table("peak", self._peaks)

    @cached_property
    def impacts(self) -> xr.Dataset:
        """Impacts: time, position, closing speed, largest force until the next impact, duration, impulse, interval.

        `position` is that of the wheel's centre along the rail. `interval` is the time from this onset of contact to
        the next. `force_ratio` is the ratio of this impact's largest force to that of the next one (r_N of the paper).
        Both are NaN if there is no next impact. `duration` and `impulse` are NaN if the contact lasts beyond the end of
        the run. If there are several contacts, the next impact is that of the same contact.
        """
        each = [self._impacts_of(contact) for contact in range(len(self._contacts.lanes))]
        columns = {name: np.concatenate([one[name] for one in each]) for name in each[0]}
        order = np.argsort(columns["time"], kind="stable")
        table = self._public_table("impact", {name: values[order] for name, values in columns.items()})
        return table if self._contacts.has_several else table.drop_vars("contact")

    def _impacts_of(self, contact: int) -> Columns:
        """Return the impacts of one contact."""
        events, peaks = (
            {name: values[table["contact"] == contact] for name, values in table.items()}
            for table in (self._events, self._peaks)
        )
        hits = events["kind"] == contract.IMPACT
        time, losses = events["time"][hits], events["time"][events["kind"] == contract.LOSS]
        count, forces = len(time), peaks["normal_force"]
        spans = np.searchsorted(peaks["time"], [time, np.append(time[1:], self.end)[:count]])
        largest = np.array([forces[a:b].max() if b > a else np.nan for a, b in spans.T])
        ends = np.append(losses, np.nan)[np.searchsorted(losses, time, side="right")]
        missing = np.full(min(count, 1), np.nan)
        return {
            "contact": np.full(count, contact),
            "time": time,
            "position": self._positions(time, contact),
            "closing_speed": events["indentation_rate"][hits],
            "peak_force": largest,
            "duration": ends - time,
            "impulse": self._impact_impulses(contact, time, ends),
            "interval": np.append(np.diff(time), missing),
            "force_ratio": np.append(largest[:-1] / largest[1:], missing),
        }

    def _impact_impulses(self, contact: int, start: FloatArray, end: FloatArray) -> FloatArray:
        if len(start) == 0:
            return start
        total = np.append(0.0, np.cumsum(self._works.impulses[:, contact]))
        begins, margin = self._step_starts, 1e-12 * max(self.end, 1e-300)
        first = np.searchsorted(begins, start - margin)
        last = np.searchsorted(begins, np.nan_to_num(end) - margin)
        return np.where(np.isnan(end), np.nan, total[last] - total[first])

    @cached_property
    def damper_events(self) -> xr.Dataset:
        """Events of a damper with play: its end reaches a stop ("reached") or leaves it ("left"); time, kind, side.

        With several wheelsets, each event also has the number of its `wheelset`.
        """
        run.choose(run.DAMPER_EVENTS, self.scenario.needs)
        stops, wheelset = self._lowered.stops_met(self._kept_march)
        number = wheelset + 1 if self._contacts.has_several else None
        return elements.stop_events(stops, self._lowered.time, number)

    @cached_property
    def suspension_events(self) -> xr.Dataset:
        """Events of the nonlinear elements of suspensions: time, element, kind, side, rate of compression.

        Dry friction begins to slip, reverses its slip, or sticks. A bumpstop is met or left. A spring or a damper goes
        beyond a corner of its characteristic or comes back within it. For a wagon, only the events of its friction
        elements are listed.
        """
        run.choose(run.SUSPENSION_EVENTS, self.scenario.needs)
        return elements.element_table(self._lowered.element_events(self._kept_march))

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
        wanted = _times_in_seconds(times)
        if len(wanted) and not (np.all(wanted >= 0.0) and np.all(wanted <= self.end * (1 + 1e-12))):
            raise InputError("", "times", f"times from {wanted.min():g} to {wanted.max():g} s", f"0 to {self.end:g} s")
        extent.check_samples("times", "too many", len(wanted), self._sample_columns)
        return self._labelled_at(wanted)

    def track(
        self, rate: float | str | None = None, rail: Sequence[float | str] = (), seat: Sequence[int] = ()
    ) -> xr.Dataset:
        """Return what rail, pads, sleepers and ballast do, at places of a rail over time.

        Parameters
        ----------
        rate
            Samples per second, Hz or as "20 kHz". By default there are about 20 000 samples.
        rail
            Positions along the rail, m.
        seat
            Numbers of seats; that at `first_sleeper` is 0.

        Returns
        -------
        xarray.Dataset
            Over `time` and `rail`: rail_displacement, rail_acceleration, rail_strain (in bending, at the foot, tension
            positive), rail_shear. Over `time` and `seat`: sleeper_displacement, sleeper_acceleration, pad_force,
            ballast_force (compression positive); on a slab only pad_force. Displacements and accelerations are upwards.
            All values are those of one rail; below a wagon, each rail has its own, over `side`. A value is NaN at times
            when a wheel is farther from its place than half the length of the ring that stands for the track.

        Raises
        ------
        InputError
            If the track has no rail that bends, or if neither `rail` nor `seat` is given.
        """
        from wheeltapper.record.track import track

        return track(self, rate, rail, seat)

    def recordings(
        self, sensors: Site | str | Sensor | Sequence[Sensor], seed: int | None = None
    ) -> dict[str, Recording]:  # fmt: skip
        """Return what sensors would have recorded of the run, from its start to its end.

        Parameters
        ----------
        sensors
            A site or the path of its file: the site's sensors along the track are simulated, and its deck's sensor if
            the run has a deck. Or one sensor or several, which may also be on the run's vehicle. Sensors are on the
            track of the run: their places are those of the scenario. Seats of a site's sensors are found by their
            places; seats of sensors without a site have the run's numbers. With a wagon each sensor has a `side`; with
            other vehicles both sides are alike.
        seed
            Seed of the noise of a deck's sensor. By default there is no noise.

        Returns
        -------
        dict
            A `Recording` for each sensor, by the sensor's name (by its kind if it has no name), as
            `diagnosis.measure_trains` takes them; `diagnose` takes the recording of a deck. Along the track, a reading
            is the true value times the sensor's gain. There and at axle boxes the recorder filters before it samples,
            as the sensor's `anti_alias` says.

        Raises
        ------
        InputError
            If the run's track has nothing that a sensor reads, or no seat at the sensor's place, or if the vehicle has
            no such wheelset.
        """
        from wheeltapper.record.recordings.simulated import recordings

        return recordings(self, sensors, seed)

    @cached_property
    def _sample_columns(self) -> int:
        """Number of numbers in memory for each sample of the dense solution: in rows, in order, and in columns."""
        found = self._lowered.variables(self._march, np.zeros(1))
        return 4 * sum(np.size(values) for _, values in found.values())

    def _labelled_at(self, wanted: FloatArray) -> xr.Dataset:
        return dataset(self._variables_at(wanted), several=self._contacts.has_sides)

    def _variables_at(self, wanted: FloatArray) -> Variables:
        """Return variables and axes at some times, s, with dimensions; a dataset takes longer than a short run."""
        order = np.argsort(wanted, kind="stable")
        back = np.argsort(order, kind="stable")
        found = self._lowered.variables(self._march, wanted[order])
        variables: Variables = {"time": (("time",), wanted)}
        variables |= {name: ((name,), names) for name, names in self._contacts.axis_names.items()}
        for name, (dimensions, values) in found.items():
            over_time = values[back] if dimensions[0] == "time" else values
            if dimensions[-1] == "contact":
                among, by_wheel = self._contacts.by_wheel(over_time)
                variables[name] = (*dimensions[:-1], *among), by_wheel
            else:
                variables[name] = dimensions, over_time
        return variables

    def _per_wheel(self, values: FloatArray, attributes: dict[str, str]) -> xr.DataArray:
        """Return one value per wheel as it is in public."""
        import xarray as xr

        dimensions, by_wheel = self._contacts.by_wheel(values)
        return xr.DataArray(by_wheel, self._contacts.axis_names, dimensions, attrs=attributes)

    # -- energy and summary -----------------------------------------------------------------------------------------

    @cached_property
    def _works(self) -> Works:
        """Impulses of contacts in each step, and what returns the balance of energy."""
        with (
            progress_shown(True),
            np.errstate(over="ignore", invalid="ignore"),
        ):  # of a motion that left the range of numbers
            report("integrating over every step", 0.0, 0.0)
            return self._lowered.works(self._march)

    @cached_property
    def energy(self) -> xr.Dataset:
        """Energy balance over the whole run, J: kinetic, elastic, dissipated, works, and the imbalance."""
        from wheeltapper.record.energy import energies

        with progress_shown(True), np.errstate(over="ignore", invalid="ignore"):
            report("integrating over every step", 0.0, 0.0)
            return energies(self._works.terms())

    @property
    def _known_energy(self) -> xr.Dataset | None:
        """The energy balance, unless it takes long and nobody has asked for it."""
        return None if self._lowered.balance_is_dear and "energy" not in vars(self) else self.energy

    @property
    def time_in_air(self) -> float:
        """Total time without contact force, s; of a wagon the sum over all wheels."""
        lengths = self._kept_march.spans[:, 1] * self._lowered.time
        return float(lengths @ self._free_steps().sum(axis=1))

    def _impacts_and_ratio(self) -> tuple[int, float | None]:
        """Return the number of impacts, and the ratio of the largest to the static force."""
        forces = self._kept_march.peaks[:, contract.PEAK_FORCE] * self._lowered.force
        impacts = int((self._kept_march.events[:, contract.EVENT_KIND] == contract.IMPACT).sum())
        return impacts, (float(forces.max() / self.static_force) if len(forces) else None)

    def __str__(self) -> str:
        impacts, largest = self._impacts_and_ratio()
        peak = "no force maximum"
        if largest is not None:
            of = "wheel" if self._contacts.has_sides else "wheelset"
            peak = f"largest force {largest:.3f} of static ({largest * self.static_force / 1e3:.1f} kN per {of})"
        state = self.outcome.sentence if self.outcome is not Outcome.COMPLETED else f"completed, {self.end:.6g} s"
        onsets = int((self._events["kind"] == contract.YIELD).sum())
        parts = [_counted(impacts, "impact"), peak, *([f"{_counted(onsets, 'onset')} of yield"] if onsets else [])]
        if self._seat_events is not None:
            closings = int((self._seat_events["kind"] == EVENT_KINDS.index("void closes")).sum())
            parts.append(f"{_counted(closings, 'closing')} of voids")
        return f"{state}: {', '.join(parts)}, {1e3 * self.time_in_air:.3f} ms in the air"

    def __repr__(self) -> str:
        return f"<Record {self}>"

    def comfort(
        self,
        body: str = "car body",
        at: Sequence[float | str] | None = None,
        rate: float | str = 1000.0,
        *,
        vertical_weighting: str = "Wb",
        settling: float | str = 0.0,
    ) -> xr.Dataset:
        """Return the ride comfort on a body of a wagon (EN 12299, ISO 2631-1).

        Parameters
        ----------
        body
            Name of the body.
        at
            Position relative to its centre of gravity, m; by default the centre itself.
        rate
            Samples per second, 250 to 1e6, Hz or as "1 kHz".
        vertical_weighting
            "Wb", or "Wb EN 12299:2009" as in programs for that edition.
        settling
            Seconds at the beginning that are filtered but not counted.

        Returns
        -------
        xarray.Dataset
            The numbers of `wheeltapper.record.assessment.comfort.ride_comfort`, each with unit and meaning.

        Raises
        ------
        InputError
            For a single wheelset, an unknown body, a point that is not three numbers, a rate outside this range, or if
            nothing is left after settling.
        """
        from wheeltapper.record.assessment.comfort import comfort

        run.choose(run.COMFORT, self.scenario.needs)
        check_choice(body, "body", self.scenario.vehicle.names)
        found = comfort(self, body, at, rate, vertical_weighting=vertical_weighting, settling=settling)
        if self.outcome is not Outcome.COMPLETED:
            found.attrs["note"] = f"{self.outcome.sentence}: computed up to {self.end:g} s; {found.attrs['note']}"
        return found

    def guidance(
        self, *, cutoff: float | str | None = 20.0, order: int = 4, window: float | str = 2.0,
        settling: float | str = 0.0, rate: float | str | None = None,
    ) -> xr.Dataset:  # fmt: skip
        """Return Y, Q, Y/Q, ΣY, unloading and T-gamma of a wagon's wheels over time, filtered (EN 14363).

        Parameters
        ----------
        cutoff
            Cut-off (-3 dB) of the low-pass filter of Y and Q, which has no phase, Hz, or as "20 Hz"; None: no filter.
        order
            Order of the filter, an even number: 4 falls by 24 dB per octave.
        window
            Distance over which Y/Q, ΣY and T-gamma are averaged (a sliding mean), m, rounded to an odd number of
            samples; 0: no mean.
        settling
            Seconds at the beginning that are filtered but not returned.
        rate
            Samples per second, Hz; by default 100 per period of the cut-off frequency, but at least 20 000.

        Returns
        -------
        xarray.Dataset
            guiding_force (Y, outwards), wheel_force (Q), unloading, derailment_quotient and spin_t_gamma over time,
            wheelset and side; sum_of_guiding_forces without side; t_gamma also over surface (tread, flange). Forces are
            filtered first, then divided, then averaged. T-gamma is only averaged. A mean belongs to the middle of its
            window. It is NaN if the window reaches beyond the run or into the settling. Filtered forces, and whatever
            is computed from them, are NaN at the end of the run, for as long as the filter takes to settle (a period of
            the cut-off for the order 4), since the filter also needs later values. They are NaN at the beginning, too,
            if the run does not start in equilibrium. The attribute `note` says so. A `ModelWarning` is given as well if
            larger values may be in these parts, if nothing is left, or if the run broke off.

        Raises
        ------
        InputError
            For a record without lateral forces, an odd order, a rate of less than 10 per period of the cut-off, or a
            run that is too short.
        """
        from wheeltapper.record.assessment.guidance import guidance

        return guidance(self, cutoff=cutoff, order=order, window=window, settling=settling, rate=rate)

    def running_safety(self, **options: Any) -> xr.Dataset:
        """Return extremes, percentiles (0.15, 50 and 99.85 %) and mean of what `guidance` returns with these options.

        They lie along the dimension "statistic": "least", "0.15 %", "50 %", "99.85 %", "largest" and "mean".
        """
        from wheeltapper.record.assessment.guidance import statistics

        return statistics(self.guidance(**options))

    def save(self, path: str | Path) -> None:
        """Write the record as netCDF (.nc); it opens in plain xarray, and with `wheeltapper.load`.

        The energy balance of a run on rails takes longer than the run: the file has it only if `energy` was read
        before.
        """
        from wheeltapper.record.saving import save

        path = as_path(path, "path", "a path with the suffix .nc")
        if path.suffix != ".nc":
            raise InputError(str(path), "", f"the suffix {path.suffix!r}", ".nc (netCDF)")
        save(self, path)


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _times_in_seconds(times: Any) -> FloatArray:
    """Return times as an array in s."""
    allowed = 'times in s, or as "1 ms": one, or a list'
    wanted = np.atleast_1d(as_array(times, "times", allowed, "time"))
    if wanted.ndim != 1:
        raise InputError("", "times", value_text(times), allowed)
    return wanted
