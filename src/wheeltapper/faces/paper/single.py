"""Claims on single irregularities: bump, step and flat on a stiff track."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import Measure, absolute, claim, count, relative, within
from wheeltapper.faces.paper.setting import STATIC_INDENTATION, bump, flat, impacts, largest, scene, step


@claim("C01", "fig2", "the response to a bump has a phase of impacts and then one of contact vibration")
def two_phases() -> Iterator[Measure]:
    """Measure impacts, largest force and intervals at three dampings."""
    record = bump(5e4, 0.3)
    yield count("impacts at c = 5e4", impacts(record), 11)
    yield relative("N_max/N0 at c = 5e4", largest(record), 5.566, 1e-3)
    record = bump(1e5, 0.3)
    yield count("impacts at c = 1e5", impacts(record), 5)
    for i, expected in enumerate((7.93, 7.03, 6.36, 5.85)):
        yield relative(f"interval {i + 1} [ms] at c = 1e5", 1e3 * float(record.impacts.interval[i]), expected, 1e-3)
    yield count("impacts at c = 2e5", impacts(bump(2e5, 0.3)), 3)


@claim("C02", "fig2", "the system of Fig. 2a is heavily damped: c of 5e4 N s/m or more")
def needs_damping() -> Iterator[Measure]:
    """Measure that light damping leaves impacts to the end."""
    yield count("impacts in 0.3 s at c = 2e4", impacts(bump(2e4, 0.3)), 26)
    light = bump(8e3, 0.3)
    yield within("last impact [s] of 0.3 s at c = 8e3", float(light.impacts.time[-1]), 0.28, 0.3)


@claim("C08", "stiffness", "the suspension's stiffness is of little importance")
def stiffness_matters_little() -> Iterator[Measure]:
    """Measure force and interval from no spring to ten times the nominal one, at the same static force."""
    soft, stiff = (bump(5e4, 0.1, vehicle={"stiffness": k}) for k in (0.0, 2.44e7))
    for name, record, force, interval in (("k = 0", soft, 5.561, 8.728), ("k = 2.44e7", stiff, 5.608, 8.493)):
        unit = record.static_force
        yield relative(f"N_max/N0 at {name}", float(record.peaks.normal_force.max()) / unit, force, 1e-3)
        yield relative(f"interval [ms] at {name}", 1e3 * float(record.impacts.interval[0]), interval, 1e-3)


@claim("C17", "fig4", "a step up: peaks, loss and impact of the core model")
def step_up() -> Iterator[Measure]:
    """Measure the undamped response to a step up."""
    record = step(1e-4, 0.0, 0.06)
    peaks = record.peaks.normal_force.values[~record.peaks.corner.values] / record.static_force
    yield relative("first peak/N0", float(peaks[0]), 2.20, 5e-3)
    yield relative("second peak/N0", float(peaks[1]), 2.89, 5e-3)
    yield relative("loss after the edge [ms]", 1e3 * float(record.events.time[0]) - 10.0, 0.960, 5e-3)
    yield relative("impact after the edge [ms]", 1e3 * float(record.events.time[1]) - 10.0, 2.66, 5e-3)
    yield relative("frequency [Hz]", 1.0 / float(record.impacts.interval[1]), 162.8, 5e-3)


@claim("C18", "fig4", "a step down: peak, loss and impact of the core model")
def step_down() -> Iterator[Measure]:
    """Measure the undamped response to a step down."""
    record = step(-1e-4, 0.0, 0.06)
    yield relative("N_max/N0", largest(record), 2.639, 5e-3)
    yield relative("loss after the edge [ms]", 1e3 * float(record.events.time[0]) - 10.0, 6.55, 5e-3)
    yield relative("impact after the edge [ms]", 1e3 * float(record.events.time[1]) - 10.0, 7.57, 5e-3)
    yield relative("frequency [Hz]", 1.0 / float(record.impacts.interval[1]), 168.5, 5e-3)


@claim("C19", "fig4", "an ideal jump of the rail gives higher peaks")
def ideal_step() -> Iterator[Measure]:
    """Measure the limit of a wheel of radius zero."""
    yield relative("N_max/N0 up", largest(step(1e-4, 0.0, 0.06, ideal=True)), 3.278, 5e-3)
    yield relative("N_max/N0 down", largest(step(-1e-4, 0.0, 0.06, ideal=True)), 2.762, 5e-3)


@claim("C20", "fig4", "the sign of the step decides the peak")
def sign_of_the_step() -> Iterator[Measure]:
    """Measure both signs with light damping."""
    yield relative("N_max/N0 up", largest(step(1e-4, 8e3, 0.1)), 2.859, 5e-3)
    yield relative("N_max/N0 down", largest(step(-1e-4, 8e3, 0.1)), 2.626, 5e-3)


@claim("C21", "fig4", "the largest force over speed: steps rise, flats peak near 3 m/s")
def force_over_speed() -> Iterator[Measure]:
    """Measure step up, step down and flat at five speeds."""
    rows = {
        1.0: (1.371, 1.375, 1.753),
        3.0: (2.384, 2.332, 3.594),
        5.0: (2.859, 2.626, 3.232),
        10.0: (3.135, 2.722, 2.131),
        30.0: (3.229, 2.742, 1.348),
    }
    for speed, (up, down, flattened) in rows.items():
        duration = 0.06 / speed + 0.1
        yield relative(f"step up, {speed:g} m/s", largest(step(1e-4, 8e3, duration, speed)), up, 5e-3)
        yield relative(f"step down, {speed:g} m/s", largest(step(-1e-4, 8e3, duration, speed)), down, 5e-3)
        yield relative(f"flat, {speed:g} m/s", largest(flat(8e3, duration, speed)), flattened, 5e-3)


@claim("C40", "fig7", "the contact resonance of 1500 kg lies near 180 Hz")
def resonance() -> Iterator[Measure]:
    """Measure the frequency of small free vibration."""
    delta = STATIC_INDENTATION * (1.0 + 1e-4)
    start = {"displacement": -delta}
    record = wt.simulate(scene(None, 0.0, 0.0, 0.2, start=start), "strict")
    period = float(np.diff(record.peaks.time.values).mean())
    yield absolute("frequency [Hz]", 1.0 / period, 180.06, 0.1)
    yield absolute("speed of resonance at 5 cm [km/h]", 3.6 * 0.05 / period, 32.4, 0.05)
    yield absolute("speed of resonance at 10 cm [km/h]", 3.6 * 0.1 / period, 64.8, 0.1)
