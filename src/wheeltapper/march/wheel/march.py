"""The march of one wheel, and what can be asked of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import happened, kept
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.telling import Tell, report_nothing
from wheeltapper.march.steps.written import functions_of_energy, scratch_for
from wheeltapper.march.wheel import balance, dense, single


class Marched(single.March):
    """A march of one wheel, in scaled units."""

    __slots__ = ()

    @property
    def _columns(self) -> int:
        return dense.ENDED_OUT_COLUMNS if self.program.damper_ends else dense.OUT_COLUMNS

    @property
    def end(self) -> float:
        """Time at the end."""
        return float(self.state[contract.TIME])

    @property
    def spans(self) -> FloatArray:
        """Time and length of each step, (steps, 2); the length in a row of steps is one in s where there is contact."""
        begins = self.steps[:, contract.TIME]
        return np.column_stack([begins, np.diff(begins, append=self.end)])

    def without_force(self, contacts: IntArray) -> NDArray[np.bool_]:
        """Return where some contacts have no force, (steps, contacts); there is one, 0."""
        free = np.isin(self.steps[:, [contract.PHASE]], (contract.FLIGHT, contract.RELEASED))
        return np.asarray(free[:, contacts])

    def at(self, times: FloatArray) -> FloatArray:
        """Return the motion at rising times (dense.py); columns for a damper's own end follow where there is one."""
        out = np.empty((len(times), self._columns))
        law, S = self.program.law_or_none, scratch_for(self.program)
        dense.dense(self.pieces, self.program.numbers, law, self.steps, times, out, S)
        return out

    def indentations(self, times: FloatArray) -> FloatArray:
        """Return the indentation of the surface as it is, and what earlier contacts have left, (2, times)."""
        return np.asarray(self.at(times).T[[dense.OUT_DELTA, dense.OUT_RESIDUAL]])

    def integrals(self, nodes: int) -> tuple[FloatArray, FloatArray]:
        """Return the energy's integrals of each step, (steps, INTEGRALS), and the motion at its ends, (steps, 2, …).

        `nodes` are those of the Gauss rule in each step.
        """
        places, weights = np.polynomial.legendre.leggauss(nodes)
        out, ends = np.zeros((len(self.steps), dense.INTEGRALS)), np.zeros((len(self.steps), 2, self._columns))
        law, S = self.program.law_or_none, scratch_for(self.program, pushes=True)
        rule = 0.5 * (places + 1.0), 0.5 * weights
        dense.integrals(self.pieces, self.program.numbers, law, self.steps, *rule, out, ends, S)
        return out, ends

    def add_balance(self, first: int, after: int, sums: FloatArray) -> None:
        """Add what some steps leave missing of the energy, and exchange, to `sums` (balance.SUMS,)."""
        last = self.steps[after] if after < len(self.steps) else self.state
        law, made = self.program.law, functions_of_energy(len(self.program.law) > 0)
        balance.balance_kernel(self.pieces, self.program.numbers, law, self.steps[first:after], last, sums, made)

    def happened(self) -> list[FloatArray]:
        """Return what happens to the contact, to the wheel on a deck and to the damper's end, each in its order."""
        held = [contract.PHASE, contract.ON_DECK, *range(contract.END_MODE, self.steps.shape[1])[:1]]
        return [
            self.events[:, [contract.EVENT_KIND, contract.EVENT_CAUSE]], happened.without_repeats(self.steps[:, held]),
            self.stops[:, [contract.STOP_KIND, contract.STOP_SIDE]],
        ]  # fmt: skip

    def gentlest(self) -> float:
        """Return the smallest rate of indentation at an event that is no jump of the path."""
        return happened.slowest(self.events[self.events[:, contract.EVENT_CAUSE] == 0.0])

    def on_its_own_path(self) -> Marched:
        """Return the same, if its path is not that which its scenario alone leads to: a file keeps it."""
        return self._replace(pieces=self.pieces.copy())

    def log(self, program: contract.Program) -> dict[str, FloatArray]:
        """Return what brings this march back where its program is known."""
        held = {"steps": self.steps, "events": self.events, "peaks": self.peaks, "state": self.state}
        if self.program.damper_ends:
            held["stops"] = self.stops
        if self.pieces is not program.pieces:
            held["pieces"] = self.pieces
        return held

    def last_motion(self) -> FloatArray:
        """Return displacement and velocity of the wheel, and of the deck, at the end."""
        row = self.at(self.state[[contract.TIME]])[0]
        return np.asarray(row[[dense.OUT_WHEEL_Y, dense.OUT_WHEEL_V, dense.OUT_DECK_Y, dense.OUT_DECK_V]])


def march(program: contract.Program, tell: Tell = report_nothing, motion: FloatArray | None = None) -> Marched:
    """March a program to its end from its start, or from displacement and velocity of the wheel and of the deck."""
    return Marched(*single.march(program, tell, motion))


def restored(program: contract.Program, status: int, held: kept.Held) -> Marched:
    """Return the march of a program whose log a file has kept; refuse what no march can have written."""
    pieces = program.pieces
    if "march_pieces" in held:
        pieces = kept.table(held, "march_pieces", None, pieces.shape[1], ends=True)
        kept.check_pieces("march_pieces", pieces)
    ended = program.damper_ends
    width = contract.ENDED_COLUMNS if ended else contract.STEP_COLUMNS
    state = kept.table(held, "march_state", range(contract.LENGTH, width + 1), anything=status == contract.NOT_FINITE)
    end = float(state[contract.TIME])
    kept.check("march_state", state[[contract.TIME]], 0.0 < end < np.inf, "a positive time")
    steps = kept.steps_of(held, width, contract.TIME, end)
    kept.check("march_steps", steps[:, contract.LENGTH], steps[:, contract.LENGTH] >= 0.0, "lengths of 0 or more")
    for rows in (steps, state[None]):
        kept.check_whole("march_steps", rows[:, contract.PHASE], 0, contract.YIELDING + len(program.law) - 1)
        kept.check_whole("march_steps", rows[:, contract.PIECE], 0, len(pieces) - 1)
        kept.check_whole("march_steps", rows[:, contract.ON_DECK], 0, 1)
    stops = contract.NO_STOPS
    if ended:
        kept.check_whole("march_steps", steps[:, contract.END_MODE], contract.LOWER, contract.LINKED)
        stops = kept.table(held, "march_stops", None, contract.STOP_COLUMNS)
        kept.rising("march_stops", stops[:, contract.STOP_TIME], end)
        kept.check_whole("march_stops", stops[:, contract.STOP_KIND], contract.REACHED, contract.LEFT)
    events = kept.rows_of(held, "march_events", end, latest=contract.YIELD)
    peaks = kept.rows_of(held, "march_peaks", end)
    return Marched(status, steps, events, peaks, state, stops, pieces, program)
