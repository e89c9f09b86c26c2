"""A macro step of one contact from event to event: flights, impacts, losses, breakpoints of the path.

    while the macro step has not ended:
        at a breakpoint      enter the next piece; where the path jumps, choose contact or flight anew
        flying               search D for the first touch (every crossing, by Descartes); none: fly to the limit
        released             the surfaces indent each other, but a law that depends on the rate would pull: no force.
                             Search for where it would press again, an impact, and for where D falls below zero,
                             from where it is a flight
        in contact           solve to the limit, on nodes that suit a recent impact and a foreseen loss
            not converged, or forces not resolved: half as far
            D falls below zero: find the loss by Newton on D = 0 with the moments held: exact, since N = 0 there
            the law would pull: find where its force falls through zero, a loss after which the contact is released
        the law has a kink: find where the indentation comes to it, and go on from there (borders.py)
            a loss is foreseen soon behind the limit: once more, on nodes that suit it

The limit is the macro step's end, a breakpoint, or some part of a wave of the path.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Row, Rows
from wheeltapper.march.general import borders, layout, local, paths
from wheeltapper.march.general.algebra import copy
from wheeltapper.march.general.crossings import NO_CROSSING, first_crossing
from wheeltapper.march.general.laws.switch import LAW_PULLS, LAW_RATED, trend
from wheeltapper.march.general.layout import AFTER_IMPACT, BEFORE_LOSS, EVENLY, FLYING
from wheeltapper.march.general.records import Nodes, Room, Site

SNAP = 1e-12
"""Parts of a macro step closer than this are one."""
RECENT = 2.5
"""Macro steps for which an impact is felt in the force's smoothness."""
FORESEEN = 1.5
"""Macro steps before a loss in which it is felt."""
SHORTEST = 1e-6
"""Part of a macro step below which nothing is halved any more."""
SHALLOW = 1e-12
"""A dip of D less deep than this, in static indentations, is rounding and no loss."""
MOST_TRIES = 60
PULLS = 1e-6
"""What a law may pull when a part begins, and what it may press while it is released, by the error of an event."""
FOUND, TOO_LATE, FAILED = range(3)
NO = 0.0
"""No constant of its type, for which Numba would compile a callee once more."""


ROWS_NOW, EVENTS_NOW = 0, 1
"""Counts of a contact's rows and events in the present macro step."""


@uncounted_kernel
def log_row(step: int, i: int, start: float, end: float, how: int, origin: float, span: float, s0: float, s1: float, n: int, N: FloatArray, rows: Rows, counts: IntArray) -> None:  # fmt: skip  # noqa: E501
    """Write a part of a macro step in the contact's next row."""
    row = rows[counts[ROWS_NOW]]
    counts[ROWS_NOW] += 1
    row["step"] = step
    row["contact"] = i
    row["from"] = start
    row["to"] = end
    row["map"] = how
    row["origin"] = origin
    row["span"] = span
    row["s0"] = s0
    row["s1"] = s1
    row["nodes"] = n
    for k in range(n):
        row["forces"][k] = N[k]


@uncounted_kernel
def log_event(step: int, i: int, at: float, kind: int, rate: float, events: Rows, counts: IntArray) -> None:
    """Write an event of the present macro step."""
    row = events[counts[EVENTS_NOW]]
    counts[EVENTS_NOW] += 1
    row["step"] = step
    row["part"] = at
    row["kind"] = kind
    row["rate"] = rate
    row["contact"] = i


@uncounted_kernel
def foresee_loss(value: float, slope: float, bend: float) -> float:
    """Return when value + slope·s + bend·s²/2 falls to zero, or infinity."""
    if value <= 0.0:
        return 0.0
    inside = slope * slope - 2.0 * bend * value
    if inside <= 0.0:
        return np.inf
    root = sqrt(inside)
    if slope < 0.0:
        return 2.0 * value / (root - slope)
    if bend < 0.0:
        return -(slope + root) / bend
    return np.inf


