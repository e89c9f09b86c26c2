"""A peer: heyoka, Taylor integrators compiled for the regularised system, with heyoka's own events.

In contact the unknowns are t, u and w in the variable s (indentation u², dt = u ds), in flight the indentation and its
rate in time; on a deck those of its motion, too. A loss, an impact and the end of a piece are terminal events (in
flight the end is a plain final time); force maxima are a non-terminal event. Level rail has integrators of its own,
without sine and cosine. All integrators are compiled before the clock starts and used again for every run; the numbers
of the case are runtime parameters. heyoka's option fast_math is on: it saves some 8 % and costs no accuracy here.
"""

from __future__ import annotations

from typing import Any

import heyoka as hy  # type: ignore[import-untyped]
import numpy as np
from problems import Outcome, Piece, Scaled

FAR = 1e9
"""A final value of s that is never reached: terminal events end the steps in contact."""
NUDGE = 1e-200
"""A start at exactly zero hides heyoka's next root of the same event, so a phase starts this far from zero."""
LOSS, LANDED = -1, -1
"""heyoka's outcome where the first terminal event stopped the integration."""

Raw = tuple[list[float], list[float], list[tuple[float, ...]], tuple[float, float]]
"""Times of losses and impacts, time, u and w of the force maxima, and the last indentation and rate."""


def load_function(time: Any, flat: bool) -> Any:
    """Return F(t) with its numbers as parameters."""
    if flat:
        return hy.par[2]
    return hy.par[2] + hy.par[3] * hy.sin(hy.par[5] * time) + hy.par[4] * hy.cos(hy.par[5] * time)


def falling(expression: Any, **options: Any) -> Any:
    """Return the terminal event of an expression that falls through zero."""
    return hy.t_event(expression, direction=hy.event_direction.negative, **options)


def deck_motion(on_deck: bool, force: Any) -> tuple[list[tuple[Any, Any]], Any]:
    """Return the equations of a deck under a force in time, and what its motion adds to F."""
    if not on_deck:
        return [], 0.0
    place, speed = hy.make_vars("place", "speed")
    rise = hy.par[8] * (hy.par[11] - force) - hy.par[9] * place - hy.par[10] * speed
    return [(place, speed), (speed, rise)], hy.par[0] * place + hy.par[1] * speed + rise


def contact_integrator(
    flat: bool, tolerance: float, peaks: list[tuple[float, ...]], lossy: bool = False, on_deck: bool = False
) -> Any:
    """Return the integrator of (t, u, w) in s, which adds time, u and w of each force maximum to `peaks`."""
    t, u, w = hy.make_vars("t", "u", "w")
    squared = u * u
    grip = 1.0 + hy.par[7] * w if lossy else 1.0
    force = squared * u * grip
    deck, moved = deck_motion(on_deck, force)
    rate = load_function(t, flat) - hy.par[0] * squared - hy.par[1] * w - force + moved
    rises = 1.5 * w * grip + hy.par[7] * squared * rate if lossy else w  # as the force does

    def note(integrator: Any, s: float, sign: int) -> None:
        integrator.update_d_output(s)
        peaks.append(tuple(integrator.d_output[:3]))

    return hy.taylor_adaptive(
        [(t, u), (u, 0.5 * w), (w, u * rate), *((one, u * its) for one, its in deck)],
        [0.0, 1.0, 0.0, *(0.0 for _ in deck)],
        tol=tolerance,
        fast_math=True,
        t_events=[falling(u), hy.t_event(t - hy.par[6])],
        nt_events=[hy.nt_event(rises, callback=note, direction=hy.event_direction.negative)],
    )


def flight_integrator(flat: bool, tolerance: float, on_deck: bool = False) -> Any:
    """Return the integrator of the (negative) indentation and its rate in time."""
    d, w = hy.make_vars("d", "w")
    deck, moved = deck_motion(on_deck, 0.0)
    rate = load_function(hy.time, flat) - hy.par[0] * d - hy.par[1] * w + moved
    return hy.taylor_adaptive(
        [(d, w), (w, rate), *deck],
        [-1.0, 0.0, *(0.0 for _ in deck)],
        tol=tolerance,
        fast_math=True,
        t_events=[hy.t_event(d, direction=hy.event_direction.positive)],
    )


