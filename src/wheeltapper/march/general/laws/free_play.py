"""A damper with free play: N = c·δ', without a force while the end is between its two stops.

δ is the displacement of what the damper holds, z the place of its end, which the contact remembers (layout.py). Where
|δ - z| = g a stop is met. There the end goes along, |δ - z| = g, and N = c·δ', as long as δ' points outwards; where δ'
falls through zero the stop is left, and z rests (docs/theory/motion.rst, section 1.3).
"""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray

PLAY_DAMPING, PLAY_GAP, PLAY_START = 1, 2, 3
"""Columns of c, of the half-gap g, and of z at the start."""


@inlined_uncounted_kernel
def free_play_force(rate: float, numbers: FloatArray) -> tuple[float, float]:
    """Return the force at a stop, and its derivative by the rate."""
    return numbers[PLAY_DAMPING] * rate, numbers[PLAY_DAMPING]
