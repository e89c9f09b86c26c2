"""A user's function as an irregularity: what jumps unsaid or is no height is refused in one line."""

import math

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.lower.paths import fit

VEHICLE = wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=2e4, radius=0.46)


def run_over(function, **changes):
    common = {"contact": wt.Hertz(constant=1.405e11), "speed": 10.0, "duration": 0.04}
    options = {"breakpoints": changes.pop("breakpoints", ()), "start": changes.pop("start", None)}
    return wt.Scenario(vehicle=VEHICLE, irregularity=wt.Profile(function=function, **options), **(common | changes))


@pytest.mark.parametrize("rolling", ["circle", "point"])
def test_a_jump_that_is_not_declared_is_refused_with_its_place(rolling):
    with pytest.raises(wt.InputError, match=r"jumps by 1 mm at x = 0\.3 m; .*breakpoints=\[0\.3\]") as told:
        lower(run_over(lambda x: np.where(x > 0.3, 1e-3, 0), rolling=rolling))
    assert "\n" not in str(told.value)


def test_a_declared_jump_is_followed():
    assert (
        len(lower(run_over(lambda x: np.where(x > 0.3, 1e-3, 0), breakpoints=(0.3,), rolling="point")).table.rows) == 2
    )


@pytest.mark.parametrize("width", [1e-3, 1e-4])
def test_a_steep_rise_that_is_smooth_is_followed_and_found_in_few_pieces(width):
    table = lower(run_over(lambda x: 1e-4 * np.tanh((x - 0.2) / width), rolling="point"), "strict").table
    assert len(table.rows) < 1000
    x = np.linspace(0.15, 0.25, 4001)
    assert np.abs(table.height_at(x) - 1e-4 * np.tanh((x - 0.2) / width)).max() < 1e-15


def test_a_kink_that_is_not_declared_is_followed_and_told():
    lowered = lower(run_over(lambda x: -1e-3 * np.abs(x - 0.3), rolling="point"))
    assert abs(float(lowered.table.height_at(np.array([0.3]))[0])) < 1e-11
    assert any("not smooth at x = 0.3 m" in note for note in lowered.notes)


def test_a_narrow_hump_far_from_everything_sets_the_scale_of_its_own_run():
    table = lower(run_over(lambda x: 1e-4 * np.exp(-(((x - 0.2) / 0.01) ** 2)))).table
    assert len(table.rows) < 200


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda x: np.where(x > 0.2, np.nan, 0.0), "is nan at x = "),
        (lambda x: 1j * x, "returns"),
        (lambda x: np.zeros((2, 2)), "shape"),
        (lambda x: "high", "returns"),
        (lambda x: 1.0 / 0, "ZeroDivisionError"),
        (lambda x: math.inf, "is inf at x = "),
    ],
)
def test_what_is_no_height_is_refused_in_one_line(function, words):
    with pytest.raises(wt.InputError, match=words) as told:
        wt.simulate(run_over(function))
    assert "\n" not in str(told.value)
    assert "function" in str(told.value)


def test_what_no_pieces_can_follow_is_refused(monkeypatch):
    monkeypatch.setattr(fit, "MOST_PIECES", 500)
    with pytest.raises(wt.InputError, match="500 pieces cannot follow"):
        lower(run_over(lambda x: 1e-6 * np.sin(1e5 * x), rolling="point"))
