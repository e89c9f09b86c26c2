"""Measured profiles of any length lower in time and memory proportional to it."""

import tracemalloc

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march.common.program import DONE
from wheeltapper.march.wheel.single import march


def rough_rail(samples, rolling):
    x = 1e-3 * np.arange(samples)
    waves = ((2e-4, 1.1, 0.0), (5e-5, 0.31, 1.0), (1e-5, 0.07, 2.0), (3e-6, 0.023, 3.0))
    heights = sum(a * np.sin(2 * np.pi * x / length + phase) for a, length, phase in waves)
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4),
        contact=wt.Hertz(constant=1.405e11),
        irregularity=wt.Measured(positions=x, heights=heights),
        rolling=rolling,
        speed=50,
        duration=0.99 * x[-1] / 50,
    )


def peak_memory(samples, rolling):
    scenario = rough_rail(samples, rolling)
    tracemalloc.start()
    lower(scenario)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


@pytest.mark.parametrize("rolling", ["point", "circle"])
@pytest.mark.slow
def test_memory_grows_no_faster_than_the_profile(rolling):
    peak_memory(1000, rolling)  # what is imported and cached once
    assert peak_memory(80_000, rolling) < 2.2 * peak_memory(40_000, rolling)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("rolling", ["point", "circle"])
def test_a_profile_of_a_million_points_is_marched_whole(rolling):
    scenario = rough_rail(1_000_000, rolling)
    lowered = lower(scenario)
    assert len(lowered.program.pieces) >= 990_000
    if rolling == "point":
        knots = np.arange(5, 980_000, 997)
        heights = lowered.table.height_at(1e-3 * knots)
        np.testing.assert_allclose(heights, np.array(scenario.irregularities[0].heights)[knots], rtol=0, atol=1e-15)
    result = march(lowered.program)
    assert result.status == DONE
    assert len(result.steps) >= 990_000
