"""A lowered vehicle in the vertical plane: contacts per wheelset, SI units, the motions in the vertical plane."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.plane import PlaneVehicle, end_name
from wheeltapper.ground.needs import YIELDING
from wheeltapper.ground.notes import Note
from wheeltapper.lower import extent
from wheeltapper.lower.contacts import Contacts
from wheeltapper.lower.laws.plastic import PlasticLaw, patch_semi_axis
from wheeltapper.lower.lowered.base import DECK, ElementEvents, LoweredScenario, Variables, VoidEvents, Works
from wheeltapper.lower.lowered.plane_dampers import damper_motion, stops_met
from wheeltapper.lower.lowered.plane_elements import element_events, element_motion
from wheeltapper.lower.lowered.rails_below import RailsBelow
from wheeltapper.lower.marks.marks import SAMPLES, Surface
from wheeltapper.lower.marks.rail_memory import RailMemory
from wheeltapper.lower.numbers import SHORTER, SMALL
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.lower.track.anomalies import NONE, Anomalies
from wheeltapper.lower.track.irregular import IrregularModes
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common import program as contract
from wheeltapper.march.common import telling
from wheeltapper.march.common.law_columns import PLASTIC_CONSTANT, PLASTIC_ONSET
from wheeltapper.march.common.program import IntArray
from wheeltapper.march.general import contract as general
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.layout import ROW
from wheeltapper.march.general.tables import longest_step

if TYPE_CHECKING:
    from wheeltapper.march.general.task import Marched

FloatArray = NDArray[np.float64]
WHEELSET = ("wheel_displacement", "wheel_velocity", "wheel_acceleration")
"""Variables of the motion of a wheelset's centre; other freedoms have variables of their own names."""
MOTIONS = ("", "_velocity", "_acceleration")
"""What follows a freedom's name: its displacement or rotation, and the two derivatives."""
DECK_MOTIONS = "_displacement", "_velocity", "_acceleration"


class Stop(NamedTuple):
    """A contact between a wheelset and the end of its damper, in which there is play.

    Attributes
    ----------
    wheelset
        Its number, from zero.
    sides
        Of the stops that this contact is: 1 for the upper one, -1 for the lower one.
    law
        Of one rail's part.
    shape
        What each freedom adds to what is pressed together, (freedoms,).
    gap
        To be closed before there is a force, m.
    """

    wheelset: int
    sides: tuple[int, ...]
    law: general.Law
    shape: FloatArray
    gap: float


def plastic_of(law: general.Law, rails: float) -> PlasticLaw:
    """Return the plastic law of a wheelset on so many equal rails."""
    constant, onset = law.numbers[[PLASTIC_CONSTANT - 1, PLASTIC_ONSET - 1]].tolist()
    return PlasticLaw.over_onset(law.table, onset, constant * rails)


