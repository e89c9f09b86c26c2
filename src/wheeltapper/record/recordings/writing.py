"""Writing recordings as text, numpy or netCDF; `read_recording` reads equal ones back."""

from __future__ import annotations

import gzip
import io
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from wheeltapper.describe.sensitivity import QUANTITIES
from wheeltapper.ground.arguments import as_path
from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.given import as_recording
from wheeltapper.record.recordings.recording import Recording
from wheeltapper.record.recordings.units import SI

SUFFIXES = ".csv, .csv.gz, .npz, .nc"
"""Suffixes of the files that can be written, for messages."""


def write_recording(recording: Recording | str | Path, path: str | Path) -> Path:
    """Write a recording; `read_recording` returns an equal one, except for its source.

    The file is complete or absent: it is written under another name and then renamed.

    Parameters
    ----------
    recording
        A recording of any quantity, or the path of its file. Parts of its truth that JSON cannot express are written
        as text.
    path
        .csv, .csv.gz (SI units, every digit), .npz or .nc.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    InputError
        If the suffix is another one, or the place cannot be written.
    """
    recording, path = as_recording(recording), as_path(path, "path", f"a path with the suffix {SUFFIXES}")
    name = path.name.lower()
    writer = next((write for suffix, write in WRITERS.items() if name.endswith(suffix)), None)
    if writer is None:
        raise InputError(str(path), "path", f"the suffix {path.suffix!r}", SUFFIXES)
    beside = path.with_name(f".{os.getpid()}-{path.name}")
    try:
        writer(recording, beside)
        beside.replace(path)
    except OSError as error:
        found = f"a place that cannot be written ({error.strerror or error})"
        raise InputError(str(path), "path", found, "a writable path") from error
    finally:
        beside.unlink(missing_ok=True)
    return path


def _recording_facts(recording: Recording) -> dict[str, Any]:
    """Return the facts of a recording, without its samples."""
    facts: dict[str, Any] = {
        "quantity": recording.quantity,
        "unit": SI[recording.quantity],
        "rate": float(recording.rate),
        "start": float(recording.start),
    }
    if recording.speed is not None:
        facts["speed"] = float(recording.speed)
    facts["source"] = recording.source
    facts["notes"] = json.dumps(list(recording.notes))
    facts["truth"] = json.dumps(recording.truth, default=_as_json)
    return facts


def _as_json(value: object) -> object:
    """Return an array, a model, or any other object in a form that JSON can express."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    dump = getattr(value, "model_dump", None)
    return dump(mode="json") if dump else str(value)


def _text_lines(recording: Recording) -> str:
    si = {"rate": " Hz", "start": " s", "speed": " m/s"}
    lines = io.StringIO()
    lines.write("# wheeltapper recording\n")
    for name, fact in _recording_facts(recording).items():
        lines.write(f"# {name}: {fact!r}{si[name]}\n" if name in si else f"# {name}: {' '.join(str(fact).split())}\n")
    dimension, unit = QUANTITIES[recording.quantity], SI[recording.quantity]
    lines.write(f"t [s],{dimension} [{unit}],clipped\n")
    marks = recording.clipped.astype(int).tolist()
    rows = zip(recording.times.tolist(), recording.samples.tolist(), marks, strict=True)
    lines.writelines(f"{t!r},{a!r},{c}\n" for t, a, c in rows)
    return lines.getvalue()


def _write_csv(recording: Recording, path: Path) -> None:
    path.write_text(_text_lines(recording), encoding="utf-8")


def _csv_gz(recording: Recording, path: Path) -> None:
    path.write_bytes(gzip.compress(_text_lines(recording).encode(), mtime=0))


def _write_npz(recording: Recording, path: Path) -> None:
    facts: dict[str, Any] = {name: np.array(fact) for name, fact in _recording_facts(recording).items()}
    with path.open("wb") as file:
        np.savez_compressed(file, samples=recording.samples, clipped=recording.clipped, **facts)


def _write_netcdf(recording: Recording, path: Path) -> None:
    import xarray as xr

    facts = _recording_facts(recording)
    samples = ("time", recording.samples, {"units": facts["unit"], "long_name": recording.quantity})
    clipped = ("time", recording.clipped.astype(np.int8), {"long_name": "at the end of the sensor's range"})
    time = ("time", recording.times, {"units": "s", "long_name": "time after the trigger"})
    data = xr.Dataset(
        {"samples": samples, "clipped": clipped}, {"time": time}, {"title": "wheeltapper recording", **facts}
    )
    data.to_netcdf(path, engine="h5netcdf", format="NETCDF4")


WRITERS: dict[str, Callable[[Recording, Path], None]] = {
    ".csv": _write_csv, ".csv.gz": _csv_gz, ".npz": _write_npz, ".nc": _write_netcdf,
}  # fmt: skip
