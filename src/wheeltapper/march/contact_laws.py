"""What contact laws other than Hertz's make of an octet's indentations, whose Hertzian forces have just been computed.

Hunt and Crossley's force is Hertz's times the grip, 1 + χ·δ', and zero where that is negative. The patch of contact,
and with it what creep takes for its stiffness, is that of the elastic part. On a flange δ' is along its normal.
A linear force has the patch that Hertz's theory gives to it.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march import assembly as asm
from wheeltapper.march import wheel_rows as wheel
from wheeltapper.march.assembly import LANES
from wheeltapper.march.kernel import inlined_kernel, kernel
from wheeltapper.march.program import FloatArray


@inlined_kernel
def grip_of(i: int, rate: float, inclined: float, loss: float, L: FloatArray) -> float:
    """Return the ratio of a lossy force to its elastic part, negative where it would pull; `inclined`: of a flange."""
    g = L[wheel.ROW_G + i] * inclined
    return 1.0 + loss * rate / sqrt(1.0 + g * g)


@kernel
def _lose_by_rates(inclined: float, loss: float, indentation: float, L: FloatArray) -> None:
    """Write lossy forces; their rates are those that were found last."""
    for i in range(LANES):
        grip = grip_of(i, L[wheel.DELTA_RATE + i], inclined, loss, L)
        n = L[wheel.CUBE_ROOT + i]
        L[wheel.GRIP + i] = grip
        L[wheel.ROW_HOLD + i] = min(L[wheel.ROW_DELTA + i], indentation * grip)
        L[wheel.NORMAL + i] = n * n * n * max(grip, 0.0)
        L[wheel.NORMAL_RATE + i] = L[wheel.FORCE_GROWTH + i]


@kernel
def _straighten(L: FloatArray) -> None:
    """Write linear forces and their rates."""
    for i in range(LANES):
        c = L[wheel.ROOT_C + i] * L[wheel.BULGE + i]
        indented = max(L[wheel.ROW_DELTA + i], 0.0) * L[wheel.ON + i]
        growth = L[wheel.ROOT_C_RATE + i] * L[wheel.BULGE + i] + L[wheel.ROOT_C + i] * L[wheel.BULGE_RATE + i]
        L[wheel.CUBE_ROOT + i] = c * np.cbrt(indented)
        L[wheel.NORMAL + i] = c * c * c * indented
        L[wheel.NORMAL_RATE + i] = c * c * (3.0 * growth * indented + c * L[wheel.DELTA_RATE + i] * L[wheel.ON + i])


@kernel
def apply_law(inclined: float, data: FloatArray, L: FloatArray) -> None:
    """Correct the forces of an octet by the law of its contacts, which is not Hertz's; `inclined`: of flanges."""
    if data[asm.CONTACT_LAW] == asm.LOSSY:
        _lose_by_rates(inclined, data[asm.MATERIAL_LOSS], data[asm.STATIC_INDENTATION], L)
    else:
        _straighten(L)


@inlined_kernel
def push(i: int, gap: float, law: FloatArray | None, L: FloatArray) -> tuple[float, float]:
    """Return the force of an indentation and its derivative; `law`: None of Hertz's, or the data, known by its type."""
    c = L[wheel.ROOT_C + i] * L[wheel.BULGE + i] * L[wheel.ON + i]
    if law is None:
        n = c * sqrt(max(gap, 0.0))
        return n * n * n, 1.5 * c * c * n
    else:  # noqa: RET505 - Numba prunes whole branches only
        if law[asm.CONTACT_LAW] == asm.STRAIGHT:
            return c * c * c * max(gap, 0.0), c * c * c if gap > 0.0 else 0.0
        n = c * sqrt(max(gap, 0.0))
        grip = max(L[wheel.GRIP + i], 0.0)
        return n * n * n * grip, 1.5 * c * c * n * grip