@uncounted_kernel
def fly(theta: float, limit: float, fresh: bool, q: int, places: FloatArray, matrix: FloatArray, site: Site, room: Room) -> float:  # fmt: skip  # noqa: E501
    """Return the first touch of a flight before `limit`, or NO_CROSSING. `fresh`: it begins with a loss here."""
    n = len(places)
    length = limit - theta
    start, slope = local.gap_at(theta, q, room.free, site)
    if slope > 0.0 if fresh else start + SNAP * slope > 0.0:  # also a loss at a kink, behind which the gap closes
        return theta
    for k in range(n):
        room.spare[k] = theta + length * places[k]
    paths.heights(site.pieces, site.place, site.x0, site.stride, site.lift, n, room.spare, room.height, room.factor)
    for k in range(n):
        value, _ = local.sum_at(room.spare[k], q, room.free)
        room.F[k] = value + room.height[k]
    if fresh:  # the zero at the start is taken out
        room.F[layout.BEGIN] = slope * length
        for k in range(1, n):
            room.F[k] = (room.F[k] - start) / places[k]
    for k in range(n):
        total = 0.0
        for j in range(n):
            total += matrix[k, j] * room.F[j]
        room.bernstein[k] = total
    root = first_crossing(room.bernstein, n - 1, 1.0, 0.0, room.stack)
    if root == NO_CROSSING:
        return NO_CROSSING
    at = theta + length * root
    for _ in range(4):  # on the path itself
        value, slope = local.gap_at(at, q, room.free, site)
        if slope <= 0.0:
            break
        new = at - value / slope
        if not theta <= new <= limit:
            break
        at = new
    return at


@uncounted_kernel
def drift(theta: float, limit: float, q: int, places: FloatArray, matrix: FloatArray, site: Site, room: Room) -> tuple[float, bool]:  # fmt: skip  # noqa: E501
    """Return where a released contact ends before `limit`, or NO_CROSSING, and whether the law presses again there."""
    n = len(places)
    length = limit - theta
    for k in range(n):
        value, slope = local.gap_at(theta + length * places[k], q, room.free, site)
        room.F[k] = value
        room.spare[k] = trend(site.law, site.table, value, slope / site.seconds)
    start = room.spare[layout.BEGIN]
    if start > PULLS or (start > 0.0 and room.spare[layout.BEGIN + 1] > start):  # behind a kink of the path
        return theta, True
    over = crossing(n, matrix, room.F, -1.0, room)
    again = crossing(n, matrix, room.spare, 1.0, room)
    if again != NO_CROSSING and (over == NO_CROSSING or again < over):
        return theta + length * again, True
    return NO_CROSSING if over == NO_CROSSING else theta + length * over, False


@uncounted_kernel
def crossing(n: int, matrix: FloatArray, values: FloatArray, direction: float, room: Room) -> float:
    """Return the first crossing from 0 to 1 of the polynomial with n values, by their matrix to Bernstein's form."""
    for k in range(n):
        total = 0.0
        for j in range(n):
            total += matrix[k, j] * values[j]
        room.bernstein[k] = total
    return first_crossing(room.bernstein, n - 1, direction, 0.0, room.stack)


@uncounted_kernel
def _ends_otherwise(nodes: Nodes, late: bool, limit: float, site: Site, room: Room) -> tuple[float, float]:
    """Return where in σ a solved part ends in contact, or NO_CROSSING, and the border by which it leaves its stretch.

    `late`: that border has been found behind the part's end. `limit` is that of resolved forces.
    """
    pulls = _pulls(nodes, limit, site, room)
    if pulls != NO_CROSSING or late:
        return pulls, borders.NOWHERE
    return borders.leaves(nodes, site, room)


@uncounted_kernel
def _pulls(nodes: Nodes, limit: float, site: Site, room: Room) -> float:
    """Return where in σ the law of a solved part begins to pull, or NO_CROSSING; `limit` is that of resolved forces."""
    if site.law[LAW_RATED] == 0.0:
        return NO_CROSSING
    n = len(nodes.places)
    local.trends(n, site.law, site.table, room, room.F)
    if site.place["joined"] != 0.0:  # the zero at the start is taken out
        start = 0.0
        for k in range(n):
            start += nodes.bernstein[layout.BEGIN, k] * room.F[k]
        for k in range(n):
            room.F[k] = (room.F[k] - start) / nodes.places[k]
        return crossing(n, nodes.bernstein, room.F, -1.0, room)
    root = crossing(n, nodes.bernstein, room.F, -1.0, room)
    if room.bernstein[layout.BEGIN] < -PULLS and local.tail_of(nodes, room.N) <= limit:
        return 0.0
    return root


