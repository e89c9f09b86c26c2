"""Maxima of the forces of a vehicle on rails through macro steps that are solved at once (`whole_steps`).

There a force is a polynomial through the nodes. While such steps follow each other each force is followed through them,
so that a maximum counts once it stands out from the lows around it, also where these are in other steps.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import LANES
from wheeltapper.march.wagon.passing import log_peak
from wheeltapper.march.wagon.rail_motion import INVERSES
from wheeltapper.march.wagon.whole_steps import CONSTANT, Nodal, expand

CLIMBS, BEST_TIME, BEST_FORCE, END_SLOPE = range(4)
TRACKED = 4
"""What is known of a force while whole steps follow each other: whether it climbs (1) or descends (-1), 0 before the
first; its largest maximum since it began to climb, and when, or its smallest value since it began to descend; and its
derivative at the last step's end."""
PROMINENT_FORCE = 1e-6
"""Smallest height of a maximum above its surroundings, in static forces."""


@uncounted_kernel
def _force_at(x: float, i: int, nodal: Nodal) -> tuple[float, float]:
    """Return a contact's force at a place of the step, and its derivative."""
    z = 2.0 * x - 1.0
    before, value, slope_before, slope = 1.0, z, 0.0, 1.0
    force, growth = nodal.change[CONSTANT, i], 0.0
    for m in range(1, len(nodal.places)):
        force += nodal.change[m, i] * value
        growth += nodal.change[m, i] * slope
        later = z * value + m * INVERSES[m] * (z * value - before)
        slope_later = slope_before + (2 * m + 1) * value
        before, value, slope_before, slope = value, later, slope, slope_later
    return force, 2.0 * growth


@uncounted_kernel
def _turn_within(low: float, high: float, f_low: float, f_high: float, i: int, nodal: Nodal) -> float:
    """Return where the derivative of a force passes zero between two places, at which it has these values."""
    x, side = high, 0
    for _ in range(60):
        before = x
        x = low + (high - low) * min(max(f_low / (f_low - f_high), 0.001), 0.999)
        _, f = _force_at(x, i, nodal)
        if f * f_low > 0.0:
            low, f_low = x, f
            if side == 1:  # the Illinois method: the value at an end that stays is halved
                f_high *= 0.5
            side = 1
        else:
            high, f_high = x, f
            if side == -1:
                f_low *= 0.5
            side = -1
        if abs(x - before) < 1e-12 or f == 0.0:
            break
    return x


@uncounted_kernel
def _pass_maximum(time: float, force: float, lane: int, tracked: FloatArray) -> None:
    """Take a local maximum."""
    if tracked[CLIMBS, lane] > 0.0 and force > tracked[BEST_FORCE, lane]:
        tracked[BEST_TIME, lane], tracked[BEST_FORCE, lane] = time, force


@uncounted_kernel
def _pass_value(force: float, lane: int, least: float, tracked: FloatArray, peaks: FloatArray, S: FloatArray) -> None:
    """Take an extremum, or the force at a step's end; log the maximum that this leaves behind."""
    best = tracked[BEST_FORCE, lane]
    if tracked[CLIMBS, lane] > 0.0:
        if force < best - least:
            log_peak(tracked[BEST_TIME, lane], lane, best, 0.0, peaks, S)
            tracked[CLIMBS, lane], tracked[BEST_FORCE, lane] = -1.0, force
    elif force < best:
        tracked[BEST_FORCE, lane] = force
    elif force > best + least:
        tracked[CLIMBS, lane], tracked[BEST_FORCE, lane] = 1.0, -np.inf


@uncounted_kernel
def follow_forces(
    t: float, h: float, wheels: FloatArray, data: FloatArray, plan: IntArray, tracked: FloatArray, peaks: FloatArray,
    S: FloatArray, nodal: Nodal,
) -> None:  # fmt: skip
    """Follow all forces through a step, and log their maxima."""
    q, least = len(nodal.places), PROMINENT_FORCE * data[plan[asm.AT_RAILS] + asm.RAIL_FORCE]
    for o in range(wheels.shape[0]):
        if wheels[o, wheel.AWAKE] == 0.0:
            continue
        expand(nodal.transform, nodal.normals[o], nodal.change)
        for i in range(LANES):
            lane = o * LANES + i
            if wheels[o, wheel.ON + i] == 0.0:
                continue
            force, slope = _force_at(0.0, i, nodal)
            if tracked[CLIMBS, lane] == 0.0:
                tracked[CLIMBS, lane], tracked[BEST_FORCE, lane] = -1.0, force
                if slope > 0.0:
                    tracked[CLIMBS, lane], tracked[BEST_FORCE, lane] = 1.0, -np.inf
            elif tracked[END_SLOPE, lane] > 0.0 and slope <= 0.0:
                _pass_maximum(t, force, lane, tracked)
            place = 0.0
            for a in range(1, q + 2):
                after = 1.0 if a > q else nodal.places[a - 1]
                slope_after = 0.0
                for k in range(q):
                    slope_after += nodal.slopes[a, k] * nodal.normals[o, k, i]
                if slope * slope_after < 0.0:
                    x = _turn_within(place, after, slope, slope_after, i, nodal)
                    force, _ = _force_at(x, i, nodal)
                    _pass_value(force, lane, least, tracked, peaks, S)
                    if slope > 0.0:
                        _pass_maximum(t + x * h, force, lane, tracked)
                place, slope = after, slope_after
            force, _ = _force_at(1.0, i, nodal)
            _pass_value(force, lane, least, tracked, peaks, S)
            tracked[END_SLOPE, lane] = slope


@uncounted_kernel
def end_following(t: float, wheels: FloatArray, tracked: FloatArray, peaks: FloatArray, S: FloatArray) -> None:
    """Log the maxima that forces have passed at a time after which no whole step follows."""
    for lane in range(tracked.shape[1]):
        if tracked[CLIMBS, lane] > 0.0:
            L, i = wheels[lane // LANES], lane % LANES
            if tracked[END_SLOPE, lane] > 0.0 and L[wheel.ON + i] != 0.0 and L[wheel.NORMAL_RATE + i] < 0.0:
                _pass_maximum(t, L[wheel.NORMAL + i], lane, tracked)
                tracked[END_SLOPE, lane] = -1.0
            if tracked[END_SLOPE, lane] < 0.0 and tracked[BEST_FORCE, lane] > -np.inf:
                log_peak(tracked[BEST_TIME, lane], lane, tracked[BEST_FORCE, lane], 0.0, peaks, S)
        tracked[CLIMBS, lane] = 0.0
