"""From a vehicle in the vertical plane, on any track, to a system for the general march: bodies, contacts, paths."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.describe.vehicle.kinks import Element
from wheeltapper.describe.vehicle.plane import PlaneVehicle, end_name
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.needs import YIELDING
from wheeltapper.ground.notes import Note
from wheeltapper.lower.build import path_table
from wheeltapper.lower.known import check_known
from wheeltapper.lower.laws import ellipse
from wheeltapper.lower.laws.own_law import table_note, tabulated_law
from wheeltapper.lower.laws.plastic import patch_semi_axis, stretched_rows, virgin_pieces
from wheeltapper.lower.lowered.base import DECK
from wheeltapper.lower.lowered.plane import LoweredPlane, Stop, plastic_of
from wheeltapper.lower.marks.marks import SAMPLES, VIRGIN, MarkedPath, Surface
from wheeltapper.lower.marks.rail_memory import RailMemory
from wheeltapper.lower.numbers import METHODS, Method, contact_alone, hysteresis_factor, units_of
from wheeltapper.lower.paths.table import PathTable, blank_rows
from wheeltapper.lower.plausible import doubts
from wheeltapper.lower.track.anomalies import NONE, Anomalies, Void, anomalies_of, check_seats
from wheeltapper.lower.track.irregular import IrregularModes
from wheeltapper.lower.track.reach import Reach, critical_speed, cutoff_note, modes_of
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.law_columns import PLASTIC_ONSET
from wheeltapper.march.general import contract as general
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.laws.corners import STRETCH_BEGIN, STRETCH_FORCE, STRETCH_PLACE, STRETCH_SLOPE
from wheeltapper.march.general.march import force_at_rest
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import MOST_PHASES, longest_step

if TYPE_CHECKING:
    pass

FloatArray = NDArray[np.float64]
GENERAL_METHODS = {"default": general.DEFAULT, "strict": general.STRICT}
METHODS_OF_BODIES = {
    "default": general.DEFAULT._replace(tail=1e-8, sweep=1e-10),
    "strict": general.STRICT._replace(nodes=10, step=0.5 * general.STRICT.step),
}
"""Without modes. What contacts feel of each other's kinks in a macro step is a polynomial, for which more nodes are no
better, but shorter steps are. All is the same however many contacts there are, so that one more changes nothing."""
TABLE_BYTES = 50.0
"""Memory for each place in a bay, node and mode, while tables of single precision are made."""
SUDDEN = Note(
    "at t = 0 the wheels already roll at full speed, but the track below them is still at rest: this start disturbs "
    "the results of the first 0.1 s or so; let irregularities begin later",
    "sudden start",
)
"""What a start at speed from a static state means."""
HALVES = Note(
    "track.sleeper_roll_inertia has no effect here: this vehicle runs on one rail, on half-sleepers; sleepers roll "
    "below a Wagon only",
    "sleepers' roll",
)
"""What is left out where the track says how sleepers roll."""


def lower_plane(scenario: Scenario, method: str = "default") -> LoweredPlane:
    """Lower a scenario to a task of the general march."""
    check_known(scenario)
    vehicle = on_wheels(scenario)
    under = under_wheels(scenario, vehicle.plane.extent, method)
    way = float(scenario.speed * scenario.duration)
    recurring = checked_way(scenario, vehicle.plane, under, float(scenario.speed), way, method)
    tables, notes = paths_of(scenario, vehicle.plane, way, METHODS[method])
    task = task_of(scenario, vehicle, under, tables, float(scenario.speed), float(scenario.duration), method)
    said = (*doubts(scenario), *vehicle.notes, *notes)
    if under.reach is not None:
        said = (*said, *under.reach.notes, *recurring, *_excitation_note(scenario, vehicle.plane, under.reach))
        if vehicle.plane.rails == 1 and scenario.track.rolls:
            said = (*said, HALVES)
    if under.modes is not None and scenario.speed > 0.0:
        said = (*said, SUDDEN)
    if YIELDING in scenario.needs and len(tables) > 1 and task.memory is None:
        said = (*said, VIRGIN)
    return LoweredPlane(
        scenario, task, vehicle.plane, under.modes, under.seat, vehicle.static_force, vehicle.contact_constant, said,
        float(vehicle.plane.rails), vehicle.stops, under.anomalies, tuple(tables),
    )  # fmt: skip


class OnWheels(NamedTuple):
    """A vehicle, and its contact laws: what the march is told of them.

    Attributes
    ----------
    plane
        The vehicle in the vertical plane.
    bodies, laws
        Of one of its equal rails.
    stops
        Of the dampers with play, wheelset by wheelset.
    static_force
        Of each wheelset, N.
    contact_constant
        Of the first wheelset, N/m^1.5, if linear N/m.
    notes
        On the laws.
    contact
        The contact as it is described.
    deck
        x of both ends of a deck, m; infinite where it has none.
    """

    plane: PlaneVehicle
    bodies: general.Bodies
    laws: tuple[general.Law, ...]
    stops: tuple[Stop, ...]
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]
    contact: Any
    deck: tuple[float, float] = (-np.inf, np.inf)


def on_wheels(scenario: Scenario, usual: float | None = None) -> OnWheels:
    """Return the vehicle of a scenario, with its contact laws and a deck below it.

    `usual` is the static force, N, by which a contact yields that does not tell when; by default the largest one.
    """
    plane = plane_of(scenario)
    rails, wheels = float(plane.rails), len(plane.wheelsets)
    weights = np.array([wheelset.weight for wheelset in plane.wheelsets])
    usual = float(weights.max()) if usual is None else usual
    laws = [law_of(scenario, wheelset, rails, usual) for wheelset in plane.wheelsets]
    guides = np.empty(0) if isinstance(scenario.track, SupportedRail) else plane.guides
    forces = weights
    if guides.size:
        each = zip(weights.tolist(), guides.tolist(), laws, strict=True)
        forces = rails * np.array([force_at_rest(law, one / rails, k / rails) for one, k, (law, _, _) in each])
    shapes = np.eye(len(plane.freedoms), wheels)
    if plane.freedoms[-1] == DECK:
        only = scenario.track.wheelset
        shapes[-1] = -1.0 if only is None else -np.eye(wheels)[only - 1]
    start = scenario.start
    raised = np.empty((2, 0)) if isinstance(start, str) else np.tile([[start.displacement], [start.velocity]], wheels)
    bodies = general.Bodies(
        plane.mass / rails, plane.damping / rails, plane.stiffness / rails, shapes, shapes @ forces / rails, raised,
        plane.follows, guides / rails,
    )  # fmt: skip
    return OnWheels(
        plane, bodies, tuple(law for law, _, _ in laws), stops_of(plane), forces, laws[0][1], laws[0][2],
        scenario.contact, _ends_of(scenario),
    )  # fmt: skip


def _ends_of(scenario: Scenario) -> tuple[float, float]:
    """Return x of both ends of a deck, m; infinite where it has none."""
    deck = scenario.track
    if not isinstance(deck, FloatingDeck) or deck.start is None:
        return -np.inf, np.inf
    start = float(deck.start)
    return start, start + float(np.inf if deck.length is None else deck.length)


def _along_deck(
    bodies: general.Bodies, vehicle: OnWheels, speed: float
) -> tuple[general.Bodies, tuple[general.Change, ...]]:  # fmt: skip
    """Return bodies as they are at the start, and what changes as wheels come on to a deck and leave it.

    The deck is prestressed by the static forces of the wheels that are on it, so that it rests below none of them, too.
    """
    if np.isinf(vehicle.deck).all():
        return bodies, ()
    ahead = np.subtract.outer(vehicle.deck, vehicle.plane.positions)
    enters, leaves = ahead / speed if speed > 0.0 else np.where(ahead > 0.0, np.inf, -np.inf)

    def change_at(time: float) -> general.Change:
        shapes = bodies.shapes.copy()
        shapes[-1, : len(enters)] *= (enters <= time) & (time < leaves)
        pressing = shapes[:, : len(enters)] @ vehicle.static_force / vehicle.plane.rails
        return general.Change(time, shapes, pressing)

    times = np.unique([enters, leaves])
    changes = tuple(change_at(time) for time in times[(times > 0.0) & np.isfinite(times)].tolist())
    _, shapes, load = change_at(0.0)
    return bodies._replace(shapes=shapes, load=load), changes


def stops_of(plane: PlaneVehicle) -> tuple[Stop, ...]:
    """Return the stops of all dampers with play."""
    return tuple(stop for number in range(len(plane.wheelsets)) for stop in _stops(plane, number))


def _stops(plane: PlaneVehicle, number: int) -> Iterator[Stop]:
    """Return the stops of a wheelset's damper: two springs in a bush, or one damper that meets both."""
    wheelset, rails = plane.wheelsets[number], float(plane.rails)
    play, start = float(wheelset.damper_play), float(wheelset.damper_play_start)
    if not play:
        return
    shape = np.zeros(len(plane.freedoms))
    shape[number] = -1.0
    if wheelset.bush_stiffness is None:
        numbers = np.array([wheelset.damping / rails, play, start * play])
        yield Stop(number, (1, -1), general.Law(switch.FREE_PLAY, numbers), shape, 0.0)
        return
    shape[plane.freedoms.index(end_name(number))] = 1.0
    law = general.Law(switch.LINEAR_LAW, np.array([wheelset.bush_stiffness / rails]))
    for side in (1, -1):
        yield Stop(number, (side,), law, side * shape, play * (1.0 + side * start))


