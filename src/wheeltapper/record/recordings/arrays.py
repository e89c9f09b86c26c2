"""Recordings in files of arrays: WAV, MATLAB, numpy, netCDF; TDMS and MDF if their packages are installed."""

from __future__ import annotations

import importlib
import io
import json
import math
import warnings
import zlib
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.table.content import check_size
from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError, brief
from wheeltapper.record.recordings.table import CLIPPED, INTERVALS, RATES, Column, RecordingTable, rate_fact
from wheeltapper.record.recordings.units import name_and_unit

UNIT_NAMES = ("unit", "units")
"""Names under which a file may hold the unit of its samples."""
MATLAB_CLASSES = ("double", "single", "logical", "char", *(f"{s}int{n}" for s in ("", "u") for n in (8, 16, 32, 64)))
"""Classes of MATLAB variables that may be samples or describe them; structures and cells are skipped."""
MATLAB_PACKED = 15
"""Number of the element type "compressed" in a MATLAB file."""
CHUNK = 2**18
"""Bytes that are read or unpacked at a time."""


def refuse_broken_files(
    kind: str,
) -> Callable[[Callable[[Path, float], RecordingTable]], Callable[[Path, float], RecordingTable]]:
    """Let a reader refuse a broken file in one line; libraries raise many undocumented errors for such files."""

    def wrapped_reader(reader: Callable[[Path, float], RecordingTable]) -> Callable[[Path, float], RecordingTable]:
        @wraps(reader)
        def read_checked(path: Path, largest: float) -> RecordingTable:
            check_size(path.stat().st_size, largest)
            try:
                return reader(path, largest)
            except InputError:
                raise
            except Exception as error:
                text = brief(error) or type(error).__name__
                raise InputError("", "path", f"no readable {kind} file ({text})", f"a whole {kind} file") from None

        return read_checked

    return wrapped_reader


@refuse_broken_files("WAV")
def read_wav(path: Path, largest: float) -> RecordingTable:
    """Return the channels of a WAV file; for integers, 1 is full scale."""
    from scipy.io import wavfile

    with path.open("rb") as file:
        head = file.read(36)
    if head.startswith(b"RF64"):  # sizes of 64 bits, which the library trusts before it reads the file
        check_size(int.from_bytes(head[28:36], "little"), largest)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        rate, samples = wavfile.read(path)
    notes = [str(w.message).split("\n")[0] for w in caught if "non-data" not in str(w.message)]
    integer = samples.dtype.kind in "iu"
    if integer:
        bits = 8 * samples.dtype.itemsize
        samples = (samples.astype(float) - (128.0 if bits == 8 else 0.0)) / 2.0 ** (bits - 1)
    channels = samples.reshape(len(samples), -1).T
    columns = tuple(Column(f"channel {k}", channel) for k, channel in enumerate(channels))
    return RecordingTable(columns, {"rate": float(rate), "notes": notes}, full_scale=integer)


@refuse_broken_files("numpy")
def read_npy(path: Path, largest: float) -> RecordingTable:
    """Return a vector, the columns of a matrix, or the fields of a structured array."""
    with path.open("rb") as file:
        array = _npy_array(file, path.stat().st_size, largest)
    if array.dtype.names:
        fields = [(name, *name_and_unit(name)) for name in array.dtype.names]
        return RecordingTable(tuple(Column(name, array[key].ravel(), unit) for key, name, unit in fields))
    return RecordingTable(tuple(_array_columns("", array)))


@refuse_broken_files("numpy")
def read_npz(path: Path, largest: float) -> RecordingTable:
    """Return the vectors of an .npz file, and the numbers and texts beside them."""
    import zipfile

    variables = {}
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        check_size(sum(member.file_size for member in members), largest)
        for member in members:
            if member.filename.endswith(".npy"):
                file = io.BytesIO(archive.read(member))  # at most the stated size
                variables[member.filename.removesuffix(".npy")] = _npy_array(file, member.file_size, largest)
    return _from_variables(variables)


def _npy_array(file: Any, size: int, largest: float) -> NDArray[Any]:
    """Return the array in an .npy file, whose length must be the stated one."""
    form = np.lib.format
    read_header = form.read_array_header_1_0 if form.read_magic(file) == (1, 0) else form.read_array_header_2_0
    shape, _, dtype = read_header(file)
    stated = math.prod(shape) * dtype.itemsize
    check_size(stated, largest)
    if min(shape, default=0) < 0 or stated > size - file.tell():
        found = f"an array of {stated} bytes in a file with {size - file.tell()}"
        raise InputError("", "path", found, "a whole numpy file")
    file.seek(0)
    return np.asarray(form.read_array(file, allow_pickle=False))


@refuse_broken_files("MATLAB")
def read_mat(path: Path, largest: float) -> RecordingTable:
    """Return the variables of a MATLAB file, up to v7 by scipy, v7.3 by h5py."""
    from scipy.io import loadmat, whosmat

    h5py = importlib.import_module("h5py")
    if h5py.is_hdf5(path):
        check_hdf5(path, largest)
        return _from_variables(_hdf5_variables(h5py, path))
    held = _unpacked_size(path, largest)
    wanted = [(name, math.prod(shape)) for name, shape, kind in whosmat(path) if kind in MATLAB_CLASSES]
    stated = sum(count for _, count in wanted)
    check_size(8 * stated, largest)
    if stated > held:
        raise InputError("", "path", f"{stated} numbers in {held} bytes", "a whole MATLAB file")
    variables = loadmat(path, variable_names=[name for name, _ in wanted])
    return _from_variables({name: value for name, value in variables.items() if not name.startswith("__")})


