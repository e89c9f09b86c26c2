"""The rolling circle against reference values and against brute force."""

from math import sqrt

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import courses_of, lower
from wheeltapper.lower.paths import surface

from ..cases import reference

R = 0.46


X = np.linspace(0.0, 1.1, 551)
ROUGH = wt.Measured(positions=X, heights=1e-4 * np.sin(31 * X) + 2e-6 * np.random.default_rng(3).standard_normal(551))


def scene(*irregularity, speed=1.0, duration=1.0):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, radius=R),
        contact=wt.Hertz(constant=1.405e11),
        irregularity=list(irregularity),
        speed=speed,
        duration=duration,
    )


def brute_force(scenario, x0):
    courses = courses_of(scenario)
    borders = np.array([s.start for course in courses for s in course.stretches if abs(s.start - x0) < 0.04])
    x = np.concatenate([x0 + np.linspace(-0.04, 0.04, 160_001), borders, np.nextafter(borders, -1.0)])
    u = x - x0
    drop = -(u**2) / (R + np.sqrt(R**2 - u**2))
    return max(sum(course.value(x) for course in courses) + drop)


def test_reference_points_of_the_sine():
    for row in reference()["static"]["constraint"]["rows"]:
        if "a" not in row:
            continue
        a, wavelength, x0 = float(row["a"]), float(row["lam"]), float(row["x0"])
        far = x0 + 8 * wavelength  # away from the corner where the corrugation begins
        table = lower(scene(wt.Corrugation(amplitude=a, wavelength=wavelength, start=0.0)), "strict").table
        assert table.height_at(np.array([far]))[0] == pytest.approx(float(row["yCk_minus_R"]), abs=2e-13 * a + 1e-18)


def test_reference_points_of_steps_and_flat():
    shapes = {"step up": wt.Step(height=1e-4, position=0.5), "step do": wt.Step(height=-1e-4, position=0.5)}
    rows = [row for row in reference()["static"]["constraint"]["rows"] if "profile" in row and "a" not in row]
    assert len(rows) == 5
    for row in rows:
        shape = shapes.get(row["profile"][:7], wt.WheelFlat(depth=1e-4, position=0.5))
        height = lower(scene(shape), "strict").table.height_at(np.array([0.5 + float(row["x0"])]))[0]
        assert height == pytest.approx(float(row["yCk_minus_R"]), abs=1e-16)


@pytest.mark.parametrize("height", [1e-4, -1e-4])
def test_a_step_is_an_arc(height):
    x = np.linspace(0.0, 0.1, 4001)
    X = x - 0.05
    L = sqrt(2 * R * 1e-4 - 1e-8)
    arc = -(X**2) / (R + np.sqrt(R**2 - X**2))
    up = np.where(-L > X, 0.0, np.where(X < 0, 1e-4 + arc, 1e-4))
    down = np.where(X < 0, 0.0, np.where(L > X, arc, -1e-4))
    table = lower(scene(wt.Step(height=height, position=0.05)), "strict").table
    assert np.abs(table.height_at(x) - (up if height > 0 else down)).max() < 1e-17


def test_a_step_up_mirrored_in_time_is_a_step_down():
    x = np.linspace(0.0, 0.1, 2001)
    up = lower(scene(wt.Step(height=1e-4, position=0.05)), "strict").table
    down = lower(scene(wt.Step(height=-1e-4, position=0.05)), "strict").table
    assert np.abs(up.height_at(x) - 1e-4 - down.height_at(0.1 - x)).max() < 1e-17


def test_a_fresh_flat_pivots_on_its_edges_and_returns_every_revolution():
    turn = 2 * np.pi * R
    table = lower(scene(wt.WheelFlat(depth=1e-4, position=0.05), duration=9.0), "strict").table
    L = sqrt(2 * R * 1e-4 - 1e-8)
    X = np.linspace(-0.02, 0.02, 2001)
    pivot = np.where(np.abs(X) < L, np.sqrt(R**2 - np.maximum(L - np.abs(X), 0) ** 2) - R, 0.0)
    for revolution in range(3):
        assert np.abs(table.height_at(0.05 + revolution * turn + X) - pivot).max() < 1e-15


@pytest.mark.slow
@pytest.mark.few(4)
@pytest.mark.parametrize(
    "irregularity",
    [
        (wt.Corrugation(amplitude=5e-5, wavelength=0.025, start=0.01),),
        (wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.01),),
        (wt.CosineBump(height=-2e-4, length=0.03, start=0.05),),
        (
            wt.WheelFlat(length=0.03, position=0.2, shape="rounded"),
            wt.Corrugation(amplitude=2e-5, wavelength=0.1, start=0.0),
        ),
        (wt.WheelFlat(depth=1e-4, position=0.2), wt.Step(height=1e-4, position=0.205)),
        (wt.OutOfRound(orders=(1, 6), amplitudes=(1e-4, 5e-5)),),
        (wt.Repeated(of=wt.CosineBump(height=-1e-4, length=0.04, start=0.3), period=0.1), ROUGH),
        (wt.Step(height=3e-4, position=0.3), wt.WheelFlat(length=0.04, position=0.3, shape="rounded"), ROUGH),
        (wt.Profile(function=lambda x: 1e-4 * np.sin(25 * x) - 3e-4 * np.abs(x - 0.3), breakpoints=(0.3,)),),
    ],
)
def test_the_path_is_the_maximum_over_all_contacts(irregularity):
    scenario = scene(*irregularity)
    table = lower(scenario).table
    for x0 in np.random.default_rng(3).uniform(0.0, 0.99, 25):
        assert table.height_at(np.array([x0]))[0] == pytest.approx(brute_force(scenario, x0), abs=2e-13)


