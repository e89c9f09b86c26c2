"""Marching a system: its tables, its state at the start, and what comes out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import log2
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march.common import program as numbers
from wheeltapper.march.common.law_columns import PLASTIC_ONSET
from wheeltapper.march.common.plastic_law import stretch_of
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Row, Rows, row_of
from wheeltapper.march.common.telling import GENERAL_CHUNK, Tell, report_nothing
from wheeltapper.march.general import layout
from wheeltapper.march.general import tables as tabulation
from wheeltapper.march.general.at_rest import MOST_NEWTON, indentation_at_rest
from wheeltapper.march.general.basis import FLIGHT_DEGREE, flight_nodes, gauss_nodes
from wheeltapper.march.general.borders import NOWHERE
from wheeltapper.march.general.contract import DEFAULT, Bodies, Contact, Law, Marking, Memory, Method, System, Task
from wheeltapper.march.general.crossings import DEEPEST
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.laws.corners import STRETCH_BEGIN, STRETCH_FORCE, STRETCH_PLACE, STRETCH_SLOPE
from wheeltapper.march.general.laws.free_play import PLAY_START
from wheeltapper.march.general.paths import enter_next_piece, height_and_slope, heights, piece_stop, surface_at
from wheeltapper.march.general.records import Data, Logs, Motion, Room, Stage, Tables
from wheeltapper.march.general.stepping import MODES_EVERY, march_kernel
from wheeltapper.march.general.structure import ComplexArray, Ring


class Start(NamedTuple):
    """A state to start from.

    Attributes
    ----------
    bodies
        Displacements of all freedoms, then velocities of those with mass.
    modes
        Amplitudes as seen from the bay of the first contact, (modes,).
    offsets
        Added to the indentation of each contact, m.
    """

    bodies: FloatArray
    modes: ComplexArray
    offsets: FloatArray


class Stretch(NamedTuple):
    """What bodies are between two of their changes.

    Attributes
    ----------
    first
        Macro step with which it begins.
    bodies, tables
        Of it.
    """

    first: int
    bodies: Bodies
    tables: Tables


class Prepared(NamedTuple):
    """A system whose tables are made: it can be marched again and again.

    Where bodies change there are `stretches`, of which `system` and `tables` are those of the first one.
    """

    system: System
    method: Method
    units: tabulation.Units
    grid: tabulation.Grid
    tables: Tables
    data: Data
    start: Start
    motion: Motion
    stretches: tuple[Stretch, ...] = ()

    def on_paths(self, pieces: list[FloatArray]) -> Prepared:
        """Return the system on new paths of the wheels, which go on to their ends without a loop."""
        contacts = self.system.contacts
        new = tuple(one._replace(pieces=own, loop=len(own)) for one, own in zip(contacts, pieces, strict=False))
        system = self.system._replace(contacts=new + contacts[len(new) :])
        table, ends = path_tables(system)
        return self._replace(system=system, data=self.data._replace(pieces=table, ends=ends))

    def in_stretch(self, number: int) -> Prepared:
        """Return what holds in a stretch, as if it held all the time."""
        one = self.stretches[number]
        return self._replace(system=self.system._replace(bodies=one.bodies), tables=one.tables, stretches=())

    def stretch_at(self, step: IntArray) -> IntArray:
        """Return the stretches of macro steps."""
        return np.searchsorted([one.first for one in self.stretches], step, side="right") - 1

    def moved_at(self, number: int) -> IntArray:
        """Return the contacts that press other bodies in a stretch than in the one before."""
        before, after = (self.stretches[one].bodies.shapes for one in (number - 1, number))
        return np.flatnonzero((before != after).any(axis=0))


class Found(NamedTuple):
    """A march.

    Attributes
    ----------
    prepared
        What was marched.
    status
        DONE, or why it ended before (`wheeltapper.march.common.program` and layout.py).
    steps
        Macro steps made.
    events
        (events, 4): time in s, LOSS, IMPACT or YIELD, rate of indentation in m/s, contact.
    peaks
        Maxima of a force, (peaks, 4): time in s, force in N, contact, and 1 where the path has a kink or jump there, or
        a deck an end.
    logs
        For what is asked later; complete macro steps only.
    """

    prepared: Prepared
    status: int
    steps: int
    events: FloatArray
    peaks: FloatArray
    logs: Logs

    @property
    def sinking(self) -> FloatArray:
        """Of the bodies at each contact from first touch to rest: indentation and rail's deflection, less the path."""
        return self.prepared.start.offsets

    @property
    def time(self) -> float:
        """How far the march came, s."""
        return float(self.prepared.grid.times(np.array(self.steps)))

    @property
    def changes(self) -> FloatArray:
        """When stretches but the first one begin, s."""
        return self.prepared.grid.times(np.array([one.first for one in self.prepared.stretches[1:]], np.int64))

    def changes_of(self, contact: int) -> FloatArray:
        """Return when a contact comes to other bodies, s."""
        stretches = range(1, len(self.prepared.stretches))
        return self.changes[[contact in self.prepared.moved_at(one) for one in stretches]]

    def by_stretch(self, step: IntArray) -> Iterator[tuple[Any, Found]]:
        """Return which of some macro steps lie in each stretch, and the march as if it were all of that stretch."""
        if not self.prepared.stretches:
            yield slice(None), self
            return
        which = self.prepared.stretch_at(step)
        for number in np.unique(which).tolist():
            yield np.flatnonzero(which == number), self._replace(prepared=self.prepared.in_stretch(number))


