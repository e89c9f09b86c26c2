"""What can be taken from a page: the scene, its record, histories, pictures, the map."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from wheeltapper.faces.explore.sampling import Part, channels_of, times_of
from wheeltapper.faces.explore.scenes import python_of, toml_of
from wheeltapper.faces.explore.session import Session
from wheeltapper.ground.errors import InputError, with_suggestion
from wheeltapper.record.record import Record

_drawing = threading.Lock()
"""Pictures are drawn one after the other: matplotlib's style sheet holds for the whole process."""


class Export(NamedTuple):
    """A file to take: what it is in words, its type, and what makes its contents."""

    words: str
    kind: str
    make: Callable[[Session], bytes]


def _record(session: Session) -> Record:
    return session.marched(lambda: False, lambda line: None)


def _netcdf(session: Session) -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "record.nc"
        _record(session).save(path)
        return path.read_bytes()


def _picture(suffix: str, what: Callable[[Session], Any]) -> Callable[[Session], bytes]:
    return lambda session: picture(what(session), suffix)


def picture(what: Any, suffix: str) -> bytes:
    """Return a picture of a result as `wheeltapper.plot` draws it."""
    from wheeltapper.faces.plot import plot

    out = io.BytesIO()
    with _drawing:
        plot(what).savefig(out, format=suffix, bbox_inches="tight", dpi=150)
    return out.getvalue()


def _history(session: Session) -> bytes:
    """Return the histories as CSV: uniform times with all events and maxima, each column with its unit."""
    import numpy as np

    record = _record(session)
    history = Part(record._variables_at(times_of(record)))
    channels = channels_of(history, record._contacts.has_sides)
    names = ["time [s]", *(f"{one.key.replace('|', ', ')} [{one.unit}]" for one in channels)]
    out = io.StringIO()
    rows = np.column_stack([history.time, *(one.of(history) for one in channels)])
    header = ",".join(f'"{name}"' if "," in name else name for name in names)
    np.savetxt(out, rows, "%.9g", ",", header=header, comments="")
    return out.getvalue().encode()


def _events(session: Session) -> bytes:
    table = _record(session).events
    units = {name: held.attrs.get("units") for name, held in table.variables.items()}
    renamed = {name: f"{name} [{unit}]" for name, unit in units.items() if unit}
    return str(table.to_dataframe().rename(columns=renamed).to_csv(index=False)).encode()


def _map_netcdf(session: Session) -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "map.nc"
        _chart(session).to_netcdf(path, engine="h5netcdf")
        return path.read_bytes()


def _chart(session: Session) -> Any:
    if session.map is None:
        raise InputError("", "map", "no map", "a filled map")
    return session.map.chart()


EXPORTS = {
    "scene.toml": Export("scene, TOML", "application/toml", lambda session: toml_of(session.scene).encode()),
    "scene.py": Export("scene, Python", "text/x-python", lambda session: python_of(session.scene).encode()),
    "run.png": Export("run, PNG", "image/png", _picture("png", _record)),
    "run.svg": Export("run, SVG", "image/svg+xml", _picture("svg", _record)),
    "history.csv": Export("histories, CSV", "text/csv", _history),
    "events.csv": Export("events, CSV", "text/csv", _events),
    "record.nc": Export("record, netCDF", "application/x-netcdf", _netcdf),
    "map.png": Export("map, PNG", "image/png", _picture("png", _chart)),
    "map.svg": Export("map, SVG", "image/svg+xml", _picture("svg", _chart)),
    "map.nc": Export("map, netCDF", "application/x-netcdf", _map_netcdf),
}
"""Everything that can be taken, by the name of its file."""


def exported(session: Session, name: str) -> tuple[bytes, str]:
    """Return the contents of a file to take, and their type.

    Raises
    ------
    InputError
        If there is no such file, or nothing in it.
    """
    if name not in EXPORTS:
        raise InputError("", "export", repr(name), with_suggestion(name, EXPORTS))
    export = EXPORTS[name]
    return export.make(session), export.kind
