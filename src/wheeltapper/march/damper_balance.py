"""Work and energy of a march with a damper that has an end of its own, as in balance.py.

dM/dt = N·(y_k' - w) + D·v - γ·Z²,   D = -G·v - B·e the force of what holds the damper's end
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.balance import held_at, seen_from, settle
from wheeltapper.march.damper_series import contact_with_end, flight_with_end, held
from wheeltapper.march.events import touches
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import BUSH, DEGREE, FACTOR_DEGREE, HERE, SCRATCH, WHEEL_V, N, U, W, Z
from wheeltapper.march.power import CONTACT_WORK, LONG, LOST, PATH, SHORT, times
from wheeltapper.march.program import (
    END_DEFLECTION,
    END_MODE,
    ENDED_COLUMNS,
    ON_DECK,
    PHASE,
    PIECE,
    SHIFT,
    TIME,
    A,
    B,
    FloatArray,
)
from wheeltapper.march.series import localise

ENOUGH = 5
"""Powers of the path in time beyond this do not reach the terms that are used."""


@kernel
def _power(
    numbers: FloatArray, damper: FloatArray, state: FloatArray, S: FloatArray, P: FloatArray, X: FloatArray
) -> None:
    """Write the power in a state whose piece stands in S; `numbers` ask for SHORT terms."""
    G, soft, _ = held(state[END_MODE], damper)
    bearing = numbers[contract.DECK_DAMPING]
    if not touches(state[PHASE]):
        flight_with_end(numbers, damper, state, S)
        X[PATH], X[CONTACT_WORK] = 0.0, 0.0
        for n in range(LONG):
            X[LOST, n] = 0.0
            for j in range(n + 1):
                X[LOST, n] += (G * S[W + j] + soft * S[BUSH + j]) * S[W + n - j]
                if bearing > 0.0:
                    X[LOST, n] += bearing * S[Z + j] * S[Z + n - j]
        return
    S[HERE + DEGREE] = min(S[HERE + DEGREE], ENOUGH)
    S[HERE + FACTOR_DEGREE] = min(S[HERE + FACTOR_DEGREE], ENOUGH)
    contact_with_end(numbers, damper, state, S)
    pushed, velocity, lost = P[0], P[1], P[2]
    times(S[N : N + SHORT], S[U : U + SHORT], pushed)
    for n in range(SHORT):
        velocity[n] = S[WHEEL_V + n] + S[W + n]
        if state[ON_DECK] != 0.0:
            velocity[n] -= S[Z + n]
    times(pushed, velocity, X[PATH])
    times(pushed, S[W : W + SHORT], X[CONTACT_WORK])
    for n in range(SHORT):
        velocity[n] = G * S[WHEEL_V + n] + soft * S[BUSH + n]
    times(velocity, S[WHEEL_V : WHEEL_V + SHORT], lost)
    if bearing > 0.0:
        times(S[Z : Z + SHORT], S[Z : Z + SHORT], velocity)
        for n in range(SHORT):
            lost[n] += bearing * velocity[n]
    times(lost, S[U : U + SHORT], X[LOST])


@kernel
def damper_balance_kernel(
    pieces: FloatArray, numbers: FloatArray, damper: FloatArray, steps: FloatArray, last: FloatArray, sums: FloatArray
) -> None:
    """Add what some steps, after which the step `last` begins, leave missing and exchange to `sums`."""
    S = np.zeros(SCRATCH)
    P = np.zeros((3, LONG))
    begins, ends = np.zeros((3, LONG)), np.zeros((3, LONG))
    end = np.empty(ENDED_COLUMNS)
    short = numbers.copy()
    short[contract.ORDER] = SHORT
    known = False
    y = v = 0.0
    for i in range(len(steps)):
        step = steps[i]
        after = steps[i + 1] if i + 1 < len(steps) else last
        if not known:
            localise(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
            y, v = held_at(step, S)
            _power(short, damper, step, S, P, begins)
        localise(pieces, numbers, int(after[PIECE]), after[SHIFT], after[TIME], S)
        end_y, end_v = held_at(after, S)
        end[:] = after
        known = step[END_MODE] == after[END_MODE]
        for column in (PHASE, PIECE, SHIFT, ON_DECK, END_MODE):
            known = known and end[column] == step[column]
            end[column] = step[column]
        if not known:
            localise(pieces, numbers, int(step[PIECE]), step[SHIFT], after[TIME], S)
            end[A], end[B] = seen_from(step, after, end_y, end_v, S) if touches(step[PHASE]) else (end_y, end_v)
            if step[END_MODE] != after[END_MODE]:
                end[END_DEFLECTION] = 0.0  # nothing is let go before its force is gone
        _power(short, damper, end, S, P, ends)
        settle(numbers, step, after, y, v, end_y, end_v, begins, ends, sums)
        begins, ends = ends, begins
        y, v = end_y, end_v
