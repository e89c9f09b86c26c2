"""Tables of a structure for macro steps at repeating places: computed once for a structure, a speed and a method.

Places repeat in every bay, and every wheel passes the seats, where the modes have kinks, at ends of macro steps. Steps
that divide a bay evenly do that for contacts whose distances are whole numbers of steps; these share their tables of
modes. Where there are others, what lies between two such passages is divided evenly. Units of length and force make the
tables' numbers those of the kernels.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator
from math import ceil
from threading import Lock
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.contract import Bodies, Method, Port, System
from wheeltapper.march.general.records import Nodes, Tables
from wheeltapper.march.general.structure import ComplexArray, Ring


class Units(NamedTuple):
    """Of the kernels: m, N."""

    length: float
    force: float


class Grid(NamedTuple):
    """Macro steps: when they end while a bay is passed, how long they are, and where each contact begins.

    Attributes
    ----------
    ends
        From 0 to the time that the way from a seat to the next one takes, s, (its steps + 1,); without seats to the end
        of one step.
    lengths, which
        Different lengths of steps, s, and which of them each of these steps has.
    speed
        m/s.
    phases
        Places in a bay of the ring, from each of which a step goes on.
    whole, part
        Each contact begins `whole` steps from a seat, and `part` m more. At speed zero it has one place, and
        `whole` counts bays.
    first, rows
        Tables have `rows` of the places, from the place `first` on.
    """

    ends: FloatArray
    lengths: FloatArray
    which: IntArray
    speed: float
    phases: int
    whole: IntArray
    part: FloatArray
    first: int
    rows: int

    @property
    def longest(self) -> float:
        """Length of the longest macro step, s."""
        return float(self.lengths.max())

    @property
    def same(self) -> float:
        """Distance of places that count as one, m."""
        return SAME_PHASE * self.speed * self.longest

    @property
    def lengths_of_rows(self) -> IntArray:
        """Which of the lengths the step of each row of the tables has."""
        return self.which[(self.first + np.arange(self.rows)) % len(self.which)]

    @property
    def reached(self) -> int:
        """Number of macro steps that the rows are enough for; then all repeats, or the run is over."""
        return self.rows - int(np.ptp(self.whole)) if self.rows < self.phases else self.rows

    @property
    def passed(self) -> IntArray:
        """The rows that a contact passes, rising."""
        begins = (self.whole - self.first) % self.phases
        return np.unique(np.add.outer(begins, np.arange(self.reached)) % self.rows)

    def seconds(self, step: IntArray | FloatArray) -> FloatArray:
        """Return the lengths of macro steps, s, in which parts count for nothing."""
        return self.lengths[self.which[np.asarray(step, dtype=np.int64) % len(self.which)]]

    def times(self, at: FloatArray | IntArray) -> FloatArray:
        """Return times, s, from macro steps and their parts."""
        step = np.floor(at).astype(np.int64)
        passed, own = np.divmod(step, len(self.which))
        return np.asarray(passed * self.ends[-1] + self.ends[own] + (at - step) * self.seconds(step))

    def steps(self, times: FloatArray) -> FloatArray:
        """Return macro steps and their parts from times, s."""
        passed = np.floor(times / self.ends[-1])
        since = times - passed * self.ends[-1]
        own = np.clip(np.searchsorted(self.ends, since, side="right") - 1, 0, len(self.which) - 1)
        return np.asarray(passed * len(self.which) + own + (since - self.ends[own]) / self.lengths[self.which[own]])

    def steps_until(self, time: float) -> int:
        """Return how many macro steps reach a time, s."""
        return max(1, ceil(float(self.steps(np.array(time))) - 1e-9))

    def alike(self) -> Iterator[tuple[float, Any]]:
        """Return the different lengths of steps, s, and the rows of the tables whose steps have them."""
        if len(self.lengths) == 1:
            yield float(self.lengths[0]), slice(None)
            return
        for number, seconds in enumerate(self.lengths.tolist()):
            yield seconds, np.flatnonzero(self.lengths_of_rows == number)


SAME_PHASE = 1e-6
"""Parts of a step; places no farther from each other are one."""
NEAR_PASSAGES = 1e-3
"""Parts of a step; passages of seats no farther from each other are at one end of a step. What is smoothed of a kink is
then smaller than other errors, and in much shorter steps rates of indentations, which some laws take, are rounding."""
MOST_PHASES = 12_000
"""Places in a bay; with 337 modes their tables take some 2 GB while they are made."""
FEW_MODES = 32
"""So few gain nothing from single precision."""
KEPT_BYTES = 2**27
"""Memory for tables of tracks that are kept for the next march."""
DEEPER_SEARCH = 1.15
"""Steps may be shorter by this factor for the sake of shared tables."""


def longest_step(ring: Ring | None, method: Method, bodies: Bodies | None = None) -> float:
    """Return the longest macro step, s, over which the nodes resolve the fastest mode of a track, and of bodies on it.

    For |λ|·H = 2π the error of ten nodes is some 1e-6 in that mode alone, that of twelve a fiftieth of that.
    """
    fastest = np.abs(ring.rates).max(initial=0.0) if ring is not None else 0.0
    if bodies is not None:
        fastest = max(fastest, np.abs(np.linalg.eigvals(states_of(bodies).A)).max())
    return min(method.step, 1.001 * 2.0 * np.pi / max(fastest, 1e-300))


def grid_of(system: System, method: Method, duration: float = np.inf, even: bool = False) -> Grid:
    """Choose the macro steps; of a ring with seats of its own all around, rows for a duration, s, are enough.

    `even`: all steps are equal, wherever wheels pass seats.
    """
    places = np.array([contact.position for contact in system.wheels])
    seconds, speed = longest_step(system.ring, method, system.bodies), system.speed
    one = np.array([0.0, seconds]), np.array([seconds]), np.zeros(1, np.int64), speed, 1
    if system.ring is None:
        return grid_between(np.array([0.0, seconds]), seconds, system)
    spacing, seats = system.ring.spacing, system.ring.seats
    if speed == 0.0:
        bays = np.floor(places / spacing + SAME_PHASE)
        return Grid(*one, bays.astype(np.int64), np.maximum(places - bays * spacing, 0.0), 0, 1)
    bay = spacing / seats
    least = max(1, ceil(bay / (speed * seconds) - 1e-9))
    if least > MOST_PHASES:
        slowest = spacing / (seats * MOST_PHASES * seconds)
        raise ValueError(f"tables of the track take too much memory below {slowest:.2g} m/s; a wheel may stand still")
    tried = [_placed(places, spacing, seats * n) for n in range(least, int(least * DEEPER_SEARCH) + 2)]
    kinds = [len(np.unique(np.round(part / SAME_PHASE))) + (np.abs(part).max() > SAME_PHASE) for _, part in tried]
    best = int(np.argmin(kinds))
    whole, part = tried[best]
    count = least + best
    which, part = np.zeros(count, np.int64), part * (bay / count)
    ends = np.arange(count + 1.0) * (bay / count)
    if part.any() and not even:
        ends, which = _between_passages(places, bay, speed * seconds)
        count, passed = len(which), np.floor(places / bay + SAME_PHASE * speed * seconds / bay)
        whole, part = count * passed.astype(np.int64), np.maximum(places - passed * bay, 0.0)
    lengths = np.diff(ends)[np.unique(which, return_index=True)[1]]
    grid = Grid(ends / speed, lengths / speed, which, speed, seats * count, whole, part, 0, seats * count)
    needed = np.ptp(whole) + grid.steps(np.array(duration)) + 2.0 if np.isfinite(duration) else np.inf
    if seats > 1 and needed < grid.phases:
        grid = grid._replace(first=int(whole.min()), rows=int(needed))
    return grid


def grid_between(times: FloatArray, longest: float, system: System) -> Grid:
    """Return macro steps that end at rising times, s, from zero on; what lies between is divided evenly.

    A track has no places where there are no seats.
    """
    spans, place = np.diff(times), np.zeros(len(system.wheels))
    counts = np.maximum(np.ceil(spans / longest - 1e-9).astype(np.int64), 1)
    divided = [
        np.linspace(begin, end, count, endpoint=False)
        for begin, end, count in zip(times[:-1], times[1:], counts, strict=True)
    ]
    ends, which = np.concatenate([*divided, times[-1:]]), np.repeat(np.arange(len(spans)), counts)
    return Grid(ends, spans / counts, which, system.speed, 1, place.astype(np.int64), place, 0, 1)


def _between_passages(places: FloatArray, bay: float, longest: float) -> tuple[FloatArray, IntArray]:
    """Return ends of steps, m, over a bay of so many m, and which of their different lengths each step has.

    Steps end where a contact passes a seat; what lies between is divided evenly. `longest` is that of a step, m.
    """
    passages, near = [0.0], NEAR_PASSAGES * longest
    for x in np.sort(-places % bay):
        if passages[-1] + near < x < bay - near:
            passages.append(float(x))
    spans = np.diff([*passages, bay])
    counts = np.ceil(spans / longest - 1e-9).astype(np.int64)
    divided = [np.linspace(x, x + span, n, endpoint=False) for x, span, n in zip(passages, spans, counts, strict=True)]
    return np.concatenate([*divided, [bay]]), np.repeat(np.arange(len(spans)), counts)


def _placed(places: FloatArray, spacing: float, phases: int) -> tuple[IntArray, FloatArray]:
    steps = places / (spacing / phases)
    whole = np.floor(steps + SAME_PHASE)
    part = steps - whole
    return whole.astype(np.int64), np.where(np.abs(part) < SAME_PHASE, 0.0, part)


def slowest_modes(rates: ComplexArray, seconds: float, q: int, negligible: float) -> IntArray:
    """Return for each degree the first mode, of rates in rising order, whose Legendre coefficient is not negligible.

    The coefficient of degree l of exp(2xz), z from -1 to 1, is at most about (2l + 1)·x^l/(1·3·…·(2l + 1)).
    """
    x = 0.55 * np.abs(rates) * seconds  # some tenth more, for the change of the shapes
    sizes = np.ones((q, len(rates)))
    for m in range(1, q):
        sizes[m] = sizes[m - 1] * x / (2 * m - 1)
    return np.array([np.argmax(row > negligible) if (row > negligible).any() else len(x) for row in sizes], np.int64)


def exponentials(matrix: FloatArray, factors: FloatArray) -> FloatArray:
    """Return the exponentials of a small matrix times each factor, (factors, n, n), by scaling and squaring."""
    size = np.abs(matrix).sum(axis=1).max(initial=0.0) * np.abs(factors).max(initial=0.0)
    squarings = max(0, ceil(np.log2(max(size, 1e-300))) + 3)
    scaled = factors[:, None, None] * matrix / 2.0**squarings
    term = total = np.broadcast_to(np.eye(len(matrix)), scaled.shape)
    for k in range(1, 20):
        term = term @ scaled / k
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return np.asarray(total)


class States(NamedTuple):
    """Bodies in first order: x' = A·x - B·N, indentation S·x.

    States are the displacements of all freedoms, the velocities of those with mass, and 1, which carries the loads.
    """

    A: FloatArray
    B: FloatArray
    S: FloatArray


class Equations(NamedTuple):
    """E·x' = F·x - G·N, linear in the bodies' matrices."""

    E: FloatArray
    F: FloatArray
    G: FloatArray


def heavy_of(bodies: Bodies) -> IntArray:
    """Return the freedoms that have mass."""
    return np.flatnonzero(bodies.mass.any(axis=1))


def equations_of(bodies: Bodies, heavy: IntArray, unit: float = 1.0) -> Equations:
    """Return the equations of bodies of which some freedoms are `heavy`; `unit` is 0 for those of a derivative."""
    count, contacts = bodies.shapes.shape
    light = np.setdiff1d(np.arange(count), heavy)
    size = count + len(heavy) + 1
    fast = count + np.arange(len(heavy))  # states that are velocities
    E, F, G = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, contacts))
    E[heavy, heavy] = E[-1, -1] = F[heavy, fast] = unit
    for rows, of in ((light, light), (fast, heavy)):  # balances of forces
        E[np.ix_(rows, light)] = bodies.damping[np.ix_(of, light)]
        F[rows, :count] = -bodies.stiffness[of]
        F[np.ix_(rows, fast)] = -bodies.damping[np.ix_(of, heavy)]
        F[rows, -1], G[rows] = bodies.load[of], bodies.shapes[of]
    E[np.ix_(fast, fast)] = bodies.mass[np.ix_(heavy, heavy)]
    return Equations(E, F, G)


def states_of(bodies: Bodies) -> States:
    """Return bodies as a system of first order."""
    E, F, G = equations_of(bodies, heavy_of(bodies))
    S = np.zeros((bodies.shapes.shape[1], len(E)))
    S[:, : len(bodies.mass)] = bodies.shapes.T
    return States(np.asarray(np.linalg.solve(E, F)), np.asarray(np.linalg.solve(E, G)), S)


def shapes_at(ring: Ring, shapes: ComplexArray, inside: FloatArray) -> ComplexArray:
    """Return shapes at places in a bay, from 0 to the spacing: (places, modes)."""
    element = np.clip(np.searchsorted(ring.edges, inside, side="right") - 1, 0, len(ring.edges) - 2)
    left, right = ring.edges[element], ring.edges[element + 1]
    zeta = (2.0 * inside - left - right) / (right - left)
    out = np.empty((len(inside), shapes.shape[2]), dtype=complex)
    powers = zeta[:, None] ** np.arange(shapes.shape[1])
    for number in range(len(ring.edges) - 1):
        there = element == number
        out[there] = real_times(powers[there], shapes[number])
    return out


def real_times(matrix: FloatArray, values: ComplexArray) -> ComplexArray:
    """Return a real matrix times complex ones, without making it complex."""
    return np.asarray((matrix @ np.ascontiguousarray(values).view(float)).view(complex))


def compliance_at(ring: Ring, inside: FloatArray) -> FloatArray:
    """Return the local compliance at places in a bay, m/N."""
    return np.asarray(shapes_at(ring, ring.residual[:, :, None].astype(complex), inside)[:, 0].real)


def _split(values: ComplexArray, sign: float) -> FloatArray:
    """Return real and imaginary parts along the last axis but one, the latter times a sign."""
    return np.stack([values.real, sign * values.imag], axis=-2)


class RingTables(NamedTuple):
    """Of one set: at the nodes of all rows that are passed, (rows, q, modes) complex, and of the residual (rows, q)."""

    shows: ComplexArray
    takes: ComplexArray
    residual: FloatArray


def ring_tables(ring: Ring, order: IntArray, grid: Grid, part: float, nodes: Nodes) -> RingTables:
    """Return one set of tables."""
    q, passed = len(nodes.places), grid.passed
    rows = grid.first + passed
    times = grid.times(rows)[:, None] + np.multiply.outer(grid.seconds(rows), nodes.places)
    along = part + grid.speed * times
    laps = np.floor(along / ring.spacing)
    over = laps > 0.0  # behind the last phase's end: turned below
    x = (along - laps * ring.spacing).ravel()
    shape = (len(passed), q, len(order))
    shows = shapes_at(ring, ring.deflection[:, :, order], x).reshape(shape)
    takes = shapes_at(ring, ring.drive[:, :, order], x).reshape(shape)
    if ring.bays > 1 and over.any():
        shows[over] *= ring.turns[order]
        takes[over] *= ring.turns[order].conj()
    for number, seconds in enumerate(grid.lengths.tolist()):
        some = slice(None) if len(grid.lengths) == 1 else grid.lengths_of_rows[passed] == number
        growth = np.exp(np.multiply.outer(nodes.places * seconds, ring.rates[order]))
        shows[some] *= ring.weights[order] * growth
        takes[some] *= seconds / growth
    residual = compliance_at(ring, x).reshape(len(passed), q)
    return RingTables(shows, takes, residual)


def sets_of(ring: Ring, order: IntArray, grid: Grid, made_at: Callable[[float], RingTables]) -> list[RingTables]:
    """Return the tables of all sets; at speed zero those of each contact, as seen from the bay of the first one."""
    if grid.speed > 0.0:
        return [made_at(part) for part in parts_of(grid)[0]]
    made = []
    for bay, part in zip(grid.whole, grid.part, strict=True):
        one = made_at(part)
        turn = np.exp(1j * np.angle(ring.turns[order]) * (bay - grid.whole[0]))
        made.append(RingTables(one.shows * turn, one.takes / turn, one.residual))
    return made


def parts_of(grid: Grid) -> tuple[FloatArray, IntArray]:
    """Return the different parts, m, at which contacts begin, and which of them each contact has."""
    if grid.speed == 0.0:
        return grid.part, np.arange(len(grid.part))
    _, first, sets = np.unique(np.round(grid.part / grid.same), return_index=True, return_inverse=True)
    return grid.part[first], sets.astype(np.int64)


def phases_and_bays(grid: Grid) -> tuple[IntArray, IntArray]:
    """Return where in a bay each contact begins, in macro steps, and in which bay."""
    phase, bay = (grid.whole - grid.first) % grid.phases, grid.whole // grid.phases
    return phase, np.full_like(bay, bay[0]) if grid.speed == 0.0 else bay


def _products(shows: ComplexArray, takes: ComplexArray) -> FloatArray:
    """Return Re Σ_n shows[p, k, n]·takes[p, l, n], (p, k, l)."""
    left = np.concatenate([shows.real, shows.imag], axis=2)
    right = np.concatenate([takes.real, -takes.imag], axis=2)
    return np.asarray(left @ right.swapaxes(1, 2))


class ModalTables(NamedTuple):
    """As entries of `Tables`."""

    reads: FloatArray
    writes: FloatArray
    first: IntArray
    decay: FloatArray
    turns: FloatArray
    fixed_reads: FloatArray
    fixed_writes: FloatArray


class TrackTables(NamedTuple):
    """What a track is to contacts that go along at one speed, whatever stands on it.

    Attributes
    ----------
    units
        Of what follows; for others it differs by exact factors.
    grid
        Macro steps.
    modal
        Of the modes.
    sets, phase, bay, residual
        As in `Tables`.
    answers
        To forces at the nodes: (contact, other, phases, q, q).
    """

    units: Units
    grid: Grid
    modal: ModalTables
    sets: IntArray
    phase: IntArray
    bay: IntArray
    residual: FloatArray
    answers: FloatArray


class BodyTables(NamedTuple):
    """What bodies are to the contacts: as in `Tables`, and their answers, (contact, other, lengths, q, q)."""

    read: FloatArray
    write: FloatArray
    step: FloatArray
    answers: FloatArray


_kept: OrderedDict[tuple[Any, ...], tuple[Ring | None, TrackTables]] = OrderedDict()
_kept_lock = Lock()


def track_tables(
    system: System, method: Method, units: Units, duration: float = np.inf, even: bool = False
) -> TrackTables:  # fmt: skip
    """Return the tables of a system's track for its speed and the places of its contacts, enough for a duration, s.

    `even`: all macro steps are equal, wherever wheels pass seats. Those that were made last are kept: many marches go
    over one track at one speed.
    """
    grid = grid_of(system, method, duration, even)
    content = (*grid, *(part for port in system.ports for part in port))
    key = id(system.ring), method, units, tuple(np.asarray(part).tobytes() for part in content)
    with _kept_lock:
        if key in _kept:
            _kept.move_to_end(key)
            return _kept[key][1]
    made = tables_on(grid, system, method, units)
    size = _size_of(made)
    with _kept_lock:
        if size <= KEPT_BYTES:
            _kept[key] = system.ring, made  # with the ring, so that no other one gets its identity
        while sum(_size_of(tables) for _, tables in _kept.values()) > KEPT_BYTES:
            _kept.popitem(last=False)
    return made


def _size_of(tables: TrackTables) -> int:
    """Return the size of tables in memory, bytes."""
    return sum(part.nbytes for part in (*tables.modal, tables.residual, tables.answers))


def forget_tables() -> None:
    """Give up all tables that are kept."""
    with _kept_lock:
        _kept.clear()


def tables_on(grid: Grid, system: System, method: Method, units: Units) -> TrackTables:
    """Return the tables of a system's track for given macro steps."""
    nodes = gauss_nodes(method.nodes)
    q, contacts = method.nodes, len(system.contacts)
    sets = parts_of(grid)[1]
    g = np.zeros((contacts, contacts, grid.rows, q, q))
    residual = np.zeros((contacts, grid.rows, q))
    modal = _no_modes(q, grid)
    phase, bay = phases_and_bays(grid)
    if system.ring is not None:
        ring = system.ring
        order = np.argsort(np.abs(ring.rates), kind="stable")
        made = sets_of(ring, order, grid, lambda part: ring_tables(ring, order, grid, part, nodes))
        fixed = [_fixed_tables(ring, order, grid, port, nodes) for port in system.ports]
        modal = modal_tables(ring, order, grid, made, fixed, nodes, method, units)
        ring_kernels(ring, order, grid, made, fixed, g, residual)
    scale = units.force / units.length
    g *= scale
    residual *= scale
    return TrackTables(units, grid, modal, sets, phase.astype(np.int64), bay.astype(np.int64), residual, g)


