"""A lowered vehicle in the vertical plane: contacts per wheelset, SI units, the motions in the vertical plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.plane import end_name
from wheeltapper.ground.needs import YIELDING
from wheeltapper.lower.contacts import Contacts
from wheeltapper.lower.lowered.base import ElementEvents, LoweredScenario, Variables, VoidEvents, Works
from wheeltapper.lower.lowered.plane_dampers import damper_motion, stops_met
from wheeltapper.lower.lowered.plane_data import DECK, PlaneData
from wheeltapper.lower.lowered.plane_elements import element_events, element_motion
from wheeltapper.lower.lowered.rails_below import RailsBelow
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common import program as contract
from wheeltapper.march.common import telling
from wheeltapper.march.common.program import IntArray
from wheeltapper.march.general.layout import ROW_COLUMNS

if TYPE_CHECKING:
    from wheeltapper.march.general.task import Marched

FloatArray = NDArray[np.float64]
WHEELSET = ("wheel_displacement", "wheel_velocity", "wheel_acceleration")
"""Variables of the motion of a wheelset's centre; other freedoms have variables of their own names."""
MOTIONS = ("", "_velocity", "_acceleration")
"""What follows a freedom's name: its displacement or rotation, and the two derivatives."""
DECK_MOTIONS = "_displacement", "_velocity", "_acceleration"


class LoweredOnRails(PlaneData, LoweredScenario):
    """A task for the general march, and how its march is read."""

    chunk = telling.GENERAL_CHUNK
    balance_is_dear = True

    @property
    def row_bytes(self) -> float:
        """Memory that each macro step takes."""
        return 8.0 * ROW_COLUMNS * len(self.plane.positions)

    @property
    def contacts(self) -> Contacts:
        """A contact for each wheelset."""
        positions = np.array(self.plane.positions)
        radius = np.array([wheelset.radius for wheelset in self.plane.wheelsets], dtype=float)
        return Contacts(self.static_force, positions, radius, np.arange(len(positions)), sides=1)

    def variables(self, march: Marched, times: FloatArray) -> Variables:
        """Return all variables but what the track does elsewhere."""
        found = march.at(times)
        wheels = len(self.plane.wheelsets)
        along, touching = ("time",), ("time", "contact")
        sinking = march.sinking[:wheels]  # below the height of first touch
        motions = (-found.displacement, -found.velocity, -found.acceleration)
        out: Variables = {
            name: (touching, values[:, :wheels] - (sinking if name == WHEELSET[0] else 0.0))
            for name, values in zip(WHEELSET, motions, strict=True)
        }
        out |= {
            "normal_force": (touching, found.force[:, :wheels] * self.force),
            "indentation": (touching, found.indentation[:, :wheels]),
            "constraint": (touching, found.path[:, :wheels]),
        }
        if YIELDING in self.scenario.needs:
            left = [
                law.left_over(found.indentation[:, wheel], march.left_before(wheel, times))
                for wheel, law in enumerate(self.plastic_laws)
            ]
            out["permanent_indentation"] = touching, np.stack(left, axis=1)
        if self.modes is not None:
            out["rail_displacement"] = touching, -found.rail[:, :wheels]
        if self.has_ends:
            place, force = damper_motion(self, march, times, found)
            out |= {"damper_end_displacement": (touching, place), "damper_force": (touching, force)}
        out |= element_motion(self, found)
        ends = [end_name(i) for i in range(wheels)]
        for freedom in range(wheels, len(self.plane.freedoms)):
            if self.plane.freedoms[freedom] in ends:
                continue
            name = self.plane.freedoms[freedom].replace(" ", "_")
            for after, values in zip(DECK_MOTIONS if name == DECK else MOTIONS, motions, strict=True):
                out[name + after] = along, values[:, freedom]
        return out

    def works(self, march: Marched) -> Works:
        """Return what contacts, dampers, loads and track have done."""
        from wheeltapper.lower.lowered.plane_energy import balance

        return Works(march.impulses() * self.force, lambda: balance(self, march))

    def missing_part(self, march: Marched) -> float:
        """Return zero of a run in numbers: no part is accepted unsolved, and the balance takes longer than the run."""
        return 0.0 if march.is_solved else np.nan

    def stops_met(self, march: Marched) -> tuple[FloatArray, IntArray]:
        """Return the table of the stops that dampers' ends meet, and their wheelsets."""
        return stops_met(self, march)

    def element_events(self, march: Marched) -> ElementEvents:
        """Return all elements' events."""
        return element_events(self, march)

    def void_events(self, march: Marched) -> VoidEvents | None:
        """Return where voids below sleepers close and open; a rate is that of the sleeper, downwards."""
        if not self.anomalies.voids:
            return None
        rows = march.seat_events[march.seat_events[:, contract.EVENT_CONTACT] < len(self.anomalies.voids)]
        seats = np.array([void.seat for void in self.anomalies.voids])
        return VoidEvents(rows, seats[rows[:, contract.EVENT_CONTACT].astype(int)])

    def rails_below(self, march: Marched, method: str) -> RailsBelow:
        """Return what the rail does below the vehicle."""
        from wheeltapper.march.wagon.rails.replay import RailAt

        assert self.modes is not None
        system = self.program.system

        def at(times: FloatArray) -> list[RailAt]:
            shown, found = march.at(times), march.modes(times)
            return [RailAt(found, shown.force, shown.force_rate, shown.force_bend)]

        return RailsBelow(
            ((section_of(self.scenario.track), self.modes),), (self.anomalies,), self.seat,
            [one.position for one in system.wheels], [np.array([port.residual for port in system.ports])],
            [np.ones(len(system.ports))], at,
        )  # fmt: skip
