"""Waves that are short beside the samples of a rolled profile: every crest is touched, or they are refused."""

from time import process_time

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.irregularity.interpolants import Interpolants
from wheeltapper.lower.build import lower

VEHICLE = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)


def lowered(*irregularities, length=0.1):
    contact = wt.Hertz(constant=1.405e11)
    return lower(
        wt.Scenario(vehicle=VEHICLE, contact=contact, irregularity=irregularities, speed=5, duration=length / 5)
    )


def wave(wavelength, amplitude, **given):
    return wt.Profile(function=lambda x: amplitude * np.sin(2 * np.pi * x / wavelength), **given)


@pytest.mark.parametrize("wavelength", [5e-4, 1e-3])
@pytest.mark.parametrize("amplitude", [1e-6, 1e-4])
@pytest.mark.parametrize("shape", ["function", "corrugation and flat"])
def test_a_wheel_touches_every_crest(shape, wavelength, amplitude):
    if shape == "function":
        table = lowered(wave(wavelength, amplitude)).table
    else:
        waves = wt.Corrugation(amplitude=amplitude, wavelength=wavelength, start=-0.3)
        table = lowered(waves, wt.WheelFlat(depth=1e-5, position=0.5)).table
    crests = (np.arange(20, 90) * 1e-3 // wavelength + 0.25) * wavelength
    np.testing.assert_allclose(table.height_at(crests), amplitude, rtol=1e-9)
    between = table.height_at(crests + 0.5 * wavelength)  # on two crests at once
    sagitta = VEHICLE.radius - np.sqrt(VEHICLE.radius**2 - wavelength**2 / 4)
    assert np.all((amplitude - between > 0.9 * sagitta) & (amplitude - between < 1.001 * sagitta))


@pytest.mark.slow
def test_waves_too_short_to_be_followed_are_refused_soon():
    begun = process_time()
    with pytest.raises(wt.InputError, match=r"irregularity: found .*allowed: longer waves, a shorter run"):
        lowered(wave(6e-5, 1e-4), length=1.0)
    assert process_time() - begun < 10.0


@pytest.mark.parametrize("middle", [0.0, 60.0])
def test_curvatures_of_functions_are_not_those_of_rounding(middle):
    sizes, numbers = np.array([6e-5, 2e-5, 5e-6, 3e-6]), np.array([38.3, 83.6, 75.3, 142.3])

    def heights(x):
        return (sizes * np.sin(np.multiply.outer(x, numbers))).sum(axis=-1)

    found = Interpolants(heights, -np.inf, np.inf, 1e-3)
    x = middle + np.linspace(0.0, 10.0, 3001)
    slope = (sizes * numbers * np.cos(np.multiply.outer(x, numbers))).sum(axis=-1)
    curvature = -(sizes * numbers**2 * np.sin(np.multiply.outer(x, numbers))).sum(axis=-1)
    np.testing.assert_allclose(found.derivative(x, 1), slope, rtol=0, atol=1e-11)
    np.testing.assert_allclose(found.derivative(x, 2), curvature, rtol=0, atol=2e-7)
    assert 0.0 < found.scatter(x).max() < 4e-7


def test_interpolants_do_not_reach_across_a_breakpoint_that_is_nearer_than_the_scale():
    def heights(x):
        assert np.all((x >= 0.0) & (x <= 0.01))
        return 1e-4 * np.sin(50.0 * x)

    found = Interpolants(heights, 0.0, 0.01, 1.0)
    x = np.linspace(0.0, 0.01, 101)
    np.testing.assert_allclose(found.derivative(x, 1), 5e-3 * np.cos(50.0 * x), rtol=0, atol=1e-9)
