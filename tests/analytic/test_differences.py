"""Derivatives by differences, against functions whose derivatives are known."""

import numpy as np
import pytest

from wheeltapper.ask.differences import slope_at
from wheeltapper.ground.errors import InputError


def of(function, at):
    return slope_at(lambda x: np.array([function(x)]), np.array([function(at)]), at)


@pytest.mark.parametrize(
    ("function", "derivative", "at"),
    [
        (np.exp, np.exp, 1.0),
        (lambda x: np.sin(5.0 * x), lambda x: 5.0 * np.cos(5.0 * x), -3.0),
        (lambda x: x**1.5, lambda x: 1.5 * x**0.5, 2e6),
        (lambda x: 1.0 / (1.0 + x * x), lambda x: -2.0 * x / (1.0 + x * x) ** 2, 0.1),
        (lambda x: 7.0, lambda x: 0.0, 2.0),
        (lambda x: 3.0 + np.tanh(1e-6 * x), lambda x: 1e-6, 0.0),
        (lambda x: 3.0 + np.tanh(1e6 * x), lambda x: 1e6, 0.0),
    ],
)
def test_smooth_functions_are_differentiated_to_the_error_that_is_told(function, derivative, at):
    found = of(function, at)
    wrong = abs(float(found.value[0]) - derivative(at))
    assert wrong <= 1e-8 * abs(derivative(at))
    assert wrong <= float(found.error[0])
    assert not found.at_corner[0]


def test_values_that_scatter_have_an_error_that_says_so():
    rough = np.random.default_rng(1)
    for scatter in (1e-10, 1e-7, 1e-5):
        found = of(lambda x, size=scatter: np.exp(x) * (1.0 + size * rough.standard_normal()), 1.0)
        wrong = abs(float(found.value[0]) / np.e - 1.0)
        assert wrong < 1e3 * scatter
        assert wrong <= 5.0 * float(found.error[0]) / np.e < 1e4 * scatter


@pytest.mark.parametrize("function", [abs, lambda x: 2.0 + max(x, 3.0 * x), lambda x: np.sin(x) + 1e-3 * abs(x)])
@pytest.mark.parametrize("at", [0.0, 0.7, 250.0])
def test_a_corner_has_no_derivative(function, at):
    found = of(lambda x: function(x - at), at)
    assert np.isnan(found.value[0])
    assert found.at_corner[0]


def test_a_corner_beside_does_not_matter():
    found = of(lambda x: np.exp(x) + max(x - 1.01, 0.0), 1.0)
    assert found.value[0] == pytest.approx(np.e, rel=1e-8)


def test_a_number_that_cannot_be_negative_is_differentiated_on_one_side():
    def function(x):
        if x < 0.0:
            raise InputError("", "x", str(x), "no negative number")
        return np.exp(-3.0 * x)

    found = of(function, 0.0)
    assert found.value[0] == pytest.approx(-3.0, rel=1e-7)
    assert abs(found.value[0] + 3.0) <= found.error[0]


def test_where_the_same_never_happens_on_both_sides_there_is_no_derivative():
    found = slope_at(lambda x: None if x > 1.0 else np.array([x]), np.array([1.0]), 1.0)
    assert np.isnan(found.value[0])
    assert np.isnan(found.error[0])
    assert not found.at_corner[0]


def test_steps_become_small_enough_that_the_same_happens():
    found = slope_at(lambda x: None if abs(x - 1.0) > 1e-5 else np.array([np.exp(x)]), np.array([np.e]), 1.0)
    assert found.value[0] == pytest.approx(np.e, rel=1e-7)


def test_a_number_that_cannot_be_changed_says_why():
    def stubborn(x):
        raise InputError("", "speed", f"{x:g} m/s", "0 m/s")

    for at in (0.0, 3.0):
        found = slope_at(stubborn, np.array([1.0]), at)
        assert np.isnan(found.value).all()
        assert found.refusal.endswith("allowed: 0 m/s")
    assert slope_at(lambda x: None, np.array([1.0]), 3.0).refusal == ""
