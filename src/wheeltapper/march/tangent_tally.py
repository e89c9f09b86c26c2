"""Derivatives of the sums over steps: impulses, and the wheel's highest position."""

from __future__ import annotations

from wheeltapper.march import program as contract
from wheeltapper.march.kernel import uncounted_kernel
from wheeltapper.march.layout import FLIGHT_ORDER, N, T, U, W, Y, Z
from wheeltapper.march.program import CONTACT, LENGTH, ON_DECK, PHASE, TIME, FloatArray
from wheeltapper.march.roots import evaluate
from wheeltapper.march.series import path_at
from wheeltapper.march.step import time_to
from wheeltapper.march.tangent_path import LANES, path_tangent, sum_at


@uncounted_kernel
def add_impulse(order: int, length: float, impulse: FloatArray, S: FloatArray, D: FloatArray) -> None:
    """Add the derivatives, at fixed s, of a contact step's impulse ∫ N·u ds."""
    power = 1.0
    for n in range(order):
        power *= length
        for j in range(n + 1):
            u, force = S[U + n - j], S[N + j]
            for lane in range(LANES):
                impulse[lane] += power / (n + 1) * (D[N + j, lane] * u + force * D[U + n - j, lane])


@uncounted_kernel
def highest_tangent(
    numbers: FloatArray, step: FloatArray, time: float, highest: FloatArray, S: FloatArray, D: FloatArray
) -> float:
    """Write the derivatives of the wheel's displacement at a fixed time inside a step; return its velocity there."""
    if step[PHASE] != CONTACT:
        x = time - step[TIME]
        for lane in range(LANES):
            highest[lane] = sum_at(D, U, FLIGHT_ORDER, x, lane)
        return evaluate(S, W, FLIGHT_ORDER, x)
    order = int(numbers[contract.ORDER])
    on_deck = step[ON_DECK] != 0.0
    x = time_to(S, order, step[LENGTH], time - step[TIME])
    after = evaluate(S, T, order, x)
    u = evaluate(S, U, order, x)
    _, velocity, _ = path_at(after, S)
    v = velocity - evaluate(S, W, order, x) + (evaluate(S, Z, order, x) if on_deck else 0.0)
    for lane in range(LANES):
        height, _ = path_tangent(after, lane, S, D)
        lift = sum_at(D, Y, order, x, lane) if on_deck else 0.0
        highest[lane] = (
            height + lift + (velocity - v) * sum_at(D, T, order, x, lane) - 2.0 * u * sum_at(D, U, order, x, lane)
        )
    return v
