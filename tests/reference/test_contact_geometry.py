"""Smooth contact geometry of S1002 on 60E1 1:40 against a rigid search and an elastic program."""

import numpy as np
import pytest

from tests.cases import rows
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import s1002
from wheeltapper.lower.laws.geometry import contact_geometry, radius_difference, resting_roll

SMOOTH = contact_geometry(s1002, rail_60e1)


def test_with_five_micrometres_it_is_the_elastic_programs_geometry():
    elastic = {0.5: 0.397, 1.0: 0.604, 2.0: 0.797, 3.0: 0.989, 4.0: 1.230}  # CONTACT, case, 10 kN
    for shift, expected in elastic.items():
        assert 1e3 * radius_difference(SMOOTH, 1e-3 * shift) == pytest.approx(expected, rel=0.01)
    without_roll = [
        1e3 * (SMOOTH.table_at("radius", y) - SMOOTH.table_at("radius", -y)) for y in (5e-4, 1e-3, 2e-3, 3e-3)
    ]
    np.testing.assert_allclose(without_roll, [0.392, 0.601, 0.790, 0.975], atol=1.5e-3)


def test_with_little_smoothing_it_is_the_rigid_geometry():
    rigid = contact_geometry(s1002, rail_60e1, smoothing=2e-7, shifts=np.linspace(-5e-3, 5e-3, 401))
    compared = 0
    for row in rows("rolling_radii_s1002_60e1.csv"):
        shift = float(row["dy_mm"])
        if not 0.5 <= shift <= 4.0:  # there the rigid contact jumps
            continue
        compared += 1
        assert 1e3 * radius_difference(rigid, 1e-3 * shift) == pytest.approx(float(row["delta_r_mm"]), rel=0.007)
        assert resting_roll(rigid, 1e-3 * shift, 0.46) == pytest.approx(float(row["roll_rad"]), rel=0.01)
    assert compared >= 10


def test_the_tables_belong_together():
    # The envelope theorem: the wheel rises with the mean slope of its profile where it touches.
    shift, lift, radius = SMOOTH.shift, SMOOTH.lift, SMOOTH.radius
    assert SMOOTH.table_at("lift", 0.0) == pytest.approx(0.0, abs=1e-15)
    step = 1e-6
    for u in (-3e-3, -1e-3, 1e-3, 3e-3):
        near = contact_geometry(s1002, rail_60e1, shifts=np.array([u - step, u, u + step]))
        slope = (near.lift[2] - near.lift[0]) / (2 * step)
        place = near.place[1] - 0.75 - u  # of the mean place on the wheel; its profile bends little about it
        profile = 1e-3 * (s1002(np.array([1e3 * place + 1e-3])) - s1002(np.array([1e3 * place - 1e-3])))[0] / 2e-6
        assert slope == pytest.approx(-profile, abs=6e-3)
    assert (np.diff(radius[shift > 0]) < 0).all() or (np.diff(radius[shift > 0]) > 0).all()
    assert (SMOOTH.curvature > 0).all()
    assert np.isfinite(lift).all()


@pytest.mark.parametrize("gauge", [1.432, 1.435, 1.440])
def test_a_wider_gauge_is_a_shift_of_both_wheels(gauge):
    wide = contact_geometry(s1002, rail_60e1, gauge=gauge, shifts=np.array([-1e-3, 0.0, 1e-3]))
    moved = contact_geometry(s1002, rail_60e1, shifts=np.array([-1e-3, 0.0, 1e-3]) - 0.5 * (gauge - 1.435))
    np.testing.assert_allclose(wide.radius, moved.radius, rtol=0, atol=2e-8)
    np.testing.assert_allclose(wide.curvature, moved.curvature, rtol=1e-3)
