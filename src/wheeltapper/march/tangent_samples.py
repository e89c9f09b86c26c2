"""Derivatives of the motion at given times, inside the steps that `tangent_kernel` goes through.

In a contact step the tangents are at fixed s; at fixed time they are those less the rate of each quantity times the
tangent of the time:   X_p at fixed t  =  X_p at fixed s  -  X'·t_p
"""

from __future__ import annotations

from wheeltapper.march import program as contract
from wheeltapper.march.kernel import uncounted_kernel
from wheeltapper.march.layout import FLIGHT_ORDER, HERE_FACTOR_DEGREE, N, T, U, W, Y, Z
from wheeltapper.march.program import BONDED, CONTACT, LENGTH, ON_DECK, PHASE, TIME, FloatArray
from wheeltapper.march.roots import evaluate, evaluate_derivative
from wheeltapper.march.series import deck_acceleration, path_at
from wheeltapper.march.step import time_to
from wheeltapper.march.tangent_path import LANES, path_tangent, sum_at

# What is sampled: contact force, the deck's displacement and velocity, the wheel's.
FORCE, SAMPLED_DECK_Y, SAMPLED_DECK_V, SAMPLED_WHEEL_Y, SAMPLED_WHEEL_V = range(5)
QUANTITIES = 5
VALUE, RATE, FIRST_LANE = 0, 1, 2
SAMPLED = FIRST_LANE + LANES
"""Entries of each quantity: its value, its rate in time, and its derivatives at fixed time."""


@uncounted_kernel
def _sample_accelerations(numbers: FloatArray, on_deck: bool, point: FloatArray) -> tuple[float, float]:
    """Return the accelerations of deck and wheel from their motion and the force."""
    wheel = -1.0 + point[FORCE, VALUE]
    y, v = point[SAMPLED_WHEEL_Y, VALUE], point[SAMPLED_WHEEL_V, VALUE]
    wheel -= numbers[contract.STIFFNESS] * y + numbers[contract.DAMPING] * v
    deck_y, deck_v = point[SAMPLED_DECK_Y, VALUE], point[SAMPLED_DECK_V, VALUE]
    return deck_acceleration(numbers, deck_y, deck_v, on_deck, point[FORCE, VALUE]), wheel


@uncounted_kernel
def _in_contact(
    numbers: FloatArray, step: FloatArray, time: float, point: FloatArray, S: FloatArray, D: FloatArray
) -> None:
    """Write one sample in a contact step."""
    order = int(numbers[contract.ORDER])
    on_deck = step[ON_DECK] != 0.0
    x = time_to(S, order, step[LENGTH], time - step[TIME]) if time > step[TIME] else 0.0
    after = evaluate(S, T, order, x)
    u = evaluate(S, U, order, x)
    w = evaluate(S, W, order, x)
    height, velocity, bend = path_at(after, S)
    lift = evaluate(S, Y, order, x)
    sway = evaluate(S, Z, order, x)
    quadratic, cubic = numbers[contract.QUADRATIC], numbers[contract.CUBIC]
    plain = numbers[contract.HYSTERESIS] == 0.0 and S[HERE_FACTOR_DEGREE] < 0.0
    if plain:  # exact where u vanishes, too
        point[FORCE, VALUE] = u * u * (quadratic + cubic * u)
        point[FORCE, RATE] = (quadratic + 1.5 * cubic * u) * w
    else:
        point[FORCE, VALUE] = evaluate(S, N, order - 1, x)
        point[FORCE, RATE] = evaluate_derivative(S, N, order - 1, x) / u if u > 0.0 else 0.0
    point[SAMPLED_DECK_Y, VALUE], point[SAMPLED_DECK_V, VALUE] = lift, sway
    point[SAMPLED_WHEEL_Y, VALUE] = height - u * u + (lift if on_deck else 0.0)
    point[SAMPLED_WHEEL_V, VALUE] = velocity - w + (sway if on_deck else 0.0)
    point[SAMPLED_DECK_Y, RATE] = point[SAMPLED_DECK_V, VALUE]
    point[SAMPLED_WHEEL_Y, RATE] = point[SAMPLED_WHEEL_V, VALUE]
    point[SAMPLED_DECK_V, RATE], point[SAMPLED_WHEEL_V, RATE] = _sample_accelerations(numbers, on_deck, point)
    parting = bend - point[SAMPLED_WHEEL_V, RATE] + (point[SAMPLED_DECK_V, RATE] if on_deck else 0.0)  # w'
    for lane in range(LANES):
        d_t = sum_at(D, T, order, x, lane)
        d_u = sum_at(D, U, order, x, lane)
        d_w = sum_at(D, W, order, x, lane)
        to = FIRST_LANE + lane
        if plain:
            point[FORCE, to] = u * (2.0 * quadratic + 3.0 * cubic * u) * d_u - point[FORCE, RATE] * d_t
        else:
            point[FORCE, to] = sum_at(D, N, order - 1, x, lane) - point[FORCE, RATE] * d_t
        point[SAMPLED_DECK_Y, to] = sum_at(D, Y, order, x, lane) - sway * d_t
        point[SAMPLED_DECK_V, to] = sum_at(D, Z, order, x, lane) - point[SAMPLED_DECK_V, RATE] * d_t
        d_height, d_velocity = path_tangent(after, lane, S, D)
        raised = point[SAMPLED_DECK_Y, to] if on_deck else 0.0
        point[SAMPLED_WHEEL_Y, to] = d_height - (2.0 * u * d_u - w * d_t) + raised
        point[SAMPLED_WHEEL_V, to] = d_velocity - d_w + (point[SAMPLED_DECK_V, to] if on_deck else 0.0)
        point[SAMPLED_WHEEL_V, to] += parting * d_t


