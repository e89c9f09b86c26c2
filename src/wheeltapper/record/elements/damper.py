"""Results for a damper whose end can move: the motion of the end, the force, and the stops that it meets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.build import Lowered
from wheeltapper.march.common import program as contract
from wheeltapper.record.labels import flag_variable

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

KINDS = ("reached", "left")
"""Kinds of events of a damper's end: it reaches a stop, or leaves it."""
SIDES = ("lower", "upper")
"""Names of the two stops."""


def bush_energy(lowered: Lowered, ends: FloatArray) -> float:
    """Return the elastic energy of the bush (scaled), from a row of the dense output."""
    from wheeltapper.march.wheel import dense

    bush = lowered.program.numbers[contract.DAMPER_BUSH]
    return float(0.5 * ends[dense.OUT_DAMPER_FORCE] ** 2 / bush) if bush > 0.0 else 0.0


def stop_events(stops: FloatArray, unit: float, wheelset: NDArray[np.int64] | None) -> xr.Dataset:
    """Return the table of stops that ends meet and leave, with times in a unit, s, and numbers of several wheelsets."""
    import xarray as xr

    kinds = np.array(KINDS)[stops[:, contract.STOP_KIND].astype(int)]
    sides = np.where(stops[:, contract.STOP_SIDE] > 0.0, SIDES[1], SIDES[0])
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


def stored_events(table: xr.Dataset) -> xr.Dataset:
    """Return that table as it is in files: names become numbers with their meaning."""
    out = table.rename({name: f"damper_event_{name}" for name in table.data_vars})
    for name, names in (("kind", KINDS), ("side", SIDES)):
        out[f"damper_event_{name}"] = flag_variable("damper_event", table[name].values, names)
    return out
