"""Every element of a wagon: at rest it rests, its energy closes, it is felt, and it survives its file."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.vehicle.element import Element

from . import samples

AXLE = {"mass": 1500.0, "inertia": (1120.0, 112.0, 1120.0), "held": ("x", "y", "roll", "pitch", "yaw")}
HELD = ("x", "y", "roll", "pitch", "yaw")
PLACE = {"between": ("body", "wheelset 1"), "at": (0.0, 0.0, 0.8)}


def elements():
    return samples(Element, name="it", **PLACE)


SAMPLES = elements()


def scene(*tried, height=5e-4):
    body = wt.vehicles.Body(name="body", mass=5000.0, inertia=(1e3, 1e3, 1e3), position=(0.0, 0.0, 1.0), held=HELD)
    spring = wt.vehicles.Spring(name="spring", stiffness=(0.0, 0.0, 1e6), **PLACE)
    return wt.Scenario(
        vehicle=wt.Wagon(bodies=(body,), axles=(wt.vehicles.Axle(position=0.0, **AXLE),), elements=(spring, *tried)),
        contact=wt.Hertz(constant_per_wheel=7e10),
        profiles=wt.profiles.Cones(moving_with="wheel"),
        irregularity=wt.CosineBump(height=height, length=0.1, start=0.02) if height else None,
        speed=9.0,
        duration=0.1,
    )


@pytest.mark.parametrize("name", SAMPLES)
def test_at_rest_nothing_moves(name):
    history = wt.simulate(scene(SAMPLES[name], height=0.0)).history(1e4)
    np.testing.assert_allclose(history.acceleration, 0.0, atol=1e-6)


@pytest.mark.parametrize("name", SAMPLES)
def test_energy_closes(name):
    assert abs(wt.simulate(scene(SAMPLES[name])).energy.relative_imbalance.item()) < 1e-6


def test_no_element_is_taken_for_another_or_for_none():
    upright = [element for element in SAMPLES.values() if getattr(element, "direction", "z") == "z"]
    moved = [
        wt.simulate(scene(*tried)).at([0.1]).displacement.sel(body="body", motion="z").item()
        for tried in ((), *((element,) for element in upright))
    ]
    assert len(SAMPLES) - len(upright) == 1
    assert len({round(value, 9) for value in moved}) == 1 + len(upright), moved


@pytest.mark.parametrize("name", SAMPLES)
def test_it_survives_its_file(name, tmp_path):
    scene(SAMPLES[name]).to_toml(tmp_path / "scene.toml")
    assert wt.Scenario.from_toml(tmp_path / "scene.toml").vehicle.elements[-1] == SAMPLES[name]
