"""From a scenario on rails that give way to a system for the general march: bodies, contacts, paths and the ring."""

from __future__ import annotations

from dataclasses import dataclass

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
from wheeltapper.lower.table import PathTable
from wheeltapper.lower.track.reach import Reach, critical_speed, cutoff_note, modes_of
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import section_of
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
    modes
        The track's modes; None on a rigid rail.
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
    modes: TrackModes | None
    seat: float
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]
    force: float
    paths: tuple[PathTable, ...] = ()
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
    forces = np.array([wheelset.weight for wheelset in plane.wheelsets])
    laws = [law_of(scenario, wheelset, rails) for wheelset in plane.wheelsets]
    if modes is not None:
        _check_speed(float(scenario.speed), track, modes.ring, GENERAL_METHODS[method])
    contacts, paths, notes = _contacts(scenario, plane, METHODS[method], seat, [law for law, _, _ in laws])
    count, wheels = len(plane.freedoms), len(plane.wheelsets)
    shapes = np.eye(count, wheels)
    bodies = general.Bodies(
        plane.mass / rails, plane.damping / rails, plane.stiffness / rails, shapes, shapes @ forces / rails
    )
    system = general.System(bodies, contacts, float(scenario.speed), None if modes is None else modes.ring)
    task = general.Task(system, GENERAL_METHODS[method], float(scenario.duration))
    said = (*implausible_notes(scenario), *laws[0][2], *notes)
    if reach is not None:
        said = (*said, *reach.notes, *_excitation_note(scenario, plane, reach))
    if modes is not None and scenario.speed > 0.0:
        said = (*said, SUDDEN)
    return LoweredOnRails(task, plane, modes, seat, forces, laws[0][1], said, rails, paths)


def _excitation_note(scenario: Scenario, plane: PlaneVehicle, reach: Reach) -> tuple[Note, ...]:
    """Return a note where the irregularities excite more than the modes of the track know."""
    waves = [item.shortest_wave(plane.wheelsets[0].radius) for item in scenario.irregularities]
    lengths = [length for length in waves if length is not None]
    note = cutoff_note(reach, float(scenario.speed) / min(lengths)) if lengths else None
    return () if note is None else (note,)


def _check_speed(speed: float, track: SupportedRail, ring: Ring, method: general.Method) -> None:
    """Refuse a speed above that of the rail's waves, or so low that the tables for its places in a bay do not fit."""
    fastest = critical_speed(section_of(track))
    if speed >= fastest:
        raise InputError(
            "", "speed", f"{speed:g} m/s", f"less than {fastest:.4g} m/s, at which waves go along the rail"
        )
    if speed == 0.0:
        return
    places = ring.spacing / (speed * longest_step(ring, method))
    found = f"{speed:g} m/s on rails, with tables for {places:.3g} places in a bay"
    if places > MOST_PHASES:
        slowest = 1.01 * speed * places / MOST_PHASES
        raise InputError("", "speed", found, f"0 m/s, or at least {slowest:.2g} m/s")
    needed = places * method.nodes * len(ring.rates) * TABLE_BYTES * (1.0 if method.single else 2.0)
    check_room("speed", found, needed, lambda share: f"0 m/s, or at least {speed / share:.2g} m/s")


def _contacts(
    scenario: Scenario, plane: PlaneVehicle, method: Method, seat: float, laws: list[general.Law]
) -> tuple[tuple[general.Contact, ...], tuple[PathTable, ...], list[Note]]:
    """Return the contacts of all wheelsets, their paths, and notes on these."""
    end = float(scenario.speed * scenario.duration)
    out, paths, notes = list[general.Contact](), list[PathTable](), list[Note]()
    for number, (wheelset, position) in enumerate(zip(plane.wheelsets, plane.positions, strict=True), 1):
        items = scenario.irregularities_on(number, "left")
        courses = [item.course(wheelset.radius).moved(-position) for item in items]
        factor = ellipse.factor_function(scenario.contact, wheelset)
        table, said = path_table(courses, end, method, scenario.rolling, wheelset.radius, factor)
        paths.append(table)
        out.append(
            general.Contact(
                table.rows, laws[number - 1], position - seat, 0.0, table.loop, table.loop_join
            )
        )  # fmt: skip
        several = f"wheelset {number}, x from {position:g} m: " if len(plane.wheelsets) > 1 else ""
        notes += [note.reworded(f"{several}{note}") for note in said]
    return tuple(out), tuple(paths), notes


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
