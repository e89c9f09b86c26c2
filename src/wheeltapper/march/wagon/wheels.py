"""Eight contacts of wheels and rails at a time: path, geometry, normal force, creep forces.

Side σ is +1 left, -1 right; u, s and the tables count outwards from the track's middle (docs/theory/wagon.rst, section
7.2):

    u  = σ·(y + R·roll)
    δ  = path - rail + h(u) - z - σ·(s(u) - u)·roll     N  = C(u)·δ^1.5
    g  = ∂δ/∂u = h'(u) - σ·(s'(u) - 1)·roll              δ' = path' - rail' + g·u' - z' - σ·(s - u)·roll'

The forces are the gradient of the contact's energy: N along z, -σ·g·N along y, σ·N·(s - u - R·g) about x. On the tread
the slip is that of a contact whose inclination is small; on the flange it lies in the inclined plane of contact.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import HALF, LANES
from wheeltapper.march.wagon.contact_laws import apply_law
from wheeltapper.march.wagon.fastsim import PARABOLIC, SHARE_ELLIPTIC, SHARE_PARABOLIC, fastsim
from wheeltapper.march.wagon.wheel_paths import evaluate_paths, gather_motions

LAST_CELL = asm.SATURATION_CELLS * (1.0 - 1e-15)
"""Largest position in the creep law's curve, in cells, so that a utilisation of one still lies in the last cell."""


@kernel
def _enter_cells(first: float, finer: float, data: FloatArray, cells: int, count: int, L: FloatArray) -> None:
    """Load the geometry's cells in which the lanes are, where they changed; the tables begin at `cells`."""
    last = count - 1.0
    changed = 0.0
    for i in range(LANES):
        # in this order NaN gives 0, not an index
        cell = min(last, max(0.0, np.floor((L[wheel.ROW_U + i] - first) * finer)))
        L[wheel.NEW_CELL + i] = cell
        changed += (cell - L[wheel.CELL + i]) * (cell - L[wheel.CELL + i])
    if changed == 0.0:
        return
    for i in range(LANES):
        if L[wheel.NEW_CELL + i] != L[wheel.CELL + i]:
            L[wheel.CELL + i] = L[wheel.NEW_CELL + i]
            at = cells + int(L[wheel.CELL + i]) * asm.TABLES * asm.TABLE_TERMS
            for j in range(asm.TABLES * asm.TABLE_TERMS):
                L[wheel.CELLS + j * LANES + i] = data[at + j]


@kernel
def _table_value(table: int, i: int, p: float, L: FloatArray) -> float:
    """Return a table's value at the place p in a lane's cell."""
    c = wheel.CELLS + table * asm.TABLE_TERMS * LANES + i
    low = L[c] + p * (L[c + LANES] + p * L[c + 2 * LANES])
    return low + p * p * p * (L[c + 3 * LANES] + p * (L[c + 4 * LANES] + p * L[c + 5 * LANES]))


@kernel
def _table_slope(table: int, i: int, p: float, L: FloatArray) -> float:
    """Return a table's derivative by the place in the cell."""
    c = wheel.CELLS + table * asm.TABLE_TERMS * LANES + i
    low = L[c + LANES] + p * (2.0 * L[c + 2 * LANES] + p * 3.0 * L[c + 3 * LANES])
    return low + p * p * p * (4.0 * L[c + 4 * LANES] + p * 5.0 * L[c + 5 * LANES])


