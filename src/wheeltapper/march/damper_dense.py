"""Any time of a march with a damper that has an end of its own, as in dense.py; and the energy's integrals."""

from __future__ import annotations

import numpy as np

from wheeltapper.march import dense as plain
from wheeltapper.march import program as contract
from wheeltapper.march.damper_series import contact_with_end, flight_with_end, held
from wheeltapper.march.dense import (
    CONTACT_TIME,
    DELTA,
    DELTA_V,
    FORCE,
    IMPULSE,
    LOST_CONTACT,
    LOST_DECK,
    LOST_SUSPENSION,
    OUT_COLUMNS,
    OUT_DECK_V,
    PATH_V,
    WHEEL_A,
    WHEEL_V,
    WHEEL_Y,
    WORK_FACTOR,
    WORK_PATH,
    touches,
)
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import BUSH, ENDED_SCRATCH, FLIGHT_ORDER, T, U
from wheeltapper.march.program import (
    DAMPER_DAMPING,
    DAMPER_PLAY,
    END_MODE,
    END_PLACE,
    FREE,
    LENGTH,
    PIECE,
    SHIFT,
    TIME,
    FloatArray,
)
from wheeltapper.march.roots import evaluate
from wheeltapper.march.series import factor_at, localise
from wheeltapper.march.step import time_to

# Columns that follow those of the plain dense output: the end's displacement, and the damper's force on the wheel.
OUT_END_Y, OUT_DAMPER_FORCE = OUT_COLUMNS, OUT_COLUMNS + 1
ENDED_OUT_COLUMNS = OUT_COLUMNS + 2


@kernel
def _prepare(pieces: FloatArray, numbers: FloatArray, damper: FloatArray, step: FloatArray, S: FloatArray) -> bool:
    """Compute the series of a step; return True for a contact step."""
    localise(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
    if touches(step):
        contact_with_end(numbers, int(numbers[contract.ORDER]), damper, step, S)
        return True
    flight_with_end(numbers, damper, step, S)
    return False


@kernel
def _fill(numbers: FloatArray, damper: FloatArray, step: FloatArray, x: float, S: FloatArray, out: FloatArray) -> float:
    """Write all quantities at x of the prepared step's own variable; return the time after the step's start."""
    after = plain._fill(numbers, step, x, S, out)
    mode = step[END_MODE]
    if mode == FREE:
        out[OUT_END_Y] = step[END_PLACE]
        out[OUT_DAMPER_FORCE] = 0.0
        return after
    G, soft, _ = held(mode, damper)
    deflection = 0.0
    if soft > 0.0:
        deflection = evaluate(S, BUSH, int(numbers[contract.ORDER]) if touches(step) else FLIGHT_ORDER, x)
    out[OUT_END_Y] = out[WHEEL_Y] - deflection - mode * damper[DAMPER_PLAY]
    out[OUT_DAMPER_FORCE] = -G * out[WHEEL_V] - soft * deflection
    out[WHEEL_A] += out[OUT_DAMPER_FORCE]
    return after


@kernel
def _place(order: int, x: float, s_max: float, time: float, S: FloatArray) -> float:
    """Return s in (0, s_max] with t(s) = time, from a guess."""
    for _ in range(8):
        u = evaluate(S, U, order, x)
        new = x - (evaluate(S, T, order, x) - time) / u if u > 0.0 else 0.0
        if not 0.0 < new <= s_max:
            break
        if abs(new - x) <= 1e-15 * new:
            return new
        x = new
    return time_to(S, order, s_max, time)


@kernel
def dense(
    pieces: FloatArray, numbers: FloatArray, damper: FloatArray, steps: FloatArray, times: FloatArray, out: FloatArray
) -> None:
    """Write all quantities at the given rising times (scaled) into the rows of `out`."""
    S = np.zeros(ENDED_SCRATCH)
    order = int(numbers[contract.ORDER])
    present = -1
    row = 0
    whole = 0.0
    x = 0.0
    for i in range(len(times)):
        while row + 1 < len(steps) and steps[row + 1, TIME] <= times[i]:
            row += 1
        step = steps[row]
        contact = touches(step)
        if row != present:
            _prepare(pieces, numbers, damper, step, S)
            whole = evaluate(S, T, order, step[LENGTH]) if contact else step[LENGTH]
            present = row
            x = 0.5 * step[LENGTH]
        after = max(times[i] - step[TIME], 0.0)
        if not contact:
            x = min(after, step[LENGTH])
        elif after >= whole:
            x = step[LENGTH]
        else:
            x = _place(order, x, step[LENGTH], after, S) if after > 0.0 else 0.0
        _fill(numbers, damper, step, x, S, out[i])


@kernel
def integrals(
    pieces: FloatArray, numbers: FloatArray, damper: FloatArray, steps: FloatArray, nodes: FloatArray,
    weights: FloatArray, out: FloatArray, ends: FloatArray,
) -> None:  # fmt: skip
    """Write each step's integrals into `out`, and the quantities at its two ends into ends[step, 0 or 1]."""
    S = np.zeros(ENDED_SCRATCH)
    point = np.zeros(ENDED_OUT_COLUMNS)
    order = int(numbers[contract.ORDER])
    for i in range(len(steps)):
        step = steps[i]
        contact = _prepare(pieces, numbers, damper, step, S)
        _fill(numbers, damper, step, 0.0, S, ends[i, 0])
        _fill(numbers, damper, step, step[LENGTH], S, ends[i, 1])
        total = out[i]
        total[:] = 0.0
        for j in range(len(nodes)):
            x = nodes[j] * step[LENGTH]
            after = _fill(numbers, damper, step, x, S, point)
            weight = weights[j] * step[LENGTH]
            if contact:
                weight *= evaluate(S, U, order, x)
            total[LOST_SUSPENSION] += weight * point[OUT_DAMPER_FORCE] ** 2 / damper[DAMPER_DAMPING]
            total[LOST_DECK] += weight * numbers[contract.DECK_DAMPING] * point[OUT_DECK_V] ** 2
            total[WORK_PATH] += weight * point[FORCE] * point[PATH_V]
            total[IMPULSE] += weight * point[FORCE]
            if contact:
                factor, rate = factor_at(after, S)
                delta = point[DELTA]
                root = np.sqrt(delta)
                total[CONTACT_TIME] += weight
                stored = numbers[contract.QUADRATIC] * delta**2 / 2.0 + numbers[contract.CUBIC] * delta**2 * root / 2.5
                total[WORK_FACTOR] += weight * rate * stored
                elastic = factor * delta * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * root)
                total[LOST_CONTACT] += weight * (point[FORCE] - elastic) * point[DELTA_V]
