"""Derivatives of the motion at given times, inside the steps that `tangent_kernel` goes through.

In a contact step the tangents are at fixed s; at fixed time they are those less the rate of each quantity times the
tangent of the time:   X_p at fixed t  =  X_p at fixed s  -  X'·t_p
"""

from __future__ import annotations

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import BONDED, CONTACT, LENGTH, ON_DECK, PHASE, TIME, FloatArray
from wheeltapper.march.steps.layout import FLIGHT_ORDER, N, T, U, W, Y, Z
from wheeltapper.march.steps.series import factor_at
from wheeltapper.march.steps.tangent_path import LANES, path_tangent, sum_at
from wheeltapper.march.wheel import dense
from wheeltapper.march.wheel.roots import evaluate_derivative
from wheeltapper.march.wheel.step import time_to
from wheeltapper.march.wheel.tangent_events import force_tangent, parting

# What is sampled: contact force, the deck's displacement and velocity, the wheel's.
FORCE, SAMPLED_DECK_Y, SAMPLED_DECK_V, SAMPLED_WHEEL_Y, SAMPLED_WHEEL_V = range(5)
QUANTITIES = 5
VALUE, RATE, FIRST_LANE = 0, 1, 2
SAMPLED = FIRST_LANE + LANES
"""Entries of each quantity: its value, its rate in time, and its derivatives at fixed time."""


@uncounted_kernel
def _force_rate(numbers: FloatArray, after: float, u: float, w: float, bend: float, S: FloatArray) -> float:
    """Return the rate in time of an elastic contact's force; `bend` is that of w."""
    factor, rate = factor_at(after, S)
    eta = numbers[contract.HYSTERESIS]
    law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
    stiff = numbers[contract.QUADRATIC] + 1.5 * numbers[contract.CUBIC] * u
    return float((rate * law + factor * stiff * w) * (1.0 + eta * w) + factor * law * eta * bend)


@uncounted_kernel
def sample_point(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, time: float, point: FloatArray, here: FloatArray,
    S: FloatArray, D: FloatArray,
) -> None:  # fmt: skip
    """Write one sample in a step (QUANTITIES, SAMPLED); `here` is scratch memory for a motion."""
    contact, bonded = step[PHASE] == CONTACT, step[PHASE] == BONDED
    on_deck, deck = step[ON_DECK] != 0.0, numbers[contract.DECK_MASS] > 0.0
    order = int(numbers[contract.ORDER]) if contact else int(FLIGHT_ORDER)
    x = time - step[TIME]
    if contact:
        x = time_to(S, order, step[LENGTH], x) if x > 0.0 else 0.0
    after = dense.fill_row(numbers, step, x, S, here)
    delta_v = here[dense.OUT_DELTA_V]
    u, bend = 0.0, parting(here, on_deck)
    point[FORCE, RATE] = evaluate_derivative(S, N, order, x) if bonded else 0.0
    if contact:
        u = here[dense.OUT_DELTA] ** 0.5
        point[FORCE, RATE] = _force_rate(numbers, after, u, delta_v, bend, S)
    point[FORCE, VALUE] = here[dense.OUT_FORCE]
    point[SAMPLED_DECK_Y, VALUE], point[SAMPLED_DECK_Y, RATE] = here[dense.OUT_DECK_Y], here[dense.OUT_DECK_V]
    point[SAMPLED_DECK_V, VALUE], point[SAMPLED_DECK_V, RATE] = here[dense.OUT_DECK_V], here[dense.OUT_DECK_A]
    point[SAMPLED_WHEEL_Y, VALUE], point[SAMPLED_WHEEL_Y, RATE] = here[dense.OUT_WHEEL_Y], here[dense.OUT_WHEEL_V]
    point[SAMPLED_WHEEL_V, VALUE], point[SAMPLED_WHEEL_V, RATE] = here[dense.OUT_WHEEL_V], here[dense.OUT_WHEEL_A]
    for lane in range(LANES):
        to = FIRST_LANE + lane
        d_t = sum_at(D, T, order, x, lane) if contact else 0.0
        d_y, d_v = sum_at(D, U, order, x, lane), sum_at(D, W, order, x, lane)
        point[SAMPLED_DECK_Y, to] = sum_at(D, Y, order, x, lane) - here[dense.OUT_DECK_V] * d_t if deck else 0.0
        point[SAMPLED_DECK_V, to] = sum_at(D, Z, order, x, lane) - here[dense.OUT_DECK_A] * d_t if deck else 0.0
        point[FORCE, to] = sum_at(D, N, order - 1, x, lane) if bonded else 0.0
        if contact:
            d_u, d_w = d_y, d_v
            point[FORCE, to] = force_tangent(
                numbers, turns, lane, after, u, delta_v, bend, d_u, d_w, d_t, 0.0, S, D
            )  # fmt: skip
            height, velocity = path_tangent(after, lane, S, D)
            d_y = height - (2.0 * u * d_u - delta_v * d_t) + (point[SAMPLED_DECK_Y, to] if on_deck else 0.0)
            d_v = velocity - (d_w - bend * d_t) + (point[SAMPLED_DECK_V, to] if on_deck else 0.0)
        point[SAMPLED_WHEEL_Y, to], point[SAMPLED_WHEEL_V, to] = d_y, d_v


@uncounted_kernel
def sample_tangents(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, until: float, row: int, times: FloatArray,
    samples: FloatArray, here: FloatArray, S: FloatArray, D: FloatArray,
) -> int:  # fmt: skip
    """Write the samples (rows of (QUANTITIES, SAMPLED)) that lie before `until`; return the next one's row."""
    while row < len(times) and times[row] < until:
        sample_point(numbers, turns, step, times[row], samples[row], here, S, D)
        row += 1
    return row