# -- laws in the march's units ----------------------------------------------------------------------------------------


def law_row(contact: Contact, units: tabulation.Units, first: int) -> FloatArray:
    """Return the numbers of a contact's law in the march's units; `first` is the first row of its table."""
    kind, given = contact.law.kind, contact.law.numbers
    row = np.zeros(switch.LAW_NUMBERS)
    row[switch.LAW_KIND] = kind
    row[1 : 1 + len(given)] = given
    if kind in (switch.HERTZ, switch.HUNT_CROSSLEY):
        row[1] *= units.length**1.5 / units.force
    if kind in (switch.LINEAR_LAW, switch.TWO_SIDED):
        row[1] *= units.length / units.force
        row[switch.LAW_PULLS] = kind == switch.TWO_SIDED
    if kind == switch.HUNT_CROSSLEY:
        row[2] *= units.length
        row[switch.LAW_RATED] = 1.0
    if kind == switch.KELVIN:
        row[1:3] *= units.length / units.force
        row[switch.LAW_RATED] = 1.0
    if kind == switch.FREE_PLAY:
        row[1] *= units.length / units.force
        row[2:4] /= units.length
        row[switch.LAW_RATED] = 1.0
    if kind == switch.SLIDER:
        row[1] /= units.force
        row[2] *= units.length / units.force
    if kind in (switch.CORNERED_SPRING, switch.CORNERED_DAMPER):
        row[2:5] = first, units.length, units.force
        row[switch.LAW_RATED] = kind == switch.CORNERED_DAMPER
    if kind == switch.TABULATED:
        row[2] /= units.length
        row[5] = first
        row[6] = units.length ** given[0] / units.force
        row[7:9] /= units.length
        row[switch.LAW_RATED] = given[8] > 1 or given[9] > 1
    if kind == switch.PLASTIC:
        row[1] *= units.length**1.5 / units.force
        row[2] /= units.length
        row[3] = first
    return row


class Spot(NamedTuple):
    """A place of the running surface: the factor on the force, what earlier wheels have left, and what it bears.

    Lengths are in the march's units.
    """

    factor: float
    left: float
    bears: float


def pressed(delta: float, row: FloatArray, table: FloatArray, spot: Spot) -> tuple[float, float]:
    """Return the force of an indentation at rest, and its derivative, in the march's units."""
    at, rate, N, slope, viscous = np.zeros((5, 1))
    at[0], stretch = delta, 0.0
    if row[switch.LAW_KIND] == switch.PLASTIC:
        stretch = stretch_of(delta, spot.left, spot.bears, row, table)
    left, factor = np.array([spot.left]), np.array([spot.factor if stretch == 0.0 else 1.0])
    switch.forces(row, table, stretch, 1, at, rate, left, factor, N, slope, viscous)
    return float(N[0]), float(slope[0])


def indentation_of(force: float, row: FloatArray, table: FloatArray, spot: Spot, beside: float = 0.0) -> float:
    """Return the indentation at rest under a force, in the march's units, by Newton's method between bounds.

    `beside` is the stiffness of a spring beside the contact.
    """
    low, high = 0.0, 1.0
    while pressed(high, row, table, spot)[0] + beside * high < force:
        low, high = high, 2.0 * high
        if high > 1e12:
            raise ValueError("the contact's law never reaches its static force")
    x = high
    for _ in range(200):
        found, steepness = pressed(x, row, table, spot)
        found, steepness = found + beside * x, steepness + beside
        low, high = (x, high) if found < force else (low, x)
        new = x - (found - force) / steepness if steepness > 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 2e-16 * x:
            return new
        x = new
    return x


def indentation_within(gap: float, compliance: float, row: FloatArray, table: FloatArray, spot: Spot) -> float:
    """Return the indentation δ at rest where δ + r·N(δ) is a gap, and zero in flight, in the march's units."""
    if gap <= 0.0 or compliance <= 0.0:
        return max(gap, 0.0)
    return indentation_of(gap / compliance, row, table, spot, 1.0 / compliance)


# -- preparing --------------------------------------------------------------------------------------------------------


def carried_loads(system: System) -> FloatArray:
    """Return the forces of the wheels that come nearest to carrying the loads alone, N; they give the units."""
    shapes = system.bodies.shapes[:, : len(system.wheels)]
    found = np.linalg.lstsq(shapes, system.bodies.load, rcond=None)[0]
    if not (found > 0.0).all():
        raise ValueError("a contact has no static force")
    return np.asarray(found)


def static_forces(system: System) -> FloatArray:
    """Return the forces of the wheels that carry the loads while no spring of the bodies is stretched, N."""
    shapes, load = system.bodies.shapes[:, : len(system.wheels)], system.bodies.load
    found = carried_loads(system)
    if not np.allclose(shapes @ found, load, rtol=1e-9, atol=1e-9 * np.abs(load).max()):
        raise ValueError("the contacts do not carry the bodies' loads")
    return found


def units_of(contacts: tuple[Contact, ...], static: FloatArray) -> tabulation.Units:
    """Return the units: powers of two near the largest static force and its indentation.

    Tables of one track then differ by exact factors, whatever stands on it.
    """
    force = float(static.max())
    contact = contacts[int(static.argmax())]
    row = law_row(contact, tabulation.Units(1.0, 1.0), 0)
    indentation = indentation_of(force, row, table_of(contact), virgin_spot(row))
    return tabulation.Units(*(2.0 ** round(log2(size)) for size in (indentation, force)))


