"""A lowered wagon: contacts of treads, and of flanges if they can touch; SI units; the motions of all bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.lower.contacts import SIDES, Contacts
from wheeltapper.lower.lowered import wagon_energy
from wheeltapper.lower.lowered.base import NO_ELEMENTS, ElementEvents, LoweredScenario, Variables, VoidEvents, Works
from wheeltapper.lower.lowered.rails_below import RailsBelow
from wheeltapper.lower.lowered.wagon_data import DECK, WagonData
from wheeltapper.lower.track.anomalies import anomalies_of, arms_of
from wheeltapper.lower.track.reach import modes_of, rolling_modes_of
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common import program, telling
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows
from wheeltapper.march.wagon.assembly import HALF, LANES, PLACES, TO_RATE

if TYPE_CHECKING:
    from wheeltapper.march.wagon.march import Marched as MarchedWagon

FloatArray = NDArray[np.float64]
ROWS = {
    "normal": wheel_rows.NORMAL, "fx": wheel_rows.FX, "fy": wheel_rows.FY, "mz": wheel_rows.MZ, "g": wheel_rows.ROW_G,
    "slip_x": wheel_rows.SLIP_X, "slip_y": wheel_rows.SLIP_Y, "slip_turn": wheel_rows.SLIP_TURN,
    "delta": wheel_rows.ROW_DELTA, "path": wheel_rows.ROW_PATH, "u": wheel_rows.ROW_U, "rail": wheel_rows.ROW_RAIL,
    "left": wheel_rows.ROW_LEFT,
}  # fmt: skip
"""Quantities of a contact that a record reads, and their rows in the kernels' scratch memory."""


def row_bytes(bodies: int) -> float:
    """Return the memory that a step takes."""
    return 8.0 * (PLACES * (bodies + 1) + asm.STEP_ELEMENTS)


class LoweredWagon(WagonData, LoweredScenario):
    """An assembly, and how its march is read."""

    chunk = telling.WAGON_CHUNK

    @property
    def row_bytes(self) -> float:
        """Memory that each step takes."""
        return row_bytes(len(self.scenario.vehicle.names))

    @property
    def contacts(self) -> Contacts:
        """Treads of all wheels, then their flanges if they can touch."""
        axles = self.scenario.vehicle.axles
        wheelset, side = np.divmod(np.arange(2 * len(axles)), 2)
        treads = wheelset // HALF * LANES + side * HALF + wheelset % HALF
        octets = range(0, self.assembly.wheel_octets, int(self.assembly.numbers[asm.TREADS]))
        return Contacts(
            self.static_force.ravel(), np.repeat([axle.position for axle in axles], 2),
            np.repeat([axle.radius for axle in axles], 2),
            np.concatenate([treads + first * LANES for first in octets]), sides=2,
        )  # fmt: skip

    def variables(self, march: MarchedWagon, times: FloatArray) -> Variables:
        """Return the variables of wheels, and the motions of bodies by name."""
        rows = np.array(list(ROWS.values()), dtype=np.int64)
        states, rates, found = march.at(times, rows)
        found = np.moveaxis(found[:, :, self.contacts.lanes], 1, 0)
        rows_of = dict(zip(ROWS, found, strict=True))
        touching = _wheel_variables(self.scenario, rows_of)
        wheels = 2 * len(self.scenario.vehicle.axles)
        for law in self.plastic_laws[:1]:  # all have the same
            left = law.left_over(rows_of["delta"][:, :wheels], rows_of["left"][:, :wheels])
            touching["permanent_indentation"] = left
        if self.below is not None:
            touching["rail_displacement"] = -rows_of["rail"][:, :wheels] - self.below.sinking.T.ravel()
        out: Variables = {name: (("time", "contact"), values) for name, values in touching.items()}
        shape = (len(times), len(self.layout.bodies), PLACES)
        held, changing = (values[:, : self.layout.state_count].reshape(shape) for values in (states, rates))
        motions = {
            "displacement": held[:, :, : len(MOTIONS)],
            "velocity": held[:, :, TO_RATE : TO_RATE + len(MOTIONS)],
            "acceleration": changing[:, :, TO_RATE : TO_RATE + len(MOTIONS)],
        }
        bodies = [name for name in self.layout.bodies if name != DECK]
        out |= {"body": (("body",), bodies), "motion": (("motion",), list(MOTIONS))}
        out |= {name: (("time", "body", "motion"), values[:, : len(bodies)]) for name, values in motions.items()}
        if DECK in self.layout.bodies:
            out |= {f"deck_{name}": (("time",), values[:, -1, asm.MOTION_Z]) for name, values in motions.items()}
        return out

    def works(self, march: MarchedWagon) -> Works:
        """Return what contacts, dampers and loads have done."""
        done = wagon_energy.works(self, march)
        return Works(done[1][:, self.contacts.lanes], lambda: wagon_energy.balance(self, march, done))

    def missing_part(self, march: MarchedWagon) -> float:
        """Return the missing share of the exchanged energy."""
        return wagon_energy.missing_part(self, march)

    def element_events(self, march: MarchedWagon) -> ElementEvents:
        """Return where dry friction sticks and slides; extension is where its first end goes forth on its direction."""
        sliders = self.structure.sliders
        if not sliders:
            return NO_ELEMENTS
        end = asm.STEP_ELEMENTS + len(self.assembly.element_inside)
        pieces = np.vstack([np.full(len(sliders), asm.STICKS), march.steps[:, end - len(sliders) : end]])
        pieces[pieces > asm.FORTH] = asm.STICKS
        step, which = np.nonzero(pieces[1:] != pieces[:-1])
        places = self.layout.displacement_places[: len(self.structure.motions)] + TO_RATE
        names, rows = np.array([item.name for item in sliders]), np.array([item.row for item in sliders])
        sticks = pieces[step + 1, which] == asm.STICKS
        slides = np.where(sticks, pieces[step, which], pieces[step + 1, which])
        return ElementEvents(
            march.steps[step, asm.STEP_TIME], names[which], (~sticks).astype(np.int64),
            (slides == asm.BACK).astype(np.int64), -(march.states[:, places][step] * rows[which]).sum(axis=1),
        )  # fmt: skip

    def void_events(self, march: MarchedWagon) -> VoidEvents | None:
        """Return where voids below the halves of sleepers close and open."""
        A = self.assembly
        if not len(A.voids):
            return None
        octet, lane = np.divmod(march.seat_events[:, program.EVENT_CONTACT].astype(int), LANES)
        side, place = np.divmod(lane, HALF)
        seats = np.array([void.seat for void in self.voids])
        return VoidEvents(march.seat_events, seats[(octet - A.wheel_octets) * HALF + place], np.array(SIDES)[side])

    def rails_below(self, march: MarchedWagon, method: str) -> RailsBelow:
        """Return what both rails do below the vehicle."""
        assert self.below is not None
        track, below = self.scenario.track, self.below.track
        modes, reach = modes_of(track, method, float(np.ptp(below.places)))
        ways = (section_of(track), modes), (section_of(track, rolling=True), rolling_modes_of(track, reach))
        anomalies = tuple(anomalies_of(track, section, reach.bays) for section, _ in ways)
        residuals = [np.array([port.residual for port in ports]) for ports in below.sleepers]
        arms = [np.ones(below.over_voids), arms_of(track, reach.bays)]
        return RailsBelow(
            ways, anomalies, float(track.first_sleeper), below.places.tolist(), residuals, arms,
            march.rails_below(self.below).at, SIDES[:2],
        )  # fmt: skip


