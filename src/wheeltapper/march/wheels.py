"""Eight contacts of wheels and rails at a time: path, geometry, normal force, creep forces.

Side σ is +1 left, -1 right; u, s and the tables count outwards from the track's middle (the project's coach reference,
section 2):

    u  = σ·(y + R·roll)
    δ  = path + h(u) - z - σ·(s(u) - u)·roll            N  = C(u)·δ^1.5
    g  = ∂δ/∂u = h'(u) - σ·(s'(u) - 1)·roll              δ' = path' + g·u' - z' - σ·(s - u)·roll'

The forces are the gradient of the contact's energy: N along z, -σ·g·N along y, σ·N·(s - u - R·g) about x. On the tread
the slip is that of a contact whose inclination is small; on the flange it lies in the inclined plane of contact.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march import assembly as contract
from wheeltapper.march.assembly import (
    ACROSS,
    ALONG,
    HALF,
    LANE_COLUMNS,
    LANES,
    LIFT,
    PLACE,
    RADIUS,
    RATE,
    ROOT_CONSTANT,
    SATURATION_CELLS,
    SLENDER,
    SPIN,
    SPIN_MOMENT,
    TABLES,
    TERMS,
    Assembly,
)
from wheeltapper.march.assembly import DEGREE as DEGREE_OF_CELLS
from wheeltapper.march.fastsim import fastsim
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import (
    CENTRE,
    COEFFICIENT,
    COSINE,
    DEGREE,
    FACTOR,
    FACTOR_DEGREE,
    MAX_DEGREE,
    SCALE,
    SINE,
    STOP,
    WAVENUMBER,
    FloatArray,
)

TOLERANCE_OF_STRIPS = 1e-3

# Rows of an octet's scratch, LANES entries each: first what the contract tells once, then what is set between steps.
_ROWS = iter(range(LANE_COLUMNS * LANES, 400 * LANES, LANES))


def _rows(count: int) -> tuple[int, ...]:
    return tuple(next(_ROWS) for _ in range(count))


SIDES, RADII = contract.SIDE * LANES, contract.NOMINAL * LANES
(ON, PIECE, SHIFT, UNTIL, ON_DECK, CELL) = _rows(6)
"""Whether the contact may carry; piece and shift of the path, and when the piece ends; whether the wheel is on the
deck; the cell of the geometry's tables."""
(CENTRE_TIME, PACE, WAVE_SINE, WAVE_COSINE, OMEGA) = _rows(5)
(POLY, *_) = _rows(MAX_DEGREE + 1)
(FACTORS, *_) = _rows(MAX_DEGREE + 1)
"""The present piece over time: polynomials of (t - CENTRE_TIME)·PACE, and a wave."""
(CELLS, *_) = _rows(TABLES * TERMS)
(QY, QZ, QROLL, QYAW, VX, VY, VZ, VROLL, VPITCH, VYAW) = _rows(10)
(PATH, PATH_RATE, BULGE, BULGE_RATE) = _rows(4)
"""Height and velocity of the path, and the factor on C^(1/3)."""
(U, U_RATE, G, SLOPE, ARM, ROLLING, DELTA, DELTA_RATE) = _rows(8)
(NORMAL, NORMAL_RATE, CUBE_ROOT) = _rows(3)
"""Normal force N (its component along z), its rate, and N^(1/3)."""
(STIFF_X, STIFF_Y, STIFF_SPIN, STIFF_TURN, FLAT) = _rows(5)
"""Kalker's coefficients at this force, and b/a."""
(SLIP_X, SLIP_Y, SLIP_TURN, FX, FY, MZ, SHARE) = _rows(7)
"""Slip velocities, creep forces and moment, and the share of the linear resultant that remains."""
FLAGS = next(_ROWS)
DEGREE_FLAG, WAVE_FLAG, FACTOR_FLAG, AWAKE = range(FLAGS, FLAGS + 4)
"""Degree of the octet's polynomials, whether any lane has a wave or a factor, and whether it has to be computed."""
ROWS = int(next(_ROWS))
GATHERED = (
    (QY, contract.Y), (QZ, contract.Z), (QROLL, contract.ROLL), (QYAW, contract.YAW), (VX, RATE + contract.X),
    (VY, RATE + contract.Y), (VZ, RATE + contract.Z), (VROLL, RATE + contract.ROLL), (VPITCH, RATE + contract.PITCH),
    (VYAW, RATE + contract.YAW),
)  # fmt: skip


