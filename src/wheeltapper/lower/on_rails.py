"""From a scenario on rails that give way to a system for the general march: bodies, contacts, paths and the ring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.law import Law
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.describe.vehicle.plane import PlaneVehicle
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.notes import Note
from wheeltapper.lower import ellipse
from wheeltapper.lower.build import path_table
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.known import check_known
from wheeltapper.lower.numbers import METHODS, Method, hysteresis_factor, units_of
from wheeltapper.lower.own_law import tabulated_law
from wheeltapper.lower.plausible import implausible_notes
from wheeltapper.lower.table import PathTable, blank_rows
from wheeltapper.lower.track.anomalies import NONE, Anomalies, Void, anomalies_of, check_seats
from wheeltapper.lower.track.irregular import IrregularModes
from wheeltapper.lower.track.reach import Reach, critical_speed, cutoff_note, modes_of
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import section_of
from wheeltapper.march import program as contract
from wheeltapper.march.general import contract as general
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import MOST_PHASES, longest_step

FloatArray = NDArray[np.float64]
GENERAL_METHODS = {"default": general.DEFAULT, "strict": general.STRICT}
TABLE_BYTES = 50.0
"""Memory for each place in a bay, node and mode, while tables of single precision are made."""
DOUBTFUL_TABLE = 1e-5
"""Error of a law's table from which on its note is a warning."""
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
    paths
        Tables of the wheelsets' paths.
    """

    program: general.Task
    plane: PlaneVehicle
    modes: TrackModes | IrregularModes | None
    seat: float
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]
    force: float
    anomalies: Anomalies = NONE
    paths: tuple[PathTable, ...] = ()
    length: float = 1.0
    time: float = 1.0


def lower_on_rails(scenario: Scenario, method: str = "default") -> LoweredOnRails:
    """Lower a scenario to a task of the general march."""
    check_known(scenario)
    vehicle = on_wheels(scenario)
    under = under_wheels(scenario, vehicle.plane.extent, method)
    way = float(scenario.speed * scenario.duration)
    recurring = checked_way(scenario, vehicle.plane, under, float(scenario.speed), way, method)
    tables, notes = paths_of(scenario, vehicle.plane, way, METHODS[method])
    system = system_of(vehicle, under, tables, float(scenario.speed))
    task = general.Task(system, GENERAL_METHODS[method], float(scenario.duration))
    said = (*implausible_notes(scenario), *vehicle.notes, *notes)
    if under.reach is not None:
        said = (*said, *under.reach.notes, *recurring, *_excitation_note(scenario, vehicle.plane, under.reach))
    if under.modes is not None and scenario.speed > 0.0:
        said = (*said, SUDDEN)
    return LoweredOnRails(
        task, vehicle.plane, under.modes, under.seat, vehicle.static_force, vehicle.contact_constant, said,
        float(vehicle.plane.rails), under.anomalies, tuple(tables),
    )  # fmt: skip


class OnWheels(NamedTuple):
    """A vehicle, and its contact laws: what the march is told of them.

    Attributes
    ----------
    plane
        The vehicle in the vertical plane.
    bodies, laws
        Of one of its equal rails.
    static_force
        Of each wheelset, N.
    contact_constant
        Of the first wheelset, N/m^1.5, if linear N/m.
    notes
        On the laws.
    """

    plane: PlaneVehicle
    bodies: general.Bodies
    laws: tuple[general.Law, ...]
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]


def on_wheels(scenario: Scenario) -> OnWheels:
    """Return the vehicle of a scenario, with its contact laws."""
    plane = scenario.vehicle.plane
    rails = float(plane.rails)
    forces = np.array([wheelset.weight for wheelset in plane.wheelsets])
    laws = [law_of(scenario, wheelset, rails) for wheelset in plane.wheelsets]
    shapes = np.eye(len(plane.freedoms), len(plane.wheelsets))
    bodies = general.Bodies(
        plane.mass / rails, plane.damping / rails, plane.stiffness / rails, shapes, shapes @ forces / rails
    )
    return OnWheels(plane, bodies, tuple(law for law, _, _ in laws), forces, laws[0][1], laws[0][2])


class UnderWheels(NamedTuple):
    """A track below a vehicle.

    Attributes
    ----------
    modes
        None on a rigid rail.
    reach
        How they were chosen.
    seat
        Position of the seat from which the march counts, m.
    anomalies
        What is not regular.
    """

    modes: TrackModes | IrregularModes | None = None
    reach: Reach | None = None
    seat: float = 0.0
    anomalies: Anomalies = NONE


def under_wheels(scenario: Scenario, extent: float, method: str) -> UnderWheels:
    """Return the track of a scenario below a vehicle so long, m."""
    track = scenario.track
    if not isinstance(track, SupportedRail):
        return UnderWheels()
    modes, reach = modes_of(track, method, extent)
    return UnderWheels(
        modes, reach, float(track.first_sleeper), anomalies_of(track, section_of(track), reach.bays)
    )  # fmt: skip


def checked_way(
    scenario: Scenario, plane: PlaneVehicle, under: UnderWheels, speed: float, way: float, method: str
) -> tuple[Note, ...]:  # fmt: skip
    """Refuse a speed or a way, m, that the track's tables do not take; return notes on how its anomalies recur."""
    if under.modes is None or under.reach is None:
        return ()
    places = plane.positions
    check_speed(speed, scenario.track, under.modes.ring, GENERAL_METHODS[method], way)
    return check_seats(scenario.track, under.reach.bays, min(places) - under.seat, max(places) + way - under.seat)