@uncounted_kernel
def _solve_to(at: float, theta: float, again: bool, nodes: Nodes, q: int, settings: Row, site: Site, room: Room) -> tuple[bool, int, float, float, float, float, float]:  # fmt: skip  # noqa: E501
    """Solve from θ to a place where something but a loss ends the part; return whether that is done.

    Then follow map, origin, span, s0 and s1, and the pace at the end.
    """
    impact = site.place["impact"]
    how, origin, span, s0, s1 = EVENLY, theta, at - theta, 0.0, 1.0
    pace = span
    if theta - impact < RECENT:
        how, origin, s0, s1 = AFTER_IMPACT, impact, sqrt(max(theta - impact, 0.0)), sqrt(at - impact)
        pace = 2.0 * s1 * (s1 - s0)
    solved = local.solve_part(nodes, q, how, origin, span, s0, s1, again, settings["newton_limit"], site, room)
    return solved, how, origin, span, s0, s1, pace


@uncounted_kernel
def go_over(step: int, i: int, theta: float, direction: float, guess: float, limit: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray) -> tuple[int, float]:  # fmt: skip  # noqa: E501
    """Go on in contact from θ to where it leaves its law's stretch, near a guess; return an outcome and where.

    Moments behind it are in `room.after`.
    """
    n = len(nodes.places)
    place = site.place
    yields = direction == borders.UP and place["stretch"] == 0.0
    at = guess
    if at <= theta + SNAP:
        if yields:
            _, slope = local.gap_at(theta, q, room.free, site)
            log_event(step, i, theta, contract.YIELD, slope / site.seconds, events, counts)
        borders.enter(direction, theta, site)
        return FOUND, theta
    for turn in range(12):
        if at <= theta + SNAP:
            return FAILED, at
        if at > limit + SNAP:
            return TOO_LATE, at
        solved, how, origin, span, s0, s1, pace = _solve_to(at, theta, turn > 0, nodes, q, settings, site, room)
        if not solved:
            return FAILED, at
        local.free_sum(q, site.c, site.B, room.after, room.spare)
        end, _ = local.gap_at(at, q, room.spare, site)
        value, steepness = borders.beyond(direction, at, q, end, site)
        slope, rate = borders.approach(direction, nodes, pace, site, room)
        if slope <= 0.0:
            return FAILED, at
        away = -value / (slope * steepness)
        if abs(away) < settings["loss_limit"]:
            if local.tail_of(nodes, room.N) > settings["tail_limit"] and at - theta > SHORTEST:
                return FAILED, at
            log_row(step, i, theta, at, how, origin, span, s0, s1, n, room.N, rows, counts)
            if yields:
                log_event(step, i, at + away, contract.YIELD, rate / site.seconds, events, counts)
            borders.enter(direction, at, site)
            place["began"] = local.end_indentation(n, nodes, place, room)
            return FOUND, at
        at += min(max(away, 0.5 * (theta - at)), at - theta)
    return FAILED, at


