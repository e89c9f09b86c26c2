"""A wheel that passes again and again over one rail, by the yielding wheel's march."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.build import lower
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.laws.plastic import (
    PlasticLaw,
    law_rows,
    patch_semi_axis,
    plastic_bearing,
    static_force_of,
    stretched_rows,
)
from wheeltapper.lower.lines.base import Drawn, Line, Passing
from wheeltapper.lower.marks.marks import MarkedPath, Surface, height_at, marks_at
from wheeltapper.lower.marks.rail_memory import Marking, RailMemory
from wheeltapper.lower.numbers import METHODS, Placing, numbers_of
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program
from wheeltapper.march.general.at_rest import indentation_at_rest
from wheeltapper.march.wheel.march import Marched

FloatArray = NDArray[np.float64]


class WheelLine(Line):
    """A rail over which the same wheel passes again and again."""

    def __init__(self, scenario: Scenario, start: float, per_interval: int, method: str) -> None:
        super().__init__(scenario, start)
        self._method, lowered = METHODS[method], lower(scenario, method)
        self._lowered, self.notes, self.static_force = lowered, lowered.notes, lowered.static_force
        (self.law,) = lowered.plastic_laws
        self.semi_axis = patch_semi_axis(scenario.contact, scenario.vehicle, lowered.static_force)
        self.virgin = Surface.virgin_surface(self.length, self.semi_axis, self.law.onset, per_interval)
        self.place_samples(self.virgin, 0.0)
        self._path = MarkedPath(lowered.table, self.virgin, self.length)
        self._base = lowered.table.height_at(self.sample_positions)
        rows = stretched_rows(scenario.contact)
        self._over_onset = PlasticLaw.over_onset(rows, self.law.onset, lowered.contact_constant)

    def passing_over(self, surface: Surface, number: int, drawn: Drawn, hardening: float) -> Passing:
        """Return a pass over a surface."""
        speed, load = float(self.scenario.speed) * drawn.faster, float(self.scenario.vehicle.load) * drawn.heavier
        program, law, time = self._program_over(surface, speed, load, drawn.start)
        length, share = self.length - drawn.start, self.scenario.contact.share_of_rail
        memory = RailMemory((self._over_onset,), (drawn.start,), share, hardening, surface, (), length)
        limit = float(program.law[0, contract.LAW_START]) ** 1.5

        def pressed(march: Marched) -> Sequence[Marking]:
            from wheeltapper.march.wheel.dense import OUT_DELTA, OUT_FORCE, OUT_RESIDUAL

            marking = memory.begin()
            for wheel, places in marking.ahead(length):
                out = march.at((places - drawn.start) / speed / time)
                depths = (np.maximum(out[:, OUT_DELTA], 0.0) + out[:, OUT_RESIDUAL]) * law.length
                marking.take(wheel, depths, out[:, OUT_FORCE] / limit)
            return (marking,)

        return Passing(program, speed, load, length, law.force, limit * law.force, pressed)

    def _program_over(
        self, surface: Surface, speed: float, load: float, start: float
    ) -> tuple[Program, PlasticLaw, float]:
        """Return the program of a pass over the surface, its law with its units, and its unit of time, s."""
        lowered = self._lowered
        numbers, length, time, law = lowered.program.numbers.copy(), lowered.length, lowered.time, lowered.program.law
        vehicle, contact = self.scenario.vehicle, self.scenario.contact
        if (speed, load) != (self.scenario.speed, vehicle.load):
            changed = self.scenario.replaced({"speed": speed, "vehicle.load": load})
            one, none = np.ones(1), np.zeros(1)
            drawn, units = numbers_of(Fields(changed), Placing(one, one, none, none, one), self._method)
            numbers[: contract.LOOP] = drawn[0, : contract.LOOP]
            length, time = units.length.item(), units.time.item()
            law = law_rows(contact, self.law.onset / length)
            if numbers[contract.DECK_MASS] > 0.0:
                numbers[contract.PRESTRESS] = static_force_of(law, numbers[contract.STIFFNESS])
        made = PlasticLaw(law, length, vehicle.mass * length / time**2)
        pieces = self._path.pieces_over(surface, made, contact.share_of_rail)
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