@kernel
def normal_forces(first: float, finer: float, data: FloatArray, cells: int, count: int, L: FloatArray) -> None:
    """Compute the indentation, the normal force, and their rates."""
    for i in range(LANES):
        L[wheel.ROW_U + i] = L[wheel.SIDES + i] * (L[wheel.QY + i] + L[wheel.RADII + i] * L[wheel.QROLL + i])
        L[wheel.U_RATE + i] = L[wheel.SIDES + i] * (L[wheel.VY + i] + L[wheel.RADII + i] * L[wheel.VROLL + i])
    _enter_cells(first, finer, data, cells, count, L)
    for i in range(LANES):
        side = L[wheel.SIDES + i]
        u = L[wheel.ROW_U + i]
        u_rate = L[wheel.U_RATE + i]
        p = (u - first) * finer - L[wheel.CELL + i]
        slope = _table_slope(asm.TABLE_LIFT, i, p, L) * finer
        arm = _table_value(asm.TABLE_PLACE, i, p, L) - u
        g = slope - side * (_table_slope(asm.TABLE_PLACE, i, p, L) * finer - 1.0) * L[wheel.QROLL + i]
        lift = _table_value(asm.TABLE_LIFT, i, p, L)
        height, rises = L[wheel.ROW_PATH + i] - L[wheel.ROW_RAIL + i], L[wheel.PATH_RATE + i] - L[wheel.RAIL_RATE + i]
        delta = height + lift - L[wheel.QZ + i] - side * arm * L[wheel.QROLL + i]
        rate = rises + g * u_rate - L[wheel.VZ + i] - side * arm * L[wheel.VROLL + i]
        root_c = _table_value(asm.ROOT_CONSTANT, i, p, L)
        root_c_rate = _table_slope(asm.ROOT_CONSTANT, i, p, L) * finer * u_rate
        c = root_c * L[wheel.BULGE + i]
        root = sqrt(max(delta, 0.0)) * L[wheel.ON + i]
        n = c * root
        L[wheel.SLOPE + i] = slope
        L[wheel.ARM + i] = arm
        L[wheel.ROW_G + i] = g
        L[wheel.ROW_DELTA + i] = delta
        L[wheel.DELTA_RATE + i] = rate
        L[wheel.ROOT_C + i] = root_c
        L[wheel.ROOT_C_RATE + i] = root_c_rate
        L[wheel.CUBE_ROOT + i] = n
        L[wheel.NORMAL + i] = n * n * n
        growth = root_c_rate * L[wheel.BULGE + i] + root_c * L[wheel.BULGE_RATE + i]
        L[wheel.NORMAL_RATE + i] = 3.0 * n * (n * root * growth + 0.5 * c * c * rate * L[wheel.ON + i])


@kernel
def paths_and_forces(t: float, data: FloatArray, plan: IntArray, kind: int, w: FloatArray, L: FloatArray) -> None:
    """Compute the paths, the indentations and the normal forces."""
    gather_motions(w, L)
    evaluate_paths(t, int(data[asm.DECK]), w, L)
    count = plan[asm.CELLS_EACH]
    cells = plan[asm.AT_CELLS] + kind * count * asm.TABLES * asm.TABLE_TERMS
    normal_forces(data[asm.FIRST_SHIFT], data[asm.CELLS_PER_M], data, cells, count, L)
    if data[asm.CONTACT_LAW] != asm.HERTZIAN:
        apply_law(t, data, L)


@kernel
def _slip_and_stiffness(first: float, finer: float, speed: float, L: FloatArray) -> None:
    """Compute Kalker's coefficients over the speed, and the slip velocities."""
    for i in range(LANES):
        side = L[wheel.SIDES + i]
        p = (L[wheel.ROW_U + i] - first) * finer - L[wheel.CELL + i]
        n = L[wheel.CUBE_ROOT + i]
        square = n * n / speed
        L[wheel.STIFF_X + i] = _table_value(asm.ALONG, i, p, L) * square
        L[wheel.STIFF_Y + i] = _table_value(asm.ACROSS, i, p, L) * square
        L[wheel.STIFF_SPIN + i] = _table_value(asm.SPIN, i, p, L) * square * n
        L[wheel.STIFF_TURN + i] = _table_value(asm.SPIN_MOMENT, i, p, L) * square * n * n
        L[wheel.ROW_FLATNESS + i] = _table_value(asm.SLENDER, i, p, L)
        radius = L[wheel.RADII + i] + _table_value(asm.TABLE_RADIUS, i, p, L)
        spinning = speed / L[wheel.RADII + i]
        L[wheel.ROLLING + i] = radius
        L[wheel.SLIP_X + i] = speed + L[wheel.VX + i] - side * L[wheel.ARM + i] * L[wheel.VYAW + i] - radius * spinning
        L[wheel.SLIP_Y + i] = L[wheel.VY + i] + radius * L[wheel.VROLL + i] - speed * L[wheel.QYAW + i]
        L[wheel.SLIP_TURN + i] = L[wheel.VYAW + i] - side * spinning * L[wheel.SLOPE + i]


