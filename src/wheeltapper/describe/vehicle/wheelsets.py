"""Several wheelsets on one track, each on its own suspension."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from wheeltapper.describe.noun import Length
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.kinks import Suspension
from wheeltapper.describe.vehicle.plane import PlaneVehicle, side_by_side
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import WHEELSETS, Need


class Wheelsets(Vehicle):
    """Independent wheelsets that run over one track and feel each other through it.

    They are numbered from the leading one, 1; irregularities are placed under "wheelset 2" and the like. The position x
    of the vehicle is that of the leading wheelset.

    Parameters
    ----------
    wheelsets
        All wheelsets, beginning with the leading one.
    positions
        x of each from the leading wheelset, m: 0 first, then negative, falling numbers.
    """

    example: ClassVar[dict[str, Any]] = {
        "wheelsets": ({"mass": 1200.0, "load": 88e3}, {"mass": 1200.0, "load": 88e3}), "positions": (0.0, -2.56),
    }  # fmt: skip
    wheelsets: Annotated[tuple[Wheelset, ...], Field(min_length=1)]
    positions: tuple[Length, ...]

    @model_validator(mode="after")
    def _one_behind_the_other(self) -> Wheelsets:
        if len(self.positions) != len(self.wheelsets):
            raise InputError("", "positions", f"{len(self.positions)} values", f"{len(self.wheelsets)}, one a wheelset")
        if self.positions[0] != 0.0:
            raise InputError("", "positions.0", f"{self.positions[0]:g} m", "0 m, the leading wheelset")
        for number, (ahead, behind) in enumerate(pairwise(self.positions), start=1):
            if behind >= ahead:
                allowed = f"less than {ahead:g} m, behind the wheelset before"
                raise InputError("", f"positions.{number}", f"{behind:g} m", allowed)
        wheels = [wheelset.wheels for wheelset in self.wheelsets]
        if len(set(wheels)) > 1:
            raise InputError("", "wheelsets", f"wheels = {value_text(wheels)}", "the same number on every wheelset")
        return self

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: several wheelsets, and what each of them needs."""
        return frozenset({WHEELSETS}).union(*(wheelset.needs for wheelset in self.wheelsets))

    @property
    def wheels(self) -> int:
        """Number of wheels of each wheelset."""
        return self.wheelsets[0].wheels

    @property
    def loads(self) -> dict[str, float]:
        """The loads that the wheelsets carry, N, by the paths of the fields that state them."""
        return {f"wheelsets.{number}.load": float(one.load) for number, one in enumerate(self.wheelsets)}

    @property
    def suspensions(self) -> tuple[Suspension, ...]:
        """The suspensions of wheelsets that differ from each other."""
        kinds = tuple(dict.fromkeys(self.wheelsets))
        if len(kinds) == 1:
            return kinds[0].suspensions
        numbers = (self.wheelsets.index(one) + 1 for one in kinds)
        return tuple(one.suspensions[0]._replace(name=f"wheelset {n}") for n, one in zip(numbers, kinds, strict=True))

    @property
    def plane(self) -> PlaneVehicle:
        """The wheelsets as matrices, for a track that deforms."""
        return side_by_side(self.wheelsets, self.positions)
