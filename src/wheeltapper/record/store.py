"""Records on disk: netCDF that opens in plain xarray and holds all that is needed to answer any time again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from wheeltapper._version import __version__
from wheeltapper.describe.scenario import Scenario, toml_table
from wheeltapper.describe.site import Site
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.build import Lowered
from wheeltapper.lower.table import Table
from wheeltapper.march import program as contract
from wheeltapper.march.program import ELASTIC, PLAIN, Program
from wheeltapper.record import damper
from wheeltapper.record.chart_store import load_chart
from wheeltapper.record.checksum import is_damaged
from wheeltapper.record.labels import EVENT_KINDS, WEAR_TITLE
from wheeltapper.record.record import Record
from wheeltapper.record.wagon_record import WagonRecord
from wheeltapper.record.wagon_store import wagon_record, wagon_tables

FORMAT = 1
"""Version of the files' layout; a newer file is refused."""
WHEEL = ("wheelset", "side", "surface")
"""Columns that say which wheel of a wagon is meant."""


def save(record: Record, path: Path) -> None:
    """Write a record as netCDF."""
    import xarray as xr

    march = record._march
    events = record.events.rename(time="event_time", contact="event_contact")
    kinds = np.array([EVENT_KINDS.index(kind) for kind in events.kind.values], dtype=np.int8)
    meaning = {
        "flag_values": np.arange(len(EVENT_KINDS), dtype=np.int8), "flag_meanings": " ".join(EVENT_KINDS),
    }  # fmt: skip
    events["kind"] = ("event", kinds, meaning)
    peaks = record.peaks.rename(time="peak_time", contact="peak_contact", normal_force="peak_normal_force")
    peaks["corner"] = peaks.corner.astype(np.int8)
    if isinstance(record, WagonRecord):
        events = events.rename({name: f"event_{name}" for name in WHEEL})
        peaks = peaks.rename({name: f"peak_{name}" for name in WHEEL})
    tables = {
        "march_steps": (("step", "step_column"), march.steps),
        "march_events": (("event", "event_column"), march.events),
        "march_peaks": (("peak", "peak_column"), march.peaks),
        "march_state": (("state",), march.state),
    }
    special, more = wagon_tables(record) if isinstance(record, WagonRecord) else _wheelset_tables(record)
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
    if "program_damper" in tables:
        parts.append(damper.flagged(record.damper_events))
    data = xr.merge(parts, combine_attrs="override").assign_attrs(attributes)
    for name, value in record.energy.data_vars.items():
        data[f"energy_{name}"] = value
    try:
        data.to_netcdf(path, engine="h5netcdf")
    except OSError as error:
        raise InputError(
            str(path), "output", f"a place that cannot be written ({error.strerror or error})", "a writable path"
        ) from error


def _wheelset_tables(record: Record) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the tables and attributes that only a core model has."""
    lowered = record._lowered
    tables = {
        "program_pieces": (("piece", "piece_column"), lowered.program.pieces),
        "program_numbers": (("number",), lowered.program.numbers),
        "units": (("unit",), np.array(_units(lowered))),
    }
    if len(lowered.program.law):
        tables["program_law"] = (("law_piece", "law_column"), lowered.program.law)
    if len(lowered.program.damper):
        tables["program_damper"] = (("damper_entry",), lowered.program.damper)
        tables["march_stops"] = (("damper_event", "stop_column"), record._stops)
    return tables, {"loop": [lowered.table.loop, lowered.table.loop_join]}


def _units(lowered: Lowered) -> list[float]:
    return [lowered.length, lowered.time, lowered.force, lowered.static_force, lowered.contact_constant]


def _scenario_text(scenario: Scenario) -> str:
    """Return the scenario as JSON, or its printed form where it holds a Python function."""
    try:
        return json.dumps(scenario.model_dump(mode="json"))
    except ValueError:
        return repr(scenario)


def load(path: str | Path) -> Any:
    """Load by suffix: .toml gives a `Scenario` or a `Site`, .nc a record or what `wear_in` wrote, .zarr a chart.

    Raises
    ------
    InputError
        If the file is missing, foreign, or written by a newer format.
    """
    path = Path(path)
    if path.suffix == ".toml":
        return (
            Site.from_toml(path) if "passage" in toml_table(path, "a scenario or a site") else Scenario.from_toml(path)
        )
    if path.suffix == ".nc":
        return _load_record(path)
    if path.suffix == ".zarr":
        return load_chart(path)
    raise InputError(
        str(path), "", f"the suffix {path.suffix!r}", ".toml (a scenario or a site), .nc (a record) or .zarr (a chart)"
    )


def _load_record(path: Path) -> Any:
    import xarray as xr

    from wheeltapper.march.single import March

    try:
        with xr.open_dataset(path, engine="h5netcdf") as opened:
            data = opened.load()
    except Exception as error:  # of a damaged file HDF5 says whatever it stumbles over
        reason = str(error).partition("\n")[0]
        raise InputError(
            str(path), "", f"no readable netCDF file ({reason})", "a record saved by wheeltapper"
        ) from error
    if is_damaged(data):
        raise InputError(str(path), "", "a damaged file", "a file as wheeltapper wrote it")
    if data.attrs.get("title") == WEAR_TITLE:
        return data
    version = data.attrs.get("format")
    if version is None or "march_steps" not in data:
        raise InputError(str(path), "", "a file that wheeltapper did not write", "a record saved by wheeltapper")
    if int(version) > FORMAT:
        raise InputError(
            str(path), "format", str(version), f"at most {FORMAT}; wheeltapper {__version__} cannot read it"
        )
    try:
        scenario = Scenario.model_validate(json.loads(data.attrs["scenario"]))
    except ValueError as error:
        raise InputError(
            str(path), "scenario", "a Python function, which a file cannot hold", "a scenario without a Profile"
        ) from error
    if isinstance(scenario.vehicle, Wagon):
        return wagon_record(scenario, data)
    numbers = data.program_numbers.values
    length, time, force, static, constant = (float(v) for v in data.units.values)
    law = np.ascontiguousarray(data.program_law.values) if "program_law" in data else ELASTIC
    ended = "program_damper" in data
    program = Program(
        np.ascontiguousarray(data.program_pieces.values), numbers, law, data.program_damper.values if ended else PLAIN
    )
    loop, join = (int(v) for v in data.attrs["loop"])
    lowered = Lowered(
        program, Table(program.pieces, loop, join), length, time, force, static, constant,
        tuple(json.loads(data.attrs["notes"])),
    )  # fmt: skip
    steps, events, peaks = (np.ascontiguousarray(data[f"march_{name}"].values) for name in ("steps", "events", "peaks"))
    march = March(int(data.attrs["status"]), steps, events, peaks, data.march_state.values[: contract.LENGTH])
    stops = data.march_stops.values if ended else damper.NO_STOPS
    return Record(scenario, str(data.attrs["method"]), lowered, march, stops)
