"""What the peers that march in time share: the accelerations, and the restart at every loss, impact and piece.

This is what a careful user of a general solver writes: contact and flight have right-hand sides of their own (plain
floats, which here are faster than small arrays), the contact ends at its terminal event, and force maxima are an event
too. How one leg, a stretch of contact or of flight, is marched is up to each peer.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from problems import Outcome, Piece, Scaled

State = tuple[float, float]
"""Indentation and its rate."""
Raw = tuple[list[float], list[float], list[State], State]
"""Times of losses and impacts, time and indentation of the force maxima, and the last state."""
Acceleration = Callable[[float, float, float], float]
"""The second derivative of the indentation at a time, an indentation and its rate."""


class Leg(NamedTuple):
    """A stretch of contact or of flight: its force maxima, where it ended, and whether a loss or an impact ended it."""

    peaks: list[State]
    time: float
    state: State
    at_event: bool


def acceleration(problem: Scaled, piece: Piece, touching: bool) -> Acceleration:
    """Return δ'' on a piece of the rail, in contact or in flight, as a function without anything superfluous."""
    K, G, omega = float(problem.stiffness), float(problem.damping), float(problem.frequency)
    constant, sine, cosine = float(piece.constant), float(piece.sine), float(piece.cosine)

    def level_contact(time: float, delta: float, rate: float) -> float:
        return constant - K * delta - G * rate - (delta * sqrt(delta) if delta > 0.0 else 0.0)

    def level_flight(time: float, delta: float, rate: float) -> float:
        return constant - K * delta - G * rate

    def wavy_contact(time: float, delta: float, rate: float) -> float:
        load = constant + sine * sin(omega * time) + cosine * cos(omega * time)
        return load - K * delta - G * rate - (delta * sqrt(delta) if delta > 0.0 else 0.0)

    def wavy_flight(time: float, delta: float, rate: float) -> float:
        return constant + sine * sin(omega * time) + cosine * cos(omega * time) - K * delta - G * rate

    if piece.is_flat:
        return level_contact if touching else level_flight
    return wavy_contact if touching else wavy_flight


class InTime(ABC):
    """A solver in time at one relative and absolute tolerance (the unknowns are of size one), prepared for one case.

    Parameters
    ----------
    problem
        The case in scaled numbers; may be replaced by another one between two runs.
    tolerance
        Relative and absolute.
    landings
        Number of impacts after which the march stops; None: it goes to the end.
    """

    def __init__(self, problem: Scaled, tolerance: float, landings: int | None = None) -> None:
        self.problem, self.tolerance, self.landings = problem, tolerance, landings

    @abstractmethod
    def leg(self, piece: Piece, time: float, state: State, touching: bool) -> Leg:
        """March to the next loss or impact, or to the end of the piece."""

    def __call__(self) -> Raw:
        """March the case once."""
        losses: list[float] = []
        impacts: list[float] = []
        peaks: list[State] = []
        time, state, touching = 0.0, (self.problem.root**2, self.problem.rate), True
        for piece in self.problem.pieces:
            while True:
                found, time, state, at_event = self.leg(piece, time, state, touching)
                peaks += found
                if not at_event:
                    break
                (losses if touching else impacts).append(time)
                state, touching = (0.0, state[1]), not touching
                if len(impacts) == self.landings:
                    return losses, impacts, peaks, state
        return losses, impacts, peaks, state

    def read(self, raw: Raw) -> Outcome:
        """Put an answer into SI units."""
        losses, impacts, peaks, end = raw
        times, delta = np.array(peaks).T
        seconds, newtons = self.problem.time_unit, self.problem.force_unit
        ends = np.array(losses) * seconds, np.array(impacts) * seconds
        return Outcome(*ends, times * seconds, delta**1.5 * newtons, np.array(end))
