"""The setting of the paper: its wheelset, contact and irregularities (docs/theory/motion.rst, section 1.6)."""

from __future__ import annotations

from typing import Any

import numpy as np

import wheeltapper as wt

STATIC = 105_820.015756807212
"""Static force N0 of the setting in N: the unit of the forces in the claims."""

CONSTANT = 1.405e11
"""Contact constant per wheelset of the setting, N/m^1.5."""

HERTZ: dict[str, Any] = {"contact": wt.Hertz(constant=1.8825e11), "vehicle": {"stiffness": 0.0}}
"""The changes of the set `hertz`: the exact constant for a crown of 0.3 m, and no suspension."""

STATIC_INDENTATION = 8.27804275380278819e-5
"""Static indentation of the setting in m."""


def scene(irregularity: Any, damping: float, speed: float, duration: float, **changes: Any) -> wt.Scenario:
    """Return a scenario with the paper's wheelset (1500 kg, contact resonance at 180 Hz)."""
    vehicle = {"mass": 1500.0, "load": 91_307.0, "stiffness": 2.44e6, "damping": damping, "radius": 0.46}
    vehicle |= changes.pop("vehicle", {})
    fields = {"contact": wt.Hertz(constant=CONSTANT)} | changes
    return wt.Scenario(
        vehicle=wt.Wheelset(**vehicle), irregularity=irregularity, speed=speed, duration=duration, **fields
    )  # fmt: skip


def bump(damping: float, duration: float, speed: float = 9.0, **changes: Any) -> wt.Record:
    """Simulate the cosine bump of Fig. 2, 0.2 mm by 50 mm, followed by the wheel's centre."""
    shape = wt.CosineBump(height=2e-4, length=0.05, start=0.009)
    return wt.simulate(scene(shape, damping, speed, duration, **({"rolling": "point"} | changes)))


def step(
    height: float, damping: float, duration: float, speed: float = 5.0, ideal: bool = False, **changes: Any
) -> wt.Record:  # fmt: skip
    """Simulate the step of Fig. 4, 0.1 mm, at x = 0.05 m."""
    return wt.simulate(scene(wt.Step(height=height, position=0.05, ideal=ideal), damping, speed, duration, **changes))


def flat(damping: float, duration: float, speed: float = 5.0, **changes: Any) -> wt.Record:
    """Simulate the flat of Fig. 5, of sagitta 0.1 mm, at x = 0.05 m."""
    shape = wt.WheelFlat(depth=1e-4, position=0.05, repeat=False)
    return wt.simulate(scene(shape, damping, speed, duration, **changes))


def sine(amplitude: float, damping: float, speed: float, duration: float, **changes: Any) -> wt.Record:
    """Simulate the corrugation of Fig. 7, 5 cm long, from x = 0 on, followed by the wheel's centre."""
    shape = wt.Corrugation(amplitude=amplitude, wavelength=0.05, start=0.0)
    return wt.simulate(scene(shape, damping, speed, duration, **({"rolling": "point"} | changes)))


def largest(record: wt.Record) -> float:
    """Return the largest normal force over the static one."""
    return float(record.peaks.normal_force.values.max(initial=0.0)) / STATIC


def impacts(record: wt.Record) -> int:
    """Return the number of impacts."""
    return int(record.impacts.sizes["impact"])


def losses(record: wt.Record) -> int:
    """Return the number of losses of contact."""
    return int((record.events.kind.values == "loss").sum())


def harmonic(times: Any, values: Any, frequency: float) -> complex:
    """Return the complex amplitude at a frequency, over a whole number of periods."""
    return complex(2.0 * np.mean(np.asarray(values) * np.exp(-2j * np.pi * frequency * np.asarray(times))))
