"""Rails over which vehicles pass again and again, each over the surface that the last one has left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.plastic import PlasticLaw
from wheeltapper.lower.marks.marks import Surface
from wheeltapper.lower.marks.rail_memory import Marking
from wheeltapper.march import run
from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]


class Drawn(NamedTuple):
    """A pass as it was drawn: speed and load over their means, and where the leading wheel starts, m."""

    faster: float
    heavier: float
    start: float


class Passing(NamedTuple):
    """A pass over a surface.

    Attributes
    ----------
    program
        What is marched.
    speed, load, length
        m/s; what the leading wheelset bears without its weight, N; how far each wheel rolls, m.
    unit
        A wheelset's force for a force of a maximum, N.
    yield_force
        Force of a wheelset at first yield, N.
    pressed
        From the march to the marks that the wheels have made on each rail.
    treads
        How many contacts of the march leave marks; maxima of others, of flanges, do not count.
    """

    program: Any
    speed: float
    load: float
    length: float
    unit: float
    yield_force: float
    pressed: Callable[[Any], Sequence[Marking]]
    treads: float = np.inf

    def largest_force(self, march: Any) -> float:
        """Return the largest maximum of a contact force, N."""
        tops = march.peaks
        if self.treads < np.inf:
            tops = tops[tops[:, contract.PEAK_CONTACT] < self.treads]
        return float(tops[:, contract.PEAK_FORCE].max(initial=0.0)) * self.unit


class Line:
    """A rail, or two, over which vehicles pass again and again.

    Parameters
    ----------
    scenario
        A scenario with an elastic-plastic contact and point rolling.
    start
        Length, m, over which the starting places of the wheels are spread.
    vehicles
        What passes in turn; none: the scenario's.

    Attributes
    ----------
    sides
        Names of the rails, where they are told apart.
    length
        How far the wheels of a pass go, m.
    notes, law, static_force
        Notes for the user, the plastic law, and the static force of the most heavily loaded wheelset, N.
    virgin
        The surface before the first pass.
    semi_axis
        Of the patch, along the rail, m.
    sample_positions
        Where the samples that are told lie on the run, m.
    """

    sides: tuple[str, ...] = ()
    notes: tuple[Note, ...]
    law: PlasticLaw
    static_force: float
    virgin: Surface
    semi_axis: float
    _base: FloatArray

    def __init__(self, scenario: Scenario, start: float = 0.0, vehicles: Sequence[Any] = ()) -> None:
        self.scenario, self.length = scenario, float(scenario.speed * scenario.duration)
        if start >= self.length:
            raise InputError("", "scatter.start", f"{start:g} m", f"less than the run of {self.length:g} m")
        self.passing = [scenario.replaced({"vehicle": vehicle}) for vehicle in vehicles] or [scenario]
        for one in self.passing:
            run.choose(run.WEAR_IN, one.needs)
            one.check_extent()

    def place_samples(self, rail: Surface, begins: float) -> None:
        """Choose the samples to tell: those on the run, of a rail that begins at some place, m."""
        places = rail.sample_positions + begins
        self._seen = (places >= 0.0) & (places < self.length)
        self.sample_positions = places[self._seen]

    def rails_of(self, surface: Surface) -> tuple[Surface, ...]:
        """Return the rails of a surface."""
        return (surface,)

    def joined(self, rails: Sequence[Surface]) -> Surface:
        """Return rails as one surface."""
        (rail,) = rails
        return rail

    def settled(self, surface: Surface) -> FloatArray:
        """Return the permanent indentation at the samples, averaged over the patch, m; two rows for sides."""
        each = np.stack([rail.settled_indentation()[self._seen] for rail in self.rails_of(surface)])
        return np.asarray(each if self.sides else each[0], dtype=np.float64)

    def rail_heights(self, surface: Surface) -> FloatArray:
        """Return the height of the rail at the samples, of the same shape, m."""
        return np.asarray(self._base - self.scenario.contact.share_of_rail * self.settled(surface), dtype=np.float64)

    def passing_over(self, surface: Surface, number: int, drawn: Drawn, hardening: float) -> Passing:
        """Return pass `number` over a surface, as it was drawn."""
        raise NotImplementedError
