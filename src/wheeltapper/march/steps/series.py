"""The present piece of the path, of what earlier contacts left of it and of the plastic law, as functions of time.

`localise` and its like write them about the start of a step; what is asked at times after that start follows. The
equations of the steps themselves stand in steps/equations.py.
"""

from __future__ import annotations

from math import cos, sin

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import DECK_V, DECK_Y, ON_DECK, PHASE, PIECE, SHIFT, TIME, FloatArray
from wheeltapper.march.steps import layout

NO_PIECE = -1
"""Stands for a piece of the plastic law where the contact is elastic."""


@uncounted_kernel
def taylor_shift(
    pieces: FloatArray, piece: int, source: int, degree: int, at: float, rate: float, gain: float, first: int,
    out: FloatArray,
) -> None:  # fmt: skip
    """Write gain·Σ pieces[piece, source + k]·ξ^k, ξ = at + rate·τ, as a polynomial in τ from out[first] on."""
    for k in range(degree + 1):
        out[first + k] = pieces[piece, source + k]
    for i in range(degree):
        for k in range(degree - 1, i - 1, -1):
            out[first + k] += at * out[first + k + 1]
    for k in range(degree + 1):
        out[first + k] *= gain
        gain *= rate


@uncounted_kernel
def localise(pieces: FloatArray, numbers: FloatArray, piece: int, shift: float, time: float, S: FloatArray) -> None:
    """Write the path and the factor of one piece as functions of the time after `time` (scaled units)."""
    away = numbers[contract.PACE] * time - shift - pieces[piece, contract.CENTRE]
    lift = numbers[contract.LIFT]
    degree = int(pieces[piece, contract.DEGREE])
    factor_degree = int(pieces[piece, contract.FACTOR_DEGREE])
    S[layout.HERE_DEGREE] = degree
    S[layout.HERE_FACTOR_DEGREE] = factor_degree
    wavenumber = pieces[piece, contract.WAVENUMBER]
    S[layout.HERE_AMP_SIN] = pieces[piece, contract.SINE] * lift
    S[layout.HERE_AMP_COS] = pieces[piece, contract.COSINE] * lift
    S[layout.HERE_OMEGA] = wavenumber * numbers[contract.PACE]
    S[layout.HERE_PHASE0] = wavenumber * away
    if degree == 0 and factor_degree < 0:
        S[layout.HERE_POLY] = pieces[piece, contract.COEFFICIENT] * lift
        return
    scale = pieces[piece, contract.SCALE]
    at = away / scale
    rate = numbers[contract.PACE] / scale
    taylor_shift(pieces, piece, contract.COEFFICIENT, degree, at, rate, lift, layout.HERE_POLY, S)
    if factor_degree >= 0:
        taylor_shift(pieces, piece, contract.FACTOR, factor_degree, at, rate, 1.0, layout.HERE_FACTOR, S)


@uncounted_kernel
def localise_marks(
    pieces: FloatArray, numbers: FloatArray, piece: int, shift: float, time: float, S: FloatArray
) -> None:
    """Write what earlier contacts have left of one piece as functions of the time after `time` (scaled units)."""
    scale = pieces[piece, contract.SCALE]
    at = (numbers[contract.PACE] * time - shift - pieces[piece, contract.CENTRE]) / scale
    rate = numbers[contract.PACE] / scale
    lift = numbers[contract.LIFT]
    degree, bears = int(pieces[piece, contract.RESIDUAL_DEGREE]), int(pieces[piece, contract.BEARS_DEGREE])
    S[layout.HERE_RESIDUAL_DEGREE], S[layout.HERE_BEARS_DEGREE] = degree, bears
    taylor_shift(pieces, piece, contract.RESIDUAL, degree, at, rate, lift, layout.HERE_RESIDUAL, S)
    taylor_shift(pieces, piece, contract.BEARS, bears, at, rate, lift, layout.HERE_BEARS, S)


@uncounted_kernel
def mark_at(after: float, degree: int, first: int, S: FloatArray) -> float:
    """Return one of those functions (RESIDUAL_DEGREE, RESIDUAL or BEARS_DEGREE, BEARS) after the step's start."""
    value = 0.0
    for k in range(int(S[degree]), -1, -1):
        value = value * after + S[first + k]
    return value


@uncounted_kernel
def residual_at(after: float, S: FloatArray) -> float:
    """Return the residual indentation of the surface as it is at a time after the step's start."""
    return mark_at(after, layout.HERE_RESIDUAL_DEGREE, layout.HERE_RESIDUAL, S)


@uncounted_kernel
def borne_at(after: float, S: FloatArray) -> float:
    """Return the indentation at which the surface as it is yields at a time after the step's start."""
    return mark_at(after, layout.HERE_BEARS_DEGREE, layout.HERE_BEARS, S)


