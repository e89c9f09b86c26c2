"""What every lowered scenario tells of its march, in SI units; the marches differ behind it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray, IntArray

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.ground.notes import Note
    from wheeltapper.lower.contacts import Contacts
    from wheeltapper.lower.laws.plastic import PlasticLaw
    from wheeltapper.lower.lowered.rails_below import RailsBelow
    from wheeltapper.lower.marks.marks import Surface

DECK = "deck"
"""Name of the body, or of the freedom, that is a deck."""
Variables = dict[str, tuple[tuple[str, ...], Any]]
"""Variables of a table by name: their dimensions and their values."""


class Terms(NamedTuple):
    """A balance of energy.

    Attributes
    ----------
    terms
        By names of `record.energy`.
    exchanged
        With which what is left is compared: the magnitudes of all works, as finely as a march tells them apart, and
        the largest energies that it knows, so that it is not zero where nothing moves.
    joule
        Unit of all these, J.
    more
        What is left of the balance of the track.
    """

    terms: Mapping[str, float]
    exchanged: float
    joule: float = 1.0
    more: float = 0.0


class Works(NamedTuple):
    """What a march has done: impulses of contacts in each step, (steps, contacts), N s, and what gives its energy."""

    impulses: FloatArray
    terms: Callable[[], Terms]


class ElementEvents(NamedTuple):
    """Events of what is not linear in suspensions: time, s, name, numbers of kind and side, compression rate, m/s."""

    time: FloatArray
    element: NDArray[Any]
    kind: IntArray
    side: IntArray
    rate: FloatArray


NO_ELEMENTS = ElementEvents(
    np.zeros(0), np.array([], dtype=str), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
)


class VoidEvents(NamedTuple):
    """A march's rows of voids that close and open, the seat of each, and its side where sleepers have sides."""

    rows: FloatArray
    seat: IntArray
    side: NDArray[Any] | None = None


class LoweredScenario:
    """A lowered scenario.

    Attributes
    ----------
    scenario
        What was lowered.
    program
        What is marched.
    length, time, force
        Units of the program in m, s and N.
    contact_constant
        N/m^1.5, if linear N/m.
    notes
        What the user should know.
    chunk
        Steps that the march makes before it tells of its progress.
    balance_is_dear
        Whether the balance takes longer than the march, so that only who asks for it waits for it.
    """

    scenario: Scenario
    program: Any
    length: float
    time: float
    force: float
    contact_constant: float
    notes: tuple[Note, ...]
    chunk: ClassVar[int]
    balance_is_dear: ClassVar[bool] = False

    @property
    def row_bytes(self) -> float:
        """Memory that each step takes."""
        raise NotImplementedError

    @property
    def contacts(self) -> Contacts:
        """The contacts of the vehicle."""
        raise NotImplementedError

    @property
    def plastic_laws(self) -> tuple[PlasticLaw, ...]:
        """Of the wheelsets whose contacts yield."""
        raise NotImplementedError

    def pressed(self, march: Any, contact: int, times: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return how deep a contact is at times, s, what earlier ones have left there, m, and if it yields.

        The indentation is that of the surface as it is, m.
        """
        raise NotImplementedError

    def slopes_below(self, march: Any, contact: int, distances: FloatArray) -> FloatArray:
        """Return the slope of a contact's path where it has travelled so far, m."""
        raise NotImplementedError

    @property
    def semi_axis(self) -> float:
        """Semi-axis of the patch of the first wheels along the rail, m; of contacts that yield."""
        raise NotImplementedError

    def surfaces_left(self, march: Any, way: float) -> list[Surface]:
        """Return each rail after a run over some way, m, in which wheels met the marks of those before them."""
        raise NotImplementedError

    def finer(self) -> LoweredScenario:
        """Return the same with smaller errors of steps."""
        raise NotImplementedError

    def perturbed(self, march: Any, in_velocity: bool) -> tuple[LoweredScenario, float]:
        """Return the same with a small change of the start of this march, and the size of the change, scaled."""
        raise NotImplementedError

    def gentlest(self, march: Any) -> float:
        """Return the smallest rate of indentation at an event of a march, scaled."""
        raise NotImplementedError

    def scaled_end(self, march: Any) -> FloatArray:
        """Return the scaled state at the end of a march."""
        raise NotImplementedError

    def forces(self, march: Any, times: FloatArray) -> FloatArray:
        """Return the normal forces of all contacts at times, s, N, (times, contacts)."""
        return np.asarray(self.variables(march, times)["normal_force"][1]).reshape(len(times), -1)

    def variables(self, march: Any, times: FloatArray) -> Variables:
        """Return all variables at rising times, s; those of the wheels have the dimension `contact` last."""
        raise NotImplementedError

    def works(self, march: Any) -> Works:
        """Return what contacts, dampers and loads have done."""
        raise NotImplementedError

    def missing_part(self, march: Any) -> float:
        """Return the missing share of the exchanged energy."""
        raise NotImplementedError

    def stops_met(self, march: Any) -> tuple[FloatArray, IntArray]:
        """Return the table of stops that dampers' ends meet (`common.program`), and the wheelset of each, from zero.

        Times are in the program's unit.
        """
        return contract.NO_STOPS, np.zeros(0, dtype=np.int64)

    def element_events(self, march: Any) -> ElementEvents:
        """Return the events of what is not linear in the suspensions."""
        return NO_ELEMENTS

    def void_events(self, march: Any) -> VoidEvents | None:
        """Return the events of voids below sleepers; None on a track without."""
        return None

    def rails_below(self, march: Any, method: str) -> RailsBelow:
        """Return what rails that bend do below the vehicle."""
        raise NotImplementedError