@dataclass(frozen=True)
class LoweredPlane(LoweredScenario):
    """A task for the general march, with what is needed to read its results.

    Attributes
    ----------
    scenario
        What was lowered.
    program
        The task; of two equal rails it has one, with half of the vehicle on it.
    plane
        The vehicle in the vertical plane.
    modes, anomalies
        The track's modes, None on a rigid rail, and what is not regular on it.
    seat
        Position of the seat from which the march counts, m.
    static_force
        Of each wheelset, N.
    contact_constant
        Of the first wheelset, N/m^1.5, if linear N/m.
    notes
        What the user should know about track and paths.
    length, time
        Units of the program in m and s.
    force
        Force of a wheelset for a force of one of the program, N: the number of rails.
    stops
        Of the dampers with play: the last contacts of the task but those of the plane's elements.
    paths
        Tables of the wheelsets' paths.
    """

    chunk = telling.GENERAL_CHUNK
    balance_is_dear = True

    scenario: Scenario
    program: general.Task
    plane: PlaneVehicle
    modes: TrackModes | IrregularModes | None
    seat: float
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]
    force: float
    stops: tuple[Stop, ...] = ()
    anomalies: Anomalies = NONE
    paths: tuple[PathTable, ...] = ()
    length: float = 1.0
    time: float = 1.0

    @property
    def has_ends(self) -> bool:
        """Whether the damper of any wheelset has an end of its own."""
        return any(wheelset.damper_end for wheelset in self.plane.wheelsets)

    @property
    def first_stop(self) -> int:
        """Number of the first contact that is a stop of a damper's end."""
        return len(self.plane.wheelsets) + len(self.anomalies.voids)

    @property
    def first_element(self) -> int:
        """Number of the first contact that is an element of a suspension."""
        return self.first_stop + len(self.stops)

    @property
    def plastic_laws(self) -> tuple[PlasticLaw, ...]:
        """Of the wheelsets whose contacts yield."""
        laws = (wheel.law for wheel in self.program.system.wheels)
        return tuple(plastic_of(law, self.force) for law in laws if law.kind == switch.PLASTIC)

    @property
    def semi_axis(self) -> float:
        """Semi-axis of the patch of the leading wheelset along the rail, m."""
        return patch_semi_axis(self.scenario.contact, self.plane.wheelsets[0], float(self.static_force.max()))

    def surfaces_left(self, march: Marched, way: float) -> list[Surface]:
        """Return the rail after a run over some way, m, in which wheels met the marks of those before them."""
        contact, positions, laws = self.scenario.contact, np.array(self.plane.positions), self.plastic_laws
        axis = patch_semi_axis(contact, self.plane.wheelsets[0], float(self.static_force[0]))
        onset = laws[int(np.argmax(positions))].onset
        virgin = Surface.virgin_surface(self.plane.extent + way, axis, onset, SAMPLES)
        offsets = tuple((positions - positions.min()).tolist())
        marking = RailMemory(laws, offsets, contact.share_of_rail, 1.0, virgin, (), way).begin()
        march.lay(marking)
        return [marking.left()]

    def pressed(
        self, march: Marched, contact: int, times: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return how deep a contact is at times, s, what earlier ones have left there, m, and if it yields."""
        return march.pressed(contact, times)

    def slopes_below(self, march: Marched, contact: int, distances: FloatArray) -> FloatArray:
        """Return the slope of a contact's path where it has travelled so far, m."""
        return march.path_slopes(contact, distances)

    def finer(self) -> Self:
        """Return the same with shorter macro steps where a track gives way; else no kink makes a step less exact."""
        task = self.program
        if task.system.ring is None:
            return self
        return replace(self, program=task._replace(method=task.method._replace(step=SHORTER * task.method.step)))

    def perturbed(self, march: Marched, in_velocity: bool) -> tuple[Self, float]:
        """Return the same with a small change of the start of this march, and the size of the change, scaled."""
        task, speeds = self.program, self.speeds(march)
        bodies, wheels = task.system.bodies, len(self.static_force)
        began, freedoms = march.start, len(bodies.mass)
        height = began[:wheels] + march.sinking[:wheels]  # below that of first touch
        start = -np.stack([height, began[freedoms : freedoms + wheels]])
        start[int(in_velocity)] += SMALL * (speeds.mean() if in_velocity else march.static_indentation)
        system = task.system._replace(bodies=bodies._replace(raised=start))
        return replace(self, program=task._replace(system=system)), SMALL * float(np.sqrt(wheels))

    def gentlest(self, march: Marched) -> float:
        """Return the smallest rate of indentation at an event of a march, scaled."""
        return march.gentlest(self.speeds(march))

    def scaled_end(self, march: Marched) -> FloatArray:
        """Return the scaled state at the end of a march."""
        scale = np.full(len(march.state), float(self.speeds(march).mean()))
        scale[: len(self.plane.freedoms)] = march.static_indentation
        return np.asarray(march.state / scale)

    def speeds(self, march: Marched) -> FloatArray:
        """Return the static indentation δ0 over the time sqrt(m·δ0/N0) of each wheelset, m/s."""
        mass = np.diag(self.plane.mass)[: len(self.static_force)]
        return np.sqrt(march.static_indentation * self.static_force / mass)

    @property
    def row_bytes(self) -> float:
        """Memory that each macro step takes."""
        return float(ROW.itemsize) * len(self.plane.positions)

    def check_room(self) -> None:
        """Refuse a duration whose log cannot fit in memory."""
        task = self.program
        longest = longest_step(task.system.ring, task.method, task.system.bodies)
        extent.check_duration(self.scenario, task.duration / longest, self.row_bytes)

    @property
    def contacts(self) -> Contacts:
        """A contact for each wheelset."""
        positions = np.array(self.plane.positions)
        radius = np.array([wheelset.radius for wheelset in self.plane.wheelsets], dtype=float)
        return Contacts(self.static_force, positions, radius, np.arange(len(positions)), sides=1)

    def forces(self, march: Marched, times: FloatArray) -> FloatArray:
        """Return the normal forces of all contacts, without all else."""
        return march.forces(times)[:, : len(self.plane.wheelsets)] * self.force

    def variables(self, march: Marched, times: FloatArray) -> Variables:
        """Return all variables but what the track does elsewhere."""
        found = march.at(times)
        wheels = len(self.plane.wheelsets)
        along, touching = ("time",), ("time", "contact")
        sinking = march.sinking[:wheels]  # below the height of first touch
        motions = (-found.displacement, -found.velocity, -found.acceleration)
        out: Variables = {
            name: (touching, values[:, :wheels] - (sinking if name == WHEELSET[0] else 0.0))
            for name, values in zip(WHEELSET, motions, strict=True)
        }
        out |= {
            "normal_force": (touching, found.force[:, :wheels] * self.force),
            "indentation": (touching, found.indentation[:, :wheels]),
            "constraint": (touching, found.path[:, :wheels]),
        }
        if YIELDING in self.scenario.needs:
            left = [
                law.left_over(found.indentation[:, wheel], march.left_before(wheel, times))
                for wheel, law in enumerate(self.plastic_laws)
            ]
            out["permanent_indentation"] = touching, np.stack(left, axis=1)
        if self.modes is not None:
            out["rail_displacement"] = touching, -found.rail[:, :wheels]
        if self.has_ends:
            place, force = damper_motion(self, march, times, found)
            out |= {"damper_end_displacement": (touching, place), "damper_force": (touching, force)}
        out |= element_motion(self, found)
        ends = [end_name(i) for i in range(wheels)]
        for freedom in range(wheels, len(self.plane.freedoms)):
            if self.plane.freedoms[freedom] in ends:
                continue
            name = self.plane.freedoms[freedom].replace(" ", "_")
            for after, values in zip(DECK_MOTIONS if name == DECK else MOTIONS, motions, strict=True):
                out[name + after] = along, values[:, freedom]
        return out

    def works(self, march: Marched) -> Works:
        """Return what contacts, dampers, loads and track have done."""
        from wheeltapper.lower.lowered.plane_energy import balance

        return Works(march.impulses() * self.force, partial(balance, self, march))

    def missing_part(self, march: Marched) -> float:
        """Return zero of a run in numbers: no part is accepted unsolved, and the balance takes longer than the run."""
        return 0.0 if march.is_solved else np.nan

    def stops_met(self, march: Marched) -> tuple[FloatArray, IntArray]:
        """Return the table of the stops that dampers' ends meet, and their wheelsets."""
        return stops_met(self, march)

    def element_events(self, march: Marched) -> ElementEvents:
        """Return all elements' events."""
        return element_events(self, march)

    def void_events(self, march: Marched) -> VoidEvents | None:
        """Return where voids below sleepers close and open; a rate is that of the sleeper, downwards."""
        if not self.anomalies.voids:
            return None
        rows = march.seat_events[march.seat_events[:, contract.EVENT_CONTACT] < len(self.anomalies.voids)]
        seats = np.array([void.seat for void in self.anomalies.voids])
        return VoidEvents(rows, seats[rows[:, contract.EVENT_CONTACT].astype(int)])

    def rails_below(self, march: Marched, method: str) -> RailsBelow:
        """Return what the rail does below the vehicle."""
        from wheeltapper.march.wagon.rails.replay import RailAt

        assert self.modes is not None
        system = self.program.system

        def at(times: FloatArray, bends: bool) -> list[RailAt]:
            shown, found, moved = march.at(times), march.modes(times, bends), march.moved(times)
            return [RailAt(found, *shown[:3], None if moved is None else moved[:3])]

        return RailsBelow(
            ((section_of(self.scenario.track), self.modes),), (self.anomalies,), self.seat,
            [one.position for one in system.wheels], [np.array([port.residual for port in system.ports])],
            [np.ones(len(system.ports))], at,
        )  # fmt: skip
