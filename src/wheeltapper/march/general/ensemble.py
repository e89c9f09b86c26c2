"""Many cells of the general march: those of one track, speed and geometry share its tables and march in step.

What comes of a cell depends neither on the number of threads nor on the cells beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextvars import copy_context
from itertools import zip_longest
from math import ceil
from threading import Event, Lock
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import algebra_on_one_thread
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Rows, row_of
from wheeltapper.march.common.telling import GENERAL_CHUNK
from wheeltapper.march.general import layout
from wheeltapper.march.general import march as general
from wheeltapper.march.general import tables as tabulation
from wheeltapper.march.general.basis import flight_nodes, gauss_nodes
from wheeltapper.march.general.cells import Kinds, Lanes, Own, cells_kernel
from wheeltapper.march.general.contract import Contact, System, Task
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.march import Found, Rest
from wheeltapper.march.general.modal import TOGETHER
from wheeltapper.march.general.records import Data, Logs, Room, Stage, Tables
from wheeltapper.march.general.replay import lay
from wheeltapper.march.general.structure import ComplexArray

OF_A_PLACE = 150.0
"""Macro steps of a cell in step with others that cost as much as to make the tables of one place in a bay."""
MOST_LANES = 64
"""Cells that march in step; the modes of more of them leave the processor's cache."""


class Until(NamedTuple):
    """Where cells may end before their time: at an impact, or at the first loss after an impact; -1: they do not."""

    impact: int = -1
    loss: int = -1


TO_THE_END = Until()


class MarchedCells(NamedTuple):
    """What comes of some cells, in SI units; rows are sorted by cell, contact and time.

    Attributes
    ----------
    status
        Why each cell ended, (cells,).
    end
        s, (cells,).
    events
        As in `common.program`, with the contact counted over all cells: cell times contacts plus contact.
    peaks
        Time in s, force in N, contact.
    """

    status: IntArray
    end: FloatArray
    events: FloatArray
    peaks: FloatArray


# -- tables that cells share ------------------------------------------------------------------------------------------


class Shared(NamedTuple):
    """What tasks share: tables of their track, also in the kernel's form, and the track under forces at rest."""

    track: tabulation.TrackTables
    tables: Tables
    rest: Rest


class SharedTrack:
    """Tables of the track of some tasks that share them; made once, when first asked for, and given up in the end."""

    def __init__(self, tasks: Sequence[Task], users: int) -> None:
        self._task, self._users, self._lock = tasks[0], users, Lock()
        self._duration = max(task.duration for task in tasks)
        self._made: Shared | None = None

    def __enter__(self) -> Shared:
        system, method = self._task.system, self._task.method
        with self._lock:
            if self._made is None:
                units = general.units_of(system.wheels, general.carried_loads(system))
                track = tabulation.track_tables(system, method, units, self._duration)
                self._made = Shared(track, tabulation.without_bodies(track, method), general.rest_of(system))
            return self._made

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._users -= 1
            if not self._users:
                self._made = None


def same_track(task: Task) -> tuple[Any, ...]:
    """Return what tasks have in common that share the tables of a track."""
    system = task.system
    step = tabulation.longest_step(system.ring, task.method, system.bodies)
    places = tuple(contact.position for contact in system.wheels), len(system.ports)
    return id(system.ring), system.speed, places, task.method, step


class Work(NamedTuple):
    """Some tasks that march together, by their numbers, and their track."""

    numbers: IntArray
    track: SharedTrack


def works_of(tasks: Sequence[Task], threads: int, most: int = MOST_LANES) -> list[Work]:
    """Return all tasks as works in the order in which threads take them; `most` tasks together.

    The dearest tracks come first, so that what is left in the end is short, and within a track the longest tasks. As
    many tracks as there are threads take turns: no thread waits for tables that another one makes, and tables of no
    more tracks are held at a time.
    """
    groups: dict[tuple[Any, ...], list[int]] = {}
    for number, task in enumerate(tasks):
        groups.setdefault(same_track(task), []).append(number)
    together = min(most, max(TOGETHER, ceil(len(tasks) / (2 * threads))))
    tracks = []
    for numbers in sorted(groups.values(), key=lambda numbers: _cost([tasks[one] for one in numbers]), reverse=True):
        numbers.sort(key=lambda number: tasks[number].duration, reverse=True)
        parts = np.array_split(np.array(numbers), ceil(len(numbers) / together))
        track = SharedTrack([tasks[number] for number in numbers], len(parts))
        tracks.append([Work(part, track) for part in parts])
    turns = (zip_longest(*tracks[first : first + threads]) for first in range(0, len(tracks), threads))
    return [work for one in turns for works in one for work in works if work is not None]


