"""Records on disk: netCDF that opens in plain xarray, and contains the dense solution."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from wheeltapper.describe.contact.law import Law
from wheeltapper.describe.scenario import Scenario, toml_table
from wheeltapper.describe.site import Site
from wheeltapper.describe.table.content import LARGEST
from wheeltapper.ground.arguments import as_path, as_quantity
from wheeltapper.ground.errors import InputError, brief
from wheeltapper.ground.needs import DAMPER_END, KINKS
from wheeltapper.record import damper, suspension
from wheeltapper.record.chart_store import load_chart
from wheeltapper.record.checksum import is_damaged
from wheeltapper.record.contacts import SIDES, SURFACES
from wheeltapper.record.kinds import kind_of
from wheeltapper.record.labels import BRANCH_TITLE, EVENT_KINDS, WEAR_TITLE, attributes_of, flag_variable
from wheeltapper.record.own_law import law_again, stored_law
from wheeltapper.record.reading_arrays import check_hdf5
from wheeltapper.record.record import Record
from wheeltapper.record.stored import FORMAT, UNDAMAGED, method_of, notes, rising, table, version_of


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


LOADED = ".toml (a scenario or a site), .nc (a record) or .zarr (a chart)"
"""What `load` takes, for messages."""
RECORD = "a record saved by wheeltapper"
"""What a netCDF file must be, for messages."""


def load(path: str | Path, *, law: Callable[..., Any] | None = None, largest: float = LARGEST) -> Any:
    """Load by suffix: .toml is a `Scenario` or a `Site`, .nc a record, a wear or a branch, .zarr a chart.

    A wear is what `wear_in` keeps in a file, a branch what the command `orbits` writes.

    Parameters
    ----------
    path
        Path of the file, or of the folder of a chart.
    law
        For a record with a contact of one's own, a `Law`: its Python function. A file names it but does not hold it,
        and loading imports nothing; the function given has to return the forces that the file has kept.
    largest
        Largest unpacked size of a .nc file, bytes.

    Raises
    ------
    InputError
        If the file is missing, foreign, damaged, or written by a newer format.
    """
    path, largest = as_path(path, "path", f"the path of a file: {LOADED}"), as_quantity(largest, "largest", "number")
    suffix = path.suffix.lower()
    if suffix not in (".toml", ".nc", ".zarr"):
        raise InputError(str(path), "", f"the suffix {path.suffix!r}" if path.suffix else "no suffix", LOADED)
    if path.is_dir() != (suffix == ".zarr") or not path.exists():
        found = "a folder" if path.is_dir() else "a file" if path.exists() else "no such file or folder"
        raise InputError(str(path), "", found, LOADED)
    if suffix == ".toml":
        is_site = not {"passage", "sensor", "sensors"}.isdisjoint(toml_table(path, "a scenario or a site"))
        return Site.from_toml(path) if is_site else Scenario.from_toml(path)
    try:
        return _load_record(path, law, largest) if suffix == ".nc" else load_chart(path)
    except InputError as error:
        raise error.at(str(path)) from None


def _load_record(path: Path, law: Any, largest: float) -> Any:
    import xarray as xr

    try:
        check_hdf5(path, largest)
        with xr.open_dataset(path, engine="h5netcdf") as opened:
            data = opened.load()
    except InputError:
        raise
    except Exception as error:  # h5py and xarray raise many kinds of errors for a damaged file
        raise InputError("", "", f"no readable netCDF file ({brief(error)})", RECORD) from error
    if is_damaged(data):
        raise InputError("", "", "a damaged file", UNDAMAGED)
    if data.attrs.get("title") == WEAR_TITLE:
        return check_wear(data)
    if data.attrs.get("title") == BRANCH_TITLE:
        return check_branch(data)
    if data.attrs.get("format") is None or "march_steps" not in data:
        raise InputError("", "", "a file that wheeltapper did not write", RECORD)
    version_of(data)
    scenario = _scenario_of(data, law)
    return Record(scenario, method_of(data), *kind_of(scenario).read(scenario, data))


def _scenario_of(data: Any, law: Any = None) -> Scenario:
    """Return the scenario in a file; `law` is the function of its contact, where this is a `Law`."""
    text = str(data.attrs.get("scenario", ""))
    try:
        table = json.loads(text)
        contact = table.get("contact") if isinstance(table, dict) else None
        if isinstance(contact, dict) and contact.get("type") == "Law":
            table["contact"] = law_again(contact, law)
        elif law is not None:
            raise InputError("", "law", "a function", "none, as this record's contact is no `Law`")
        return Scenario.of(table)
    except InputError as error:
        raise InputError("", f"scenario, {error.field}", error.found, error.allowed) from None
    except (ValueError, RecursionError):
        found = "a Python function, which a file cannot hold" if text.startswith("Scenario(") else repr(text[:60])
        raise InputError("", "scenario", found, "a scenario without a Profile") from None


def check_branch(data: Any) -> Any:
    """Return a branch of orbits; refuse a damaged one."""
    points, special = (data.sizes.get(name, -1) for name in ("point", "special"))
    for name in (str(data.attrs.get("parameter")), "displacement", "velocity", "largest_force"):
        table(data, name, points)
    table(data, "parameter", special)
    return data


def check_wear(data: Any) -> Any:
    """Return a result of `wear_in`; refuse a damaged one."""
    passes, kept = (data.sizes.get(name, -1) for name in ("pass", "kept"))
    for name in ("speed", "largest_force"):
        table(data, name, passes, ends=True)
    for name, along in (("height", "position"), ("permanent_indentation", "position"), ("amplitude", "wavelength")):
        sides = (len(SIDES[:2]),) if "side" in data.dims else ()
        table(data, name, kept, *sides, data.sizes.get(along, -1))
    table(data, "position", data.sizes.get("position", -1))
    rising("kept", table(data, "kept", kept), passes)
    notes(data)
    return data
