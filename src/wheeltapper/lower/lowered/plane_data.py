"""A lowered vehicle in the vertical plane: the general march's task, and what is needed to read its results."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.plane import PlaneVehicle
from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.plastic import PlasticLaw
from wheeltapper.lower.numbers import SHORTER, SMALL
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.lower.track.anomalies import NONE, Anomalies
from wheeltapper.lower.track.irregular import IrregularModes
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.march.common.law_columns import PLASTIC_CONSTANT, PLASTIC_ONSET
from wheeltapper.march.general import contract as general
from wheeltapper.march.general.laws import switch

if TYPE_CHECKING:
    from wheeltapper.march.general.task import Marched

FloatArray = NDArray[np.float64]
DECK = "deck"
"""Name of the freedom that is a deck."""


class Stop(NamedTuple):
    """A contact between a wheelset and the end of its damper, in which there is play.

    Attributes
    ----------
    wheelset
        Its number, from zero.
    sides
        Of the stops that this contact is: 1 for the upper one, -1 for the lower one.
    law
        Of one rail's part.
    shape
        What each freedom adds to what is pressed together, (freedoms,).
    gap
        To be closed before there is a force, m.
    """

    wheelset: int
    sides: tuple[int, ...]
    law: general.Law
    shape: FloatArray
    gap: float


def plastic_of(law: general.Law, rails: float) -> PlasticLaw:
    """Return the plastic law of a wheelset on so many equal rails."""
    constant, onset = law.numbers[[PLASTIC_CONSTANT - 1, PLASTIC_ONSET - 1]].tolist()
    return PlasticLaw.over_onset(law.table, onset, constant * rails)


@dataclass(frozen=True)
class PlaneData:
    """A task for the general march, with what is needed to read its results.

    Attributes
    ----------
    scenario
        What was lowered.
    program
        The task; of two equal rails it has one, with half of the vehicle on it.
    plane
        The vehicle in the vertical plane.
    modes, anomalies
        The track's modes, None on a rigid rail, and what is not regular on it.
    seat
        Position of the seat from which the march counts, m.
    static_force
        Of each wheelset, N.
    contact_constant
        Of the first wheelset, N/m^1.5, if linear N/m.
    notes
        What the user should know about track and paths.
    length, time
        Units of the program in m and s.
    force
        Force of a wheelset for a force of one of the program, N: the number of rails.
    stops
        Of the dampers with play: the last contacts of the task but those of the plane's elements.
    paths
        Tables of the wheelsets' paths.
    """

    scenario: Scenario
    program: general.Task
    plane: PlaneVehicle
    modes: TrackModes | IrregularModes | None
    seat: float
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]
    force: float
    stops: tuple[Stop, ...] = ()
    anomalies: Anomalies = NONE
    paths: tuple[PathTable, ...] = ()
    length: float = 1.0
    time: float = 1.0

    @property
    def has_ends(self) -> bool:
        """Whether the damper of any wheelset has an end of its own."""
        return any(wheelset.damper_end for wheelset in self.plane.wheelsets)

    @property
    def first_stop(self) -> int:
        """Number of the first contact that is a stop of a damper's end."""
        return len(self.plane.wheelsets) + len(self.anomalies.voids)

    @property
    def first_element(self) -> int:
        """Number of the first contact that is an element of a suspension."""
        return self.first_stop + len(self.stops)

    @property
    def plastic_laws(self) -> tuple[PlasticLaw, ...]:
        """Of the wheelsets whose contacts yield."""
        laws = (wheel.law for wheel in self.program.system.wheels)
        return tuple(plastic_of(law, self.force) for law in laws if law.kind == switch.PLASTIC)

    def pressed(
        self, march: Marched, contact: int, times: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return how deep a contact is at times, s, what earlier ones have left there, m, and if it yields."""
        return march.pressed(contact, times)

    def slopes_below(self, march: Marched, contact: int, distances: FloatArray) -> FloatArray:
        """Return the slope of a contact's path where it has travelled so far, m."""
        return march.path_slopes(contact, distances)

    def finer(self) -> Self:
        """Return the same with shorter macro steps where a track gives way; else no kink makes a step less exact."""
        task = self.program
        if task.system.ring is None:
            return self
        return replace(self, program=task._replace(method=task.method._replace(step=SHORTER * task.method.step)))

    def beside(self, march: Marched, in_velocity: bool) -> tuple[Self, float]:
        """Return the same with a small change of the start of this march, and the size of the change, scaled."""
        task, speeds = self.program, self.speeds(march)
        bodies, wheels = task.system.bodies, len(self.static_force)
        began, freedoms = march.start, len(bodies.mass)
        height = began[:wheels] + march.sinking[:wheels]  # below that of first touch
        start = -np.stack([height, began[freedoms : freedoms + wheels]])
        start[int(in_velocity)] += SMALL * (speeds.mean() if in_velocity else march.static_indentation)
        system = task.system._replace(bodies=bodies._replace(raised=start))
        return replace(self, program=task._replace(system=system)), SMALL * float(np.sqrt(wheels))

    def gentlest(self, march: Marched) -> float:
        """Return the smallest rate of indentation at an event of a march, scaled."""
        return march.gentlest(self.speeds(march))

    def scaled_end(self, march: Marched) -> FloatArray:
        """Return the scaled state at the end of a march."""
        scale = np.full(len(march.state), float(self.speeds(march).mean()))
        scale[: len(self.plane.freedoms)] = march.static_indentation
        return np.asarray(march.state / scale)

    def speeds(self, march: Marched) -> FloatArray:
        """Return the static indentation δ0 over the time sqrt(m·δ0/N0) of each wheelset, m/s."""
        mass = np.diag(self.plane.mass)[: len(self.static_force)]
        return np.sqrt(march.static_indentation * self.static_force / mass)
