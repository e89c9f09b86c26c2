"""Distance of the wheels of a run from a further loss of contact: a margin that passes zero when the loss appears.

the loss happened      the smallest indentation in its flight: minus the largest clearance
it did not             the smallest indentation of the tread since the impact before it, once it has begun to fall
with material damping  the force also ends where its factor 1 + χ·rate does; this, times the static indentation, counts
                       as well, and the smaller of both is the margin. On rails that give way the factor jumps where
                       the force ends, and with it the margin: from zero to what is missing after the jump

The indentation is that of the dense solution; its smallest value is where its rate passes zero.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import program as contract
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.wheel_rows import DELTA_RATE, GRIP, ROW_DELTA

if TYPE_CHECKING:
    from wheeltapper.march.wagon.march import Marched

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

WITHIN = np.array([0.0, 0.25, 0.5, 0.75, 1.0 - 1e-9])
"""Places in a step at which the indentation is read first; the last one where rates count, which may jump behind it."""
WITHIN_AT_ONCE = np.arange(16) / 16
"""The same in the macro steps of rails, which may be solved at once."""
NEAR = 0.05
"""Minima are located where the readings are so near to the smallest of them, in static indentations."""
KINDS = contract.LOSS, contract.IMPACT
DELTA, RATE, FACTOR = range(3)
"""What is read: indentation, m, its rate, and with material damping what its force is multiplied by, times δ0, m."""


class Readings(NamedTuple):
    """What a run's margin is read from.

    Attributes
    ----------
    at
        From rising times to DELTA, RATE and perhaps FACTOR, (times, quantities, treads).
    times
        Of the first readings.
    losses, impacts
        Times of those of each tread.
    static
        Static indentation δ0, m.
    damped
        Whether there is a FACTOR.
    """

    at: Callable[[FloatArray], FloatArray]
    times: FloatArray
    losses: list[FloatArray]
    impacts: list[FloatArray]
    static: float
    damped: bool


def readings_of(found: Marched) -> Readings:
    """Return the readings of a run, of all its treads."""
    A = found.assembly
    static, damped = float(A.numbers[asm.STATIC_INDENTATION]), A.numbers[asm.CONTACT_LAW] in (asm.LOSSY, asm.OWN_RATED)
    rows = np.array([ROW_DELTA, DELTA_RATE, *([GRIP] if damped else [])])
    treads = np.flatnonzero(A.lanes[: int(A.numbers[asm.TREADS]), asm.SIDE].ravel())

    def at(times: FloatArray) -> FloatArray:
        read = found.at(times, rows)[2][:, :, treads]
        read[:, FACTOR:] *= static
        return np.asarray(read)

    begins, lengths = found.steps[:, asm.STEP_TIME], found.steps[:, asm.STEP_LENGTH]
    at_once = A.rails.size > 0 and A.rails[asm.RAIL_AT_ONCE] != 0.0
    within = WITHIN_AT_ONCE if at_once and not damped else WITHIN if damped else WITHIN[:-1]
    times = np.append((begins[:, None] + lengths[:, None] * within).ravel(), found.end)
    each = [found.events[found.events[:, contract.EVENT_CONTACT] == lane] for lane in treads]
    lost, hit = ([_times_of(events, kind) for events in each] for kind in KINDS)
    return Readings(at, times, lost, hit, static, damped)


def _times_of(events: FloatArray, kind: int) -> FloatArray:
    return np.asarray(events[events[:, contract.EVENT_KIND] == kind, contract.EVENT_TIME])


def margin_of(readings: Readings, losses: int) -> float:
    """Return how far a run is from the `losses`-th loss of any of its treads, m; negative where it happened."""
    read, out = readings.at(readings.times), readings.static  # of contacts without an impact before that loss
    turns, lows = list[tuple[int, int]](), list[tuple[int, int]]()
    for tread in range(read.shape[2]):
        among = _window(readings, tread, losses)
        held = read[among][:, [DELTA, *range(FACTOR, read.shape[1])], tread]
        for k, here in enumerate(held.T):
            falls = np.flatnonzero(here[1:] < here[:-1]) + 1
            begins = 0 if len(readings.losses[tread]) >= losses else falls[0] if len(falls) else len(here)
            out = min(out, here[begins:].min(initial=np.inf))
            if k == 0:
                rate = read[among, RATE, tread]
                inside = (rate[:-1] < 0.0) & (rate[1:] > 0.0) & (np.diff(among) == 1)
                turns += [(int(among[turn]), tread) for turn in np.flatnonzero(inside)]
            else:
                inside = (here[1:-1] < here[:-2]) & (here[1:-1] < here[2:]) & (among[2:] - among[:-2] == 2)
                lows += [(int(among[low]), tread) for low in np.flatnonzero(inside)]
    limit = out + NEAR * readings.static
    near = [(i, tread) for i, tread in turns if min(read[i : i + 2, DELTA, tread]) < limit]
    out = min(out, *_smallest_deltas(readings, near), out)
    near = [(i, tread) for i, tread in lows if read[i + 1, FACTOR, tread] < limit]
    return float(min(out, *_smallest_factors(readings, near), out))


def _window(readings: Readings, tread: int, losses: int) -> IntArray:
    """Return the readings among which a tread's margin is: those of a flight, or of a contact."""
    times, lost, hit = readings.times, readings.losses[tread], readings.impacts[tread]
    before = losses - 1  # impacts before that loss
    if len(hit) and (not len(lost) or hit[0] < lost[0]):  # it began in the air
        before += 1
    if len(lost) >= losses:
        until = hit[before] if len(hit) > before else np.inf
        return np.flatnonzero((times >= lost[losses - 1]) & (times <= until))
    if len(hit) < before:
        return np.zeros(0, dtype=np.int64)
    return np.flatnonzero(times >= (hit[before - 1] if before else 0.0))


def _read(readings: Readings, at: FloatArray, tread: FloatArray, quantity: int) -> FloatArray:
    """Return a quantity at times in any order, each of a tread."""
    flat, own = at.ravel(), np.broadcast_to(tread, at.shape).ravel().astype(np.int64)
    order = np.argsort(flat, kind="stable")
    out = np.empty(len(flat))
    out[order] = readings.at(np.ascontiguousarray(flat[order]))[np.arange(len(flat)), quantity, own[order]]
    return out.reshape(at.shape)


def _smallest_deltas(readings: Readings, near: list[tuple[int, int]]) -> list[float]:
    """Return the indentations where their rates pass zero between readings and the next ones."""
    from scipy.optimize import elementwise

    if not near:
        return []
    first, tread = np.array(near).T

    def rate(at: FloatArray, own: FloatArray) -> FloatArray:
        return _read(readings, at, own, RATE)

    ends = readings.times[first], readings.times[first + 1]
    found: Any = elementwise.find_root(rate, ends, args=(tread.astype(float),))
    return list(_read(readings, np.asarray(found.x), tread.astype(float), DELTA))


def _smallest_factors(readings: Readings, near: list[tuple[int, int]]) -> list[float]:
    """Return the smallest factors beside readings that are smaller than those before and behind."""
    from scipy.optimize import elementwise

    if not near:
        return []
    first, tread = np.array(near).T

    def factor(at: FloatArray, own: FloatArray) -> FloatArray:
        return _read(readings, at, own, FACTOR)

    bracket = readings.times[first], readings.times[first + 1], readings.times[first + 2]
    found: Any = elementwise.find_minimum(factor, bracket, args=(tread.astype(float),))
    return list(np.minimum(found.f_x, readings.at(readings.times)[first + 1, FACTOR, tread]))