def _cost(tasks: Sequence[Task]) -> float:
    """Return what tasks of one track cost together, roughly, in macro steps of a cell."""
    system, method = tasks[0].system, tasks[0].method
    seconds = tabulation.longest_step(system.ring, method, system.bodies)
    marched = sum(task.duration for task in tasks) / seconds
    if system.ring is None or system.speed == 0.0:
        return marched
    way = system.ring.spacing if system.ring.seats == 1 else max(task.duration for task in tasks) * system.speed
    return marched + OF_A_PLACE * way / (system.speed * seconds)


def on_threads(works: Sequence[Work], threads: int, one: Callable[[Work, Callable[[], bool]], None]) -> None:
    """Do all works; an error of one, or an interruption, soon ends all: `one` is given what tells it to stop."""
    stop = Event()
    with algebra_on_one_thread():
        if threads == 1 or len(works) < 2:
            for work in works:
                one(work, stop.is_set)
            return
        with ThreadPoolExecutor(threads) as pool:
            try:
                begun = [pool.submit(copy_context().run, one, work, stop.is_set) for work in works]
                for done in as_completed(begun):
                    done.result()
            finally:
                stop.set()
                pool.shutdown(wait=False, cancel_futures=True)


# -- cells in step ----------------------------------------------------------------------------------------------------


class _Kind(NamedTuple):
    """What cells share that differ in their paths only."""

    number: int
    units: tabulation.Units
    static: FloatArray
    laws: FloatArray
    sinking: FloatArray  # of the track under each contact at rest, m
    local: FloatArray  # the part of that which the modes leave out, m
    amplitudes: ComplexArray
    tables: tabulation.BodyTables
    law_tables: list[FloatArray]


class _Stack:
    """Tables behind each other, each but once."""

    def __init__(self) -> None:
        self._tables: list[FloatArray] = []
        self._first: dict[int, int] = {}
        self._count = 0

    def first_row(self, table: FloatArray) -> int:
        """Return the first row of a table, which is added where it is new."""
        if id(table) not in self._first:
            self._first[id(table)] = self._count
            self._count += len(table)
            self._tables.append(table)  # which keeps its id
        return self._first[id(table)]

    @property
    def rows(self) -> FloatArray:
        """All tables."""
        width = max(one.shape[1] for one in self._tables)
        return np.vstack([np.pad(one, ((0, 0), (0, width - one.shape[1]))) for one in self._tables])


