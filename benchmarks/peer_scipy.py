"""A peer: scipy's DOP853 in time, with events, restarted at every loss, impact and piece of the rail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from in_time import InTime, Leg, State, acceleration
from problems import Piece
from scipy.integrate import solve_ivp


def event(index: int, direction: float, terminal: bool) -> Callable[[float, Any], float]:
    """Return the event in which one of the unknowns passes zero."""

    def function(time: float, state: Any) -> float:
        return float(state[index])

    function.direction = direction  # type: ignore[attr-defined]
    function.terminal = terminal  # type: ignore[attr-defined]
    return function


LOSS, IMPACT, MAXIMUM = event(0, -1.0, True), event(0, 1.0, True), event(1, -1.0, False)


class Scipy(InTime):
    """DOP853."""

    def leg(self, piece: Piece, time: float, state: State, touching: bool) -> Leg:
        """March to the next loss or impact, or to the end of the piece."""
        second = acceleration(self.problem, piece, touching)

        def rates(now: float, unknowns: Any) -> State:
            delta, rate = unknowns.tolist()
            return rate, second(now, delta, rate)

        events = [LOSS, MAXIMUM] if touching else [IMPACT]
        t = self.tolerance
        run: Any = solve_ivp(rates, (time, piece.stop), state, method="DOP853", rtol=t, atol=t, events=events)
        if run.status < 0:
            raise RuntimeError(run.message)
        maxima = zip(run.t_events[1], run.y_events[1], strict=True) if touching else ()
        peaks = [(float(now), float(unknowns[0])) for now, unknowns in maxima]
        if run.status == 0:
            return Leg(peaks, piece.stop, tuple(run.y[:, -1].tolist()), False)
        return Leg(peaks, float(run.t_events[0][0]), tuple(run.y_events[0][0].tolist()), True)
