"""The acceleration of a deck under a wheelset and the wheelsets that pass with it.

together    One motion of all wheelsets and the deck, exact, by the march of many bodies. The other end of each
            suspension moves steadily, as in the core model.
superposed  Each wheelset alone on the deck, shifted in time by spacing over speed, and the sum of all. This is exact
            for the deck, which is linear, but no wheel reacts to the motion of the deck due to the others.

The deck moves by micrometres, but this matters: the indentation of the contact is about 80 µm, and its resonance, about
180 Hz, is hardly damped. The error of superposition is of the order of m/M times the quality factor of that resonance.
On the reference deck (15 t, both wheelsets on it) it is 15 % of the signal within 25 ms, and all of it after 60 ms. On
a deck of 1500 t it is 0.2 % and 4 %. A neighbour that stands on the deck without bouncing has the same effect, because
its contact couples its mass to the deck.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import ceil, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.profile.wheel_rail import Cones
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.body import Axle
from wheeltapper.describe.vehicle.element import GROUND, Damper, Spring
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.shown import Shown
from wheeltapper.march import run
from wheeltapper.record.simulate import simulated_quietly

if TYPE_CHECKING:
    from wheeltapper.diagnosis.faults.base import Fault

FloatArray = NDArray[np.float64]

HELD = ("x", "y", "roll", "pitch", "yaw")
"""Motions of an axle that are suppressed, because the wheelset of the core model moves only vertically."""
INERTIA = (1120.0, 112.0, 1120.0)
"""Moments of inertia of an axle about x, y and z, kg·m². They have no effect, because these rotations are
suppressed."""


@dataclass(frozen=True)
class Condition(Shown):
    """The condition of one wheelset: a fault, or none.

    Attributes
    ----------
    fault
        Name in the catalogue; None: healthy.
    size
        Size of the fault in the catalogue's unit, or a range (low, high) in which it is drawn uniformly; None: the
        usual size.
    place
        Place on the wheel's circumference, 0 to 1; None: drawn uniformly.
    name
        What a recording's `truth` calls it; None: the fault's name, or "healthy".
    """

    fault: str | None = None
    size: float | tuple[float, float] | None = None
    place: float | None = None
    name: str | None = field(default=None, kw_only=True)

    def drawn(self, random: np.random.Generator) -> tuple[Fault | None, float | None, float | None]:
        """Return the fault, its size and its place."""
        from wheeltapper.diagnosis.faults.base import as_place, fault_named  # it needs what needs this

        if self.fault is None:
            for name, value in (("size", self.size), ("place", self.place)):
                if value is not None:
                    raise InputError("", name, f"{value!r} without a fault", "a fault that has it")
            return None, None, None
        fault = fault_named(self.fault)
        low, high = ends_of(fault.usual if self.size is None else self.size)
        size = low if low == high else float(random.uniform(low, high))
        drawn = float(random.uniform())  # always drawn, so that a given place changes no other number
        return fault, size, drawn if self.place is None else as_place(self.place)

    @property
    def label(self) -> str:
        """Its name, the fault's name, or "healthy"."""
        return self.name or self.fault or "healthy"


def ends_of(size: Any) -> tuple[float, float]:
    """Return the range in which a fault's size is drawn; for one size, that size twice."""
    try:
        low, high = map(float, size) if isinstance(size, Sequence) and not isinstance(size, str) else 2 * (float(size),)
    except (TypeError, ValueError):
        low, high = np.nan, np.nan
    if not (np.isfinite(low + high) and low <= high):
        raise InputError("", "size", value_text(size), "a number, or a range (low, high)")
    return low, high


@dataclass(frozen=True)
class Neighbour(Condition):
    """A wheelset that passes with the one of interest.

    Attributes
    ----------
    spacing
        Distance by which it runs ahead, m; negative: behind.
    """

    spacing: float = 0.0

    def __post_init__(self) -> None:
        spacing = to_si(self.spacing, "length", "neighbour.spacing")
        object.__setattr__(self, "spacing", spacing)
        if not np.isfinite(spacing) or spacing == 0.0:
            raise InputError(
                "", "neighbour.spacing", repr(self.spacing), "a distance in m: positive ahead, negative behind"
            )


def neighbours_of(given: float | Neighbour | Sequence[Neighbour] | None) -> tuple[Neighbour, ...]:
    """Return neighbours; a number is the spacing to a healthy one."""
    if given is None:
        return ()
    if isinstance(given, Neighbour):
        return (given,)
    if isinstance(given, int | float):
        return (Neighbour(spacing=given),)
    if isinstance(given, Sequence) and all(isinstance(one, Neighbour) for one in given):
        return tuple(given)
    raise InputError("", "neighbour", value_text(given), "a spacing in m, a Neighbour, or several")


Others = Sequence[tuple[float, Scenario]]
"""Spacings (m, positive ahead) and passages, each from its own trigger."""


class DeckMotion(NamedTuple):
    """Motion of a deck: the end of the known part, s after the trigger, and the acceleration at given times, m/s²."""

    end: float
    at: Callable[[FloatArray], FloatArray]


