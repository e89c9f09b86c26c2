"""Claims on the law of the contact: curvature, non-linearity, and one-sidedness."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import acos, asin, pi, sqrt
from typing import Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import PINNED, Case, Measure, analysis, claim, said
from wheeltapper.faces.paper.corrugation import AMPLITUDE, WAVELENGTH
from wheeltapper.faces.paper.setting import CONSTANT, STATIC, bump, largest, losses, scene, sine
from wheeltapper.lower.build import lower
from wheeltapper.march.common import program as contract
from wheeltapper.march.run import march

FOLLOWING = wt.Hertz(constant=CONSTANT, curvature=True)
"""The setting's contact with a constant that follows the local curvature."""
ENERGY = analysis("quadrature of the energy (docs/theory/closed_forms.rst, section 11.1)")
SHARE = "softening by the non-linearity alone, before the first loss, over that of a linear contact that cannot pull"


def parametric_alone(damping: float, duration: float) -> wt.Record:
    """Simulate the corrugation at 9 m/s as a change of the contact's stiffness only, on a level path."""
    shape = wt.Corrugation(amplitude=AMPLITUDE, wavelength=WAVELENGTH, start=0.0)
    scenario = scene(shape, damping, 9.0, duration, rolling="point", contact=FOLLOWING)
    lowered = lower(scenario)
    numbers = lowered.program.numbers.copy()
    numbers[contract.LIFT] = 0.0
    level = replace(lowered, program=lowered.program._replace(numbers=numbers))
    return wt.Record(level, "default", march(level.program))


@claim(
    "C24", "parametric", "parametric excitation, the contact's stiffness that follows the curvature, is negligible",
    "for single irregularities and above the resonance; at the resonance it alone makes the wheel lift off corrugation",
)  # fmt: skip
def parametric() -> Iterator[Measure]:
    """Measure the effect of a contact constant that follows the curvature."""
    rows: tuple[tuple[str, dict[str, Any], float, float, float], ...] = (
        ("constant", {}, 5.86273, 9.25359, 2.34225),
        ("following", {"contact": FOLLOWING}, 5.30241, 8.64783, 2.14580),
    )
    found = []
    for name, changes, force, interval, corrugation in rows:
        record = bump(2e4, 0.1, **changes)
        beyond = largest(sine(-AMPLITUDE, 8e3, 36.0, 0.2, **changes))
        found.append((largest(record), 1e3 * float(record.impacts.interval[0]), beyond))
        yield PINNED.relative(f"bump, C {name}: N_max/N0", found[-1][0], force)
        yield PINNED.relative(f"bump, C {name}: interval [ms]", found[-1][1], interval)
        yield PINNED.relative(f"corrugation at 36 m/s, C {name}: N_max/N0", found[-1][2], corrugation)
    where = "section 4: much less significant"
    for name, constant, following in zip(("bump: N_max", "bump: interval", "36 m/s: N_max"), *found, strict=True):
        ratio = following / constant
        yield said("almost identical", where, f"{name} with C following, over that with C constant", ratio)
    record = parametric_alone(2e4, 1.0)
    late = float(record.peaks.normal_force.values[record.peaks.time.values > 0.5].max() / STATIC)
    yield PINNED.relative("9 m/s, the changing constant alone: settled N_max/N0", late, 2.64055)
    corrugated = Case("corrugation at the resonance", own=False)
    yield said(
        "very small",
        where,
        "settled N_max/N0 of the changing constant alone, less 1",
        late - 1.0,
        refutes=True,
        case=corrugated,
    )
    yield PINNED.count("losses of contact with the changing constant alone", losses(record), 23)


def free_vibration(contact: Any, ratio: float) -> float:
    """Return the frequency of undamped vibration with this largest force over the static one, over the linear one."""
    linear = isinstance(contact, wt.Linear)
    stiffness = contact.stiffness if linear else 1.5 * (CONSTANT**2 * STATIC) ** (1 / 3)
    deepest = ratio * STATIC / stiffness if linear else (ratio * STATIC / CONSTANT) ** (2 / 3)
    start = {"displacement": -deepest}
    vehicle = {"stiffness": 0.0, "load": STATIC - 1500.0 * 9.81}
    scenario = scene(None, 0.0, 0.0, 0.1, contact=contact, vehicle=vehicle, start=start)
    times = wt.simulate(scenario, "strict").peaks.time.values
    return float(1.0 / np.diff(times).mean() / (sqrt(stiffness / 1500.0) / (2 * pi)))


