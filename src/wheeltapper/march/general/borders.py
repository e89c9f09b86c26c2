"""Borders between the stretches of a law with kinks: parts between events end there, so that forces stay smooth.

The first border is that of yield, at the indentation that the surface bears; the others are those of the law itself, on
the virgin surface's indentation. A surface that has borne some of these goes beyond them as it yields, and back from
there to the elastic stretch.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.plastic_law import border_of, plastic_force
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general import local, paths
from wheeltapper.march.general.crossings import NO_CROSSING, first_crossing
from wheeltapper.march.general.laws.switch import LAW_KIND, PLASTIC
from wheeltapper.march.general.layout import BEGIN
from wheeltapper.march.general.records import Nodes, Room, Site

UP, DOWN, NOWHERE = 1.0, -1.0, 0.0
"""Which border of its stretch a contact leaves by."""
AT_BORDER = 1e-6
"""Static indentations by which the polynomial of a part that begins at a border may miss it."""


@uncounted_kernel
def border_at(direction: float, theta: float, site: Site) -> float:
    """Return the indentation at which a contact leaves its stretch up or down; infinity where it does not."""
    stretch = site.place["stretch"]
    if stretch == 0.0 and direction == DOWN:
        return -np.inf
    left, bears, _ = paths.surface_at(site.pieces, site.place, site.x0, site.stride, site.lift, theta)
    if stretch == (0.0 if direction == UP else 1.0):
        return bears
    border = border_of(stretch + (1.0 if direction == UP else 0.0), site.law, site.table) - left
    return border if direction == UP else max(border, bears)


@uncounted_kernel
def beyond(direction: float, theta: float, q: int, gap: float, site: Site) -> tuple[float, float]:
    """Return by how much a gap D is beyond a border, and the derivative of D by the indentation there."""
    delta = border_at(direction, theta, site)
    if not np.isfinite(delta):
        return -np.inf, 1.0
    left, _, factor = paths.surface_at(site.pieces, site.place, site.x0, site.stride, site.lift, theta)
    if site.place["stretch"] != 0.0:
        factor = 1.0
    force, slope = plastic_force(delta, left, site.place["stretch"], site.law, site.table)
    compliance, _ = local.sum_at(theta, q, site.local)
    compliance *= factor
    return direction * (gap - delta - compliance * force), 1.0 + compliance * slope


@uncounted_kernel
def astray(theta: float, q: int, gap: float, site: Site) -> float:
    """Return the border beyond which a contact is whose part begins with a gap D, or NOWHERE."""
    if site.law[LAW_KIND] != PLASTIC:
        return NOWHERE
    for direction in (UP, DOWN):
        if site.place["joined"] != direction:
            value, _ = beyond(direction, theta, q, gap, site)
            if value > 0.0:
                return direction
    return NOWHERE


@inlined_uncounted_kernel
def _over_border(direction: float, n: int, theta: FloatArray, site: Site, room: Room) -> bool:
    """Write by how much indentations at nodes are beyond a border in F; return False where there is none."""
    for k in range(n):
        delta = border_at(direction, theta[k], site)
        if not np.isfinite(delta):
            return False
        room.F[k] = direction * (room.delta[k] - delta)
    return True


@uncounted_kernel
def leaves(nodes: Nodes, site: Site, room: Room) -> tuple[float, float]:
    """Return where in σ a solved part first leaves its stretch, or NO_CROSSING, and by which border."""
    found, where = NO_CROSSING, NOWHERE
    if site.law[LAW_KIND] != PLASTIC:
        return found, where
    n = len(nodes.places)
    for direction in (UP, DOWN):
        if not _over_border(direction, n, room.theta, site, room):
            continue
        if site.place["joined"] == direction:  # the zero at the start is taken out; behind a jump there is none
            start = 0.0
            for k in range(n):
                start += nodes.bernstein[BEGIN, k] * room.F[k]
            if abs(start) < AT_BORDER:
                for k in range(n):
                    room.F[k] = (room.F[k] - start) / nodes.places[k]
        for k in range(n):
            total = 0.0
            for j in range(n):
                total += nodes.bernstein[k, j] * room.F[j]
            room.bernstein[k] = total
        root = first_crossing(room.bernstein, n - 1, UP, 0.0, room.stack)
        if root != NO_CROSSING and (found == NO_CROSSING or root < found):
            found, where = root, direction
    return found, where


@uncounted_kernel
def near(nodes: Nodes, theta: FloatArray, clearance: float, site: Site, room: Room) -> bool:
    """Return True where a solved part may leave its stretch between nodes: nearer than a share of its range."""
    if site.law[LAW_KIND] != PLASTIC:
        return False
    n = len(nodes.places)
    for direction in (UP, DOWN):
        if not _over_border(direction, n, theta, site, room):
            continue
        least, most = room.F[BEGIN], room.F[BEGIN]
        end = 0.0
        for k in range(n):
            least, most = min(least, room.F[k]), max(most, room.F[k])
            end += nodes.end[k] * room.F[k]
        least, most = min(least, end), max(most, end)
        if most >= clearance * (least - most):
            return True
    return False


@uncounted_kernel
def approach(direction: float, nodes: Nodes, pace: float, site: Site, room: Room) -> tuple[float, float]:
    """Return how fast a solved part goes beyond a border at its end, by θ, and how fast it indents."""
    slope, rate = 0.0, 0.0
    for k in range(len(nodes.places)):
        slope += nodes.end_slope[k] * (room.delta[k] - border_at(direction, room.theta[k], site))
        rate += nodes.end_slope[k] * room.delta[k]
    return direction * slope / pace, rate / pace


@uncounted_kernel
def enter(direction: float, theta: float, site: Site) -> None:
    """Go over to the stretch behind a border; back from what the surface bears it is the elastic one."""
    place = site.place
    after = place["stretch"] + direction
    if direction == DOWN and after > 0.0:
        left, bears, _ = paths.surface_at(site.pieces, place, site.x0, site.stride, site.lift, theta)
        if border_of(after + 1.0, site.law, site.table) - left < bears:
            after = 0.0
    place["stretch"] = after
    place["joined"] = -direction
