"""A macro step of an element between bodies whose force goes from one straight stretch to another.

    while the macro step has not ended:
        solve to the end in the present stretch
            forces not resolved: half as far
            what the stretch ends by comes to one of its ends: find where, and go over to the next stretch

Dry friction sticks until its displacement from the anchor comes to F/k, and slides until the rate falls through zero;
a spring or a damper with corners is in one stretch until its displacement, or its rate, comes to a corner.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Row, Rows
from wheeltapper.march.general import careful, layout, local
from wheeltapper.march.general.algebra import copy
from wheeltapper.march.general.crossings import NO_CROSSING
from wheeltapper.march.general.laws.corners import corner_at
from wheeltapper.march.general.laws.slider import JENKINS_FORCE, JENKINS_STIFFNESS, STUCK
from wheeltapper.march.general.laws.switch import CORNERED_DAMPER, LAW_KIND, LAW_RATED, SLIDER
from wheeltapper.march.general.layout import BEGIN, EVENLY
from wheeltapper.march.general.play import PLACE_ROUNDING, TURN_STAGNANT
from wheeltapper.march.general.records import Nodes, Room, Site

UP, DOWN, NOWHERE = 1.0, -1.0, 0.0
"""The end by which a stretch is left."""
PAST_END = 1e-12
"""How far beyond its end, in static indentations, a stretch may be followed: rounding."""


@uncounted_kernel
def _end_at(direction: float, site: Site) -> float:
    """Return where the present stretch ends up or down; infinity where it does not."""
    law, stretch = site.law, site.place["stretch"]
    if law[LAW_KIND] == SLIDER:
        if stretch == STUCK:
            return direction * law[JENKINS_FORCE] / law[JENKINS_STIFFNESS]
        return 0.0 if direction == -stretch else direction * np.inf
    return corner_at(stretch + (1.0 if direction == UP else 0.0), law, site.table)


@inlined_uncounted_kernel
def _by_rate(site: Site) -> bool:
    """Return whether the present stretch ends by the rate, and not by the displacement."""
    if site.law[LAW_KIND] == SLIDER:
        return site.place["stretch"] != STUCK
    return site.law[LAW_KIND] == CORNERED_DAMPER


@inlined_uncounted_kernel
def _anchor(site: Site) -> float:
    """Return from where the law's displacement counts."""
    return site.place["stop"] if site.law[LAW_KIND] == SLIDER else 0.0


@uncounted_kernel
def _beyond(direction: float, theta: float, q: int, gap: FloatArray, site: Site) -> float:
    """Return how far the present stretch is beyond its end at θ, where the displacement has these coefficients.

    Its rate is that at fixed moments, since forces do not move masses at once.
    """
    value, slope = local.gap_at(theta, q, gap, site)
    if _by_rate(site):
        return direction * (slope / site.seconds - _end_at(direction, site))
    return direction * (value - _anchor(site) - _end_at(direction, site))


@uncounted_kernel
def _leaves(nodes: Nodes, site: Site, room: Room) -> tuple[float, float]:
    """Return where in σ a solved part first leaves its stretch, or NO_CROSSING, and by which end."""
    n = len(nodes.places)
    found, where = NO_CROSSING, NOWHERE
    by_rate = _by_rate(site)
    for direction in (UP, DOWN):
        end = _end_at(direction, site)
        if not np.isfinite(end):
            continue
        for k in range(n):
            u = room.rate[k] if by_rate else room.delta[k]
            room.F[k] = direction * (u - end) - PAST_END
        root = careful.crossing(n, nodes.bernstein, room.F, 1.0, room)
        if room.bernstein[BEGIN] > 0.0 and room.bernstein[BEGIN + 1] > room.bernstein[BEGIN]:
            root = 0.0
        if root != NO_CROSSING and (found == NO_CROSSING or root < found):
            found, where = root, direction
    return found, where


@uncounted_kernel
def _solve(theta: float, to: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room) -> tuple[bool, bool]:  # fmt: skip  # noqa: E501
    """Solve from θ to a place in the present stretch, with rates; return whether that is done, and well resolved."""
    anchor = _anchor(site)
    room.free[BEGIN] -= anchor
    site.place["began"], _ = local.gap_at(theta, q, room.free, site)
    solved = local.solve_part(
        nodes, q, EVENLY, theta, to - theta, 0.0, 1.0, bool(careful.NO), settings["newton_limit"], site, room
    )
    room.free[BEGIN] += anchor
    if not solved:
        return solved, solved
    local.rates(len(nodes.places), nodes.own_slopes, 0.0, site.seconds, room)
    limit = settings["tail_limit"]
    if site.law[LAW_RATED] != 0.0:
        limit += PLACE_ROUNDING * abs(room.viscous[BEGIN]) / ((to - theta) * site.seconds)
    return not bool(careful.NO), local.tail_of(nodes, room.N) <= limit


