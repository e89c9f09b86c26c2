"""Passages of one wheelset at several speeds, with derivatives. The rail is lowered once for all of them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import check_along
from wheeltapper.ask.trajectory import in_si, tilted_motion
from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.many import EPSILON, Direction, LoweredCells
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program

if TYPE_CHECKING:
    from wheeltapper.march.wheel.ensemble import Cells
    from wheeltapper.march.wheel.gradients import CellTangents
    from wheeltapper.march.wheel.march import Marched as MarchedWheel

FloatArray = NDArray[np.float64]


class PassageMotion(NamedTuple):
    """One passage at given times, in SI units; NaN beyond the end of its march."""

    status: int
    deck_acceleration: FloatArray  # (times,)
    slopes: FloatArray  # (parameters, times): its derivatives


class Passages:
    """Passages that differ in speed.

    Parameters
    ----------
    scenario
        A passage of a wheelset whose motion has exact derivatives.
    speeds
        m/s.
    parameters
        Paths of continuous fields with respect to which derivatives are computed.
    """

    def __init__(self, scenario: Scenario, speeds: FloatArray, parameters: tuple[str, ...]) -> None:
        check_along(run.INFORMATION, scenario, parameters)
        self.speeds, self.parameters = speeds, parameters
        held = {path: np.full(len(speeds), float(Fields(scenario)(path))) for path in parameters}
        self.many = LoweredCells(scenario, held | {"speed": speeds})

    @cached_property
    def marches(self) -> list[MarchedWheel]:
        """The marches, one for each speed."""
        return [run.march(self.many.program(i)) for i in range(len(self.speeds))]

    @cached_property
    def largest_forces(self) -> FloatArray:
        """(speeds,) N."""
        peaks = [march.peaks[:, contract.PEAK_FORCE].max(initial=0.0) for march in self.marches]
        return np.asarray(np.array(peaks) * self.many.units.force)

    @property
    def place_of_largest_force(self) -> float:
        """Position of the largest force, m; NaN if the force has no maximum."""
        i = int(np.argmax(self.largest_forces))
        peaks = self.marches[i].peaks
        if not len(peaks):
            return np.nan
        time = peaks[np.argmax(peaks[:, contract.PEAK_FORCE]), contract.PEAK_TIME] * self.many.units.time[i]
        return float(time * self.speeds[i])

    def motions_at(self, times: FloatArray) -> list[PassageMotion]:
        """Return each passage's deck acceleration with its derivatives at rising times, s."""
        from wheeltapper.march.steps.tangent_path import LANES

        directions = [self.many.direction_along(path) for path in self.parameters]
        groups = [directions[i : i + LANES] for i in range(0, max(len(directions), 1), LANES)]
        lowered = [(group, *self.many.turned(group)) for group in groups]
        out = []
        for i, march in enumerate(self.marches):
            parts = [self._sampled_passage(i, times, *each) for each in lowered]
            out.append(PassageMotion(march.status, parts[0][0], np.concatenate([part[1] for part in parts])))
        return out

    def _sampled_passage(
        self, i: int, times: FloatArray, directions: list[Direction], cells: Cells, turns: CellTangents
    ) -> tuple[FloatArray, FloatArray]:
        """Return the deck acceleration (times,) of a passage, and its derivatives (directions, times)."""
        from wheeltapper.march.wheel.gradients import sampled_tangents
        from wheeltapper.march.wheel.tangent_samples import VALUE

        block = slice(i, i + 1)
        units, numbers = self.many.units.part(block), cells.numbers[i]
        scaled = times / units.time.item()
        program = Program(cells.pieces, numbers)
        _, samples = sampled_tangents(program, turns.numbers[i], turns.bends, turns.table, scaled)
        plain = in_si(numbers.astype(complex), units, samples[:, :, VALUE].astype(complex), scaled)[1]
        slopes = np.empty((len(directions), len(times)))
        for lane, direction in enumerate(directions):
            own = direction.units.part(block)
            moved = tilted_motion(samples, lane, own, scaled)
            tilted = in_si(numbers + 1j * EPSILON * direction.numbers[i], own, moved, scaled)[1]
            slopes[lane] = tilted.imag / EPSILON
        return plain.real, slopes