@kernel
def set_piece(lane: int, A: Assembly, L: FloatArray) -> None:
    """Write the present piece of a lane's path as functions of time."""
    row = A.pieces[int(L[PIECE + lane])]
    speed = A.numbers[contract.SPEED]
    L[UNTIL + lane] = np.inf
    L[CENTRE_TIME + lane] = 0.0
    if speed > 0.0:
        L[UNTIL + lane] = (row[STOP] + L[SHIFT + lane]) / speed
        L[CENTRE_TIME + lane] = (row[CENTRE] + L[SHIFT + lane]) / speed
    L[PACE + lane] = speed / row[SCALE]
    for k in range(MAX_DEGREE + 1):
        L[POLY + k * LANES + lane] = row[COEFFICIENT + k] if k <= row[DEGREE] else 0.0
        L[FACTORS + k * LANES + lane] = row[FACTOR + k] if k <= row[FACTOR_DEGREE] else 0.0
    if row[FACTOR_DEGREE] < 0.0:
        L[FACTORS + lane] = 1.0
    L[WAVE_SINE + lane] = row[SINE]
    L[WAVE_COSINE + lane] = row[COSINE]
    L[OMEGA + lane] = row[WAVENUMBER] * speed
    L[DEGREE_FLAG] = 0.0
    L[WAVE_FLAG] = 0.0
    L[FACTOR_FLAG] = 0.0
    for i in range(LANES):
        if L[SIDES + i] != 0.0:
            other = A.pieces[int(L[PIECE + i])]
            L[DEGREE_FLAG] = max(L[DEGREE_FLAG], other[DEGREE])
            if other[SINE] != 0.0 or other[COSINE] != 0.0:
                L[WAVE_FLAG] = 1.0
            if other[FACTOR_DEGREE] >= 0.0:
                L[FACTOR_FLAG] = 1.0


@kernel
def gather(w: FloatArray, L: FloatArray) -> None:
    """Copy the motion of the wheelsets into the lanes."""
    for i in range(HALF):
        at = int(L[contract.BODY * LANES + i]) * contract.PLACES
        for row, place in GATHERED:
            L[row + i] = w[at + place]
            L[row + HALF + i] = w[at + place]


@kernel
def follow(t: float, deck: int, w: FloatArray, L: FloatArray) -> None:
    """Evaluate the paths at a time: height, velocity, and the factor on C^(1/3)."""
    for i in range(LANES):
        L[PATH + i] = L[POLY + i]
        L[PATH_RATE + i] = 0.0
        L[BULGE + i] = 1.0
        L[BULGE_RATE + i] = 0.0
    if L[DEGREE_FLAG] > 0.0:
        _powers(t, POLY, PATH, PATH_RATE, L)
    if L[FACTOR_FLAG] > 0.0:
        _powers(t, FACTORS, BULGE, BULGE_RATE, L)
    if L[WAVE_FLAG] > 0.0:
        for i in range(LANES):
            if L[WAVE_SINE + i] != 0.0 or L[WAVE_COSINE + i] != 0.0:
                phase = L[OMEGA + i] * (t - L[CENTRE_TIME + i])
                sine = np.sin(phase)
                cosine = np.cos(phase)
                L[PATH + i] += L[WAVE_SINE + i] * sine + L[WAVE_COSINE + i] * cosine
                L[PATH_RATE + i] += L[OMEGA + i] * (L[WAVE_SINE + i] * cosine - L[WAVE_COSINE + i] * sine)
    if deck >= 0:
        at = deck * contract.PLACES + contract.Z
        for i in range(LANES):
            L[PATH + i] += L[ON_DECK + i] * w[at]
            L[PATH_RATE + i] += L[ON_DECK + i] * w[at + RATE]


