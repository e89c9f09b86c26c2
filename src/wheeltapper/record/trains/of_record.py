"""The impact trains of a record, for features: one for a wheelset, one for each wheel of a wagon."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.ground.progress import progress_shown
from wheeltapper.lower.numbers import Units
from wheeltapper.march.common import program as contract
from wheeltapper.record.record import Columns, Record
from wheeltapper.record.trains.growth import Growth, growth_of
from wheeltapper.record.trains.trains import Trains

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

PLACES = 0.5 * (np.polynomial.legendre.leggauss(16)[0] + 1.0)
"""Places within a step at which a body's position is looked at, as parts of its length: a wagon's steps are long."""


def trains_of(record: Record, tally: bool) -> Trains:
    """Return the impact trains of a record, in SI units; for a wagon those of the treads.

    Parameters
    ----------
    record
        Record of any vehicle, with a run that reached its end.
    tally
        True: with impulses and the highest position.
    """
    from wheeltapper.march.wheel.ensemble import Marched

    static = record._contacts.static_force
    cells = len(static)
    owner, events = _by_train(record._events, cells)
    event_rows = np.zeros((len(owner), contract.EVENT_COLUMNS))
    event_rows[:, contract.EVENT_TIME], event_rows[:, contract.EVENT_KIND] = events["time"], events["kind"]
    event_rows[:, contract.EVENT_RATE] = events["indentation_rate"]
    of_peak, peaks = _by_train(record._peaks, cells)
    peak_rows = np.zeros((len(of_peak), contract.PEAK_COLUMNS))
    peak_rows[:, contract.PEAK_TIME], peak_rows[:, contract.PEAK_FORCE] = peaks["time"], peaks["normal_force"]
    hits = events["kind"] == contract.IMPACT
    for cell in range(cells):
        mine = of_peak == cell
        onsets = event_rows[hits & (owner == cell), contract.EVENT_TIME]
        peak_rows[mine, contract.PEAK_IMPACT] = np.searchsorted(onsets, peak_rows[mine, contract.PEAK_TIME], "right")
    marched = Marched(
        np.full(cells, contract.DONE), np.full(cells, record.end), event_rows, peak_rows, _end_rows(owner, cells),
        _end_rows(of_peak, cells), record._free_steps()[0].astype(float),
    )  # fmt: skip
    if tally:
        marched = marched._replace(
            highest=_highest_position(record, cells), impulses=_impact_impulses(record, owner, cells)
        )
    one = np.ones(cells)

    @cache
    def growth(waves: int) -> Growth:
        return Growth(*(one * values for values in growth_of(record.scenario, {}, record.method, waves)))

    def meets(place: float) -> FloatArray:
        with np.errstate(divide="ignore", invalid="ignore"):  # of a wheel that does not roll
            return (place - record._contacts.position) / float(record.scenario.speed)

    def force_histories(rate: float) -> Iterable[FloatArray]:
        history = record.history(rate)
        forces = history.vertical_force if record._contacts.has_sides else history.normal_force
        return np.asarray(forces.values.reshape(-1, cells).T)

    return Trains(
        marched, Units(one, one, one, static, one), lambda: one * missing_energy_of(record), growth, meets,
        force_histories, isinstance(record.scenario.start, str), lambda cells: end_forces_of(record)[cells],
    )  # fmt: skip


def end_forces_of(record: Record) -> FloatArray:
    """Return the larger one of the forces of each train at both ends of a run, N."""
    forces = record.at([0.0, record.end]).normal_force  # as that of maxima, of a wagon without the flange's
    return np.asarray(forces.values.reshape(2, -1).max(axis=0))


def missing_energy_of(record: Record) -> float:
    """Return the missing share of the exchanged energy: the largest of the run, on rails that at its end."""
    if not record._lowered.balance_is_dear:
        return record._lowered.missing_part(record._march)
    with progress_shown(False):
        return abs(float(record.energy.relative_imbalance))


def _by_train(table: Columns, cells: int) -> tuple[IntArray, Columns]:
    """Return the train of each row of a table, and the rows, sorted by train."""
    order = np.argsort(table["contact"], kind="stable")
    order = order[table["contact"][order] < cells]
    return table["contact"][order], {name: values[order] for name, values in table.items()}


def _end_rows(owner: IntArray, cells: int) -> IntArray:
    return np.cumsum(np.bincount(owner, minlength=cells))


def _impact_impulses(record: Record, owner: IntArray, cells: int) -> FloatArray:
    """Return the impulse of each train's n-th impact in the n-th of its rows of events."""
    out = np.full(len(owner), np.nan)
    for cell in range(cells):
        found = record._impacts_of(cell)["impulse"]
        out[np.flatnonzero(owner == cell)[: len(found)]] = found
    return out


def _highest_position(record: Record, cells: int) -> FloatArray:
    """Return the highest position of each train's wheel, m; for a wagon, that of the centre of its wheelset."""
    from scipy.optimize import elementwise

    bounds = np.append(record._step_starts, record.end)
    inside = bounds[:-1, None] + np.diff(bounds)[:, None] * np.append(0.0, PLACES)
    times = np.minimum(np.append(inside.ravel(), record.end), record.end)
    height, speed = _wheelset_motion(record, times)
    out = height.max(axis=0)
    for body in range(height.shape[1]):
        turns = np.flatnonzero((speed[:-1, body] > 0.0) & (speed[1:, body] <= 0.0))
        if not len(turns):
            continue

        def upward_velocity(time: FloatArray, body: int = body) -> FloatArray:
            return _wheelset_motion(record, time.ravel())[1][:, body].reshape(time.shape)

        found = elementwise.find_root(upward_velocity, (times[turns], times[turns + 1]))
        at = np.where(found.success, found.x, times[turns])  # at rest a velocity is rounding, of either sign
        out[body] = max(out[body], _wheelset_motion(record, at)[0][:, body].max())
    return np.repeat(out, cells // len(out))


def _wheelset_motion(record: Record, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return displacement and velocity, upwards, of the wheelsets at some times, each (times, wheelsets)."""
    found = record.at(times)
    if "body" not in found.coords:
        height, speed = (one.values.reshape(len(times), -1) for one in (found.wheel_displacement, found.wheel_velocity))
        return height, speed
    wheelsets = {"body": [name for name in found.body.values if name.startswith("wheelset ")], "motion": MOTIONS[2]}
    return found.displacement.sel(wheelsets).values, found.velocity.sel(wheelsets).values
