"""What ends a contact, along the logged parts of a march, by the polynomials with which the march finds its events.

The gap D = δ + r·N falls below zero where the surfaces part. A law that depends on the rate may have to pull before,
and then the contact is released while they still indent each other: what has the sign of its force (laws/switch.py)
falls below zero.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.common.rows import Row
from wheeltapper.march.general import local, paths
from wheeltapper.march.general.algebra import copy
from wheeltapper.march.general.careful import SNAP
from wheeltapper.march.general.crossings import NO_CROSSING, bernstein_value, first_crossing
from wheeltapper.march.general.laws.switch import LAW_RATED, forces, trend
from wheeltapper.march.general.layout import BEGIN
from wheeltapper.march.general.maxima import EXTREMES_MERGE
from wheeltapper.march.general.records import Data, Nodes, Room, Site, Tables

BoolArray = NDArray[np.bool_]
TOUCHES = 1e-9
"""Indentation in static ones below which a force says nothing about its sign."""


@inlined_uncounted_kernel
def _smallest(n: int, room: Room) -> float:
    """Return the smallest value of the polynomial of degree n in `room.bernstein` on its interval."""
    lowest = min(room.bernstein[BEGIN], room.bernstein[n])
    for k in range(n):
        room.F[k] = room.bernstein[k + 1] - room.bernstein[k]
    at = 0.0
    while True:
        at = first_crossing(room.F, n - 1, 0.0, at, room.stack)
        if at == NO_CROSSING:
            return lowest
        lowest = min(lowest, bernstein_value(room.bernstein, n, at, room.spare))
        at += EXTREMES_MERGE


@inlined_uncounted_kernel
def _press(row: Row, nodes: Nodes, q: int, room: Room) -> None:
    """Write the nodes of a part in contact and its forces; `room.after` takes the moments at its end."""
    n = len(nodes.places)
    local.map_nodes(
        n, nodes.places, int(row["map"]), row["origin"], row["span"], row["s0"],
        row["s1"], room,
    )  # fmt: skip
    local.legendre_rows(n, room.theta, q, room.P)
    for m in range(q):
        room.after[m] = room.moments[m]
    for k in range(n):
        room.N[k] = row["forces"][k] * room.pace[k]
        for m in range(q):
            room.after[m] += nodes.weights[k] * room.N[k] * room.P[k, m]


@inlined_uncounted_kernel
def _gaps(row: Row, nodes: Nodes, q: int, site: Site, room: Room) -> None:
    """Write D at start, nodes and end of a part in contact, of which `_press` has written the nodes."""
    n = len(nodes.places)
    paths.heights(site.pieces, site.place, site.x0, site.stride, site.lift, n, room.theta, room.height, room.factor)
    room.d[BEGIN], _ = local.gap_at(row["from"], q, room.free, site)
    for k in range(n):  # with the moments up to each node
        for m in range(q):
            room.F[m] = room.moments[m]
            for i in range(n):
                room.F[m] += nodes.integrals[k, i] * room.N[i] * room.P[i, m]
        local.free_sum(q, site.c, site.B, room.F, room.spare)
        room.d[k + 1] = room.height[k]
        for m in range(q):
            room.d[k + 1] += room.P[k, m] * room.spare[m]
    local.free_sum(q, site.c, site.B, room.after, room.spare)
    room.d[n + 1], _ = local.gap_at(row["to"], q, room.spare, site)


@inlined_uncounted_kernel
def _smallest_sign(row: Row, nodes: Nodes, q: int, site: Site, room: Room) -> float:
    """Return the smallest value of what has the sign of the force in such a part: the force over that at rest.

    It is not taken from the indentation's rate, in which the error of the march's solution is some 1e5 times as large.
    """
    n = len(nodes.places)
    for k in range(n):
        compliance = 0.0
        for m in range(q):
            compliance += room.P[k, m] * site.local[m]
        room.delta[k] = room.d[k + 1] - compliance * row["forces"][k]
        room.rate[k] = 0.0
    forces(
        site.law, site.table, site.place["stretch"], n, room.delta, room.rate, room.left, room.factor, room.F,
        room.slope, room.viscous,
    )  # fmt: skip
    for k in range(n):
        at_rest = trend(site.law, site.table, room.delta[k], 0.0)
        if room.delta[k] > TOUCHES:
            at_rest *= row["forces"][k] / room.F[k]
        room.rate[k] = at_rest
    for k in range(n):
        total = 0.0
        for j in range(n):
            total += nodes.bernstein[k, j] * room.rate[j]
        room.bernstein[k] = total
    return _smallest(n - 1, room)


@inlined_uncounted_kernel
def _smallest_gap(nodes: Nodes, room: Room) -> float:
    """Return the smallest D of such a part."""
    n = len(nodes.places)
    for k in range(n + 2):
        total = 0.0
        for j in range(n + 2):
            total += nodes.ended[k, j] * room.d[j]
        room.bernstein[k] = total
    return _smallest(n + 1, room)


@inlined_uncounted_kernel
def _smallest_without_force(row: Row, places: FloatArray, matrix: FloatArray, q: int, site: Site, room: Room) -> float:  # fmt: skip  # noqa: E501
    """Return the smallest D of a flight; of a released contact, what has the sign of the force that it would have."""
    n, start = len(places), row["from"]
    length = row["to"] - start
    middle, _ = local.gap_at(start + 0.5 * length, q, room.free, site)
    released = site.law[LAW_RATED] != 0.0 and middle > 0.0
    for k in range(n):
        room.d[k], slope = local.gap_at(start + length * places[k], q, room.free, site)
        if released:
            room.d[k] = trend(site.law, site.table, room.d[k], slope / site.seconds)
    for k in range(n):
        total = 0.0
        for j in range(n):
            total += matrix[k, j] * room.d[j]
        room.bernstein[k] = total
    return _smallest(n - 1, room)


@uncounted_kernel
def smallest_kernel(
    rows: FloatArray, wanted: BoolArray, gaps: FloatArray, contact: int, tables: Tables, data: Data, place: Row,
    room: Room,
) -> float:  # fmt: skip
    """Return by how much a contact holds in the wanted ones of its rows, at least; negative where it has ended.

    `gaps` are its c of each macro step, `place` is its state at time zero.
    """
    kernels, residual = tables.kernels[contact], tables.residual[contact]
    which, seconds, clock = tables.which, tables.seconds, tables.clock
    pieces, ends, table, settings = data.pieces, data.ends[contact], data.table, data.settings
    law, begin = data.laws[contact], data.starts[contact]
    q = gaps.shape[1]
    speed, phases = settings["speed"], len(which)
    smallest = np.inf
    now = -1
    for r in range(len(rows)):
        row = rows[r]
        step = int(row["step"])
        p = step % phases
        lasts = seconds[which[p]]
        stride = speed * lasts
        site = Site(
            gaps[step], kernels[p], residual[p], pieces, place, ends, law, table,
            begin + speed * ((step // phases) * clock[phases] + clock[p]), stride, 1.0 / settings["length_unit"],
            lasts,
        )  # fmt: skip
        if step != now:
            room.moments[:q] = 0.0
            now = step
        while paths.piece_stop(pieces, place, site.x0, stride) <= row["from"] + SNAP:
            joined = paths.enter_next_piece(pieces, ends["begin"], ends["end"], ends["loop"], ends["join"], place)
            if joined < 0:
                return smallest
        local.free_sum(q, site.c, site.B, room.moments, room.free)
        if row["nodes"] == 1.0:
            if wanted[r]:
                smallest = min(smallest, _smallest_without_force(row, data.places, data.matrix, q, site, room))
            continue
        nodes = data.macro
        if row["nodes"] != len(data.macro.places):
            nodes = data.part
        _press(row, nodes, q, room)
        if wanted[r]:
            _gaps(row, nodes, q, site, room)
            smallest = min(smallest, _smallest_gap(nodes, room))
            if law[LAW_RATED] != 0.0:
                smallest = min(smallest, _smallest_sign(row, nodes, q, site, room))
        copy(room.after[:q], room.moments)
    return smallest