def _law_and_shape(element: Element, plane: PlaneVehicle) -> tuple[general.Law, FloatArray]:
    """Return the law of one rail's part of an element, and what each freedom adds to what it presses together."""
    rails = float(plane.rails)
    shape = np.pad(-element.compression, (0, len(plane.freedoms) - len(element.compression)))
    if element.slider[0]:
        return general.Law(switch.SLIDER, np.array(element.slider) / rails), shape
    places, slopes = element.corners
    rows = np.zeros((len(slopes), 4))
    rows[:, STRETCH_BEGIN] = np.append(-np.inf, places)
    rows[:, STRETCH_SLOPE] = slopes / rails
    middle = int((places < 0.0).sum())
    for stretch in [*range(middle + 1, len(rows)), *range(middle - 1, -1, -1)]:  # outwards from that at zero
        corner = places[stretch - (stretch > middle)]
        inner = rows[stretch + (1 if stretch < middle else -1)]
        rows[stretch, STRETCH_PLACE] = corner
        rows[stretch, STRETCH_FORCE] = inner[STRETCH_FORCE] + inner[STRETCH_SLOPE] * (corner - inner[STRETCH_PLACE])
    kind = switch.CORNERED_DAMPER if element.by_rate else switch.CORNERED_SPRING
    return general.Law(kind, np.array([float(len(rows))]), rows), shape


