"""Maxima of a contact's force, from the polynomials of its parts; only those that stand out from their surroundings."""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.common.rows import Row, Rows
from wheeltapper.march.general.crossings import NO_CROSSING, bernstein_value, first_crossing
from wheeltapper.march.general.layout import BEGIN
from wheeltapper.march.general.local import part_of
from wheeltapper.march.general.records import Nodes, Room

EXTREMES_MERGE = 1e-9
"""Two extremes closer than this share of a part are one."""


@inlined_uncounted_kernel
def follow(step: float, at: float, force: float, contact: float, prominent: float, trend: Row, peaks: Rows, count: int) -> int:  # fmt: skip  # noqa: E501
    """Take the force's next value; log the maximum before it as soon as the force has fallen from it."""
    least = prominent * (1.0 + abs(force))
    if trend["waits"] == 0.0 and not force > trend["lowest"] + least:
        trend["lowest"] = min(trend["lowest"], force)
    elif trend["waits"] == 0.0 or force > trend["size"]:
        trend["waits"] = 1.0
        trend["step"] = step
        trend["part"] = at
        trend["size"] = force
    elif force < trend["size"] - least:
        row = peaks[count]
        row["step"] = trend["step"]
        row["part"] = trend["part"]
        row["force"] = trend["size"]
        row["contact"] = contact
        trend["waits"] = 0.0
        trend["lowest"] = force
        return count + 1
    return count


@inlined_uncounted_kernel
def follow_row(row: Row, nodes: Nodes, prominent: float, trend: FloatArray, peaks: Rows, count: int, room: Room) -> int:  # fmt: skip  # noqa: E501
    """Take the extremes of the force in a logged part; return how many maxima are logged now."""
    step = row["step"]
    contact = row["contact"]
    n = int(row["nodes"])
    if n == 1:
        count = follow(step, row["from"], 0.0, contact, prominent, trend, peaks, count)
        return follow(step, row["to"], 0.0, contact, prominent, trend, peaks, count)
    for k in range(n):
        total = 0.0
        for j in range(n):
            total += nodes.bernstein[k, j] * row["forces"][j]
        room.bernstein[k] = total
    start = max(room.bernstein[BEGIN], 0.0)
    end = max(room.bernstein[n - 1], 0.0)
    count = follow(step, row["from"], start, contact, prominent, trend, peaks, count)
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
            width = row["s1"] - row["s0"]
            at = part_of(int(row["map"]), row["origin"], row["span"], row["s0"] + width * s)
            count = follow(step, at, force, contact, prominent, trend, peaks, count)
            s += EXTREMES_MERGE
    return follow(step, row["to"], end, contact, prominent, trend, peaks, count)
