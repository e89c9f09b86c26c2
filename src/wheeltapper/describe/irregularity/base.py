"""The base of all irregularities: a noun that returns its course."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, Self

from wheeltapper.describe.irregularity.course import Course
from wheeltapper.describe.noun import Noun
from wheeltapper.ground.errors import InputError

Similarity = dict[str, Literal["lift", "rate", "offset"]]


PLACES = ("start", "end", "position")
"""Fields that hold the position of an irregularity."""


class Irregularity(Noun, abstract=True):
    """A deviation of a rolling surface, m, upwards positive; material missing on a wheel is negative."""

    example: ClassVar[dict[str, Any]]
    """Fields of an example, felt within the first 0.36 m, which the conformance tests make."""
    borne: ClassVar[Literal["rail", "wheel"]] = "rail"
    stepwise: ClassVar[tuple[str, ...]] = ()
    """Fields that choose between forms, so that there are no derivatives by them."""

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance for a wheel of this radius (m)."""
        raise NotImplementedError

    def similarity(self) -> Similarity:
        """Return the fields that only scale the height or the length, or move the irregularity along the rail."""
        return {}

    def shortest_wave(self, radius: float) -> float | None:
        """Return the length of the shortest wave of a smooth form under a wheel of this radius, m; None: not known."""
        return None

    def span_given(self, end: float) -> float | None:
        """Return the highest less the lowest given height up to x = end (m); None if a formula gives the heights."""
        return None

    def limited(self, radius: float) -> dict[str, float]:
        """Return the sizes that limits apply to, on a wheel of this radius (m): flat_length, out_of_roundness, m."""
        return {}

    def on_rail(self, side: str) -> Self:
        """Return the irregularity of the "left" or "right" rail; most kinds are the same on both."""
        return self

    @property
    def filters(self) -> bool:
        """Whether the heights are already filtered as by a contact patch or by a rolling circle."""
        return False

    def moved(self, distance: float) -> Self:
        """Return the same irregularity farther along the rail (m).

        Raises
        ------
        InputError
            If it has no field for its position.
        """
        places = {name: getattr(self, name) for name in PLACES if getattr(self, name, None) is not None}
        if not places:
            raise InputError(
                "", "irregularity", f"a {type(self).__name__}, which has no place", "one that can be moved"
            )
        return self.model_copy(update={name: place + distance for name, place in places.items()})

    @property
    def shortest_run(self) -> float:
        """Length of the shortest run that is accepted, m; 0: any."""
        return 0.0

    def check_run(self, end: float) -> None:
        """Refuse a run to x = end (m) in which this irregularity cannot be met as it is described.

        Raises
        ------
        InputError
            The message says what is missing.
        """
        if end < self.shortest_run:
            found = f"{self.shortest_run:g} m, in a run over {end:g} m"
            raise InputError("", "length", found, "at most the length of the run")
