"""A lowered scenario of one wheel: one contact for both wheels of a wheelset, scaled rows, the motion of the centre."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower.contacts import Contacts
from wheeltapper.lower.extent import ROW_BYTES
from wheeltapper.lower.laws.plastic import PlasticLaw, patch_semi_axis
from wheeltapper.lower.lowered import balanced
from wheeltapper.lower.lowered.base import LoweredScenario, Variables, Works
from wheeltapper.lower.lowered.wheel_energy import balance, integrate
from wheeltapper.lower.numbers import FINER, SMALL
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.march.common import program as contract
from wheeltapper.march.common import telling
from wheeltapper.march.common.program import IntArray, Program

if TYPE_CHECKING:
    from wheeltapper.march.wheel.march import Marched

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Lowered(LoweredScenario):
    """A program of one wheel, with the units that convert its numbers to SI.

    Attributes
    ----------
    length, time, force
        Units of the program in m, s and N.
    table
        The path of the wheel's centre.
    notes
        Notes on this lowering for the user: contact at two points, edges, warnings with numbers.
    """

    chunk = telling.CHUNK

    scenario: Scenario
    program: Program
    table: PathTable
    length: float
    time: float
    force: float
    static_force: float
    contact_constant: float
    notes: tuple[Note, ...]

    @property
    def row_bytes(self) -> float:
        """Memory that each step takes."""
        return ROW_BYTES

    @property
    def contacts(self) -> Contacts:
        """One contact for both wheels."""
        radius = np.array([float(self.scenario.vehicle.radius)])
        return Contacts(np.array([self.static_force]), np.zeros(1), radius, np.zeros(1, dtype=np.int64), sides=1)

    @property
    def plastic_laws(self) -> tuple[PlasticLaw, ...]:
        """Of the wheelset, if its contact yields."""
        law = self.program.law
        return (PlasticLaw(law, self.length, self.force),) if len(law) else ()

    @property
    def semi_axis(self) -> float:
        """Semi-axis of the patch along the rail, m."""
        return patch_semi_axis(self.scenario.contact, self.scenario.vehicle, self.static_force)

    def pressed(
        self, march: Marched, contact: int, times: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return how deep a contact of a march is at times, s, what earlier ones have left there, m, and if it yields.

        The indentation is that of the surface as it is, m.
        """
        indentation, left = march.indentations(times / self.time) * self.length
        return indentation, left, indentation + left > self.plastic_laws[contact].onset

    def slopes_below(self, march: Marched, contact: int, distances: FloatArray) -> FloatArray:
        """Return the slope of a contact's path where it has travelled so far, m."""
        return self.table.slope_at(distances)

    def finer(self) -> Lowered:
        """Return the same with smaller errors of steps."""
        return self._with_number(contract.TOLERANCE, FINER * float(self.program.numbers[contract.TOLERANCE]))

    def perturbed(self, march: Marched, in_velocity: bool) -> tuple[Lowered, float]:
        """Return the same with a small change of the start of this march, and the size of the change, scaled."""
        which = contract.START_VELOCITY if in_velocity else contract.START_HEIGHT
        return self._with_number(which, float(self.program.numbers[which]) + SMALL), SMALL

    def gentlest(self, march: Marched) -> float:
        """Return the smallest rate of indentation at an event of a march, scaled."""
        return march.gentlest()

    def scaled_end(self, march: Marched) -> FloatArray:
        """Return the scaled state at the end of a march."""
        return march.last_motion()

    def _with_number(self, which: int, value: float) -> Lowered:
        numbers = self.program.numbers.copy()
        numbers[which] = value
        return replace(self, program=self.program._replace(numbers=numbers))

    def variables(self, march: Marched, times: FloatArray) -> Variables:
        """Return all variables: those that every wheel has, then those of a law, a deck and a damper's own end."""
        from wheeltapper.march.wheel import dense

        rows = march.at(times / self.time)
        length, force = self.length, self.force
        speed, acceleration = length / self.time, length / self.time**2
        along, touching = ("time",), ("time", "contact")
        out: Variables = {
            "wheel_displacement": (along, rows[:, dense.OUT_WHEEL_Y] * length),
            "wheel_velocity": (along, rows[:, dense.OUT_WHEEL_V] * speed),
            "wheel_acceleration": (along, rows[:, dense.OUT_WHEEL_A] * acceleration),
            "normal_force": (touching, rows[:, [dense.OUT_FORCE]] * force),
            "indentation": (touching, rows[:, [dense.OUT_DELTA]] * length),
            "constraint": (touching, rows[:, [dense.OUT_PATH_Y]] * length),
        }
        for law in self.plastic_laws:
            left = law.left_over(rows[:, [dense.OUT_DELTA]] * length, rows[:, [dense.OUT_RESIDUAL]] * length)
            out["permanent_indentation"] = touching, left
        if self.program.numbers[contract.DECK_MASS] > 0.0:
            out["deck_displacement"] = along, rows[:, dense.OUT_DECK_Y] * length
            out["deck_velocity"] = along, rows[:, dense.OUT_DECK_V] * speed
            out["deck_acceleration"] = along, rows[:, dense.OUT_DECK_A] * acceleration
        if self.program.damper_ends:
            out["damper_end_displacement"] = along, rows[:, dense.OUT_END_Y] * length
            out["damper_force"] = along, rows[:, dense.OUT_DAMPER_FORCE] * force
        return out

    def works(self, march: Marched) -> Works:
        """Return what contact, dampers and load have done."""
        found, joule = integrate(self.program, march), self.force * self.length
        return Works(found.impulse[:, None] * self.force * self.time, partial(balance, self.program, found, joule))

    def missing_part(self, march: Marched) -> float:
        """Return the largest missing share of the exchanged energy at any time; NaN if it is undefined."""
        return balanced.missing_part(march)

    def stops_met(self, march: Marched) -> tuple[FloatArray, IntArray]:
        """Return the table of stops that the damper's end meets, and the wheelset of each."""
        return march.stops, np.zeros(len(march.stops), dtype=np.int64)
