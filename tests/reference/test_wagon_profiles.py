"""Wheels on rails: what lies beyond the tables, rails that stand upright, gauges in which no wheelset fits."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import s1002
from wheeltapper.lower.laws.geometry import contact_geometry, radius_difference


def scene(**profiles):
    return wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(), creep=wt.creep.Polach(friction=0.35),
        profiles=wt.profiles.WheelRail(**profiles), speed=20.0, duration=0.02,
    )  # fmt: skip


def test_a_radius_difference_beyond_the_flange_is_refused():
    tables = contact_geometry(s1002, rail_60e1)
    assert radius_difference(tables, 5e-3) > 0.0
    for shift in (8e-3, -20e-3):
        with pytest.raises(wt.InputError, match=r"shift: found -?\d.* mm, where a flange .* -6 to 6 mm"):
            radius_difference(tables, shift)


@pytest.mark.slow
def test_wheels_run_on_rails_that_stand_upright():
    upright = scene(inclination=0)
    record = wt.simulate(upright)
    history = record.at([0.01])
    np.testing.assert_allclose(history.normal_force, record.static_force, rtol=2e-3)
    np.testing.assert_allclose(history.lateral_shift, 0.0, atol=1e-6)
    flat, tilted = (contact_geometry(s1002, rail_60e1, inclination=inclination) for inclination in (0.0, 1e-6))
    assert radius_difference(flat, 1e-3) == pytest.approx(radius_difference(tilted, 1e-3), rel=1e-3)


@pytest.mark.slow
@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("profiles", "field"),
    [
        ({"gauge": 1.4}, "gauge"),
        ({"gauge": 1.435, "flange_backs": 1.41}, "gauge"),
        ({"gauge": 0.3, "flange_backs": 0.25}, "gauge"),
        ({"gauge": 1.47}, "profiles"),
        ({"gauge": 1.435, "flange_backs": 1.32}, "profiles"),
        ({"gauge": 1e-3}, "gauge"),
        ({"inclination": 1e9}, "inclination"),
        ({"smoothing": 1e-9}, "smoothing"),
    ],
)
def test_rails_on_which_no_wheelset_runs_are_refused_by_name(profiles, field):
    with pytest.raises(ValueError, match=field):
        wt.simulate(scene(**profiles))
