"""Rates of forces that depend on the indentation's rate, by central differences along the motion.

Their derivatives hold accelerations, those of path and rail included. What a state becomes a moment before and after,
its rates tell; so that no formula beside that of the force itself is needed.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import LANES
from wheeltapper.march.wagon.pressing import contact_forces

ASIDE = 1e-5
"""How far both states are away, in radians of phase of a wheelset on its contacts: the error is its square."""


@kernel
def time_aside(data: FloatArray) -> float:
    """Return how far both states are away, s."""
    return ASIDE * data[asm.PULSE]


@kernel
def _forces_aside(
    t: float, away: float, data: FloatArray, plan: IntArray, w: FloatArray, rate: FloatArray, wheels: FloatArray,
    beside: FloatArray,
) -> None:  # fmt: skip
    """Compute what presses where the motion has come to, a while later; `beside` is scratch memory for a state."""
    for i in range(w.shape[0]):
        beside[i] = w[i] + away * rate[i]
    contact_forces(t + away, data, plan, beside, wheels)


@kernel
def find_growths(
    t: float, data: FloatArray, plan: IntArray, w: FloatArray, rate: FloatArray, wheels: FloatArray
) -> None:
    """Write how fast forces, grips, indentations and the rails' deflections change in a state with these rates."""
    beside = np.empty(w.shape[0])
    away = time_aside(data)
    _forces_aside(t, -away, data, plan, w, rate, wheels, beside)
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            L[wheel.FORCE_GROWTH + i] = L[wheel.NORMAL + i]
            L[wheel.GRIP_RATE + i] = L[wheel.GRIP + i]
            L[wheel.TRUE_RATE + i] = L[wheel.ROW_DELTA + i]
            L[wheel.TRUE_SINKING + i] = L[wheel.ROW_RAIL + i]
    _forces_aside(t, away, data, plan, w, rate, wheels, beside)
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            L[wheel.FORCE_GROWTH + i] = (L[wheel.NORMAL + i] - L[wheel.FORCE_GROWTH + i]) / (2.0 * away)
            L[wheel.GRIP_RATE + i] = (L[wheel.GRIP + i] - L[wheel.GRIP_RATE + i]) / (2.0 * away)
            L[wheel.TRUE_RATE + i] = (L[wheel.ROW_DELTA + i] - L[wheel.TRUE_RATE + i]) / (2.0 * away)
            L[wheel.TRUE_SINKING + i] = (L[wheel.ROW_RAIL + i] - L[wheel.TRUE_SINKING + i]) / (2.0 * away)
    contact_forces(t, data, plan, w, wheels)
