"""The map from one section to another, some waves later, in scaled units; its derivatives; and its fixed points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.numbers import Units
from wheeltapper.lower.section import Section, SectionCells
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program
from wheeltapper.march.wheel.ensemble import Cells
from wheeltapper.march.wheel.orbits import LARGEST_FORCE, LOSSES, STATE_SIZE, Tangents, sections
from wheeltapper.orbits.asked import has_deck

FloatArray = NDArray[np.float64]
CLOSED = 1e-12
"""Largest closure of an orbit: the scaled distance between its first and its last state."""
ROUNDING = 2e-15
"""Relative error that a state may have from rounding."""
ITERATIONS = 40
"""Largest number of steps of Newton's method."""
LONGEST = 1.0
"""Longest step of Newton's method, in scaled units: one static indentation."""
BESIDE = 1e-6
"""Relative change of a parameter for difference quotients, and the change of a state where tangents are missing."""


class Wave(NamedTuple):
    """What the map is made of at one value of the parameters."""

    program: Program
    to_program: FloatArray  # (n,): from the map's units to those of the program
    units: Units
    period: float  # of one wave, s


class Image(NamedTuple):
    """The image of a state.

    Attributes
    ----------
    state
        (n,) state after all waves.
    slopes
        (n, n) derivatives of it by the first state.
    losses
        Losses of contact in all waves.
    largest_force
        N.
    near
        How near the motion comes to grazing, scaled.
    trail
        (waves, n) states after each wave.
    """

    state: FloatArray
    slopes: FloatArray
    losses: int
    largest_force: float
    near: float
    trail: FloatArray


class FixedPoint(NamedTuple):
    """A state that returns to itself, or the nearest to one that was found."""

    state: FloatArray
    image: Image
    closure: float
    closed: bool


