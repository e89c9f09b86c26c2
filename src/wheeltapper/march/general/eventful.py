"""A macro step of one contact in which something may happen, of whatever kind it is."""

from __future__ import annotations

from wheeltapper.march.common.kernel import shared_uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Row, Rows
from wheeltapper.march.general.careful import careful
from wheeltapper.march.general.laws.switch import FREE_PLAY, LAW_KIND, SLIDER
from wheeltapper.march.general.play import play
from wheeltapper.march.general.records import Nodes, Room, Site
from wheeltapper.march.general.switching import switching


@shared_uncounted_kernel
def eventful(step: int, i: int, nodes: Nodes, macro: Nodes, shared: bool, places: FloatArray, matrix: FloatArray, settings: Row, site: Site, room: Room, rows: Rows, events: Rows, counts: IntArray, sums: FloatArray) -> int:  # fmt: skip  # noqa: E501
    """March a contact over a macro step, from event to event; arguments as of `careful`; return a status."""
    if site.law[LAW_KIND] == FREE_PLAY:
        return play(step, i, nodes, macro, shared, places, matrix, settings, site, room, rows, events, counts, sums)
    if site.law[LAW_KIND] >= SLIDER:
        return switching(
            step, i, nodes, macro, shared, places, matrix, settings, site, room, rows, events, counts, sums
        )
    return careful(step, i, nodes, macro, shared, places, matrix, settings, site, room, rows, events, counts, sums)