@kernel
def _turn_along(L: FloatArray) -> None:
    """Compute the quasi-static spin of the wheelsets: the longitudinal linear forces of both wheels have no moment."""
    for i in range(HALF):
        j = i + HALF
        left = L[wheel.STIFF_X + i] * L[wheel.ROLLING + i]
        right = L[wheel.STIFF_X + j] * L[wheel.ROLLING + j]
        need = left * L[wheel.SLIP_X + i] + right * L[wheel.SLIP_X + j]
        spin = need / max(left * L[wheel.ROLLING + i] + right * L[wheel.ROLLING + j], 1e-300)
        L[wheel.VPITCH + i] = spin
        L[wheel.VPITCH + j] = spin


# Loops that are long enough are not unrolled before they are made vectors of: hence few and long ones below.
@kernel
def _linear_forces(inclined: float, friction: float, L: FloatArray) -> float:
    """Compute the linear forces, in the plane of contact if it is inclined (1), and the utilisation of friction.

    Return zero if all lanes stay in their cells of the creep law's curve.
    """
    changed = 0.0
    for i in range(LANES):
        side = L[wheel.SIDES + i]
        g = L[wheel.ROW_G + i] * inclined
        stretch = sqrt(1.0 + g * g)
        slip_x = L[wheel.SLIP_X + i] - L[wheel.ROLLING + i] * L[wheel.VPITCH + i]
        slip_turn = (L[wheel.SLIP_TURN + i] - side * L[wheel.VPITCH + i] * L[wheel.SLOPE + i]) / stretch
        rise = L[wheel.VZ + i] + side * L[wheel.ARM + i] * L[wheel.VROLL + i]
        slip_y = (L[wheel.SLIP_Y + i] + side * g * rise) / stretch
        fx = -L[wheel.STIFF_X + i] * slip_x
        fy = -L[wheel.STIFF_Y + i] * slip_y - L[wheel.STIFF_SPIN + i] * slip_turn
        force = sqrt(fx * fx + fy * fy)
        share = force / (force + friction * L[wheel.NORMAL + i] * stretch + 1e-300)
        cell = max(0.0, np.floor(share * LAST_CELL))  # 0 for NaN
        L[wheel.SLIP_X + i] = slip_x
        L[wheel.SLIP_Y + i] = slip_y
        L[wheel.SLIP_TURN + i] = slip_turn
        L[wheel.FX + i] = fx
        L[wheel.FY + i] = fy
        L[wheel.MZ + i] = L[wheel.STIFF_SPIN + i] * slip_y - L[wheel.STIFF_TURN + i] * slip_turn
        L[wheel.SHARE + i] = share
        L[wheel.NEW_CELL + i] = cell
        changed += (cell - L[wheel.CURVE_CELL + i]) * (cell - L[wheel.CURVE_CELL + i])
    return changed


@kernel
def _enter_curve(data: FloatArray, saturation: int, L: FloatArray) -> None:
    """Load the curve's cells in which the lanes are, where they changed; the curve begins at `saturation`."""
    for i in range(LANES):
        if L[wheel.NEW_CELL + i] != L[wheel.CURVE_CELL + i]:
            L[wheel.CURVE_CELL + i] = L[wheel.NEW_CELL + i]
            at = saturation + int(L[wheel.CURVE_CELL + i]) * asm.TABLE_TERMS
            for k in range(asm.TABLE_TERMS):
                L[wheel.CURVES + k * LANES + i] = data[at + k]


@kernel
def _limit_by_curve(L: FloatArray) -> None:
    """Limit the linear forces by friction, along the law's curve."""
    for i in range(LANES):
        m = L[wheel.SHARE + i]
        p = m * LAST_CELL - L[wheel.CURVE_CELL + i]
        c = wheel.CURVES + i
        low = L[c] + p * (L[c + LANES] + p * L[c + 2 * LANES])
        high = L[c + 3 * LANES] + p * (L[c + 4 * LANES] + p * L[c + 5 * LANES])
        share = (low + p * p * p * high) * (1.0 - m)
        L[wheel.SHARE + i] = share
        L[wheel.FX + i] *= share
        L[wheel.FY + i] *= share
        L[wheel.MZ + i] *= share


