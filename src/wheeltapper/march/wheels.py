"""Eight contacts of wheels and rails at a time: path, geometry, normal force, creep forces.

Side σ is +1 left, -1 right; u, s and the tables count outwards from the track's middle (docs/theory/wagon.rst, section
7.2):

    u  = σ·(y + R·roll)
    δ  = path + h(u) - z - σ·(s(u) - u)·roll            N  = C(u)·δ^1.5
    g  = ∂δ/∂u = h'(u) - σ·(s'(u) - 1)·roll              δ' = path' + g·u' - z' - σ·(s - u)·roll'

The forces are the gradient of the contact's energy: N along z, -σ·g·N along y, σ·N·(s - u - R·g) about x. On the tread
the slip is that of a contact whose inclination is small; on the flange it lies in the inclined plane of contact.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march import assembly as asm
from wheeltapper.march.assembly import (
    ACROSS,
    ALONG,
    HALF,
    LANES,
    ROOT_CONSTANT,
    SATURATION_CELLS,
    SLENDER,
    SPIN,
    SPIN_MOMENT,
    TABLE_LIFT,
    TABLE_PLACE,
    TABLE_RADIUS,
    TABLE_TERMS,
    TABLES,
)
from wheeltapper.march.fastsim import PARABOLIC, SHARE_ELLIPTIC, SHARE_PARABOLIC, fastsim
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import (
    FloatArray,
    IntArray,
)
from wheeltapper.march.wheel_paths import follow, gather
from wheeltapper.march.wheel_rows import (
    ARM,
    BULGE,
    BULGE_RATE,
    CELL,
    CELLS,
    CUBE_ROOT,
    CURVE_CELL,
    CURVES,
    DELTA_RATE,
    FX,
    FY,
    MZ,
    NEW_CELL,
    NORMAL,
    NORMAL_RATE,
    ON,
    PATH_RATE,
    QROLL,
    QY,
    QYAW,
    QZ,
    RADII,
    ROLLING,
    ROOT_C,
    ROOT_C_RATE,
    ROW_DELTA,
    ROW_FLATNESS,
    ROW_G,
    ROW_ON_DECK,
    ROW_PATH,
    ROW_U,
    SHARE,
    SIDES,
    SLIP_TURN,
    SLIP_X,
    SLIP_Y,
    SLOPE,
    STIFF_SPIN,
    STIFF_TURN,
    STIFF_X,
    STIFF_Y,
    SUM_X,
    SUM_Y,
    TURN_X,
    TURN_Y,
    U_RATE,
    UX,
    UY,
    VPITCH,
    VROLL,
    VX,
    VY,
    VYAW,
    VZ,
)

LAST_CELL = SATURATION_CELLS * (1.0 - 1e-15)
"""Largest position in the creep law's curve, in cells, so that a utilisation of one still lies in the last cell."""


@kernel
def _enter_cells(first: float, finer: float, data: FloatArray, cells: int, count: int, L: FloatArray) -> None:
    """Load the geometry's cells in which the lanes are, where they changed; the tables begin at `cells`."""
    last = count - 1.0
    changed = 0.0
    for i in range(LANES):
        cell = min(last, max(0.0, np.floor((L[ROW_U + i] - first) * finer)))  # in this order NaN gives 0, not an index
        L[NEW_CELL + i] = cell
        changed += (cell - L[CELL + i]) * (cell - L[CELL + i])
    if changed == 0.0:
        return
    for i in range(LANES):
        if L[NEW_CELL + i] != L[CELL + i]:
            L[CELL + i] = L[NEW_CELL + i]
            at = cells + int(L[CELL + i]) * TABLES * TABLE_TERMS
            for j in range(TABLES * TABLE_TERMS):
                L[CELLS + j * LANES + i] = data[at + j]


@kernel
def _value(table: int, i: int, p: float, L: FloatArray) -> float:
    """Return a table's value at the place p in a lane's cell."""
    c = CELLS + table * TABLE_TERMS * LANES + i
    low = L[c] + p * (L[c + LANES] + p * L[c + 2 * LANES])
    return low + p * p * p * (L[c + 3 * LANES] + p * (L[c + 4 * LANES] + p * L[c + 5 * LANES]))