@pytest.mark.parametrize("curvature", [False, True])
@pytest.mark.parametrize(
    "irregularity",
    [
        (wt.CosineBump(height=2e-4, length=0.05, start=0.009), wt.WheelFlat(length=0.04, position=0.4)),
        (wt.WheelFlat(length=0.06, position=0.03, shape="rounded"), wt.CosineBump(height=3e-4, length=0.05, start=0.0)),
        (wt.OutOfRound(orders=(9,), amplitudes=(1e-4,)), wt.WheelFlat(length=0.05, position=0.6423)),
        (
            wt.Repeated(of=wt.CosineBump(height=1e-4, length=0.05, start=0.1), period=0.2),
            wt.Step(height=1e-4, position=0.5),
        ),
    ],
)
def test_kernel_and_numpy_lower_the_same_path(irregularity, curvature, monkeypatch):
    """Waves and chords are known to the kernel; as mere functions they go the way of all others."""
    scenario = scene(*irregularity).replaced({"contact": wt.Hertz(constant=1.405e11, curvature=curvature)})
    x = np.sort(np.random.default_rng(5).uniform(0.0, 0.99, 400))
    by_kernel = lower(scenario).table
    monkeypatch.setattr(surface, "_kernel_terms", lambda present: None)
    by_numpy = lower(scenario).table
    np.testing.assert_allclose(by_kernel.height_at(x), by_numpy.height_at(x), rtol=0, atol=1e-16)
    np.testing.assert_allclose(by_kernel.factor_at(x), by_numpy.factor_at(x), rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("over", [-1e-12, 1e-12, 1e-6, 2.6e-4, 1e-2])
def test_a_bump_whose_foot_is_as_hollow_as_the_wheel_is_round(over):
    """There the wheel touches ground and bump at places that hardly differ."""
    bump = wt.CosineBump(height=(1.0 + over) * 0.05**2 / (2.0 * np.pi**2 * R), length=0.05, start=0.009)
    scenario = scene(bump, duration=3.25)
    for method in ("default", "strict"):
        table = lower(scenario, method).table
        for x0 in [*np.random.default_rng(4).uniform(0.0, 0.07, 10), 0.009, 0.059]:
            assert table.height_at(np.array([x0]))[0] == pytest.approx(brute_force(scenario, x0), abs=2e-13)


def test_a_contact_at_two_points_is_a_kink_and_is_said():
    scenario = scene(wt.Corrugation(amplitude=5e-5, wavelength=0.0301, start=0.0), speed=0.1)
    assert any("two points" in note for note in lower(scenario).notes)
    wider = scene(wt.Corrugation(amplitude=-5e-5, wavelength=0.0302, start=0.0), speed=0.1)  # critical: 30.133 mm
    assert not any("two points" in note for note in lower(wider).notes)


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), (wt.Step(height=3e-4, position=0.3),), (wt.WheelFlat(depth=3e-4, position=0.2),)])
@pytest.mark.parametrize("curvature", [False, True])
def test_a_rough_profile_with_a_hollow_at_every_sample_conserves_energy(more, curvature):
    """Hollows hardly sharper than the wheel: two-point contact beside the place where a contact would cease to be."""
    rough = scene(ROUGH, *more, speed=5.0, duration=0.1)
    rough = rough.replaced({"contact": wt.Hertz(constant=1.405e11, curvature=curvature)})
    records = [wt.simulate(rough, method) for method in ("default", "strict")]
    for record in records:
        assert abs(float(record.energy.relative_imbalance)) < 1e-9
    time = np.linspace(0.0, 0.03, 300)
    forces = [record.at(time).normal_force.values for record in records]
    np.testing.assert_allclose(*forces, rtol=0, atol=1e-7 * forces[1].max())


def test_curvatures_from_differences_do_not_break_a_path_into_dust():
    """A chord nearly as hollow as the wheel, under a function of which curvatures are known to some digits only."""
    bent = wt.Profile(function=lambda x: 1e-4 * np.sin(25 * x) + 3e-4 * np.abs(x - 0.3), breakpoints=(0.3,))
    both = scene(bent, wt.WheelFlat(depth=1e-3, position=0.3, repeat=False), speed=5.0, duration=0.1)
    assert len(lower(both.replaced({"contact": wt.Hertz(constant=9e10, curvature=True)})).program.pieces) < 200
