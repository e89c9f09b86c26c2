"""Wheels that pass one after the other over one rail. Each pass starts with the surface that the last one left.

for each pass: speed, load and start, drawn where they scatter -> pieces over the surface as it is -> march
               -> indentation at every sample -> how far each yields -> the surface after the pass
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.build import lower
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.laws.plastic import PlasticLaw, law_rows, patch_semi_axis, plastic_bearing, static_force_of
from wheeltapper.lower.marks.marks import MarkedPath, Surface, height_at, marks_at
from wheeltapper.lower.numbers import METHODS, Placing, numbers_of
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program
from wheeltapper.march.general.at_rest import indentation_at_rest

FloatArray = NDArray[np.float64]

SHAKEDOWN = (4.7 / 2.8) ** 3
"""Force at the shakedown limit over that at first yield.

Largest pressures over the yield stress in shear: 2.8 at first yield, 4.7 at shakedown of a frictionless point contact.
Source: A. R. S. Ponter, A. D. Hearle and K. L. Johnson, Application of the kinematical shakedown theorem to rolling and
sliding point contacts, Journal of the Mechanics and Physics of Solids 33 (1985).
"""
LEAST_FACTOR = 0.05
"""Smallest ratio of a scattered speed or load to its mean. It keeps rare draws of a wide distribution positive."""


@dataclass(frozen=True)
class Scatter:
    """Scatter of the passes, and hardening of the surface.

    Attributes
    ----------
    hardening
        1: a place yields again only beyond its largest indentation so far. 0: it yields as early as a virgin one.
    speed, load
        Standard deviations over the mean.
    start
        Length, m, over which the starting places of the wheels, at rest, are spread evenly.
    seed
        Seed of the random numbers. The draws of pass n do not depend on the number of passes.
    """

    hardening: float = 1.0
    speed: float = 0.0
    load: float = 0.0
    start: float = 0.0
    seed: int = 0


class PassResult(NamedTuple):
    """Results of one pass."""

    status: int
    speed: float  # m/s
    applied_load: float  # N, without the wheelset's weight
    start: float  # m
    largest_force: float  # N
    impacts: int
    length: float  # m
    plastic_work: float  # J
    elastic: float  # shares of the length
    shakedown: float
    ratcheting: float


def drawn_pass(held: Scatter, number: int) -> tuple[float, float, float]:
    """Return speed and load of a pass over their means, and its start, m."""
    if not (held.speed or held.load or held.start):
        return 1.0, 1.0, 0.0
    normal = np.random.default_rng([held.seed, number])
    speed, load = np.maximum(1.0 + normal.standard_normal(2) * (held.speed, held.load), LEAST_FACTOR).tolist()
    return speed, load, float(held.start * normal.random())


def checked_length(scenario: Scenario, scatter: Scatter) -> float:
    """Return how far the wheels of a pass go, m; refuse starts beyond."""
    length = float(scenario.speed * scenario.duration)
    if scatter.start >= length:
        raise InputError("", "scatter.start", f"{scatter.start:g} m", f"less than the run of {length:g} m")
    return length


class RailLine:
    """A rail over which the same scenario passes again and again.

    Parameters
    ----------
    scenario
        A scenario with an elastic-plastic contact and point rolling.
    scatter
        Scatter of the passes.
    per_interval
        Samples in half a semi-axis of the contact patch.
    method
        "default" or "strict".
    """

    def __init__(self, scenario: Scenario, scatter: Scatter, per_interval: int, method: str) -> None:
        run.choose(run.WEAR_IN, scenario.needs)
        scenario.check_extent()
        self.scenario, self.contact, self.scatter, self._method = scenario, scenario.contact, scatter, METHODS[method]
        lowered = lower(scenario, method)
        self._lowered = lowered
        self.program, self.notes, self.static_force = lowered.program, lowered.notes, lowered.static_force
        self.length = checked_length(scenario, scatter)
        (self.law,) = lowered.plastic_laws
        self.semi_axis = patch_semi_axis(scenario.contact, scenario.vehicle, lowered.static_force)
        self.virgin = Surface.virgin_surface(self.length, self.semi_axis, self.law.onset, per_interval)
        self._path = MarkedPath(lowered.table, self.virgin, self.length)
        self._samples = self.virgin.sample_positions[self.virgin.sample_positions < self.length]
        self.base = lowered.table.height_at(self._samples)

    @property
    def sample_positions(self) -> FloatArray:
        """Where the samples lie on the run, m."""
        return self._samples

    def rail_heights(self, surface: Surface) -> FloatArray:
        """Return the height of the rail at the samples, m."""
        return np.asarray(self.base - self.contact.share_of_rail * self.settled(surface))

    def settled(self, surface: Surface) -> FloatArray:
        """Return the permanent indentation at the samples, averaged over the patch, m."""
        return surface.settled_indentation()[: len(self._samples)]

    def _drawn_pass(self, number: int) -> tuple[float, float, float]:
        """Return speed, load and start of a pass."""
        faster, heavier, start = drawn_pass(self.scatter, number)
        return float(self.scenario.speed) * faster, float(self.scenario.vehicle.load) * heavier, start

    def _pass_program(
        self, surface: Surface, speed: float, load: float, start: float
    ) -> tuple[Program, PlasticLaw, float]:
        """Return the program of a pass over the surface, its law with its units, and its unit of time, s."""
        lowered = self._lowered
        numbers, length, time, law = lowered.program.numbers.copy(), lowered.length, lowered.time, lowered.program.law
        vehicle = self.scenario.vehicle
        if (speed, load) != (self.scenario.speed, vehicle.load):
            changed = self.scenario.replaced({"speed": speed, "vehicle.load": load})
            one, none = np.ones(1), np.zeros(1)
            drawn, units = numbers_of(Fields(changed), Placing(one, one, none, none, one), self._method)
            numbers[: contract.LOOP] = drawn[0, : contract.LOOP]
            length, time = units.length.item(), units.time.item()
            law = law_rows(self.contact, self.law.onset / length)
            if numbers[contract.DECK_MASS] > 0.0:
                numbers[contract.PRESTRESS] = static_force_of(law, numbers[contract.STIFFNESS])
        force = self.scenario.vehicle.mass * length / time**2
        made = PlasticLaw(law, length, force)
        pieces = self._path.pieces_over(surface, made, self.contact.share_of_rail)
        numbers[contract.LOOP] = len(pieces)
        numbers[contract.START_SHIFT] = -start
        numbers[contract.END] = (self.length - start) / speed / time
        for edge in (contract.DECK_FROM, contract.DECK_TO):
            numbers[edge] -= start / speed / time
        if self.scenario.start == "equilibrium":
            row = pieces[int(np.searchsorted(pieces[:, contract.START], start, side="right")) - 1]
            height, (residual, bears, factor) = height_at(row, start) / length, marks_at(row, start)
            stiffness = numbers[contract.STIFFNESS]
            bearing = plastic_bearing(law, residual / length, bears / length, factor)
            numbers[contract.START_HEIGHT] = height - indentation_at_rest(bearing, 1.0, stiffness, height)
        return Program(pieces, numbers, law), made, time

    def after_pass(self, surface: Surface, number: int) -> tuple[Surface, PassResult]:
        """Return the surface after pass `number`, and the results of that pass."""
        from wheeltapper.march.wheel.dense import OUT_DELTA, OUT_FORCE, OUT_RESIDUAL

        speed, load, start = self._drawn_pass(number)
        program, law, time = self._pass_program(surface, speed, load, start)
        march = run.march(program)
        first = int(np.searchsorted(self._samples, start))
        times = (self._samples[first:] - start) / speed / time
        out = march.at(times)
        depths = (np.maximum(out[:, OUT_DELTA], 0.0) + out[:, OUT_RESIDUAL]) * law.length
        reached = surface.yield_reached(first, depths)
        before = surface.borne[first : first + len(reached)]
        grown = reached > before
        dissipated = law.dissipated_by(reached[grown]) - law.dissipated_by(before[grown])
        work = float(dissipated.sum()) * surface.sample_spacing / (2.0 * self.semi_axis)
        limit = program.law[0, contract.LAW_START] ** 1.5
        elastic = float(np.mean(out[:, OUT_FORCE] <= limit))
        beyond = float(np.mean(out[:, OUT_FORCE] > SHAKEDOWN * limit))
        largest = max(float(march.peaks[:, contract.PEAK_FORCE].max(initial=0.0)), float(out[:, OUT_FORCE].max()))
        told = PassResult(
            march.status, speed, load, start, largest * law.force,
            int((march.events[:, contract.EVENT_KIND] == contract.IMPACT).sum()), self.length - start, work, elastic,
            1.0 - elastic - beyond, beyond,
        )  # fmt: skip
        return surface.after_yielding(first, reached, law, self.scatter.hardening), told