@kernel
def _slope(table: int, i: int, p: float, L: FloatArray) -> float:
    """Return a table's derivative by the place in the cell."""
    c = CELLS + table * TABLE_TERMS * LANES + i
    low = L[c + LANES] + p * (2.0 * L[c + 2 * LANES] + p * 3.0 * L[c + 3 * LANES])
    return low + p * p * p * (4.0 * L[c + 4 * LANES] + p * 5.0 * L[c + 5 * LANES])


@kernel
def approach(first: float, finer: float, data: FloatArray, cells: int, count: int, L: FloatArray) -> None:
    """Compute the indentation, the normal force, and their rates."""
    for i in range(LANES):
        L[ROW_U + i] = L[SIDES + i] * (L[QY + i] + L[RADII + i] * L[QROLL + i])
        L[U_RATE + i] = L[SIDES + i] * (L[VY + i] + L[RADII + i] * L[VROLL + i])
    _enter_cells(first, finer, data, cells, count, L)
    for i in range(LANES):
        side = L[SIDES + i]
        u = L[ROW_U + i]
        u_rate = L[U_RATE + i]
        p = (u - first) * finer - L[CELL + i]
        slope = _slope(TABLE_LIFT, i, p, L) * finer
        arm = _value(TABLE_PLACE, i, p, L) - u
        g = slope - side * (_slope(TABLE_PLACE, i, p, L) * finer - 1.0) * L[QROLL + i]
        delta = L[ROW_PATH + i] + _value(TABLE_LIFT, i, p, L) - L[QZ + i] - side * arm * L[QROLL + i]
        rate = L[PATH_RATE + i] + g * u_rate - L[VZ + i] - side * arm * L[VROLL + i]
        root_c = _value(ROOT_CONSTANT, i, p, L)
        root_c_rate = _slope(ROOT_CONSTANT, i, p, L) * finer * u_rate
        c = root_c * L[BULGE + i]
        root = sqrt(max(delta, 0.0)) * L[ON + i]
        n = c * root
        L[SLOPE + i] = slope
        L[ARM + i] = arm
        L[ROW_G + i] = g
        L[ROW_DELTA + i] = delta
        L[DELTA_RATE + i] = rate
        L[ROOT_C + i] = root_c
        L[ROOT_C_RATE + i] = root_c_rate
        L[CUBE_ROOT + i] = n
        L[NORMAL + i] = n * n * n
        growth = root_c_rate * L[BULGE + i] + root_c * L[BULGE_RATE + i]
        L[NORMAL_RATE + i] = 3.0 * n * (n * root * growth + 0.5 * c * c * rate * L[ON + i])


@kernel
def meet(t: float, data: FloatArray, plan: IntArray, kind: int, w: FloatArray, L: FloatArray) -> None:
    """Compute the paths, the indentations and the normal forces."""
    gather(w, L)
    follow(t, int(data[asm.DECK]), w, L)
    count = plan[asm.CELLS_EACH]
    cells = plan[asm.AT_CELLS] + kind * count * TABLES * TABLE_TERMS
    approach(data[asm.FIRST_SHIFT], data[asm.CELLS_PER_M], data, cells, count, L)


@kernel
def _stiffen(first: float, finer: float, speed: float, L: FloatArray) -> None:
    """Compute Kalker's coefficients over the speed, and the slip velocities."""
    for i in range(LANES):
        side = L[SIDES + i]
        p = (L[ROW_U + i] - first) * finer - L[CELL + i]
        n = L[CUBE_ROOT + i]
        square = n * n / speed
        L[STIFF_X + i] = _value(ALONG, i, p, L) * square
        L[STIFF_Y + i] = _value(ACROSS, i, p, L) * square
        L[STIFF_SPIN + i] = _value(SPIN, i, p, L) * square * n
        L[STIFF_TURN + i] = _value(SPIN_MOMENT, i, p, L) * square * n * n
        L[ROW_FLATNESS + i] = _value(SLENDER, i, p, L)
        radius = L[RADII + i] + _value(TABLE_RADIUS, i, p, L)
        spinning = speed / L[RADII + i]
        L[ROLLING + i] = radius
        L[SLIP_X + i] = speed + L[VX + i] - side * L[ARM + i] * L[VYAW + i] - radius * spinning
        L[SLIP_Y + i] = L[VY + i] + radius * L[VROLL + i] - speed * L[QYAW + i]
        L[SLIP_TURN + i] = L[VYAW + i] - side * spinning * L[SLOPE + i]


