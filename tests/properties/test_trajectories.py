"""Derivatives of a motion at given times, against differences of the strict method."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.lower.fields import Fields

HEAVY = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)
SETTINGS = {
    "heavy deck": {},
    "light deck": {"track": wt.FloatingDeck(mass=1000, stiffness=4e6, damping=1e4)},
    "edges of the deck": {"track": wt.FloatingDeck(mass=5000, stiffness=5e6, damping=2e4, start=0.05, length=0.9)},
    "circle": {"rolling": "circle"},
    "damped contact": {"contact": wt.Hertz(constant=1.405e11, hysteresis=0.2)},
    "curvature": {"contact": wt.Hertz(constant=1.405e11, curvature=True)},
    "dip": {"irregularity": wt.CosineBump(height=-1e-4, length=0.04, start=0.009)},
    "step": {"irregularity": wt.Step(height=1e-4, position=0.02), "rolling": "circle"},
    "waves": {"irregularity": wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.01)},
}
TIMES = np.arange(0.0, 0.12, 1 / 5e3)


def scene(**changes):
    fields = {
        "vehicle": wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        "contact": wt.Hertz(constant=1.405e11), "track": HEAVY, "rolling": "point", "speed": 9.0, "duration": 0.13,
        "irregularity": wt.CosineBump(height=2e-4, length=0.05, start=0.009),
    }  # fmt: skip
    return wt.Scenario(**(fields | changes))


@pytest.mark.parametrize("name", sorted(SETTINGS))
def test_derivatives_are_those_of_the_strict_method(name):
    one = scene(**SETTINGS[name])
    size = "amplitude" if name == "waves" else "height"
    paths = ("vehicle.mass", "contact.constant", f"irregularity.0.{size}", "speed", "track.mass")
    if name == "heavy deck":
        paths += ("vehicle.damping", "vehicle.load", "track.stiffness", "track.damping")
    found = trajectory(one, paths, TIMES, "strict")
    record = wt.simulate(one, "strict")
    history = record.at(TIMES)
    np.testing.assert_allclose(found.force, history.normal_force, rtol=0, atol=1e-9 * record.static_force)
    np.testing.assert_allclose(found.deck_acceleration, history.deck_acceleration, rtol=0, atol=1e-9)
    assert len(record.events.time) >= 4
    near = np.min(np.abs(TIMES[:, None] - record.events.time.values), axis=1) < 1e-4
    edges = np.array([0.009, 0.02, 0.059, *((0.05, 0.95) if "edges" in name else ())]) / 9.0
    near |= np.min(np.abs(TIMES[:, None] - edges), axis=1) < 1e-4
    for row, path in enumerate(paths):
        value = float(Fields(one)(path))
        step = 2e-6 * value

        def at(k, path=path, value=value, step=step):
            moved = wt.simulate(one.replaced({path: value + k * step}), "strict").at(TIMES)
            return np.array([moved.normal_force.values, moved.deck_acceleration.values])

        slopes = (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * step)
        for ours, theirs in zip((found.of_force[row], found.of_deck_acceleration[row]), slopes, strict=True):
            largest = np.abs(theirs).max()
            if largest * value > 1e-6 * np.abs(found.force).max():
                assert np.abs(ours - theirs)[~near].max() < 2e-5 * largest, path


def test_what_scales_and_what_shifts_is_known_exactly():
    one = scene()
    paths = ("vehicle.mass", "vehicle.load", "vehicle.stiffness", "vehicle.damping", "contact.constant", "track.mass",
             "track.stiffness", "track.damping")  # fmt: skip
    found = trajectory(one, paths, TIMES)
    values = [float(Fields(one)(path)) for path in paths]
    scaled = sum(value * row for value, row in zip(values, found.of_deck_acceleration, strict=True))
    largest = np.abs(found.of_deck_acceleration * np.array(values)[:, None]).max()
    np.testing.assert_allclose(scaled, 0.0, atol=1e-8 * largest)  # all forces and masses together leave no trace
    forces = sum(value * row for value, row in zip(values, found.of_force, strict=True))
    np.testing.assert_allclose(forces, found.force, rtol=0, atol=1e-8 * largest * 15_000)


def test_times_beyond_the_run_have_no_value():
    found = trajectory(scene(duration=0.05), ("vehicle.mass",), TIMES)
    beyond = TIMES > 0.05
    assert np.all(np.isnan(found.force[beyond]))
    assert np.all(np.isfinite(found.of_force[0, ~beyond]))
