"""FASTSIM: tangential forces of rolling Hertz contacts by Kalker's simplified theory, eight at a time.

In scaled coordinates the ellipse of contact is the unit circle, rolling towards +x. Along each strip of constant y the
traction grows against the rigid slip from the leading edge on, and is cut back to the bound g(x, y):

    strips:   where the pole of the slip (no slip there) lies in the ellipse, they meet on its line y = y0, and the
              strips beside that line are halved until they are narrow enough
    strip:    p -= (ux - fx·y, uy + fy·x)·dx       p *= g/|p| where |p| > g       sum p·dx·dy

Source: J. J. Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11 (1982).
"""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np

from wheeltapper.march.assembly import LANES
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray
from wheeltapper.march.wheel_rows import (
    ACROSS_AT,
    LEFT,
    POLE,
    PX,
    PY,
    SIDES_LEFT,
    STRIP,
    SUM_X,
    SUM_Y,
    TURN_X,
    TURN_Y,
    UX,
    UY,
    WIDE,
)

PARABOLIC, ELLIPTIC = 0, 1
SHARE_PARABOLIC, SHARE_ELLIPTIC = 2.0 / np.pi, 1.5 / np.pi
"""What the sums are to be multiplied with for forces over the friction limit."""


@kernel
def _divide(L: FloatArray) -> None:
    """Let the strips begin at the pole of the slip, on two sides of it, or at the edge where it is outside."""
    for i in range(LANES):
        pole_y = L[UX + i] / L[TURN_X + i] if L[TURN_X + i] != 0.0 else 2.0
        pole_x = -L[UY + i] / L[TURN_Y + i] if L[TURN_Y + i] != 0.0 else 2.0
        is_inside = pole_x * pole_x + pole_y * pole_y < 1.0
        L[POLE + i] = pole_y if is_inside else -1.0
        L[SIDES_LEFT + i] = 2.0 if is_inside else 1.0
        L[LEFT + i] = 0.0
        L[SUM_X + i] = 0.0
        L[SUM_Y + i] = 0.0


@kernel
def _next_strip(rows: int, tolerance: float, L: FloatArray) -> bool:
    """Enter each lane's next strip, of width zero where it has none left; return True while any has one."""
    found = False
    for i in range(LANES):
        pole = L[POLE + i]
        halves = pole > -1.0
        if L[LEFT + i] == 0.0 and L[SIDES_LEFT + i] > 0.0:
            end = 1.0 if L[SIDES_LEFT + i] == 1.0 else -1.0
            L[SIDES_LEFT + i] -= 1.0
            L[LEFT + i] = ceil(0.5 * rows * abs(end - pole))
            L[STRIP + i] = (end - pole) / L[LEFT + i]
        left = L[LEFT + i]
        L[WIDE + i] = 0.0
        L[ACROSS_AT + i] = 0.0
        if left == 0.0:
            continue
        found = True
        middle = left - 0.5
        if left > 1.0:
            L[LEFT + i] = left - 1.0
        elif halves and 0.5 * abs(L[STRIP + i]) > tolerance:
            L[STRIP + i] *= 0.5
            middle = 1.5
        else:
            L[LEFT + i] = 0.0
        L[ACROSS_AT + i] = pole + middle * L[STRIP + i]
        L[WIDE + i] = abs(L[STRIP + i])
    return found


# Loops that are long enough are not unrolled before they are made vectors of: hence two cells at a time.
@kernel
def _two_cells(cell: int, cells: int, bound: int, L: FloatArray) -> None:
    """Go over two cells of the present strips; beyond an odd number of cells the second one has no length."""
    first = 0.5 if cell == 0 else 1.0
    second = 1.0 if cell + 1 < cells else 0.0
    elliptic = bound != PARABOLIC
    for i in range(LANES):
        y = L[ACROSS_AT + i]
        edge = 1.0 - y * y
        half = sqrt(edge)
        dx = 2.0 * half / cells
        x = half - (cell + 0.5) * dx
        ahead = x - dx * second
        limit = edge - x * x
        next_limit = edge - ahead * ahead
        limit = sqrt(limit) if elliptic else limit
        next_limit = sqrt(next_limit) if elliptic else next_limit
        slip = L[UX + i] - L[TURN_X + i] * y
        step = first * dx
        px = L[PX + i] - slip * step
        py = L[PY + i] - (L[UY + i] + L[TURN_Y + i] * (x + 0.5 * step)) * step
        cut = limit / max(sqrt(px * px + py * py), limit)
        px *= cut
        py *= cut
        step = second * dx
        qx = px - slip * step
        qy = py - (L[UY + i] + L[TURN_Y + i] * (ahead + 0.5 * step)) * step
        cut = next_limit / max(sqrt(qx * qx + qy * qy), next_limit)
        qx *= cut
        qy *= cut
        L[PX + i] = qx
        L[PY + i] = qy
        weight = dx * L[WIDE + i]
        L[SUM_X + i] += (px + second * qx) * weight
        L[SUM_Y + i] += (py + second * qy) * weight


@kernel
def fastsim(cells: int, rows: int, tolerance: float, bound: int, L: FloatArray) -> None:
    """Sum the tractions of all lanes from their scaled slips (UX, UY) and spins (TURN_X, TURN_Y) to SUM_X and SUM_Y.

    A strip has so many `cells`, a diameter so many `rows`. Beside the pole strips are at most twice `tolerance` wide.
    `bound`: PARABOLIC or ELLIPTIC in the radius.
    """
    _divide(L)
    while _next_strip(rows, tolerance, L):
        for i in range(LANES):
            L[PX + i] = 0.0
            L[PY + i] = 0.0
        for cell in range(0, cells, 2):
            _two_cells(cell, cells, bound, L)