def table_of(contact: Contact) -> FloatArray:
    """Return the table of a contact's law, as kernels take it."""
    return contact.law.table if contact.law.table.size else np.zeros((1, 1))


def _law_tables(system: System, units: tabulation.Units) -> tuple[FloatArray, FloatArray]:
    """Return the laws' numbers, and their tables behind each other."""
    rows, tables, first = [], [], 0
    for contact in system.contacts:
        table = table_of(contact)
        rows.append(law_row(contact, units, first))
        tables.append(table)
        first += len(table)
    width = max(table.shape[1] for table in tables)
    return np.array(rows), np.vstack([np.pad(table, ((0, 0), (0, width - table.shape[1]))) for table in tables])


def path_tables(system: System) -> tuple[FloatArray, Rows]:
    """Return all contacts' pieces behind each other, and where each contact's begin, end and loop."""
    ends, first = np.zeros(len(system.contacts), layout.ENDS), 0
    for i, contact in enumerate(system.contacts):
        ends[i] = first, first + len(contact.pieces), contact.loop, contact.join
        first += len(contact.pieces)
    width = max(contact.pieces.shape[1] for contact in system.contacts)
    paths = [np.pad(one.pieces, ((0, 0), (0, width - one.pieces.shape[1]))) for one in system.contacts]
    return np.ascontiguousarray(np.vstack(paths)), ends


def prepare(
    system: System, method: Method = DEFAULT, start: Start | None = None, duration: float = np.inf, even: bool = False
) -> Prepared:  # fmt: skip
    """Make the tables of a system, enough for a duration; it starts from equilibrium unless a state is given.

    `even`: all macro steps are equal, wherever wheels pass seats.
    """
    units = units_of(system.wheels, carried_loads(system))
    if system.changes:
        return _prepared_in_stretches(system, method, start, duration)
    return prepared_on(tabulation.track_tables(system, method, units, duration, even), system, method, start)


def prepared_on(track: tabulation.TrackTables, system: System, method: Method, start: Start | None = None) -> Prepared:
    """Make the tables of a system whose track has tables already."""
    units, grid = units_of(system.wheels, carried_loads(system)), track.grid
    tables = tabulation.joined(track, tabulation.body_tables(system.bodies, grid, method, units), method, units)
    return _at_start(system, method, units, grid, tables, start)


def prepared_task(task: Task, track: tabulation.TrackTables) -> Prepared:
    """Make the tables of a task whose track has tables already; they do not serve where bodies change."""
    if task.system.changes:
        return prepare(task.system, task.method, None, task.duration)
    return prepared_on(track, task.system, task.method)


SAME_TIME, SAME_TIME_OF_RATES = 1e-9, 1e-4
"""Parts of a macro step; changes no farther from each other, from the start or from the end, are at one time. In much
shorter steps the rates of indentations, on which some laws of wheels depend, are rounding."""


def _prepared_in_stretches(system: System, method: Method, start: Start | None, duration: float) -> Prepared:
    """Make the tables of a system whose bodies change; macro steps end where they do, and at the duration."""
    if system.ring is not None or not np.isfinite(duration):
        raise ValueError("bodies change on a rigid rail only, and within a finite time")
    longest = tabulation.longest_step(None, method, system.bodies)
    units = units_of(system.wheels, carried_loads(system))
    rated = any(law_row(wheel, units, 0)[switch.LAW_RATED] for wheel in system.wheels)
    near, times, bodies = (SAME_TIME_OF_RATES if rated else SAME_TIME) * longest, [0.0], [system.bodies]
    for time, shapes, load in system.changes:
        if time >= duration - near:
            break
        changed = system.bodies._replace(shapes=shapes, load=load)
        if time <= times[-1] + near:
            bodies[-1] = changed
        else:
            times, bodies = [*times, time], [*bodies, changed]
    system = system._replace(bodies=bodies[0])
    grid = tabulation.grid_between(np.array([*times, duration]), longest, system)
    stretches = []
    for number, (time, own) in enumerate(zip(times, bodies, strict=True)):
        seconds, first = float(grid.lengths[number]), int(np.searchsorted(grid.which, number))
        track = tabulation.tables_on(
            tabulation.grid_between(np.array([0.0, seconds]), seconds, system), system, method, units
        )
        tables = tabulation.joined(track, tabulation.body_tables(own, track.grid, method, units), method, units)
        clock = np.array([time - first * seconds, seconds])  # of steps counted from the start
        stretches.append(Stretch(first, own, tables._replace(clock=clock)))
    made = _at_start(system, method, units, grid, stretches[0].tables, start)
    for one in stretches[1:]:
        one.tables.bodies_read[:, :, 0, -1] += made.start.offsets / units.length
    return made._replace(stretches=tuple(stretches))


def _at_start(
    system: System, method: Method, units: tabulation.Units, grid: tabulation.Grid, tables: Tables, start: Start | None
) -> Prepared:  # fmt: skip
    """Return a system with its tables where it starts, to which these then refer."""
    laws, table = _law_tables(system, units)
    pieces, ends = path_tables(system)
    starts = np.array([contact.start for contact in system.contacts])
    data = Data(
        gauss_nodes(method.nodes), gauss_nodes(method.careful_nodes), *flight_nodes(), pieces, ends, laws, table,
        starts, settings_of(system, method, units),
    )  # fmt: skip
    if start is None:
        start = equilibrium(system, data, static_forces(system), units, rest_of(system))
        if system.bodies.raised.size:
            start = start._replace(bodies=raised_state(system.bodies, start.bodies, start.offsets))
    tables.bodies_read[:, :, 0, -1] += start.offsets / units.length
    local = tables.residual[:, 0] @ (-1.0) ** np.arange(method.nodes)
    return Prepared(
        system, method, units, grid, tables, data, start, _motion(system, method, data, units, start, local)
    )


