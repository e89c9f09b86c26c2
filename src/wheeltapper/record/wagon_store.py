"""A wagon's assembly on disk, beside the tables of its record: one array with a list of its parts."""

from __future__ import annotations

import json
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.structure import structure_of
from wheeltapper.lower.wagon import LoweredWagon, layout_of
from wheeltapper.march.assembly import Assembly
from wheeltapper.record.stored import UNDAMAGED, attribute, check, method_of, notes, table, whole
from wheeltapper.record.wagon_checks import ROWS_LIKE_A_WHEELS, check_assembly, march_of
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
        ROWS_LIKE_A_WHEELS: 1,
        "evaluations": march.evaluations,
    }
    return tables, attributes


def wagon_record(scenario: Scenario, data: xr.Dataset) -> WagonRecord:
    """Return the record of a wagon from a file's contents; refuse contents that no march can have written."""
    structure = structure_of(scenario.vehicle)
    layout = layout_of(scenario, structure)
    assembly = _assembly(data)
    check_assembly(assembly, scenario, layout)
    static = table(data, "static_force", len(scenario.vehicle.axles), 2)
    check("static_force", static, static > 0.0, "positive forces")
    lowered = LoweredWagon(
        assembly, layout, structure, static, attribute(data, "contact_constant", float), notes(data)
    )  # fmt: skip
    return WagonRecord(scenario, method_of(data), lowered, march_of(data, assembly, scenario))


def _assembly(data: xr.Dataset) -> Assembly:
    """Return the assembly from the array that holds all of its parts."""
    held = table(data, "assembly", None, ends=True)
    at, parts = 0, dict[str, Any]()
    for entry in attribute(data, "assembly_parts", list):
        try:
            name, shape, kind = entry
            size = prod(shape)
            fits = name not in parts and min(shape, default=0) >= 0 and at + size <= len(held) and kind in "fi"
        except (TypeError, ValueError):
            fits = False
        if not fits:
            raise InputError("", "assembly_parts", repr(entry)[:80], UNDAMAGED)
        part = held[at : at + size].reshape(shape)
        if kind == "i":
            whole(f"assembly, {name}", part, -(2**31), 2**31)
            part = part.astype(np.int64)
        parts[name], at = np.ascontiguousarray(part), at + size
    if tuple(parts) != Assembly._fields or at != len(held):
        raise InputError("", "assembly_parts", f"{len(parts)} parts with {at} numbers", UNDAMAGED)
    return Assembly(**parts)
