"""Places of irregularities under a vehicle of several wheelsets: on a rail, under a wheelset, under one wheel."""

from __future__ import annotations

import re
from typing import Any

from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import PLACES, Need

PLACE = re.compile(r"(?:wheelset ([1-9]\d*))?\s*(left|right|both)?")
SIDES = ("left", "right")


class Placement(dict[str, tuple[Any, ...]]):
    """Irregularities by place; immutable and hashable."""

    @property
    def needs(self) -> frozenset[Need]:
        """Places to tell apart."""
        return frozenset({PLACES})

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(tuple(sorted(self.items(), key=lambda item: item[0])))

    def on(self, wheelset: int, side: str) -> tuple[Any, ...]:
        """Return the irregularities that one wheel meets; wheelsets count from 1."""
        found: list[Any] = []
        for where, items in self.items():
            number, held = parsed_place(where)
            if number in (None, wheelset) and held in ("both", side):
                found += items
        return tuple(found)


def parsed_place(where: str) -> tuple[int | None, str]:
    """Return the wheelset (None: all of them) and the side of a place."""
    match = PLACE.fullmatch(where.strip())
    if match is None or not where.strip():
        allowed = '"left", "right", "both", "wheelset 4", "wheelset 4 right" and the like'
        raise InputError("", "irregularity", f"the place {where!r}", allowed)
    number, side = match.groups()
    return (int(number) if number else None), (side or "both")


def check_places(irregularity: Any, wheelsets: int, *, sides: bool = True) -> None:
    """Refuse places that a vehicle with this number of wheelsets does not have; one in the plane has no sides."""
    if not isinstance(irregularity, Placement):
        return
    for where in irregularity:
        number, side = parsed_place(where)
        if number is not None and number > wheelsets:
            raise InputError("", "irregularity", f"the place {where!r}", f"wheelsets 1 to {wheelsets}")
        if side != "both" and not sides:
            allowed = '"both", "wheelset 1" and the like, as both rails of this vehicle are the same'
            raise InputError("", "irregularity", f"the place {where!r}", allowed)