@kernel
def _turn_along(L: FloatArray) -> None:
    """Compute the quasi-static spin of the wheelsets: the longitudinal linear forces of both wheels have no moment."""
    for i in range(HALF):
        j = i + HALF
        left = L[STIFF_X + i] * L[ROLLING + i]
        right = L[STIFF_X + j] * L[ROLLING + j]
        need = left * L[SLIP_X + i] + right * L[SLIP_X + j]
        spin = need / max(left * L[ROLLING + i] + right * L[ROLLING + j], 1e-300)
        L[VPITCH + i] = spin
        L[VPITCH + j] = spin


# Loops that are long enough are not unrolled before they are made vectors of: hence few and long ones below.
@kernel
def _linear(inclined: float, friction: float, L: FloatArray) -> float:
    """Compute the linear forces, in the plane of contact if it is inclined (1), and the utilisation of friction.

    Return zero if all lanes stay in their cells of the creep law's curve.
    """
    changed = 0.0
    for i in range(LANES):
        side = L[SIDES + i]
        g = L[ROW_G + i] * inclined
        stretch = sqrt(1.0 + g * g)
        slip_x = L[SLIP_X + i] - L[ROLLING + i] * L[VPITCH + i]
        slip_turn = (L[SLIP_TURN + i] - side * L[VPITCH + i] * L[SLOPE + i]) / stretch
        rise = L[VZ + i] + side * L[ARM + i] * L[VROLL + i]
        slip_y = (L[SLIP_Y + i] + side * g * rise) / stretch
        fx = -L[STIFF_X + i] * slip_x
        fy = -L[STIFF_Y + i] * slip_y - L[STIFF_SPIN + i] * slip_turn
        force = sqrt(fx * fx + fy * fy)
        share = force / (force + friction * L[NORMAL + i] * stretch + 1e-300)
        cell = max(0.0, np.floor(share * LAST_CELL))  # 0 for NaN
        L[SLIP_X + i] = slip_x
        L[SLIP_Y + i] = slip_y
        L[SLIP_TURN + i] = slip_turn
        L[FX + i] = fx
        L[FY + i] = fy
        L[MZ + i] = L[STIFF_SPIN + i] * slip_y - L[STIFF_TURN + i] * slip_turn
        L[SHARE + i] = share
        L[NEW_CELL + i] = cell
        changed += (cell - L[CURVE_CELL + i]) * (cell - L[CURVE_CELL + i])
    return changed


@kernel
def _enter_curve(data: FloatArray, saturation: int, L: FloatArray) -> None:
    """Load the curve's cells in which the lanes are, where they changed; the curve begins at `saturation`."""
    for i in range(LANES):
        if L[NEW_CELL + i] != L[CURVE_CELL + i]:
            L[CURVE_CELL + i] = L[NEW_CELL + i]
            at = saturation + int(L[CURVE_CELL + i]) * TABLE_TERMS
            for k in range(TABLE_TERMS):
                L[CURVES + k * LANES + i] = data[at + k]


@kernel
def _saturate(L: FloatArray) -> None:
    """Limit the linear forces by friction, along the law's curve."""
    for i in range(LANES):
        m = L[SHARE + i]
        p = m * LAST_CELL - L[CURVE_CELL + i]
        c = CURVES + i
        low = L[c] + p * (L[c + LANES] + p * L[c + 2 * LANES])
        high = L[c + 3 * LANES] + p * (L[c + 4 * LANES] + p * L[c + 5 * LANES])
        share = (low + p * p * p * high) * (1.0 - m)
        L[SHARE + i] = share
        L[FX + i] *= share
        L[FY + i] *= share
        L[MZ + i] *= share


