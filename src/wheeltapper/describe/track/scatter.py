"""Random pads and ballast."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from wheeltapper.describe.track.anomaly import Anomaly, Change
from wheeltapper.ground.errors import InputError

LARGEST = 0.5
"""Coefficient of variation beyond which normal deviates are negative too often."""
LEAST = 0.02
"""Factor below which a drawn stiffness is refused."""


class Scatter(Anomaly):
    """Pads and ballast that differ from seat to seat.

    At every seat, stiffness and damping of the pad are 1 + pads·z times those of the track; those of the ballast are
    1 + ballast·z' times as large. z and z' are independent standard normal deviates. They depend only on the seed and
    on the number of the seat.

    Parameters
    ----------
    pads, ballast
        Coefficients of variation, 0 to 0.5.
    seed
        Seed of the deviates, a whole number, 0 or more.
    """

    example: ClassVar[dict[str, Any]] = {"pads": 0.1, "seed": 1}
    pads: float = Field(default=0.0, ge=0.0, le=LARGEST)
    ballast: float = Field(default=0.0, ge=0.0, le=LARGEST)
    seed: int = Field(default=0, ge=0)

    @model_validator(mode="after")
    def _some_scatter(self) -> Scatter:
        if self.pads == self.ballast == 0.0:
            raise InputError("", "", "neither pads nor ballast", "a coefficient of variation of one of them")
        return self

    @property
    def of_ballast(self) -> bool:
        """Whether the ballast scatters."""
        return self.ballast > 0.0

    def changes(self, seats: range) -> tuple[Change, ...]:
        """Return what it changes at these seats."""
        return tuple(self._change(seat) for seat in seats)

    def _change(self, seat: int) -> Change:
        deviates = np.random.default_rng([self.seed, abs(seat), int(seat < 0)]).standard_normal(2)
        pad, ballast = (1.0 + np.array([self.pads, self.ballast]) * deviates).tolist()
        for name, factor in (("pads", pad), ("ballast", ballast)):
            if factor < LEAST:
                found = f"{getattr(self, name):g}, by which seat {seat} draws {factor:.2g} of the track's"
                raise InputError("", name, found, f"a smaller coefficient or another seed, so that all draw {LEAST:g}")
        return Change(seat, pad, ballast)