def body_tables(bodies: Bodies, grid: Grid, method: Method, units: Units) -> BodyTables:
    """Return the tables of bodies for some macro steps."""
    nodes, states = gauss_nodes(method.nodes), states_of(bodies)
    answers = _body_answers(states, grid, nodes) * (units.force / units.length)
    return BodyTables(*_body_tables(states, grid, nodes, units), answers)


def joined(track: TrackTables, bodies: BodyTables, method: Method, units: Units) -> Tables:
    """Return the tables of a track and of bodies on it, in the bodies' units."""
    nodes, contacts = gauss_nodes(method.nodes), len(track.answers)
    length, force = units.length / track.units.length, units.force / track.units.force
    modal = track.modal
    if length != 1.0 or force != 1.0:
        number = modal.reads.dtype.type
        modal = modal._replace(
            reads=modal.reads * number(1.0 / length), writes=modal.writes * number(force),
            fixed_reads=modal.fixed_reads * number(1.0 / length), fixed_writes=modal.fixed_writes * number(force),
        )  # fmt: skip
    g = track.answers * (force / length) + bodies.answers[:, :, track.grid.lengths_of_rows]
    residual = track.residual * (force / length)
    own = np.arange(contacts)
    kernels = nodes.transform @ g[own, own] @ nodes.transform.T
    coupled = are_coupled(g, method)
    made = Tables(
        modal.reads, modal.writes, modal.first, modal.decay, modal.turns,
        track.sets, track.phase, track.bay, bodies.read, bodies.write, bodies.step,
        kernels, g[own, own] * nodes.integrals, g, coupled, residual @ nodes.transform.T, residual,
        modal.fixed_reads, modal.fixed_writes, track.grid.lengths_of_rows, track.grid.lengths, clock_of(track.grid),
    )  # fmt: skip
    return Tables._make(np.ascontiguousarray(part) for part in made)  # kernels are compiled for each layout