def _wheel_variables(scenario: Scenario, rows: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the variables of each wheel (times, wheels) from the rows of all contacts (times, contacts)."""
    wheels = 2 * len(scenario.vehicle.axles)
    tread = {name: values[:, :wheels] for name, values in rows.items()}
    flange = {
        name: values[:, wheels:] if values.shape[1] > wheels else np.zeros_like(values) for name, values in rows.items()
    }
    speed = max(float(scenario.speed), 1e-300)
    sides = np.tile([1.0, -1.0], wheels // 2)
    law = scenario.creep
    rolls = float(law is not None)
    normal, steep = tread["normal"], np.hypot(1.0, flange["g"])
    along, across = (tread[name] * (normal > 0.0) * rolls for name in ("fx", "fy"))
    on_flange = flange["normal"] > 0.0
    flange_along, flange_across = (flange[name] * on_flange * rolls for name in ("fx", "fy"))
    climb = sides * flange["g"]
    sideways = flange_across / steep - climb * flange["normal"]
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = normal * (1.0 if law is None else law.friction)
        used = np.where(normal > 0.0, np.hypot(along, across) / limit, 0.0)
    losses, spins = zip(*(_t_gamma(on, rolls / speed) for on in (tread, flange)), strict=True)
    return {
        "normal_force": normal,
        "longitudinal_force": along + flange_along,
        "lateral_force": across - sides * tread["g"] * normal + sideways,
        "lateral_creep_force": across,
        "flange_force": flange["normal"] * steep,
        "vertical_force": normal + flange["normal"] + climb * flange_across / steep,
        "spin_moment": tread["mz"] * (normal > 0.0) * rolls,
        "longitudinal_creepage": tread["slip_x"] * rolls / speed,
        "lateral_creepage": tread["slip_y"] * rolls / speed,
        "spin_creepage": tread["slip_turn"] * rolls / speed,
        "friction_use": used,
        "t_gamma": losses[0] + losses[1],
        "flange_t_gamma": losses[1],
        "spin_t_gamma": spins[0] + spins[1],
        "indentation": tread["delta"],
        "constraint": tread["path"],
        "lateral_shift": tread["u"],
    }


def _t_gamma(on: dict[str, FloatArray], over_speed: float) -> tuple[FloatArray, FloatArray]:
    """Return what a contact's slips dissipate over a metre of way, N, and the share of its spin in it."""
    touches = (on["normal"] > 0.0) * over_speed
    spin = -touches * on["mz"] * on["slip_turn"]
    return spin - touches * (on["fx"] * on["slip_x"] + on["fy"] * on["slip_y"]), spin