@uncounted_kernel
def release(step: int, i: int, theta: float, guess: float, limit: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray) -> tuple[int, float]:  # fmt: skip  # noqa: E501
    """Go on in contact from θ to where the law would pull, near a guess; return an outcome and where.

    Moments behind it are in `room.after`.
    """
    n = len(nodes.places)
    place = site.place
    at = guess
    if at <= theta + SNAP:
        _, slope = local.gap_at(theta, q, room.free, site)
        log_event(step, i, theta, contract.LOSS, slope / site.seconds, events, counts)
        place["phase"] = layout.RELEASED
        place["loss"] = np.inf
        return FOUND, theta
    for turn in range(12):
        if at <= theta + SNAP:
            return FAILED, at
        if at > limit + SNAP:
            return TOO_LATE, at
        solved, how, origin, span, s0, s1, pace = _solve_to(at, theta, turn > 0, nodes, q, settings, site, room)
        if not solved:
            return FAILED, at
        local.trends(n, site.law, site.table, room, room.F)
        value, slope, rate = 0.0, 0.0, 0.0
        for k in range(n):
            value += nodes.end[k] * room.F[k]
            slope += nodes.end_slope[k] * room.F[k] / pace
            rate += nodes.end[k] * room.rate[k]
        if slope >= 0.0:
            return FAILED, at
        away = -value / slope
        if abs(away) < settings["loss_limit"]:
            if local.tail_of(nodes, room.N) > settings["tail_limit"] and at - theta > SHORTEST:
                return FAILED, at
            log_row(step, i, theta, at, how, origin, span, s0, s1, n, room.N, rows, counts)
            log_event(step, i, at + away, contract.LOSS, rate, events, counts)
            place["phase"] = layout.RELEASED
            place["loss"] = np.inf
            place["began"] = local.end_indentation(n, nodes, place, room)
            return FOUND, at
        at += min(max(away, 0.5 * (theta - at)), at - theta)
    return FAILED, at


@uncounted_kernel
def find_loss(theta: float, guess: float, limit: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room) -> tuple[int, float, float, float, float, float]:  # fmt: skip  # noqa: E501
    """Find the end of a contact that lasts from θ on; return an outcome, where its part ends, s0 and span of its map.

    Then follow the loss itself, and D's derivative there. Moments behind it are in `room.after`.
    """
    impact = site.place["impact"]
    recent = theta - impact < RECENT
    at = guess
    for turn in range(12):
        if at <= theta + SNAP:
            return FAILED, at, 0.0, 0.0, at, 0.0
        if at > limit + SNAP:
            return TOO_LATE, at, 0.0, 0.0, at, 0.0
        how, origin, span, s0, s1 = BEFORE_LOSS, at, 0.0, sqrt(at - theta), 0.0
        if recent:
            how, origin, span, s1 = layout.IMPACT_TO_LOSS, impact, at - impact, 1.0
            s0 = local.smoothstep_inverse((theta - impact) / span)
        solved = local.solve_part(nodes, q, how, origin, span, s0, s1, turn > 0, settings["newton_limit"], site, room)
        if not solved:
            return FAILED, at, 0.0, 0.0, at, 0.0
        local.free_sum(q, site.c, site.B, room.after, room.spare)
        value, slope = local.gap_at(at, q, room.spare, site)
        if slope >= 0.0:
            return FAILED, at, 0.0, 0.0, at, 0.0
        away = -value / slope
        if abs(away) < settings["loss_limit"]:
            if local.tail_of(nodes, room.N) > settings["tail_limit"] and at - theta > SHORTEST:
                return FAILED, at, 0.0, 0.0, at, 0.0
            return FOUND, at, s0, span, at + away, slope
        at += min(max(away, 0.5 * (theta - at)), at - theta)
    return FAILED, at, 0.0, 0.0, at, 0.0


@uncounted_kernel
def _falls(n: int, nodes: Nodes, how: int, origin: float, span: float, s0: float, s1: float, start: float, slope: float, end: float, room: Room) -> float:  # fmt: skip  # noqa: E501
    """Return where in σ the gap D first falls through zero, or NO_CROSSING; without the zero of an impact at 0."""
    from_impact = s0 == 0.0 and (how == AFTER_IMPACT or how == layout.IMPACT_TO_LOSS)
    room.F[layout.BEGIN] = start
    room.F[n + 1] = end
    for k in range(n):
        room.F[k + 1] = room.delta[k] + room.r[k] * room.N[k]
        if from_impact:
            room.F[k + 1] /= nodes.places[k] * nodes.places[k]
    if from_impact:
        room.F[layout.BEGIN] = slope * s1 * s1 * (1.0 if how == AFTER_IMPACT else 3.0 * span)
    for k in range(n + 2):
        total = 0.0
        for j in range(n + 2):
            total += nodes.ended[k, j] * room.F[j]
        room.bernstein[k] = total + SHALLOW
    return first_crossing(room.bernstein, n + 1, -1.0, 0.0, room.stack)


