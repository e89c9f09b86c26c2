"""From a scenario on rails that give way to a system for the general march: bodies, contacts, paths and the ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.describe.vehicle.plane import PlaneVehicle
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.notes import Note
from wheeltapper.lower import ellipse
from wheeltapper.lower.build import path_table
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.known import check_known
from wheeltapper.lower.numbers import METHODS, Method, hysteresis_factor, units_of
from wheeltapper.lower.plausible import implausible_notes
from wheeltapper.lower.track.reach import Reach, modes_of
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.march.general import contract as general

FloatArray = NDArray[np.float64]
SUDDEN = Note(
    "the track is at rest under the wheels at t = 0, which then move at full speed: what follows in the first 0.1 s or "
    "so is also the answer to this start",
    "sudden start",
)
"""What a start at speed from a static state means."""


@dataclass(frozen=True)
class LoweredOnRails:
    """A task for the general march, with what is needed to read its results.

    Attributes
    ----------
    program
        The task; of two equal rails it has one, with half of the vehicle on it.
    plane
        The vehicle in the vertical plane.
    modes, reach
        The track's modes, and how they were chosen; None on a rigid rail.
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
    """

    program: general.Task
    plane: PlaneVehicle
    modes: TrackModes | None
    reach: Reach | None
    seat: float
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]
    force: float
    length: float = 1.0
    time: float = 1.0


def lower_on_rails(scenario: Scenario, method: str = "default") -> LoweredOnRails:
    """Lower a scenario to a task of the general march."""
    check_known(scenario)
    plane, track = scenario.vehicle.plane, scenario.track
    rails = float(plane.rails)
    modes, reach, seat = None, None, 0.0
    if isinstance(track, SupportedRail):
        modes, reach = modes_of(track, method, plane.extent)
        seat = float(track.first_sleeper)
    each = [units_of(Fields(_alone(scenario, wheelset))) for wheelset in plane.wheelsets]
    forces = np.array([float(units.static_force) for units in each])
    contacts, notes = _contacts(scenario, plane, METHODS[method], seat)
    count, wheels = len(plane.freedoms), len(plane.wheelsets)
    shapes = np.eye(count, wheels)
    bodies = general.Bodies(
        plane.mass / rails, plane.damping / rails, plane.stiffness / rails, shapes, shapes @ forces / rails
    )
    system = general.System(bodies, contacts, float(scenario.speed), None if modes is None else modes.ring)
    task = general.Task(system, general.METHODS[method], float(scenario.duration), forces / rails)
    said = (*implausible_notes(scenario), *notes, *(() if reach is None else reach.notes))
    if modes is not None and scenario.speed > 0.0:
        said = (*said, SUDDEN)
    constant = float(each[0].contact_constant)
    return LoweredOnRails(task, plane, modes, reach, seat, forces, constant, said, rails)


def _alone(scenario: Scenario, wheelset: Wheelset) -> Scenario:
    """Return one wheelset with the scenario's contact, on a stiff level track."""
    return Scenario(vehicle=wheelset, contact=scenario.contact, speed=scenario.speed, duration=scenario.duration)


def _contacts(
    scenario: Scenario, plane: PlaneVehicle, method: Method, seat: float
) -> tuple[tuple[general.Contact, ...], list[Note]]:
    """Return the contacts of all wheelsets, and notes on their paths."""
    end = float(scenario.speed * scenario.duration)
    out, notes = list[general.Contact](), list[Note]()
    for number, (wheelset, position) in enumerate(zip(plane.wheelsets, plane.positions, strict=True), 1):
        items = scenario.irregularities_on(number, "left")
        courses = [item.course(wheelset.radius).moved(-position) for item in items]
        factor = ellipse.factor_function(scenario.contact, wheelset)
        table, said = path_table(courses, end, method, scenario.rolling, wheelset.radius, factor)
        out.append(
            general.Contact(
                table.rows, _law(_alone(scenario, wheelset), float(plane.rails)), position - seat, 0.0, table.loop,
                table.loop_join,
            )
        )  # fmt: skip
        several = f"wheelset {number}, x from {position:g} m: " if len(plane.wheelsets) > 1 else ""
        notes += [note.reworded(f"{several}{note}") for note in said]
    return tuple(out), notes


def _law(alone: Scenario, rails: float) -> general.Law:
    """Return the law of one rail's part of a wheelset's contact."""
    constant = float(units_of(Fields(alone)).contact_constant) / rails
    if isinstance(alone.contact, Linear):
        return general.linear(constant)
    loss = float(hysteresis_factor(Fields(alone)))
    return general.hunt_crossley(constant, loss) if loss else general.hertz(constant)
