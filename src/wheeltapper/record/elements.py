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

STOP_KINDS = ("reached", "left")
"""Kinds of events of a damper's end: it reaches a stop, or leaves it."""
STOP_SIDES = ("lower", "upper")
"""Names of the two stops."""


def stop_events(stops: FloatArray, unit: float, wheelset: NDArray[np.int64] | None) -> xr.Dataset:
    """Return the table of stops that ends meet and leave, with times in a unit, s, and numbers of several wheelsets."""
    import xarray as xr

    kinds = np.array(STOP_KINDS)[stops[:, contract.STOP_KIND].astype(int)]
    sides = np.where(stops[:, contract.STOP_SIDE] > 0.0, STOP_SIDES[1], STOP_SIDES[0])
    told: dict[str, tuple[Any, str, str]] = {
        "time": (stops[:, contract.STOP_TIME] * unit, "s", "time since the wheel was at x = 0"),
        "kind": (kinds, "", "reached: the damper begins to act; left: it ceases to"),
        "side": (sides, "", "stop of the damper's end at which the wheel is: lower or upper"),
    }
    if wheelset is not None:
        told["wheelset"] = wheelset, "", "number of the wheelset, from the leading one"
    return xr.Dataset(
        {
            name: ("damper_event", values, {"units": units, "long_name": text})
            for name, (values, units, text) in told.items()
        }
    )


def stored_stops(table: xr.Dataset) -> xr.Dataset:
    """Return that table as it is in files: names become numbers with their meaning."""
    out = table.rename({name: f"damper_event_{name}" for name in table.data_vars})
    for name, names in (("kind", STOP_KINDS), ("side", STOP_SIDES)):
        out[f"damper_event_{name}"] = flag_variable("damper_event", table[name].values, names)
    return out


ELEMENT_KINDS = ("stick", "slip", "leave", "meet", "within", "beyond")
"""Kinds of events, inwards and outwards: of dry friction, of a bumpstop, of a corner of a spring or a damper."""
ELEMENT_SIDES = ("extension", "compression")


def element_table(events: ElementEvents) -> xr.Dataset:
    """Return the table of events of what is not linear in suspensions."""
    import xarray as xr

    told: dict[str, tuple[Any, str, str]] = {
        "time": (events.time, "s", "time since the wheel was at x = 0"),
        "element": (events.element, "", "name of what is not linear in a suspension"),
        "kind": (np.array(ELEMENT_KINDS)[events.kind], "", ", ".join(ELEMENT_KINDS)),
        "side": (
            np.array(ELEMENT_SIDES)[events.side],
            "",
            "compression or extension, of a damper and of dry friction their rate",
        ),
        "compression_rate": (events.rate, "m/s", "how fast the ends of the suspension come together"),
    }  # fmt: skip
    return xr.Dataset(
        {
            name: ("suspension_event", values, {"units": units, "long_name": text})
            for name, (values, units, text) in told.items()
        }
    )


def stored_elements(table: xr.Dataset) -> xr.Dataset:
    """Return that table as it is in files: names of kinds and sides become numbers with their meaning."""
    out = table.rename({name: f"suspension_event_{name}" for name in table.data_vars})
    for name, names in (("kind", ELEMENT_KINDS), ("side", ELEMENT_SIDES)):
        out[f"suspension_event_{name}"] = flag_variable("suspension_event", table[name].values, names)
    return out


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
