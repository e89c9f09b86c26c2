"""A lowered wagon: the assembly that is marched, and what is needed to read its results."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.plastic import PlasticLaw
from wheeltapper.lower.numbers import FINER, SHORTER, SMALL
from wheeltapper.lower.structure import Structure
from wheeltapper.march.common.law_columns import PLASTIC_ONSET, PLASTIC_PIECES
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import PLACES, TO_RATE, Assembly
from wheeltapper.march.wagon.remembering import OverMarks

if TYPE_CHECKING:
    from wheeltapper.lower.marks.wagon_marks import WagonRails
    from wheeltapper.lower.track.anomalies import Void
    from wheeltapper.march.wagon.march import Marched
    from wheeltapper.march.wagon.rails.march import OnRails

FloatArray = NDArray[np.float64]
DECK = "deck"
"""Name of the body that is a deck."""


@dataclass(frozen=True)
class StateLayout:
    """Positions of the bodies of a wagon, and of its deck, in the state."""

    bodies: tuple[str, ...]
    motions: tuple[tuple[str, str], ...]

    @property
    def displacement_places(self) -> NDArray[np.int64]:
        """Index in the state of each motion's displacement."""
        return np.array([self.bodies.index(body) * PLACES + MOTIONS.index(motion) for body, motion in self.motions])

    @property
    def state_count(self) -> int:
        """Number of states of the bodies."""
        return len(self.bodies) * PLACES


@dataclass(frozen=True)
class WagonData:
    """An assembly, with the data that are needed to read its results.

    Attributes
    ----------
    scenario
        What was lowered.
    static_force
        Static normal force of each wheel, N, (wheelsets, 2): left, right.
    notes
        What the user should know about the paths.
    length, time, force
        Units of the assembly in m, s and N.
    below
        Rails that give way; None on a stiff track.
    memory
        What the rails remember of contacts that yield; None where wheels meet no marks of others.
    voids
        Below sleepers, in the order of the assembly's lanes.
    """

    scenario: Scenario
    assembly: Assembly
    layout: StateLayout
    structure: Structure
    static_force: FloatArray
    contact_constant: float
    notes: tuple[Note, ...]
    length: float = 1.0
    time: float = 1.0
    force: float = 1.0
    below: OnRails | None = None
    memory: WagonRails | None = None
    voids: tuple[Void, ...] = ()

    @property
    def program(self) -> Assembly | OnRails | OverMarks:
        """What is marched."""
        plain = self.assembly if self.below is None else self.below
        return plain if self.memory is None else OverMarks(plain, self.memory)

    @property
    def plastic_laws(self) -> tuple[PlasticLaw, ...]:
        """Of the wheelsets whose treads yield, as if both pressed alike."""
        numbers = self.assembly.numbers[asm.YIELD_LAW :]
        if not numbers[PLASTIC_PIECES]:
            return ()
        constant = 2.0 * self.contact_constant
        law = PlasticLaw.over_onset(self.assembly.law, float(numbers[PLASTIC_ONSET]), constant)
        return (law,) * len(self.static_force)

    def pressed(
        self, march: Marched, contact: int, times: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return how deep a contact is at times, s, what earlier ones have left there, m, and if it yields."""
        from wheeltapper.lower.marks.wagon_marks import lane_of, read_contacts

        rows = read_contacts(march, times)[:, :, lane_of(*divmod(contact, 2))]
        return np.maximum(rows[:, 0], 0.0), rows[:, 1], rows[:, 3] > 0.0

    def slopes_below(self, march: Marched, contact: int, distances: FloatArray) -> FloatArray:
        """Return the slope of a contact's path where it has travelled so far, m."""
        from wheeltapper.lower.marks.wagon_marks import lane_of, path_of

        return path_of(march.assembly, lane_of(*divmod(contact, 2))).slope_at(distances)

    def with_assembly(self, assembly: Assembly) -> Self:
        """Return the same with another assembly."""
        below = None if self.below is None else self.below._replace(assembly=assembly)
        return replace(self, assembly=assembly, below=below)

    def finer(self) -> Self:
        """Return the same with smaller errors of steps, and on rails with shorter macro steps."""
        numbers = self.assembly.numbers.copy()
        numbers[asm.STEP_TOLERANCE] *= FINER
        made = self.with_assembly(self.assembly._replace(numbers=numbers))
        if made.below is None:
            return made
        track = made.below.track
        method = track.method._replace(step=SHORTER * track.method.step)
        return replace(made, below=made.below._replace(track=track._replace(method=method)))

    def beside(self, march: Marched, in_velocity: bool) -> tuple[Self, float]:
        """Return the same with a small change of the start of this march, and the size of the change, scaled."""
        named = zip(self.layout.displacement_places, self.layout.motions, strict=True)
        heights = [at for at, (body, motion) in named if motion == "z" and body.startswith("wheelset ")]
        moved, start = np.array(heights) + (TO_RATE if in_velocity else 0), self.assembly.start.copy()
        start[moved] += SMALL / self.assembly.scales[moved]
        return self.with_assembly(self.assembly._replace(start=start)), SMALL * float(np.sqrt(len(moved)))

    def gentlest(self, march: Marched) -> float:
        """Return the smallest rate of indentation at an event of a march, scaled."""
        numbers = self.assembly.numbers
        return march.gentlest() * float(numbers[asm.PULSE]) / float(numbers[asm.STATIC_INDENTATION])

    def scaled_end(self, march: Marched) -> FloatArray:
        """Return the scaled state at the end of a march."""
        states = self.layout.state_count
        return np.asarray(march.state[:states] * self.assembly.scales[:states])
