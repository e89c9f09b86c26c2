"""A lowered wagon: contacts of treads, and of flanges if they can touch; SI units; the motions of all bodies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.ground.notes import Note
from wheeltapper.lower.contacts import SIDES, Contacts
from wheeltapper.lower.laws.plastic import PlasticLaw
from wheeltapper.lower.lowered import wagon_elements, wagon_energy
from wheeltapper.lower.lowered.base import DECK, ElementEvents, LoweredScenario, Variables, VoidEvents, Works
from wheeltapper.lower.lowered.rails_below import RailsBelow
from wheeltapper.lower.numbers import FINER, SHORTER, SMALL
from wheeltapper.lower.structure import Structure
from wheeltapper.lower.track.anomalies import anomalies_of, arms_of
from wheeltapper.lower.track.reach import modes_of, rolling_modes_of
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common import program, telling
from wheeltapper.march.common.law_columns import PLASTIC_ONSET, PLASTIC_PIECES
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows
from wheeltapper.march.wagon.assembly import HALF, LANES, PLACES, TO_RATE, Assembly
from wheeltapper.march.wagon.remembering import OverMarks

if TYPE_CHECKING:
    from wheeltapper.lower.marks.marks import Surface
    from wheeltapper.lower.marks.wagon_marks import WagonRails
    from wheeltapper.lower.track.anomalies import Void
    from wheeltapper.march.wagon.march import Marched
    from wheeltapper.march.wagon.rails.march import OnRails

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


@dataclass(frozen=True)
class StateLayout:
    """Positions of the bodies of a wagon, and of its deck, in the state."""

    bodies: tuple[str, ...]
    motions: tuple[tuple[str, str], ...]

    @property
    def displacement_places(self) -> NDArray[np.int64]:
        """Index in the state of each motion's displacement."""
        return np.array([self.bodies.index(body) * PLACES + MOTIONS.index(motion) for body, motion in self.motions])

    @property
    def state_count(self) -> int:
        """Number of states of the bodies."""
        return len(self.bodies) * PLACES