def plane_of(scenario: Scenario) -> PlaneVehicle:
    """Return the vehicle of a scenario in the vertical plane, with a deck below it as its last freedom."""
    plane: PlaneVehicle = scenario.vehicle.plane
    deck = scenario.track
    if not isinstance(deck, FloatingDeck):
        return plane
    mass, damping, stiffness = (
        block_diag(whole, getattr(deck, field))
        for whole, field in ((plane.mass, "mass"), (plane.damping, "damping"), (plane.stiffness, "stiffness"))
    )
    return plane._replace(freedoms=(*plane.freedoms, DECK), mass=mass, damping=damping, stiffness=stiffness)


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
    modes, contacts, bodies = under.modes, contacts_of(tables, vehicle, under.seat), vehicle.bodies
    ring = None if modes is None else modes.ring
    if isinstance(modes, IrregularModes):
        contacts += tuple(_below_sleeper(modes, void) for void in under.anomalies.voids)
    between = [(stop.law, stop.shape, stop.gap) for stop in vehicle.stops]
    between += [(*_law_and_shape(element, vehicle.plane), 0.0) for element in vehicle.plane.elements]
    if between or len(contacts) > len(vehicle.laws):
        shapes = np.pad(bodies.shapes, ((0, 0), (0, len(contacts) - len(vehicle.laws))))
        bodies = bodies._replace(shapes=np.column_stack([shapes, *(shape for _, shape, _ in between)]))
    nowhere = np.zeros(0 if ring is None else len(ring.rates), dtype=complex)
    stay = tuple(_stayed(law, general.Port(nowhere, nowhere, gap)) for law, _, gap in between)
    bodies, changes = _along_deck(bodies, vehicle, speed)
    return general.System(bodies, contacts + stay, speed, ring, changes)