@uncounted_kernel
def press(step: int, i: int, theta: float, limit: float, nodes: Nodes, q: int, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray) -> tuple[int, float]:  # fmt: skip  # noqa: E501
    """Go on in contact from θ, to the limit or a loss, or less far; return a status and where."""
    place = site.place
    n = len(nodes.places)
    impact = place["impact"]
    recent = theta - impact < RECENT
    start, start_slope = local.gap_at(theta, q, room.free, site)
    pulls_too = site.law[LAW_PULLS] != 0.0
    if start <= 0.0 and start_slope < 0.0 and not pulls_too:
        log_event(step, i, theta, contract.LOSS, start_slope / site.seconds, events, counts)
        place["phase"] = FLYING
        return contract.RUNNING, theta
    direction = borders.astray(theta, q, start, site)
    if direction != borders.NOWHERE:
        go_over(
            step, i, theta, direction, theta, limit, nodes, q, settings, site, room, rows, events, counts
        )  # fmt: skip
        return contract.RUNNING, theta
    length = limit - theta
    beyond, late, grazes = False, False, False
    for _ in range(MOST_TRIES):
        to = theta + length
        if length == limit - theta:
            to = limit
        loss = place["loss"]
        if loss <= theta:
            loss = np.inf
        guess = loss if loss <= to else np.inf
        how, origin, span, s0, s1 = EVENLY, theta, to - theta, 0.0, 1.0
        pulled, less = False, length
        if guess == np.inf:
            if recent and loss - to < FORESEEN:
                how = layout.IMPACT_TO_LOSS
                origin, span = impact, loss - impact
                s0 = local.smoothstep_inverse((theta - impact) / span)
                s1 = local.smoothstep_inverse((to - impact) / span)
            elif recent:
                how = AFTER_IMPACT
                origin, s0, s1 = impact, sqrt(max(theta - impact, 0.0)), sqrt(to - impact)
            elif loss - to < FORESEEN:
                how = BEFORE_LOSS
                origin, s0, s1 = loss, sqrt(loss - theta), sqrt(loss - to)
            solved = local.solve_part(
                nodes, q, how, origin, span, s0, s1, bool(NO), settings["newton_limit"], site, room
            )
            if not solved:
                if length < SHORTEST:
                    return layout.UNSOLVED, theta
                length *= 0.5
                continue
            local.free_sum(q, site.c, site.B, room.after, room.spare)
            end, end_slope = local.gap_at(to, q, room.spare, site)
            root = NO_CROSSING
            if grazes and end <= 0.0:
                return layout.UNSOLVED, theta
            if not pulls_too and not grazes:
                root = _falls(n, nodes, how, origin, span, s0, s1, start, start_slope, end, room)
            pulls, border = _ends_otherwise(nodes, late, settings["tail_limit"], site, room)
            if pulls != NO_CROSSING and (root == NO_CROSSING or pulls < root):
                root, pulled, direction, less = pulls, True, border, 0.5 * length
            if root != NO_CROSSING:
                guess = min(local.part_of(how, origin, span, s0 + (s1 - s0) * root), to)
        if guess != np.inf and not pulled:
            outcome, at, s0, span, loss, slope = find_loss(theta, guess, limit, nodes, q, settings, site, room)
            if outcome == FOUND:
                how, origin, s1 = BEFORE_LOSS, at, 0.0
                if recent:
                    how, origin, s1 = layout.IMPACT_TO_LOSS, impact, 1.0
                pulls, direction = _ends_otherwise(nodes, late, settings["tail_limit"], site, room)
                if pulls == NO_CROSSING:
                    log_row(step, i, theta, at, how, origin, span, s0, s1, n, room.N, rows, counts)
                    log_event(step, i, loss, contract.LOSS, slope / site.seconds, events, counts)
                    place["phase"] = FLYING
                    place["loss"] = np.inf
                    place["began"] = 0.0
                    return contract.RUNNING, at
                guess = local.part_of(how, origin, span, s0 + (s1 - s0) * pulls)
                pulled, less = True, 0.5 * min(length, guess - theta)
                place["loss"] = np.inf
        if pulled:
            if direction == borders.NOWHERE:
                outcome, at = release(
                    step, i, theta, guess, limit, nodes, q, settings, site, room, rows, events, counts
                )
            else:
                outcome, at = go_over(
                    step, i, theta, direction, guess, to, nodes, q, settings, site, room, rows, events, counts
                )
                late = outcome == TOO_LATE
            if outcome == FOUND:
                return contract.RUNNING, at
            if late:
                continue
            if length < SHORTEST:
                return layout.UNSOLVED, theta
            length = less
            continue
        if guess != np.inf:
            place["loss"] = at if outcome == TOO_LATE and at < limit + FORESEEN else np.inf
            if outcome == FAILED or beyond or length < limit - theta:
                if length < SHORTEST and not grazes:  # too shallow to be found
                    grazes, length, place["loss"] = True, limit - theta, np.inf
                    continue
                if length < SHORTEST:
                    return layout.UNSOLVED, theta
                length = 0.5 * min(length, guess - theta)
            beyond = outcome == TOO_LATE
            continue
        if local.tail_of(nodes, room.N) > settings["tail_limit"] and length > SHORTEST:
            length *= 0.5
            continue
        middle = n // 2
        back = to - room.theta[middle]
        bend = 2.0 * (room.delta[middle] + room.r[middle] * room.N[middle] - end + end_slope * back) / (back * back)
        soon = np.inf if pulls_too else to + foresee_loss(end, end_slope, bend)
        near = loss - to < FORESEEN
        place["loss"] = soon if soon < to + 2.0 * FORESEEN else np.inf
        if soon < to + FORESEEN and not near and soon > to:
            continue
        log_row(step, i, theta, to, how, origin, span, s0, s1, n, room.N, rows, counts)
        place["joined"] = 0.0
        place["began"] = local.end_indentation(n, nodes, place, room)
        return contract.RUNNING, to
    return layout.UNSOLVED, theta