@dataclass(frozen=True)
class LoweredWagon(LoweredScenario):
    """An assembly, with the data that are needed to read its results.

    Attributes
    ----------
    scenario
        What was lowered.
    static_force
        Static normal force of each wheel, N, (wheelsets, 2): left, right.
    notes
        What the user should know about the paths.
    length, time, force
        Units of the assembly in m, s and N.
    below
        Rails that give way; None on a stiff track.
    memory
        What the rails remember of contacts that yield; None where wheels meet no marks of others.
    voids
        Below sleepers, in the order of the assembly's lanes.
    """

    chunk = telling.WAGON_CHUNK

    scenario: Scenario
    assembly: Assembly
    layout: StateLayout
    structure: Structure
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]
    length: float = 1.0
    time: float = 1.0
    force: float = 1.0
    below: OnRails | None = None
    memory: WagonRails | None = None
    voids: tuple[Void, ...] = ()

    @property
    def program(self) -> Assembly | OnRails | OverMarks:
        """What is marched."""
        plain = self.assembly if self.below is None else self.below
        return plain if self.memory is None else OverMarks(plain, self.memory)

    @property
    def plastic_laws(self) -> tuple[PlasticLaw, ...]:
        """Of the wheelsets whose treads yield, as if both pressed alike."""
        numbers = self.assembly.numbers[asm.YIELD_LAW :]
        if not numbers[PLASTIC_PIECES]:
            return ()
        constant = 2.0 * self.contact_constant
        law = PlasticLaw.over_onset(self.assembly.law, float(numbers[PLASTIC_ONSET]), constant)
        return (law,) * len(self.static_force)

    @property
    def semi_axis(self) -> float:
        """Semi-axis of the patch of the first wheelset's wheels along the rail, m."""
        from wheeltapper.lower.marks.wagon_marks import semi_axis_of

        return semi_axis_of(self.scenario, float(self.static_force[0].mean()))

    def surfaces_left(self, march: Marched, way: float) -> list[Surface]:
        """Return both rails after a run in which wheels met the marks of those before them."""
        from wheeltapper.lower.marks.wagon_marks import wagon_rails

        both = wagon_rails(self.scenario, march.assembly, (), self.semi_axis).begin()
        both.press(march)
        return [rail.left() for rail in both.sides]

    def pressed(
        self, march: Marched, contact: int, times: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return how deep a contact is at times, s, what earlier ones have left there, m, and if it yields."""
        from wheeltapper.lower.marks.wagon_marks import lane_of, read_contacts

        rows = read_contacts(march, times)[:, :, lane_of(*divmod(contact, 2))]
        return np.maximum(rows[:, 0], 0.0), rows[:, 1], rows[:, 3] > 0.0

    def slopes_below(self, march: Marched, contact: int, distances: FloatArray) -> FloatArray:
        """Return the slope of a contact's path where it has travelled so far, m."""
        from wheeltapper.lower.marks.wagon_marks import lane_of, path_of

        return path_of(march.assembly, lane_of(*divmod(contact, 2))).slope_at(distances)

    def with_assembly(self, assembly: Assembly) -> Self:
        """Return the same with another assembly."""
        below = None if self.below is None else self.below._replace(assembly=assembly)
        return replace(self, assembly=assembly, below=below)

    def finer(self) -> Self:
        """Return the same with smaller errors of steps, and on rails with shorter macro steps."""
        numbers = self.assembly.numbers.copy()
        numbers[asm.STEP_TOLERANCE] *= FINER
        made = self.with_assembly(self.assembly._replace(numbers=numbers))
        if made.below is None:
            return made
        track = made.below.track
        method = track.method._replace(step=SHORTER * track.method.step)
        return replace(made, below=made.below._replace(track=track._replace(method=method)))

    def perturbed(self, march: Marched, in_velocity: bool) -> tuple[Self, float]:
        """Return the same with a small change of the start of this march, and the size of the change, scaled."""
        named = zip(self.layout.displacement_places, self.layout.motions, strict=True)
        heights = [at for at, (body, motion) in named if motion == "z" and body.startswith("wheelset ")]
        moved, start = np.array(heights) + (TO_RATE if in_velocity else 0), self.assembly.start.copy()
        start[moved] += SMALL / self.assembly.scales[moved]
        return self.with_assembly(self.assembly._replace(start=start)), SMALL * float(np.sqrt(len(moved)))

    def gentlest(self, march: Marched) -> float:
        """Return the smallest rate of indentation at an event of a march, scaled."""
        numbers = self.assembly.numbers
        return march.gentlest() * float(numbers[asm.PULSE]) / float(numbers[asm.STATIC_INDENTATION])

    def margin(self, march: Marched, losses: int) -> tuple[float, float]:
        """Return how far a march is from the `losses`-th loss of any wheel, m, and the static indentation, m."""
        from wheeltapper.lower.lowered.wagon_margin import margin_of, readings_of

        readings = readings_of(march)
        return margin_of(readings, losses), readings.static

    def scaled_end(self, march: Marched) -> FloatArray:
        """Return the scaled state at the end of a march."""
        states = self.layout.state_count
        return np.asarray(march.state[:states] * self.assembly.scales[:states])

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

    def variables(self, march: Marched, times: FloatArray) -> Variables:
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

    def works(self, march: Marched) -> Works:
        """Return what contacts, dampers and loads have done."""
        done = wagon_energy.works(self, march)
        return Works(done[1][:, self.contacts.lanes], partial(wagon_energy.balance, self, march, done))

    def missing_part(self, march: Marched) -> float:
        """Return the missing share of the exchanged energy."""
        return wagon_energy.missing_part(self, march)

    def element_events(self, march: Marched) -> ElementEvents:
        """Return events of what is not linear between bodies."""
        return wagon_elements.element_events(self, march)

    def void_events(self, march: Marched) -> VoidEvents | None:
        """Return where voids below the halves of sleepers close and open."""
        A = self.assembly
        if not len(A.voids):
            return None
        octet, lane = np.divmod(march.seat_events[:, program.EVENT_CONTACT].astype(int), LANES)
        side, place = np.divmod(lane, HALF)
        seats = np.array([void.seat for void in self.voids])
        return VoidEvents(march.seat_events, seats[(octet - A.wheel_octets) * HALF + place], np.array(SIDES)[side])

    def rails_below(self, march: Marched, method: str) -> RailsBelow:
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
