"""What contact laws other than Hertz's make of an octet's indentations, whose Hertzian forces have just been computed.

Hunt and Crossley's force is Hertz's times the grip, 1 + χ·δ', and zero where that is negative. The patch of contact,
and with it what creep takes for its stiffness, is that of the elastic part. On a flange δ' is along its normal.
A linear force has the patch that Hertz's theory gives to it; one that also pulls has none while it does, and flanges
never pull.

Treads that yield follow the stretches of an elastic-plastic law (plastic_law.py): N = C(u)·φ(δ), where φ is the law for
C = 1. Its factor and all lengths belong to the place of the rail, C to the lateral shift. The patch is the one that
Hertz's theory gives to the force. Flanges stay elastic.

A law of one's own, F(δ, δ') along the normal of the contact, stands in the table that also the general march uses
(general/laws/tabulated.py), for one wheel. With the cosine k of the contact's inclination, its component along z is
k·F(k·δ, k·δ'); as of Hertz's force, which grows so with k^2.5, ROOT_C³ is k^2.5. The patch is that of F(k·δ, 0), and
the grip the ratio to this. The first row of the table holds its numbers; each other one ends with the energy stored, at
rest, where its cell begins.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common.kernel import inlined_kernel, kernel
from wheeltapper.march.common.law_columns import PIECE_STORED, PLASTIC_ONSET, PLASTIC_PIECES, YIELD_COLUMNS
from wheeltapper.march.common.plastic_law import border_of, plastic_force, virgin_force
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general.laws import tabulated as tab
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import LANES
from wheeltapper.march.wagon.wheel_paths import evaluate_marks

OWN_NODES, _OWN_WEIGHTS = np.polynomial.legendre.leggauss(12)
OWN_RULE = tuple(zip((0.5 * (OWN_NODES + 1.0)).tolist(), (0.5 * _OWN_WEIGHTS).tolist(), strict=True))
"""Places and weights of the rule that integrates a law of one's own over a part of a cell."""


@kernel
def is_lossy(data: FloatArray) -> bool:
    """Return True where forces depend on the indentation's rate."""
    return bool(data[asm.CONTACT_LAW] == asm.LOSSY or data[asm.CONTACT_LAW] == asm.OWN_RATED)


@kernel
def is_plastic(data: FloatArray) -> bool:
    """Return True where treads may yield: then their forces have kinks, at which steps end."""
    return bool(data[asm.CONTACT_LAW] == asm.PLASTIC_TREADS)


@kernel
def is_own(data: FloatArray) -> bool:
    """Return True for a law of one's own."""
    return bool(data[asm.CONTACT_LAW] == asm.OWN_FORCE or data[asm.CONTACT_LAW] == asm.OWN_RATED)


@kernel
def pulls(data: FloatArray, L: FloatArray) -> bool:
    """Return True for an octet whose contacts also pull, and are never lost."""
    return bool(data[asm.CONTACT_LAW] == asm.PULLING and L[wheel.INCLINED_FLAG] == 0.0)