@kernel
def _slide(friction: float, inclined: float, bound: int, L: FloatArray) -> None:
    """Scale the slips for FASTSIM."""
    scale = SHARE_PARABOLIC if bound == PARABOLIC else SHARE_ELLIPTIC
    for i in range(LANES):
        g = L[ROW_G + i] * inclined
        limit = friction * L[NORMAL + i] * sqrt(1.0 + g * g)
        along = 3.0 / (8.0 * scale * (limit + 1e-300))
        turned = L[STIFF_SPIN + i] * L[SLIP_TURN + i] * (4.0 / np.pi) / (scale * (limit + 1e-300))
        L[UX + i] = L[STIFF_X + i] * L[SLIP_X + i] * along
        L[UY + i] = L[STIFF_Y + i] * L[SLIP_Y + i] * along
        L[TURN_X + i] = turned * L[ROW_FLATNESS + i]
        L[TURN_Y + i] = turned
        L[SHARE + i] = scale * limit


@kernel
def _sum_strips(cells: int, strips: int, bound: int, L: FloatArray) -> None:
    """Limit the linear forces by friction, by FASTSIM."""
    fastsim(cells, strips, bound, L)
    for i in range(LANES):
        linear = sqrt(L[FX + i] * L[FX + i] + L[FY + i] * L[FY + i])
        L[FX + i] = L[SUM_X + i] * L[SHARE + i]
        L[FY + i] = L[SUM_Y + i] * L[SHARE + i]
        left = sqrt(L[FX + i] * L[FX + i] + L[FY + i] * L[FY + i]) / (linear + 1e-300)
        L[MZ + i] *= min(left, 1.0)


@kernel
def rub(data: FloatArray, plan: IntArray, inclined: bool, L: FloatArray) -> None:
    """Compute the creep forces."""
    creep = data[asm.CREEP]
    if creep == asm.NO_CREEP:
        return
    _stiffen(data[asm.FIRST_SHIFT], data[asm.CELLS_PER_M], data[asm.SPEED], L)
    if data[asm.QUASI_STATIC] != 0.0 and not inclined:
        _turn_along(L)
    friction = data[asm.FRICTION]
    changed = _linear(1.0 if inclined else 0.0, friction, L)
    if creep == asm.CURVE:
        if changed != 0.0:
            _enter_curve(data, plan[asm.AT_SATURATION], L)
        _saturate(L)
    else:
        cells, strips, bound = data[asm.STRIP_CELLS], data[asm.STRIP_COUNT], data[asm.STRIP_BOUND]
        _slide(friction, 1.0 if inclined else 0.0, int(bound), L)
        _sum_strips(int(cells), int(strips), int(bound), L)


@kernel
def push(inclined: bool, deck: int, L: FloatArray, Q: FloatArray) -> None:
    """Add the contact forces to the forces on the bodies."""
    for i in range(LANES):
        if L[SIDES + i] == 0.0 or L[NORMAL + i] == 0.0:
            continue
        at = int(L[asm.BODY * LANES + i]) * LANES
        side = L[SIDES + i]
        arm = L[ARM + i]
        n = L[NORMAL + i]
        fy = L[FY + i]
        fz = n
        if inclined:
            climb = side * L[ROW_G + i]
            fy /= sqrt(1.0 + climb * climb)
            fz += climb * fy
        Q[at + asm.MOTION_X] += L[FX + i]
        Q[at + asm.MOTION_Y] += fy - side * L[ROW_G + i] * n
        Q[at + asm.MOTION_Z] += fz
        # the roll's share of N through u is that of the energy's gradient, R·g; friction acts at the rolling radius
        Q[at + asm.ROLL] += side * (arm * fz - L[RADII + i] * L[ROW_G + i] * n) + L[ROLLING + i] * fy
        Q[at + asm.PITCH] -= L[ROLLING + i] * L[FX + i]
        Q[at + asm.YAW] += L[MZ + i] - side * arm * L[FX + i]
        if deck >= 0:
            Q[deck * LANES + asm.MOTION_Z] -= L[ROW_ON_DECK + i] * fz
