"""A checksum over everything in a dataset, for files whose format has none."""

from __future__ import annotations

from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

CHECKSUM = "checksum"
"""Name of the attribute that holds the checksum of a file."""


def checksum(data: xr.Dataset) -> str:
    """Return the CRC-32 of all variables and attributes except the checksum itself."""
    found = 0
    for name in sorted(set(data.attrs) - {CHECKSUM}):
        found = crc32(f"{name}={data.attrs[name]}\0".encode(), found)
    for name in sorted(map(str, data.variables)):
        held = data.variables[name]
        found = crc32(f"{name} {held.dims} {held.dtype}\0".encode(), found)
        found = crc32(np.ascontiguousarray(held.values).tobytes(), found)
    return f"{found:08x}"


def is_damaged(data: xr.Dataset) -> bool:
    """Return True if a dataset does not match its checksum; False if it has none."""
    return CHECKSUM in data.attrs and data.attrs[CHECKSUM] != checksum(data)
