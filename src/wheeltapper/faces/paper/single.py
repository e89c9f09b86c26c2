"""Claims on single irregularities: bump, step and flat on a stiff track."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sqrt
from typing import Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import PINNED, STATED, Case, Measure, analysis, claim, printed, program, said
from wheeltapper.faces.paper.setting import (
    CONSTANT,
    HERTZ,
    STATIC,
    STATIC_INDENTATION,
    bump,
    flat,
    impacts,
    largest,
    scene,
    step,
)

RESTARTED = program("SciPy's DOP853 in time, restarted at every event (tests/peer.py)")
DIGITS = program("extrapolation in mpmath with 30 digits (tests/data/core_cases.json)")


@claim("C01", "fig2", "the response to a bump has a phase of impacts and then one of contact vibration")
def two_phases() -> Iterator[Measure]:
    """Measure impacts, largest force and intervals at three dampings."""
    record = bump(5e4, 0.3)
    later = int((record.peaks.time > record.impacts.time[-1]).sum())
    yield said("several times", "section 3, Fig. 2a: vibro-impacts first", "impacts, c = 5e4", impacts(record))
    yield said("several times", "section 3, Fig. 2a: then vibrations", "force maxima after them, in 0.3 s", later)
    yield RESTARTED.count("impacts at c = 5e4", impacts(record), 11)
    yield DIGITS.relative("N_max/N0 at c = 5e4", largest(record), 5.565633, 1e-6)
    record = bump(1e5, 0.3)
    yield RESTARTED.count("impacts at c = 1e5", impacts(record), 5)
    for i, expected in enumerate((7.92895, 7.02508, 6.36150, 5.85041)):
        found = 1e3 * float(record.impacts.interval[i])
        yield RESTARTED.relative(f"interval {i + 1} [ms] at c = 1e5", found, expected, 1e-5)
    yield RESTARTED.count("impacts at c = 2e5", impacts(bump(2e5, 0.3)), 3)


@claim("C02", "fig2", "the system of Fig. 2a is heavily damped: with c of 8e3 and 2e4 N s/m impacts go on to the end")
def needs_damping() -> Iterator[Measure]:
    """Measure that light damping leaves impacts to the end."""
    record = bump(2e4, 0.3)
    yield RESTARTED.count("impacts in 0.3 s at c = 2e4", impacts(record), 26)
    light = float(bump(8e3, 0.3).impacts.time[-1])
    yield said("almost identical", "section 3, Fig. 2a", "time of the last impact over 0.3 s, c = 8e3", light / 0.3)
    yield PINNED.relative("last impact [s] of 0.3 s at c = 8e3", light, 0.29372)


@claim("C08", "stiffness", "the suspension's stiffness is of little importance")
def stiffness_matters_little() -> Iterator[Measure]:
    """Measure force and interval from no spring to ten times the nominal one, at the same static force."""
    soft, stiff = (bump(5e4, 0.1, vehicle={"stiffness": k}) for k in (0.0, 2.44e7))
    found = []
    for name, record, force, interval in (("k = 0", soft, 5.56087, 8.72826), ("k = 2.44e7", stiff, 5.60793, 8.49276)):
        unit = record.static_force
        found.append((float(record.peaks.normal_force.max()) / unit, 1e3 * float(record.impacts.interval[0])))
        yield PINNED.relative(f"N_max/N0 at {name}", found[-1][0], force)
        yield RESTARTED.relative(f"interval [ms] at {name}", found[-1][1], interval, 1e-5)
    for name, low, high in zip(("N_max", "interval"), *found, strict=True):
        ratio = high / low
        yield said("practically identical", "section 4", f"{name} with ten times the spring, over that without", ratio)


VIBRATIONS = "section 4: contact vibrations of about 200 Hz"
UNDAMPED = Case("no damping: bounces that never end", own=False)
SLOWER = "bounces have 100 to 200 Hz, as the paper gives elsewhere; without damping they never become vibrations"


def bounces(frequency: float, case: Case = STATED) -> Measure:
    """Return the measure of the frequency of bounces, Hz."""
    return printed("section 4: vibro-impacts of 100 to 200 Hz", "frequency [Hz]", frequency, 100.0, 200.0, case)


@claim("C17", "fig4", "a step up makes vibro-impacts of 100 to 200 Hz, and contact vibrations of about 200 Hz", SLOWER)
def step_up() -> Iterator[Measure]:
    """Measure the undamped response to a step up."""
    record = step(1e-4, 0.0, 0.06)
    peaks = record.peaks.normal_force.values[~record.peaks.corner.values] / record.static_force
    frequency = 1.0 / float(record.impacts.interval[1])
    yield bounces(frequency)
    yield said("about", VIBRATIONS, "frequency over 200 Hz", frequency / 200.0, refutes=True, case=UNDAMPED)
    yield PINNED.relative("first peak/N0", float(peaks[0]), 2.20096)
    yield PINNED.relative("second peak/N0", float(peaks[1]), 2.89064)
    yield PINNED.relative("loss after the edge [ms]", 1e3 * float(record.events.time[0]) - 10.0, 0.960074)
    yield PINNED.relative("impact after the edge [ms]", 1e3 * float(record.events.time[1]) - 10.0, 2.66485)
    yield PINNED.relative("frequency [Hz]", frequency, 162.850)


@claim(
    "C18", "fig4", "a step down makes vibro-impacts of 100 to 200 Hz, and contact vibrations of about 200 Hz", SLOWER
)
def step_down() -> Iterator[Measure]:
    """Measure the undamped response to a step down."""
    record = step(-1e-4, 0.0, 0.06)
    frequency = 1.0 / float(record.impacts.interval[1])
    yield bounces(frequency)
    yield said("about", VIBRATIONS, "frequency over 200 Hz", frequency / 200.0, refutes=True, case=UNDAMPED)
    yield PINNED.relative("N_max/N0", largest(record), 2.63926)
    yield PINNED.relative("loss after the edge [ms]", 1e3 * float(record.events.time[0]) - 10.0, 6.54738)
    yield PINNED.relative("impact after the edge [ms]", 1e3 * float(record.events.time[1]) - 10.0, 7.56669)
    yield PINNED.relative("frequency [Hz]", frequency, 168.537)


def highest_by_energy(height: float) -> float:
    """Return the largest force over the static one after a jump of the rail, without damping, from the energy alone."""
    from scipy.optimize import brentq

    if height > -STATIC_INDENTATION:  # no loss of contact: the first indentation is the deepest
        return float((1.0 + height / STATIC_INDENTATION) ** 1.5)
    weight, stiffness = 91_307.0 + 1500.0 * 9.81, 2.44e6

    def excess(depth: float) -> float:  # work of the contact, less that of weight and spring
        low = height - depth
        fall = weight * (-STATIC_INDENTATION - low) + 0.5 * stiffness * (STATIC_INDENTATION**2 - low**2)
        return float(0.4 * CONSTANT * depth**2.5 - fall)

    return float(CONSTANT * brentq(excess, 1e-6, 1e-3, xtol=1e-15) ** 1.5 / STATIC)


@claim("C19", "fig4", "an ideal jump of the rail gives higher peaks", section=4)
def ideal_step() -> Iterator[Measure]:
    """Measure the limit of a wheel of radius zero."""
    for name, height in (("up", 1e-4), ("down", -1e-4)):
        found = largest(step(height, 0.0, 0.06, ideal=True))
        yield analysis("energy").relative(f"N_max/N0 {name}", found, highest_by_energy(height), 1e-6)


@claim("C20", "fig4", "the sign of the step decides the peak", section=4)
def sign_of_the_step() -> Iterator[Measure]:
    """Measure both signs with light damping."""
    yield DIGITS.relative("N_max/N0 up", largest(step(1e-4, 8e3, 0.1)), 2.858898, 1e-6)
    yield PINNED.relative("N_max/N0 down", largest(step(-1e-4, 8e3, 0.1)), 2.62578)


@claim("C21", "fig4", "the largest force over speed: steps rise, flats peak near 3 m/s", section=4)
def force_over_speed() -> Iterator[Measure]:
    """Measure step up, step down and flat at five speeds."""
    rows = {
        1.0: (1.37073, 1.37454, 1.75317),
        3.0: (2.38402, 2.33189, 3.59423),
        5.0: (2.85890, 2.62578, 3.23192),
        10.0: (3.13502, 2.72179, 2.13099),
        30.0: (3.22929, 2.74170, 1.34751),
    }
    for speed, (up, down, flattened) in rows.items():
        duration = 0.06 / speed + 0.1
        yield PINNED.relative(f"N_max/N0, step up, {speed:g} m/s", largest(step(1e-4, 8e3, duration, speed)), up)
        yield PINNED.relative(f"N_max/N0, step down, {speed:g} m/s", largest(step(-1e-4, 8e3, duration, speed)), down)
        yield PINNED.relative(f"N_max/N0, flat, {speed:g} m/s", largest(flat(8e3, duration, speed)), flattened)


def _resonance(**changes: Any) -> float:
    """Return the frequency of small free vibrations of the wheel on its contact, Hz."""
    level = wt.simulate(scene(None, 0.0, 0.0, 0.01, **changes))
    changes["start"] = {"displacement": float(level.at(0.0).wheel_displacement[0]) * (1.0 + 1e-4)}
    record = wt.simulate(scene(None, 0.0, 0.0, 0.2, **changes), "strict")
    return 1.0 / float(np.diff(record.peaks.time.values).mean())


@claim(
    "C40", "fig7", "the contact resonance of 1500 kg lies near 180 Hz",
    "the contact's constant was chosen for 180 Hz; the exact one of a wheel with a crown of 0.3 m gives 198 Hz",
)  # fmt: skip
def resonance() -> Iterator[Measure]:
    """Measure the frequency of small free vibration, with both constants."""
    frequency, exact = _resonance(), _resonance(**HERTZ)
    yield said("about", "section 6", "frequency over 180 Hz", frequency / 180.0, fitted=True)
    crown = Case("exact constant, crown of 0.3 m", own=False)
    yield said("about", "section 6", "frequency over 180 Hz", exact / 180.0, refutes=True, case=crown)
    linear = sqrt((1.5 * CONSTANT * sqrt(STATIC_INDENTATION) + 2.44e6) / 1500.0) / (2 * pi)
    yield analysis("√((1.5·C·√δ₀ + k)/m)/2π").relative("frequency [Hz]", frequency, linear, 1e-6)
    where = "section 6, with the printed km/s read as km/h"
    speed = 3.6 * 0.05 * frequency
    yield said("slightly above", where, "speed of resonance at 5 cm, over 30 km/h", speed / 30.0, fitted=True)
    yield said("about", where, "speed of resonance at 10 cm, over 60 km/h", 2.0 * speed / 60.0, fitted=True)
