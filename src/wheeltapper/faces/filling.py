"""Short questions that need all kernels between them: whoever asks them compiles what would be compiled one by one.

Which kernel a question needs depends on whether a vehicle is a wheelset on one wheel's track, a wagon, or any other;
on the method; and on which arrays are passed: those of damper stops, of marks, of lanes.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import wheeltapper as wt
from wheeltapper.ground.progress import reporting
from wheeltapper.march.compiling.telling import told_once
from wheeltapper.record.simulate import Method

METHODS: tuple[Method, ...] = ("default", "strict")
WHEELSET: dict[str, Any] = {"mass": 1500, "load": 91_307, "stiffness": 2.44e6, "damping": 5e4}
BUMP = wt.CosineBump(height=1e-4, length=0.05, start=0.005)
LAW = wt.Hertz(constant_per_wheel=1.405e11 / 2)
YIELDING = wt.contact.Thornton(constant_per_wheel=1.405e11 / 2, yield_force=1.3e5)
HYSTERESIS = wt.Hertz(constant_per_wheel=1.405e11 / 2, hysteresis=0.1)
OWN = wt.contact.Law(force=lambda indentation: 1.405e11 * indentation**1.5)
DECK = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)
SCALE = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4, start=0.02, length=3.0)
RAILS = wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 1000, "bays": 160})
HANGING = {"cutoff": 1000, "bays": 80, "anomalies": (wt.tracks.HangingSleeper(seat=1, void=1e-4),)}
VOIDED = wt.tracks.Ballasted(**wt.tracks.Ballasted.example | HANGING)
BILATERAL = wt.Linear(stiffness=1.2e9, bilateral=True)

wheelset = wt.Wheelset(**WHEELSET)
with_play = wt.Wheelset(**WHEELSET, damper_play=5e-5)
with_bush = wt.Wheelset(**WHEELSET, bush_stiffness=1e8)
bogie = wt.vehicles.Bogie(**wt.vehicles.Bogie.example)
wagon = wt.Wagon.erri_b176()


def scene(vehicle: Any, contact: Any = LAW, **fields: Any) -> wt.Scenario:
    """Return a vehicle on a bump that its wheels leave and meet again."""
    given = {"irregularity": BUMP, "rolling": "point", "speed": 9.0, "duration": 0.007} | fields
    return wt.Scenario(vehicle=vehicle, contact=contact, **given)


def mass_of(scenario: wt.Scenario) -> str:
    """Return the path of a wheelset's mass."""
    return {"Bogie": "vehicle.wheelset_mass", "Wagon": "vehicle.axles.0.mass"}.get(
        type(scenario.vehicle).__name__, "vehicle.mass"
    )


def record(scenario: wt.Scenario, method: Method) -> None:
    """Ask for all that a record tells."""
    found = wt.simulate(scenario, method)
    found.history("2 kHz")
    found.at([0.0, found.end])
    float(found.energy.relative_imbalance)


def chart(scenario: wt.Scenario, method: Method) -> None:
    """Ask for a map, with derivatives and without, and for its border."""
    over = {mass_of(scenario): [1500.0, 1510.0]}
    wt.sweep(scenario, over, ["filtered_force"], method=method)
    for feature in (wt.features.largest_force(), wt.features.impulse()):
        for gradient in (False, True):
            wt.sweep(scenario, over, [feature], gradient=gradient, method=method)
    wt.border(scenario, over | {"speed": [9.0, 9.1]}, resolution=2, method=method)


def wear(scenario: wt.Scenario, method: Method) -> None:
    """Ask for the marks of a pass."""
    wt.wear.marks(wt.simulate(scenario, method))
    wt.wear_in(scenario, 1, method=method)


def diagnosis(scenario: wt.Scenario, method: Method) -> None:
    """Ask what a diagnosis asks: a recording and its derivatives."""
    site = wt.diagnosis.Site(passage=scenario, sensor=wt.sensors.DeckAcceleration(rate=20e3, noise=6.66e-4))
    wt.synthesise(site, vary=False)
    wt.diagnosis.information(site, [mass_of(scenario)])


def orbits(scenario: wt.Scenario, method: Method) -> None:
    """Ask for a motion that repeats, and where others go."""
    again = scenario.replaced(
        {"irregularity": (wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.0),), "speed": 5.0}
    )
    float(wt.orbits.find(again, method=method).record.end)
    wt.orbits.returns(again, {"vehicle.mass": [1500, 1510]}, 2, 2, method=method)
    for many in (3, 20):
        wt.orbits.fates(again, {"start.velocity": np.linspace(-0.8, 0.8, many)}, settle=30)
    wt.features.growth_exponent(100)(wt.simulate(again, method))


def steps(_: wt.Scenario, method: Method) -> None:
    """Ask for each kind of a wheel's steps."""
    from wheeltapper.lower.numbers import METHODS as ORDERS
    from wheeltapper.march.steps.written import write_all

    write_all(int(ORDERS[method].order))


def asks() -> list[tuple[Callable[[wt.Scenario, Method], None], wt.Scenario, Method]]:
    """Return all questions, of which scenario, and by which method; those that compile for a long time first."""
    flanges = {"rolling": "circle", "creep": wt.creep.Polach(friction=0.35), "profiles": wt.profiles.Cones()}
    records = [
        scene(wagon, track=RAILS), scene(bogie), scene(wagon), scene(wheelset),
        scene(wagon, YIELDING, track=RAILS, **flanges), scene(wagon, track=VOIDED),
        scene(bogie, YIELDING, track=RAILS),
        scene(bogie, HYSTERESIS, track=SCALE), scene(bogie, OWN, irregularity=()), scene(with_play, track=DECK),
        scene(with_bush, HYSTERESIS, track=DECK), scene(wheelset, BILATERAL), scene(wheelset, YIELDING, track=DECK),
    ]  # fmt: skip
    charts = [
        scene(bogie, track=DECK), scene(wheelset), scene(bogie, track=RAILS), scene(wheelset, track=DECK),
        scene(wheelset, BILATERAL), scene(with_play), scene(wheelset, YIELDING),
    ]  # fmt: skip
    worn = [scene(wagon, YIELDING, duration=0.3), scene(bogie, YIELDING), scene(wheelset, YIELDING, track=DECK)]
    of = {
        steps: [scene(wheelset)], record: records, chart: charts, wear: worn,
        diagnosis: [scene(wheelset, track=SCALE)], orbits: [scene(wheelset), scene(wheelset, track=DECK)],
    }  # fmt: skip
    return [(question, one, method) for question, scenes in of.items() for method in METHODS for one in scenes]


def ask(_: None, number: int) -> list[str]:
    """Ask one of them, in silence; return what had to be said besides."""
    question, scenario, method = asks()[number]
    with reporting(lambda *_: None, lambda _: None), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        question(scenario, method)
    return told_once()