@uncounted_kernel
def _out_of_contact(
    numbers: FloatArray, step: FloatArray, time: float, point: FloatArray, S: FloatArray, D: FloatArray
) -> None:
    """Write one sample in a step in flight, or of a bilateral contact."""
    x = time - step[TIME]
    order = int(FLIGHT_ORDER)
    bonded = step[PHASE] == BONDED
    deck = numbers[contract.DECK_MASS] > 0.0
    point[FORCE, VALUE] = evaluate(S, N, order, x) if bonded else 0.0
    point[FORCE, RATE] = evaluate_derivative(S, N, order, x) if bonded else 0.0
    point[SAMPLED_DECK_Y, VALUE] = evaluate(S, Y, order, x) if deck else 0.0
    point[SAMPLED_DECK_V, VALUE] = evaluate(S, Z, order, x) if deck else 0.0
    point[SAMPLED_WHEEL_Y, VALUE] = evaluate(S, U, order, x)
    point[SAMPLED_WHEEL_V, VALUE] = evaluate(S, W, order, x)
    point[SAMPLED_DECK_Y, RATE] = point[SAMPLED_DECK_V, VALUE]
    point[SAMPLED_WHEEL_Y, RATE] = point[SAMPLED_WHEEL_V, VALUE]
    point[SAMPLED_DECK_V, RATE], point[SAMPLED_WHEEL_V, RATE] = _sample_accelerations(
        numbers, step[ON_DECK] != 0.0, point
    )
    for lane in range(LANES):
        to = FIRST_LANE + lane
        point[FORCE, to] = sum_at(D, N, order - 1, x, lane) if bonded else 0.0
        point[SAMPLED_DECK_Y, to] = sum_at(D, Y, order, x, lane) if deck else 0.0
        point[SAMPLED_DECK_V, to] = sum_at(D, Z, order, x, lane) if deck else 0.0
        point[SAMPLED_WHEEL_Y, to] = sum_at(D, U, order, x, lane)
        point[SAMPLED_WHEEL_V, to] = sum_at(D, W, order, x, lane)


@uncounted_kernel
def sample_tangents(
    numbers: FloatArray, step: FloatArray, until: float, row: int, times: FloatArray, samples: FloatArray,
    S: FloatArray, D: FloatArray,
) -> int:  # fmt: skip
    """Write the samples (rows of (QUANTITIES, SAMPLED)) that lie before `until`; return the next one's row."""
    while row < len(times) and times[row] < until:
        if step[PHASE] == CONTACT:
            _in_contact(numbers, step, times[row], samples[row], S, D)
        else:
            _out_of_contact(numbers, step, times[row], samples[row], S, D)
        row += 1
    return row
