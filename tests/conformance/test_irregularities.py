"""One suite over every irregularity: a new law's file is found by itself, with the example that its class gives."""

import pickle
from math import inf

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.irregularity.base import Irregularity

from . import samples

RADIUS = 0.46
X = np.linspace(0.0, 0.5, 251)


def smooth(x):
    return 1e-4 * np.sin(20 * x) ** 2


def laws():
    dense = wt.Measured(positions=tuple(X), heights=tuple(smooth(X)), beyond="flat")
    return samples(Irregularity) | {"Measured, dense": dense}


SAMPLES = laws()
LAWS = sorted(SAMPLES)


@pytest.mark.filterwarnings("ignore:the irregularity is more sharply hollow")  # only a point follows a flat's ends
@pytest.mark.parametrize("rolling", ["point", "circle"])
@pytest.mark.parametrize("name", LAWS)
def test_a_wheel_rolls_over_it_and_the_energy_closes(name, rolling):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4, radius=RADIUS),
        contact=wt.Hertz(constant=1.405e11),
        irregularity=SAMPLES[name],
        rolling=rolling,
        speed=6.0,
        duration=0.06,
    )
    record = wt.simulate(scene)
    felt = record.history(1e4).normal_force.values / record.static_force - 1.0
    assert np.abs(felt).max() > 1e-3
    assert abs(record.energy.relative_imbalance.item()) < 1e-7


@pytest.mark.parametrize("name", LAWS)
def test_a_law_is_a_frozen_value(name):
    law = SAMPLES[name]
    assert pickle.loads(pickle.dumps(law)) == law
    assert hash(law) == hash(law.model_copy())
    assert type(law).__name__ in repr(law)
    assert " m" in type(law).__doc__
    with pytest.raises(wt.InputError, match="never changes"):
        law.start = 1.0
    if name != "Profile":
        scene = wt.Scenario(vehicle=wt.Wheelset(mass=1500), irregularity=law, speed=1.0, duration=0.1)
        assert wt.Scenario.model_validate(scene.model_dump(mode="json")) == scene


@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_has_been_used_is_still_equal_to_its_like(name):
    used, like = (pickle.loads(pickle.dumps(SAMPLES[name])) for _ in range(2))
    for law in (used, like):
        law.course(RADIUS)
    assert used == like
    assert hash(used) == hash(like)
    assert used != "a law"


@pytest.mark.parametrize("name", LAWS)
def test_a_course_covers_the_line_and_repeats_as_it_says(name):
    course = SAMPLES[name].course(RADIUS)
    assert course.stretches[0].start == -inf
    assert course.stretches[-1].end == inf
    for a, b in zip(course.stretches[:-1], course.stretches[1:], strict=True):
        assert a.end == b.start
    if course.period is not None:
        x = max(course.repeats_from, 0.0) + np.linspace(1e-3, 0.9, 50)
        np.testing.assert_allclose(course.value(x + course.period), course.value(x), atol=1e-9 * course.height)


@pytest.mark.parametrize("name", LAWS)
def test_slope_and_curvature_are_the_derivatives(name):
    for stretch in SAMPLES[name].course(RADIUS).stretches:
        start, end = max(stretch.start, 0.0), min(stretch.end, 0.5)
        if end <= start:
            continue
        step = 1e-4 * (end - start)
        x = np.linspace(start + 10 * step, end - 10 * step, 38)  # not on the knots of a spline

        def slope(f, x=x, step=step):
            return (8 * (f(x + step) - f(x - step)) - f(x + 2 * step) + f(x - 2 * step)) / (12 * step)

        steepest = np.abs(stretch.slope(x)).max() + 1e-12
        sharpest = np.abs(stretch.curvature(x)).max() + 1e-9
        np.testing.assert_allclose(stretch.slope(x), slope(stretch.value), atol=1e-6 * steepest + 1e-12)
        np.testing.assert_allclose(stretch.curvature(x), slope(stretch.slope), atol=1e-6 * sharpest + 1e-6)
