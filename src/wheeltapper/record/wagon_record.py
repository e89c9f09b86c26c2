"""The record of a wagon's run: tables with a wheelset and a side, motions of all bodies, the dense solution."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.ground.arguments import check_choice
from wheeltapper.ground.outcome import Outcome
from wheeltapper.ground.progress import report, watched
from wheeltapper.lower.wagon import DECK, LoweredWagon
from wheeltapper.march import assembly as asm
from wheeltapper.march import program, run
from wheeltapper.march.assembly import HALF, LANES, PLACES, TO_RATE
from wheeltapper.record.labels import EVENT_KINDS, WAGON, dataset
from wheeltapper.record.record import OUTCOMES, Record

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.multibody import MultibodyMarch

FloatArray = NDArray[np.float64]
SIDES = ("left", "right")
"""Names of the two sides, in the order of the kernels."""


class WagonRecord(Record):
    """Results of a simulation of a wagon; every table is an `xarray.Dataset` in SI units.

    Tables of events, peaks and impacts have columns for the wheelset (from 1) and the side. Histories have them as
    axes, and contain the motions of the bodies by name.
    """

    _share = "wheel"
    _lowered: LoweredWagon  # type: ignore[assignment]
    _march: MultibodyMarch  # type: ignore[assignment]

    def __init__(self, scenario: Scenario, method: str, lowered: LoweredWagon, march: MultibodyMarch) -> None:
        super().__init__(scenario, method, lowered, march)  # type: ignore[arg-type]

    @property
    def outcome(self) -> Outcome:
        """Outcome of the computation."""
        return Outcome.DERAILED if self._march.status == asm.DERAILED else OUTCOMES[self._march.status]

    @property
    def end(self) -> float:
        """End of the computed time, s."""
        return self._march.end

    @property
    def static_force(self) -> float:
        """Static normal force of the most heavily loaded wheel, N; `static_forces` has all."""
        return float(self._lowered.static_force.max())

    @property
    def static_forces(self) -> xr.DataArray:
        """Static normal force of each wheel, N."""
        import xarray as xr

        axes = {"wheelset": self._wheelsets, "side": list(SIDES)}
        return xr.DataArray(
            self._lowered.static_force, axes, ("wheelset", "side"),
            attrs={"units": "N", "long_name": "static normal force, per wheel"},
        )  # fmt: skip

    @property
    def contact_constant(self) -> float:
        """Contact constant of a wheel in its middle position, N/m^1.5."""
        return self._lowered.contact_constant

    @property
    def _wheelsets(self) -> list[int]:
        return list(range(1, len(self.scenario.vehicle.axles) + 1))

    # -- tables ---------------------------------------------------------------------------------------------------

    def _where(self, contact: FloatArray) -> dict[str, Any]:
        """Return the columns that identify the wheel of each number of a contact."""
        lane = contact.astype(int)
        treads = int(self._lowered.assembly.numbers[asm.TREADS])
        octet = lane // LANES % treads
        wheelset = octet * HALF + lane % HALF + 1
        return {
            "contact": 2 * (wheelset - 1) + lane % LANES // HALF,
            "wheelset": wheelset,
            "side": np.array(SIDES)[lane % LANES // HALF],
            "surface": np.array(["tread", "flange"])[lane // LANES // treads],
        }

    @cached_property
    def events(self) -> xr.Dataset:
        """Losses of contact and impacts: time, kind, wheelset, side, position, indentation rate."""
        rows = self._march.events
        where = self._where(rows[:, program.EVENT_CONTACT])
        places = np.array([axle.position for axle in self.scenario.vehicle.axles])
        return dataset(
            "event",
            time=rows[:, program.EVENT_TIME],
            kind=np.array(EVENT_KINDS)[rows[:, program.EVENT_KIND].astype(int)],
            position=self.scenario.speed * rows[:, program.EVENT_TIME] + places[where["wheelset"] - 1],
            indentation_rate=rows[:, program.EVENT_RATE],
            **where,
        )

    @cached_property
    def peaks(self) -> xr.Dataset:
        """Maxima of the contact forces; `corner` is True if a kink of the input causes the maximum."""
        rows = self._march.peaks
        return dataset(
            "peak",
            time=rows[:, program.PEAK_TIME],
            normal_force=rows[:, program.PEAK_FORCE],
            corner=rows[:, program.PEAK_CORNER] == 1.0,
            **self._where(rows[:, program.PEAK_CONTACT]),
        )

    @cached_property
    def impacts(self) -> xr.Dataset:
        """Impacts with what follows each on the same wheel: closing speed, largest force until the next, and so on."""
        events, peaks = self.events, self.peaks
        columns: dict[str, list[Any]] = {
            name: [] for name in (*IMPACT_COLUMNS, "contact", "wheelset", "side", "surface")
        }
        lanes = self._march.events[:, program.EVENT_CONTACT].astype(int)
        peak_lanes = self._march.peaks[:, program.PEAK_CONTACT].astype(int)
        for lane in np.unique(lanes):
            mine = events.isel(event=lanes == lane)
            peak_times, forces = (peaks[name].values[peak_lanes == lane] for name in ("time", "normal_force"))
            is_impact = mine.kind.values == "impact"
            time, losses = mine.time.values[is_impact], mine.time.values[~is_impact]
            count = len(time)
            until = np.append(time[1:], self.end)[:count]
            ends = np.append(losses, np.nan)[np.minimum(np.searchsorted(losses, time, side="right"), len(losses))]
            largest = np.array([
                forces[(peak_times >= a) & (peak_times < b)].max(initial=-np.inf)
                for a, b in zip(time, until, strict=True)
            ]).reshape(-1)  # fmt: skip
            largest[np.isneginf(largest)] = np.nan
            missing = np.full(min(count, 1), np.nan)
            held = {
                "time": time, "closing_speed": mine.indentation_rate.values[is_impact], "peak_force": largest,
                "duration": ends - time, "impulse": self._impulses_of(lane, time, ends),
                "interval": np.append(np.diff(time), missing),
                "force_ratio": np.append(largest[:-1] / largest[1:], missing),
            }  # fmt: skip
            for name, values in (held | self._where(np.full(count, float(lane)))).items():
                columns[name] += list(values)
        order = np.argsort(columns["time"], kind="stable")
        return dataset("impact", **{name: np.array(values)[order] for name, values in columns.items()})

    def _impulses_of(self, lane: int, start: FloatArray, end: FloatArray) -> FloatArray:
        begins = self._march.steps[:, asm.STEP_TIME]
        total = np.append(0.0, np.cumsum(self._works[1][:, lane]))
        margin = 1e-12 * max(self.end, 1e-300)
        first = np.searchsorted(begins, start - margin)
        last = np.searchsorted(begins, np.nan_to_num(end) - margin)
        return np.where(np.isnan(end), np.nan, total[last] - total[first])

    # -- the dense solution -----------------------------------------------------------------------------------------

    @property
    def _sample_columns(self) -> int:
        assembly = self._lowered.assembly
        return 4 * len(assembly.start) + 3 * len(ROWS) * LANES * len(assembly.kinds)

    def _labelled_at(self, wanted: FloatArray) -> xr.Dataset:
        import xarray as xr

        from wheeltapper.march import wheel_rows

        order = np.argsort(wanted, kind="stable")
        names = {name: getattr(wheel_rows, row) for name, row in ROWS.items()}
        states, rates, found = run.replay(
            self._lowered.assembly, self._march, wanted[order], np.array(list(names.values()), dtype=np.int64)
        )
        back = np.argsort(order, kind="stable")
        states, rates, found = states[back], rates[back], found[back]
        by_wheel = dict(zip(names, np.moveaxis(found, 1, 0), strict=True))
        variables: dict[str, Any] = {
            name: (("time", "wheelset", "side"), self._by_wheel(values))
            for name, values in self._forces(by_wheel).items()
        }
        bodies = [name for name in self._lowered.layout.bodies if name != DECK]
        motion = ("time", "body", "motion")
        count = len(bodies)
        moving = self._lowered.layout.states
        shape = (len(wanted), moving // PLACES, PLACES)
        by_body, rates_by_body = states[:, :moving].reshape(shape), rates[:, :moving].reshape(shape)
        six = len(MOTIONS)
        variables |= {
            "displacement": (motion, by_body[:, :count, :six]),
            "velocity": (motion, by_body[:, :count, TO_RATE : TO_RATE + six]),
            "acceleration": (motion, rates_by_body[:, :count, TO_RATE : TO_RATE + six]),
        }
        if DECK in self._lowered.layout.bodies:
            variables |= {
                "deck_displacement": ("time", by_body[:, -1, asm.MOTION_Z]),
                "deck_velocity": ("time", by_body[:, -1, TO_RATE + asm.MOTION_Z]),
                "deck_acceleration": ("time", rates_by_body[:, -1, TO_RATE + asm.MOTION_Z]),
            }
        axes = {
            "time": wanted,
            "wheelset": self._wheelsets,
            "side": list(SIDES),
            "body": bodies,
            "motion": list(MOTIONS),
        }
        out = xr.Dataset(variables, axes)
        for name in out.variables:
            unit, meaning = WAGON.get(str(name), ("", str(name)))
            out[name].attrs = {"units": unit, "long_name": meaning}
        return out

    def _by_wheel(self, lanes: FloatArray) -> FloatArray:
        """Return values of one kind of contacts (times, lanes) by wheelset and side."""
        octets = lanes.shape[1] // LANES
        held = lanes.reshape(len(lanes), octets, 2, HALF)
        return np.swapaxes(held, 2, 3).reshape(len(lanes), octets * HALF, 2)[:, : len(self._wheelsets)]

    def _forces(self, rows: dict[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the record's variables of each wheel from the rows of its contacts."""
        treads = int(self._lowered.assembly.numbers[asm.TREADS]) * LANES
        both = rows["normal"].shape[1] > treads
        tread = {name: values[:, :treads] for name, values in rows.items()}
        flange = {name: values[:, treads:] if both else np.zeros_like(values) for name, values in rows.items()}
        speed = max(float(self.scenario.speed), 1e-300)
        sides = np.tile(np.repeat([1.0, -1.0], HALF), treads // LANES)
        law = self.scenario.creep
        rolls = float(law is not None)
        normal, steep = tread["normal"], np.hypot(1.0, flange["g"])
        along, across = (tread[name] * (normal > 0.0) * rolls for name in ("fx", "fy"))
        on_flange = flange["normal"] > 0.0
        flange_along, flange_across = (flange[name] * on_flange * rolls for name in ("fx", "fy"))
        sideways = flange_across / steep - sides * flange["g"] * flange["normal"]
        with np.errstate(divide="ignore", invalid="ignore"):
            limit = normal * (1.0 if law is None else law.friction)
            used = np.where(normal > 0.0, np.hypot(along, across) / limit, 0.0)
        return {
            "normal_force": normal,
            "longitudinal_force": along + flange_along,
            "lateral_force": across - sides * tread["g"] * normal + sideways,
            "lateral_creep_force": across,
            "flange_force": flange["normal"] * steep,
            "spin_moment": tread["mz"] * (normal > 0.0) * rolls,
            "longitudinal_creepage": tread["slip_x"] * rolls / speed,
            "lateral_creepage": tread["slip_y"] * rolls / speed,
            "spin_creepage": tread["slip_turn"] * rolls / speed,
            "friction_use": used,
            "indentation": tread["delta"],
            "constraint": tread["path"],
            "lateral_shift": tread["u"],
        }

    # -- energy and summary -----------------------------------------------------------------------------------------

    @cached_property
    def _works(self) -> tuple[FloatArray, ...]:
        from wheeltapper.record.wagon_energy import works

        with watched(True):
            report("integrating over every step", 0.0, 0.0)
            return works(self._lowered, self._march, self.scenario)

    @cached_property
    def energy(self) -> xr.Dataset:
        """Energy balance over the whole run, J, with the works of friction and of the drive that keeps the speed."""
        from wheeltapper.record.wagon_energy import balance

        return balance(self._lowered, self._march, self._works, self.scenario)

    def comfort(
        self,
        body: str = "car body",
        at: Sequence[float | str] | None = None,
        rate: float | str = 1000.0,
        *,
        vertical_weighting: str = "Wb",
        settling: float | str = 0.0,
    ) -> xr.Dataset:
        """Return the ride comfort on a body (EN 12299, ISO 2631-1).

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
            The numbers of `wheeltapper.record.comfort.ride_comfort`, each with unit and meaning.

        Raises
        ------
        InputError
            For an unknown body, a point that is not three numbers, another rate, or nothing left after settling.
        """
        from wheeltapper.record.comfort import comfort

        bodies = [name for name in self._lowered.layout.bodies if name != DECK]
        check_choice(body, "body", bodies)
        return comfort(self, body, at, rate, vertical_weighting=vertical_weighting, settling=settling)

    @property
    def time_in_air(self) -> float:
        """Time without contact, the sum over all wheels, s."""
        steps = self._march.steps
        closed = steps[:, asm.STEP_CLOSED].copy()
        total = 0.0
        wheels = np.ravel(self._lowered.assembly.lanes[: int(self._lowered.assembly.numbers[asm.TREADS]), asm.SIDE])
        for side in wheels:
            if side != 0.0:
                total += float(steps[closed % 2.0 == 0.0, asm.STEP_LENGTH].sum())
            closed //= 2.0
        return total

    def _summary(self) -> tuple[int, float | None]:
        """Return the number of impacts, and the ratio of the largest to the static force."""
        forces = self._march.peaks[:, program.PEAK_FORCE]
        impacts = int((self._march.events[:, program.EVENT_KIND] == program.IMPACT).sum())
        return impacts, (float(forces.max() / self.static_force) if len(forces) else None)


IMPACT_COLUMNS = ("time", "closing_speed", "peak_force", "duration", "impulse", "interval", "force_ratio")
"""Columns of the table of impacts."""
ROWS = {
    "normal": "NORMAL", "fx": "FX", "fy": "FY", "mz": "MZ", "g": "ROW_G", "slip_x": "SLIP_X", "slip_y": "SLIP_Y",
    "slip_turn": "SLIP_TURN", "delta": "ROW_DELTA", "path": "ROW_PATH", "u": "ROW_U",
}  # fmt: skip
"""Quantities of a contact that the record reads, and their rows in the kernels' scratch memory."""