@inlined_kernel
def _own_law(data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the numbers of a law of one's own, and the rows of its table."""
    width = int(data[asm.OWN_WIDTH])
    numbers = data[asm.AT_LAW : asm.AT_LAW + width]
    rows = int(numbers[tab.TABLE_CELLS] * numbers[tab.TABLE_RATES])
    return numbers, data[asm.AT_LAW + width : asm.AT_LAW + (1 + rows) * width].reshape(rows, width)


@kernel
def _cosine_of(i: int, L: FloatArray) -> float:
    """Return the cosine of a contact's inclination; that of a tread is one."""
    if L[wheel.INCLINED_FLAG] == 0.0:
        return 1.0
    return (L[wheel.ROOT_C + i] * L[wheel.ROOT_C + i] * L[wheel.ROOT_C + i]) ** 0.4


@kernel
def _own_parts(
    i: int, gap: float, rate: float, data: FloatArray, L: FloatArray
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the ratio of a force of one's own to δ^e, the force, and its derivatives by indentation and rate."""
    numbers, table = _own_law(data)
    cosine = _cosine_of(i, L)
    depth = cosine * max(gap, 0.0)
    share, by_v, by_rate = tab.tabulated_share(depth, cosine * rate, numbers, table)
    exponent, root = numbers[tab.TABLE_EXPONENT], sqrt(depth)
    power = root if exponent == 1.5 else depth ** (exponent - 1.0)
    steep = power * (exponent * share + 0.5 / sqrt(numbers[tab.TABLE_LARGEST]) * root * by_v)
    return share, cosine * power * depth * share, cosine * cosine * steep, cosine * cosine * power * depth * by_rate


@kernel
def own_force(i: int, gap: float, rate: float, data: FloatArray, L: FloatArray) -> tuple[float, float]:
    """Return the force of one's own of an indentation and its rate, and its derivative by the indentation.

    Both are zero where the law would pull, as are those of an indentation that is none.
    """
    share, force, steep, _ = _own_parts(i, gap, rate, data, L)
    return (force, steep) if gap > 0.0 and share > 0.0 else (0.0, 0.0)


@kernel
def own_energy(i: int, data: FloatArray, L: FloatArray) -> float:
    """Return the work of indenting a contact with a law of one's own so far, at rest, J."""
    numbers, table = _own_law(data)
    exponent, largest, cells = numbers[tab.TABLE_EXPONENT], numbers[tab.TABLE_LARGEST], int(numbers[tab.TABLE_CELLS])
    cosine = _cosine_of(i, L)
    depth = cosine * max(L[wheel.ROW_DELTA + i], 0.0)
    v = sqrt(depth / largest)
    cell = min(int(min(v, 1.0) * cells), cells - 1)
    begin, work = cell / cells, table[cell, int(data[asm.OWN_WIDTH]) - 1]
    for place, weight in OWN_RULE:
        at = begin + place * (min(v, 1.0) - begin)
        share, _, _ = tab.tabulated_share(largest * at * at, 0.0, numbers, table)
        rise = (min(v, 1.0) - begin) * 2.0 * largest * at
        work += weight * rise * (largest * at * at) ** exponent * max(share, 0.0)
    if v > 1.0:
        share, _, _ = tab.tabulated_share(depth, 0.0, numbers, table)
        work += max(share, 0.0) * (depth ** (exponent + 1.0) - largest ** (exponent + 1.0)) / (exponent + 1.0)
    return work


@kernel
def grip_of(i: int, rate: float, data: FloatArray, L: FloatArray) -> float:
    """Return the ratio of a lossy force to its elastic part, negative where it would pull."""
    if data[asm.CONTACT_LAW] == asm.LOSSY:
        g = L[wheel.ROW_G + i] * L[wheel.INCLINED_FLAG]
        return 1.0 + data[asm.MATERIAL_LOSS] * rate / sqrt(1.0 + g * g)
    share, _, _, _ = _own_parts(i, L[wheel.ROW_DELTA + i], rate, data, L)
    rest, _, _, _ = _own_parts(i, L[wheel.ROW_DELTA + i], 0.0, data, L)
    if rest > 0.0:
        return share / rest
    return 1.0 if share > 0.0 else -1.0


@kernel
def viscosity_of(i: int, rate: float, data: FloatArray, L: FloatArray) -> float:
    """Return the derivative of a lossy force by the indentation's rate, N s/m."""
    if data[asm.CONTACT_LAW] == asm.LOSSY:
        n = L[wheel.CUBE_ROOT + i]
        return data[asm.MATERIAL_LOSS] * n * n * n
    _, _, _, viscosity = _own_parts(i, L[wheel.ROW_DELTA + i], rate, data, L)
    return viscosity * L[wheel.ON + i]


@kernel
def hold_by_rate(i: int, rate: float, data: FloatArray, L: FloatArray) -> None:
    """Write the grip of a lossy contact at a rate, and what is positive just where there is a force."""
    grip = grip_of(i, rate, data, L)
    L[wheel.HELD_RATE + i] = rate
    L[wheel.GRIP + i] = grip
    L[wheel.ROW_HOLD + i] = min(L[wheel.ROW_DELTA + i], data[asm.STATIC_INDENTATION] * grip)
    L[wheel.NORMAL_RATE + i] = L[wheel.FORCE_GROWTH + i]


@kernel
def _lose_by_rates(data: FloatArray, L: FloatArray) -> None:
    """Write lossy forces; their rates are those that were found last."""
    for i in range(LANES):
        hold_by_rate(i, L[wheel.DELTA_RATE + i], data, L)
        n = L[wheel.CUBE_ROOT + i]
        L[wheel.NORMAL + i] = n * n * n * max(L[wheel.GRIP + i], 0.0)


@kernel
def own_growth(i: int, force: float, steep: float, L: FloatArray) -> float:
    """Return how a force of one's own grows at a constant indentation: its inclination changes, N/s."""
    return (force + steep * L[wheel.ROW_DELTA + i]) * 1.2 * L[wheel.ROOT_C_RATE + i] / L[wheel.ROOT_C + i]


@kernel
def press_own(i: int, data: FloatArray, L: FloatArray) -> None:
    """Write the force of a contact with a law of one's own, at the rate that is held, and its patch."""
    on = L[wheel.ON + i]
    rest, _ = own_force(i, L[wheel.ROW_DELTA + i], 0.0, data, L)
    force = rest
    if data[asm.CONTACT_LAW] == asm.OWN_RATED:
        force, _ = own_force(i, L[wheel.ROW_DELTA + i], L[wheel.HELD_RATE + i], data, L)
    L[wheel.CUBE_ROOT + i] = np.cbrt(rest) * on
    L[wheel.NORMAL + i] = force * on


@kernel
def _follow_own_law(data: FloatArray, L: FloatArray) -> None:
    """Write forces of one's own, and their rates."""
    for i in range(LANES):
        if data[asm.CONTACT_LAW] == asm.OWN_RATED:
            hold_by_rate(i, L[wheel.DELTA_RATE + i], data, L)
        else:
            force, steep = own_force(i, L[wheel.ROW_DELTA + i], 0.0, data, L)
            rises = own_growth(i, force, steep, L) + steep * L[wheel.DELTA_RATE + i]
            L[wheel.NORMAL_RATE + i] = rises * L[wheel.ON + i]
        press_own(i, data, L)


@kernel
def _straighten(pulling: bool, L: FloatArray) -> None:
    """Write linear forces and their rates."""
    for i in range(LANES):
        c = L[wheel.ROOT_C + i] * L[wheel.BULGE + i]
        indented = (L[wheel.ROW_DELTA + i] if pulling else max(L[wheel.ROW_DELTA + i], 0.0)) * L[wheel.ON + i]
        growth = L[wheel.ROOT_C_RATE + i] * L[wheel.BULGE + i] + L[wheel.ROOT_C + i] * L[wheel.BULGE_RATE + i]
        L[wheel.CUBE_ROOT + i] = c * np.cbrt(max(indented, 0.0))
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
        if pulls(law, L):
            return c * c * c * gap, c * c * c
        if law[asm.CONTACT_LAW] == asm.STRAIGHT or law[asm.CONTACT_LAW] == asm.PULLING:
            return c * c * c * max(gap, 0.0), c * c * c if gap > 0.0 else 0.0
        if is_own(law):
            force, slope = own_force(i, gap, L[wheel.HELD_RATE + i], law, L)
            return force * L[wheel.ON + i], slope * L[wheel.ON + i]
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
def apply_law(t: float, data: FloatArray, L: FloatArray) -> None:
    """Correct the forces of an octet by the law of its contacts, which is not Hertz's."""
    if data[asm.CONTACT_LAW] == asm.LOSSY:
        _lose_by_rates(data, L)
    elif is_own(data):
        _follow_own_law(data, L)
    elif data[asm.CONTACT_LAW] == asm.STRAIGHT or data[asm.CONTACT_LAW] == asm.PULLING:
        _straighten(pulls(data, L), L)
    elif L[wheel.INCLINED_FLAG] == 0.0:
        _yield(t, data, L)