@kernel
def _powers(t: float, source: int, value: int, rate: int, L: FloatArray) -> None:
    """Evaluate the lanes' polynomials over time, and their rates."""
    for i in range(LANES):
        place = (t - L[CENTRE_TIME + i]) * L[PACE + i]
        total = 0.0
        slope = 0.0
        for k in range(MAX_DEGREE, -1, -1):
            slope = slope * place + total
            total = total * place + L[source + k * LANES + i]
        L[value + i] = total
        L[rate + i] = slope * L[PACE + i]


@kernel
def _enter_cells(first: float, finer: float, table: FloatArray, L: FloatArray) -> None:
    """Load the geometry's cells in which the lanes are, where they changed."""
    last = table.shape[0] - 1
    for i in range(LANES):
        cell = min(max(np.floor((L[U + i] - first) * finer), 0.0), last)
        if cell != L[CELL + i]:
            L[CELL + i] = cell
            held = table[int(cell)]
            for j in range(TABLES):
                for k in range(TERMS):
                    L[CELLS + (j * TERMS + k) * LANES + i] = held[j, k]


@kernel
def _value(table: int, i: int, p: float, L: FloatArray) -> float:
    """Return a table's value at the place p in a lane's cell."""
    c = CELLS + table * TERMS * LANES + i
    low = L[c] + p * (L[c + LANES] + p * L[c + 2 * LANES])
    return low + p * p * p * (L[c + 3 * LANES] + p * (L[c + 4 * LANES] + p * L[c + 5 * LANES]))


@kernel
def _slope(table: int, i: int, p: float, L: FloatArray) -> float:
    """Return a table's derivative by the place in the cell."""
    c = CELLS + table * TERMS * LANES + i
    low = L[c + LANES] + p * (2.0 * L[c + 2 * LANES] + p * 3.0 * L[c + 3 * LANES])
    return low + p * p * p * (4.0 * L[c + 4 * LANES] + p * 5.0 * L[c + 5 * LANES])


@kernel
def approach(first: float, finer: float, table: FloatArray, L: FloatArray) -> None:
    """Compute the indentation, the normal force, and their rates."""
    for i in range(LANES):
        L[U + i] = L[SIDES + i] * (L[QY + i] + L[RADII + i] * L[QROLL + i])
        L[U_RATE + i] = L[SIDES + i] * (L[VY + i] + L[RADII + i] * L[VROLL + i])
    _enter_cells(first, finer, table, L)
    for i in range(LANES):
        side = L[SIDES + i]
        u = L[U + i]
        u_rate = L[U_RATE + i]
        p = (u - first) * finer - L[CELL + i]
        slope = _slope(LIFT, i, p, L) * finer
        arm = _value(PLACE, i, p, L) - u
        g = slope - side * (_slope(PLACE, i, p, L) * finer - 1.0) * L[QROLL + i]
        delta = L[PATH + i] + _value(LIFT, i, p, L) - L[QZ + i] - side * arm * L[QROLL + i]
        rate = L[PATH_RATE + i] + g * u_rate - L[VZ + i] - side * arm * L[VROLL + i]
        root_c = _value(ROOT_CONSTANT, i, p, L)
        root_c_rate = _slope(ROOT_CONSTANT, i, p, L) * finer * u_rate
        c = root_c * L[BULGE + i]
        root = sqrt(max(delta, 0.0)) * L[ON + i]
        n = c * root
        L[SLOPE + i] = slope
        L[ARM + i] = arm
        L[G + i] = g
        L[DELTA + i] = delta
        L[DELTA_RATE + i] = rate
        L[CUBE_ROOT + i] = n
        L[NORMAL + i] = n * n * n
        growth = root_c_rate * L[BULGE + i] + root_c * L[BULGE_RATE + i]
        L[NORMAL_RATE + i] = 3.0 * n * (n * root * growth + 0.5 * c * c * rate * L[ON + i])