def method_on(ring: Ring | None, method: str) -> general.Method:
    """Return how macro steps are made over the modes of a track, or without any."""
    return (METHODS_OF_BODIES if ring is None else GENERAL_METHODS)[method]


def _stayed(law: general.Law, port: general.Port) -> general.Contact:
    """Return a contact that stays where it is."""
    level = blank_rows(1)
    level[0, [contract.START, contract.STOP]] = -np.inf, np.inf
    return general.Contact(level, law, loop=1, port=port)


def task_of(
    scenario: Scenario, vehicle: OnWheels, under: UnderWheels, tables: Sequence[PathTable], speed: float,
    duration: float, method: str,
) -> general.Task:  # fmt: skip
    """Return a vehicle on its paths and its track for some time, with what its rail remembers."""
    system = system_of(vehicle, under, tables, speed)
    how = method_on(system.ring, method)
    yields = isinstance(vehicle.contact, ElasticPlastic)
    if not (yields and len(tables) > 1 and scenario.rolling == "point" and speed > 0.0):
        return general.Task(system, how, duration)
    memory = memory_of(vehicle, tables, virgin_rail(vehicle, speed * duration), speed * duration)
    return general.Task(remembering(system, memory), how, duration, memory)


def remembering(system: general.System, memory: RailMemory) -> general.System:
    """Return a system whose wheels stand where a memory has them, on its surface as it was before."""
    wheels = [
        one._replace(pieces=pieces, start=start, loop=len(pieces))
        for one, pieces, start in zip(system.wheels, memory.begin().pieces(), memory.offsets, strict=True)
    ]
    return system._replace(contacts=(*wheels, *system.contacts[len(wheels) :]))


def virgin_rail(vehicle: OnWheels, way: float, per_interval: int = SAMPLES, extent: float = 0.0) -> Surface:
    """Return the surface of a rail for a vehicle, or longer ones, that go so far, m."""
    plane, onsets = vehicle.plane, [plastic_of(law, 1.0).onset for law in vehicle.laws]
    semi_axis = patch_semi_axis(vehicle.contact, plane.wheelsets[0], float(vehicle.static_force[0]))
    leading = onsets[int(np.argmax(plane.positions))]
    return Surface.virgin_surface(max(plane.extent, extent) + way, semi_axis, leading, per_interval)


def memory_of(
    vehicle: OnWheels, tables: Sequence[PathTable], before: Surface, way: float, hardening: float = 1.0,
    start: float | None = None,
) -> RailMemory:  # fmt: skip
    """Return what a rail remembers of a vehicle's wheels that go so far, m.

    Without tables of the wheels' paths it tells what is left, but no new paths. The surface begins at x = `start`, by
    default under the last wheel.
    """
    plane, contact = vehicle.plane, vehicle.contact
    offsets = (np.array(plane.positions) - (min(plane.positions) if start is None else start)).tolist()
    marked = tuple(
        MarkedPath(table.moved(offset), before, offset + way) for table, offset in zip(tables, offsets, strict=False)
    )  # fmt: skip
    laws = tuple(plastic_of(law, float(plane.rails)) for law in vehicle.laws)
    return RailMemory(laws, tuple(offsets), contact.share_of_rail, hardening, before, marked, way)


