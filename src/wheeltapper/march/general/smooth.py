"""A macro step of one contact in which nothing happens: one collocation, its matrix from a table."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Row, Rows
from wheeltapper.march.general import borders, layout, local, paths
from wheeltapper.march.general.careful import FORESEEN, RECENT, SNAP, foresee_loss, log_row
from wheeltapper.march.general.laws.switch import LAW_PULLS
from wheeltapper.march.general.records import Nodes, Room, Site

FROM_GAP, CONTINUED, ONCE_MORE = range(3)
"""What a solve begins with: the force that there is, the last solution continued, or a solution of its own."""
CLEARANCE = 0.02
"""Smallest indentation at a node, over the range of all of them, at which none can vanish between two nodes."""


@inlined_uncounted_kernel
def may_be_smooth(site: Site) -> bool:
    """Return True for a contact without a break of its path, a recent impact or a foreseen loss in this macro step."""
    place = site.place
    if place["phase"] != 0.0 or -place["impact"] < RECENT or place["loss"] < 1.0 + FORESEEN:
        return False
    if paths.longest_reach(site.pieces, place, site.stride) < 1.0:
        return False
    return paths.piece_stop(site.pieces, place, site.x0, site.stride) >= 1.0 - SNAP


@inlined_uncounted_kernel
def smooth(step: int, i: int, macro: Nodes, G: FloatArray, r: FloatArray, begin: int, guess: FloatArray, settings: Row, site: Site, room: Room, rows: Rows, counts: IntArray) -> bool:  # fmt: skip  # noqa: E501
    """Solve one contact over a macro step; return False where that is not exact enough.

    `guess` takes the indentations at the nodes. Before, it holds what the solve begins with: nothing, the solution of
    the macro step before, or one of this macro step. The moments are in `room.moments`.
    """
    q = len(macro.places)
    place = site.place
    paths.heights(site.pieces, place, site.x0, site.stride, site.lift, q, macro.places, room.height, room.factor)
    paths.surfaces(site.pieces, place, site.x0, site.stride, site.lift, q, macro.places, room.left, room.factor)
    for k in range(q):
        total = room.height[k]
        for m in range(q):
            total += macro.values[k, m] * site.c[m]
        room.d[k] = total
        room.r[k] = r[k]
        if begin == ONCE_MORE:
            room.delta[k] = guess[k]
        elif begin == CONTINUED:
            room.delta[k] = 0.0
            for m in range(q):
                room.delta[k] += macro.ahead[k, m] * guess[m]
        room.pace[k] = 1.0
        for m in range(q):
            room.K[k, m] = G[k, m]
    if begin == FROM_GAP:
        gap, steepness = local.gap_at(0.0, q, site.c, site)
        local.continue_force(q, gap, steepness, site, room)
    if not local.newton(q, macro, settings["newton_limit"], site, room):
        return False
    least, most = np.inf, -np.inf
    end, slope, bend = 0.0, 0.0, 0.0
    for k in range(q):
        delta = room.delta[k]
        least, most = min(least, delta), max(most, delta)
        end += macro.end[k] * delta
        slope += macro.end_slope[k] * delta
        bend += macro.end_bend[k] * delta
    least, most = min(least, end), max(most, end)
    if local.would_pull(macro, site.law, room):
        return False
    if borders.near(macro, macro.places, CLEARANCE, site, room):
        return False
    if local.tail_of(macro, room.N) > settings["tail_limit"]:
        return False
    if site.law[LAW_PULLS] == 0.0:
        if least <= CLEARANCE * (most - least):
            return False
        loss = 1.0 + foresee_loss(end, slope, bend)
        if loss < 1.0 + FORESEEN:
            place["loss"] = loss
            return False
    for m in range(q):
        total = 0.0
        for k in range(q):
            total += macro.weights[k] * room.N[k] * macro.values[k, m]
        room.moments[m] = total
    place["joined"] = 0.0
    place["began"] = local.end_indentation(q, macro, place, room)
    for k in range(q):
        guess[k] = room.delta[k]
    log_row(step, i, 0.0, 1.0, layout.EVENLY, 0.0, 1.0, 0.0, 1.0, q, room.N, rows, counts)
    return True
