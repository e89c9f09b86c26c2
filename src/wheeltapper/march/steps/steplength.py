"""The length of a contact step, from the last two terms of its series (docs/theory/integration.rst, section 5.4).

A part of the motion that has decayed does not appear in the terms of the series. If it is fast, it limits the step
nevertheless: beyond order/2 of its time constants a polynomial amplifies rounding to visible motion. Half of that is
the limit. For roots of order 11 and more an approximate logarithm suffices: logarithm and power come from the bits of
the number, to 0.1 and 3 %.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import uncounted_kernel

LONGEST = 2.0
LOG_SAFETY = float(np.log2(0.6))
UNIT = 2.0**52
BIAS = 1022.957  # of the exponent, less half the largest error of the straight line through the mantissa
FLOOR = 1e-250
STABLE = 0.25  # of the order
SLOW = 1.0
"""Value of K + G below which the suspension is too slow to limit a step of at most LONGEST."""


BRIEFEST = 1e-14
"""Part of the time that has passed, and of its unit, that a step takes unless it is stuck."""


@uncounted_kernel
def _log2_bits(x: float) -> float:
    """Return the bits of a positive number as a number: 2**52·(log2(x) + BIAS), with an error up to 0.05·2**52."""
    return float(np.float64(x).view(np.int64))


@uncounted_kernel
def steplength(order: int, u_before: float, w_before: float, u_last: float, w_last: float, goal: float) -> float:
    """Return the step in s at which the terms of u and w of orders `order` - 1 and `order` reach 2**goal."""
    start = UNIT * (goal / (order - 1) + LOG_SAFETY + BIAS)
    before = _log2_bits(max(w_before, max(u_before, FLOOR)))
    last = _log2_bits(max(w_last, max(u_last, FLOOR)))
    first = start + (UNIT * BIAS - before) / (order - 1)
    second = start + (UNIT * BIAS - last) / order
    return min(LONGEST, float(np.int64(min(first, second)).view(np.float64)))


@uncounted_kernel
def steplength_of_bush(order: int, bush: float, before: float, last: float, goal: float) -> float:
    """Return the step at which the last two terms of a bush's deflection, or of its force, reach 2**goal."""
    if not bush > 0.0:
        return LONGEST
    gain = max(1.0, bush)
    return steplength(order, gain * before, 0.0, gain * last, 0.0, goal)


@uncounted_kernel
def stable_step(order: int, length: float, rate: float) -> float:
    """Return the length of a step, limited by stability if the motion has a part as fast as `rate`."""
    reach = STABLE * order
    return reach / rate if length * rate > reach else length