@uncounted_kernel
def _find_end(theta: float, guess: float, direction: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room) -> tuple[int, float, float]:  # fmt: skip  # noqa: E501
    """Find where a stretch is left, near a guess; return an outcome, where its part ends, and the event itself.

    Moments at the part's end are in `room.after`.
    """
    n = len(nodes.places)
    by_rate = _by_rate(site)
    before = np.inf
    begun = _beyond(direction, theta, q, room.free, site)
    at = guess
    for _ in range(12):
        if at <= theta + careful.SNAP:
            return careful.TOO_LATE, theta, theta
        solved, resolved = _solve(theta, at, nodes, q, settings, site, room)
        if not solved:
            return careful.FAILED, at, at
        local.free_sum(q, site.c, site.B, room.after, room.spare)
        value = _beyond(direction, at, q, room.spare, site)
        slope = 0.0
        for k in range(n):
            slope += nodes.end_slope[k] * direction * (room.rate[k] if by_rate else room.delta[k]) / (at - theta)
        if slope <= 0.0:  # of a rate in a short part that is rounding
            slope = (value - begun) / (at - theta)
        if slope <= 0.0:
            return careful.FAILED, at, at
        away = -value / slope
        if (
            abs(away) < settings["loss_limit"]
            or 0.5 * before <= abs(away) < TURN_STAGNANT
            or (at == 1.0 and before == 0.0)
        ):
            return careful.FOUND if resolved else careful.FAILED, at, min(at + away, 1.0)
        before = abs(away)
        if at == 1.0 and away > 0.0:  # just behind the macro step
            before = 0.0
        at = min(at + min(max(away, 0.5 * (theta - at)), at - theta), 1.0)
    return careful.FAILED, at, at


@uncounted_kernel
def _go_over(step: int, i: int, at: float, event: float, direction: float, q: int, site: Site, room: Room, events: Rows, counts: IntArray) -> None:  # fmt: skip  # noqa: E501
    """Enter the stretch behind an end, where the moments are those in `room.after`, and log the event."""
    place, law = site.place, site.law
    local.free_sum(q, site.c, site.B, room.after, room.spare)
    value, slope = local.gap_at(at, q, room.spare, site)
    stretch = place["stretch"]
    outwards = direction * _end_at(direction, site) > 0.0
    if law[LAW_KIND] != SLIDER:
        place["stretch"] = stretch + direction
    elif stretch == STUCK:
        place["stretch"] = direction
    else:
        place["stop"] = value - stretch * law[JENKINS_FORCE] / law[JENKINS_STIFFNESS]
        place["stretch"] = STUCK
    kind = contract.IMPACT if outwards else contract.LOSS
    careful.log_event(step, i, event, kind, slope / site.seconds, events, counts)


@uncounted_kernel
def _go_on(step: int, i: int, theta: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray) -> tuple[int, float]:  # fmt: skip  # noqa: E501
    """Go on from θ, to the macro step's end or to the end of the stretch; return a status and where.

    Moments there are in `room.after`.
    """
    n = len(nodes.places)
    length = 1.0 - theta
    while length > careful.SHORTEST:
        to = 1.0 if length == 1.0 - theta else theta + length
        solved, resolved = _solve(theta, to, nodes, q, settings, site, room)
        if not solved:
            length *= 0.5
            continue
        root, direction = _leaves(nodes, site, room)
        event = to
        if root != NO_CROSSING:
            outcome, to, event = _find_end(
                theta, theta + (to - theta) * root, direction, nodes, q, settings, site, room
            )  # fmt: skip
            if outcome == careful.TOO_LATE:
                copy(room.moments[:q], room.after)
            resolved = outcome != careful.FAILED
        if not resolved:
            length = 0.5 * min(length, to - theta)
            continue
        if to > theta:
            careful.log_row(step, i, theta, to, EVENLY, theta, to - theta, 0.0, 1.0, n, room.N, rows, counts)
        if root != NO_CROSSING:
            _go_over(step, i, to, event, direction, q, site, room, events, counts)
        return contract.RUNNING, to
    return layout.UNSOLVED, theta


@uncounted_kernel
def switching(step: int, i: int, nodes: Nodes, macro: Nodes, shared: bool, places: FloatArray, matrix: FloatArray, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray, sums: FloatArray) -> int:  # fmt: skip  # noqa: E501
    """March an element over a macro step, from stretch to stretch; arguments as of `careful`; return a status."""
    q = len(macro.places)
    room.moments[:q] = 0.0
    theta = 0.0
    k = int(careful.NO)
    for _ in range(layout.MOST_PARTS):
        if theta >= 1.0:
            while shared and k < q:
                copy(room.moments[:q], sums[k])
                k += 1
            return contract.RUNNING
        local.free_sum(q, site.c, site.B, room.moments, room.free)
        status, to = _go_on(step, i, theta, nodes, q, settings, site, room, rows, events, counts)
        if status != contract.RUNNING:
            return status
        if to > theta:
            if shared:
                k = careful.share_part(k, to, nodes, macro, q, rows[counts[careful.ROWS_NOW] - 1], room, sums)
            copy(room.after[:q], room.moments)
        theta = to
        if theta > 1.0 - careful.SNAP:
            theta = 1.0
    return layout.CHATTERS
