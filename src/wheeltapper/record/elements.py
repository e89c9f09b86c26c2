"""Tables of events of suspensions, of stops that dampers' ends meet, and of voids below sleepers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.lowered.base import ElementEvents, VoidEvents
from wheeltapper.march.common import program as contract
from wheeltapper.record.labels import VOID_OPENS, flag_variable

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

STOP_KINDS, STOP_SIDES = ("reached", "left"), ("lower", "upper")
"""Kinds of events of a damper's end, which reaches a stop or leaves it, and the names of its two stops."""
ELEMENT_KINDS = ("stick", "slip", "leave", "meet", "within", "beyond")
"""Kinds of events, inwards and outwards: of dry friction, of a bumpstop, of a corner of a spring or a damper."""
ELEMENT_SIDES = ("extension", "compression")
TIME = "time since the wheel was at x = 0"
Told = dict[str, tuple[Any, str, str]]
"""Columns of a table by name: values, unit, meaning."""


def _table(dimension: str, told: Told) -> xr.Dataset:
    import xarray as xr

    return xr.Dataset(
        {name: (dimension, values, {"units": unit, "long_name": text}) for name, (values, unit, text) in told.items()}
    )


def stored_table(table: xr.Dataset) -> xr.Dataset:
    """Return a table of stops or of elements as it is in files: names become numbers with their meaning."""
    (dimension,) = map(str, table.dims)
    of_stops = dimension == "damper_event"
    named = {"kind": STOP_KINDS if of_stops else ELEMENT_KINDS, "side": STOP_SIDES if of_stops else ELEMENT_SIDES}
    out = table.rename({name: f"{dimension}_{name}" for name in table.data_vars})
    for name, names in named.items():
        out[f"{dimension}_{name}"] = flag_variable(dimension, table[name].values, names)
    return out


def stop_events(stops: FloatArray, unit: float, wheelset: NDArray[np.int64] | None) -> xr.Dataset:
    """Return the table of stops that ends meet and leave, with times in a unit, s, and numbers of several wheelsets."""
    told: Told = {
        "time": (stops[:, contract.STOP_TIME] * unit, "s", TIME),
        "kind": (
            np.array(STOP_KINDS)[stops[:, contract.STOP_KIND].astype(int)], "",
            "reached: the damper begins to act; left: it ceases to",
        ),
        "side": (
            np.array(STOP_SIDES)[(stops[:, contract.STOP_SIDE] > 0.0).astype(int)], "",
            "stop of the damper's end at which the wheel is: lower or upper",
        ),
    }  # fmt: skip
    if wheelset is not None:
        told["wheelset"] = wheelset, "", "number of the wheelset, from the leading one"
    return _table("damper_event", told)


def element_table(events: ElementEvents) -> xr.Dataset:
    """Return the table of events of what is not linear in suspensions."""
    side = "compression or extension, of a damper and of dry friction their rate"
    return _table("suspension_event", {
        "time": (events.time, "s", TIME),
        "element": (events.element, "", "name of what is not linear in a suspension"),
        "kind": (np.array(ELEMENT_KINDS)[events.kind], "", ", ".join(ELEMENT_KINDS)),
        "side": (np.array(ELEMENT_SIDES)[events.side], "", side),
        "compression_rate": (events.rate, "m/s", "how fast the ends of the suspension come together"),
    })  # fmt: skip


def void_columns(scenario: Scenario, found: VoidEvents) -> dict[str, NDArray[Any]]:
    """Return events of voids at seats as columns of a table of events."""
    rows, seat, side = found
    columns: dict[str, NDArray[Any]] = {
        "time": rows[:, contract.EVENT_TIME],
        "kind": rows[:, contract.EVENT_KIND].astype(int) + VOID_OPENS,
        "seat": seat,
        "position": float(scenario.track.first_sleeper) + seat * float(scenario.track.spacing),
        "indentation_rate": rows[:, contract.EVENT_RATE],
    }
    return columns if side is None else columns | {"side": side}
