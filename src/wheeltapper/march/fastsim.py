"""FASTSIM: tangential forces of a rolling Hertz contact by Kalker's simplified theory.

In scaled coordinates the ellipse of contact is the unit circle, rolling towards +x. Along each strip of constant y the
traction grows against the rigid slip from the leading edge on, and is cut back to the bound g(x, y):

    strips:   where the pole of the slip (no slip there) lies in the ellipse, they meet on its line y = y0, and the
              strips beside that line are halved until they are narrow enough
    strip:    p -= (ux - fx·y, uy + fy·x)·dx       p *= g/|p| where |p| > g       sum p·dx·dy

Source: J. J. Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11 (1982).
"""

from __future__ import annotations

from math import ceil, sqrt

from wheeltapper.march.kernel import kernel

PARABOLIC, ELLIPTIC = 0, 1


@kernel
def _strip(ux: float, uy: float, fx: float, fy: float, y: float, cells: int, bound: int) -> tuple[float, float]:
    """Return the traction's integral along one strip."""
    edge = 1.0 - y * y
    half = sqrt(edge)
    dx = 2.0 * half / cells
    px = 0.0
    py = 0.0
    sum_x = 0.0
    sum_y = 0.0
    step = 0.5 * dx  # from the edge to the middle of the first cell
    x = half - step
    for _ in range(cells):
        px -= (ux - fx * y) * step
        py -= (uy + fy * (x + 0.5 * step)) * step
        limit = edge - x * x
        if bound == ELLIPTIC:
            limit = sqrt(limit)
        size = sqrt(px * px + py * py)
        if size > limit:
            px *= limit / size
            py *= limit / size
        sum_x += px
        sum_y += py
        step = dx
        x -= dx
    return sum_x * dx, sum_y * dx


@kernel
def _side(
    ux: float, uy: float, fx: float, fy: float, begin: float, end: float, rows: int, cells: int, tolerance: float,
    bound: int,
) -> tuple[float, float]:  # fmt: skip
    """Return the integral between the line y = begin and the edge y = end; strips are narrow beside `begin`."""
    total_x = 0.0
    total_y = 0.0
    width = (end - begin) / rows
    for row in range(1, rows):
        px, py = _strip(ux, uy, fx, fy, begin + (row + 0.5) * width, cells, bound)
        total_x += px * abs(width)
        total_y += py * abs(width)
    while True:
        narrow = 0.5 * abs(width) <= tolerance
        if not narrow:
            width *= 0.5
        px, py = _strip(ux, uy, fx, fy, begin + (0.5 if narrow else 1.5) * width, cells, bound)
        total_x += px * abs(width)
        total_y += py * abs(width)
        if narrow:
            return total_x, total_y


@kernel
def fastsim(
    ux: float, uy: float, fx: float, fy: float, cells: int, rows: int, tolerance: float, bound: int
) -> tuple[float, float]:
    """Return the forces along x and y over the friction limit.

    `ux`, `uy`, `fx`, `fy` are the scaled creepages and spins; a strip has so many `cells`, a diameter so many `rows`.
    Beside the pole strips are at most twice `tolerance` wide. `bound`: PARABOLIC or ELLIPTIC in the radius.
    """
    scale = 2.0 / 3.141592653589793 if bound == PARABOLIC else 1.5 / 3.141592653589793
    pole_y = ux / fx if fx != 0.0 else 2.0
    pole_x = -uy / fy if fy != 0.0 else 2.0
    if pole_x * pole_x + pole_y * pole_y < 1.0:
        below = ceil(0.5 * rows * (1.0 + pole_y))
        above = ceil(0.5 * rows * (1.0 - pole_y))
        ax, ay = _side(ux, uy, fx, fy, pole_y, -1.0, below, cells, tolerance, bound)
        bx, by = _side(ux, uy, fx, fy, pole_y, 1.0, above, cells, tolerance, bound)
        return scale * (ax + bx), scale * (ay + by)
    ax, ay = _side(ux, uy, fx, fy, -1.0, 1.0, rows, cells, 2.0, bound)
    return scale * ax, scale * ay
