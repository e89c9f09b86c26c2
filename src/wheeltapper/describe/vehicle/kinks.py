"""What is not linear in a suspension: dry friction, bumpstops, springs with corners, dampers that blow off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import BLOW_OFF, BUMPSTOP, FRICTION, SPRING_CORNERS, Need

FloatArray = NDArray[np.float64]
FASTEST_ELEMENT = 1e4
"""Largest rate √(k/m) of dry friction, of a bumpstop or behind a corner of a spring, 1/s."""


class Element(NamedTuple):
    """What of a suspension is not linear, beside the springs and dampers in the matrices.

    Its force F pushes the two ends apart; u is by how much they have come together since the static state.

    Attributes
    ----------
    name
        As events and forces are told: "primary friction 1".
    compression
        What each freedom adds to u, upwards, (freedoms,).
    slider
        Of dry friction: sliding force, N, and series stiffness, N/m.
    corners
        Of a spring or a damper: where its slope changes, m or m/s, rising, without zero, and its slope between them,
        one more, N/m or N·s/m, beyond what the matrices have; 0 N at zero.
    by_rate
        Whether these are over the rate of u.
    is_bumpstop
        Whether it is met and left, rather than going beyond a corner.
    linear
        Stiffness, N/m, and damping, N·s/m, that the matrices have of the same spring or damper.
    """

    name: str
    compression: FloatArray
    slider: tuple[float, float] = (0.0, 0.0)
    corners: tuple[FloatArray, FloatArray] = (np.empty(0), np.zeros(1))
    by_rate: bool = False
    is_bumpstop: bool = False
    linear: tuple[float, float] = (0.0, 0.0)


class Suspension(NamedTuple):
    """A suspension: what it is called, whose it is with the prefix of its fields, its spring and damper."""

    name: str
    of: Any
    prefix: str
    stiffness: float
    damping: float


class Kinks(NamedTuple):
    """The fields of one suspension that make it more than a spring and a damper, as `Wheelset` describes them.

    `prefix` is that of the fields' names, as in "primary_friction".
    """

    prefix: str
    friction: float
    friction_stiffness: float | None
    bumpstop_gap: float | None
    rebound_gap: float | None
    bumpstop_stiffness: float | None
    spring_corners: tuple[tuple[float, float], ...]
    blow_off_force: float | None
    blow_off_damping: float

    @property
    def needs(self) -> frozenset[Need]:
        """What a march has to know."""
        has = {
            FRICTION: self.friction_stiffness is not None,
            BUMPSTOP: self.bumpstop_stiffness is not None,
            SPRING_CORNERS: bool(self.spring_corners),
            BLOW_OFF: self.blow_off_force is not None,
        }
        return frozenset(need for need, there in has.items() if there)

    def check(self, mass: float, stiffness: float, damping: float) -> None:
        """Refuse fields that do not go together, and what is stiffer than a mass of the vehicle, kg, allows."""
        name = self.prefix + "{}"
        if self.friction > 0.0 and self.friction_stiffness is None:
            raise InputError(
                "", name.format("friction"), f"{self.friction:g} N without {name.format('friction_stiffness')}",
                "both, or neither",
            )  # fmt: skip
        if (self.bumpstop_gap is None and self.rebound_gap is None) != (self.bumpstop_stiffness is None):
            what = "none" if self.bumpstop_stiffness is None else f"{self.bumpstop_stiffness:g} N/m"
            there = "without" if self.bumpstop_stiffness is not None else "with"
            raise InputError(
                "", name.format("bumpstop_stiffness"),
                f"{what} {there} {name.format('bumpstop_gap')} or {name.format('rebound_gap')}", "both, or neither",
            )  # fmt: skip
        places = [place for place, _ in self.spring_corners]
        if places != sorted(set(places)) or 0.0 in places:
            raise InputError(
                "", name.format("spring_corners"), f"corners at {', '.join(f'{place:g}' for place in places)} m",
                "rising compressions, m, none of them zero",
            )  # fmt: skip
        most = FASTEST_ELEMENT**2 * mass
        stiffest = max((abs(slope - stiffness) for _, slope in self.spring_corners), default=0.0)
        for field, held in (
            ("friction_stiffness", self.friction_stiffness), ("bumpstop_stiffness", self.bumpstop_stiffness),
            ("spring_corners", stiffest),
        ):  # fmt: skip
            if held is not None and held > most:
                raise InputError(
                    "", name.format(field), f"{held:g} N/m", f"at most {most:g} N/m for a mass of {mass:g} kg"
                )
        if self.blow_off_force is not None and not self.blow_off_damping < damping:
            raise InputError(
                "", name.format("blow_off_force"),
                f"{name.format('blow_off_damping')} = {self.blow_off_damping:g} N·s/m beyond it",
                f"less than the damping below it, {damping:g} N·s/m",
            )  # fmt: skip
        if self.blow_off_force is None and self.blow_off_damping:
            raise InputError(
                "", name.format("blow_off_damping"),
                f"{self.blow_off_damping:g} N·s/m without {name.format('blow_off_force')}", "both, or neither",
            )  # fmt: skip

    def elements(self, name: str, compression: FloatArray, stiffness: float, damping: float) -> Iterator[Element]:
        """Return the elements beside a spring and a damper that the matrices have; `name` takes their kind."""
        if self.friction > 0.0 and self.friction_stiffness is not None:
            yield Element(
                name.format("friction"), compression, slider=(float(self.friction), float(self.friction_stiffness))
            )
        if self.bumpstop_stiffness is not None:
            held = float(self.bumpstop_stiffness)
            ends = [(-gap, held) for gap in (self.rebound_gap,) if gap is not None]
            ends += [(gap, held) for gap in (self.bumpstop_gap,) if gap is not None]
            yield Element(name.format("bumpstop"), compression, corners=_with_corners(ends, 0.0), is_bumpstop=True)
        if self.spring_corners:
            corners = _with_corners(self.spring_corners, float(stiffness))
            yield Element(name.format("spring"), compression, corners=corners, linear=(float(stiffness), 0.0))
        if self.blow_off_force is not None:
            rate = float(self.blow_off_force / damping)
            ends = [(-rate, self.blow_off_damping), (rate, self.blow_off_damping)]
            yield Element(
                name.format("damper"), compression, corners=_with_corners(ends, float(damping)), by_rate=True,
                linear=(0.0, float(damping)),
            )  # fmt: skip


def kinks_of(vehicle: Any, prefix: str = "") -> Kinks:
    """Return what is not linear in a vehicle's suspension whose fields begin so."""
    return Kinks(prefix, *(getattr(vehicle, prefix + name) for name in Kinks._fields[1:]))


def _with_corners(corners: Sequence[tuple[float, float]], slope: float) -> tuple[FloatArray, FloatArray]:
    """Return corners, and how much the slope before, between and behind them differs from that at zero."""
    places, beyond = np.array(corners, dtype=float).T
    return places, np.insert(beyond, int((places < 0.0).sum()), slope) - slope
