"""One step of DOP853 for a vehicle's state, and its dense solution."""

from __future__ import annotations

from wheeltapper.march.common.kernel import shared_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon.rates import rates
from wheeltapper.march.wagon.unrolled_dop853 import DENSE_STAGES, STAGES, C, combine, combine_dense, finish, powers

FIRST_STAGE = 0
"""The stage whose rates are those at the step's start; STAGES has those at its end."""


@shared_kernel
def make_step(
    t: float, h: float, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray, wheels: FloatArray,
    pieces: FloatArray, Q: FloatArray, K: FloatArray, P: FloatArray,
) -> None:  # fmt: skip
    """Compute a step from w to y; K[FIRST_STAGE] are the rates at its start."""
    for stage in range(FIRST_STAGE + 1, STAGES):
        combine(stage, h, P, K, w, y)
        rates(t + C[stage] * h, data, plan, y, wheels, pieces, Q, K[stage], False)
    finish(h, P, K, w, y)


@shared_kernel
def dense_step(
    t: float, h: float, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray, wheels: FloatArray,
    pieces: FloatArray, Q: FloatArray, K: FloatArray, P: FloatArray, F: FloatArray, spare: FloatArray,
) -> None:  # fmt: skip
    """Compute the dense solution of a step; K[STAGES] are the rates at its end."""
    for stage in range(STAGES + 1, DENSE_STAGES):
        combine_dense(stage, h, P, K, w, spare)
        rates(t + C[stage] * h, data, plan, spare, wheels, pieces, Q, K[stage], False)
    powers(h, P, K, w, y, F)
