"""Distance of a contact from a further loss, on rails that give way: a margin that passes zero when the loss appears.

D = δ + r·N, the indentation and the local deflection of the track, is positive in contact and negative in flight. Where
a law that depends on the rate ends the contact before, counts what has the sign of its force, in static indentations: 1
plus loss times rate with Hunt and Crossley's law.

the loss happened      the smallest D of its flight, minus the largest clearance, or the smallest sign of the force that
                       is missing while the contact is released
it did not             the smaller of both in contact since the impact before it
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.common.rows import Rows
from wheeltapper.march.general import layout
from wheeltapper.march.general.careful import SNAP
from wheeltapper.march.general.contract import Task
from wheeltapper.march.general.ensemble import march_alone
from wheeltapper.march.general.gap_along import smallest_kernel
from wheeltapper.march.general.march import Found, first_places, room_of

NEAR = 2.0, 0.1
"""A part may hold the smallest D if its smallest force at a node is at most so many times that of all parts, plus so
many static units."""


def _wanted_rows(rows: Rows, events: FloatArray, losses: int, error: float) -> NDArray[np.bool_]:
    """Return the rows of a contact in which its margin can be, from times in macro steps and kinds of its events.

    `error` is that of a loss, by which a flight may begin before it.
    """
    times, kinds = events[:, contract.EVENT_TIME], events[:, contract.EVENT_KIND]
    lost, hit = times[kinds == contract.LOSS], times[kinds == contract.IMPACT]
    before = losses - 1  # impacts before that loss
    if len(hit) and (not len(lost) or hit[0] < lost[0]):  # it began in the air
        before += 1
    begins = rows["step"] + rows["from"]
    flying = rows["nodes"] == 1.0
    if len(lost) >= losses:
        until = hit[before] if len(hit) > before else np.inf
        return np.asarray(flying & (begins >= lost[losses - 1] - error - SNAP) & (begins < until))
    since = -1.0 if before == 0 else hit[before - 1] if len(hit) >= before else np.inf
    held = ~flying & (begins > since + SNAP)
    nodes = np.arange(layout.MOST_NODES) < rows["nodes"][:, None]
    least = np.where(nodes, rows["forces"], np.inf).min(axis=1)
    return np.asarray(held & (least <= NEAR[0] * least[held].min(initial=np.inf) + NEAR[1]))


def margin_of(found: Found, losses: int) -> float:
    """Return how far a march is from the `losses`-th loss of any of its contacts, m; negative where it happened."""
    prepared, logs = found.prepared, found.logs
    data, room = prepared.data, room_of(len(prepared.motion.bodies))
    out = np.inf
    for i, place in enumerate(first_places(data)[: len(prepared.system.wheels)]):
        events = found.events[found.events[:, contract.EVENT_CONTACT] == i]
        events[:, contract.EVENT_TIME] = prepared.grid.steps(events[:, contract.EVENT_TIME])
        rows = logs.rows[logs.rows["contact"] == i]
        lost = int((events[:, contract.EVENT_KIND] == contract.LOSS).sum())
        wanted = _wanted_rows(rows, events, losses, prepared.method.loss)
        gaps, here = np.ascontiguousarray(logs.gaps[:, i]), np.inf
        for some, part in found.by_stretch(rows["step"]):  # `place` goes along
            tables = part.prepared.tables
            here = min(here, smallest_kernel(rows[some], wanted[some], gaps, i, tables, data, place, room))
        none = 0.0 if lost >= losses else 1.0  # a loss that ends as it begins; or none before this one either
        out = min(out, here if np.isfinite(here) else none)
    return out * prepared.units.length


def margins_of(tasks: Sequence[Task], losses: int, threads: int) -> FloatArray:
    """Return the margin of each cell from the `losses`-th loss of any of its contacts, m; NaN where it broke off."""
    out = np.full(len(tasks), np.nan)

    def read(number: int, found: Found) -> None:
        if found.status == contract.DONE:
            out[number] = margin_of(found, losses)

    march_alone(tasks, threads, read)
    return out
