"""Exact derivatives of features with respect to fields of a scenario, through all impacts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.beyond_trains import others_of
from wheeltapper.ground.notes import Note, Shared
from wheeltapper.ground.progress import progress_counter
from wheeltapper.lower.many import EPSILON, Direction, LoweredCells
from wheeltapper.lower.paths.table import used_degree
from wheeltapper.march.common import program as contract
from wheeltapper.record.features import Feature

if TYPE_CHECKING:
    from wheeltapper.march.wheel.ensemble import Cells, Marched
    from wheeltapper.march.wheel.gradients import CellTangents, Tangents
    from wheeltapper.record.trains.trains import Trains

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class FeatureSlopes:
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
        (cells,) growth of a small change of the start until the last feature is known.
    notes
        What the features say.
    """

    values: FloatArray
    gradient: FloatArray
    status: IntArray
    gentlest: FloatArray
    amplification: FloatArray
    notes: list[Shared]


def feature_slopes(
    many: LoweredCells, parameters: tuple[str, ...], features: tuple[Feature, ...], threads: int
) -> FeatureSlopes:
    """Compute features and their derivatives with respect to some of the changed fields of `many`."""
    from wheeltapper.march.wheel.gradients import PARAMETERS

    groups = [parameters[i : i + PARAMETERS] for i in range(0, len(parameters), PARAMETERS)]
    parts = [_slopes_of_block(many, group, features, threads) for group in groups]
    gradient = np.concatenate([part.gradient for part in parts], axis=1)
    return replace(parts[0], gradient=gradient)


def turns_of(many: LoweredCells, directions: list[Direction]) -> tuple[Cells, CellTangents]:
    """Return the cells, and their derivatives along some directions."""
    from wheeltapper.march.steps.tangent_path import LANES
    from wheeltapper.march.wheel.gradients import CellTangents

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
    return many.cells._replace(pieces=pieces), CellTangents(numbers, bent_all, table)


def _slopes_of_block(
    many: LoweredCells, parameters: tuple[str, ...], features: tuple[Feature, ...], threads: int
) -> FeatureSlopes:
    from wheeltapper.march.wheel.gradients import march_all
    from wheeltapper.record.trains.trains import Trains, notes_of_cells

    directions = [many.direction_along(path) for path in parameters]
    cells, turns = turns_of(many, directions)
    tally = any(feature.tally for feature in features)
    total = len(many.cells.first)
    out = FeatureSlopes(
        np.empty((len(features), total)), np.empty((len(features), len(parameters), total)),
        np.empty(total, dtype=np.int64), np.empty(total), np.empty(total), [],
    )  # fmt: skip

    def read_block(block: slice, marched: Marched, tangents: Tangents) -> None:
        out.status[block], out.gentlest[block] = marched.status, tangents.gentlest
        out.amplification[block] = tangents.amplification
        others, said = others_of(many, block), list[tuple[int, Note]]()
        for lane, direction in enumerate(directions):
            rates = Rates.along(tangents, lane)
            units = direction.units.part(block)

            def tilted(
                gap: float, rates: Rates = rates, direction: Direction = direction, units: Any = units
            ) -> Trains:
                with_rates = _with_imaginary_rates(marched, rates.known(gap), direction, block)
                return Trains(with_rates, units, *others, said, gap * EPSILON)

            for row, (values, slope) in enumerate(derivatives(features, tilted, rates.has_gaps)):
                out.values[row, block], out.gradient[row, lane, block] = values, slope
        out.notes.extend(notes_of_cells(said))
        count(block.stop - block.start)

    count = progress_counter("cells", total)
    march_all(cells, turns, threads, read_block, tally)
    return out


def derivatives(
    features: tuple[Feature, ...], tilted: Callable[[float], Trains], has_gaps: bool
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Return each feature and its derivative along one direction, NaN where it has none.

    Parameters
    ----------
    features
        The features.
    tilted
        Trains with derivatives as imaginary parts; unknown ones are filled with numbers of the order of its argument.
    has_gaps
        Whether some are unknown.
    """
    trains = tilted(0.0)
    other = tilted(1.0) if has_gaps or trains.lacks_maxima.any() else None
    for feature in features:
        values = feature(trains)
        if not feature.differentiable:
            yield values.real, np.full(values.shape, np.nan)
            continue
        unknown = np.isnan(values)
        if other is not None:
            unknown |= feature(other).imag != values.imag
        yield values.real, np.where(unknown, np.nan, values.imag / EPSILON)


class Rates(NamedTuple):
    """Derivatives of the results of a march along one direction; NaN where they are unknown.

    A NaN as an imaginary part would make the real part NaN, too. Therefore gaps are filled with numbers. A feature
    whose derivative depends on these numbers has no derivative.
    """

    events: FloatArray  # (events, 2)
    peaks: FloatArray  # (peaks, 2)
    highest: FloatArray  # (cells,), empty without a tally
    impulses: FloatArray  # (events,)

    @staticmethod
    def along(tangents: Tangents, lane: int) -> Rates:
        """Return those of one direction."""
        none = np.empty((0, lane + 1))
        highest = none if tangents.highest is None else tangents.highest
        impulses = none if tangents.impulses is None else tangents.impulses
        return Rates(tangents.events[:, :, lane], tangents.peaks[:, :, lane], highest[:, lane], impulses[:, lane])

    @property
    def has_gaps(self) -> bool:
        """Whether some are unknown."""
        return any(bool(np.isnan(rates).any()) for rates in self)

    def known(self, gap: float) -> Rates:
        """Return the same with different numbers of the order of `gap` in the gaps."""
        fills = (np.linspace(gap, 2.0 * gap, rates.size).reshape(rates.shape) for rates in self)
        return Rates(*(np.where(np.isnan(rates), fill, rates) for rates, fill in zip(self, fills, strict=True)))


def _with_imaginary_rates(marched: Marched, rates: Rates, direction: Direction, block: slice) -> Marched:
    """Return the results of a march with their derivatives along one direction as imaginary parts."""
    from wheeltapper.march.steps.tangent_path import OF_SIZE, OF_TIME

    events, peaks = marched.events.astype(complex), marched.peaks.astype(complex)
    events[:, contract.EVENT_TIME] += 1j * EPSILON * rates.events[:, OF_TIME]
    events[:, contract.EVENT_RATE] += 1j * EPSILON * rates.events[:, OF_SIZE]
    peaks[:, contract.PEAK_TIME] += 1j * EPSILON * rates.peaks[:, OF_TIME]
    peaks[:, contract.PEAK_FORCE] += 1j * EPSILON * rates.peaks[:, OF_SIZE]
    ended = marched.status == contract.DONE
    end: Any = marched.end + 1j * EPSILON * np.where(ended, direction.numbers[block, contract.END], 0.0)
    tilted = marched._replace(events=events, peaks=peaks, end=end)
    if marched.highest is None or marched.impulses is None:
        return tilted
    highest: Any = marched.highest + 1j * EPSILON * rates.highest
    impulses: Any = marched.impulses + 1j * EPSILON * rates.impulses
    return tilted._replace(highest=highest, impulses=impulses)