@uncounted_kernel
def enter_law(piece: int, law: FloatArray, S: FloatArray) -> None:
    """Let a piece of the plastic law hold; NO_PIECE: the elastic law."""
    if piece == NO_PIECE:
        S[layout.HERE_LAW_TERMS] = 0.0
        return
    S[layout.HERE_LAW_CENTRE] = law[piece, contract.LAW_CENTRE]
    S[layout.HERE_LAW_SCALE] = law[piece, contract.LAW_SCALE]
    terms = 1
    for k in range(contract.TERMS):
        S[layout.HERE_LAW + k] = law[piece, contract.LAW_FORCE + k]
        if S[layout.HERE_LAW + k] != 0.0:
            terms = k + 1
    S[layout.HERE_LAW_TERMS] = terms


@uncounted_kernel
def enter_piece(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, state: FloatArray, S: FloatArray
) -> None:
    """Put the piece and the law of a state (or of a row of steps) in S, as functions of the time from there on."""
    localise(pieces, numbers, int(state[PIECE]), state[SHIFT], state[TIME], S)
    if law is not None:
        localise_marks(pieces, numbers, int(state[PIECE]), state[SHIFT], state[TIME], S)
        phase = state[PHASE]
        enter_law(int(phase) - contract.YIELDING if phase >= contract.YIELDING else NO_PIECE, law, S)


@uncounted_kernel
def law_at(depth: float, S: FloatArray) -> float:
    """Return the force of the plastic law that holds at an indentation of the virgin surface."""
    x = (depth - S[layout.HERE_LAW_CENTRE]) / S[layout.HERE_LAW_SCALE]
    value = 0.0
    for k in range(int(S[layout.HERE_LAW_TERMS]) - 1, -1, -1):
        value = value * x + S[layout.HERE_LAW + k]
    return value


@uncounted_kernel
def path_at(after: float, S: FloatArray) -> tuple[float, float, float]:
    """Return the path's height, velocity and acceleration (scaled) at a time after the step's start."""
    degree = int(S[layout.HERE_DEGREE])
    y = S[layout.HERE_POLY + degree]
    v = 0.0
    a = 0.0
    for k in range(degree - 1, -1, -1):
        a = a * after + 2.0 * v
        v = v * after + y
        y = y * after + S[layout.HERE_POLY + k]
    omega = S[layout.HERE_OMEGA]
    if omega != 0.0:
        phase = S[layout.HERE_PHASE0] + omega * after
        s = sin(phase)
        c = cos(phase)
        h = S[layout.HERE_AMP_SIN] * s + S[layout.HERE_AMP_COS] * c
        y += h
        v += omega * (S[layout.HERE_AMP_SIN] * c - S[layout.HERE_AMP_COS] * s)
        a -= omega * omega * h
    return y, v, a


@uncounted_kernel
def rail_at(after: float, state: FloatArray, S: FloatArray) -> tuple[float, float]:
    """Return height and velocity of the rail under the wheel, on the deck too; the state has the deck's motion then."""
    height, velocity, _ = path_at(after, S)
    if state[ON_DECK] != 0.0:
        height += state[DECK_Y]
        velocity += state[DECK_V]
    return height, velocity


@uncounted_kernel
def deck_acceleration(numbers: FloatArray, y: float, v: float, on_deck: bool, force: float) -> float:
    """Return the acceleration of the deck from its motion and the contact force; zero without a deck."""
    mass = numbers[contract.DECK_MASS]
    if mass == 0.0:
        return 0.0
    pull = -numbers[contract.DECK_STIFFNESS] * y - numbers[contract.DECK_DAMPING] * v
    if on_deck:
        pull += numbers[contract.PRESTRESS] - force
    return pull / mass


@uncounted_kernel
def factor_at(after: float, S: FloatArray) -> tuple[float, float]:
    """Return the factor on the contact force and its rate at a time after the step's start."""
    degree = int(S[layout.HERE_FACTOR_DEGREE])
    if degree < 0:
        return 1.0, 0.0
    value = S[layout.HERE_FACTOR + degree]
    rate = 0.0
    for k in range(degree - 1, -1, -1):
        rate = rate * after + value
        value = value * after + S[layout.HERE_FACTOR + k]
    return value, rate


@uncounted_kernel
def harmonic_at(amp_sin: float, amp_cos: float, omega: float, phase: float) -> tuple[float, float]:
    """Return the harmonic of a path, and its rate; it has none where `omega` is zero."""
    if omega == 0.0:
        return 0.0, 0.0
    s, c = sin(phase), cos(phase)
    return amp_sin * s + amp_cos * c, omega * (amp_sin * c - amp_cos * s)
