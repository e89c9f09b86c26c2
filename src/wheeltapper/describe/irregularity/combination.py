"""Repetition of an irregularity."""

from __future__ import annotations

from math import inf
from typing import Any, ClassVar

import numpy as np
from pydantic import Field, SerializeAsAny, field_validator, model_validator

from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.course import Course, Stretch
from wheeltapper.describe.noun import PositiveLength
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.ground.errors import InputError, value_text, with_suggestion


class Repeated(Irregularity):
    """A repeated irregularity of the rail: y(x) = Σ of(x - i·period), i = 0, 1, 2 and so on.

    Parameters
    ----------
    of
        The irregularity that is repeated. Its part that is not level must not be longer than the period.
    period
        m.
    count
        How many times it occurs; None: without end.
    """

    example: ClassVar[dict[str, Any]] = {
        "of": {"type": "CosineBump", "height": 1e-4, "length": 0.05, "start": 0.1},
        "period": 0.1,
    }
    of: SerializeAsAny[Any]
    period: PositiveLength
    count: int | None = Field(default=None, ge=1)

    @field_validator("of", mode="before")
    @classmethod
    def _checked_repetition(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        known = {kind.__name__: kind for kind in makeable_nouns(Irregularity) if kind.borne == "rail"}
        kind = str(value.get("type"))
        if kind not in known:
            raise InputError("", "type", repr(kind), with_suggestion(kind, known))
        return known[kind].model_validate(value)

    @model_validator(mode="after")
    def _fits_in_period(self) -> Repeated:
        if not isinstance(self.of, Irregularity) or self.of.borne != "rail":
            raise InputError("", "of", value_text(self.of), "an irregularity of the rail")
        course = self.of.course(1.0)
        if course.period is not None:
            raise InputError("", "", "an irregularity that already repeats", "one that does not")
        first, last = course.stretches[0].end, course.stretches[-1].start
        if last - first > self.period * (1 + 1e-12):
            allowed = f"at least {last - first:g} m, the length of what is repeated"
            raise InputError("", "period", f"{self.period:g} m", allowed)
        if abs(float(course.value(np.array([last + 1.0]))[0])) > 1e-12 * course.height:
            raise InputError(
                "", "", "an irregularity that ends at another height than it began", "one that returns to zero"
            )
        return self

    def moved(self, distance: float) -> Repeated:
        """Return the same irregularities farther along the rail (m)."""
        return self.model_copy(update={"of": self.of.moved(distance)})

    def shortest_wave(self, radius: float) -> float | None:
        """Return the shortest wave of the repeated irregularity."""
        found: float | None = self.of.shortest_wave(radius)
        return found

    def check_run(self, end: float) -> None:
        """Refuse a run that is shorter than the repeated irregularity, which is level behind its last sample."""
        try:
            Irregularity.check_run(self.of, end)
        except InputError as error:
            raise error.within("of") from None

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        once = self.of.course(radius)
        if self.count is None:
            return Course(once.stretches, once.height, self.period, once.stretches[0].end)
        first, *inner, last = once.stretches
        stretches: list[Stretch] = [first]
        for i in range(self.count):
            stretches += [s.moved(i * self.period) for s in inner]
            gap_end = inf if i == self.count - 1 else first.end + (i + 1) * self.period
            gap = last.moved(i * self.period)
            stretches.append(Stretch(gap.start, gap_end, gap.value, gap.slope, gap.curvature, gap.exact))
        return Course(tuple(s for s in stretches if s.end > s.start), once.height)
