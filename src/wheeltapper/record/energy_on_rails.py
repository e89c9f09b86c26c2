"""The energy balance of a vehicle on rails that give way."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.lower.on_rails import LoweredOnRails
from wheeltapper.march import run

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.general.task import Marched

MEANINGS = {
    "kinetic": "change of kinetic energy of the vehicle",
    "elastic": "change of elastic energy of the vehicle's springs",
    "dissipated": "energy dissipated in the vehicle's dampers",
    "into_contact": "energy that the contacts took: that of their elastic compression, and what they dissipated",
    "into_track": "energy that the contact forces gave to the track",
    "work_of_load": "work of load and weight",
    "work_of_irregularity": "work of the irregularity",
    "imbalance": "what is left of the vehicle's balance",
}


def balance(lowered: LoweredOnRails, march: Marched) -> xr.Dataset:
    """Return the energy balance of the vehicle over the whole run, in J.

    The vehicle has exchanged energy with loads and contacts; what the contacts took of it, beside the work of the
    irregularity, is in them or has gone to the track. `relative_imbalance` divides by the energy exchanged: the
    magnitudes of all works.
    """
    import xarray as xr

    found, rails = run.works_on_rails(march), lowered.force
    kinetic, elastic = found.ends[1] - found.ends[0]
    taken, path, contact = (float(one.sum()) for one in (found.bodies, found.path, found.contact))
    imbalance = kinetic + elastic + found.dissipated + taken - found.load
    values = {
        "kinetic": kinetic, "elastic": elastic, "dissipated": found.dissipated, "into_contact": contact,
        "into_track": taken + path - contact, "work_of_load": found.load, "work_of_irregularity": path,
        "imbalance": imbalance,
    }  # fmt: skip
    exchanged = found.dissipated + float(np.abs(found.bodies).sum() + np.abs(found.path).sum()) + abs(found.load)
    variables = {
        name: ((), value * rails, {"units": "J", "long_name": MEANINGS[name]}) for name, value in values.items()
    }
    share = {"units": "", "long_name": "imbalance over energy exchanged"}
    return xr.Dataset(variables | {"relative_imbalance": ((), imbalance / max(exchanged, 1e-300), share)})
