"""Distance of a wagon's wheels from a further loss of contact: a margin that passes zero when the loss appears.

the loss happened      the smallest indentation in its flight: minus the largest clearance
it did not             the smallest indentation of the tread since the impact before it, once it has begun to fall

The indentation is that of the dense solution; its smallest value is where its rate, which is exact, passes zero.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march import assembly as asm
from wheeltapper.march import program as contract
from wheeltapper.march import run
from wheeltapper.march.wheel_rows import DELTA_RATE, ROW_DELTA

if TYPE_CHECKING:
    from wheeltapper.march.assembly import Assembly
    from wheeltapper.march.multibody import MultibodyMarch

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

READINGS, READINGS_AT_ONCE = 4, 16
"""Number of places in a step at which the indentation is read first; in a macro step that was solved at once."""
NEAR = 0.05
"""Minima are located where the readings are so near to the smallest of them, in static indentations."""
BOTH = np.array([ROW_DELTA, DELTA_RATE])
KINDS = contract.LOSS, contract.IMPACT


def margin_of(assembly: Assembly, found: MultibodyMarch, losses: int) -> float:
    """Return how far a march is from the `losses`-th loss of any of its treads, m; negative where it happened."""
    begins, lengths = found.steps[:, asm.STEP_TIME], found.steps[:, asm.STEP_LENGTH]
    readings = READINGS_AT_ONCE if assembly.rails.size and assembly.rails[asm.RAIL_AT_ONCE] else READINGS
    within = np.arange(readings) / readings
    times = np.append((begins[:, None] + lengths[:, None] * within).ravel(), found.end)
    read = run.replay(assembly, found, times, BOTH)[2]
    out = float(assembly.numbers[asm.STATIC_INDENTATION])  # of contacts without an impact before that loss
    ends: list[tuple[int, int]] = []
    for lane in _treads(assembly):
        among = _window(found, lane, losses, times)
        here, rate = read[among, 0, lane], read[among, 1, lane]
        falls = np.flatnonzero(here[1:] < here[:-1])
        if not len(falls):
            continue
        out = min(out, float(here[falls[0] + 1 :].min()))
        turns = np.flatnonzero((rate[:-1] < 0.0) & (rate[1:] > 0.0) & (np.diff(among) == 1))
        ends += [(int(among[turn]), lane) for turn in turns]
    first, lanes = (np.array(column, dtype=np.int64) for column in zip(*ends, strict=True)) if ends else _NOTHING
    least = np.minimum(read[first, 0, lanes], read[first + 1, 0, lanes]) if ends else np.zeros(0)
    near = least < out + NEAR * float(assembly.numbers[asm.STATIC_INDENTATION])
    if near.any():
        out = min(out, float(_smallest(assembly, found, times, first[near], lanes[near]).min()))
    return out


_NOTHING = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)


def _treads(assembly: Assembly) -> IntArray:
    """Return the lanes of the treads of all wheels."""
    octets = int(assembly.numbers[asm.TREADS])
    return np.flatnonzero(assembly.lanes[:octets, asm.SIDE].ravel())


def _window(found: MultibodyMarch, lane: int, losses: int, times: FloatArray) -> IntArray:
    """Return the readings among which a tread's margin is: those of a flight, or of a contact."""
    events = found.events[found.events[:, contract.EVENT_CONTACT] == lane]
    lost, hit = (events[events[:, contract.EVENT_KIND] == kind, contract.EVENT_TIME] for kind in KINDS)
    if len(lost) >= losses:
        until = hit[losses - 1] if len(hit) >= losses else np.inf
        return np.flatnonzero((times >= lost[losses - 1]) & (times <= until))
    if len(hit) < losses - 1:
        return _NOTHING[0]
    return np.flatnonzero(times >= (hit[losses - 2] if losses > 1 else 0.0))


def _smallest(
    assembly: Assembly, found: MultibodyMarch, times: FloatArray, first: IntArray, lanes: IntArray
) -> FloatArray:
    """Return the indentations where their rates pass zero between readings and the next ones."""
    from scipy.optimize import elementwise

    def read(at: FloatArray, lane: FloatArray, row: int) -> FloatArray:
        order = np.argsort(at, kind="stable")
        values = run.replay(assembly, found, np.ascontiguousarray(at[order]), BOTH)[2]
        out = np.empty(len(at))
        out[order] = values[np.arange(len(at)), row, lane[order].astype(np.int64)]
        return out

    def rate(at: FloatArray, lane: FloatArray) -> FloatArray:
        return read(at.ravel(), np.broadcast_to(lane, at.shape).ravel(), 1).reshape(at.shape)

    at: Any = elementwise.find_root(rate, (times[first], times[first + 1]), args=(lanes.astype(float),)).x
    return read(np.asarray(at), lanes.astype(float), 0)