def clock_of(grid: Grid) -> FloatArray:
    """Return when the steps of the tables' rows begin, counted from the first one, and when the last one ends, s."""
    return np.asarray(grid.times(grid.first + np.arange(grid.rows + 1)) - grid.times(np.array(grid.first)))


def are_coupled(answers: FloatArray, method: Method) -> IntArray:
    """Return which contacts feel which others, from (contact, other, phases, q, q), 1 or 0."""
    felt = np.abs(answers).max(axis=(2, 3, 4)) > method.newton * 1e-2
    return (felt & ~np.eye(len(felt), dtype=bool)).astype(np.int64)


def without_bodies(track: TrackTables, method: Method) -> Tables:
    """Return the tables of a track alone, in its own units."""
    contacts, _, _, q, _ = track.answers.shape
    nothing, count = np.zeros((contacts, q, 1)), len(track.grid.lengths)
    bodies = BodyTables(
        np.stack(count * [nothing]), np.stack(count * [nothing]), np.ones((count, 1, 1)),
        np.zeros((contacts, contacts, count, q, q)),
    )  # fmt: skip
    return joined(track, bodies, method, track.units)


def _no_modes(q: int, grid: Grid) -> ModalTables:
    lengths = len(grid.lengths)
    empty, none = np.zeros((1, grid.rows, q, 2, 0)), np.zeros((0, lengths, q, 2, 0))
    return ModalTables(
        empty, empty.copy(), np.zeros(q, np.int64), np.zeros((lengths, 2, 0)), np.zeros((1, 2, 0)), none, none
    )


