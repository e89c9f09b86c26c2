"""Records on disk: netCDF that opens in plain xarray, and contains the dense solution."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.describe.contact.law import Law
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import DAMPER_END, KINKS
from wheeltapper.record.contacts import SIDES, SURFACES
from wheeltapper.record.elements import damper, suspension
from wheeltapper.record.files.stored import FORMAT
from wheeltapper.record.labels import EVENT_KINDS, attributes_of, flag_variable
from wheeltapper.record.own_law import stored_law

if TYPE_CHECKING:
    from wheeltapper.record.record import Record


def save(record: Record, path: Path) -> None:
    """Write a record as netCDF; its tables have the axis `contact`, which `contact_wheelset` and the like name."""
    import xarray as xr

    march, contacts = record._march, record._contacts
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
        "march_steps": (("step", "step_column"), march.steps),
        "march_events": (("march_event", "event_column"), march.events),
        "march_peaks": (("peak", "peak_column"), march.peaks),
        "march_state": (("state",), march.state),
    }
    special, more = record._kind.tables(record._lowered, march)
    tables |= special
    attributes: dict[str, Any] = {
        "format": FORMAT,
        "title": "wheeltapper record",
        "outcome": record.outcome.name,
        "status": march.status,
        "summary": str(record),
        "scenario": _scenario_text(record.scenario),
        "notes": json.dumps(list(record.notes)),
        **more,
        **record.provenance,
    }
    parts = [events, peaks, xr.Dataset(tables)]
    if DAMPER_END in record.scenario.needs:
        parts.append(damper.stored_events(record.damper_events))
    if record.scenario.needs & KINKS:
        parts.append(suspension.stored_events(record.suspension_events))
    data = xr.merge(parts, combine_attrs="override").assign_attrs(attributes)
    energy = record._known_energy
    for name, value in (energy.data_vars if energy is not None else {}).items():
        data[f"energy_{name}"] = value
    try:
        data.to_netcdf(path, engine="h5netcdf")
    except OSError as error:
        raise InputError(
            str(path), "output", f"a place that cannot be written ({error.strerror or error})", "a writable path"
        ) from error


def _scenario_text(scenario: Scenario) -> str:
    """Return the scenario as JSON, or its printed form if it holds a Python function that is no contact's law."""
    law = scenario.contact if isinstance(scenario.contact, Law) else None
    try:
        plain = scenario if law is None else scenario.model_copy(update={"contact": None})
        own = {} if law is None else {"contact": stored_law(law)}
        return json.dumps(plain.model_dump(mode="json") | own)
    except ValueError:
        return repr(scenario)