class SectionMap:
    """The map of a state at phase zero to that some waves later, as a function of one or two parameters.

    Parameters
    ----------
    section
        The scenario.
    waves
        Number of waves.
    paths
        Fields of the scenario that are the parameters.

    Attributes
    ----------
    scale
        (n,) what a state of the map is multiplied by to be in m and m/s.
    static_force
        N0, N.
    """

    def __init__(self, section: Section, waves: int, paths: tuple[str, ...] = ()) -> None:
        self.section, self.waves, self.paths = section, waves, paths
        self.size = 4 if has_deck(section) else 2
        units = section.cells({}).units
        length, time = float(units.length[0]), float(units.time[0])
        self.scale = np.array([length, length / time] * 2)[: self.size]
        self.static_force = float(units.static_force[0])
        self._tangents = Tangents()

    def waves_at(self, values: FloatArray) -> list[Wave]:
        """Return what the map is made of at some values of the parameters, (many, parameters)."""
        found = self.section.cells_to_start({path: values[:, i] for i, path in enumerate(self.paths)})
        return [self.wave_of(found, cell) for cell in range(len(values))]

    def wave_of(self, found: SectionCells, cell: int) -> Wave:
        """Return what the map is made of in one cell."""
        units = found.units.part(slice(cell, cell + 1))
        length, time = float(units.length[0]), float(units.time[0])
        own = self.scale / np.array([length, length / time] * 2)[: self.size]
        return Wave(found.program(cell), own, units, float(found.period[cell]))

    def wave_at(self, *values: float) -> Wave:
        """Return what the map is made of at one value of the parameters."""
        return self.waves_at(np.array([values]).reshape(1, -1))[0]

    def _full(self, wave: Wave, state: FloatArray) -> FloatArray:
        out = np.zeros(STATE_SIZE)
        out[: self.size] = state * wave.to_program
        return out

    def image(self, wave: Wave, state: FloatArray) -> Image:
        """Return the image of a state, with its derivatives; NaN where the march did not reach the end."""
        turn = self._tangents.turn(wave.program, self._full(wave, state), self.waves)
        n, own = self.size, wave.to_program
        if turn.status != contract.DONE:
            nothing = np.full(n, np.nan)
            return Image(nothing, np.full((n, n), np.nan), 0, np.nan, 0.0, np.full((self.waves, n), np.nan))
        trail = turn.trail[:, :n] / own
        slopes = turn.slopes[:n, :n] / own[:, None] * own
        if not np.all(np.isfinite(slopes)):
            slopes = self._differences(wave, state)
        force = float(turn.told[:, LARGEST_FORCE].max() * wave.units.force[0])
        return Image(trail[-1], slopes, int(turn.told[:, LOSSES].sum()), force, turn.near, trail)

    def marched(self, wave: Wave, states: FloatArray, rounds: int = 1) -> FloatArray:
        """Return the images of some states, (many, n), after some rounds, without derivatives."""
        many = len(states)
        cells = _repeated(wave.program, many)
        full = np.array([self._full(wave, state) for state in states])
        sections(cells, full, rounds * self.waves, 0)
        return np.asarray(full[:, : self.size] / wave.to_program)

    def side_by_side(self, values: FloatArray, states: FloatArray) -> FloatArray:
        """Return the images (many, n) of some states, each at its own value of the parameters, without derivatives."""
        found = self.section.cells_to_start({path: values[:, i] for i, path in enumerate(self.paths)})
        length, time = found.units.length, found.units.time
        own = self.scale / np.column_stack([length, length / time] * 2)[:, : self.size]
        full = np.zeros((len(states), STATE_SIZE))
        full[:, : self.size] = states * own
        sections(found.cells, full, self.waves, 0)
        return np.asarray(full[:, : self.size] / own)

    def trail(self, wave: Wave, state: FloatArray) -> FloatArray:
        """Return the states after each wave, (waves, n), without derivatives."""
        kept = sections(_repeated(wave.program, 1), self._full(wave, state)[None], 0, self.waves).kept
        return np.asarray(kept[0, :, : self.size] / wave.to_program)

    def losses(self, wave: Wave, state: FloatArray) -> tuple[FloatArray, int]:
        """Return the image of a state and the losses of contact on the way, without derivatives."""
        full = self._full(wave, state)[None]
        found = sections(_repeated(wave.program, 1), full, 0, self.waves)
        return full[0, : self.size] / wave.to_program, int(found.told[0, :, LOSSES].sum())

    def _differences(self, wave: Wave, state: FloatArray) -> FloatArray:
        """Return the derivatives of the image by difference quotients."""
        changes = BESIDE * np.eye(self.size)
        ends = self.marched(wave, np.concatenate([state + changes, state - changes]))
        return np.asarray((ends[: self.size] - ends[self.size :]).T / (2.0 * BESIDE))

    def fixed_point(self, wave: Wave, state: FloatArray) -> FixedPoint:
        """Return the orbit near a state, by Newton's method with bounded steps."""
        image = self.image(wave, state)
        best = FixedPoint(state, image, _distance(image.state, state), False)
        for _ in range(ITERATIONS):
            if not np.isfinite(best.closure) or best.closure <= _rounding(best):
                break
            step = -_solved(best.image.slopes - np.eye(self.size), best.image.state - best.state)
            step *= min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-300))
            better = self._shorter(wave, best, step)
            if better is None:
                break
            best = better
        return best._replace(closed=bool(best.closure <= max(CLOSED, _rounding(best))))

    def _shorter(self, wave: Wave, best: FixedPoint, step: FloatArray) -> FixedPoint | None:
        """Return the state behind a step, or behind a part of it, that closes better; None if none does."""
        for part in (1.0, 0.5, 0.25, 0.1, 0.03, 0.01):
            state = best.state + part * step
            image = self.image(wave, state)
            closure = _distance(image.state, state)
            if closure < best.closure:
                return FixedPoint(state, image, closure, False)
            if best.closure <= CLOSED:
                return None
        return None


def exact_determinant(program: Program, waves: int) -> float:
    """Return the product of the multipliers of any orbit of some waves; NaN where it depends on the motion."""
    numbers = program.numbers
    if numbers[contract.HYSTERESIS] != 0.0:
        return float("nan")
    rate = numbers[contract.DAMPING]
    if numbers[contract.DECK_MASS] > 0.0:
        rate += numbers[contract.DECK_DAMPING] / numbers[contract.DECK_MASS]
    return float(np.exp(-rate * numbers[contract.END] * waves))


def _distance(a: FloatArray, b: FloatArray) -> float:
    distance = float(np.abs(a - b).max())
    return distance if np.isfinite(distance) else np.inf


def _rounding(at: FixedPoint) -> float:
    """Return the closure that rounding leaves."""
    growth = 1.0 + float(np.abs(at.image.slopes).max())
    return ROUNDING * growth * (1.0 + float(np.abs(at.state).max()))


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solution of linear equations, of singular ones the shortest."""
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])


def _repeated(program: Program, many: int) -> Cells:
    """Return the same wave as many cells."""
    zeros = np.zeros(many, dtype=np.int64)
    return Cells(program.pieces, zeros, zeros + len(program.pieces), np.repeat(program.numbers[None], many, axis=0))
