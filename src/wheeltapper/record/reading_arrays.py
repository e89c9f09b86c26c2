"""Recordings in files of arrays: WAV, MATLAB, numpy, netCDF; TDMS and MDF where their packages are installed."""

from __future__ import annotations

import importlib
import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError
from wheeltapper.record.reading_table import CLIPPED, INTERVALS, RATES, Column, Table, positive, rate_fact
from wheeltapper.record.reading_units import name_and_unit

UNIT_NAMES = ("unit", "units")


def read_wav(path: Path) -> Table:
    """Return the channels of a WAV file; of integers, 1 is full scale."""
    from scipy.io import wavfile

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            rate, samples = wavfile.read(path)
        except (ValueError, EOFError, OSError, TypeError, ZeroDivisionError) as error:
            raise _unreadable("WAV", error) from None
        except Exception as error:  # struct.error of a header cut short
            raise _unreadable("WAV", error) from None
    notes = [str(w.message).split("\n")[0] for w in caught if "non-data" not in str(w.message)]
    integer = samples.dtype.kind in "iu"
    if integer:
        bits = 8 * samples.dtype.itemsize
        samples = (samples.astype(float) - (128.0 if bits == 8 else 0.0)) / 2.0 ** (bits - 1)
    channels = samples.reshape(len(samples), -1).T
    columns = tuple(Column(f"channel {k}", channel) for k, channel in enumerate(channels))
    return Table(columns, {"rate": float(rate), "notes": notes}, full_scale=integer)


def read_npy(path: Path) -> Table:
    """Return a vector, the columns of a matrix, or the fields of a structured array."""
    array = _loaded(path)
    if array.dtype.names:
        fields = [(name, *name_and_unit(name)) for name in array.dtype.names]
        return Table(tuple(Column(name, array[key].ravel(), unit) for key, name, unit in fields))
    return Table(tuple(_spread("", array)))


def read_npz(path: Path) -> Table:
    """Return the vectors of an .npz file, and the numbers and texts beside them."""
    with _loaded(path) as archive:
        try:
            return _from_variables({name: archive[name] for name in archive.files})
        except (ValueError, OSError, EOFError) as error:
            if isinstance(error, InputError):
                raise
            raise _unreadable("numpy", error) from None


def _loaded(path: Path) -> Any:
    import zipfile

    try:
        return np.load(path, allow_pickle=False)
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise _unreadable("numpy", error) from None


def read_mat(path: Path) -> Table:
    """Return the variables of a MATLAB file, up to v7 by scipy, v7.3 by h5py."""
    from scipy.io import loadmat

    h5py = importlib.import_module("h5py")
    try:
        if h5py.is_hdf5(path):
            return _from_variables(_hdf5_variables(h5py, path))
        variables = loadmat(path)
    except InputError:
        raise
    except Exception as error:  # scipy's readers fail in many ways on a broken file
        raise _unreadable("MATLAB", error) from None
    return _from_variables({name: value for name, value in variables.items() if not name.startswith("__")})


def _hdf5_variables(h5py: Any, path: Path) -> dict[str, Any]:
    """Return the arrays at the root of an HDF5 file, in MATLAB's order of dimensions."""
    variables: dict[str, Any] = {}
    with h5py.File(path, "r") as file:
        for name, value in file.items():
            if not isinstance(value, h5py.Dataset) or name.startswith("#") or "MATLAB_empty" in value.attrs:
                continue
            kind = value.attrs.get("MATLAB_class", b"double")
            array = value[()]
            is_text = kind in (b"char", "char")
            variables[name] = "".join(map(chr, np.asarray(array).ravel())) if is_text else np.asarray(array).T
    return variables


def _from_variables(variables: Mapping[str, Any]) -> Table:
    """Return a table from named arrays: vectors and matrices are columns, single numbers and texts facts."""
    columns: list[Column] = []
    facts: dict[str, Any] = {}
    for name, value in variables.items():
        array = np.asarray(value)
        if array.dtype.kind in "US" and array.size == 1:
            text = array.ravel()[0]
            _add_text(facts, name, text.decode() if isinstance(text, bytes) else str(text))
        elif array.dtype.kind in "fiu" and array.size == 1:
            _add_number(facts, name, array.ravel()[0])
        elif array.dtype.kind in "fiu" or (array.dtype.kind == "b" and name == CLIPPED):
            columns += _spread(name, array)
    return Table(tuple(columns), facts)


