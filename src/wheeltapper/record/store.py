"""Reading what was saved: scenarios, records, charts, branches and worn rails."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from wheeltapper.describe.scenario import Scenario, toml_table
from wheeltapper.describe.site import Site
from wheeltapper.describe.table.content import LARGEST
from wheeltapper.ground.arguments import as_path, as_quantity
from wheeltapper.ground.errors import InputError, brief
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower.contacts import SIDES
from wheeltapper.lower.door import lowered_scenario
from wheeltapper.march import run
from wheeltapper.march.common.kept import UNDAMAGED, rising, table
from wheeltapper.record.again import WITNESSES, marched_again
from wheeltapper.record.files.checksum import CHECKSUM, is_damaged
from wheeltapper.record.files.filled import KINDS, load_filled
from wheeltapper.record.files.stored import FORMAT, check_format, method_of, notes, status_of, version_of
from wheeltapper.record.labels import BRANCH_TITLE, WEAR_TITLE
from wheeltapper.record.own_law import law_again
from wheeltapper.record.record import Record
from wheeltapper.record.recordings.arrays import check_hdf5
from wheeltapper.record.saving import digest_of_inputs

LOADED = ".toml (a scenario or a site), .nc (a record) or .zarr (a chart or a data set)"
"""What `load` takes, for messages."""
TABLES_OPEN = 'the tables of events open with xarray.open_dataset(path, engine="h5netcdf")'
"""What can still be read of a record whose scenario cannot, for messages."""
RECORD = "a record saved by wheeltapper"
"""What a netCDF file must be, for messages."""


def load(path: str | Path, *, law: Callable[..., Any] | None = None, largest: float = LARGEST) -> Any:
    """Load a file by its suffix.

    .toml is a `Scenario` or a `Site`, .nc a record, a wear (which `wear_in` keeps) or a branch (of the command
    `orbits`), .zarr a chart or a data set. A chart or a data set that ``to_netcdf`` of xarray wrote is a .nc, too.

    Parameters
    ----------
    path
        Path of the file, or of the folder of a chart or data set.
    law
        For a record whose contact is a `Law` of your own: its Python function. The file has only the function's name,
        and loading imports nothing. The function must return the forces that are kept in the file.
    largest
        Largest unpacked size of a .nc file, bytes.

    Raises
    ------
    InputError
        If the file is missing, not one of these, damaged, or written by a newer format.
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
        return _load_record(path, law, largest) if suffix == ".nc" else load_filled(path)
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
    filled = KINDS.get(str(data.attrs.get("title")))
    if filled is not None:
        check_format(data.attrs.get("format", 0), filled.format)
        return data
    if data.attrs.get("format") is None or "march_events" not in data:
        raise InputError("", "", "a file that wheeltapper did not write", RECORD)
    version, scenario, method = version_of(data), _scenario_of(data, law), method_of(data)
    if version < FORMAT:
        from wheeltapper.record.files.earlier import read

        lowered, march = read(scenario, data)
        record = Record(lowered, method, march)
        record.notes = notes(data)
        return record
    if data.attrs.get("inputs") != digest_of_inputs(str(data.attrs["scenario"]), method):
        raise InputError("", "scenario", "another one than that of the record", UNDAMAGED)
    status, said = status_of(data), notes(data)
    lowered = lowered_scenario(scenario, method)
    held = {name: data[name].values for name in map(str, data.variables)}
    made_by = ", ".join(f"{name} {data.attrs.get(name, 'unknown')}" for name in ("wheeltapper", "numba", "numpy"))
    try:
        march = run.restored(lowered.program, status, held)
    except InputError:
        if CHECKSUM not in data.attrs:  # else the file is whole, and this version makes other paths of its scenario
            raise
        events, peaks = (table(held, f"march_{name}", None, None) for name in ("events", "peaks"))
        again, note = marched_again(lowered, events, made_by)
        warn_of([note])
        record = Record(lowered, method, again._replace(status=status, events=events, peaks=peaks))
        record.notes = (*said, note)
        return record
    kept = table(data, "witness", WITNESSES, None, anything=True, ends=True)
    return Record.of_file(lowered, method, march, said, made_by, kept)


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
        own = error.field.endswith("type")  # perhaps of a class that is not defined here
        allowed = f"{error.allowed}; or its class, defined before loading; {TABLES_OPEN}" if own else error.allowed
        raise InputError("", f"scenario, {error.field}", error.found, allowed) from None
    except (ValueError, RecursionError):
        name = re.search(r"<function (\S+)", text)
        found = f"a Python function{f' ({name[1]})' if name else ''}, which a file cannot hold"
        found = found if text.startswith("Scenario(") else repr(text[:60])
        raise InputError("", "scenario", found, f"a scenario without a Profile; {TABLES_OPEN}") from None


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