@kernel
def _stiffen(first: float, finer: float, speed: float, L: FloatArray) -> None:
    """Compute Kalker's coefficients over the speed, and the slip velocities."""
    for i in range(LANES):
        side = L[SIDES + i]
        p = (L[U + i] - first) * finer - L[CELL + i]
        n = L[CUBE_ROOT + i]
        square = n * n / speed
        L[STIFF_X + i] = _value(ALONG, i, p, L) * square
        L[STIFF_Y + i] = _value(ACROSS, i, p, L) * square
        L[STIFF_SPIN + i] = _value(SPIN, i, p, L) * square * n
        L[STIFF_TURN + i] = _value(SPIN_MOMENT, i, p, L) * square * n * n
        L[FLAT + i] = _value(SLENDER, i, p, L)
        radius = _value(RADIUS, i, p, L)
        spinning = speed / L[RADII + i]
        L[ROLLING + i] = radius
        L[SLIP_X + i] = speed + L[VX + i] - side * L[ARM + i] * L[VYAW + i] - radius * spinning
        L[SLIP_Y + i] = L[VY + i] + radius * L[VROLL + i] - speed * L[QYAW + i]
        L[SLIP_TURN + i] = L[VYAW + i] - side * spinning * L[SLOPE + i]


@kernel
def _turn_along(L: FloatArray) -> None:
    """Let the wheelsets' spin follow at once: the longitudinal linear forces of both wheels have no moment."""
    for i in range(HALF):
        j = i + HALF
        left = L[STIFF_X + i] * L[ROLLING + i]
        right = L[STIFF_X + j] * L[ROLLING + j]
        need = left * L[SLIP_X + i] + right * L[SLIP_X + j]
        spin = need / max(left * L[ROLLING + i] + right * L[ROLLING + j], 1e-300)
        L[VPITCH + i] = spin
        L[VPITCH + j] = spin


@kernel
def _incline(inclined: bool, L: FloatArray) -> None:
    """Turn the slip into the plane of contact, if it is inclined, and compute the linear forces."""
    for i in range(LANES):
        L[SLIP_X + i] -= L[ROLLING + i] * L[VPITCH + i]
        L[SLIP_TURN + i] -= L[SIDES + i] * L[VPITCH + i] * L[SLOPE + i]
        if inclined:
            climb = L[SIDES + i] * L[G + i]
            rise = L[VZ + i] + L[SIDES + i] * L[ARM + i] * L[VROLL + i]
            L[SLIP_Y + i] = (L[SLIP_Y + i] + climb * rise) / sqrt(1.0 + climb * climb)
        slip_x = L[SLIP_X + i]
        slip_y = L[SLIP_Y + i]
        slip_turn = L[SLIP_TURN + i]
        L[FX + i] = -L[STIFF_X + i] * slip_x
        L[FY + i] = -L[STIFF_Y + i] * slip_y - L[STIFF_SPIN + i] * slip_turn
        L[MZ + i] = L[STIFF_SPIN + i] * slip_y - L[STIFF_TURN + i] * slip_turn


@kernel
def _saturate(friction: float, inclined: bool, saturation: FloatArray, L: FloatArray) -> None:
    """Limit the linear forces by friction, along the law's curve."""
    for i in range(LANES):
        force = sqrt(L[FX + i] * L[FX + i] + L[FY + i] * L[FY + i])
        limit = friction * L[NORMAL + i]
        if inclined:
            limit *= sqrt(1.0 + L[G + i] * L[G + i])
        whole = force + limit
        L[SHARE + i] = force / max(whole, 1e-300)
    for i in range(LANES):
        m = L[SHARE + i]
        cell = int(min(m * SATURATION_CELLS, SATURATION_CELLS - 1.0))
        p = m * SATURATION_CELLS - cell
        value = 0.0
        for k in range(DEGREE_OF_CELLS, -1, -1):
            value = value * p + saturation[cell, k]
        L[SHARE + i] = value * (1.0 - m)
    for i in range(LANES):
        L[FX + i] *= L[SHARE + i]
        L[FY + i] *= L[SHARE + i]
        L[MZ + i] *= L[SHARE + i]