LEAST_SHARE = 1e-9
"""Of a step of Newton's method: where a smaller one would be needed, rounding alone is left."""
RATED_TAIL = 1e-9
"""Least error of forces' polynomials, in static units, where a law depends on the rate: rounding of the rate."""


def settings_of(system: System, method: Method, units: tabulation.Units) -> Row:
    """Return the settings of a march, as its kernel takes them."""
    settings = row_of(layout.SETTINGS)
    settings["newton_limit"] = method.newton
    rated = any(law_row(contact, units, 0)[switch.LAW_RATED] for contact in system.contacts)
    settings["tail_limit"] = max(method.tail, RATED_TAIL if rated else 0.0)
    settings["sweep_limit"] = method.sweep
    settings["loss_limit"] = method.loss
    settings["prominent"] = method.prominence
    settings["length_unit"] = units.length
    settings["force_unit"] = units.force
    settings["speed"] = system.speed
    return settings


def first_places(data: Data) -> Rows:
    """Return the state's rows with the piece under each contact at time zero."""
    rows = np.zeros(len(data.starts), layout.STATE)
    rows["impact"], rows["loss"] = -np.inf, np.inf
    for row, x, ends in zip(rows, data.starts, data.ends, strict=True):
        begin, end = ends["begin"], ends["end"]
        inside = np.searchsorted(data.pieces[begin:end, numbers.START], x, side="right") - 1
        row["piece"] = begin + max(int(inside), 0)
    return rows


def path_at_start(data: Data, units: tabulation.Units) -> tuple[FloatArray, list[Spot]]:
    """Return the paths' heights, in units of length, and the running surfaces at time zero."""
    height, spots = np.empty(len(data.starts)), list[Spot]()
    for i, place in enumerate(first_places(data)):
        lift = 1.0 / units.length
        height[i] = height_and_slope(data.pieces, place, data.starts[i], 0.0, lift, 0.0)[0]
        ignored, one = np.zeros((2, 1))
        heights(data.pieces, place, data.starts[i], 0.0, lift, 1, np.zeros(1), ignored, one)
        left, bears, _ = surface_at(data.pieces, place, data.starts[i], 0.0, lift, 0.0)
        spots.append(Spot(float(one[0]), left, bears))
    return height, spots