def _unpacked_size(path: Path, largest: float) -> int:
    """Return the unpacked size of a MATLAB file up to v7, bytes; it is unpacked in small parts."""
    from scipy.io.matlab import matfile_version

    size = path.stat().st_size
    if matfile_version(path)[0] != 1:  # before v5 nothing is compressed
        return size
    total = 0
    with path.open("rb") as file:
        order: Literal["big", "little"] = "big" if file.read(128)[126:] == b"MI" else "little"
        while len(tag := file.read(8)) == 8:
            kind, count = int.from_bytes(tag[:4], order), int.from_bytes(tag[4:], order)
            total += 0 if kind == MATLAB_PACKED else count
            unpacking, end = zlib.decompressobj(), min(file.tell() + count, size)
            while kind == MATLAB_PACKED and file.tell() < end:
                piece = file.read(min(CHUNK, end - file.tell()))
                while piece and not unpacking.eof:
                    total += len(unpacking.decompress(piece, CHUNK))
                    check_size(total, largest)
                    piece = unpacking.unconsumed_tail
            file.seek(end)
    return total


def check_hdf5(path: Path, largest: float) -> None:
    """Refuse an HDF5 file whose arrays have a larger stated size than is allowed."""
    h5py = importlib.import_module("h5py")
    total = 0

    def add_size(_: str, item: Any) -> None:
        nonlocal total
        if isinstance(item, h5py.Dataset) and item.shape is not None:
            total += math.prod(item.shape) * item.dtype.itemsize

    with h5py.File(path, "r") as file:
        file.visititems(add_size)
    check_size(total, largest)


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


def _from_variables(variables: Mapping[str, Any]) -> RecordingTable:
    """Return a table from named arrays: vectors and matrices become columns, single numbers and texts become facts."""
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
            columns += _array_columns(name, array)
    return RecordingTable(tuple(columns), facts)


def _array_columns(name: str, array: NDArray[Any]) -> list[Column]:
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
        facts[name] = as_quantity(float(value), name, "speed")
    elif name == "start":
        facts[name] = float(value)


@refuse_broken_files("netCDF-4")
def read_nc(path: Path, largest: float) -> RecordingTable:
    """Return the vectors of a netCDF file with their units; attributes become facts."""
    import xarray as xr

    check_hdf5(path, largest)
    with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as opened:
        data = opened.load()
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
    return RecordingTable(columns, facts)


def _add_fact(facts: dict[str, Any], name: str, value: Any) -> None:
    array = np.asarray(value)
    if array.size == 1 and array.dtype.kind in "fiu":
        _add_number(facts, name, array.ravel()[0])
    elif array.size == 1 and array.dtype.kind in "US":
        _add_text(facts, name, str(array.ravel()[0]))


@refuse_broken_files("TDMS")
def read_tdms(path: Path, largest: float) -> RecordingTable:
    """Return the channels of a TDMS file, named "group/channel"."""
    nptdms = _optional_package("nptdms", ".tdms")
    with path.open("rb") as raw, nptdms.TdmsFile.open(raw) as file:  # of a damaged file it leaves its own one open
        channels = [channel for group in file.groups() for channel in group.channels() if channel.dtype.kind in "fiu"]
        check_size(sum(len(channel) * channel.dtype.itemsize for channel in channels), largest)
        stated, size = sum(map(len, channels)), path.stat().st_size
        if stated > size:
            raise InputError("", "path", f"{stated} numbers in {size} bytes", "a whole TDMS file")
        columns = tuple(
            _tdms_column(f"{channel.group_name}/{channel.name}", np.asarray(channel[:]), channel.properties)
            for channel in channels
            if len(channel)
        )
    return RecordingTable(columns)


def _tdms_column(name: str, values: NDArray[Any], properties: Mapping[str, Any]) -> Column:
    step = float(properties.get("wf_increment", 0.0))
    start = float(properties.get("wf_start_offset", 0.0))
    unit = str(properties.get("unit_string", properties.get("NI_UnitDescription", "")))
    return Column(name, values, unit, rate=1.0 / step if step > 0.0 else None, start=start)


@refuse_broken_files("MDF")
def read_mdf(path: Path, largest: float) -> RecordingTable:
    """Return the channels of an MDF file, each with its own times."""
    asammdf = _optional_package("asammdf", path.suffix)
    columns = []
    with asammdf.MDF(path) as file:
        groups = [group.channel_group for group in file.groups]
        check_size(sum(group.cycles_nr * (group.samples_byte_nr + 8) for group in groups), largest)
        for signal in file.iter_channels(skip_master=True):
            samples = np.asarray(signal.samples)
            if samples.ndim == 1 and samples.dtype.kind in "fiu" and len(samples):
                columns.append(Column(signal.name, samples, signal.unit or "", times=np.asarray(signal.timestamps)))
    return RecordingTable(tuple(columns))


def _optional_package(package: str, suffix: str) -> Any:
    """Return an optional package."""
    try:
        return importlib.import_module(package)
    except ImportError:
        found = f"a {suffix} file, for which the package {package} is not installed"
        raise InputError("", "path", found, f"after: pip install {package}; or another format") from None