@kernel
def _strip(friction: float, inclined: bool, cells: int, rows: int, bound: int, L: FloatArray) -> None:
    """Limit the linear forces by friction, by FASTSIM."""
    scale = 2.0 / np.pi if bound == 0 else 1.5 / np.pi
    for i in range(LANES):
        limit = friction * L[NORMAL + i]
        if inclined:
            limit *= sqrt(1.0 + L[G + i] * L[G + i])
        if limit <= 0.0:
            continue
        along = 1.0 / (scale * 8.0 / 3.0 * limit)
        turned = L[STIFF_SPIN + i] * L[SLIP_TURN + i] / (scale * np.pi / 4.0 * limit)
        ux = L[STIFF_X + i] * L[SLIP_X + i] * along
        uy = L[STIFF_Y + i] * L[SLIP_Y + i] * along
        linear = sqrt(L[FX + i] * L[FX + i] + L[FY + i] * L[FY + i])
        px, py = fastsim(ux, uy, turned * L[FLAT + i], turned, cells, rows, TOLERANCE_OF_STRIPS, bound)
        L[FX + i] = px * limit
        L[FY + i] = py * limit
        L[MZ + i] *= min(sqrt(px * px + py * py) * limit / max(linear, 1e-300), 1.0)


@kernel
def rub(A: Assembly, inclined: bool, L: FloatArray) -> None:
    """Compute the creep forces."""
    creep = A.numbers[contract.CREEP]
    if creep == contract.NO_CREEP:
        return
    first = A.numbers[contract.FIRST_SHIFT]
    _stiffen(first, A.numbers[contract.CELLS_PER_M], A.numbers[contract.SPEED], L)
    if A.numbers[contract.QUASI_STATIC] != 0.0 and not inclined:
        _turn_along(L)
    _incline(inclined, L)
    friction = A.numbers[contract.FRICTION]
    if creep == contract.CURVE:
        _saturate(friction, inclined, A.saturation, L)
    else:
        numbers = A.numbers
        cells, rows, bound = numbers[contract.STRIP_CELLS], numbers[contract.STRIP_ROWS], numbers[contract.STRIP_BOUND]
        _strip(friction, inclined, int(cells), int(rows), int(bound), L)


@kernel
def push(inclined: bool, deck: int, L: FloatArray, Q: FloatArray) -> None:
    """Add the contact forces to the forces on the bodies."""
    for i in range(LANES):
        if L[SIDES + i] == 0.0 or L[NORMAL + i] == 0.0:
            continue
        at = int(L[contract.BODY * LANES + i]) * LANES
        side = L[SIDES + i]
        arm = L[ARM + i]
        n = L[NORMAL + i]
        fy = L[FY + i]
        fz = n
        if inclined:
            climb = side * L[G + i]
            fy /= sqrt(1.0 + climb * climb)
            fz += climb * fy
        Q[at + contract.X] += L[FX + i]
        Q[at + contract.Y] += fy - side * L[G + i] * n
        Q[at + contract.Z] += fz
        # the roll's share of N through u is that of the energy's gradient, R·g; friction acts at the rolling radius
        Q[at + contract.ROLL] += side * (arm * fz - L[RADII + i] * L[G + i] * n) + L[ROLLING + i] * fy
        Q[at + contract.PITCH] -= L[ROLLING + i] * L[FX + i]
        Q[at + contract.YAW] += L[MZ + i] - side * arm * L[FX + i]
        if deck >= 0:
            Q[deck * LANES + contract.Z] -= L[ON_DECK + i] * fz
