"""Profiles of the standards by name: their pieces meet and touch, and have the widths and slopes that are known."""

import csv
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.profile import en13674
from wheeltapper.describe.profile.named import NAMED
from wheeltapper.describe.profile.rail_60e1 import rail_60e1

FINE = np.arange(-75.0, 75.0, 1e-3)
WIDTHS = {"49E1": 67.0, "54E1": 70.0, "EN 13674 60E1": 72.0, "60E2": 72.0, "50E2": 72.0, "27E1": 50.0, "33E1": 58.0}
"""Widths of heads where their sides begin, mm."""


def known(kind, name):
    z = NAMED[kind][name](FINE)
    there = np.isfinite(z)
    assert np.diff(np.flatnonzero(there)).max() == 1, name  # one piece
    return FINE[there], z[there]


def test_each_rail_of_the_standard_is_there_and_its_arcs_end_at_its_sides():
    with (Path(en13674.__file__).with_suffix(".csv")).open(encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if not row[0].startswith("#")]
    assert len(rows) == 40
    for row in rows[1:]:
        name = "EN 13674 60E1" if row[0] == "60E1" else row[0]
        y, z = known("rail", name)
        np.testing.assert_allclose(z, z[::-1], atol=5e-3 / max(float(row[9]), 1e-3) * 1.01)  # both sides
        half = float(row[10])
        slopes = np.diff(z[(y > 0.0) & (y < half - 0.01)]) * 1e3
        assert (np.diff(slopes) < 1e-6).all(), name  # it only bends down: no kink between arcs that touch
        if name in WIDTHS:
            assert 2.0 * half == pytest.approx(WIDTHS[name], abs=0.02)


def test_the_rail_in_use_and_that_of_the_standard_are_nearly_alike():
    y = np.linspace(-34.0, 34.0, 1001)
    apart = rail_60e1(y) - NAMED["rail"]["EN 13674 60E1"](y)
    assert 0.01 < np.abs(apart).max() < 0.05
    np.testing.assert_array_equal(rail_60e1(y, "drawing"), NAMED["rail"]["EN 13674 60E1"](y))


@pytest.mark.parametrize("name", [name for name in NAMED["wheel"] if name.startswith(("EN 13715", "APTA"))])
def test_pieces_of_wheels_meet_and_touch(name):
    y, z = known("wheel", name)
    assert y[0] == pytest.approx(-70.0, abs=1e-3)
    assert float(NAMED["wheel"][name](np.array([0.0]))[0]) == pytest.approx(0.0, abs=5e-4)
    within = (y > -60.0) & (y < 50.0)
    steps = np.diff(z[within])
    assert np.abs(np.diff(steps)).max() < 0.02  # no gap between pieces, of 20 µm
    flange = z[y < -40.0].max()
    if name.startswith("EN 13715"):
        thickness = 32.5 if " e" not in name else float(name.rsplit(" e", 1)[1])
        assert flange == pytest.approx(28.0, abs=0.2)
        assert np.interp(-10.0, -z[(y > -50.0) & (y < -30.0)], y[(y > -50.0) & (y < -30.0)]) == pytest.approx(
            thickness - 70.0, abs=0.03  # 10 mm above the datum
        )  # fmt: skip
        flank = (z > 12.5) & (z < 15.0) & (y > -50.0)
        assert np.degrees(np.arctan(-np.diff(z[flank]).min() * 1e3)) == pytest.approx(70.0, abs=0.1)


@pytest.mark.parametrize(("wheel", "slope"), [("APTA 320", 1 / 20), ("APTA 340", 1 / 40), ("EN 13715 1:40", 1 / 40)])
def test_cones_have_their_conicity(wheel, slope):
    z = NAMED["wheel"][wheel](np.array([0.0, 5.0]))
    assert (z[0] - z[1]) / 5.0 == pytest.approx(slope, rel=0.03)
    profiles = wt.profiles.WheelRail(wheel=wheel, rail="60E2", inclination=0.025 if slope < 0.03 else 0.05)
    found = wt.profiles.conicity(profiles)
    assert float(found.equivalent_conicity.sel(amplitude=2e-3, method="nearest")) == pytest.approx(slope, rel=0.1)


def test_a_wrong_name_lists_those_there_are():
    with pytest.raises(ValueError, match=r"'54E1'.*'60E2'"):
        wt.profiles.conicity(wt.profiles.WheelRail(rail="61E1"))