def system_of(vehicle: OnWheels, under: UnderWheels, tables: Sequence[PathTable], speed: float) -> general.System:
    """Return a vehicle on its paths and its track as the march takes it."""
    modes, contacts = under.modes, contacts_of(tables, vehicle, under.seat)
    ring = None if modes is None else modes.ring
    if not isinstance(modes, IrregularModes):
        return general.System(vehicle.bodies, contacts, speed, ring)
    ports = tuple(_port(modes, void) for void in under.anomalies.voids)
    bodies = vehicle.bodies._replace(shapes=np.pad(vehicle.bodies.shapes, ((0, 0), (0, len(ports)))))
    return general.System(bodies if ports else vehicle.bodies, contacts + ports, speed, ring)


def shortest_wave(scenario: Scenario, plane: PlaneVehicle) -> float | None:
    """Return the shortest wave of the irregularities, m; None where none is told."""
    waves = [item.shortest_wave(plane.wheelsets[0].radius) for item in scenario.irregularities]
    return min((length for length in waves if length is not None), default=None)


def _excitation_note(scenario: Scenario, plane: PlaneVehicle, reach: Reach) -> tuple[Note, ...]:
    """Return a note where the irregularities excite more than the modes of the track know."""
    length = shortest_wave(scenario, plane)
    note = cutoff_note(reach, float(scenario.speed) / length) if length is not None else None
    return () if note is None else (note,)


def _port(modes: IrregularModes, void: Void) -> general.Contact:
    """Return the contact between a sleeper and the ballast below a void; its force presses the sleeper up."""
    place = void.seat % len(modes.sleeper)
    level = blank_rows(1)
    level[0, [contract.START, contract.STOP]] = -np.inf, np.inf
    law = general.Law(switch.LINEAR_LAW, np.array([void.stiffness]))
    if void.damping > 0.0:
        law = general.Law(switch.KELVIN, np.array([void.stiffness, void.damping]))
    port = general.Port(
        -modes.sleeper[place], -modes.sleeper_drive[place], void.gap, float(modes.sleeper_residual[place])
    )
    return general.Contact(level, law, loop=1, port=port)


def check_speed(speed: float, track: SupportedRail, ring: Ring, method: general.Method, way: float = 0.0) -> None:
    """Refuse a speed above that of the rail's waves, or so low that the tables for its places in a bay do not fit.

    `way` is what the wheels go, m, where bays differ.
    """
    fastest = critical_speed(section_of(track))
    if speed >= fastest:
        raise InputError(
            "", "speed", f"{speed:g} m/s", f"less than {fastest:.4g} m/s, at which waves go along the rail"
        )
    if speed == 0.0:
        return
    places = ring.spacing / (ring.seats * speed * longest_step(ring, method))
    found = f"{speed:g} m/s on rails, with tables for {places:.3g} places in a bay"
    if places > MOST_PHASES:
        slowest = 1.01 * speed * places / MOST_PHASES
        raise InputError("", "speed", found, f"0 m/s, or at least {slowest:.2g} m/s")
    bays = min(float(ring.seats), way / track.spacing + 1.0)  # whose tables differ
    needed = bays * places * method.nodes * len(ring.rates) * TABLE_BYTES * (1.0 if method.single else 2.0)
    check_room("speed", found, needed, lambda share: f"0 m/s, or at least {speed / share:.2g} m/s")


def paths_of(
    scenario: Scenario, plane: PlaneVehicle, end: float, method: Method
) -> tuple[list[PathTable], list[Note]]:  # fmt: skip
    """Return the paths of all wheelsets until the vehicle has come to x = `end`, m, and notes on them."""
    out, notes = list[PathTable](), list[Note]()
    for number, (wheelset, position) in enumerate(zip(plane.wheelsets, plane.positions, strict=True), 1):
        items = scenario.irregularities_on(number, "left")
        courses = [item.course(wheelset.radius).moved(-position) for item in items]
        factor = ellipse.factor_function(scenario.contact, wheelset)
        table, said = path_table(courses, end, method, scenario.rolling, wheelset.radius, factor)
        out.append(table)
        several = f"wheelset {number}, x from {position:g} m: " if len(plane.wheelsets) > 1 else ""
        notes += [note.reworded(f"{several}{note}") for note in said]
    return out, notes


def contacts_of(tables: Sequence[PathTable], vehicle: OnWheels, seat: float) -> tuple[general.Contact, ...]:
    """Return the contacts of all wheelsets on their paths; the march counts from a seat."""
    return tuple(
        general.Contact(table.rows, law, position - seat, 0.0, table.loop, table.loop_join)
        for table, law, position in zip(tables, vehicle.laws, vehicle.plane.positions, strict=True)
    )


def law_of(scenario: Scenario, wheelset: Wheelset, rails: float) -> tuple[general.Law, float, tuple[Note, ...]]:
    """Return the law of one rail's part of a wheelset's contact, the wheelset's constant, and notes on the law."""
    contact = scenario.contact
    if isinstance(contact, Law):
        law, table = tabulated_law(contact, rails)
        text = f"the table of the contact's law differs from the function by at most {table.error:.2g} of its force"
        note = Note(text, "own law", table.error, doubtful=table.error > DOUBTFUL_TABLE)
        return law, table.constant, (note,)
    alone = Fields(Scenario(vehicle=wheelset, contact=contact, speed=scenario.speed, duration=scenario.duration))
    constant = float(units_of(alone).contact_constant)
    if isinstance(contact, Linear):
        return general.Law(switch.LINEAR_LAW, np.array([constant / rails])), constant, ()
    loss = float(hysteresis_factor(alone))
    if loss:
        return general.Law(switch.HUNT_CROSSLEY, np.array([constant / rails, loss])), constant, ()
    return general.Law(switch.HERTZ, np.array([constant / rails])), constant, ()