@uncounted_kernel
def _cross(step: int, i: int, theta: float, q: int, site: Site, room: Room, events: Rows, counts: IntArray) -> int:  # fmt: skip  # noqa: E501
    """Enter the next piece of the path; return a status."""
    place = site.place
    ends = site.ends
    join = paths.enter_next_piece(site.pieces, ends["begin"], ends["end"], ends["loop"], ends["join"], place)
    if join < 0:
        return contract.END_OF_PATH
    if join == contract.JUMP and site.law[LAW_PULLS] == 0.0:
        local.free_sum(q, site.c, site.B, room.moments, room.free)
        value, slope = local.gap_at(theta, q, room.free, site)
        place["loss"] = np.inf
        place["began"] = max(value, 0.0)
        place["joined"] = 0.0
        if value > 0.0 and place["phase"] == FLYING:
            log_event(step, i, theta, contract.IMPACT, slope / site.seconds, events, counts)
            place["phase"] = layout.TOUCHING
            place["stretch"] = 0.0
            place["impact"] = -np.inf
        elif value <= 0.0 and place["phase"] == layout.TOUCHING:
            log_event(step, i, theta, contract.LOSS, slope / site.seconds, events, counts)
            place["phase"] = FLYING
        elif value <= 0.0:
            place["phase"] = FLYING
    return contract.RUNNING