class _Block:
    """Some tasks of one track as lanes for the kernel."""

    def __init__(self, tasks: Sequence[Task], shared: Shared) -> None:
        self.tasks, self.shared = tasks, shared
        self.method, self.grid = tasks[0].method, shared.track.grid
        self.nodes = gauss_nodes(self.method.nodes), gauss_nodes(self.method.careful_nodes), *flight_nodes()
        self.known: dict[tuple[int, ...], _Kind] = {}
        self.law_tables, self.paths = _Stack(), _Stack()
        self.kinds = [self._kind(task.system) for task in tasks]
        self.lanes = self._lanes()

    def _kind(self, system: System) -> _Kind:
        """Return what a system has beside its paths."""
        key = id(system.bodies), *(id(contact.law) for contact in system.contacts)
        if key not in self.known:
            static, rest = general.static_forces(system), self.shared.rest
            units = general.units_of(system.contacts, static)
            tables = [general.table_of(contact) for contact in system.contacts]
            laws = [
                general.law_row(contact, units, self.law_tables.first_row(table))
                for contact, table in zip(system.contacts, tables, strict=True)
            ]
            self.known[key] = _Kind(
                len(self.known), units, static, np.array(laws), rest.deflections @ static, rest.local * static,
                static @ rest.amplitudes,
                tabulation.body_tables(system.bodies, self.grid, self.method, units), tables,
            )  # fmt: skip
        return self.known[key]

    def _lanes(self) -> Lanes:
        """Return the lanes of all cells at their starts; what is left over up to a multiple of TOGETHER has ended."""
        first, q = self.tasks[0].system, self.method.nodes
        contacts, modes = len(first.contacts), self.shared.tables.decay.shape[2]
        count = TOGETHER * ceil(len(self.tasks) / TOGETHER)
        each = count, contacts
        lanes = Lanes(
            np.zeros((count, 2, modes)), np.zeros((count, len(tabulation.states_of(first.bodies).A))),
            np.zeros(each, layout.STATE), np.zeros((*each, q)), np.zeros((*each, q)),
            np.zeros(each, layout.TREND), np.zeros(each, layout.ENDS), np.zeros((*each, switch.LAW_NUMBERS)),
            np.zeros(each), np.zeros(count, layout.SETTINGS), np.zeros(each), np.zeros(count, np.int64),
            np.ones((count, 2)), np.zeros(count, np.int64), np.full(count, contract.DONE),
            np.zeros((*each, 2), np.int64), np.zeros((contacts, count, q)), np.zeros((contacts, count, q)),
        )  # fmt: skip
        lanes.bodies[:, -1] = 1.0
        lanes.trend["lowest"] = np.inf
        units, order = self.shared.track.units, general.order_of(first.ring)
        for w, (task, kind) in enumerate(zip(self.tasks, self.kinds, strict=True)):
            lanes.laws[w], lanes.kind[w] = kind.laws, kind.number
            lanes.settings[w] = general.settings_of(task.system, self.method, kind.units)
            lanes.scales[w] = kind.units.length / units.length, kind.units.force / units.force
            lanes.steps[w] = self.grid.steps_until(task.duration)
            lanes.status[w] = contract.RUNNING
            lanes.modes[w] = np.stack([kind.amplitudes.real, kind.amplitudes.imag])[:, order]
            at = [self._set_at_rest(w, i, contact, kind, lanes) for i, contact in enumerate(task.system.contacts)]
            self._raise(w, task.system, kind, lanes, np.array([height for height, _ in at]), [spot for _, spot in at])
        return lanes

    def _set_at_rest(self, w: int, i: int, contact: Contact, kind: _Kind, lanes: Lanes) -> tuple[float, general.Spot]:
        """Write a contact's path, and its state in equilibrium; return the path's height and its running surface."""
        begin, pieces = self.paths.first_row(contact.pieces), len(contact.pieces)
        lanes.ends[w, i] = begin, begin + pieces, contact.loop, contact.join
        lanes.starts[w, i] = contact.start
        ends = np.array([(0, pieces, contact.loop, contact.join)], layout.ENDS)
        data = Data(
            *self.nodes, contact.pieces, ends, kind.laws[i : i + 1], kind.law_tables[i], lanes.starts[w, i : i + 1],
            lanes.settings[w],
        )  # fmt: skip
        height, spots = general.path_at_start(data, kind.units)
        law = general.law_row(contact, kind.units, 0)
        force = float(kind.static[i]) / kind.units.force
        delta = general.indentation_of(force, law, kind.law_tables[i], spots[0])
        lanes.contacts[w, i] = general.first_places(data)[0]
        lanes.contacts["piece"][w, i] += begin
        lanes.contacts["began"][w, i] = delta
        lanes.sinking[w, i] = delta - height[0] + kind.sinking[i] / kind.units.length
        lanes.forces[w, i] = force
        return float(height[0]), spots[0]

    def _raise(
        self, w: int, system: System, kind: _Kind, lanes: Lanes, height: FloatArray, spots: list[general.Spot]
    ) -> None:  # fmt: skip
        """Move the wheels of a lane at rest to where they start."""
        bodies, length, contacts = system.bodies, kind.units.length, lanes.contacts[w]
        if not bodies.raised.size and not bodies.guides.size:
            return
        moved = lanes.bodies[w, :-1]
        if bodies.guides.size:
            level, stood = general.standing(system, kind.static, kind.units, contacts["began"], height, spots)
            lanes.sinking[w], moved[: len(bodies.mass)] = level, stood * length
        if bodies.raised.size:
            moved[:] = general.raised_state(bodies, moved, lanes.sinking[w] * length)
        sprung = kind.local - kind.sinking + bodies.shapes.T @ moved[: len(bodies.mass)]
        gap = height + lanes.sinking[w] + sprung / length
        contacts["phase"] = (gap <= 0.0) & (kind.laws[:, switch.LAW_PULLS] == 0.0)
        compliance = kind.local / kind.static * kind.units.force / length
        for i, contact in enumerate(system.contacts):
            law = general.law_row(contact, kind.units, 0)
            contacts["began"][i] = general.indentation_within(
                float(gap[i]), float(compliance[i]), law, kind.law_tables[i], spots[i]
            )

    def march(self, until: Until, stopped: Callable[[], bool]) -> MarchedCells:
        """March all cells to their ends."""
        lanes, kinds, logs, step = self.lanes, self._kinds(), self._logs(), 0
        data = Data(
            *self.nodes, self.paths.rows, lanes.ends[0], lanes.laws[0], self.law_tables.rows, lanes.starts[0],
            lanes.settings[0],
        )  # fmt: skip
        stage, room, own = self._rooms()
        events, peaks = [], []
        while (lanes.status == contract.RUNNING).any() and not stopped():
            logs = logs._replace(used=row_of(layout.USED))
            step = cells_kernel(
                step, step + GENERAL_CHUNK, *until, self.shared.tables, kinds, lanes, data, stage, logs, room, own
            )
            events.append(logs.events[: logs.used["events"]].copy())
            peaks.append(logs.peaks[: logs.used["peaks"]].copy())
        return self._found(np.concatenate(events), np.concatenate(peaks))

    def _kinds(self) -> Kinds:
        """Return the tables of all kinds."""
        nodes, track = self.nodes[0], self.shared.track
        made = [kind.tables for kind in self.known.values()]
        scales = [kind.units.force / kind.units.length for kind in self.known.values()]
        one = track.units.force / track.units.length
        coupled = [
            tabulation.are_coupled(
                track.answers * (scale / one) + bodies.answers[:, :, self.grid.lengths_of_rows], self.method
            )
            for scale, bodies in zip(scales, made, strict=True)
        ]
        g = np.stack([bodies.answers for bodies in made])  # (kinds, contact, other, lengths, q, q)
        own = np.arange(g.shape[1])
        kinds = Kinds(
            np.stack([bodies.read for bodies in made]), np.stack([bodies.write for bodies in made]),
            np.stack([bodies.step for bodies in made]), nodes.transform @ g[:, own, own] @ nodes.transform.T,
            g[:, own, own] * nodes.integrals, g, np.stack(coupled),
        )  # fmt: skip
        return Kinds._make(np.ascontiguousarray(part) for part in kinds)

    def _logs(self) -> Logs:
        """Return logs with room for the worst macro step of all lanes, and for many usual ones."""
        count, contacts = self.lanes.starts.shape
        margin = count * contacts * (layout.MOST_PARTS + 2)
        none, empty = np.zeros((0, 1, 1)), np.zeros((0, 1))
        return Logs(
            np.empty(contacts * (layout.MOST_PARTS + 2), layout.ROW), np.empty(2 * margin, layout.EVENT),
            np.empty(4 * margin, layout.MAXIMUM), none, none, empty, none, row_of(layout.USED),
        )  # fmt: skip

    def _rooms(self) -> tuple[Stage, Room, Own]:
        """Return scratch memory."""
        contacts, q = self.lanes.starts.shape[1], self.method.nodes
        own = Own(
            np.zeros((contacts, 1, q, q)), np.zeros((contacts, 1, q, q)), np.zeros((contacts, contacts, 1, q, q)),
            np.zeros((contacts, 1, q)), np.zeros((contacts, 1, q)), np.zeros((q, *self.lanes.modes.shape[1:])),
        )  # fmt: skip
        return general.stage_of(contacts, q, 0), general.room_of(self.lanes.bodies.shape[1]), own

    def _found(self, events: Rows, peaks: Rows) -> MarchedCells:
        """Return what came of the cells, without what is behind their ends."""
        length, force = (np.array([kind.units[column] for kind in self.kinds]) for column in range(2))
        when, owner, kept = self._in_order(events)
        rate = events["rate"][kept] * length[owner]
        happened = np.column_stack([when, events["kind"][kept], rate, events["contact"][kept]])
        at, owner, kept = self._in_order(peaks)
        tops = np.column_stack([at, peaks["force"][kept] * force[owner], peaks["contact"][kept]])
        durations = np.array([task.duration for task in self.tasks])
        return MarchedCells(self.lanes.status[: len(self.tasks)].copy(), durations, happened, tops)

    def _in_order(self, rows: Rows) -> tuple[FloatArray, IntArray, IntArray]:
        """Return times, cells and numbers of rows up to their cells' ends, sorted by contact and time."""
        times = self.grid.times(rows["step"] + rows["part"])
        owner = rows["contact"].astype(np.int64) // self.lanes.starts.shape[1]
        ends = np.array([task.duration for task in self.tasks])
        kept = np.flatnonzero(times <= ends[owner])
        kept = kept[np.lexsort((times[kept], rows["contact"][kept]))]
        return times[kept], owner[kept], kept