class Heyoka:
    """heyoka at one tolerance (0 for that of round-off), prepared for one case.

    Parameters
    ----------
    problem
        The case in scaled numbers; may be replaced by another one with the same kinds of pieces between two runs.
    tolerance
        heyoka's tolerance.
    landings
        Number of impacts after which the march stops; None: it goes to the end.
    flat_apart
        False to march level rail with the integrators of a wave of height zero.
    """

    def __init__(self, problem: Scaled, tolerance: float, landings: int | None = None, flat_apart: bool = True) -> None:
        self.problem, self.landings = problem, landings
        self._peaks: list[tuple[float, ...]] = []
        lossy, on_deck = problem.hysteresis > 0, bool(problem.deck)
        self._kinds = [flat_apart and piece.is_flat for piece in problem.pieces]
        kinds = set(self._kinds)
        self._contact = {flat: contact_integrator(flat, tolerance, self._peaks, lossy, on_deck) for flat in kinds}
        self._flight = {flat: flight_integrator(flat, tolerance, on_deck) for flat in kinds}

    def __call__(self) -> Raw:
        """March the case once."""
        self._peaks.clear()
        losses: list[float] = []
        impacts: list[float] = []
        time, touching = 0.0, True
        first, rate, *deck = self.problem.root, self.problem.rate, *(0.0 for _ in self.problem.deck[:2])
        for piece, flat in zip(self.problem.pieces, self._kinds, strict=True):
            contact, flight = self._contact[flat], self._flight[flat]
            self._set(contact, piece)
            self._set(flight, piece)
            while True:
                if touching:
                    time, first, rate, *deck, ended = self._touch(contact, time, first, rate, *deck)
                    if ended:
                        break
                    losses.append(time)
                    first, touching = -NUDGE, False
                else:
                    time, first, rate, *deck, ended = self._fly(flight, piece.stop, time, first, rate, *deck)
                    if ended:
                        break
                    impacts.append(time)
                    first, touching = NUDGE, True
                    if len(impacts) == self.landings:
                        return losses, impacts, list(self._peaks), (0.0, rate)
        return losses, impacts, list(self._peaks), (first**2 if touching else first, rate)

    def _set(self, integrator: Any, piece: Piece) -> None:
        problem = self.problem
        wave = (piece.constant, piece.sine, piece.cosine, problem.frequency)
        more = piece.stop, problem.hysteresis, *problem.deck, problem.root**3
        numbers = (problem.stiffness, problem.damping, *wave, *more)
        integrator.pars[:] = numbers[: len(integrator.pars)]  # some use the first ones only

    @staticmethod
    def _touch(integrator: Any, *state: float) -> tuple[Any, ...]:
        """March in contact from time, u, w and the deck's motion; return these and whether the piece ended."""
        integrator.time = 0.0
        integrator.state[:] = state
        integrator.reset_cooldowns()
        outcome = integrator.propagate_until(FAR)[0]
        return *integrator.state.tolist(), int(outcome) != LOSS

    @staticmethod
    def _fly(integrator: Any, stop: float, time: float, *state: float) -> tuple[Any, ...]:
        """March in flight from indentation, rate and the deck's motion; return time, these, and whether it ended."""
        integrator.time = time
        integrator.state[:] = state
        integrator.reset_cooldowns()
        outcome = integrator.propagate_until(stop)[0]
        return integrator.time, *integrator.state.tolist(), int(outcome) != LANDED

    def read(self, raw: Raw) -> Outcome:
        """Put an answer into SI units."""
        losses, impacts, peaks, end = raw
        times, roots, rates = np.array(peaks).T
        seconds, newtons = self.problem.time_unit, self.problem.force_unit
        return Outcome(
            np.array(losses) * seconds,
            np.array(impacts) * seconds,
            times * seconds,
            roots**3 * (1.0 + self.problem.hysteresis * rates) * newtons,
            np.array(end),
        )
