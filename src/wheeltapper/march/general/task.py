"""The general march of a task, and what can be asked of it, in the columns that all records share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import happened, kept
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Rows, plain, row_of, rows_from, width
from wheeltapper.march.common.telling import Tell, report_nothing
from wheeltapper.march.general import contract as general
from wheeltapper.march.general import ensemble, integrals, layout, replay
from wheeltapper.march.general.contract import Marking, Task
from wheeltapper.march.general.march import Found, march_task, prepare
from wheeltapper.march.general.records import Logs
from wheeltapper.march.general.stepping import MODES_EVERY

if TYPE_CHECKING:
    from wheeltapper.march.general.changes import Change
    from wheeltapper.march.general.gradients import Tangents
    from wheeltapper.march.general.turned import SystemTurn

SPAN_BEGIN, SPAN_LENGTH = range(2)
"""Columns of the rows of `Marched.steps`."""
DECK_END = -1.0
"""What happens to a wheel that comes on to a deck or leaves it, among kinds of events."""


class Marched(NamedTuple):
    """A march of a task.

    Attributes
    ----------
    status
        Why it ended.
    steps
        Spans between two events of any contact: time and length, s, (spans, 2).
    free
        (spans, contacts): where a contact has no force.
    events, peaks
        Of the wheels, as in `wheeltapper.march.common.program`, in SI units.
    end
        Time at the end, s.
    found
        The march itself.
    seat_events
        Of the contacts that stay where they are, as `events`; the last column is the number of the contact among these.
    """

    status: int
    steps: FloatArray
    free: NDArray[np.bool_]
    events: FloatArray
    peaks: FloatArray
    end: float
    found: Found
    seat_events: FloatArray

    @property
    def spans(self) -> FloatArray:
        """Time and length of each span, (spans, 2)."""
        return self.steps

    def without_force(self, contacts: IntArray) -> NDArray[np.bool_]:
        """Return where some contacts have no force, (spans, contacts)."""
        return np.asarray(self.free[:, contacts])

    @property
    def state(self) -> FloatArray:
        """The bodies' state at the start of the last macro step."""
        return self.found.logs.bodies[-1]

    @property
    def system(self) -> general.System:
        """What was marched."""
        return self.found.prepared.system

    @property
    def static_indentation(self) -> float:
        """δ0, the unit of length of the march, m."""
        return self.found.prepared.units.length

    @property
    def start(self) -> FloatArray:
        """The bodies' state at time zero: displacements, then velocities."""
        return self.found.prepared.start.bodies

    @property
    def sinking(self) -> FloatArray:
        """Of the bodies at each contact from first touch to rest, m."""
        return self.found.sinking

    @property
    def changes(self) -> FloatArray:
        """When any contact comes to other bodies, s."""
        return self.found.changes

    def changes_of(self, contact: int) -> FloatArray:
        """Return when a contact comes to other bodies, s."""
        return self.found.changes_of(contact)

    @property
    def is_solved(self) -> bool:
        """Whether no part was left unsolved."""
        return bool(np.isfinite(self.found.logs.moments).all())

    def at(self, times: FloatArray) -> replay.Replayed:
        """Return everything but the track's modes at some times, s."""
        return replay.replay(self.found, times)

    def forces(self, times: FloatArray) -> FloatArray:
        """Return the forces of all contacts at some times, s, and nothing else."""
        return replay.forces(self.found, times)

    def modes(self, times: FloatArray, bends: bool = True, starts: replay.Starts | None = None) -> replay.Modes:
        """Return the track's modes at some times, s; `starts` lets one call go on from where another ended."""
        return replay.modes(self.found, times, bends, starts)

    def starts(self) -> replay.Starts:
        """Return what lets `modes` go on from one call to the next."""
        return replay.Starts(replay.track_run(self.found))

    def pressed(self, contact: int, times: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return how deep a wheel indents the surface as it is at rising times, s, m; negative in no case.

        Then follow what earlier wheels have left there, m, and whether that surface yields.
        """
        wheel = self.system.contacts[contact]
        left, bears = replay.surface_along(wheel, wheel.start + self.system.speed * times)
        indented = np.maximum(replay.pressed(self.found, contact, times)[0], 0.0)
        return indented, left, indented > bears

    def left_before(self, contact: int, times: FloatArray) -> FloatArray:
        """Return what earlier wheels have left below a wheel at some times, s, m."""
        wheel = self.system.contacts[contact]
        return replay.surface_along(wheel, wheel.start + self.system.speed * times)[0]

    def path_slopes(self, contact: int, distances: FloatArray) -> FloatArray:
        """Return the slope of a wheel's path where it has travelled so far, m."""
        wheel = self.system.contacts[contact]
        return replay.path_slopes(wheel, wheel.start + distances)

    def lay(self, marking: Marking) -> None:
        """Let a memory of rails take what the wheels have done."""
        replay.lay(self.found, marking)

    def log(self, task: Task) -> dict[str, FloatArray]:
        """Return what brings this march back where its task is known."""
        logs, wheels = self.found.logs, self.system.wheels
        held = {name: getattr(logs, name) for name in LOGGED} | {"events": self.events, "peaks": self.peaks}
        held["rows"] = plain(logs.rows)
        held["steps_made"] = np.array([float(self.found.steps)])
        if self.system.ports:
            held["seat_events"] = self.seat_events
        if any(one.pieces is not own.pieces for one, own in zip(wheels, task.system.wheels, strict=True)):
            held["pieces"] = np.vstack([one.pieces for one in wheels])
            held["pieces_of"] = np.repeat(np.arange(float(len(wheels))), [len(one.pieces) for one in wheels])
        return held

    def happened(self) -> list[FloatArray]:
        """Return what happens to each wheel, ends of a deck among it, and to each contact that stays, in its order."""
        stays = happened.by_contact(self.seat_events, contract.EVENT_KIND, contract.EVENT_RATE)
        onsets = stays[:, 1] == contract.IMPACT  # else a rate may be zero but for rounding
        stays[:, -1] = np.where(onsets, np.sign(stays[:, -1]), 0.0)  # to which side friction slips, or a stop is met
        rows = [
            (time, DECK_END, 0.0, wheel)
            for wheel in range(self.free.shape[1])
            for time in self.changes_of(wheel)
        ]  # fmt: skip
        both = np.vstack([np.array(rows).reshape(-1, contract.EVENT_COLUMNS), self.events])
        both = both[np.argsort(both[:, contract.EVENT_TIME], kind="stable")]
        return [happened.by_contact(both, contract.EVENT_KIND), stays]

    def gentlest(self, units: FloatArray) -> float:
        """Return the smallest rate of indentation at an event that is no jump of the path, in `units` of the wheels."""
        events = self.events[~np.isin(self.events[:, contract.EVENT_TIME], self.changes)]
        events[:, contract.EVENT_RATE] /= units[events[:, contract.EVENT_CONTACT].astype(np.int64)]
        return happened.slowest(events)

    def impulses(self) -> FloatArray:
        """Return the impulse of each contact in each span, (spans, contacts), N s."""
        begins = self.steps[:, SPAN_BEGIN]
        contacts = range(self.free.shape[1])
        return np.stack([integrals.impulses(self.found, one, begins, self.end) for one in contacts], axis=1)

    def works(self) -> integrals.Works:
        """Return works and energies, J."""
        return integrals.works(self.found, self.end)

    def contact_energies(self) -> tuple[FloatArray, float]:
        """Return the elastic energy of all contacts at both ends, and what their material took, J."""
        from wheeltapper.march.general.contact_energy import contact_energies

        return contact_energies(self.found, self.end)

    def rules(self, steps: int) -> Iterator[integrals.Rule]:
        """Return rules for integrals over the march, one after the other in time, for some macro steps each."""
        return integrals.rules(self.found, self.end, steps)

    def jumps(self) -> FloatArray:
        """Return two times, s, one on either side of each jump of a contact's force, (jumps, 2)."""
        return integrals.jumps(self.found, self.end)

    def extremes(self) -> tuple[float, float]:
        """Return the largest indentation, m, and its largest rate either way, m/s."""
        return integrals.extremes(self.found, self.end)

    def tangents(self, turns: list[SystemTurn]) -> Tangents:
        """Return the derivatives along some directions."""
        from wheeltapper.march.general.gradients import tangents

        return tangents(self.found, turns)

    def changed(self, turns: list[SystemTurn]) -> list[Change]:
        """Return how the march changes along some directions, at any fixed time."""
        from wheeltapper.march.general.changes import changes

        return changes(self.found, self.status, self.end, turns)

    def moved(self, times: FloatArray) -> replay.Replayed | None:
        """Return what acts where wheels are elsewhere: nothing of a march, whose wheels are where they are."""
        return None

    def impulse_rates(self, rates: Tangents, contact: int) -> FloatArray:
        """Return the derivatives of a contact's impulses from each impact to the next loss, (impacts, directions)."""
        from wheeltapper.march.general.gradients import impulse_rates

        return impulse_rates(self.found, rates, contact)


def march(task: Task, tell: Tell = report_nothing) -> Marched:
    """March a task."""
    return marched_of(task, march_task(task, tell, replay.lay))


def march_alone(tasks: Sequence[Task], threads: int, read: Callable[[int, Marched], None]) -> None:
    """March many tasks one by one, with all that is logged, and hand each to `read`."""
    ensemble.march_alone(tasks, threads, lambda number, found: read(number, marched_of(tasks[number], found)))


def marched_of(task: Task, found: Found) -> Marched:
    """Return a march in the columns of records."""
    end, wheels = min(found.time, task.duration), len(task.system.wheels)
    moves = found.events[:, contract.EVENT_CONTACT] < wheels
    events, seated = found.events[moves], found.events[~moves]
    seated[:, contract.EVENT_CONTACT] -= wheels
    begins = np.concatenate([[0.0], events[:, contract.EVENT_TIME]])
    free = np.stack([_free(events, contact) for contact in range(wheels)], axis=1)
    tops = found.peaks[found.peaks[:, 2] < wheels]
    peaks = np.zeros((len(tops), contract.PEAK_COLUMNS))
    peaks[:, [contract.PEAK_TIME, contract.PEAK_FORCE, contract.PEAK_CONTACT, contract.PEAK_CORNER]] = tops
    steps = np.column_stack([begins, np.diff(begins, append=end)])
    return Marched(found.status, steps, free, events, peaks, end, found, seated)


def _free(events: FloatArray, contact: int) -> NDArray[np.bool_]:
    """Return for the spans between all events where a contact has no force."""
    changing = events[:, contract.EVENT_KIND] != contract.YIELD
    own = np.flatnonzero((events[:, contract.EVENT_CONTACT] == contact) & changing)
    losses = events[own, contract.EVENT_KIND] == contract.LOSS
    changes = np.zeros(len(events) + 1, dtype=np.int64)
    changes[own + 1] = np.where(losses, 1, -1)
    changes[0] = len(own) > 0 and not losses[0]
    return np.cumsum(changes) > 0


LOGGED = ("rows", "gaps", "moments", "bodies", "modes")
"""Logs that bring a march back."""


def restored(task: Task, status: int, held: kept.Held) -> Marched:
    """Return the march of a task whose log a file has kept; refuse what no march can have written."""
    prepared = prepare(task.system, task.method, None, task.duration, even=EVEN in held)
    if "march_pieces" in held:
        prepared = prepared.on_paths(_paths_of(held, task.system))
    steps = int(kept.table(held, "march_steps_made", 1)[0])
    contacts, q, states = len(task.system.contacts), task.method.nodes, prepared.tables.bodies_step.shape[1]
    known = len(range(0, steps, MODES_EVERY))
    shapes = {
        "rows": (None, width(layout.ROW)), "gaps": (steps, contacts, q), "moments": (steps, contacts, q),
        "bodies": (steps, states), "modes": (known, 2, prepared.tables.decay.shape[2]),
    }  # fmt: skip
    table, gaps, moments, bodies, modes = (kept.table(held, f"march_{name}", *shapes[name]) for name in LOGGED)
    rows = rows_from(table, layout.ROW)
    _check_rows(rows, steps, contacts, {1, q, task.method.careful_nodes})
    logs = Logs(
        rows, np.empty(0, layout.EVENT), np.empty(0, layout.MAXIMUM), gaps, moments, bodies, modes, row_of(layout.USED)
    )  # fmt: skip
    wheels, ports = np.arange(len(task.system.wheels)), np.arange(len(task.system.ports))
    events = kept.rows_of(held, "march_events", task.duration, contacts=wheels, latest=contract.YIELD)
    peaks = kept.rows_of(held, "march_peaks", task.duration, contacts=wheels)
    seated = np.empty((0, contract.EVENT_COLUMNS))
    if len(ports):
        seated = kept.rows_of(held, "march_seat_events", task.duration, contacts=ports, latest=contract.IMPACT)
    found = Found(prepared, status, steps, events, np.empty((0, 4)), logs)
    return marched_of(task, found)._replace(peaks=peaks, seat_events=seated)


EVEN = "march_even"
"""In the log of a version whose macro steps were all equal, wherever wheels pass seats."""


def _paths_of(held: kept.Held, system: general.System) -> list[FloatArray]:
    """Return the paths of the wheels as a march has left them."""
    pieces = kept.table(held, "march_pieces", None, system.wheels[0].pieces.shape[1], ends=True)
    kept.check_pieces("march_pieces", pieces)
    own = kept.table(held, "march_pieces_of", len(pieces))
    paths = [pieces[own == wheel] for wheel in range(len(system.wheels))]
    whole = np.isin(own, np.arange(len(paths))) & (np.diff(own, prepend=0.0) >= 0.0) & all(map(len, paths))
    kept.check("march_pieces_of", own, whole, "rising numbers of all wheels")
    return paths


def _check_rows(rows: Rows, steps: int, contacts: int, counts: set[int]) -> None:
    """Refuse logged parts that do not follow each other, or whose nodes do not exist."""
    kept.check_whole("march_rows", rows["step"], 0, steps - 1)
    kept.check_whole("march_rows", rows["contact"], 0, contacts - 1)
    kept.check_whole("march_rows", rows["map"], layout.EVENLY, layout.IMPACT_TO_LOSS)
    nodes = rows["nodes"]
    kept.check("march_rows", nodes, np.isin(nodes, list(counts)), f"nodes among {sorted(counts)}")
    for contact in range(contacts):
        own = rows[rows["contact"] == contact]
        begins = own["step"] + own["from"]
        ends = own["step"] + own["to"]
        follows = np.abs(np.append(begins[1:], float(steps)) - ends) <= 1e-9 * steps + 1e-9
        kept.check("march_rows", ends, follows & (ends > begins), "parts that follow each other")
        kept.check("march_rows", begins[:1], begins[:1] == 0.0, "a first part at zero")
        if not len(own):
            kept.refuse("march_rows", f"nothing of contact {contact}")
