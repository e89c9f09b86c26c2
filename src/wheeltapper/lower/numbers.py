"""The numbers of a program from the numbers of a scenario: for one cell, for many cells, and with derivatives.

All formulas here are analytic in their arguments. Therefore the imaginary part of a complex array is a derivative.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.contact.restitution import hysteresis_from_restitution
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.first_order import first_order
from wheeltapper.lower.known import check_known
from wheeltapper.lower.laws import ellipse
from wheeltapper.march.common import program as contract
from wheeltapper.march.general.at_rest import Numbers, indentation_at_rest, power_bearing

EVENT_LIMIT = 10_000_000
"""Largest number of events of a march; a march with more is ended, and its outcome says so."""


@dataclass(frozen=True)
class Method:
    """Order of the series, tolerance of its steps, and tolerance of the path relative to its height."""

    order: int
    tolerance: float
    fit: float


METHODS = {"default": Method(12, 1e-7, 1e-11), "strict": Method(20, 1e-10, 5e-14)}
"""The two methods: order of the series, tolerance of the steps, tolerance of the path."""
FINER, SHORTER = 1e-3, 0.5
"""Tolerance of a step, and longest macro step on rails, of runs finer than strict ones, relative to those of the strict
method. Values scatter by the errors of their steps where the number of these depends on a field; so they do by some
1e-12."""
SMALL = 1e-6
"""Change of the start by whose growth the amplification is found, in static indentations."""


@dataclass(frozen=True)
class Placing:
    """Use of a table by cells: y(x) = lift·table(rate·x + offset); and the table's height (m) and factor at x = 0."""

    lift: Numbers
    rate: Numbers
    offset: Numbers
    height: Numbers
    factor: Numbers


@dataclass(frozen=True)
class Units:
    """Units of length (m), time (s) and force (N) of each cell, its static contact force N0 and contact constant."""

    length: Numbers
    time: Numbers
    force: Numbers
    static_force: Numbers
    contact_constant: Numbers

    def part(self, block: slice) -> Units:
        """Return the units of some of the cells."""
        return Units(**{name: held[block] for name, held in vars(self).items()})


def _contact_constant(value: Fields) -> Numbers:
    contact = value.scenario.contact
    if isinstance(contact, Linear):
        return np.asarray(value("contact.stiffness"))
    if contact.constant is not None:
        return np.asarray(value("contact.constant"))
    wheels = value.scenario.vehicle.wheels
    if contact.constant_per_wheel is not None:
        return np.asarray(value("contact.constant_per_wheel") * wheels)
    names = ("vehicle.radius", "contact.rail_radius", "contact.youngs_modulus", "contact.poisson")
    return np.asarray(first_order(ellipse.contact_constant, *(value(name) for name in names)) * wheels)


def hysteresis_factor(value: Fields) -> Numbers:
    """Return χ in s/m."""
    contact = value.scenario.contact
    if not isinstance(contact, Hertz):
        return np.asarray(0.0)
    if contact.restitution is not None:
        factor = first_order(np.vectorize(hysteresis_from_restitution, otypes=[float]), value("contact.restitution"))
        return np.asarray(factor / value("contact.impact_speed"))
    return np.asarray(value("contact.hysteresis") if contact.hysteresis is not None else 0.0)


def contact_alone(scenario: Scenario, wheelset: Wheelset) -> Fields:
    """Return the numbers of a wheelset's contact, as that of a wheelset by itself on a stiff track.

    Of its suspension spring and damper alone are left: the rest is no matter of the contact.
    """
    kept = "mass", "load", "stiffness", "damping", "radius", "wheels", "gravity"
    alone = Wheelset(**{name: getattr(wheelset, name) for name in kept})
    return Fields(Scenario(vehicle=alone, contact=scenario.contact, speed=scenario.speed, duration=scenario.duration))


def units_of(value: Fields) -> Units:
    """Return the units of a scenario's cells (static force still missing: it is the program's prestress)."""
    check_known(value.scenario)
    mass = value("vehicle.mass")
    weight = np.asarray(value("vehicle.load") + mass * value("vehicle.gravity"))
    constant = _contact_constant(value)
    power = 1.0 if isinstance(value.scenario.contact, Linear) else 2 / 3
    length = (weight / constant) ** power
    return Units(length, np.sqrt(mass * length / weight), weight, weight, constant)


def static_stiffness(value: Fields) -> Numbers:
    """Return dN/dδ of the contact under the weight on it, N/m."""
    units = units_of(value)
    return np.asarray((1.0 if isinstance(value.scenario.contact, Linear) else 1.5) * units.force / units.length)


