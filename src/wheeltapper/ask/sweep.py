"""Maps: features over cells in which some fields of a scenario vary."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper._version import __version__
from wheeltapper.ask.study import Sampling, Study, study
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.march import program as contract
from wheeltapper.record.features import Feature

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.lower.many import Many
    from wheeltapper.lower.numbers import Units

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Status of a cell: what the kernels say, in the order of the numbers that a chart stores.
COMPLETE, EVENT_LIMIT, NOT_FINITE, STALLED, END_OF_PATH, REFUSED = range(6)
STATUS = ("complete", "event_limit", "not_finite", "stalled", "end_of_path", "refused")
_OF_MARCH = {
    contract.DONE: COMPLETE,
    contract.ENOUGH: COMPLETE,
    contract.TOO_MANY_EVENTS: EVENT_LIMIT,
    contract.NOT_FINITE: NOT_FINITE,
    contract.STALLED: STALLED,
    contract.END_OF_PATH: END_OF_PATH,
}


def sweep(
    scenario: Scenario,
    over: Mapping[str, Any],
    features: Sequence[Feature],
    *,
    zipped: bool = False,
    samples: int | None = None,
    sampling: Sampling = "sobol",
    seed: int = 0,
    method: str = "default",
    threads: int | None = None,
) -> xr.Dataset:
    """Compute features over many cells in which some fields of a scenario vary.

    Parameters
    ----------
    scenario
        What all cells have in common.
    over
        By path ("vehicle.damping", "irregularity.0.height", "speed"), the values of a continuous field: numbers in SI
        units or strings with a unit. The cells are all combinations of them.
    features
        From `wheeltapper.features`. A run ends as soon as all of them are known.
    zipped
        True: the lists of `over` have one length and go side by side.
    samples, sampling, seed
        If given, `over` holds lowest and highest values, and so many cells are drawn between them, as a "sobol"
        sequence or a "latin hypercube".
    method
        "default" or "strict".
    threads
        How many march at a time; by default all cores. The result does not depend on it.

    Returns
    -------
    xarray.Dataset
        One variable per feature with its unit and definition, NaN where a cell has too few impacts, over dimensions
        named by the paths (or "cell", where cells do not form a grid); and `status` per cell.

    Raises
    ------
    InputError
        If a path names no continuous field, or a value is not allowed there.
    """
    asked = study(scenario, over, features, zipped=zipped, samples=samples, sampling=sampling, seed=seed, method=method)
    values, status, notes = compute(asked, 0, asked.cells, threads or cores())
    return chart(asked, values, status, notes)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _set_end(asked: Study, numbers: FloatArray) -> None:
    """Let each march end where the last of the features is known."""
    reach = {
        until: max((f.impacts for f in asked.features if f.until == until), default=-1) for until in ("impact", "loss")
    }
    if any(feature.until == "end" for feature in asked.features):
        return
    if reach["impact"] > reach["loss"]:
        numbers[:, contract.LAST_IMPACT] = reach["impact"]
    else:
        numbers[:, contract.LAST_LOSS] = reach["loss"]


def compute(asked: Study, begin: int, end: int, threads: int) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    """Compute the cells from `begin` to before `end`.

    Returns
    -------
    values
        (features, cells).
    status
        (cells,), places in `STATUS`.
    notes
        What the user should know.
    """
    from wheeltapper.lower.many import Many

    changed = asked.changed(begin, end)
    try:
        many = Many(asked.scenario, changed, asked.method)
    except InputError as error:
        if end - begin == 1:
            return np.full((len(asked.features), 1), np.nan), np.array([REFUSED]), (str(error),)
        return _apart(asked, begin, end, threads)
    return _marched(asked, many, threads)


def _apart(asked: Study, begin: int, end: int, threads: int) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    """Compute two halves, so that what is refused stands alone in the end."""
    middle = (begin + end) // 2
    halves = [compute(asked, a, b, threads) for a, b in ((begin, middle), (middle, end))]
    values, status = (np.concatenate([half[i] for half in halves], axis=-1) for i in (0, 1))
    return values, status, tuple(dict.fromkeys(halves[0][2] + halves[1][2]))


def _marched(asked: Study, many: Many, threads: int) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    from wheeltapper.march import ensemble
    from wheeltapper.record.trains import trains_of

    _set_end(asked, many.cells.numbers)
    if not ensemble.is_ready(many.cells):
        print("wheeltapper: compiling its kernels for this machine, once; this takes some seconds", file=sys.stderr)
    total = len(many.cells.first)
    values, status = np.empty((len(asked.features), total)), np.empty(total, dtype=np.int64)
    tally = any(feature.tally for feature in asked.features)

    def read(block: slice, marched: ensemble.Marched) -> None:
        trains = trains_of(marched, _part(many.units, block))
        for row, feature in zip(values, asked.features, strict=True):
            row[block] = feature(trains)
        status[block] = [_OF_MARCH[why] for why in marched.status.tolist()]

    ensemble.march_all(many.cells, threads, read, tally)
    return values, status, many.notes


def _part(units: Units, block: slice) -> Units:
    return type(units)(**{name: values[block] for name, values in vars(units).items()})


def chart(asked: Study, values: FloatArray, status: IntArray, notes: tuple[str, ...]) -> xr.Dataset:
    """Return computed cells as a labelled dataset."""
    import xarray as xr

    named = {
        axis.path: ("cell" if not asked.grid else axis.path, axis.values, {"units": axis.unit}) for axis in asked.axes
    }
    dimensions = tuple(axis.path for axis in asked.axes) if asked.grid else ("cell",)
    data: dict[str, Any] = {
        feature.name: (
            dimensions, column.reshape(asked.shape), {"units": feature.unit, "long_name": feature.definition},
        )
        for feature, column in zip(asked.features, values, strict=True)
    }  # fmt: skip
    data["status"] = (
        dimensions,
        status.astype(np.int8).reshape(asked.shape),
        {"flag_values": np.arange(len(STATUS), dtype=np.int8), "flag_meanings": " ".join(STATUS)},
    )
    return xr.Dataset(data, named, attributes(asked, notes))


def attributes(asked: Study, notes: tuple[str, ...]) -> dict[str, Any]:
    """Return what a chart says of its origin."""
    import json

    import numba

    try:
        text = json.dumps(asked.scenario.model_dump(mode="json"))
    except ValueError:
        text = repr(asked.scenario)
    return {
        "title": "wheeltapper chart", "scenario": text, "notes": json.dumps(list(notes)), "method": asked.method,
        "wheeltapper": __version__, "numba": numba.__version__, "numpy": np.__version__,
    }  # fmt: skip
