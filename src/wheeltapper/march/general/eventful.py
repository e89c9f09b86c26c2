"""A macro step of one contact in which something may happen, of whatever kind it is."""

from __future__ import annotations

from typing import Any

import numpy as np

from wheeltapper.march.general import layout
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.by_address import ByAddress
from wheeltapper.march.general.careful import careful
from wheeltapper.march.general.laws.switch import FREE_PLAY, LAW_KIND, SLIDER
from wheeltapper.march.general.play import play
from wheeltapper.march.general.records import Nodes, Room, Site
from wheeltapper.march.general.switching import switching
from wheeltapper.march.kernel import uncounted_kernel
from wheeltapper.march.program import FloatArray, IntArray


@uncounted_kernel
def eventful(step: int, i: int, nodes: Nodes, macro: Nodes, shared: bool, places: FloatArray, matrix: FloatArray, settings: FloatArray, site: Site, room: Room, rows: FloatArray, events: FloatArray, counts: IntArray, sums: FloatArray) -> int:  # fmt: skip  # noqa: E501
    """March a contact over a macro step, from event to event; arguments as of `careful`; return a status."""
    if site.law[LAW_KIND] == FREE_PLAY:
        return play(step, i, nodes, macro, shared, places, matrix, settings, site, room, rows, events, counts, sums)
    if site.law[LAW_KIND] >= SLIDER:
        return switching(
            step, i, nodes, macro, shared, places, matrix, settings, site, room, rows, events, counts, sums
        )
    return careful(step, i, nodes, macro, shared, places, matrix, settings, site, room, rows, events, counts, sums)


def _like_those_given() -> tuple[Any, ...]:
    """Return arguments for `eventful` of the types of all marches."""
    row, table, nodes = np.zeros(1), np.zeros((1, 1)), gauss_nodes(layout.MOST_NODES)
    site = Site(row, table, row, table, row, row, row, table, 0.0, 0.0, 0.0, 0.0)
    room = Room(*[row] * 18, *[table] * 5)
    return 0, 0, nodes, nodes, True, row, table, row, site, room, table, table, np.zeros(1, np.int64), table


EVENTFUL = ByAddress(eventful, _like_those_given)
eventful_at = EVENTFUL.call