def _spread(name: str, array: NDArray[Any]) -> list[Column]:
    """Return the columns of a vector or of a matrix, whose longer side is time."""
    if array.dtype.kind not in "fiub" or array.ndim > 2 or array.ndim == 0:
        if name:
            return []
        raise InputError(
            "", "samples", f"an array of {array.dtype} with {array.ndim} dimensions", "a vector of numbers"
        )
    title, unit = name_and_unit(name) if name else ("", "")
    if array.ndim == 1 or 1 in array.shape:
        return [Column(title, array.ravel(), unit)]
    matrix = array.T if array.shape[0] < array.shape[1] else array
    return [
        Column(f"{title} {k}".strip() if title else "", matrix[:, k], unit, loose=True) for k in range(matrix.shape[1])
    ]


def _add_text(facts: dict[str, Any], name: str, text: str) -> None:
    if name.lower() in UNIT_NAMES:
        facts["unit"] = text
    elif name == "quantity":
        facts[name] = text
    elif name in ("truth", "notes"):
        try:
            facts[name] = json.loads(text)
        except ValueError:
            facts.setdefault("words", []).append(f"{name}: {text[:80]}")


def _add_number(facts: dict[str, Any], name: str, value: Any) -> None:
    rate = rate_fact(name, float(value))
    if rate is not None:
        facts["rate"] = rate
    elif name == "speed" and not np.isnan(value):
        facts[name] = positive(name, float(value), "speed")
    elif name == "start":
        facts[name] = float(value)


def read_nc(path: Path) -> Table:
    """Return the vectors of a netCDF file with their units; attributes are facts."""
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as opened:
            data = opened.load()
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise _unreadable("netCDF-4", error) from None
    facts: dict[str, Any] = {}
    names = [str(name) for name in data.variables if data[name].ndim == 1 and data[name].dtype.kind in "fiub"]
    for name, value in data.attrs.items():
        if str(name).lower() not in UNIT_NAMES:
            _add_fact(facts, str(name), value)
    columns = tuple(
        Column(name, data[name].values, str(data[name].attrs.get("units", "")).partition(" since ")[0])
        for name in names
    )
    for name in (str(n) for n in data.variables if data[n].ndim == 0):
        _add_fact(facts, name, data[name].values)
    if len(names) == 1:
        for key, value in data[names[0]].attrs.items():
            _add_fact(facts, str(key), value) if str(key).lower() in (*RATES, *INTERVALS) else None
    return Table(columns, facts)


def _add_fact(facts: dict[str, Any], name: str, value: Any) -> None:
    array = np.asarray(value)
    if array.size == 1 and array.dtype.kind in "fiu":
        _add_number(facts, name, array.ravel()[0])
    elif array.size == 1 and array.dtype.kind in "US":
        _add_text(facts, name, str(array.ravel()[0]))


def read_tdms(path: Path) -> Table:
    """Return the channels of a TDMS file, named "group/channel"."""
    nptdms = _optional("nptdms", ".tdms")
    columns = []
    try:
        for group in nptdms.TdmsFile.read(path).groups():
            for channel in group.channels():
                values = np.asarray(channel[:])
                if values.dtype.kind in "fiu" and len(values):
                    columns.append(_tdms_column(f"{group.name}/{channel.name}", values, channel.properties))
    except Exception as error:  # nptdms has no class of errors of its own
        raise _unreadable("TDMS", error) from None
    return Table(tuple(columns))


def _tdms_column(name: str, values: NDArray[Any], properties: Mapping[str, Any]) -> Column:
    step = float(properties.get("wf_increment", 0.0))
    start = float(properties.get("wf_start_offset", 0.0))
    unit = str(properties.get("unit_string", properties.get("NI_UnitDescription", "")))
    return Column(name, values, unit, rate=1.0 / step if step > 0.0 else None, start=start)


def read_mdf(path: Path) -> Table:
    """Return the channels of an MDF file, each with its own times."""
    asammdf = _optional("asammdf", path.suffix)
    columns = []
    try:
        with asammdf.MDF(path) as file:
            for signal in file.iter_channels(skip_master=True):
                samples = np.asarray(signal.samples)
                if samples.ndim == 1 and samples.dtype.kind in "fiu" and len(samples):
                    columns.append(Column(signal.name, samples, signal.unit or "", times=np.asarray(signal.timestamps)))
    except Exception as error:  # asammdf's errors have no common class
        raise _unreadable("MDF", error) from None
    return Table(tuple(columns))


def _optional(package: str, suffix: str) -> Any:
    """Return a package that not everyone has."""
    try:
        return importlib.import_module(package)
    except ImportError:
        found = f"a {suffix} file, for which the package {package} is not installed"
        raise InputError("", "path", found, f"after: pip install {package}; or another format") from None


def _unreadable(kind: str, error: Exception) -> InputError:
    text = " ".join(str(error).split())[:120] or type(error).__name__
    return InputError("", "path", f"no readable {kind} file ({text})", f"a whole {kind} file")