def shortest_wave(scenario: Scenario, plane: PlaneVehicle) -> float | None:
    """Return the shortest wave of the irregularities, m; None where none is told."""
    waves = [item.shortest_wave(plane.wheelsets[0].radius) for item in scenario.irregularities]
    return min((length for length in waves if length is not None), default=None)


def _excitation_note(scenario: Scenario, plane: PlaneVehicle, reach: Reach) -> tuple[Note, ...]:
    """Return a note where the irregularities excite more than the modes of the track know."""
    length = shortest_wave(scenario, plane)
    note = cutoff_note(reach, float(scenario.speed) / length) if length is not None else None
    return () if note is None else (note,)


def _below_sleeper(modes: IrregularModes, void: Void) -> general.Contact:
    """Return the contact between a sleeper and the ballast below a void."""
    law = general.Law(switch.LINEAR_LAW, np.array([void.stiffness]))
    if void.damping > 0.0:
        law = general.Law(switch.KELVIN, np.array([void.stiffness, void.damping]))
    return _stayed(law, modes.port_of(void))


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
        allowed = (
            f"0 m/s, or at least {slowest:.2g} m/s, where {MOST_PHASES} places, whose tables fit in memory, will do"
        )
        raise InputError("", "speed", found, allowed)
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
        out.append(table.going_on())
        several = f"wheelset {number}, x from {position:g} m: " if len(plane.wheelsets) > 1 else ""
        notes += [note.reworded(f"{several}{note}") for note in said]
    return out, notes


def contacts_of(tables: Sequence[PathTable], vehicle: OnWheels, seat: float) -> tuple[general.Contact, ...]:
    """Return the contacts of all wheelsets on their paths; the march counts from a seat."""
    return tuple(
        general.Contact(_surfaced(table.rows, law), law, position - seat, 0.0, table.loop, table.loop_join)
        for table, law, position in zip(tables, vehicle.laws, vehicle.plane.positions, strict=True)
    )


def _surfaced(pieces: FloatArray, law: general.Law) -> FloatArray:
    """Return the pieces of a path with what the law must know of the surface."""
    return virgin_pieces(pieces, float(law.numbers[PLASTIC_ONSET - 1])) if law.kind == switch.PLASTIC else pieces


def law_of(
    scenario: Scenario, wheelset: Wheelset, rails: float, usual: float | None = None
) -> tuple[general.Law, float, tuple[Note, ...]]:
    """Return the law of one rail's part of a wheelset's contact, the wheelset's constant, and notes on the law."""
    contact = scenario.contact
    if isinstance(contact, ForceLaw):
        law, table = tabulated_law(contact, rails)
        return law, table.constant, (table_note(table.error),)
    alone = contact_alone(scenario, wheelset)
    constant = float(units_of(alone).contact_constant)
    if isinstance(contact, Linear):
        kind = switch.TWO_SIDED if contact.bilateral else switch.LINEAR_LAW
        return general.Law(kind, np.array([constant / rails])), constant, ()
    if isinstance(contact, ElasticPlastic):
        onset = contact.yield_indentation(constant, wheelset.wheels, wheelset.weight if usual is None else usual)
        rows = stretched_rows(contact)
        return general.Law(switch.PLASTIC, np.array([constant / rails, onset, 0.0, len(rows)]), rows), constant, ()
    loss = float(hysteresis_factor(alone))
    if loss:
        return general.Law(switch.HUNT_CROSSLEY, np.array([constant / rails, loss])), constant, ()
    return general.Law(switch.HERTZ, np.array([constant / rails])), constant, ()