def _one_by_one(tasks: Sequence[Task], shared: Shared, stopped: Callable[[], bool]) -> MarchedCells:
    """March cells that do not go in step, to their ends; tell of the wheels alone."""
    status, parts = np.full(len(tasks), contract.FULL), [(np.empty((0, 4)), np.empty((0, 3)))]
    for number, task in enumerate(tasks):
        if stopped():
            break
        found = general.run(general.prepared_task(task, shared.track), task.duration, memory=task.memory, lay=lay)
        wheels = len(task.system.wheels)
        events, peaks = (
            table[table[:, column] < wheels] for table, column in ((found.events, 3), (found.peaks[:, :3], 2))
        )
        events[:, contract.EVENT_CONTACT] += wheels * number
        peaks[:, 2] += wheels * number
        orders = np.argsort(events[:, contract.EVENT_CONTACT], kind="stable"), np.argsort(peaks[:, 2], kind="stable")
        parts.append((events[orders[0]], peaks[orders[1]]))
        status[number] = found.status
    all_events, all_peaks = (np.vstack(tables) for tables in zip(*parts, strict=True))
    return MarchedCells(status, np.array([task.duration for task in tasks]), all_events, all_peaks)


# -- marching ---------------------------------------------------------------------------------------------------------


def march_all(
    tasks: Sequence[Task], threads: int, read: Callable[[IntArray, MarchedCells], None], until: Until = TO_THE_END
) -> None:
    """March all cells, and hand each block, with the cells' numbers, to `read`; the threads do both."""

    def march_work(work: Work, stopped: Callable[[], bool]) -> None:
        with work.track as shared:
            mine = [tasks[number] for number in work.numbers]
            if mine[0].system.ports or any(task.system.changes for task in mine):
                found = _one_by_one(mine, shared, stopped)
            else:
                found = _Block(mine, shared).march(until, stopped)
        if not stopped():
            read(work.numbers, found)

    on_threads(works_of(tasks, threads), threads, march_work)


def march_alone(tasks: Sequence[Task], threads: int, read: Callable[[int, Found], None]) -> None:
    """March all cells one by one with all their logs, and hand each to `read`; the threads do both."""

    def march_work(work: Work, stopped: Callable[[], bool]) -> None:
        with work.track as shared:
            for number in work.numbers.tolist():
                if stopped():
                    return
                task = tasks[number]
                read(
                    number,
                    general.run(general.prepared_task(task, shared.track), task.duration, memory=task.memory, lay=lay),
                )

    on_threads(works_of(tasks, threads), threads, march_work)
