"""A peer: SUNDIALS' CVODE in time by scikit-sundae, with root finding, restarted at every loss, impact and piece.

Adams's method is the better one here: BDF takes about twice as long for the same error. Every leg has a solver of its
own, as one that is used again hands out the events of its earlier runs too; to make one takes some 40 us of a leg's
millisecond. CVODE stops at each root, force maxima included, and goes on from there without a restart; that is a fifth
faster than letting it keep all its steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from in_time import InTime, Leg, State, acceleration
from problems import Piece
from sksundae.cvode import CVODE  # type: ignore[import-untyped]

AT_ROOT = 2
"""CVODE's status where it stopped at a root."""
MOST_STEPS = 1_000_000


def contact_roots(time: float, unknowns: Any, roots: Any) -> None:
    """Loss, and force maximum."""
    roots[:] = unknowns


def flight_roots(time: float, unknowns: Any, roots: Any) -> None:
    """Impact."""
    roots[0] = unknowns[0]


contact_roots.terminal, contact_roots.direction = [True, False], [-1, -1]  # type: ignore[attr-defined]
flight_roots.terminal, flight_roots.direction = [True], [1]  # type: ignore[attr-defined]


class Cvode(InTime):
    """CVODE by Adams's method."""

    def leg(self, piece: Piece, time: float, state: State, touching: bool) -> Leg:
        """March to the next loss or impact, or to the end of the piece."""
        second = acceleration(self.problem, piece, touching)

        def rates(now: float, unknowns: Any, out: Any) -> None:
            delta, rate = unknowns.tolist()
            out[0] = rate
            out[1] = second(now, delta, rate)

        roots, number = (contact_roots, 2) if touching else (flight_roots, 1)
        t = self.tolerance
        solver = CVODE(
            rates, method="Adams", rtol=t, atol=t, eventsfn=roots, num_events=number, max_num_steps=MOST_STEPS
        )
        solver.init_step(time, np.array(state))
        peaks: list[State] = []
        while True:
            run = solver.step(piece.stop, tstop=piece.stop)
            if not run.success:
                raise RuntimeError(run.message)
            if run.status != AT_ROOT:
                return Leg(peaks, piece.stop, tuple(run.y.tolist()), False)
            at, reached = float(run.t_events[-1]), tuple(run.y_events[-1].tolist())
            if run.i_events[-1][0]:
                return Leg(peaks, at, reached, True)
            peaks.append((at, reached[0]))
