"""Exact derivatives of features with respect to fields of a scenario, through all impacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.many import EPSILON, Direction, Many
from wheeltapper.lower.table import used_degree
from wheeltapper.march import program as contract
from wheeltapper.record.features import Feature
from wheeltapper.record.simulate import say_that_it_compiles

if TYPE_CHECKING:
    from wheeltapper.march.ensemble import Cells, Marched
    from wheeltapper.march.gradients import Tangents, Turns

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Slopes:
    """Features and their derivatives in many cells.

    Attributes
    ----------
    values
        (features, cells).
    gradient
        (features, parameters, cells): SI units of the feature per SI unit of the parameter.
    status
        (cells,) why each march ended.
    gentlest
        (cells,) smallest indentation rate at an event, scaled; near zero the cell grazes.
    amplification
        (cells,) how much a change of the start has grown when the last feature is known.
    """

    values: FloatArray
    gradient: FloatArray
    status: IntArray
    gentlest: FloatArray
    amplification: FloatArray


def slopes(many: Many, parameters: tuple[str, ...], features: tuple[Feature, ...], threads: int) -> Slopes:
    """Compute features and their derivatives with respect to some of the changed fields of `many`."""
    from wheeltapper.march.gradients import PARAMETERS

    groups = [parameters[i : i + PARAMETERS] for i in range(0, len(parameters), PARAMETERS)]
    parts = [_slopes(many, group, features, threads) for group in groups]
    gradient = np.concatenate([part.gradient for part in parts], axis=1)
    return Slopes(parts[0].values, gradient, parts[0].status, parts[0].gentlest, parts[0].amplification)


def is_ready(many: Many, parameters: tuple[str, ...], tally: bool) -> bool:
    """Return False where the gradients of these cells begin with compiling."""
    from wheeltapper.march import gradients

    return gradients.is_ready(*turns_of(many, [many.along(path) for path in parameters[: gradients.PARAMETERS]]), tally)


def turns_of(many: Many, directions: list[Direction]) -> tuple[Cells, Turns]:
    """Return the cells, and how they change along some directions."""
    from wheeltapper.march.gradients import Turns
    from wheeltapper.march.tangent_path import LANES

    cells = len(many.cells.first)
    numbers = np.zeros((cells, contract.NUMBERS, LANES))
    table = np.full(LANES, -1, dtype=np.int64)
    bends: list[FloatArray] = []
    pieces = many.cells.pieces.copy()
    for lane, direction in enumerate(directions):
        numbers[:, :, lane] = direction.numbers
        if direction.bend is not None:
            table[lane] = len(bends)
            bends.append(direction.bend)
    for bent in bends:  # a kernel knows a piece's tangent up to the piece's own degree
        for degree, source in ((contract.DEGREE, contract.COEFFICIENT), (contract.FACTOR_DEGREE, contract.FACTOR)):
            held = bent[:, source : source + contract.TERMS]
            used = used_degree(held, 1e-15 * float(np.abs(held).max()))
            pieces[:, degree] = np.where(pieces[:, degree] < 0, -1, np.maximum(pieces[:, degree], used))
    bent_all = np.array(bends) if bends else np.zeros((1, 1, contract.PIECE_COLUMNS))
    return many.cells._replace(pieces=pieces), Turns(numbers, bent_all, table)


def _slopes(many: Many, parameters: tuple[str, ...], features: tuple[Feature, ...], threads: int) -> Slopes:
    from wheeltapper.march import gradients
    from wheeltapper.record.trains import Trains

    directions = [many.along(path) for path in parameters]
    cells, turns = turns_of(many, directions)
    tally = any(feature.tally for feature in features)
    if not gradients.is_ready(cells, turns, tally):
        say_that_it_compiles()
    total = len(many.cells.first)
    out = Slopes(
        np.empty((len(features), total)), np.empty((len(features), len(parameters), total)),
        np.empty(total, dtype=np.int64), np.empty(total), np.empty(total),
    )  # fmt: skip

    def read(block: slice, marched: Marched, tangents: Tangents) -> None:
        out.status[block], out.gentlest[block] = marched.status, tangents.gentlest
        out.amplification[block] = tangents.amplification
        for lane, direction in enumerate(directions):
            tilted = _tilted(marched, tangents, direction, block, lane)
            trains = Trains(tilted, direction.units.part(block))
            for row, feature in enumerate(features):
                values = feature(trains)
                out.values[row, block] = values.real
                if feature.differentiable:
                    out.gradient[row, lane, block] = np.where(np.isnan(values), np.nan, values.imag / EPSILON)
                else:
                    out.gradient[row, lane, block] = np.nan

    gradients.march_all(cells, turns, threads, read, tally)
    return out


def _tilted(marched: Marched, tangents: Tangents, direction: Direction, block: slice, lane: int) -> Marched:
    """Return what was marched with the derivatives along one direction as imaginary parts."""
    from wheeltapper.march.tangent_peaks import OF_SIZE, OF_TIME

    events, peaks = marched.events.astype(complex), marched.peaks.astype(complex)
    events[:, contract.EVENT_TIME] += 1j * EPSILON * tangents.events[:, OF_TIME, lane]
    events[:, contract.EVENT_RATE] += 1j * EPSILON * tangents.events[:, OF_SIZE, lane]
    peaks[:, contract.PEAK_TIME] += 1j * EPSILON * tangents.peaks[:, OF_TIME, lane]
    peaks[:, contract.PEAK_FORCE] += 1j * EPSILON * tangents.peaks[:, OF_SIZE, lane]
    ended = marched.status == contract.DONE
    end: Any = marched.end + 1j * EPSILON * np.where(ended, direction.numbers[block, contract.END], 0.0)
    tilted = marched._replace(events=events, peaks=peaks, end=end)
    if marched.highest is None or marched.impulses is None or tangents.highest is None or tangents.impulses is None:
        return tilted
    highest: Any = marched.highest + 1j * EPSILON * tangents.highest[:, lane]
    impulses: Any = marched.impulses + 1j * EPSILON * tangents.impulses[:, lane]
    return tilted._replace(highest=highest, impulses=impulses)
