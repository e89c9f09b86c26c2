"""A track as one mass on a spring and a damper under a wheel, as formulas for joints take it."""

from __future__ import annotations

from typing import NamedTuple

from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.numbers import contact_alone, units_of
from wheeltapper.lower.track.section import Section


class Lumped(NamedTuple):
    """What of a beam on an elastic foundation moves with a force on it: kg, N/m, N·s/m."""

    mass: float
    stiffness: float
    damping: float


def lumped(bending: float, foundation: float, mass: float, damping: float = 0.0) -> Lumped:
    """Return a beam on an elastic foundation as one mass, by Rayleigh's method (docs/theory/joints.rst, section 14.2).

    Its static deflection is w(x) = w0·e^(-βx)·(cos βx + sin βx) with β = (k/4EI)^(1/4), on both sides. Force over
    deflection is 2k/β = 2·(4EI)^(1/4)·k^(3/4), and ∫w²dx/w0² = 3/(2β) is the length of mass and damping that moves.

    Parameters
    ----------
    bending
        EI, N·m².
    foundation, mass, damping
        Per metre of rail: N/m², kg/m, N·s/m².
    """
    beta = (foundation / (4.0 * bending)) ** 0.25
    moving = 1.5 / beta
    return Lumped(mass * moving, 2.0 * foundation / beta, damping * moving)


def rail_on_pads(section: Section) -> Lumped:
    """Return the rail on its pads, on sleepers that rest: what P1 meets."""
    return lumped(section.bending, section.pad / section.spacing, section.mass)


def whole_track(section: Section) -> Lumped:
    """Return rail, pads, sleepers and ballast: what P2 meets.

    Pad and ballast are in series, k = 1/(1/k_p + 1/k_b); sleepers follow the rail as under a static force, by k/k_b;
    the dampers are those of slow motions, c = k²·(c_p/k_p² + c_b/k_b²).
    """
    a = section.spacing
    if not section.sleeper:
        return lumped(section.bending, section.pad / a, section.mass, section.pad_damping / a)
    both = 1.0 / (1.0 / section.pad + 1.0 / section.ballast)
    damping = both**2 * (section.pad_damping / section.pad**2 + section.ballast_damping / section.ballast**2)
    mass = section.mass + (both / section.ballast) ** 2 * section.sleeper / a
    return lumped(section.bending, both / a, mass, damping / a)


def contact_stiffness(scenario: Scenario) -> float:
    """Return the slope of the first wheelset's contact force over its indentation at the static force, N/m.

    Raises
    ------
    InputError
        If the contact's law has no such constant.
    """
    wheelset, contact = scenario.vehicle.plane.wheelsets[0], scenario.contact
    if not isinstance(contact, Hertz | Linear):
        raise InputError("", "contact", f"a {type(contact).__name__}", "Hertz or Linear")
    constant = float(units_of(contact_alone(scenario, wheelset)).contact_constant)
    return constant if isinstance(contact, Linear) else 1.5 * constant ** (2.0 / 3.0) * wheelset.weight ** (1.0 / 3.0)
