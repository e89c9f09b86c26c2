"""Wheel and rail profiles against the figures of their definitions."""

import tomllib

import numpy as np
import pytest

from tests.cases import DATA
from wheeltapper.describe.profile import rail_60e1 as rail
from wheeltapper.describe.profile import s1002 as wheel
from wheeltapper.describe.profile.en13674 import arc_centres


def test_the_wheel_profile_has_the_heights_and_slopes_of_its_definition():
    z = wheel.s1002(np.array([0.0, 60.0, -55.0]))
    np.testing.assert_allclose(z, [0.0, -2.63568, 28.0], atol=1e-5)
    step = 1e-5
    slope = np.diff(wheel.s1002(np.array([-step, step])))[0] / (2 * step)
    assert slope == pytest.approx(-0.03358537, abs=1e-8)
    flank = np.diff(wheel.s1002(np.array([-39.5, -38.6])))[0] / 0.9
    assert np.degrees(np.arctan(abs(flank))) == pytest.approx(70.0, abs=0.01)
    assert np.isnan(wheel.s1002(np.array([-70.1, 60.1]))).all()


def test_the_wheel_profile_joins_itself():
    joints = [begin for begin, *_ in (*wheel.POLYNOMIALS, *wheel.ARCS) if begin < 60.0]
    assert len(joints) == 7
    for joint in joints:
        beside = wheel.s1002(np.array([joint - 1e-9, joint + 1e-9]))
        assert abs(beside[1] - beside[0]) < 1.2e-4


@pytest.mark.parametrize("variant", ["public", "drawing"])
def test_the_rail_head_has_the_joints_and_centres_of_its_definition(variant):
    expected = tomllib.loads((DATA / "rail_60e1.toml").read_text(encoding="utf-8"))[variant]
    centres = arc_centres(rail.RADII, rail.JOINTS[variant])
    np.testing.assert_allclose(centres[1], expected["arc80_centre"], atol=2e-5)
    np.testing.assert_allclose(centres[2], expected["arc13_centre"], atol=2e-5)
    y, z = expected["side_start"]
    assert rail.rail_60e1(np.array([y]), variant)[0] == pytest.approx(z, abs=4e-4)  # the side is steep


def test_the_two_readings_of_the_rail_head_differ_by_little():
    y = np.linspace(-35.0, 35.0, 7001)
    public, drawing = rail.rail_60e1(y), rail.rail_60e1(y, "drawing")
    np.testing.assert_allclose(public, public[::-1], atol=1e-12)
    assert np.abs(public - drawing).max() == pytest.approx(0.040, abs=1e-3)
    assert np.diff(public[y > 0]).max() < 0