def numbers_of(value: Fields, placing: Placing, method: Method) -> tuple[Numbers, Units]:
    """Return the numbers of each cell's program, (cells, NUMBERS), and its units."""
    units = units_of(value)
    length, time, mass = units.length, units.time, value("vehicle.mass")
    speed = value("speed")
    linear = isinstance(value.scenario.contact, Linear)
    columns: dict[int, Any] = {
        contract.PACE: speed * time * placing.rate,
        contract.LIFT: placing.lift / length,
        contract.STIFFNESS: value("vehicle.stiffness") * time**2 / mass,
        contract.QUADRATIC if linear else contract.CUBIC: 1.0,
        contract.DECK_FROM: inf,
        contract.DECK_TO: inf,
        contract.START_SHIFT: -placing.offset,
        contract.END: value("duration") / time,
        contract.ORDER: method.order,
        contract.TOLERANCE: method.tolerance,
        contract.EVENT_LIMIT: EVENT_LIMIT,
        contract.LAST_IMPACT: -1.0,
        contract.LAST_LOSS: -1.0,
    }
    columns |= _damper_numbers(value, units)
    if isinstance(value.scenario.contact, Linear):
        columns[contract.BILATERAL] = float(value.scenario.contact.bilateral)
    else:
        columns[contract.HYSTERESIS] = hysteresis_factor(value) * length / time
    law = (float(linear), float(not linear))
    static = indentation_at_rest(power_bearing(*law), 1.0, columns[contract.STIFFNESS])
    prestress = law[0] * static + law[1] * static**1.5
    if isinstance(value.scenario.track, FloatingDeck):
        columns |= _deck_numbers(value, time, mass) | {contract.PRESTRESS: prestress}
    start = value.scenario.start
    if start == "equilibrium":
        height = placing.lift * placing.height / length
        if np.any(height != 0.0) or np.any(placing.factor != 1.0):
            here = power_bearing(law[0] * placing.factor, law[1] * placing.factor)
            static = indentation_at_rest(here, 1.0, columns[contract.STIFFNESS], height)
        columns[contract.START_HEIGHT] = height - static
    else:
        columns[contract.START_HEIGHT] = value("start.displacement") / length
        columns[contract.START_VELOCITY] = value("start.velocity") * time / length
    kind = np.result_type(float, *columns.values())
    numbers = np.zeros((value.cells, contract.NUMBERS), dtype=kind)
    for column, entry in columns.items():
        numbers[:, column] = entry
    return numbers, Units(length, time, units.force, prestress * units.force, units.contact_constant)


def _damper_numbers(value: Fields, units: Units) -> dict[int, Any]:
    """Return the numbers of dampers: the damping is that of the wheels, or of dampers whose ends can move."""
    damping = value("vehicle.damping") * units.time / value("vehicle.mass")
    play, bush = value("vehicle.damper_play") / units.length, value("vehicle.bush_stiffness")
    ends = np.real(play) > 0.0 if bush is None else True
    return {
        contract.DAMPING: np.where(ends, 0.0, damping),
        contract.DAMPER_DAMPING: np.where(ends, damping, 0.0),
        contract.DAMPER_PLAY: play,
        contract.DAMPER_BUSH: 0.0 if bush is None else bush * units.time**2 / value("vehicle.mass"),
        contract.DAMPER_START: value("vehicle.damper_play_start"),
    }


def _deck_numbers(value: Fields, time: Numbers, mass: Any) -> dict[int, Any]:
    deck = value.scenario.track
    columns = {
        contract.DECK_MASS: value("track.mass") / mass,
        contract.DECK_STIFFNESS: value("track.stiffness") * time**2 / mass,
        contract.DECK_DAMPING: value("track.damping") * time / mass,
        contract.DECK_FROM: -inf,
    }
    if deck.start is None:
        return columns
    pace = value("speed") * time
    start = np.asarray(value("track.start"))
    columns[contract.DECK_FROM] = _arrival_time(start, pace)
    if deck.length is not None:
        columns[contract.DECK_TO] = _arrival_time(start + value("track.length"), pace)
    return columns


def _arrival_time(position: Numbers, pace: Numbers) -> Numbers:
    """Return the time at which a position is reached; ±infinity if the wheel does not roll."""
    with np.errstate(divide="ignore", invalid="ignore"):
        rolled = position / pace
    return np.where(pace == 0.0, np.where(position.real > 0.0, inf, -inf), rolled)
