"""Records on disk: netCDF that opens in plain xarray, and from which the dense solution comes back."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.describe.contact.law import Law
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import DAMPER_END, KINKS
from wheeltapper.lower.contacts import SIDES, SURFACES
from wheeltapper.record.elements import stored_table
from wheeltapper.record.files.checksum import CHECKSUM, checksum
from wheeltapper.record.files.stored import FORMAT
from wheeltapper.record.labels import EVENT_KINDS, attributes_of, flag_variable
from wheeltapper.record.own_law import stored_law

if TYPE_CHECKING:
    from wheeltapper.record.record import Record

LOG = "march_"
"""What stands before the names of a march's log."""


def save(record: Record, path: Path) -> None:
    """Write a record as netCDF; its tables have the axis `contact`, which `contact_wheelset` and the like name.

    The file holds the scenario with the contents of all files that it names, and the march's log: lowering the scenario
    again gives the program back.
    """
    import xarray as xr

    march, contacts = record._kept_march, record._contacts
    events = record.events.drop_vars(contacts.axis_names | {"surface": 0}, errors="ignore")
    events = events.rename(time="event_time", contact="event_contact")
    events["kind"] = flag_variable("event", events.kind.values, EVENT_KINDS)
    peaks = record.peaks.drop_vars(contacts.axis_names | {"surface": 0}, errors="ignore")
    peaks = peaks.rename(time="peak_time", contact="peak_contact", normal_force="peak_normal_force")
    peaks["corner"] = peaks.corner.astype(np.int8)
    named = contacts.labels
    static = np.pad(contacts.static_force, (0, len(contacts.lanes) - len(contacts.static_force)))
    tables = {
        "contact_wheelset": ("contact", named["wheelset"], attributes_of("wheelset")),
        "contact_side": flag_variable("contact", named["side"], SIDES),
        "contact_surface": flag_variable("contact", named["surface"], SURFACES),
        "static_force": ("contact", static, attributes_of("static_force", contacts.has_sides)),
        "witness": (("witness_time", "wheel"), record._witness),
    }
    for name, values in march.log(record._lowered.program).items():
        tables[LOG + name] = tuple(f"{LOG}{name}_{axis}" for axis in range(values.ndim)), values
    scenario = scenario_text(record.scenario)
    attributes: dict[str, Any] = {
        "format": FORMAT,
        "title": "wheeltapper record",
        "outcome": record.outcome.name,
        "status": march.status,
        "summary": str(record),
        "scenario": scenario,
        "inputs": digest_of_inputs(scenario, record.method),
        "notes": json.dumps(list(record.notes)),
        **record.provenance,
    }
    parts = [events, peaks, xr.Dataset(tables)]
    if DAMPER_END in record.scenario.needs:
        parts.append(stored_table(record.damper_events))
    if record.scenario.needs & KINKS:
        parts.append(stored_table(record.suspension_events))
    data = xr.merge(parts, combine_attrs="override").assign_attrs(attributes)
    energy = record._known_energy
    for share, value in (energy.data_vars if energy is not None else {}).items():
        data[f"energy_{share}"] = value
    data.attrs[CHECKSUM] = checksum(data)
    try:
        data.to_netcdf(path, engine="h5netcdf")
    except OSError as error:
        raise InputError(
            str(path), "output", f"a place that cannot be written ({error.strerror or error})", "a writable path"
        ) from error


def scenario_text(scenario: Scenario) -> str:
    """Return the scenario as JSON, or its printed form if it holds a Python function that is no contact's law.

    The contents of files stand in place of their paths.
    """
    law = scenario.contact if isinstance(scenario.contact, Law) else None
    try:
        whole = scenario._with_data()
        plain = whole if law is None else whole.model_copy(update={"contact": None})
        own = {} if law is None else {"contact": stored_law(law)}
        return json.dumps(plain.model_dump(mode="json") | own)
    except ValueError:
        return repr(scenario)


def digest_of_inputs(scenario: str, method: str) -> str:
    """Return the identity of a record: a digest of what it was made of, and of the file's format."""
    return sha256(json.dumps([FORMAT, method, scenario]).encode()).hexdigest()