@kernel
def _scale_slips(friction: float, inclined: float, bound: int, L: FloatArray) -> None:
    """Scale the slips for FASTSIM."""
    scale = SHARE_PARABOLIC if bound == PARABOLIC else SHARE_ELLIPTIC
    for i in range(LANES):
        g = L[wheel.ROW_G + i] * inclined
        limit = friction * L[wheel.NORMAL + i] * sqrt(1.0 + g * g)
        along = 3.0 / (8.0 * scale * (limit + 1e-300))
        turned = L[wheel.STIFF_SPIN + i] * L[wheel.SLIP_TURN + i] * (4.0 / np.pi) / (scale * (limit + 1e-300))
        L[wheel.UX + i] = L[wheel.STIFF_X + i] * L[wheel.SLIP_X + i] * along
        L[wheel.UY + i] = L[wheel.STIFF_Y + i] * L[wheel.SLIP_Y + i] * along
        L[wheel.TURN_X + i] = turned * L[wheel.ROW_FLATNESS + i]
        L[wheel.TURN_Y + i] = turned
        L[wheel.SHARE + i] = scale * limit


@kernel
def _sum_strips(cells: int, strips: int, bound: int, L: FloatArray) -> None:
    """Limit the linear forces by friction, by FASTSIM."""
    fastsim(cells, strips, bound, L)
    for i in range(LANES):
        linear = sqrt(L[wheel.FX + i] * L[wheel.FX + i] + L[wheel.FY + i] * L[wheel.FY + i])
        L[wheel.FX + i] = L[wheel.SUM_X + i] * L[wheel.SHARE + i]
        L[wheel.FY + i] = L[wheel.SUM_Y + i] * L[wheel.SHARE + i]
        left = sqrt(L[wheel.FX + i] * L[wheel.FX + i] + L[wheel.FY + i] * L[wheel.FY + i]) / (linear + 1e-300)
        L[wheel.MZ + i] *= min(left, 1.0)


@kernel
def creep_forces(data: FloatArray, plan: IntArray, inclined: bool, L: FloatArray) -> None:
    """Compute the creep forces."""
    creep = data[asm.CREEP]
    if creep == asm.NO_CREEP:
        return
    _slip_and_stiffness(data[asm.FIRST_SHIFT], data[asm.CELLS_PER_M], data[asm.SPEED], L)
    if data[asm.QUASI_STATIC] != 0.0 and not inclined:
        _turn_along(L)
    friction = data[asm.FRICTION]
    changed = _linear_forces(1.0 if inclined else 0.0, friction, L)
    if creep == asm.CURVE:
        if changed != 0.0:
            _enter_curve(data, plan[asm.AT_SATURATION], L)
        _limit_by_curve(L)
    else:
        cells, strips, bound = data[asm.STRIP_CELLS], data[asm.STRIP_COUNT], data[asm.STRIP_BOUND]
        _scale_slips(friction, 1.0 if inclined else 0.0, int(bound), L)
        _sum_strips(int(cells), int(strips), int(bound), L)


@kernel
def add_body_forces(inclined: bool, deck: int, L: FloatArray, Q: FloatArray) -> None:
    """Add the contact forces to the forces on the bodies."""
    for i in range(LANES):
        if L[wheel.SIDES + i] == 0.0 or L[wheel.NORMAL + i] == 0.0:
            continue
        at = int(L[asm.BODY * LANES + i]) * LANES
        side = L[wheel.SIDES + i]
        arm = L[wheel.ARM + i]
        n = L[wheel.NORMAL + i]
        fy = L[wheel.FY + i]
        fz = n
        if inclined:
            climb = side * L[wheel.ROW_G + i]
            fy /= sqrt(1.0 + climb * climb)
            fz += climb * fy
        Q[at + asm.MOTION_X] += L[wheel.FX + i]
        Q[at + asm.MOTION_Y] += fy - side * L[wheel.ROW_G + i] * n
        Q[at + asm.MOTION_Z] += fz
        # the roll's share of N through u is that of the energy's gradient, R·g; friction acts at the rolling radius
        Q[at + asm.ROLL] += side * (arm * fz - L[wheel.RADII + i] * L[wheel.ROW_G + i] * n) + L[wheel.ROLLING + i] * fy
        Q[at + asm.PITCH] -= L[wheel.ROLLING + i] * L[wheel.FX + i]
        Q[at + asm.YAW] += L[wheel.MZ + i] - side * arm * L[wheel.FX + i]
        if deck >= 0:
            Q[deck * LANES + asm.MOTION_Z] -= L[wheel.ROW_ON_DECK + i] * fz
