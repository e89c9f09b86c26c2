"""A peer: SUNDIALS' CVODE through scikit-sundae, with its root finding, restarted at every loss, impact and piece.

The equations are those of peer_scipy, in time; a loss or an impact is a root that stops the solver, a force maximum one
that is recorded. Adams' method: the contact is not stiff, and BDF takes several times as many steps here.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import sqrt
from typing import Any

import numpy as np
from peer_scipy import load
from problems import FloatArray, Outcome, Piece, Scaled
from sksundae.cvode import CVODE  # type: ignore[import-untyped]


def flight(problem: Scaled, piece: Piece, time: float, state: Any, rates: Any) -> None:
    """Write the rates without contact force."""
    delta, rate = state.tolist()
    rates[0] = rate
    rates[1] = load(problem, piece, time) - problem.stiffness * delta - problem.damping * rate


def contact(problem: Scaled, piece: Piece, time: float, state: Any, rates: Any) -> None:
    """Write the rates with Hertz's force."""
    flight(problem, piece, time, state, rates)
    delta = float(state[0])
    if delta > 0.0:
        rates[1] -= delta * sqrt(delta)


def roots_of(touching: bool) -> Callable[[float, Any, Any], None]:
    """Return what passes zero at a loss (which stops) and at a force maximum, or at an impact (which stops)."""

    def both(time: float, state: Any, values: Any) -> None:
        values[:] = state

    def first(time: float, state: Any, values: Any) -> None:
        values[0] = state[0]

    both.terminal, both.direction = [True, False], [-1, -1]  # type: ignore[attr-defined]
    first.terminal, first.direction = [True], [1]  # type: ignore[attr-defined]
    return both if touching else first


class Cvode:
    """CVODE at one relative and absolute tolerance (the unknowns are of size one), prepared for one case."""

    def __init__(self, problem: Scaled, tolerance: float, method: str = "Adams") -> None:
        self.problem, self.tolerance, self.method = problem, tolerance, method

    def _run(self, piece: Piece, time: float, state: tuple[float, float], touching: bool) -> Any:
        """March one phase, with a solver of its own: one that is used again keeps the events of its earlier runs."""
        solver = CVODE(
            partial(contact if touching else flight, self.problem, piece), method=self.method, rtol=self.tolerance,
            atol=self.tolerance, eventsfn=roots_of(touching), num_events=2 if touching else 1, max_num_steps=1_000_000,
        )  # fmt: skip
        run = solver.solve(np.array([time, piece.stop]), np.array(state))
        if not run.success:
            raise RuntimeError(run.message)
        return run

    def __call__(self, landings: int | None = None) -> tuple[list[float], list[float], list[FloatArray]]:
        """March the case once, or up to so many landings.

        Return times of losses and impacts, and rows of time and indentation at maxima.
        """
        losses: list[float] = []
        impacts: list[float] = []
        peaks: list[FloatArray] = []
        time, state, touching = 0.0, (self.problem.root**2, self.problem.rate), True
        for piece in self.problem.pieces:
            while True:
                run = self._run(piece, time, state, touching)
                found = np.empty((0, 2)) if run.i_events is None else np.atleast_2d(run.i_events)
                for row, which in enumerate(found):
                    if touching and which[1] != 0:
                        peaks.append(np.array([[run.t_events[row], run.y_events[row, 0]]]))
                if not (len(found) and found[-1][0] != 0):
                    time, state = piece.stop, tuple(run.y[-1])
                    break
                time = float(run.t_events[-1])
                (losses if touching else impacts).append(time)
                state, touching = (0.0, float(run.y_events[-1, 1])), not touching
                if len(impacts) == landings:
                    return losses, impacts, peaks
        return losses, impacts, peaks

    def read(self, raw: tuple[list[float], list[float], list[FloatArray]]) -> Outcome:
        """Put an answer into SI units."""
        losses, impacts, peaks = raw
        times, delta = np.vstack(peaks).T
        seconds, newtons = self.problem.time_unit, self.problem.force_unit
        return Outcome(np.array(losses) * seconds, np.array(impacts) * seconds, times * seconds, delta**1.5 * newtons)
