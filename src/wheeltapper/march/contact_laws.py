"""What contact laws other than Hertz's make of an octet's indentations, whose Hertzian forces have just been computed.

Hunt and Crossley's force is Hertz's times the grip, 1 + χ·δ', and zero where that is negative. The patch of contact,
and with it what creep takes for its stiffness, is that of the elastic part. On a flange δ' is along its normal.
A linear force has the patch that Hertz's theory gives to it.

Treads that yield follow the stretches of an elastic-plastic law (plastic_law.py): N = C(u)·φ(δ), where φ is the law for
C = 1. Its factor and all lengths belong to the place of the rail, C to the lateral shift. The patch is the one that
Hertz's theory gives to the force. Flanges stay elastic.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march import assembly as asm
from wheeltapper.march import wheel_rows as wheel
from wheeltapper.march.assembly import LANES
from wheeltapper.march.kernel import inlined_kernel, kernel
from wheeltapper.march.law_columns import PIECE_STORED, PLASTIC_ONSET, PLASTIC_PIECES, YIELD_COLUMNS
from wheeltapper.march.plastic_law import border_of, plastic_force, virgin_force
from wheeltapper.march.program import FloatArray
from wheeltapper.march.wheel_paths import evaluate_marks


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
def yield_law(data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return numbers and pieces of the law of treads that yield."""
    numbers = data[asm.YIELD_LAW : asm.AT_LAW]
    pieces = int(numbers[PLASTIC_PIECES])
    table = data[asm.AT_LAW : asm.AT_LAW + pieces * YIELD_COLUMNS].reshape(pieces, YIELD_COLUMNS)
    return numbers, table


@kernel
def _borne(i: int, gap: float, data: FloatArray, L: FloatArray) -> tuple[float, float]:
    """Return the force of an indentation for C = 1 on the present stretch, and its derivative."""
    stretch = L[wheel.STRETCH + i]
    if stretch == 0.0:
        slope = L[wheel.BULGE + i] * sqrt(max(gap, 0.0))
        return slope * max(gap, 0.0), 1.5 * slope
    numbers, table = yield_law(data)
    force, slope = plastic_force(gap, L[wheel.ROW_LEFT + i], stretch, numbers, table)
    return max(force, 0.0), slope


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
        if law[asm.CONTACT_LAW] == asm.PLASTIC_TREADS:
            c = L[wheel.ROOT_C + i] * L[wheel.ON + i]
            force, slope = _borne(i, gap, law, L)
            return c * c * c * force, c * c * c * slope
        n = c * sqrt(max(gap, 0.0))
        grip = max(L[wheel.GRIP + i], 0.0)
        return n * n * n * grip, 1.5 * c * c * n * grip


@kernel
def yield_growth(i: int, data: FloatArray, L: FloatArray) -> tuple[float, float]:
    """Return how the force of a contact that may yield grows: at a constant indentation, N/s, and with it, N/m."""
    c, c_rate = L[wheel.ROOT_C + i] * L[wheel.ON + i], L[wheel.ROOT_C_RATE + i] * L[wheel.ON + i]
    gap = L[wheel.ROW_DELTA + i]
    force, slope = _borne(i, gap, data, L)
    if L[wheel.STRETCH + i] == 0.0:
        grown = L[wheel.BULGE_RATE + i] * sqrt(max(gap, 0.0)) * max(gap, 0.0)
    else:
        grown = slope * L[wheel.LEFT_RATE + i]
    return c * c * (3.0 * c_rate * force + c * grown), c * c * c * slope


@kernel
def yield_energy(i: int, data: FloatArray, L: FloatArray) -> tuple[float, float]:
    """Return the elastic energy of a contact that may yield, J, and how it grows at a constant indentation, W.

    Beyond the elastic stretch it is the work of loading a virgin surface so far. Where a surface with marks begins to
    yield it jumps by what this is more than what the surface stores.
    """
    c, gap = L[wheel.ROOT_C + i], max(L[wheel.ROW_DELTA + i], 0.0)
    if L[wheel.STRETCH + i] == 0.0:
        whole = 0.4 * sqrt(gap) * gap * gap
        stored, growth = L[wheel.BULGE + i] * whole, L[wheel.BULGE_RATE + i] * whole
    else:
        numbers, table = yield_law(data)
        onset, left = numbers[PLASTIC_ONSET], L[wheel.ROW_LEFT + i]
        unit = onset * sqrt(onset)
        force, done = virgin_force((gap + left) / onset, PIECE_STORED, numbers, table)
        stored, growth = unit * onset * done, unit * force * L[wheel.LEFT_RATE + i]
    return c * c * c * stored, c * c * (3.0 * L[wheel.ROOT_C_RATE + i] * stored + c * growth)


@kernel
def measure_borders(data: FloatArray, L: FloatArray) -> None:
    """Write how far treads that may yield are from the borders of their stretches, and how fast that changes."""
    for i in range(LANES):
        stretch, gap, rate = L[wheel.STRETCH + i], L[wheel.ROW_DELTA + i], L[wheel.DELTA_RATE + i]
        upper, upper_rate, lower, lower_rate = np.inf, 0.0, np.inf, 0.0
        if L[wheel.ON + i] != 0.0:
            bears, bears_rate = L[wheel.ROW_BEARS + i], L[wheel.BEARS_RATE + i]
            if stretch == 0.0:
                upper, upper_rate = bears - gap, bears_rate - rate
            else:
                numbers, table = yield_law(data)
                left, left_rate = L[wheel.ROW_LEFT + i], L[wheel.LEFT_RATE + i]
                ends = border_of(stretch + 1.0, numbers, table)
                if ends < np.inf:
                    upper, upper_rate = ends - left - gap, -left_rate - rate
                lower, lower_rate = gap - bears, rate - bears_rate
                begins = border_of(stretch, numbers, table) - left
                if stretch > 1.0 and begins > bears:
                    lower, lower_rate = gap - begins, rate + left_rate
        L[wheel.TO_UPPER + i] = upper
        L[wheel.TO_UPPER_RATE + i] = upper_rate
        L[wheel.TO_LOWER + i] = lower
        L[wheel.TO_LOWER_RATE + i] = lower_rate


@kernel
def _yield(t: float, data: FloatArray, L: FloatArray) -> None:
    """Write the forces of treads that may yield, their rates, and how far they are from the borders of the law."""
    evaluate_marks(t, L)
    for i in range(LANES):
        force, _ = push(i, L[wheel.ROW_DELTA + i], data, L)
        grown, steep = yield_growth(i, data, L)
        L[wheel.CUBE_ROOT + i] = np.cbrt(force)
        L[wheel.NORMAL + i] = force
        L[wheel.NORMAL_RATE + i] = grown + steep * L[wheel.DELTA_RATE + i]
    measure_borders(data, L)


@kernel
def apply_law(t: float, inclined: float, data: FloatArray, L: FloatArray) -> None:
    """Correct the forces of an octet by the law of its contacts, which is not Hertz's; `inclined`: of flanges."""
    if data[asm.CONTACT_LAW] == asm.LOSSY:
        _lose_by_rates(inclined, data[asm.MATERIAL_LOSS], data[asm.STATIC_INDENTATION], L)
    elif data[asm.CONTACT_LAW] == asm.STRAIGHT:
        _straighten(L)
    elif inclined == 0.0:
        _yield(t, data, L)
