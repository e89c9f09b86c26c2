"""Vehicles that pass one after the other over a rail that gives way, or several wheelsets over a rigid one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.lines.base import Drawn, Line, Passing
from wheeltapper.lower.marks.marks import SEMI_AXIS, Surface
from wheeltapper.lower.marks.rail_memory import Marking
from wheeltapper.lower.numbers import METHODS
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.lower.plane import (
    UnderWheels,
    checked_way,
    lower_plane,
    memory_of,
    method_on,
    on_wheels,
    paths_of,
    remembering,
    system_of,
    under_wheels,
    virgin_rail,
)
from wheeltapper.march.general.contract import Task
from wheeltapper.march.general.task import Marched


class _Prepared(NamedTuple):
    """A vehicle that passes: its scenario, its paths, and the track below it."""

    scenario: Scenario
    tables: list[PathTable]
    under: UnderWheels


class PlaneLine(Line):
    """A rail over which vehicles pass again and again, by the general march."""

    def __init__(
        self, scenario: Scenario, start: float, per_interval: int, method: str, vehicles: Sequence[Any] = ()
    ) -> None:
        super().__init__(scenario, start, vehicles)
        lowered = lower_plane(scenario, method)
        self._method, self.notes, self.law = method, lowered.notes, lowered.plastic_laws[0]
        self.static_force = max(wheelset.weight for one in self.passing for wheelset in one.vehicle.plane.wheelsets)
        self._prepared = [self._prepare(one) for one in self.passing]
        extent = max(one.vehicle.plane.extent for one in self.passing)
        self._begins = min(min(one.vehicle.plane.positions) for one in self.passing)
        first = on_wheels(scenario, self.static_force)
        self.virgin = virgin_rail(first, self.length, per_interval, extent)
        self.semi_axis = SEMI_AXIS * self.virgin.interval
        self.place_samples(self.virgin, self._begins)
        self._marked = [
            memory_of(on_wheels(one.scenario), one.tables, self.virgin, self.length, start=self._begins).marked
            for one in self._prepared
        ]
        self._base = self._prepared[0].tables[0].height_at(self.sample_positions)

    def _prepare(self, scenario: Scenario) -> _Prepared:
        plane = scenario.vehicle.plane
        under = under_wheels(scenario, plane.extent, self._method)
        checked_way(scenario, plane, under, float(scenario.speed), self.length, self._method)
        return _Prepared(scenario, paths_of(scenario, plane, self.length, METHODS[self._method])[0], under)

    def passing_over(self, surface: Surface, number: int, drawn: Drawn, hardening: float) -> Passing:
        """Return a pass over a surface."""
        turn, start = number % len(self._prepared), drawn.start
        scenario, tables, under = self._prepared[turn]
        if drawn.heavier != 1.0:
            loads = scenario.vehicle.loads.items()
            scenario = scenario.replaced({f"vehicle.{path}": load * drawn.heavier for path, load in loads})
        speed, length = float(scenario.speed) * drawn.faster, self.length - start
        vehicle = on_wheels(scenario, self.static_force)
        memory = memory_of(vehicle, (), surface, length, hardening, self._begins)
        offsets = tuple(offset + start for offset in memory.offsets)
        memory = replace(memory, marked=self._marked[turn], offsets=offsets)
        system = remembering(system_of(vehicle, under, tables, speed), memory)
        moved = tuple(one._replace(position=one.position + start) for one in system.wheels)
        system = system._replace(contacts=moved + system.contacts[len(moved) :])
        several = memory if len(moved) > 1 else None
        task = Task(system, method_on(system.ring, self._method), length / speed, several)

        def pressed(march: Marched) -> Sequence[Marking]:
            marking = memory.begin()
            march.lay(marking)
            return (marking,)

        plane = scenario.vehicle.plane
        yield_force = max(law.force for law in memory.laws)
        return Passing(task, speed, float(plane.wheelsets[0].load), length, float(plane.rails), yield_force, pressed)
