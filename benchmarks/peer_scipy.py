"""A peer: scipy's DOP853 in time, with events, restarted at every loss, impact and piece of the rail.

This is what a careful user of `solve_ivp` writes: contact and flight have right-hand sides of their own (plain floats,
which here are faster than small arrays), the contact ends at its terminal event, and force maxima are an event too.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import cos, sin, sqrt
from typing import Any

import numpy as np
from problems import FloatArray, Outcome, Piece, Scaled
from scipy.integrate import solve_ivp

State = Any
"""Indentation and its rate, as solve_ivp hands them over."""


def load(problem: Scaled, piece: Piece, time: float) -> float:
    """Return F(t)."""
    if piece.is_flat:
        return float(piece.constant)
    phase = problem.frequency * time
    return float(piece.constant + piece.sine * sin(phase) + piece.cosine * cos(phase))


def flight(problem: Scaled, piece: Piece, time: float, state: State) -> tuple[float, float]:
    """Return the rates without contact force."""
    delta, rate = state.tolist()
    return rate, load(problem, piece, time) - problem.stiffness * delta - problem.damping * rate


def contact(problem: Scaled, piece: Piece, time: float, state: State) -> tuple[float, float]:
    """Return the rates with Hertz's force."""
    delta, rate = state.tolist()
    force = delta * sqrt(delta) if delta > 0.0 else 0.0
    return rate, load(problem, piece, time) - problem.stiffness * delta - problem.damping * rate - force


def event(index: int, direction: float, terminal: bool) -> Callable[[float, State], float]:
    """Return the event in which one of the unknowns passes zero."""

    def function(time: float, state: State) -> float:
        return float(state[index])

    function.direction = direction  # type: ignore[attr-defined]
    function.terminal = terminal  # type: ignore[attr-defined]
    return function


LOSS, IMPACT, MAXIMUM = event(0, -1.0, True), event(0, 1.0, True), event(1, -1.0, False)


class Scipy:
    """DOP853 at one relative and absolute tolerance (the unknowns are of size one), prepared for one case."""

    def __init__(self, problem: Scaled, tolerance: float) -> None:
        self.problem, self.tolerance = problem, tolerance

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
                if touching and len(run.t_events[1]):
                    peaks.append(np.column_stack([run.t_events[1], run.y_events[1][:, 0]]))
                if run.status == 0:
                    time, state = piece.stop, tuple(run.y[:, -1])
                    break
                time = float(run.t_events[0][0])
                (losses if touching else impacts).append(time)
                state, touching = (0.0, float(run.y_events[0][0, 1])), not touching
                if len(impacts) == landings:
                    return losses, impacts, peaks
        return losses, impacts, peaks

    def _run(self, piece: Piece, time: float, state: tuple[float, float], touching: bool) -> Any:
        rates = partial(contact if touching else flight, self.problem, piece)
        events = [LOSS, MAXIMUM] if touching else [IMPACT]
        t = self.tolerance
        run = solve_ivp(rates, (time, piece.stop), state, method="DOP853", rtol=t, atol=t, events=events)
        if run.status < 0:
            raise RuntimeError(run.message)
        return run

    def read(self, raw: tuple[list[float], list[float], list[FloatArray]]) -> Outcome:
        """Put an answer into SI units."""
        losses, impacts, peaks = raw
        times, delta = np.vstack(peaks).T
        seconds, newtons = self.problem.time_unit, self.problem.force_unit
        return Outcome(np.array(losses) * seconds, np.array(impacts) * seconds, times * seconds, delta**1.5 * newtons)
