"""Files that earlier versions of this package wrote."""

import lzma
from pathlib import Path

import xarray as xr

DATA = Path(__file__).resolve().parent / "data"
EARLIER = [("wheelset", 1), ("wagon", 1), ("wheelset", 2), ("bogie_on_slab", 2), ("wagon", 2), ("wagon_on_slab", 2)]
"""What was recorded, and the format of its file."""


def earlier(kind, version, folder):
    """Unpack a file of an earlier format; return its path and its contents."""
    path = folder / f"{kind}_{version}.nc"
    path.write_bytes(lzma.decompress((DATA / f"record_{kind}_format_{version}.nc.xz").read_bytes()))
    with xr.open_dataset(path, engine="h5netcdf") as opened:
        return path, opened.load()
