"""Measured data: the smoothing keeps to its noise, and the measured wheel flat runs end to end from its TOML files."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import courses_of, lower

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NOISE = 1e-5


@pytest.fixture(scope="module")
def scan():
    return wt.Scenario.from_toml(EXAMPLES / "measured_flat.toml").irregularities[0]


def test_the_residual_is_the_stated_noise(scan):
    arc, deviation = scan.samples
    smooth = scan.course(0.49).value(arc + scan.position)
    assert np.sqrt(np.mean((smooth - deviation) ** 2)) == pytest.approx(NOISE, rel=2e-3)


def test_where_nothing_was_measured_the_wheel_stays_round(scan):
    turn = 2 * np.pi * 0.49  # the scan covers 0.240 to 0.398 m of arc
    for margin, limit in ((0.05, 1e-6), (0.2, 1e-8), (0.5, 1e-11)):
        arc = np.linspace(0.398 + margin, turn + 0.240 - margin, 5000)
        assert np.abs(scan.course(0.49).value(arc + scan.position)).max() < limit


def test_the_ring_is_closed_smoothly(scan):
    course = scan.course(0.49)
    seam = course.stretches[1].start
    for which, scale in (("value", 1e-3), ("slope", 0.1), ("curvature", 10.0)):
        before, behind = getattr(course, which)(np.array([seam + course.period - 1e-12, seam + course.period]))
        assert abs(behind - before) < 1e-9 * scale


def test_a_straight_line_is_left_alone():
    x = np.linspace(0.0, 1.0, 50)
    course = wt.Measured(positions=tuple(x), heights=tuple(1e-3 * x), noise=1e-6, beyond="flat").course(0.46)
    np.testing.assert_allclose(course.value(np.linspace(0, 1, 99)), 1e-3 * np.linspace(0, 1, 99), rtol=0, atol=1e-7)


@pytest.mark.parametrize("speed", [5.0, 15.0, 30.0])
@pytest.mark.parametrize("file", ["measured_flat.toml", "measured_flat_deck.toml"])
def test_the_measured_flat_runs_from_its_file(file, speed):
    scene = wt.Scenario.from_toml(EXAMPLES / file).replaced({"speed": speed, "duration": 3.0 / speed})
    record = wt.simulate(scene)
    assert record.outcome.name == "COMPLETED"
    energies = [abs(float(value)) for name, value in record.energy.items() if name != "imbalance"]
    assert abs(float(record.energy.imbalance)) < 1e-9 * max(energies)
    history = record.history()
    assert float(history.normal_force.min()) == 0.0
    assert float(history.normal_force.max()) > 5 * record.static_force
    path = history.constraint.values
    assert path.min() == pytest.approx(-1.12e-3, abs=2e-5)  # the flat is 1.14 mm deep; the wheel bridges its bottom
    level = history.time.values * speed < 0.2 + 0.24 - 0.11  # where the wheel does not reach the scanned part yet
    assert np.abs(path[level]).max() < 2e-6


@pytest.mark.slow
def test_its_path_is_the_maximum_over_all_contacts(scan):
    scene = wt.Scenario.from_toml(EXAMPLES / "measured_flat.toml")
    (course,) = courses_of(scene)
    table = lower(scene).table
    for x in np.random.default_rng(3).uniform(0.4, 0.65, 40):
        u = np.linspace(-0.08, 0.08, 400_001)
        best = u[np.argmax(course.value(x + u) - u**2 / (0.49 + np.sqrt(0.49**2 - u**2)))]
        fine = best + np.linspace(-4e-7, 4e-7, 201)
        height = (course.value(x + fine) - fine**2 / (0.49 + np.sqrt(0.49**2 - fine**2))).max()
        assert table.height_at(np.array([x]))[0] == pytest.approx(height, abs=1e-14)


@pytest.fixture(scope="module")
def across():
    spec = importlib.util.spec_from_file_location("flat_across_the_tread", EXAMPLES / "flat_across_the_tread.py")
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(EXAMPLES.parent)
        patch.setattr("sys.argv", ["flat_across_the_tread.py"])
        spec.loader.exec_module(module)
    return module


def test_the_line_that_a_60e1_feels_is_derived_from_the_surface(scan, across):
    np.testing.assert_allclose(scan.samples[1], across.line, rtol=0, atol=6e-8)
    np.testing.assert_allclose(scan.samples[0], 0.49 * across.angles, rtol=0, atol=1e-6)


def flat_head(y):
    """Return a rail of three arcs that touch, R 300, 60 and 12.792 mm, with chords of 16 mm; mm."""
    radii, joints = (300.0, 60.0, 12.792), (15.9924, 31.5730)
    y, centre = np.abs(np.asarray(y, dtype=float)), np.array([0.0, -radii[0]])
    z = np.full_like(y, np.nan)
    for radius, follows, begin, end in zip(radii, (*radii[1:], 0.0), (0.0, *joints), (*joints, 40.35), strict=True):
        here = (y >= begin) & (y <= end)
        z[here] = centre[1] + np.sqrt(radius**2 - (y[here] - centre[0]) ** 2)
        joint = np.array([end, centre[1] + np.sqrt(radius**2 - (end - centre[0]) ** 2)])
        centre = joint + (centre - joint) * follows / radius
    return z


def test_the_flat_on_another_rail_is_where_contact_has_the_unloaded_wheel(across):
    # Published with the program CONTACT, case "chalmers_flat_fz125": heights of the wheelset that touches without
    # force, mm, at pitch angles of -35 to -40 degrees, and beside the flat.
    heights = np.array([0.7889, 0.8893, 0.9380, 0.9316, 0.8803, 0.6609]) - 0.2647
    line = across.felt(across.across, across.deviations, rail=flat_head, inclination=0.020)
    fine = np.linspace(0.2, 0.45, 5001)
    felt = np.interp(fine, 0.49 * across.angles, line)
    for degrees, height in zip(range(35, 41), heights, strict=True):
        u = fine - 0.49 * np.deg2rad(degrees)
        stands = (np.sqrt(0.49**2 - u**2) - 0.49 + felt).max()
        assert -1e3 * stands == pytest.approx(height, abs=0.02)
