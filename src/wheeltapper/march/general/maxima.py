"""Maxima of a contact's force, from the polynomials of its parts; only those that stand out from their surroundings."""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general import layout
from wheeltapper.march.general.crossings import NO_CROSSING, bernstein_value, first_crossing
from wheeltapper.march.general.layout import BEGIN, LOWEST_SINCE, TOP_SIZE, TOP_WAITS
from wheeltapper.march.general.local import part_of
from wheeltapper.march.general.records import Nodes, Room

EXTREMES_MERGE = 1e-9
"""Two extremes closer than this share of a part are one."""


@inlined_uncounted_kernel
def follow(step: float, at: float, force: float, contact: float, prominent: float, trend: FloatArray, peaks: FloatArray, count: int) -> int:  # fmt: skip  # noqa: E501
    """Take the force's next value; log the maximum before it as soon as the force has fallen from it."""
    least = prominent * (1.0 + abs(force))
    if trend[TOP_WAITS] == 0.0 and not force > trend[LOWEST_SINCE] + least:
        trend[LOWEST_SINCE] = min(trend[LOWEST_SINCE], force)
    elif trend[TOP_WAITS] == 0.0 or force > trend[TOP_SIZE]:
        trend[TOP_WAITS] = 1.0
        trend[layout.TOP_STEP] = step
        trend[layout.TOP_PART] = at
        trend[TOP_SIZE] = force
    elif force < trend[TOP_SIZE] - least:
        row = peaks[count]
        row[layout.MAXIMUM_STEP] = trend[layout.TOP_STEP]
        row[layout.MAXIMUM_PART] = trend[layout.TOP_PART]
        row[layout.MAXIMUM_FORCE] = trend[TOP_SIZE]
        row[layout.MAXIMUM_CONTACT] = contact
        trend[TOP_WAITS] = 0.0
        trend[LOWEST_SINCE] = force
        return count + 1
    return count


@inlined_uncounted_kernel
def follow_row(row: FloatArray, nodes: Nodes, prominent: float, trend: FloatArray, peaks: FloatArray, count: int, room: Room) -> int:  # fmt: skip  # noqa: E501
    """Take the extremes of the force in a logged part; return how many maxima are logged now."""
    step = row[layout.ROW_STEP]
    contact = row[layout.ROW_CONTACT]
    n = int(row[layout.ROW_NODES])
    if n == 1:
        count = follow(step, row[layout.ROW_FROM], 0.0, contact, prominent, trend, peaks, count)
        return follow(step, row[layout.ROW_TO], 0.0, contact, prominent, trend, peaks, count)
    for k in range(n):
        total = 0.0
        for j in range(n):
            total += nodes.bernstein[k, j] * row[layout.ROW_FORCES + j]
        room.bernstein[k] = total
    start = max(room.bernstein[BEGIN], 0.0)
    end = max(room.bernstein[n - 1], 0.0)
    count = follow(step, row[layout.ROW_FROM], start, contact, prominent, trend, peaks, count)
    rises = False
    falls = False
    for k in range(n - 1):
        room.F[k] = room.bernstein[k + 1] - room.bernstein[k]
        rises = rises or room.F[k] > 0.0
        falls = falls or room.F[k] < 0.0
    if rises and falls:
        s = 0.0
        while True:
            s = first_crossing(room.F, n - 2, 0.0, s, room.stack)
            if s == NO_CROSSING:
                break
            force = bernstein_value(room.bernstein, n - 1, s, room.spare)
            width = row[layout.ROW_S1] - row[layout.ROW_S0]
            at = part_of(
                int(row[layout.ROW_MAP]), row[layout.ROW_ORIGIN], row[layout.ROW_SPAN], row[layout.ROW_S0] + width * s
            )
            count = follow(step, at, force, contact, prominent, trend, peaks, count)
            s += EXTREMES_MERGE
    return follow(step, row[layout.ROW_TO], end, contact, prominent, trend, peaks, count)
