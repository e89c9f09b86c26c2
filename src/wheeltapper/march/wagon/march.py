"""The march of a wagon, and what can be asked of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import happened, kept
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.law_columns import PIECE_STRETCH
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.telling import Tell, report_nothing
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import multibody, replay
from wheeltapper.march.wagon.assembly import Assembly
from wheeltapper.march.wagon.remembering import PATH_COLUMNS, OverMarks
from wheeltapper.march.wagon.wheel_rows import DELTA_RATE, ROW_DELTA

if TYPE_CHECKING:
    from wheeltapper.march.wagon.rails.march import OnRails
    from wheeltapper.march.wagon.rails.replay import RailsReplay


BEHIND = np.linspace(0.0, 1.0, 17)
"""Times behind a maximum of a damped force at which its indentation is read, in radians of phase of a wheelset."""


class Marched(multibody.MultibodyMarch):
    """A march of a wagon, in SI units."""

    __slots__ = ()

    @property
    def spans(self) -> FloatArray:
        """Time and length of each step, (steps, 2)."""
        return np.asarray(self.steps[:, [asm.STEP_TIME, asm.STEP_LENGTH]])

    def without_force(self, contacts: IntArray) -> NDArray[np.bool_]:
        """Return where some contacts have no force, (steps, contacts)."""
        return np.asarray(np.floor(self.steps[:, [asm.STEP_CLOSED]] / 2.0**contacts) % 2.0 == 0.0)

    def at(self, times: FloatArray, rows: IntArray) -> tuple[FloatArray, ...]:
        """Return states and rates (times, states) and some rows of contacts (times, rows, lanes) at rising times."""
        return replay.replay(self, times, rows)

    def works(self, damping: FloatArray, places: IntArray) -> tuple[FloatArray, ...]:
        """Return each step's works (steps, POWERS_KEPT), impulses (steps, lanes), and elastic energies at its ends.

        These are those of contacts and of nonlinear elements, (steps, 2) both. `damping` acts on the velocities of the
        displacements at `places`; the last one is a deck's where there is one.
        """
        return replay.works(self, damping, places)

    def rails_below(self, program: OnRails) -> RailsReplay:
        """Return what tells what both rails below do."""
        from wheeltapper.march.wagon.rails.replay import RailsReplay

        return RailsReplay(program, self)

    def extremes(self) -> tuple[float, float]:
        """Return the largest indentation of the treads, m, and its largest rate either way, m/s.

        They are read at events, where it is fastest, and at maxima of forces and what follows: contacts whose force
        knows the rate are deepest a little later.
        """
        A, peaks = self.assembly, self.peaks[:, [contract.PEAK_TIME]]
        rated = A.numbers[asm.CONTACT_LAW] == asm.OWN_RATED
        behind = (peaks + A.numbers[asm.PULSE] * BEHIND[: len(BEHIND) if rated else 1]).ravel()
        times = np.concatenate([[0.0], behind[behind <= self.end], self.events[:, contract.EVENT_TIME]])
        _, _, found = self.at(np.unique(times), np.array([ROW_DELTA, DELTA_RATE]))
        treads = np.flatnonzero(A.lanes[: int(A.numbers[asm.TREADS]), asm.SIDE].ravel())
        delta, rate = np.moveaxis(found[:, :, treads], 1, 0)
        return float(delta.max()), float(np.abs(rate[delta >= 0.0]).max(initial=0.0))

    def happened(self) -> list[FloatArray]:
        """Return what happens to each contact, to each void and to each nonlinear element, in its order."""
        pieces = self.steps[:, asm.STEP_ELEMENTS :].T[:, :, None]
        met = [happened.by_contact(rows, contract.EVENT_KIND) for rows in (self.events, self.seat_events)]
        return [*met, *(happened.without_repeats(one) for one in pieces)]

    def gentlest(self) -> float:
        """Return the smallest rate of indentation at an event, m/s."""
        return happened.slowest(self.events)

    def log(self, program: Assembly | OnRails | OverMarks) -> dict[str, FloatArray]:
        """Return what brings this march back where its program is known."""
        A = self.assembly
        held = {
            "steps": self.steps, "states": self.states, "events": self.events, "peaks": self.peaks,
            "end": np.array([self.end]), "state": self.state, "evaluations": np.array([float(self.evaluations)]),
        }  # fmt: skip
        if A.rails.size:
            held["rails_free"] = self.rails.free
        if len(A.voids):
            held["seat_events"] = self.seat_events
        if A.pieces is not _assembly_of(program).pieces:
            held |= {"lanes": A.lanes, "pieces": A.pieces}
        return held


def march(program: Assembly | OnRails | OverMarks, tell: Tell = report_nothing) -> Marched:
    """March a wagon from its start to its end; one that meets its own marks lays them on the way."""
    memory, plain = program.memory if isinstance(program, OverMarks) else None, _plain(program)
    if isinstance(plain, Assembly):
        return Marched(*multibody.march(plain, tell, memory))
    from wheeltapper.march.wagon.rails.march import march

    return Marched(*march(plain, tell, memory))


def _plain(program: Assembly | OnRails | OverMarks) -> Assembly | OnRails:
    """Return a program as if no wheel met marks of others."""
    plain: Assembly | OnRails = program.program if isinstance(program, OverMarks) else program
    return plain


def _assembly_of(program: Assembly | OnRails | OverMarks) -> Assembly:
    plain = _plain(program)
    return plain if isinstance(plain, Assembly) else plain.assembly


LARGEST = 1e3
"""Largest plausible displacement (m, rad) or velocity (m/s, rad/s) in a file; a larger one is damage."""
ORDERLY = contract.DONE, contract.FULL, contract.TOO_MANY_EVENTS, contract.STALLED, contract.END_OF_PATH, asm.DERAILED
"""Why a march ends whose states are plausible."""


def restored(program: Assembly | OnRails | OverMarks, status: int, held: kept.Held) -> Marched:
    """Return the march of a program whose log a file has kept; refuse what no march can have written."""
    A = _on_paths(_assembly_of(program), held)
    duration = float(A.numbers[asm.RUN_END])
    end = float(kept.table(held, "march_end", 1)[0])
    kept.check("march_end", np.array([end]), 0.0 < end <= duration * (1.0 + 1e-9), "a time within the run")
    steps = _steps_of(held, A, end)
    broken = status not in ORDERLY  # such states are no damage of the file
    moments = np.arange(len(A.start)) >= (A.rails[asm.RAIL_STATES] if A.rails.size else np.inf)
    states = kept.table(held, "march_states", len(steps), len(A.start))
    state = kept.table(held, "march_state", len(A.start), anything=status == contract.NOT_FINITE)
    for name, values in (("march_states", states), ("march_state", state)):
        kept.check(name, values, broken | moments | (np.abs(values) < LARGEST), f"states below {LARGEST:g}")
    lanes = np.flatnonzero(A.lanes[:, asm.SIDE].ravel())
    latest = contract.YIELD if A.stretch_columns else contract.IMPACT
    events = kept.rows_of(held, "march_events", end, contacts=lanes, latest=latest)
    peaks = kept.rows_of(held, "march_peaks", end, contacts=lanes)
    seated = np.zeros((0, contract.EVENT_COLUMNS))
    if len(A.voids):
        below = asm.LANES * A.wheel_octets + np.arange(asm.LANES * len(A.voids))
        seated = kept.rows_of(held, "march_seat_events", end, contacts=below, latest=contract.IMPACT)
    evaluations = int(kept.table(held, "march_evaluations", 1)[0])
    found = Marched(A, status, steps, states, events, peaks, end, state, evaluations, seat_events=seated)
    return found if not A.rails.size else found._replace(rails=_rails_of(program, held, end))


def _on_paths(A: Assembly, held: kept.Held) -> Assembly:
    """Return an assembly on the paths that a march has changed, if it has."""
    if "march_pieces" not in held:
        return A
    pieces = kept.table(held, "march_pieces", None, A.pieces.shape[1], ends=True)
    kept.check_pieces("march_pieces", pieces)
    lanes = kept.table(held, "march_lanes", *A.lanes.shape, ends=True)
    others = np.setdiff1d(np.arange(asm.LANE_COLUMNS), PATH_COLUMNS)
    kept.check("march_lanes", lanes[:, others], lanes[:, others] == A.lanes[:, others], "those of the scenario")
    kept.check_whole("march_lanes", lanes[:, [asm.FIRST_PIECE, asm.LAST_PIECE]], 0, len(pieces) - 1)
    kept.check_whole("march_lanes", lanes[:, asm.PATH_LOOP], 0, len(pieces))
    kept.check_whole("march_lanes", lanes[:, asm.PATH_LOOP_JOIN], contract.SOFT, contract.JUMP)
    return A._replace(lanes=lanes, pieces=pieces)


def _steps_of(held: kept.Held, A: Assembly, end: float) -> FloatArray:
    """Return the steps of a march, which follow each other to its end."""
    elements = len(A.element_inside)
    behind = asm.STEP_ELEMENTS + elements
    steps = kept.steps_of(held, behind + A.stretch_columns, asm.STEP_TIME, end)
    begins, lengths = steps[:, asm.STEP_TIME], steps[:, asm.STEP_LENGTH]
    follows = np.abs(begins + lengths - np.append(begins[1:], end)) <= 1e-9 * end
    kept.check("march_steps", lengths, follows & (lengths > 0.0), "steps that follow each other")
    at_once = bool(A.rails.size and A.rails[asm.RAIL_AT_ONCE])
    kept.check_whole("march_steps", steps[:, asm.STEP_CLOSED], 0, 2.0 ** (len(A.kinds) * asm.LANES + at_once) - 1)
    most = np.concatenate([np.diff(A.element_corners) - 2, np.full(len(A.sliders), asm.FORTH)])
    most[elements - len(A.yields) :] = asm.FULL_FORTH  # of rigid friction
    most[elements - len(A.pressed) :] = asm.PARTED
    for element in range(elements):
        kept.check_whole("march_steps", steps[:, asm.STEP_ELEMENTS + element], 0, most[element])
    if A.stretch_columns:
        kept.check_whole("march_steps", steps[:, behind:], 0, float(A.law[:, PIECE_STRETCH].max()))
    return steps


def _rails_of(program: Any, held: kept.Held, end: float) -> multibody.RailLog:
    """Return what the rails below showed in each macro step."""
    from wheeltapper.march.wagon.rails.modes import tables_of

    below: Any = _plain(program)
    made = tables_of(below.track, float(below.assembly.numbers[asm.RUN_END]))
    free = kept.table(held, "march_rails_free", None, 2 * below.track.fours * asm.HALF * below.track.method.nodes)
    enough = float(made.grid.times(np.array(len(free)))) >= end * (1.0 - 1e-9)
    kept.check("march_rails_free", np.array([float(len(free))]), enough, "a row for each macro step")
    return multibody.RailLog(made.grid.ends, free, made.local, made.answers)
