"""Against 30-digit truth (mpmath extrapolation, cross-checked by DOP853)."""

import numpy as np
import pytest

import wheeltapper as wt

from ..cases import NAMES, numbers, reference, scenario

LIMITS = {"default": (1e-11, 1e-9), "strict": (1e-13, 1e-11)}


@pytest.mark.parametrize("method", LIMITS)
@pytest.mark.parametrize("name", NAMES)
def test_events_and_peaks_reach_the_reference_digits(name, method):
    case = reference()["dynamic"][name]
    record = wt.simulate(scenario(case), method)
    time_limit, force_limit = LIMITS[method]
    assert list(record.events.kind.values) == ["loss" if e["type"] == "release" else "impact" for e in case["events"]]
    assert np.abs(record.events.time.values - numbers(case["events"], "t")).max() < time_limit
    rates = numbers(case["events"], "delta_dot")
    np.testing.assert_allclose(record.events.indentation_rate, rates, rtol=1e-8 if method == "default" else 1e-11)
    smooth = record.peaks.isel(peak=~record.peaks.corner.values)
    np.testing.assert_allclose(smooth.normal_force, numbers(case["force_peaks"], "N"), rtol=force_limit)
    assert np.abs(smooth.time.values - numbers(case["force_peaks"], "t")).max() < 1e-8


@pytest.mark.parametrize("name", NAMES)
def test_intervals_and_ratios_of_impacts(name):
    derived = reference()["dynamic"][name]["derived"]
    impacts = wt.simulate(scenario(reference()["dynamic"][name]), "strict").impacts
    np.testing.assert_allclose(impacts.interval.values[:-1], [float(v) for v in derived["Delta_t"]], rtol=1e-10)
    ratios = [float(v) for v in derived["r_N"] if v is not None]
    np.testing.assert_allclose(impacts.force_ratio.values[: len(ratios)], ratios, rtol=1e-9)


def test_dense_output_at_given_times():
    case = reference()["dynamic"]["sine_V9"]
    record = wt.simulate(scenario(case), "strict")
    for time, sample in case["samples"].items():
        at = record.at(float(time))
        assert at.wheel_displacement.item() == pytest.approx(float(sample["y"]), rel=1e-11)
        assert at.wheel_velocity.item() == pytest.approx(float(sample["v"]), rel=1e-10)
        assert at.normal_force.item() == pytest.approx(float(sample["N"]), rel=1e-10)


def test_static_indentation_and_force():
    for row in reference()["static"]["static_linear"]["rows"]:
        scene = wt.Scenario(
            vehicle=wt.Wheelset(mass=float(row["m"]), load=float(row["P"]), stiffness=float(row["k"])),
            contact=wt.Hertz(constant=float(row["C"])),
            speed=0.0,
            duration=1e-3,
        )
        record = wt.simulate(scene)
        assert record.static_force == pytest.approx(float(row["N0"]), rel=1e-14)
        assert record.at(0.0).indentation.item() == pytest.approx(float(row["delta0"]), rel=1e-14)
