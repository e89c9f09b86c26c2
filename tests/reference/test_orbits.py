"""Orbits, special points, analytic limits and an exponent against values that another program has checked."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import wheeltapper as wt
from tests.cases import orbit_cases

CASES = {case["id"]: case for case in orbit_cases()}
ORBITS = [name for name, case in CASES.items() if case["kind"] == "orbit"]
WAVELENGTH, NAMES = 0.05, ("displacement", "velocity")
AMPLITUDE = "irregularity.0.amplitude"


def scene(speed=5.0, amplitude=5e-5, rolling="point", damping=2e4, stiffness=2.44e6):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=stiffness, damping=damping, radius=0.46),
        contact=wt.Hertz(constant=1.405e11), rolling=rolling, speed=speed, duration=1.0,
        irregularity=wt.Corrugation(amplitude=amplitude, wavelength=WAVELENGTH, start=0.0),
    )  # fmt: skip


def start_of(case):
    return {"displacement": case["start_displacement_m"], "velocity": case["start_velocity_m_per_s"]}


def same_state(found, case, relative):
    """Compare states, relative to the scales of both entries."""
    scales = np.array([8.289e-5, 0.0777])
    np.testing.assert_allclose(
        found / scales, np.array([*start_of(case).values()]) / scales, rtol=relative, atol=relative
    )


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("name", ORBITS)
def test_an_orbit_is_that_of_the_other_program(name, method):
    case = CASES[name]
    speed = case["scenario"]["speed_m_per_s"]
    orbit = wt.orbits.find(scene(speed), case["wavelengths"], start_of(case), method=method)
    allowed = case["tolerance"]
    same_state([orbit.start[entry] for entry in NAMES], case, allowed["state_relative"])
    expected = np.array([complex(*pair) for pair in case["multipliers"]])
    np.testing.assert_allclose(
        np.sort_complex(orbit.multipliers), np.sort_complex(expected), atol=allowed["multiplier"]
    )
    assert orbit.closure <= 1e-12
    assert abs(orbit.determinant_error) <= (1e-8 if method == "default" else 1e-12)
    assert orbit.stable == case["stable"]
    assert orbit.losses == case["losses_per_orbit"]
    assert orbit.waves == case["wavelengths"]
    ratio = orbit.largest_force / orbit.record.static_force
    assert ratio == pytest.approx(case["largest_force_over_static"], rel=allowed["largest_force"])


@pytest.mark.parametrize("name", ORBITS)
def test_both_methods_find_the_same_orbit(name):
    case = CASES[name]
    both = [
        wt.orbits.find(scene(case["scenario"]["speed_m_per_s"]), case["wavelengths"], start_of(case), method=method)
        for method in ("default", "strict")
    ]
    states = np.array([[orbit.start[entry] for entry in NAMES] for orbit in both]) / [8.289e-5, 0.0777]
    assert np.abs(states[0] - states[1]).max() < 1e-9


def test_period_three_is_reached_from_rest():
    case = CASES["O4 period three at 9 m/s"]
    orbit = wt.orbits.find(scene(9.0), 3)
    assert orbit.multipliers.sum().real == pytest.approx(case["trace"], abs=1e-7)
    assert orbit.stable
    assert orbit.losses == 1


@cache
def main_branch():
    return wt.orbits.follow(wt.orbits.find(scene(5.0)), {"speed": (1.0, 60.0)})


def special(branch, kind, near):
    """Return the special point of a kind nearest to a value: its parameter and state."""
    chosen = np.flatnonzero(branch.kind.values == kind)
    i = chosen[np.argmin(np.abs(branch.parameter.values[chosen] - near))]
    return float(branch.parameter[i]), np.array([float(branch[f"special_{name}"][i]) for name in NAMES])


def check_special(branch, name):
    case = CASES[name]
    kind = {"period doubling": "doubling"}.get(case["kind"], case["kind"])
    value, state = special(branch, kind, case["value"])
    assert value == pytest.approx(case["value"], rel=case["tolerance"]["value_relative"])
    if "state_relative" in case["tolerance"]:
        same_state(state, case, case["tolerance"]["state_relative"])


@pytest.mark.slow
def test_the_main_branch_has_these_special_points_and_no_others():
    kinds = ["fold", "fold", "grazing", "fold", "fold", "doubling", "grazing", "doubling"]
    branch = main_branch()
    assert branch.kind.values.tolist() == kinds
    np.testing.assert_allclose(branch.parameter[:2], [4.4414418, 4.4407160], rtol=1e-7)  # the superharmonic folds
    np.testing.assert_allclose(branch.parameter[-2:], [15.0137038, 19.1223990], rtol=1e-7)
    assert branch.speed.values[[0, -1]] == pytest.approx([1.0, 60.0], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["O6 upper fold (jump up)", "O7 lower fold (bouncing dies)", "O8 first period doubling",
     "O9 first loss on the calm branch"],
)  # fmt: skip
def test_a_special_point_of_the_main_branch_is_that_of_the_other_program(name):
    check_special(main_branch(), name)


def test_the_upper_fold_at_half_the_amplitude_is_that_of_the_other_program():
    orbit = wt.orbits.find(scene(6.0, 2.5e-5))
    check_special(wt.orbits.follow(orbit, {"speed": (5.0, 9.0)}), "O10 upper fold, a 25 um")


def test_the_amplitudes_of_loss_and_doubling_at_9_m_s_are_those_of_the_other_program():
    branch = wt.orbits.follow(wt.orbits.find(scene(9.0)), {AMPLITUDE: (2e-6, 8e-5)})
    check_special(branch, "O graze amplitude at 9 m/s")
    check_special(branch, "O pd amplitude at 9 m/s")


@pytest.mark.slow
def test_the_bounce_in_two_waves_begins_and_doubles_where_the_other_program_says():
    case = CASES["O lower fold, one bounce in 2 waves"]
    orbit = wt.orbits.find(scene(case["value"] * 1.005), 2, start_of(case))
    branch = wt.orbits.follow(orbit, {"speed": (4.0, 13.0)})
    check_special(branch, "O lower fold, one bounce in 2 waves")
    check_special(branch, "O period doubling of the period-2 bounce")


def test_the_fold_under_a_rolling_circle_is_that_of_the_other_program():
    orbit = wt.orbits.find(scene(6.0, rolling="circle"))
    check_special(wt.orbits.follow(orbit, {"speed": (5.0, 7.0)}), "O rolling circle: fold near 6.656 m/s")


def conservative(zeta):
    """Return a wheel without suspension but for its damper, and the angular frequency of its linear contact."""
    mass, static, constant = 1500.0, 91_307.0 + 1500 * 9.81, 1.405e11
    indentation = (static / constant) ** (2 / 3)
    frequency = np.sqrt(1.5 * static / (mass * indentation))
    return scene(damping=2 * zeta * mass * frequency, stiffness=0.0), frequency, indentation


def first_special(kind, scenario, speed, low, high):
    orbit = wt.orbits.find(scenario.replaced({"speed": speed, AMPLITUDE: low}), method="strict")
    branch = wt.orbits.follow(orbit, {AMPLITUDE: (low, high)})
    return float(branch.parameter[branch.kind == kind][0])


def grazing_amplitude(ratio):
    """Return the amplitude that just loses contact at a frequency ratio, over δ0·ζ, for ζ = 0.001."""
    scenario, frequency, indentation = conservative(1e-3)
    unit = 1e-3 * indentation
    speed = ratio * frequency * WAVELENGTH / (2 * np.pi)
    return first_special("grazing", scenario, speed, 0.5 * unit, 40 * unit) / unit


def test_contact_is_lost_at_resonance_as_the_energy_balance_says():
    case = CASES["O analytic: first loss at resonance"]
    ratio = case["at_omega_over_omega0"]
    found = grazing_amplitude(ratio)
    assert found == pytest.approx(case["value"], rel=case["tolerance"]["value_relative_at_zeta_0_001"])
    force = (
        1.5 * ratio**2 * found
    )  # in the indentation, the path is a force m·a·ω²; this one over the static force and ζ
    assert force == pytest.approx(2.659567, rel=1e-5)


@pytest.mark.parametrize(
    ("ratio", "zeta", "kind", "expected"),
    [(0.9, 0.01, "fold", 0.128948), (0.9, 0.05, "fold", 0.156042), (0.9, 0.10, "grazing", 0.231717),
     (0.5, 0.01, "grazing", 2.70405), (0.5, 0.05, "grazing", 2.24872), (0.5, 0.10, "grazing", 2.17368),
     (2.0, 0.05, "grazing", 0.690)],
)  # fmt: skip
def test_contact_is_lost_or_the_orbit_ends_at_these_amplitudes_below_and_above_resonance(ratio, zeta, kind, expected):
    scenario, frequency, indentation = conservative(zeta)
    speed = ratio * frequency * WAVELENGTH / (2 * np.pi)
    found = first_special(kind, scenario, speed, 0.3 * expected * indentation, 1.1 * expected * indentation)
    digits = 1e-5 if ratio < 1.0 else 2e-3  # as many as the source has
    assert found / indentation == pytest.approx(expected, rel=digits)


@pytest.mark.slow
def test_no_frequency_near_resonance_loses_contact_at_a_smaller_amplitude():
    case = CASES["O analytic: first loss at resonance"]
    centre = case["at_omega_over_omega0"]
    bounds = centre - 3e-4, centre + 3e-4
    found = minimize_scalar(grazing_amplitude, bounds=bounds, method="bounded", options={"xatol": 1e-7})
    assert found.fun == pytest.approx(case["computed"]["zeta 0.001"], rel=1e-7)
    assert found.x == pytest.approx(centre, rel=1e-5)


def test_a_path_at_twice_the_resonance_doubles_the_period_at_six_times_the_damping_ratio():
    case = CASES["O analytic: parametric threshold"]
    scenario, frequency, indentation = conservative(5e-3)
    speed = 2 * frequency * WAVELENGTH / (2 * np.pi)
    unit = 5e-3 * indentation
    found = first_special("doubling", scenario, speed, 4 * unit, 7 * unit) / unit
    assert found == pytest.approx(case["value"], rel=case["tolerance"]["value_relative_at_zeta_0_005"])
    assert found == pytest.approx(case["computed"]["zeta 0.005"], rel=1e-8)
