"""Vehicles that pass one after the other over a rail that gives way, or several wheelsets over a rigid one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.passes import SHAKEDOWN, PassResult, Scatter, checked_length, drawn_pass
from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.marks.marks import SEMI_AXIS, Surface
from wheeltapper.lower.numbers import METHODS
from wheeltapper.lower.on_rails import (
    UnderWheels,
    checked_way,
    lower_on_rails,
    memory_of,
    method_on,
    on_wheels,
    paths_of,
    remembering,
    system_of,
    under_wheels,
    virgin_rail,
)
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.general.contract import Task

FloatArray = NDArray[np.float64]


class _Passing(NamedTuple):
    """A vehicle that passes: its scenario, its paths, and the track below it."""

    scenario: Scenario
    tables: list[PathTable]
    under: UnderWheels


class RailLineOnTrack:
    """A rail over which vehicles pass again and again, by the general march.

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
    vehicles
        What passes in turn; none: the scenario's.
    """

    def __init__(
        self, scenario: Scenario, scatter: Scatter, per_interval: int, method: str, vehicles: tuple[Any, ...] = ()
    ) -> None:
        lowered = lower_on_rails(scenario, method)
        self.scenario, self.scatter, self._method = scenario, scatter, method
        self.program, self.notes, self.law = lowered.program, lowered.notes, lowered.plastic_laws[0]
        self.length = checked_length(scenario, scatter)
        passing = [scenario.replaced({"vehicle": vehicle}) for vehicle in vehicles] or [scenario]
        for one in passing:
            run.choose(run.WEAR_IN, one.needs)
            one.check_extent()
        self.static_force = max(wheelset.weight for one in passing for wheelset in one.vehicle.plane.wheelsets)
        self._passing = [self._prepared(one) for one in passing]
        extent = max(one.vehicle.plane.extent for one in passing)
        self._begins = min(min(one.vehicle.plane.positions) for one in passing)
        first = on_wheels(scenario, self.static_force)
        self.virgin = virgin_rail(first, self.length, per_interval, extent)
        self.semi_axis = SEMI_AXIS * self.virgin.interval
        places = self.virgin.sample_positions + self._begins
        self._seen = (places >= 0.0) & (places < self.length)
        self.sample_positions = places[self._seen]
        self._marked = [
            memory_of(on_wheels(one.scenario), one.tables, self.virgin, self.length, start=self._begins).marked
            for one in self._passing
        ]
        self._base = self._passing[0].tables[0].height_at(self.sample_positions)

    def _prepared(self, scenario: Scenario) -> _Passing:
        plane = scenario.vehicle.plane
        under = under_wheels(scenario, plane.extent, self._method)
        checked_way(scenario, plane, under, float(scenario.speed), self.length, self._method)
        return _Passing(scenario, paths_of(scenario, plane, self.length, METHODS[self._method])[0], under)

    def settled(self, surface: Surface) -> FloatArray:
        """Return the permanent indentation at the samples, averaged over the patch, m."""
        return np.asarray(surface.settled_indentation()[self._seen], dtype=np.float64)

    def rail_heights(self, surface: Surface) -> FloatArray:
        """Return the height of the rail at the samples, m."""
        return np.asarray(self._base - self.scenario.contact.share_of_rail * self.settled(surface), dtype=np.float64)

    @property
    def _rails(self) -> float:
        return float(self.scenario.vehicle.plane.rails)

    def after_pass(self, surface: Surface, number: int) -> tuple[Surface, PassResult]:
        """Return the surface after pass `number`, and the results of that pass."""
        faster, heavier, start = drawn_pass(self.scatter, number)
        turn = number % len(self._passing)
        passing, marked = self._passing[turn], self._marked[turn]
        scenario = passing.scenario if heavier == 1.0 else passing.scenario.replaced(_loaded(passing.scenario, heavier))
        speed, length = float(scenario.speed) * faster, self.length - start
        vehicle = on_wheels(scenario, self.static_force)
        memory = memory_of(vehicle, (), surface, length, self.scatter.hardening, self._begins)
        memory = replace(memory, marked=marked, offsets=tuple(offset + start for offset in memory.offsets))
        system = remembering(system_of(vehicle, passing.under, passing.tables, speed), memory)
        moved = tuple(one._replace(position=one.position + start) for one in system.wheels)
        system = system._replace(contacts=moved + system.contacts[len(moved) :])
        several = memory if len(moved) > 1 else None
        march = run.march(Task(system, method_on(system.ring, self._method), length / speed, several))
        marking = memory.begin()
        march.lay(marking)
        pressures = np.concatenate(marking.pressures)
        elastic, beyond = float(np.mean(pressures <= 1.0)), float(np.mean(pressures > SHAKEDOWN))
        largest = float(march.peaks[:, contract.PEAK_FORCE].max(initial=0.0)) * self._rails
        told = PassResult(
            march.status, speed, float(scenario.vehicle.plane.wheelsets[0].load), start,
            max(largest, float(pressures.max()) * max(law.force for law in memory.laws)),
            int((march.events[:, contract.EVENT_KIND] == contract.IMPACT).sum()), length, marking.work, elastic,
            1.0 - elastic - beyond, beyond,
        )  # fmt: skip
        return marking.left(), told


def _loaded(scenario: Scenario, factor: float) -> dict[str, float]:
    """Return the changes that multiply all loads of a vehicle."""
    return {f"vehicle.{path}": load * factor for path, load in scenario.vehicle.loads.items()}
