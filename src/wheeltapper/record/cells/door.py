"""From a march to what it offers for cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.march import run

if TYPE_CHECKING:
    from wheeltapper.record.cells.base import Cells


def cells_of(marcher: run.Marcher) -> type[Cells]:
    """Return the class of cells that a march takes."""
    from wheeltapper.record.cells import alone, lanes, tables

    return {
        run.LOCKSTEP: lanes.CellsInLanes, run.AS_OBJECTS: lanes.CellsAsObjects,
        run.SHARING_TABLES: tables.CellsSharingTables, run.ALONE_EACH: alone.CellsAlone,
    }[marcher.cells]  # fmt: skip