@uncounted_kernel
def careful(step: int, i: int, nodes: Nodes, macro: Nodes, shared: bool, places: FloatArray, matrix: FloatArray, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray, sums: FloatArray) -> int:  # fmt: skip  # noqa: E501
    """March one contact over a macro step, from event to event; return a status. Its moments are in `room.moments`.

    Where the contact is `shared`, the moments up to each macro node are written to `sums`, (node, moment).
    """
    q = len(macro.places)
    place = site.place
    room.moments[:q] = 0.0
    theta = 0.0
    fresh = bool(NO)
    k = int(NO)
    for _ in range(layout.MOST_PARTS):
        if theta > 1.0 - SNAP:
            theta = 1.0
        stop = paths.piece_stop(site.pieces, place, site.x0, site.stride)
        if stop <= theta + SNAP and theta < 1.0:
            status = _cross(step, i, theta, q, site, room, events, counts)
            if status != contract.RUNNING:
                return status
            continue
        if theta >= 1.0:
            while shared and k < q:
                copy(room.moments[:q], sums[k])
                k += 1
            return contract.RUNNING
        limit = min(1.0, stop, theta + paths.longest_reach(site.pieces, place, site.stride))
        if limit > 1.0 - SNAP:
            limit = 1.0
        local.free_sum(q, site.c, site.B, room.moments, room.free)
        if place["phase"] != layout.TOUCHING:
            released = place["phase"] == layout.RELEASED
            presses = True
            if released:
                at, presses = drift(theta, limit, q, places, matrix, site, room)
            else:
                at = fly(theta, limit, fresh, q, places, matrix, site, room)
            fresh = bool(NO)
            end = limit if at == NO_CROSSING else at
            rises = released and (end > theta or place["lags"] != 0.0)  # a lag has the law press from nothing
            if end > theta:
                room.N[:1] = 0.0
                log_row(step, i, theta, end, EVENLY, theta, end - theta, 0.0, 1.0, 1, room.N, rows, counts)
            while shared and k < q and macro.places[k] <= end:
                copy(room.moments[:q], sums[k])
                k += 1
            theta = end
            if at != NO_CROSSING and presses:
                value, slope = local.gap_at(at, q, room.free, site)
                log_event(step, i, at, contract.IMPACT, slope / site.seconds, events, counts)
                place["phase"] = layout.TOUCHING
                place["impact"] = -np.inf if released else at
                place["loss"] = np.inf
                place["began"] = value if released else 0.0
                place["stretch"] = 0.0
                place["joined"] = borders.UP if rises else borders.NOWHERE
            elif at != NO_CROSSING:
                place["phase"] = FLYING
                fresh = not bool(NO)
            continue
        status, to = press(step, i, theta, limit, nodes, q, settings, site, room, rows, events, counts)
        if status != contract.RUNNING:
            return status
        if to > theta:
            if shared:
                k = share_part(k, to, nodes, macro, q, rows[counts[ROWS_NOW] - 1], room, sums)
            copy(room.after[:q], room.moments)
        fresh = place["phase"] == FLYING
        theta = to
    return layout.CHATTERS


@uncounted_kernel
def sigma_of(theta: float, row: Row) -> float:
    """Return σ, from 0 to 1, of a part θ of the macro step in a logged row."""
    how = row["map"]
    origin = row["origin"]
    s = theta - origin
    if how == EVENLY:
        return s / row["span"]
    if how == AFTER_IMPACT:
        s = sqrt(max(s, 0.0))
    elif how == BEFORE_LOSS:
        s = sqrt(max(-s, 0.0))
    else:
        s = local.smoothstep_inverse(s / row["span"])
    return (s - row["s0"]) / (row["s1"] - row["s0"])


@uncounted_kernel
def sigmas_of(theta: FloatArray, index: IntArray, rows: Rows, out: FloatArray) -> None:
    """Write σ of parts θ, each in the row that its index tells."""
    for k in range(len(theta)):
        out[k] = sigma_of(theta[k], rows[index[k]])


@uncounted_kernel
def share_part(k: int, to: float, nodes: Nodes, macro: Nodes, q: int, row: Row, room: Room, sums: FloatArray) -> int:  # fmt: skip  # noqa: E501
    """Write the moments up to the macro nodes in a solved part, from node k on; return the first node behind it."""
    n = len(nodes.places)
    first = k
    while k < q and macro.places[k] <= to:
        k += 1
    if k == first:
        return k
    for m in range(q):
        for j in range(n):  # coefficients of the moment's rate, over σ
            total = 0.0
            for a in range(n):
                total += nodes.transform[j, a] * room.pace[a] * room.N[a] * room.P[a, m]
            room.F[j] = total
        for node in range(first, k):
            z = 2.0 * sigma_of(macro.places[node], row) - 1.0
            before = 1.0
            value = z
            total = room.moments[m] + room.F[layout.BEGIN] * 0.5 * (z + 1.0)
            for j in range(1, n):  # the integral of P_j is (P_{j+1} - P_{j-1})/(2j + 1), half of it over σ
                later = ((2 * j + 1) * z * value - j * before) / (j + 1)
                total += room.F[j] * 0.5 * (later - before) / (2 * j + 1)
                before = value
                value = later
            sums[node, m] = total
    return k
