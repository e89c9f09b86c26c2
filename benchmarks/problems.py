"""The cases that codes solve, in SI units and in the scaled numbers that the peers get.

Both are one wheelset on a stiff rail with a Hertz contact, whose centre follows the irregularity itself, started at
rest in static equilibrium where the irregularity begins. In units of force N0 = P + mg, length d0 = (N0/C)^(2/3) and
time sqrt(m·d0/N0), the indentation δ of the contact obeys

    δ'' = F(t) - K·δ - G·δ' - max(δ, 0)^1.5,      F = 1 + K·yk + G·yk' + yk'',

yk the height of the irregularity under the wheel. On each piece of the rail F is a constant plus one harmonic. With
hysteresis the last term is multiplied by 1 + η·δ'. On a deck, which moves by Y, K·Y + G·Y' + Y'' comes to F, and Y'' is
(N0 - N)/M - stiffness·Y - damping·Y', N the contact's force and N0 that at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Number = Any
"""A float for the peers, a number of many digits for the reference."""


@dataclass(frozen=True)
class Case:
    """A case in SI units, as decimal text, so that the reference reads the same numbers as everybody else.

    Attributes
    ----------
    height
        Height of the bump, or amplitude of the corrugation, m.
    length
        Length of the bump, or wavelength, m.
    impacts, maxima
        How many impacts and force maxima the run has: what all codes with events find, independently of each other.
    """

    name: str
    is_bump: bool
    height: str
    length: str
    speed: str  # m/s
    damping: str  # N s/m
    duration: str  # s
    impacts: int
    maxima: int
    mass: str = "1500"  # kg
    load: str = "95285"  # N, without the wheelset's own weight
    gravity: str = "9.81"  # m/s²
    constant: str = "1.9e11"  # N/m^1.5
    stiffness: str = "2.4e6"  # N/m
    hysteresis: str = ""  # s/m
    deck: tuple[str, ...] = ()  # kg, N/m, N s/m

    @property
    def inputs(self) -> dict[str, str]:
        """The physical inputs that there are, as text."""
        return {name: str(value) for name, value in vars(self).items() if value and name not in ("impacts", "maxima")}


CASES = {
    case.name: case
    for case in (
        Case("bump", True, "0.5e-3", "50e-3", "5", "1e4", "0.5", 67, 67),
        Case("corr", False, "50e-6", "50e-3", "9", "1e5", "1", 180, 180),
    )
}
TERMS = {
    name: replace(CASES["bump"], name=f"bump, {name}", **more)  # type: ignore[arg-type]
    for name, more in (
        ("hysteresis", {"hysteresis": "0.1"}), ("deck", {"deck": ("15e3", "15e6", "5e4")}),
    )
}  # fmt: skip
"""The same bump with another term in the equations."""


@dataclass(frozen=True)
class Piece:
    """F(t) = constant + sine·sin(Ωt) + cosine·cos(Ωt) until the time `stop`."""

    stop: Number
    constant: Number
    sine: Number
    cosine: Number

    @property
    def is_flat(self) -> bool:
        """True on level rail."""
        return bool(self.sine == 0 and self.cosine == 0)


@dataclass(frozen=True)
class Scaled:
    """A case in scaled numbers, and the units that lead back to seconds and newtons.

    At the piece borders of these cases height and slope of the rail are continuous, and so are δ and δ'.
    """

    stiffness: Number  # K
    damping: Number  # G
    frequency: Number  # Ω
    pieces: tuple[Piece, ...]
    root: Number  # square root of the indentation at t = 0
    rate: Number  # indentation rate at t = 0
    time_unit: Number  # s
    force_unit: Number  # N
    hysteresis: Number = 0.0
    deck: tuple[Number, ...] = ()  # 1/mass, stiffness/mass, damping/mass


@dataclass(frozen=True)
class Outcome:
    """What a run found.

    Attributes
    ----------
    losses, impacts
        Times in s.
    peak_times, peak_forces
        Times in s and forces in N of the force maxima.
    end
        Indentation and its rate at the end, in scaled numbers; NaN where a code does not tell.
    """

    losses: FloatArray
    impacts: FloatArray
    peak_times: FloatArray
    peak_forces: FloatArray
    end: FloatArray


class Runner(Protocol):
    """A code, prepared for one case: calling it is what is timed, reading its answer is not."""

    def __call__(self) -> Any:
        """March the case once."""

    def read(self, raw: Any) -> Outcome:
        """Put an answer into SI units."""


def scaled(case: Case, number: Callable[[str], Number] = float, pi: Number = math.pi) -> Scaled:
    """Return the case in scaled numbers of the kind that `number` makes."""
    half, mass, stiffness = number("0.5"), number(case.mass), number(case.stiffness)
    weight = number(case.load) + mass * number(case.gravity)
    length = (weight / number(case.constant)) ** (number("2") / 3)
    time = (mass * length / weight) ** half
    k = stiffness * time**2 / mass
    g = number(case.damping) * time / mass
    omega = 2 * pi * number(case.speed) * time / number(case.length)
    height, end = number(case.height) / length, number(case.duration) / time
    if case.is_bump:  # yk = h/2·(1 - cos Ωt) for one period, then level
        h = height / 2
        bump = Piece(2 * pi / omega, 1 + k * h, g * h * omega, h * (omega**2 - k))
        pieces = [bump, Piece(end, number("1"), number("0"), number("0"))]
        rate = number("0")
    else:  # yk = a·sin Ωt: its corner at t = 0 starts the contact with a rate
        pieces = [Piece(end, number("1"), height * (k - omega**2), g * height * omega)]
        rate = height * omega
    eta, deck = number(case.hysteresis or "0") * length / time, tuple(map(number, case.deck))
    if deck:
        deck = mass / deck[0], deck[1] * time**2 / deck[0], deck[2] * time / deck[0]
    return Scaled(k, g, omega, tuple(pieces), static_root(k), rate, time, weight, eta, deck)


def static_root(stiffness: Number) -> Number:
    """Return u, the square root of the static indentation, which balances u³ + K·u² = 1."""
    u = stiffness * 0 + 1
    for _ in range(60):
        u -= (u**3 + stiffness * u**2 - 1) / (3 * u**2 + 2 * stiffness * u)
    return u


def largest_force_error(found: Outcome, reference: Outcome) -> float:
    """Return eN, the largest relative error of a force maximum over the run."""
    return float(np.max(np.abs(found.peak_forces / reference.peak_forces - 1.0)))


def largest_time_error(found: Outcome, reference: Outcome) -> float:
    """Return the largest error of the time of a loss or an impact, s."""
    pairs = ((found.losses, reference.losses), (found.impacts, reference.impacts))
    return max(float(np.max(np.abs(a - b))) for a, b in pairs)


def largest_end_error(found: Outcome, reference: Outcome) -> float:
    """Return the larger error of indentation and rate at the end, in scaled numbers, where both are of size one."""
    return float(np.max(np.abs(found.end - reference.end)))


def check_counts(label: str, case: Case, found: Outcome) -> None:
    """Refuse an answer that missed or invented an impact or a force maximum."""
    counts = len(found.impacts), len(found.peak_forces)
    if counts != (case.impacts, case.maxima):
        raise SystemExit(
            f"{label} on {case.name}: found {counts[0]} impacts and {counts[1]} force maxima; "
            f"expected {case.impacts} and {case.maxima}"
        )
