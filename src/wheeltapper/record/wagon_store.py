"""What a wagon's record needs on disk beside its tables: the assembly, as one array with a list of its parts."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.structure import structure_of
from wheeltapper.lower.wagon import LoweredWagon, layout_of
from wheeltapper.march.assembly import Assembly
from wheeltapper.march.multibody import MultibodyMarch
from wheeltapper.record.wagon_record import WagonRecord

if TYPE_CHECKING:
    import xarray as xr


def wagon_tables(record: WagonRecord) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the tables and attributes that only a wagon's record has."""
    lowered, march = record._lowered, record._march
    parts = lowered.assembly._asdict()
    tables = {
        "assembly": ("assembly_entry", np.concatenate([np.ravel(part).astype(float) for part in parts.values()])),
        "march_states": (("step", "state"), march.states),
        "static_force": (
            ("wheelset", "side"),
            lowered.static_force,
            {"units": "N", "long_name": "static normal force"},
        ),
    }
    attributes = {
        "assembly_parts": json.dumps([[name, part.shape, part.dtype.kind] for name, part in parts.items()]),
        "contact_constant": lowered.contact_constant,
        "end": march.end,
        "evaluations": march.evaluations,
    }
    return tables, attributes


def wagon_record(scenario: Scenario, data: xr.Dataset) -> WagonRecord:
    """Return the record of a wagon from a file's contents."""
    whole, at = data.assembly.values, 0
    parts: dict[str, Any] = {}
    for name, shape, kind in json.loads(data.attrs["assembly_parts"]):
        size = int(np.prod(shape))
        part = np.ascontiguousarray(whole[at : at + size].reshape(shape))
        parts[name] = part.astype(np.int64) if kind == "i" else part
        at += size
    structure = structure_of(scenario.vehicle)
    lowered = LoweredWagon(
        Assembly(**parts), layout_of(scenario, structure), structure, data.static_force.values,
        float(data.attrs["contact_constant"]), tuple(json.loads(data.attrs["notes"])),
    )  # fmt: skip
    steps, states, events, peaks = (
        np.ascontiguousarray(data[f"march_{name}"].values) for name in ("steps", "states", "events", "peaks")
    )
    march = MultibodyMarch(
        int(data.attrs["status"]), steps, states, events, peaks, float(data.attrs["end"]), data.march_state.values,
        int(data.attrs["evaluations"]),
    )  # fmt: skip
    return WagonRecord(scenario, str(data.attrs["method"]), lowered, march)
