"""Dry friction with an elastic slider (Jenkins): N = k·(δ - z), |N| ≤ F.

stretch 0       sticking: N = k·(δ - z), a spring about its anchor z
stretch ±1      sliding: N = ±F, and the anchor goes along, z = δ ∓ F/k

δ is the displacement between the two bodies; the march takes it from the anchor, which the contact remembers
(layout.py). It begins to slide where |N| comes to F, and sticks where δ' falls through zero (docs/theory/motion.rst,
section 1.9).
"""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray

JENKINS_FORCE, JENKINS_STIFFNESS = 1, 2
"""Columns of F and k."""
STUCK = 0.0


@inlined_uncounted_kernel
def slider_force(delta: float, stretch: float, numbers: FloatArray) -> tuple[float, float]:
    """Return the force of a displacement from the anchor, and its derivative; `stretch` is 0, or the side it slides."""
    if stretch == STUCK:
        return numbers[JENKINS_STIFFNESS] * delta, numbers[JENKINS_STIFFNESS]
    return stretch * numbers[JENKINS_FORCE], 0.0
