"""Making a data set."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from wheeltapper.ask.fill import ClusterError, fill_store
from wheeltapper.diagnosis.dataset.passages import check_plan
from wheeltapper.diagnosis.dataset.plan import DatasetPlan
from wheeltapper.diagnosis.dataset.store import DatasetStore
from wheeltapper.ground.arguments import as_path
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.progress import Progress, progress_shown
from wheeltapper.record.files.filled import load_filled

if TYPE_CHECKING:
    import xarray as xr


def make_dataset(
    plan: DatasetPlan | str | Path, output: str | Path, *, resume: bool = False, workers: int = 0,
    scheduler: str | None = None, progress: Progress = True,
) -> xr.Dataset:  # fmt: skip
    """Compute labelled passages, as sensors record them, into a Zarr store that opens in plain xarray.

    Parameters
    ----------
    plan
        The description of the data set, or the path of its TOML file.
    output
        Folder of the store (.zarr). Its card, a page in Markdown, is written beside it.
    resume
        Continue a store that exists: only missing chunks are computed. The result has the same bits.
    workers, scheduler
        Number of processes on this machine, or the address of a Dask scheduler; else the threads of this process.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset
        Readings by sensor (passage, time), labels (passage, vehicle), and `status`; not yet read into memory.

    Raises
    ------
    InputError
        If the plan is wrong, or the output exists and `resume` is not set.
    RuntimeError
        If some passages were not computed; the others are kept.
    """
    output = as_path(output, "output", "the path of a .zarr folder")
    plan = as_plan(plan)
    with progress_shown(progress, "passages"):
        failed = fill_dataset(plan, output, resume=resume, workers=workers, scheduler=scheduler)
    if failed:
        raise ClusterError(f"not computed: {'; '.join(failed)}")
    return load_filled(output)


def as_plan(given: DatasetPlan | str | Path) -> DatasetPlan:
    """Return a plan; for a path, the one that the TOML file describes."""
    if isinstance(given, DatasetPlan):
        return given
    return DatasetPlan.from_toml(as_path(given, "plan", "a DatasetPlan, or the path of its TOML file"))


def fill_dataset(
    plan: DatasetPlan, output: Path, *, resume: bool = False, workers: int = 0, scheduler: str | None = None
) -> list[str]:
    """Fill the store of a plan, and write its card beside it; return what could not be computed.

    Raises
    ------
    InputError
        If the scenario does not run as stated, a sensor reads nothing of it, or its vehicle cannot have a fault.
    """
    if output.suffix != ".zarr":
        raise InputError("", "--output", value_text(str(output)), "a folder that ends with .zarr")
    store = DatasetStore(output, plan.model_dump(mode="json"))
    if not output.exists():
        check_plan(store.plan)
    failed = fill_store(store, resume=resume, workers=workers, scheduler=scheduler)
    output.with_suffix(".md").write_text(str(store.attributes()["card"]), encoding="utf-8")
    return failed
