"""Comparisons with closed forms."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

from wheeltapper.ask.tracks import static_deflection
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.ballasted import Ballasted
from wheeltapper.describe.track.rail import Rail
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.faces.validation.comparison import compared
from wheeltapper.lower.laws.ellipse import contact_constant
from wheeltapper.record.simulate import simulate

MASS, CONSTANT = 1500.0, 1.405e11


@compared(
    "Impact of a wheelset without load on Hertz's contact", "closed form",
    "H. Hertz 1882; K. L. Johnson, Contact Mechanics, 1985, section 11.4",
    {"largest force": 1e-9, "duration": 1e-6, "impulse": 1e-9},
)  # fmt: skip
def hertz_impact() -> tuple[float, float, float]:
    """Return differences of the largest force, of the duration and of the impulse."""
    speed = 0.3
    scene = Scenario(
        vehicle=Wheelset(mass=MASS, load=1e-6, gravity=0.0), contact=Hertz(constant=CONSTANT), speed=0.0, duration=0.01,
        start={"displacement": 1e-6, "velocity": -speed},
    )  # fmt: skip
    record = simulate(scene, "strict")
    force = CONSTANT**0.4 * (1.25 * MASS * speed**2) ** 0.6
    duration = 2.943275 * (force / CONSTANT) ** (2 / 3) / speed
    impacts = record.impacts
    return (
        record.peaks.normal_force.item() / force - 1.0,
        impacts.duration.item() / duration - 1.0,
        impacts.impulse.item() / (2.0 * MASS * speed) - 1.0,
    )


@compared(
    "Bouncing of a wheelset on a linear contact, without damping", "closed form",
    "a sine in contact, a parabola in flight", {"time of losses and impacts": 1e-10, "largest force": 1e-10},
)  # fmt: skip
def linear_bounce() -> tuple[float, float]:
    """Return differences of the instants, over the period, and of the largest forces."""
    stiffness, load, drop = 1.2e9, 1e5, 1e-3
    scene = Scenario(
        vehicle=Wheelset(mass=MASS, load=load, gravity=0.0), contact=Linear(stiffness=stiffness), speed=0.0,
        duration=0.1, start={"displacement": drop, "velocity": 0.0},
    )  # fmt: skip
    record = simulate(scene, "strict")
    fall, omega = sqrt(2.0 * drop * MASS / load), sqrt(stiffness / MASS)
    speed, static = load / MASS * fall, load / stiffness
    swing = np.hypot(static, speed / omega)
    touch = 2.0 * (pi - np.arctan2(speed / omega, static)) / omega
    period = 2.0 * fall + touch
    impacts = record.events.time.values[record.events.kind.values == "impact"]
    losses = record.events.time.values[record.events.kind.values == "loss"]
    late = np.concatenate([
        impacts - (fall + period * np.arange(len(impacts))), losses - (fall + touch + period * np.arange(len(losses))),
    ])  # fmt: skip
    force = record.peaks.normal_force.values / (load + stiffness * swing) - 1.0
    return abs(late).max() / period, abs(force).max()


@compared(
    "Hertz's constant of a sphere on a plane", "closed form", "K. L. Johnson, Contact Mechanics, 1985, section 4.2",
    {"constant": 1e-12},
)  # fmt: skip
def sphere() -> tuple[float]:
    """Return the difference of the constant."""
    modulus = 210e9 / (2.0 * (1.0 - 0.3**2))
    found = contact_constant(0.46, 0.46, youngs_modulus=210e9, poisson=0.3)
    return (float(found) / (4.0 / 3.0 * modulus * sqrt(0.46)) - 1.0,)


@compared(
    "Static deflection of a rail on seats that are close together", "closed form",
    "E. Winkler 1867: a beam on an elastic foundation", {"deflection": 2e-3},
)  # fmt: skip
def winkler() -> tuple[float]:
    """Return the difference of the deflection under a load."""
    spacing, bending = 0.1, 6.4e6
    track = Ballasted(
        rail=Rail(bending_stiffness=bending, shear_stiffness=1e13, mass_per_length=60.0), spacing=spacing,
        pad_stiffness=4e7, pad_damping=3e3, sleeper_mass=25.0, ballast_stiffness=2e7, ballast_damping=8e3,
    )  # fmt: skip
    foundation = 1.0 / (1.0 / 4e7 + 1.0 / 2e7) / spacing
    root = (foundation / (4.0 * bending)) ** 0.25
    return (float(static_deflection(track, 0.0)) / (root / (2.0 * foundation)) - 1.0,)
