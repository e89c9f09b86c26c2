"""Dampers whose ends move, in the general march: their forces, where their ends are, and the stops that these meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.plane import end_name
from wheeltapper.march.common import program as contract
from wheeltapper.march.general.replay import Replayed
from wheeltapper.march.general.task import Marched

if TYPE_CHECKING:
    from wheeltapper.lower.lowered.plane import LoweredPlane, Stop

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def stops_met(lowered: LoweredPlane, march: Marched) -> tuple[FloatArray, IntArray]:
    """Return the table of the stops that ends meet and leave (`common.program`), and their wheelsets."""
    rows = march.seat_events
    number = rows[:, contract.EVENT_CONTACT].astype(np.int64) - len(lowered.anomalies.voids)
    of_stops = (number >= 0) & (number < len(lowered.stops))
    rows, number = rows[of_stops], number[of_stops]
    out = np.zeros((len(rows), contract.STOP_COLUMNS))
    out[:, contract.STOP_TIME] = rows[:, contract.EVENT_TIME]
    reached = rows[:, contract.EVENT_KIND] == contract.IMPACT
    out[:, contract.STOP_KIND] = np.where(reached, contract.REACHED, contract.LEFT)
    for k, stop in enumerate(lowered.stops):
        mine = np.flatnonzero(number == k)
        side = np.full(len(mine), float(stop.sides[0]))
        if len(stop.sides) > 1:  # what is left is what was reached before
            side[0::2] = np.sign(rows[mine[0::2], contract.EVENT_RATE])
            side[1::2] = side[0::2][: len(side[1::2])]
        out[mine, contract.STOP_SIDE] = side
    return out, np.array([stop.wheelset for stop in lowered.stops], dtype=np.int64)[number]


def damper_motion(
    lowered: LoweredPlane, march: Marched, times: FloatArray, found: Replayed
) -> tuple[FloatArray, FloatArray]:
    """Return displacements of the dampers' ends, m, and forces on the wheels, N, upwards, (times, wheelsets) both.

    `found` is what is replayed at the times, which rise. A damper without an end of its own has NaN for its end.
    """
    wheelsets, freedoms = lowered.plane.wheelsets, lowered.plane.freedoms
    sinking = march.sinking
    place, force = np.full((2, len(times), len(wheelsets)), np.nan)
    for i, wheelset in enumerate(wheelsets):
        begun = float(wheelset.damper_play * wheelset.damper_play_start)
        if end_name(i) in freedoms:
            end = freedoms.index(end_name(i))
            place[:, i] = begun - sinking[i] - found.displacement[:, end]
            if not wheelset.damper_play:
                stretch = found.displacement[:, i] - found.displacement[:, end]
                force[:, i] = float(wheelset.bush_stiffness or 0.0) * stretch
        if not wheelset.damper_end:
            force[:, i] = float(wheelset.damping) * found.velocity[:, i]
        if wheelset.damper_play:
            force[:, i] = 0.0
        for k, stop in enumerate(lowered.stops):
            if stop.wheelset == i:
                # the wheel's part of a stop's shape is minus the stop's side
                force[:, i] += stop.shape[i] * found.force[:, lowered.first_stop + k] * lowered.force
                if len(stop.sides) > 1:
                    place[:, i] = _resting_end(lowered, march, stop, times, found) - sinking[i]
    return place, force


def _resting_end(lowered: LoweredPlane, march: Marched, stop: Stop, times: FloatArray, found: Replayed) -> FloatArray:
    """Return where an end without a bush is, upwards from the wheel at rest, m."""
    wheelset, own = lowered.plane.wheelsets[stop.wheelset], -found.displacement[:, stop.wheelset]
    gap = float(wheelset.damper_play)
    met, of = stops_met(lowered, march)
    met = met[of == stop.wheelset]
    moments = np.append(0.0, met[:, contract.STOP_TIME])
    then = -march.at(moments).displacement[:, stop.wheelset]
    rests = then - np.append(-gap * wheelset.damper_play_start, met[:, contract.STOP_SIDE] * gap)
    held = np.append(False, met[:, contract.STOP_KIND] == contract.REACHED)
    side = np.append(0.0, met[:, contract.STOP_SIDE])
    last = np.searchsorted(moments, times, side="right") - 1
    return np.asarray(np.where(held[last], own - side[last] * gap, rests[last]))