def modal_tables(
    ring: Ring, order: IntArray, grid: Grid, made: list[RingTables], fixed: list[RingTables], nodes: Nodes,
    method: Method, units: Units,
) -> ModalTables:  # fmt: skip
    """Return the Legendre coefficients of what modes show and take, in the units of the march."""
    number: Any = np.float32 if method.single and len(order) > FEW_MODES else np.float64
    rates, q, lengths = ring.rates[order], len(nodes.places), len(grid.lengths)
    decay = np.exp(np.multiply.outer(grid.lengths, rates))
    first = slowest_modes(rates, grid.longest, q, method.negligible)
    reads, writes, fixed_reads, fixed_writes = (
        np.zeros((*count, q, 2, len(order)), number)
        for count in 2 * [(len(made), grid.rows)] + 2 * [(len(fixed), lengths)]
    )
    passed = slice(None) if len(grid.passed) == grid.rows else grid.passed
    decays = decay[grid.lengths_of_rows[passed]][:, None] if lengths > 1 else decay
    of_wheels = made, passed, decays, reads, writes
    of_ports = fixed, slice(None), decay[:, None], fixed_reads, fixed_writes
    for tables, rows, decayed, read, write in (of_wheels, of_ports):
        for one, own_read, own_write in zip(tables, read, write, strict=True):
            shown = real_times(nodes.transform / -units.length, one.shows)
            own_read[rows] = _split(shown, -1.0)
            taken = real_times(nodes.transform * units.force, one.takes * decayed)
            own_write[rows] = _split(taken, 1.0)
    turns = np.exp(1j * np.multiply.outer(np.arange(ring.bays), np.angle(ring.turns[order])))
    if grid.speed == 0.0:  # nobody enters another bay
        turns = np.ones((1, len(order)), dtype=complex)
    return ModalTables(
        reads, writes, first, _split(decay, 1.0), _split(turns, 1.0), fixed_reads, fixed_writes,
    )  # fmt: skip


