"""FASTSIM: tangential forces of rolling Hertz contacts by Kalker's simplified theory, eight at a time.

In scaled coordinates the ellipse of contact is the unit circle, rolling towards +x. Along each strip of constant y the
traction grows against the rigid slip from the leading edge on, and is cut back to the bound g(x, y):

    p -= (ux - fx·y, uy + fy·x)·dx       p *= g/|p| where |p| > g       sum p·dx·dy

All strips have the same width, at any position of the pole of the slip. Kalker's strips move with the pole. They are
not more exact, because the cells along a strip decide, and they would make the force jump with the slip.

Source: J. J. Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11 (1982).
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.wagon.assembly import LANES
from wheeltapper.march.wagon.wheel_rows import OCTET_ROWS, PX, PY, SUM_X, SUM_Y, TURN_X, TURN_Y, UX, UY

PARABOLIC, ELLIPTIC = 0, 1
SHARE_PARABOLIC, SHARE_ELLIPTIC = 2.0 / np.pi, 1.5 / np.pi
"""Factors by which the sums are multiplied to give forces over the friction limit."""


# Loops that are long enough are not unrolled before they are made vectors of: hence two cells at a time.
@kernel
def _two_cells(
    y: float, x: float, step: float, dx: float, limit: float, next_limit: float, weight: float, next_weight: float,
    L: FloatArray,
) -> None:  # fmt: skip
    """Go over two cells of a strip: the first at x, a `step` from the last place, the second dx behind it."""
    for i in range(LANES):
        slip = L[UX + i] - L[TURN_X + i] * y
        px = L[PX + i] - slip * step
        py = L[PY + i] - (L[UY + i] + L[TURN_Y + i] * (x + 0.5 * step)) * step
        cut = limit / max(sqrt(px * px + py * py), limit)
        px *= cut
        py *= cut
        qx = px - slip * dx
        qy = py - (L[UY + i] + L[TURN_Y + i] * (x - 0.5 * dx)) * dx
        cut = next_limit / max(sqrt(qx * qx + qy * qy), next_limit)
        qx *= cut
        qy *= cut
        L[PX + i] = qx
        L[PY + i] = qy
        L[SUM_X + i] += px * weight + qx * next_weight
        L[SUM_Y + i] += py * weight + qy * next_weight


@kernel
def add_strip(y: float, width: float, cells: int, bound: int, L: FloatArray) -> None:
    """Add the tractions of one strip to SUM_X and SUM_Y."""
    edge = 1.0 - y * y
    half = sqrt(edge)
    dx = 2.0 * half / cells
    for i in range(LANES):
        L[PX + i] = 0.0
        L[PY + i] = 0.0
    for cell in range(0, cells, 2):
        behind = dx if cell + 1 < cells else 0.0
        x = half - (cell + 0.5) * dx
        limit, next_limit = edge - x * x, edge - (x - behind) * (x - behind)
        if bound == ELLIPTIC:
            limit, next_limit = sqrt(limit), sqrt(next_limit)
        step = dx if cell > 0 else 0.5 * dx
        _two_cells(y, x, step, behind, limit, next_limit, dx * width, behind * width, L)


@kernel
def fastsim(cells: int, strips: int, bound: int, L: FloatArray) -> None:
    """Sum the tractions of all lanes from their scaled slips (UX, UY) and spins (TURN_X, TURN_Y) to SUM_X and SUM_Y.

    There are `strips` strips of `cells` cells; `bound`: PARABOLIC or ELLIPTIC over the radius.
    """
    for i in range(LANES):
        L[SUM_X + i] = 0.0
        L[SUM_Y + i] = 0.0
    width = 2.0 / strips
    for strip in range(strips):
        add_strip(-1.0 + (strip + 0.5) * width, width, cells, bound, L)


def saturation(utilisation: FloatArray, parabolic: bool, cells: int, strips: int) -> FloatArray:
    """Return T/(μ·N) along the rail at F/(μ·N), F the linear force, without spin."""
    bound, share = (PARABOLIC, SHARE_PARABOLIC) if parabolic else (ELLIPTIC, SHARE_ELLIPTIC)
    small = 3.0 / 8.0 / share  # of the unit slip the linear sum is 8/3
    out = np.empty(-(-len(utilisation) // LANES) * LANES)
    padded = np.resize(utilisation, out.shape)
    for first in range(0, len(out), LANES):
        held = np.zeros(OCTET_ROWS)
        held[UX : UX + LANES] = small * padded[first : first + LANES]
        fastsim(cells, strips, bound, held)
        out[first : first + LANES] = share * held[SUM_X : SUM_X + LANES]
    return np.abs(out[: len(utilisation)])
