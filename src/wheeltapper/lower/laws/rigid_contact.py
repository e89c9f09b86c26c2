"""Where a rigid wheel touches its rail at one place, over the lateral shift; without roll of the wheelset.

Lengths in m; positions s and shifts u of one side count outwards from the track's middle. The wheel rests where its
profile is highest above the rail's. As it shifts, this place moves, and here and there it jumps. A jump lies where both
places carry the wheel at the same height. That height changes with u by the slope of the wheel at the place.

See docs/theory/wagon.rst, section 7.9.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from wheeltapper.describe.profile.files import rail_profile, wheel_profile
from wheeltapper.describe.profile.named import Shape
from wheeltapper.describe.profile.s1002 import FLANGE_BACK
from wheeltapper.describe.profile.wheel_rail import WheelRail
from wheeltapper.lower.laws.geometry import laid_rail

FloatArray = NDArray[np.float64]
FINENESS = 1e-5
"""Distance of places and of shifts, m."""
NOWHERE = -1.0
"""Height, m, that stands for "no profile here"."""
AT_ONCE = 128
"""Shifts whose gaps are looked at together, so that they stay near the processor."""
FAR, BARRIER = 1e-3, 1e-10
"""Contact jumps between two places on the rail that are so far apart, m, and between which the gap is by so much wider
than at both, m. Nearer ones are joints of profiles that do not quite meet."""
BESIDE = 1e-9
"""Half the distance of the two nodes that stand for a jump, m."""


class Touching(NamedTuple):
    """Where one wheel touches, over its shift outwards; all in m but the slope.

    Attributes
    ----------
    shift
        Nodes, rising; between them all is linear.
    wheel, rail
        Places: on the wheel from its tread datum, positive to the field side; on the rail from the track's middle.
    radius
        Rolling radius less the nominal one, which is that at the tread datum.
    slope
        Of the wheel's profile at the contact, positive where its radius grows towards the field side.
    jumps
        Shifts at which contact jumps from place to place.
    """

    shift: FloatArray
    wheel: FloatArray
    rail: FloatArray
    radius: FloatArray
    slope: FloatArray
    jumps: FloatArray

    def at(self, name: str, shifts: FloatArray) -> FloatArray:
        """Return one of these at shifts."""
        return np.asarray(np.interp(shifts, self.shift, getattr(self, name)))


def touching_of(profiles: WheelRail, farthest: float) -> Touching:
    """Return where a wheel touches its rail if it shifts by up to `farthest`, m, to both sides."""
    wheel_shape, rail_shape = wheel_profile(profiles.files[0]), rail_profile(profiles.files[1])
    datum = 0.5 * profiles.flange_backs + 1e-3 * FLANGE_BACK
    place, height = laid_rail(rail_shape, profiles.inclination, profiles.gauge)
    first, last = np.ceil((place[0] - datum) / FINENESS), np.floor((place[-1] - datum) / FINENESS)
    s = datum + FINENESS * np.arange(first, last + 1.0)
    rail = np.interp(s, place, height)
    most = int(np.ceil(farthest / FINENESS))
    across = s[0] - datum + FINENESS * np.arange(-most, len(s) + most)
    wheel = _heights(wheel_shape, across)
    windows = sliding_window_view(wheel, len(s))[::-1]  # by rising shift
    shifts = FINENESS * np.arange(-most, most + 1.0)
    at, lift = np.empty(len(shifts), dtype=int), np.empty((3, len(shifts)))
    for begin in range(0, len(shifts), AT_ONCE):
        some = slice(begin, begin + AT_ONCE)
        highest = windows[some] + rail
        at[some] = np.clip(highest.argmax(axis=1), 1, len(s) - 2)
        lift[:, some] = [highest[np.arange(len(highest)), at[some] + beside] for beside in (-1, 0, 1)]
    bent = np.minimum(lift[0] - 2.0 * lift[1] + lift[2], -1e-18)
    within = np.clip(0.5 * (lift[0] - lift[2]) / bent, -0.5, 0.5)
    on_rail = s[at] + FINENESS * within
    on_wheel = on_rail - datum - shifts
    found = [shifts, on_wheel, on_rail, *_on_wheel(across, wheel, on_wheel)]
    top = lift[1] - 0.25 * (lift[0] - lift[2]) * within
    jumps = [
        (number, _jump(shifts, top, found[4], number))
        for number in np.flatnonzero(np.abs(np.diff(on_rail)) > FAR).tolist()
        if _is_apart(windows, rail, at, number)
    ]
    shifts, on_wheel, on_rail, radius, slope = _with_jumps(found, jumps)
    return Touching(shifts, on_wheel, on_rail, radius, slope, np.array([where for _, where in jumps]))


def _heights(shape: Shape, across: FloatArray) -> FloatArray:
    """Return the heights of a wheel's profile, m, away from the axle, at places from its tread datum, m."""
    return np.nan_to_num(1e-3 * shape(1e3 * across), nan=NOWHERE)


def _on_wheel(across: FloatArray, wheel: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return height and slope of a wheel at places between those where it is known."""
    lower = np.clip(((places - across[0]) / FINENESS).astype(int), 1, len(across) - 3)
    share = (places - across[lower]) / FINENESS
    height = (1.0 - share) * wheel[lower] + share * wheel[lower + 1]
    return height, (wheel[lower + 1] - wheel[lower]) / FINENESS


def _is_apart(windows: FloatArray, rail: FloatArray, at: NDArray[np.int64], number: int) -> bool:
    """Return whether two neighbouring shifts have contacts between which, and not only at which, the gap is open."""
    low, high = sorted((int(at[number]), int(at[number + 1])))
    between = (windows[number] + rail)[low : high + 1]
    return bool(between.min() < min(between[0], between[-1]) - BARRIER)


def _jump(shifts: FloatArray, top: FloatArray, slope: FloatArray, number: int) -> float:
    """Return the shift at which a wheel is equally high on two places, one of each of two neighbouring shifts."""
    step, first, second = shifts[number + 1] - shifts[number], -slope[number], -slope[number + 1]
    part = (top[number + 1] - top[number] - second * step) / (first - second) if first != second else 0.5 * step
    return float(shifts[number] + np.clip(part, BESIDE, step - BESIDE))


def _with_jumps(found: list[FloatArray], jumps: list[tuple[int, float]]) -> list[FloatArray]:
    """Return rows by shift with two more nodes at each jump, which are as those beside it."""
    numbers = np.array([number for number, _ in jumps], dtype=int)
    ends = np.array([where for _, where in jumps])[:, None] + BESIDE * np.array([-1.0, 1.0])
    rows = [ends, *(np.stack([row[numbers], row[numbers + 1]], axis=1) for row in found[1:])]
    at = np.repeat(numbers + 1, 2)
    return [np.insert(row, at, own.ravel()) for row, own in zip(found, rows, strict=True)]
