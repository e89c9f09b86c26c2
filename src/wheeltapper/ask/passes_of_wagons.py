"""Wagons that pass one after the other over two rails, each over the marks that those before it have left."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.passes import SHAKEDOWN, PassResult, Scatter, checked_length, drawn_pass
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import FLEXIBLE_TRACK
from wheeltapper.lower.lowered.wagon import LoweredWagon
from wheeltapper.lower.marks.marks import Surface
from wheeltapper.lower.marks.wagon_marks import (
    SIDES,
    WornRails,
    lane_of,
    path_of,
    semi_axis_of,
)
from wheeltapper.lower.wagon import lower_wagon, started
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.wagon import assembly as asm

FloatArray = NDArray[np.float64]
WHEELS = 2.0
"""Forces are told per wheelset, as if both of its wheels pressed alike."""


class RailLineOfWagons:
    """Two rails over which wagons pass again and again, by the wagon's march.

    A surface holds the samples of the left rail, then those of the right one.

    Parameters
    ----------
    scenario
        A scenario with a wagon, an elastic-plastic contact and point rolling.
    scatter
        Scatter of the passes.
    per_interval
        Samples in half a semi-axis of the contact patch.
    method
        "default" or "strict".
    vehicles
        What passes in turn; none: the scenario's.
    """

    sides = SIDES

    def __init__(
        self, scenario: Scenario, scatter: Scatter, per_interval: int, method: str, vehicles: tuple[Any, ...] = ()
    ) -> None:
        self.scenario, self.scatter, self._method = scenario, scatter, method
        self.length = checked_length(scenario, scatter)
        self._passing = [scenario.replaced({"vehicle": vehicle}) for vehicle in vehicles] or [scenario]
        for one in self._passing:
            run.choose(run.WEAR_IN, one.needs)
            one.check_extent()
            if scatter.load and not one.vehicle.bodies and not any(axle.load for axle in one.vehicle.axles):
                found = f"{scatter.load:g} with a Wagon that has neither bodies nor loads on its wheelsets"
                raise InputError("", "scatter.load", found, "0")
        self.static_force = max(float(_lowered(one, method).static_force.sum(axis=1).max()) for one in self._passing)
        positions = [_positions(one) for one in self._passing]
        self._begins = float(min(places.min() for places in positions))
        extent = float(max(places.max() for places in positions)) - self._begins
        lowered = _lowered(scenario, method, self._worn(_NOTHING, _NOTHING))
        self.program, self.notes, self.law = lowered.program, lowered.notes, lowered.plastic_laws[0]
        self.semi_axis = semi_axis_of(scenario, float(lowered.static_force[0].mean()))
        self._rail = Surface.virgin_surface(extent + self.length, self.semi_axis, self.law.onset, per_interval)
        self.virgin = self._joined(self._rail, self._rail)
        places = self._rail.sample_positions + self._begins
        self._seen = (places >= 0.0) & (places < self.length)
        self.sample_positions = places[self._seen]
        first = _positions(scenario)[0]
        self._base = np.stack([
            path_of(lowered.assembly, lane_of(0, side)).height_at(self.sample_positions - first)
            for side in range(len(SIDES))
        ])  # fmt: skip

    def _worn(self, left: Surface, right: Surface) -> WornRails:
        return WornRails((left, right), self.static_force, self._begins, self.scatter.hardening)

    def _joined(self, left: Surface, right: Surface) -> Surface:
        """Return both rails as one surface."""
        return replace(left, borne=np.append(left.borne, right.borne), left=np.append(left.left, right.left))

    def _apart(self, surface: Surface) -> tuple[Surface, Surface]:
        """Return the left and the right rail of a surface."""
        borne, left = surface.borne.reshape(2, -1), surface.left.reshape(2, -1)
        one, other = (replace(surface, borne=borne[side], left=left[side]) for side in range(len(SIDES)))
        return one, other

    def settled(self, surface: Surface) -> FloatArray:
        """Return the permanent indentation at the samples, averaged over the patch, (sides, samples), m."""
        return np.stack([rail.settled_indentation()[self._seen] for rail in self._apart(surface)])

    def rail_heights(self, surface: Surface) -> FloatArray:
        """Return the heights of both rails at the samples, (sides, samples), m."""
        return np.asarray(self._base - self.scenario.contact.share_of_rail * self.settled(surface), dtype=np.float64)

    def after_pass(self, surface: Surface, number: int) -> tuple[Surface, PassResult]:
        """Return the surface after pass `number`, and the results of that pass."""
        faster, heavier, start = drawn_pass(self.scatter, number)
        scenario = self._passing[number % len(self._passing)]
        speed, length = float(scenario.speed) * faster, self.length - start
        wagon = moved(loaded(scenario.vehicle, heavier), start)
        scenario = scenario.replaced({"speed": speed, "duration": length / speed, "vehicle": wagon})
        lowered = _lowered(scenario, self._method, self._worn(*self._apart(surface)))
        march = run.march(lowered.program)
        assembly, memory = march.assembly, lowered.memory
        assert memory is not None  # as rails with marks have
        marking = memory.begin()
        marking.press(march, everywhere=True)
        pressures = np.concatenate([one for rail in marking.sides for one in rail.pressures])
        unit = WHEELS * memory.rails[0].laws[0].force
        elastic, beyond = float(np.mean(pressures <= 1.0)), float(np.mean(pressures > SHAKEDOWN))
        treads = march.peaks[:, contract.PEAK_CONTACT] < assembly.numbers[asm.TREADS] * asm.LANES
        largest = WHEELS * float(march.peaks[treads, contract.PEAK_FORCE].max(initial=0.0))
        largest = max(largest, float(pressures.max()) * unit)
        told = PassResult(
            march.status, speed, float(lowered.static_force[0].sum()) - wagon.axles[0].mass * wagon.gravity, start,
            largest, int((march.events[:, contract.EVENT_KIND] == contract.IMPACT).sum()), length,
            float(sum(rail.work for rail in marking.sides)), elastic, 1.0 - elastic - beyond, beyond,
        )  # fmt: skip
        return self._joined(*(rail.left() for rail in marking.sides)), told


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


def _lowered(scenario: Scenario, method: str, worn: WornRails | None = None) -> LoweredWagon:
    """Return a wagon over rails with marks."""
    if FLEXIBLE_TRACK not in scenario.needs:
        return started(lower_wagon(scenario, method, worn), scenario)
    from wheeltapper.lower.wagon_on_rails import lower_wagon_on_rails

    return started(lower_wagon_on_rails(scenario, method, worn), scenario)
