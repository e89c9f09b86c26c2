"""The table of events of what is not linear in suspensions: dry friction, bumpstops, corners of springs and dampers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.record.labels import flag_variable

if TYPE_CHECKING:
    import xarray as xr

KINDS = ("stick", "slip", "leave", "meet", "within", "beyond")
"""Kinds of events, inwards and outwards: of dry friction, of a bumpstop, of a corner of a spring or a damper."""
SIDES = ("extension", "compression")


def table_of(
    time: NDArray[Any], element: NDArray[Any], kind: NDArray[Any], side: NDArray[Any], rate: NDArray[Any]
) -> xr.Dataset:
    """Return the table of events, with times in s and rates in m/s; kinds and sides are numbers in `KINDS`, `SIDES`."""
    import xarray as xr

    told: dict[str, tuple[Any, str, str]] = {
        "time": (time, "s", "time since the wheel was at x = 0"),
        "element": (element, "", "name of what is not linear in a suspension"),
        "kind": (np.array(KINDS)[kind], "", ", ".join(KINDS)),
        "side": (np.array(SIDES)[side], "", "compression or extension, of a damper and of dry friction their rate"),
        "compression_rate": (rate, "m/s", "how fast the ends of the suspension come together"),
    }
    return xr.Dataset(
        {
            name: ("suspension_event", values, {"units": units, "long_name": text})
            for name, (values, units, text) in told.items()
        }
    )


def no_events() -> xr.Dataset:
    """Return that table of a suspension that is linear."""
    none = np.zeros(0, dtype=np.int64)
    return table_of(np.zeros(0), np.array([], dtype=str), none, none, np.zeros(0))


def stored_events(table: xr.Dataset) -> xr.Dataset:
    """Return that table as it is in files: names of kinds and sides become numbers with their meaning."""
    out = table.rename({name: f"suspension_event_{name}" for name in table.data_vars})
    for name, names in (("kind", KINDS), ("side", SIDES)):
        out[f"suspension_event_{name}"] = flag_variable("suspension_event", table[name].values, names)
    return out