def bays_of(ring: Ring, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the bays of places along the track, and the places in them, m."""
    bays = np.floor(x / ring.spacing + tabulation.SAME_PHASE)
    return bays, np.maximum(x - bays * ring.spacing, 0.0)


class Rest(NamedTuple):
    """What a track does under forces of the contacts at rest.

    Attributes
    ----------
    amplitudes
        Of the modes, per force of each contact, (contacts, modes).
    deflections
        At each contact, per force of each other, (contact, other), m/N.
    local
        The part of each contact's own that the modes leave out, (contacts,), m/N.
    """

    amplitudes: ComplexArray
    deflections: FloatArray
    local: FloatArray


def rest_of(system: System) -> Rest:
    """Return what a system's track does under the contacts at rest."""
    contacts, ring = len(system.contacts), system.ring
    if ring is None:
        return Rest(np.zeros((contacts, 0), dtype=complex), np.zeros((contacts, contacts)), np.zeros(contacts))
    shows, takes, inside = _shown_and_taken(system)
    amplitudes = -takes / ring.rates
    local = np.append(tabulation.compliance_at(ring, inside), [port.residual for port in system.ports])
    deflections = np.real(shows @ (ring.weights * amplitudes).T) + np.diag(local)
    return Rest(amplitudes, deflections, local)


def static_indentations(
    data: Data, static: FloatArray, units: tabulation.Units
) -> tuple[FloatArray, FloatArray, list[Spot]]:
    """Return the indentations at rest, in units of length, the paths' heights there, and the running surfaces."""
    height, spots = path_at_start(data, units)
    delta = np.array([
        indentation_of(force / units.force, data.laws[i], data.table, spots[i]) for i, force in enumerate(static)
    ])  # fmt: skip
    return delta, height, spots


def force_at_rest(law: Law, weight: float, stiffness: float) -> float:
    """Return the static force on level track, beside a spring against a fixed guide with no force at first touch, N."""
    if stiffness == 0.0:
        return weight
    one = Contact(np.empty((0, 0)), law)
    row, table = law_row(one, tabulation.Units(1.0, 1.0), 0), table_of(one)
    size = indentation_of(weight, row, table, virgin_spot(row))

    def bears(share: Any) -> tuple[float, float]:
        force, slope = pressed(float(share) * size, row, table, virgin_spot(row))
        return force / weight, slope * size / weight

    return bears(indentation_at_rest(bears, 1.0, stiffness * size / weight))[0] * weight


def virgin_spot(law: FloatArray) -> Spot:
    """Return level track that nothing has pressed, as a law's row has it."""
    return Spot(1.0, 0.0, float(law[PLASTIC_ONSET]) if law[switch.LAW_KIND] == switch.PLASTIC else np.inf)


class Held(NamedTuple):
    """What holds a structure on paths, in the march's units.

    Attributes
    ----------
    free
        Numbers of the freedoms that move freely there: those of the wheels first. Others follow a wheel, or no spring
        holds them, or they are a deck, which starts as it rests on level track.
    ties
        What all freedoms are of these, (freedoms, free ones).
    forces_at
        From displacements of the free ones, beyond the static state on level track, to the forces that push them back,
        and how these grow, (free ones, free ones).
    """

    free: IntArray
    ties: FloatArray
    forces_at: Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def held_on(
    system: System, static: FloatArray, units: tabulation.Units, level: FloatArray, height: FloatArray,
    spots: list[Spot],
) -> Held:  # fmt: skip
    """Return what holds bodies with `guides` on paths of these heights and surfaces; `level` is as in `standing`."""
    bodies, wheels = system.bodies, len(static)
    laws = [(law_row(contact, units, 0), table_of(contact)) for contact in system.wheels]
    stays = bodies.follows.any(axis=1) | bodies.shapes[:, :wheels].any(axis=1) | ~bodies.stiffness.any(axis=1)
    own = np.flatnonzero(~stays)
    ties = np.column_stack([bodies.follows, np.eye(len(bodies.mass))[:, own]])
    below, linear = ties.T @ bodies.shapes[:, :wheels], ties.T @ bodies.stiffness @ ties * (units.length / units.force)
    cornered = [
        (ties.T @ bodies.shapes[:, k], system.contacts[k].law.table)
        for k in range(wheels, len(system.contacts))
        if system.contacts[k].law.kind == switch.CORNERED_SPRING
    ]

    def forces_at(moved: FloatArray) -> tuple[FloatArray, FloatArray]:
        depth = (level + height[:wheels] + below.T @ moved).tolist()
        found = [pressed(one, *law, spot) for one, law, spot in zip(depth, laws, spots, strict=False)]
        force, slope = np.array(found).T
        pushed, stiffer = linear @ moved + below @ (force - static / units.force), linear + (below * slope) @ below.T
        for shape, table in cornered:
            u = float(shape @ moved) * units.length
            row = table[max(int(np.searchsorted(table[:, STRETCH_BEGIN], u, side="right")) - 1, 0)]
            pushed += shape * (row[STRETCH_FORCE] + row[STRETCH_SLOPE] * (u - row[STRETCH_PLACE])) / units.force
            stiffer += np.outer(shape, shape) * row[STRETCH_SLOPE] * units.length / units.force
        return pushed, stiffer

    return Held(np.append(np.arange(wheels), own), ties, forces_at)


def standing(
    system: System, static: FloatArray, units: tabulation.Units, delta: FloatArray, height: FloatArray,
    spots: list[Spot],
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return how bodies with `guides` stand on paths of these heights and surfaces, in units of length.

    First the wheels' indentations at rest on level track that nothing has pressed, then the displacements of all
    freedoms from there. `delta` is the indentation under the static force on the surface as it is.
    """
    wheels, level = len(static), delta[: len(static)].copy()
    for i, (contact, force) in enumerate(zip(system.wheels, (static / units.force).tolist(), strict=True)):
        law = law_row(contact, units, 0)
        if spots[i] != virgin_spot(law):
            level[i] = indentation_of(force, law, table_of(contact), virgin_spot(law))
    if not height.any() and np.array_equal(level, delta[:wheels]):
        return level, np.zeros(len(system.bodies.mass))
    held = held_on(system, static, units, level, height, spots)
    moved = np.append(-height[:wheels], np.zeros(len(held.free) - wheels))
    (pushed, stiffer), share = held.forces_at(moved), 1.0
    for _ in range(MOST_NEWTON):
        way = np.linalg.solve(stiffer, pushed)
        if share < LEAST_SHARE or np.abs(way).max() < 1e-15 * max(np.abs(moved).max(), level.max()):
            break
        share = 1.0  # of the way that brings the forces nearer to zero
        while share >= LEAST_SHARE:
            after = held.forces_at(moved - share * way)
            if np.abs(after[0]).max() < np.abs(pushed).max():
                moved, (pushed, stiffer) = moved - share * way, after
                break
            share *= 0.5
    return level, held.ties @ moved


def equilibrium(system: System, data: Data, static: FloatArray, units: tabulation.Units, rest: Rest) -> Start:
    """Return the joint static state of all contacts and the track."""
    wheels = len(system.wheels)
    delta, height, spots = static_indentations(data, static, units)
    stiffness = np.array([contact.law.numbers[0] for contact in system.contacts[wheels:]])  # linear at rest
    gaps = np.array([port.gap for port in system.ports])
    force = np.append(static, forces_of_ports(rest.deflections[wheels:], static, gaps, stiffness))
    offsets = (delta - height[:wheels]) * units.length + (rest.deflections @ force)[:wheels]
    bodies = np.zeros(len(tabulation.states_of(system.bodies).A) - 1)
    if system.bodies.guides.size:
        offsets, moved = (one * units.length for one in standing(system, static, units, delta, height, spots))
        bodies[: len(system.bodies.mass)] = moved
    offsets = np.append(offsets, [-port.gap for port in system.ports])
    return Start(bodies, force @ rest.amplitudes, offsets)


def raised_state(bodies: Bodies, resting: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return the state of bodies with `raised` at time zero, as in `Start`, with whose `offsets`, m.

    What does not follow a wheel is where it was in the `resting` state.
    """
    wheels, freedoms = bodies.raised.shape[1], len(bodies.mass)
    state, (heights, velocities) = resting.copy(), bodies.raised
    moved = bodies.follows.any(axis=1)
    state[:freedoms][moved] = (bodies.follows @ (-heights - offsets[:wheels]))[moved]
    state[freedoms : freedoms + wheels] = -velocities
    return state


def _shown_and_taken(system: System) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Return Φ and Ψ of all contacts at time zero, (contacts, modes), seen from the first, and places in bays, m."""
    ring = system.ring
    assert ring is not None
    bays, inside = bays_of(ring, np.array([contact.position for contact in system.wheels]))
    turn = np.exp(1j * np.multiply.outer(bays - bays[0], np.angle(ring.turns)))
    shows, takes = (
        tabulation.shapes_at(ring, ring.deflection, inside) * turn,
        tabulation.shapes_at(ring, ring.drive, inside) / turn,
    )
    fixed = system.ports
    return (
        np.vstack([shows, *(port.deflection for port in fixed)]), np.vstack([takes, *(port.drive for port in fixed)]),
        inside,
    )  # fmt: skip


def forces_of_ports(gives: FloatArray, static: FloatArray, gaps: FloatArray, stiffness: FloatArray) -> FloatArray:
    """Return the forces at rest of the contacts that stay where they are, under those of the wheels, N.

    Those that the structure does not press together by their gaps have none: their number grows or shrinks until that
    is true of all of them. `gives` is how far forces of all contacts, the wheels' first, move them apart, m/N.
    """
    wheels, softness = len(static), np.diag(1.0 / stiffness)
    near = -gives[:, :wheels] @ static - gaps
    touching = near > 0.0
    force = np.zeros(len(gaps))
    if not len(gaps):
        return force
    for _ in range(2 * len(gaps) + 1):
        some = np.flatnonzero(touching)
        force[:] = 0.0
        force[some] = np.linalg.solve((softness + gives[:, wheels:])[np.ix_(some, some)], near[some])
        wanted = np.where(touching, force > 0.0, near - gives[:, wheels:] @ force > 0.0)
        if (wanted == touching).all():
            break
        touching = wanted
    return force


# -- marching ---------------------------------------------------------------------------------------------------------


def room_of(states: int) -> Room:
    """Return scratch memory."""
    vectors = np.zeros((18, max(32, states)))
    matrices = np.zeros((4, layout.MOST_NODES, layout.MOST_NODES))
    stack = np.zeros((DEEPEST + 2, max(FLIGHT_DEGREE + 1, 32)))
    return Room._make([*vectors, *matrices, stack])


def stage_of(contacts: int, q: int, modes: int) -> Stage:
    """Return scratch memory of what the contacts exchange."""
    rows = layout.MOST_PARTS + 2
    return Stage(
        np.zeros((contacts, rows), layout.ROW), np.zeros((contacts, rows), layout.EVENT),
        np.zeros((contacts, 2), np.int64), np.zeros(contacts, layout.STATE), np.zeros((contacts, q)),
        np.zeros((contacts, q)), np.zeros((contacts, q)), np.zeros((contacts, q, q)), np.zeros((q, q)),
        np.zeros((contacts, q)), np.zeros((2, modes)), row_of(layout.NOW),
    )  # fmt: skip


def _motion(
    system: System, method: Method, data: Data, units: tabulation.Units, start: Start, local: FloatArray
) -> Motion:  # fmt: skip
    """Return the state at time zero; `local` is the compliance that the modes leave out at each contact."""
    contacts, q = len(data.starts), method.nodes
    places = first_places(data)
    order = order_of(system.ring)
    modes = start.modes[order]
    bodies = np.append(start.bodies, 1.0)
    freedoms = len(system.bodies.mass)
    height, spots = path_at_start(data, units)
    gap = height * units.length + system.bodies.shapes.T @ start.bodies[:freedoms] + start.offsets
    if system.ring is not None:
        gap = gap - np.real(_shown_and_taken(system)[0] @ (system.ring.weights * start.modes))
    places["phase"] = (gap <= 0.0) & (data.laws[:, switch.LAW_PULLS] == 0.0)
    places["began"] = [
        indentation_within(one / units.length, float(local[i]), data.laws[i], data.table, spots[i])
        for i, one in enumerate(gap)
    ]  # fmt: skip
    ends = data.laws[:, switch.LAW_KIND] == switch.FREE_PLAY
    places["phase"][ends] = layout.FLYING
    places["stop"][ends] = gap[ends] / units.length + data.laws[ends, PLAY_START]
    _join_elements(system, start, data, gap / units.length, places)
    trend = np.zeros(contacts, layout.TREND)
    trend["lowest"] = np.inf
    carried = np.append(carried_loads(system), np.zeros(len(system.ports)))
    forces_now = np.tile(carried[:, None] / units.force, (1, q))
    return Motion(np.stack([modes.real, modes.imag]), bodies, places, np.zeros((contacts, q)), forces_now, trend)


def _join_elements(system: System, start: Start, data: Data, gap: FloatArray, places: Rows) -> None:
    """Write the state at time zero of elements whose laws have stretches; dry friction begins without a force."""
    freedoms = len(system.bodies.mass)
    speed = system.bodies.shapes[tabulation.heavy_of(system.bodies)].T @ start.bodies[freedoms:]
    for i, contact in enumerate(system.contacts):
        if contact.law.kind not in switch.SWITCHING:
            continue
        places["phase"][i] = layout.STAYING
        if contact.law.kind == switch.SLIDER:
            places["stop"][i] = gap[i]
            continue
        length = data.settings["length_unit"]
        u = speed[i] if contact.law.kind == switch.CORNERED_DAMPER else gap[i] * length
        begins = contact.law.table[:, STRETCH_BEGIN]
        places["stretch"][i] = max(np.searchsorted(begins, u, side="right") - 1, 0)


def order_of(ring: Ring | None) -> IntArray:
    """Return the order of the modes in the tables."""
    return np.argsort(np.abs(ring.rates), kind="stable") if ring is not None else np.zeros(0, np.int64)


def _logs(prepared: Prepared, steps: int) -> Logs:
    contacts, q = len(prepared.data.starts), prepared.method.nodes
    margin = contacts * (layout.MOST_PARTS + 2)
    modes = prepared.tables.decay.shape[2]
    return Logs(
        np.empty(margin + 3 * steps * contacts, layout.ROW), np.empty(margin + steps * contacts, layout.EVENT),
        np.empty(3 * margin + steps * contacts, layout.MAXIMUM),
        np.empty((steps, contacts, q)), np.empty((steps, contacts, q)),
        np.empty((steps, prepared.tables.bodies_step.shape[1])),
        np.empty((steps // MODES_EVERY + 2, 2, modes)), row_of(layout.USED),
    )  # fmt: skip


def march(
    system: System, method: Method, duration: float, static: FloatArray | None = None, start: Start | None = None,
    tell: Tell = report_nothing,
) -> Found:  # fmt: skip
    """March a system for some time.

    Parameters
    ----------
    system
        What is marched.
    method
        How.
    duration
        s; the march makes whole macro steps, and tells of nothing behind it.
    static
        Forces of the contacts at rest, N; the bodies' loads are then those that they carry, and the march starts from
        that state, displacements counted from it. By default the bodies' own loads, which the contacts have to carry.
    start
        A state to start from instead.
    tell
        Is told the time now and then, s, and ends the march by returning True.
    """
    if static is not None:
        changes = tuple(one._replace(load=one.shapes @ static) for one in system.changes)
        system = system._replace(bodies=system.bodies._replace(load=system.bodies.shapes @ static), changes=changes)
    return run(prepare(system, method, start, duration), duration, tell)


Lay = Callable[["Found", Marking], None]
"""Lays the marks of a march so far (`replay.lay`)."""


def march_task(task: Task, tell: Tell = report_nothing, lay: Lay | None = None) -> Found:
    """March a task from equilibrium; where it has a memory, `lay` lays marks on the way."""
    return run(prepare(task.system, task.method, None, task.duration), task.duration, tell, task.memory, lay)


def run(
    prepared: Prepared, duration: float, tell: Tell = report_nothing, memory: Memory | None = None,
    lay: Lay | None = None,
) -> Found:  # fmt: skip
    """March a prepared system for some time, in whole macro steps; nothing after the time is told."""
    grid = prepared.grid
    total = grid.steps_until(duration)
    motion = prepared.motion.copy()
    marking, chunk = None, GENERAL_CHUNK
    assert memory is None or lay is not None
    if memory is not None and grid.speed > 0.0:
        marking, chunk = memory.begin(), max(1, min(GENERAL_CHUNK, int(memory.reach / (grid.speed * grid.longest))))
    contacts, q = len(prepared.data.starts), prepared.method.nodes
    stage = stage_of(contacts, q, motion.modes.shape[1])
    room = room_of(len(motion.bodies))
    done, status = 0, numbers.RUNNING
    kept: list[Logs] = []
    while done < total and status in (numbers.RUNNING, numbers.FULL):
        tables, until = prepared.tables, min(total, done + chunk)
        if prepared.stretches:
            stretch = int(prepared.stretch_at(np.array(done)))
            if done and done == prepared.stretches[stretch].first:
                passed = _pass_change(prepared, stretch, motion)
                kept[-1] = kept[-1]._replace(events=np.concatenate([kept[-1].events, passed]))
            tables = prepared.stretches[stretch].tables
            until = min([until, *(one.first for one in prepared.stretches[stretch + 1 : stretch + 2])])
        logs = _logs(prepared, until - done)
        status = march_kernel(done, until, tables, prepared.data, motion, stage, logs, room)
        kept.append(_used(logs, done))
        done = int(logs.used["steps"])
        if tell(float(grid.times(np.array(done)))) and done < total:
            status = numbers.FULL
            break
        if marking is not None and lay is not None and done < total and status in (numbers.RUNNING, numbers.FULL):
            lay(_found(prepared, numbers.RUNNING, done, np.inf, _joined(kept)), marking)
            prepared = _over(prepared, marking.pieces(), motion, done)
    return _found(prepared, numbers.DONE if done >= total else int(status), done, duration, _joined(kept))


def _pass_change(prepared: Prepared, stretch: int, motion: Motion) -> Rows:
    """Go over to a stretch: what presses other bodies there has another indentation; return the rows of events.

    Contacts are opened and closed as at a jump of the path (careful.py), and as `march/wheel/events.py` has it.
    """
    before, after = (prepared.stretches[one].tables.seconds[0] for one in (stretch - 1, stretch))
    for moment in ("impact", "loss"):
        motion.contacts[moment] *= before / after
    motion.contacts["smooth"] = 0.0
    first, bodies, _ = prepared.stretches[stretch]
    system, data, length = prepared.system, prepared.data, prepared.units.length
    rolled, stride = system.speed * float(prepared.grid.times(np.array(first))), system.speed * after
    freedoms, heavy, events = len(bodies.mass), tabulation.heavy_of(bodies), []
    for i in prepared.moved_at(stretch).tolist():
        place, law, x = motion.contacts[i], data.laws[i], system.contacts[i].start + rolled
        begin, end, loop, join = data.ends[i].tolist()
        while piece_stop(data.pieces, place, x, stride) <= SAME_TIME:  # a path that also breaks here
            if enter_next_piece(data.pieces, begin, end, loop, join, place) < 0:
                break
        height, slope = height_and_slope(data.pieces, place, x, 1.0, 1.0, 0.0)
        gap = (height + bodies.shapes[:, i] @ motion.bodies[:freedoms] + prepared.start.offsets[i]) / length
        rate = (slope * system.speed + bodies.shapes[heavy, i] @ motion.bodies[freedoms:-1]) / length
        place["impact"], place["loss"], place["joined"] = -np.inf, np.inf, NOWHERE
        if law[switch.LAW_PULLS] != 0.0:
            place["began"] = gap
            continue
        place["began"] = max(gap, 0.0)
        now = layout.TOUCHING if gap > 0.0 else layout.FLYING
        if now == layout.TOUCHING and law[switch.LAW_RATED] and switch.trend(law, data.table, gap, rate) < 0.0:
            now = layout.RELEASED
        held = place["phase"] == layout.TOUCHING
        place["phase"] = now
        if held != (now == layout.TOUCHING):
            events.append((first, 0.0, numbers.LOSS if held else numbers.IMPACT, rate, i))
            place["stretch"] = place["stretch"] if held else 0.0
    return np.array(events, layout.EVENT)


def _over(prepared: Prepared, pieces: list[FloatArray], motion: Motion, done: int) -> Prepared:
    """Return a system on new paths that are the same so far, after some macro steps; wheels' pieces are renumbered."""
    over, wheels = prepared.on_paths(pieces), len(pieces)
    system, ends = over.system, over.data.ends
    rolled = system.speed * float(prepared.grid.times(np.array(done)))
    near = 1e-9 * system.speed * prepared.grid.longest
    for i, (state, contact) in enumerate(zip(motion.contacts, system.contacts, strict=True)):
        held, own = prepared.data.pieces[int(state["piece"])], ends["begin"][i]
        x = contact.start + rolled
        if i < wheels:  # behind a border at x it has not been entered yet
            stop = held[numbers.STOP] + state["shift"]
            before = stop <= x + near
            side: Any = "left" if before else "right"
            state["piece"] = own + np.searchsorted(contact.pieces[:, numbers.START], min(x, stop), side) - 1
            state["shift"] = 0.0
        else:
            state["piece"] += own - prepared.data.ends["begin"][i]
    return over


def _used(logs: Logs, first: int) -> Logs:
    """Return the part of the logs that is in use."""
    steps = int(logs.used["steps"]) - first
    states = len(range(-(-first // MODES_EVERY) * MODES_EVERY, first + steps, MODES_EVERY))
    counts = *(logs.used[name] for name in ("rows", "events", "peaks")), steps, steps, steps, states
    tables: Any = [table[:count] for table, count in zip(logs[:-1], counts, strict=True)]
    return Logs._make([*tables, logs.used])


def _joined(kept: list[Logs]) -> Logs:
    if len(kept) == 1:
        return kept[0]
    tables: Any = [np.concatenate(parts) for parts in zip(*(logs[:-1] for logs in kept), strict=True)]
    return Logs._make([*tables, kept[-1].used])


def _found(prepared: Prepared, status: int, steps: int, duration: float, logs: Logs) -> Found:
    grid, units = prepared.grid, prepared.units
    times = grid.times(logs.events["step"] + logs.events["part"])
    events = np.column_stack([
        times, logs.events["kind"], logs.events["rate"] * units.length, logs.events["contact"]
    ])  # fmt: skip
    tops = grid.times(logs.peaks["step"] + logs.peaks["part"])
    contact = logs.peaks["contact"]
    peaks = np.column_stack([
        tops, logs.peaks["force"] * units.force, contact, _at_corners(prepared, tops, contact)
    ])  # fmt: skip
    events, peaks = events[times <= duration], peaks[tops <= duration]
    return Found(
        prepared, status, steps, events[np.argsort(events[:, 0], kind="stable")],
        peaks[np.argsort(peaks[:, 0], kind="stable")], logs,
    )  # fmt: skip


AT_CORNER = 1e-9
"""Share of a macro step within which a maximum is at a corner of the path; parts of the march end there exactly."""


def _at_corners(prepared: Prepared, times: FloatArray, contact: FloatArray) -> FloatArray:
    """Return 1 for the maxima that are at a kink or jump of their contact's path, or where it comes to other bodies."""
    corner, stride = np.zeros(len(times)), prepared.system.speed * prepared.grid.longest
    for i, one in enumerate(prepared.system.contacts):
        pieces, own = one.pieces, np.flatnonzero(contact == i)
        hard = pieces[1:][pieces[1:, numbers.JOIN] != numbers.SOFT, numbers.START]
        x = one.start + prepared.system.speed * times[own]
        if one.loop < len(pieces):
            begin, end = pieces[one.loop, numbers.START], pieces[-1, numbers.STOP]
            x = np.where(x >= end - AT_CORNER * stride, begin + np.mod(x - begin, end - begin), x)
            hard = np.append(hard, [begin, end]) if one.join != numbers.SOFT else hard
        if len(hard):
            away = np.abs(x[:, None] - hard).min(axis=1)
            corner[own] = away <= AT_CORNER * stride + 1e-14 * np.abs(x)
    for number, stretch in enumerate(prepared.stretches[1:], 1):
        away = np.abs(times - prepared.grid.times(np.array(stretch.first)))
        corner[np.isin(contact, prepared.moved_at(number)) & (away <= AT_CORNER * prepared.grid.longest)] = 1.0
    return corner
