"""A macro step of a damper with free play: its end rests between two stops, or goes along at one of them.

    while the macro step has not ended:
        free     search D - z for the first stop that is met, beyond which it goes by more than rounding
        held     solve to the end with N = c·D', which either sign may have
            forces not resolved: half as far
            the velocity falls through zero: find where; the end rests where it is then

D is the displacement of what the damper holds, as a contact's gap (local.py).
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
from wheeltapper.march.general.laws.free_play import PLAY_DAMPING, PLAY_GAP
from wheeltapper.march.general.layout import EVENLY, FLYING
from wheeltapper.march.general.records import Nodes, Room, Site

PLACE_ROUNDING = 1e-13
"""Of displacements, in static indentations: over a short part it is felt in the velocity, and so in the force."""
TURN_STAGNANT = 1e-7
"""Corrections of a turn smaller than this, in macro steps, that do not shrink are rounding of the velocity."""
PAST_STOP = 1e-12
"""How far beyond a stop, in static indentations, the wheel may turn without meeting it: rounding."""


@uncounted_kernel
def _meets(theta: float, q: int, places: FloatArray, matrix: FloatArray, site: Site, room: Room) -> tuple[float, float]:
    """Return where the free end first meets a stop before the macro step ends, or NO_CROSSING, and which one."""
    n = len(places)
    length = 1.0 - theta
    first, which = NO_CROSSING, 0.0
    for turn in range(2):
        side = 1.0 - 2.0 * turn
        for k in range(n):
            value, slope = local.gap_at(theta + length * places[k], q, room.free, site)
            room.F[k] = side * (value - site.place["stop"]) - site.law[PLAY_GAP] - PAST_STOP
            if k == 0 and room.F[k] > 0.0 and side * slope > 0.0:
                return theta, side
        root = careful.crossing(n, matrix, room.F, 1.0, room)
        if root != NO_CROSSING and (first == NO_CROSSING or root < first):
            first, which = root, side
    if first == NO_CROSSING:
        return NO_CROSSING, which
    at = theta + length * first
    for _ in range(4):  # from what is hardly beyond to the stop itself
        value, slope = local.gap_at(at, q, room.free, site)
        beyond = which * (value - site.place["stop"]) - site.law[PLAY_GAP]
        new = at - beyond / (which * slope) if slope != 0.0 else at
        if not theta <= new <= 1.0:
            break
        at = new
    return at, which


@inlined_uncounted_kernel
def _resolved(length: float, settings: Row, site: Site) -> float:
    """Return the tail of a force that counts as resolved over a part."""
    return settings["tail_limit"] + PLACE_ROUNDING * site.law[PLAY_DAMPING] / (length * site.seconds)


@uncounted_kernel
def _find_turn(theta: float, guess: float, side: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room) -> tuple[int, float, float]:  # fmt: skip  # noqa: E501
    """Find where a held end turns back, near a guess; return an outcome, where its part ends, and where it turns.

    Moments at the part's end are in `room.after`.
    """
    n = len(nodes.places)
    at, before = guess, np.inf
    for _ in range(12):
        if at <= theta + careful.SNAP:
            return careful.TOO_LATE, theta, theta
        if not local.solve_part(
            nodes, q, EVENLY, theta, at - theta, 0.0, 1.0, bool(careful.NO), settings["newton_limit"], site, room
        ):
            return careful.FAILED, at, at
        value, slope = 0.0, 0.0
        for k in range(n):
            value += nodes.end[k] * side * room.rate[k]
            slope += nodes.end_slope[k] * side * room.rate[k] / (at - theta)
        if slope >= 0.0:
            return careful.FAILED, at, at
        away = -value / slope
        if abs(away) < settings["loss_limit"] or 0.5 * before <= abs(away) < TURN_STAGNANT:
            return careful.FOUND, at, at + away
        before = abs(away)
        at = min(at + min(max(away, 0.5 * (theta - at)), at - theta), 1.0)
    return careful.FAILED, at, at


@uncounted_kernel
def _hold(step: int, i: int, theta: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray) -> tuple[int, float]:  # fmt: skip  # noqa: E501
    """Go on at a stop from θ, to the macro step's end or to where the end turns back; return a status and where."""
    n = len(nodes.places)
    side = 1.0 if site.place["phase"] == layout.AT_UPPER else -1.0
    length = 1.0 - theta
    while length > careful.SHORTEST:
        to = theta + length
        solved = local.solve_part(
            nodes, q, EVENLY, theta, length, 0.0, 1.0, bool(careful.NO), settings["newton_limit"], site, room
        )
        if not solved:
            length *= 0.5
            continue
        for k in range(n):
            room.F[k] = side * room.rate[k]
        root = careful.crossing(n, nodes.bernstein, room.F, -1.0, room)
        inward = room.bernstein[layout.BEGIN] < 0.0
        if root == NO_CROSSING and not inward:
            if local.tail_of(nodes, room.N) > _resolved(length, settings, site):
                length *= 0.5
                continue
            careful.log_row(step, i, theta, to, EVENLY, theta, length, 0.0, 1.0, n, room.N, rows, counts)
            return contract.RUNNING, to
        outcome, at, turn = careful.TOO_LATE, theta, theta
        if not inward:
            outcome, at, turn = _find_turn(theta, theta + length * root, side, nodes, q, settings, site, room)
        if outcome == careful.FAILED or (
            outcome == careful.FOUND and local.tail_of(nodes, room.N) > _resolved(at - theta, settings, site)
        ):
            length = 0.5 * min(length, at - theta)
            continue
        if outcome == careful.FOUND:
            careful.log_row(step, i, theta, at, EVENLY, theta, at - theta, 0.0, 1.0, n, room.N, rows, counts)
            local.free_sum(q, site.c, site.B, room.after, room.spare)
        else:
            copy(room.moments[:q], room.after)
            local.free_sum(q, site.c, site.B, room.moments, room.spare)
        value, slope = local.gap_at(at, q, room.spare, site)
        site.place["stop"] = value - side * site.law[PLAY_GAP]
        site.place["phase"] = FLYING
        careful.log_event(step, i, turn, contract.LOSS, slope / site.seconds, events, counts)
        return contract.RUNNING, at
    return layout.UNSOLVED, theta


@uncounted_kernel
def play(step: int, i: int, nodes: Nodes, macro: Nodes, shared: bool, places: FloatArray, matrix: FloatArray, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray, sums: FloatArray) -> int:  # fmt: skip  # noqa: E501
    """March a damper's end over a macro step, from event to event; arguments as of `careful`; return a status."""
    q = len(macro.places)
    place = site.place
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
        if place["phase"] == FLYING:
            at, side = _meets(theta, q, places, matrix, site, room)
            end = 1.0 if at == NO_CROSSING else at
            if end > theta:
                room.N[:1] = 0.0
                careful.log_row(step, i, theta, end, EVENLY, theta, end - theta, 0.0, 1.0, 1, room.N, rows, counts)
            while shared and k < q and macro.places[k] <= end:
                copy(room.moments[:q], sums[k])
                k += 1
            theta = end
            if at != NO_CROSSING:
                _, slope = local.gap_at(at, q, room.free, site)
                careful.log_event(step, i, at, contract.IMPACT, slope / site.seconds, events, counts)
                place["phase"] = layout.AT_UPPER if side > 0.0 else layout.AT_LOWER
            continue
        status, to = _hold(step, i, theta, nodes, q, settings, site, room, rows, events, counts)
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