def deck_motion(own: Scenario, others: Others = (), coupled: bool = True) -> DeckMotion:
    """Return the deck's acceleration after the trigger of one wheelset.

    Parameters
    ----------
    own
        Passage of that wheelset alone.
    others
        The wheelsets that pass with it over the same deck and rail.
    coupled
        Whether wheelsets react to the motion of the deck due to the others (`coupled_motion`), or are superposed.
    """
    if not others:
        return motion_under_one_wheelset(own)
    return coupled_motion(own, others) if coupled else superposed(own, others)


def motion_under_one_wheelset(passage: Scenario, ahead: float = 0.0) -> DeckMotion:
    """Return the motion of the deck under one wheelset whose trigger was `ahead` earlier, s; zero before it."""
    duration = float(passage.duration) + ahead
    if duration <= 0.0:
        return DeckMotion(np.inf, np.zeros_like)
    record = simulated_quietly(passage.replaced({"duration": duration}))

    def acceleration_at(times: FloatArray) -> FloatArray:
        out, here = np.zeros(len(times)), times + ahead
        begun = here >= 0.0
        out[begun] = record.at(np.minimum(here[begun], record.end)).deck_acceleration.values
        return out

    return DeckMotion(record.end - ahead, acceleration_at)


def superposed(own: Scenario, others: Others) -> DeckMotion:
    """Return the sum of the motions of the deck under each wheelset alone."""
    for _, passage in [(0.0, own), *others]:
        run.choose(run.SUPERPOSED, passage.needs)
    parts = [
        motion_under_one_wheelset(own),
        *(motion_under_one_wheelset(passage, spacing / float(own.speed)) for spacing, passage in others),
    ]
    return DeckMotion(
        min(part.end for part in parts), lambda times: np.asarray(np.sum([part.at(times) for part in parts], axis=0))
    )


def coupled_motion(own: Scenario, others: Others) -> DeckMotion:
    """Return the motion of the deck under all wheelsets, which influence each other.

    It begins in equilibrium when the leading wheelset is at its trigger. On a deck without ends each wheelset has its
    own static force. A deck with ends is prestressed by the static force of the leading one, and sinks under the
    others.
    """
    for _, passage in [(0.0, own), *others]:
        run.choose(run.COUPLED, passage.needs)
    ahead = max(0.0, *(spacing for spacing, _ in others))
    row = sorted([(0.0, own), *others], key=lambda one: -one[0])
    begins = ahead / float(own.speed)
    record = simulated_quietly(_on_one_deck([(x - ahead, passage) for x, passage in row], begins + float(own.duration)))

    def acceleration_at(times: FloatArray) -> FloatArray:
        return np.asarray(record.at(np.clip(times + begins, 0.0, record.end)).deck_acceleration.values)

    return DeckMotion(record.end - begins, acceleration_at)


def _on_one_deck(row: list[tuple[float, Scenario]], duration: float) -> Scenario:
    """Return a wagon of wheelsets at x (m, falling from 0) that are coupled by the deck only."""
    from wheeltapper.lower.build import lower

    first = row[0][1]
    axles, elements, placed = [], [], {}
    for number, (x, passage) in enumerate(row, 1):
        vehicle = passage.vehicle
        load = float(vehicle.load) + float(vehicle.mass) * (float(vehicle.gravity) - float(first.vehicle.gravity))
        axles.append(Axle(mass=vehicle.mass, inertia=INERTIA, position=x, load=load, radius=vehicle.radius, held=HELD))
        elements += _suspension_elements(vehicle, number, x)
        placed[f"wheelset {number}"] = tuple(
            _turned_back(item, float(vehicle.radius), x) for item in passage.irregularity
        )
    law, constant = first.contact, lower(first.replaced({"irregularity": None})).contact_constant
    contact = Hertz(
        constant_per_wheel=0.5 * constant, curvature=law.follows_curvature,
        rail_radius=law.rail_radius, youngs_modulus=law.youngs_modulus, poisson=law.poisson,
    )  # fmt: skip
    return Scenario(
        vehicle=Wagon(bodies=(), axles=tuple(axles), elements=tuple(elements), gravity=first.vehicle.gravity),
        track=first.track, contact=contact, profiles=Cones(moving_with="wheel"), irregularity=placed,
        rolling=first.rolling, speed=first.speed, duration=duration,
    )  # fmt: skip


def _turned_back(item: Any, radius: float, x: float) -> Any:
    """Return an irregularity of a wheel, moved back so that it exists from the start of the wheel, x ≤ 0."""
    turn = 2.0 * pi * radius
    return item.moved(-turn * ceil(-x / turn)) if item.borne == "wheel" and getattr(item, "repeat", True) else item


def _suspension_elements(vehicle: Any, number: int, x: float) -> list[Spring | Damper]:
    where: dict[str, Any] = {"between": (f"wheelset {number}", GROUND), "at": (x, 0.0, float(vehicle.radius))}
    out: list[Spring | Damper] = [Spring(name=f"spring {number}", stiffness=(0.0, 0.0, vehicle.stiffness), **where)]
    if vehicle.damping > 0.0:
        bush = getattr(vehicle, "bush_stiffness", None) or None
        damping = (0.0, 0.0, vehicle.damping)
        out.append(Damper(name=f"damper {number}", damping=damping, series_stiffness=bush, **where))
    return out