def _fixed_tables(ring: Ring, order: IntArray, grid: Grid, port: Port, nodes: Nodes) -> RingTables:
    """Return the tables of a contact that stays where it is: of one place, for each length of a step."""
    growth = np.exp(np.multiply.outer(np.multiply.outer(grid.lengths, nodes.places), ring.rates[order]))
    shows = ring.weights[order] * port.deflection[order] * growth
    takes = port.drive[order] * grid.lengths[:, None, None] / growth
    return RingTables(shows, takes, np.full(growth.shape[:2], port.residual))


def ring_kernels(
    ring: Ring, order: IntArray, grid: Grid, made: list[RingTables], fixed: list[RingTables], g: FloatArray,
    residual: FloatArray,
) -> None:  # fmt: skip
    """Write what forces at the nodes of each contact do at those of each other, for all steps that are reached."""
    sets, (phase, bay) = parts_of(grid)[1], phases_and_bays(grid)
    phases, steps = grid.rows, np.arange(grid.reached)
    own = [_products(one.shows, one.takes) for one in made]
    place = np.zeros(phases, np.int64)
    place[grid.passed] = np.arange(len(grid.passed))
    at = [place[(phase[i] + steps) % phases] for i in range(len(sets))]
    residual, g = residual[:, : len(steps)], g[:, :, : len(steps)]
    bays = [bay[i] + (phase[i] + steps) // phases for i in range(len(sets))]
    for i in range(len(sets)):
        residual[i] = made[sets[i]].residual[at[i]]
        g[i, i] += own[sets[i]][at[i]]
        for j in range(len(sets)):
            if i != j:
                ahead = (bays[i] - bays[j])[:, None, None]
                turn = np.exp(1j * ahead * np.angle(ring.turns[order]))
                g[i, j] += _products(made[sets[i]].shows[at[i]] * turn, made[sets[j]].takes[at[j]])
    for number in range(len(grid.lengths)):
        some = np.flatnonzero(grid.lengths_of_rows[steps] == number)
        ports = [
            RingTables(port.shows[[number]], port.takes[[number]], port.residual[[number]]) for port in fixed
        ]  # fmt: skip
        for k, port in enumerate(ports, len(sets)):
            for i in range(len(sets)):
                moving = made[sets[i]]
                g[i, k, some] += _products(moving.shows[at[i][some]], port.takes)
                g[k, i, some] += _products(port.shows, moving.takes[at[i][some]])
            residual[k, some] = port.residual
            for m, other in enumerate(ports, len(sets)):
                g[k, m, some] += _products(port.shows, other.takes)


def _body_answers(states: States, grid: Grid, nodes: Nodes) -> FloatArray:
    """Return what bodies answer to forces at the nodes, (contact, other, lengths, q, q)."""
    q, out = len(nodes.places), []
    later = np.subtract.outer(nodes.places, nodes.places).ravel()
    for seconds in grid.lengths:
        answers = states.S @ exponentials(states.A * seconds, later) @ states.B
        out.append(seconds * np.moveaxis(answers.reshape(q, q, *answers.shape[1:]), (0, 1), (2, 3)))
    return np.stack(out, axis=2)


def _body_tables(states: States, grid: Grid, nodes: Nodes, units: Units) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what bodies show to contacts, what forces do to them, and one step of theirs, for each of the lengths."""
    reads, writes, steps = [], [], []
    for seconds in grid.lengths:
        over = states.A * seconds
        shown = states.S @ exponentials(over, nodes.places)
        taken = exponentials(over, 1.0 - nodes.places) @ states.B
        read = np.tensordot(nodes.transform, shown, (1, 0)) / units.length  # (q, contacts, states)
        write = np.tensordot(nodes.transform, taken, (1, 0)) * (-seconds * units.force)  # (q, states, contacts)
        reads.append(read.transpose(1, 0, 2))
        writes.append(write.transpose(2, 0, 1))
        steps.append(exponentials(over, np.ones(1))[0])
    return np.stack(reads), np.stack(writes), np.stack(steps)
