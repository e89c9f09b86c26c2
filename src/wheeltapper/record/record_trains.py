"""The impact trains of a record, for features: one for a wheelset, one for each wheel of a wagon."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.lower.numbers import Units
from wheeltapper.march import program as contract
from wheeltapper.march.assembly import LANES, STEP_CLOSED, STEP_TIME
from wheeltapper.record.labels import EVENT_KINDS
from wheeltapper.record.record import Record
from wheeltapper.record.trains import Trains
from wheeltapper.record.wagon_record import SIDES, WagonRecord

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def trains_of(record: Record, tally: bool) -> Trains:
    """Return the impact trains of a record, in SI units; for a wagon those of the treads.

    Parameters
    ----------
    record
        Record of any vehicle, with a run that reached its end.
    tally
        True: with impulses and the highest position.
    """
    from wheeltapper.march.ensemble import Marched

    cells = static_forces(record).size
    owner, events = _rows(record.events, cells)
    kinds = np.array([EVENT_KINDS.index(kind) for kind in events.kind.values], dtype=np.int64)
    event_rows = np.zeros((len(owner), contract.EVENT_COLUMNS))
    event_rows[:, contract.EVENT_TIME], event_rows[:, contract.EVENT_KIND] = events.time.values, kinds
    event_rows[:, contract.EVENT_RATE] = events.indentation_rate.values
    of_peak, peaks = _rows(record.peaks, cells)
    peak_rows = np.zeros((len(of_peak), contract.PEAK_COLUMNS))
    peak_rows[:, contract.PEAK_TIME], peak_rows[:, contract.PEAK_FORCE] = peaks.time.values, peaks.normal_force.values
    hits = kinds == contract.IMPACT
    for cell in range(cells):
        mine = of_peak == cell
        onsets = event_rows[hits & (owner == cell), contract.EVENT_TIME]
        peak_rows[mine, contract.PEAK_IMPACT] = np.searchsorted(onsets, peak_rows[mine, contract.PEAK_TIME], "right")
    marched = Marched(
        np.full(cells, contract.DONE), np.full(cells, record.end), event_rows, peak_rows, _ends(owner, cells),
        _ends(of_peak, cells), _airborne(record),
    )  # fmt: skip
    if tally:
        marched = marched._replace(highest=_highest(record), impulses=_impulses(record, owner, cells))
    one = np.ones(cells)
    return Trains(marched, Units(one, one, one, static_forces(record).ravel(), one))


def static_forces(record: Record) -> FloatArray:
    """Return the static normal force of each train's contact, N: a single number, or (wheelsets, sides)."""
    return np.asarray(record.static_forces if isinstance(record, WagonRecord) else record.static_force)


def labelled(record: Record, values: FloatArray, attributes: dict[str, str]) -> xr.DataArray:
    """Return one value per train, labelled with its wheel."""
    import xarray as xr

    if not isinstance(record, WagonRecord):
        return xr.DataArray(values[0], attrs=attributes)
    of_wheels = {name: text.replace("per wheelset", "per wheel") for name, text in attributes.items()}
    like = record.static_forces
    return xr.DataArray(values.reshape(like.shape), like.coords, like.dims, attrs=of_wheels)


def _rows(table: xr.Dataset, cells: int) -> tuple[IntArray, xr.Dataset]:
    """Return the train of each row of a table, and the rows, sorted by train."""
    if "surface" in table:
        table = table.isel({next(iter(table.sizes)): np.flatnonzero(table.surface.values == "tread")})
    owner = table.contact.values if cells > 1 else np.zeros(table.time.size, dtype=np.int64)
    order = np.argsort(owner, kind="stable")
    return owner[order], table.isel({next(iter(table.sizes)): order})


def _ends(owner: IntArray, cells: int) -> IntArray:
    return np.cumsum(np.bincount(owner, minlength=cells))


def _airborne(record: Record) -> FloatArray:
    """Return 1 for each train that begins in flight."""
    first: Any = record._march.steps[0]
    if not isinstance(record, WagonRecord):
        return np.array([float(first[contract.PHASE] == contract.FLIGHT)])
    lanes = record._lowered.assembly.lanes.shape[0] * LANES
    closed = np.floor(first[STEP_CLOSED] / 2.0 ** np.arange(lanes)) % 2.0
    return np.asarray(1.0 - record._by_wheel(closed[None])[0].ravel())


def _impulses(record: Record, owner: IntArray, cells: int) -> FloatArray:
    """Return the impulse of each train's n-th impact in the n-th of its rows of events."""
    out = np.full(len(owner), np.nan)
    table = record.impacts
    if not isinstance(record, WagonRecord):
        out[: table.sizes["impact"]] = table.impulse.values
        return out
    of, table = _rows(table, cells)
    for cell in range(cells):
        found = table.impulse.values[of == cell]
        out[np.flatnonzero(owner == cell)[: len(found)]] = found
    return out


def _highest(record: Record) -> FloatArray:
    """Return the highest position of each train's wheel, m; for a wagon, that of the centre of its wheelset."""
    from scipy.optimize import elementwise

    from wheeltapper.march.tally import NODES

    column = STEP_TIME if isinstance(record, WagonRecord) else contract.TIME
    unit = 1.0 if isinstance(record, WagonRecord) else record._lowered.time
    bounds = np.append(record._march.steps[:, column] * unit, record.end)
    inside = bounds[:-1, None] + np.diff(bounds)[:, None] * np.append(0.0, NODES)
    times = np.minimum(np.append(inside.ravel(), record.end), record.end)
    height, speed = _motion(record, times)
    out = height.max(axis=0)
    for body in range(height.shape[1]):
        turns = np.flatnonzero((speed[:-1, body] > 0.0) & (speed[1:, body] <= 0.0))
        if not len(turns):
            continue

        def rising(time: FloatArray, body: int = body) -> FloatArray:
            return _motion(record, time.ravel())[1][:, body].reshape(time.shape)

        at = elementwise.find_root(rising, (times[turns], times[turns + 1])).x
        out[body] = max(out[body], _motion(record, at)[0][:, body].max())
    return np.repeat(out, len(SIDES)) if isinstance(record, WagonRecord) else out


def _motion(record: Record, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return displacement and velocity, upwards, of the wheelsets at some times, each (times, wheelsets)."""
    found = record.at(times)
    if not isinstance(record, WagonRecord):
        return found.wheel_displacement.values[:, None], found.wheel_velocity.values[:, None]
    wheelsets = {"body": [name for name in found.body.values if name.startswith("wheelset ")], "motion": MOTIONS[2]}
    return found.displacement.sel(wheelsets).values, found.velocity.sel(wheelsets).values