def exact_frequency(ratio: float) -> float:
    """Return the same for Hertz's law, by quadrature of the energy (docs/theory/closed_forms.rst, section 11.1)."""
    from scipy.integrate import quad
    from scipy.optimize import brentq

    top = ratio ** (2 / 3)

    def energy_integrand(d: float) -> float:  # v²/2 of the indentation d, in units of the static state
        return float((d - top) - 0.4 * (max(d, 0.0) ** 2.5 - top**2.5))

    bottom = 0.0 if energy_integrand(0.0) > 0.0 else float(brentq(energy_integrand, 0.0, 1.0))
    middle, half = 0.5 * (top + bottom), 0.5 * (top - bottom)

    def time_integrand(angle: float) -> float:  # d = middle + half·sin(angle) removes the square roots at both ends
        d = middle + half * np.sin(angle)
        return float(half * np.cos(angle) / sqrt(max(2.0 * energy_integrand(d), 1e-300)))

    first = -pi / 2 if bottom > 0.0 else asin(-middle / half)
    contact = 2.0 * float(quad(time_integrand, first, pi / 2, epsabs=1e-13, epsrel=1e-13)[0])
    flight = 2.0 * sqrt(2.0 * energy_integrand(0.0)) if bottom == 0.0 else 0.0
    return float(2 * pi / sqrt(1.5) / (contact + flight))


def exact_linear_frequency(ratio: float) -> float:
    """Return the same for a linear contact that cannot pull, in closed form: contact on a circle arc, then flight."""
    amplitude = ratio - 1.0
    return pi / (acos(-1.0 / amplitude) + sqrt(amplitude**2 - 1.0))


@claim("C43", "law", "the non-linearity of the contact matters less than that it cannot pull")
def nonlinear_or_one_sided() -> Iterator[Measure]:
    """Measure how far the frequency falls before the first loss, and with losses."""
    hertz = wt.Hertz(constant=CONSTANT)
    for ratio in (2.0, 2.5 * (1 - 1e-9), 4.0, 10.0):
        measured = free_vibration(hertz, ratio)
        exact = exact_frequency(ratio)
        yield ENERGY.relative(f"f/f_linear, Hertz, N_max = {ratio:.3g} N0", measured, exact, 1e-6)
    before = 1.0 - free_vibration(hertz, 2.5 * (1 - 1e-9))
    stiffness = 1.5 * (CONSTANT**2 * STATIC) ** (1 / 3)
    one_sided = 100 * (1 - free_vibration(wt.Linear(stiffness=stiffness), 10.0))
    exact = 100 * (1 - exact_linear_frequency(10.0))
    yield said("lower", "section 5: of lesser importance", SHARE, 100 * before / one_sided)
    yield ENERGY.relative("softening at 10 N0 of a linear contact that cannot pull [%]", one_sided, exact, 1e-6)
    at_resonance = {
        name: largest(sine(AMPLITUDE, 2e4, 9.0, 60 * WAVELENGTH / 9.0, contact=contact))
        for name, contact in (
            ("Hertz", hertz), ("linear", wt.Linear(stiffness=stiffness)),
            ("linear, pulls", wt.Linear(stiffness=stiffness, bilateral=True)),
        )
    }  # fmt: skip
    hertzian, linear, pulling = at_resonance.values()
    change = abs(hertzian - linear) / (pulling - linear)
    share = "change of N_max over corrugation at 9 m/s by the non-linearity, over that by a contact that pulls"
    yield said("very small", "section 5: of lesser importance", share, change)
    for (name, found), expected in zip(at_resonance.items(), (4.22035, 3.68210, 69.4009), strict=True):
        yield PINNED.relative(f"N_max/N0 over corrugation at 9 m/s, {name}", found, expected)
    both = free_vibration(wt.Linear(stiffness=stiffness, bilateral=True), 10.0)
    yield ENERGY.absolute("softening at 10 N0 of a linear contact that pulls [%]", 100 * (1 - both), 0.0, 1e-6)
