"""What every irregularity is: a noun that answers with its course."""

from __future__ import annotations

from typing import ClassVar, Literal

from wheeltapper.describe.irregularity.course import Course
from wheeltapper.describe.noun import Noun

Similarity = dict[str, Literal["lift", "rate", "offset"]]


class Irregularity(Noun):
    """A deviation of a rolling surface, m, upwards positive; material missing on a wheel is negative."""

    borne: ClassVar[Literal["rail", "wheel"]] = "rail"

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance for a wheel of this radius (m)."""
        raise NotImplementedError

    def similarity(self) -> Similarity:
        """Return the fields that change nothing but the scale of the height, that of the length, or the place."""
        return {}

    def beyond_known(self, end: float) -> str | None:
        """Return what is missing if the run goes on to x = end (m), or None where everything is known."""
        return None
