"""Wagons that pass one after the other over two rails, each over the marks that those before it have left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.lower.lines.base import Drawn, Line, Passing
from wheeltapper.lower.marks.marks import Surface
from wheeltapper.lower.marks.rail_memory import Marking
from wheeltapper.lower.marks.wagon_marks import SIDES, WornRails, lane_of, path_of, semi_axis_of
from wheeltapper.lower.wagon_on_track import wagon_on_its_track
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.march import Marched

FloatArray = NDArray[np.float64]
WHEELS = 2.0
"""Forces are told per wheelset, as if both of its wheels pressed alike."""


class WagonLine(Line):
    """Two rails over which wagons pass again and again, by the wagon's march.

    A surface holds the samples of the left rail, then those of the right one.
    """

    sides = SIDES

    def __init__(
        self, scenario: Scenario, start: float, per_interval: int, method: str, vehicles: Sequence[Any] = ()
    ) -> None:
        super().__init__(scenario, start, vehicles)
        self._method = method
        alone = [wagon_on_its_track(one, method) for one in self.passing]
        self.static_force = max(float(one.static_force.sum(axis=1).max()) for one in alone)
        positions = [_positions(one) for one in self.passing]
        self._begins = float(min(places.min() for places in positions))
        extent = float(max(places.max() for places in positions)) - self._begins
        lowered = wagon_on_its_track(scenario, method, self._worn((_NOTHING, _NOTHING), 1.0))
        self.notes, self.law = lowered.notes, lowered.plastic_laws[0]
        self.semi_axis = semi_axis_of(scenario, float(lowered.static_force[0].mean()))
        rail = Surface.virgin_surface(extent + self.length, self.semi_axis, self.law.onset, per_interval)
        self.virgin = self.joined((rail, rail))
        self.place_samples(rail, self._begins)
        places = self.sample_positions - _positions(scenario)[0]
        self._base = np.stack([
            path_of(lowered.assembly, lane_of(0, side)).height_at(places) for side in range(len(SIDES))
        ])  # fmt: skip

    def _worn(self, rails: tuple[Surface, ...], hardening: float) -> WornRails:
        left, right = rails
        return WornRails((left, right), self.static_force, self._begins, hardening)

    def joined(self, rails: Sequence[Surface]) -> Surface:
        """Return both rails as one surface."""
        left, right = rails
        return replace(left, borne=np.append(left.borne, right.borne), left=np.append(left.left, right.left))

    def rails_of(self, surface: Surface) -> tuple[Surface, ...]:
        """Return the left and the right rail of a surface."""
        borne, left = surface.borne.reshape(2, -1), surface.left.reshape(2, -1)
        return tuple(replace(surface, borne=borne[side], left=left[side]) for side in range(len(SIDES)))

    def passing_over(self, surface: Surface, number: int, drawn: Drawn, hardening: float) -> Passing:
        """Return a pass over a surface."""
        scenario = self.passing[number % len(self.passing)]
        speed, length = float(scenario.speed) * drawn.faster, self.length - drawn.start
        wagon = moved(loaded(scenario.vehicle, drawn.heavier), drawn.start)
        scenario = scenario.replaced({"speed": speed, "duration": length / speed, "vehicle": wagon})
        lowered = wagon_on_its_track(scenario, self._method, self._worn(self.rails_of(surface), hardening))
        memory = lowered.memory
        assert memory is not None  # as rails with marks have

        def pressed(march: Marched) -> Sequence[Marking]:
            marking = memory.begin()
            marking.press(march, everywhere=True)
            return marking.sides

        load = float(lowered.static_force[0].sum()) - wagon.axles[0].mass * wagon.gravity
        treads = float(lowered.assembly.numbers[asm.TREADS] * asm.LANES)
        yield_force = WHEELS * memory.rails[0].laws[0].force
        return Passing(lowered.program, speed, load, length, WHEELS, yield_force, pressed, treads)


def loaded(wagon: Wagon, factor: float) -> Wagon:
    """Return a wagon in which what it carries is heavier: the loads on its wheelsets, and masses and moments of bodies.

    A bogie frame is no load: carried are the bodies that no element joins to a wheelset; all, where each has one.
    """
    if factor == 1.0:
        return wagon
    wheelsets = {name for name in wagon.names if name not in {body.name for body in wagon.bodies}}
    on_wheels = {end for element in wagon.elements if wheelsets & {*element.between} for end in element.between}
    carried = {body.name for body in wagon.bodies} - on_wheels or {body.name for body in wagon.bodies}
    bodies = [
        body.model_copy(
            update={"mass": body.mass * factor, "inertia": tuple(moment * factor for moment in body.inertia)}
        ) if body.name in carried else body
        for body in wagon.bodies
    ]  # fmt: skip
    axles = [axle.model_copy(update={"load": axle.load * factor}) for axle in wagon.axles]
    return wagon.model_copy(update={"bodies": tuple(bodies), "axles": tuple(axles)})


def moved(wagon: Wagon, way: float) -> Wagon:
    """Return a wagon whose every part stands farther along the track at time zero, m."""
    if way == 0.0:
        return wagon

    def along(place: tuple[float, float, float]) -> tuple[float, float, float]:
        return place[0] + way, *place[1:]

    return wagon.model_copy(
        update={
            "bodies": tuple(body.model_copy(update={"position": along(body.position)}) for body in wagon.bodies),
            "axles": tuple(axle.model_copy(update={"position": axle.position + way}) for axle in wagon.axles),
            "elements": tuple(one.model_copy(update={"at": along(one.at)}) for one in wagon.elements),
        }
    )


def _positions(scenario: Scenario) -> FloatArray:
    return np.array([axle.position for axle in scenario.vehicle.axles], dtype=float)


_NOTHING = Surface(np.zeros(8), np.zeros(8), 1.0, 1.0, 1)
"""A surface of which only its lengths matter, before they are known."""
