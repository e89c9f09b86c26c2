"""Parameters of a passage from its recording: their errors against the bound, their intervals, clipping and gaps."""

from dataclasses import replace

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.sensor import Sensor
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis import identify
from wheeltapper.diagnosis.force.reconstruction import noise_of
from wheeltapper.diagnosis.inference.estimate import onset, priors_of
from wheeltapper.diagnosis.inference.fitting import covariance_of, departure_sample, fit_over_windows, fit_window
from wheeltapper.diagnosis.inference.problem import FitProblem
from wheeltapper.diagnosis.site.synthetic import synthesise

UNKNOWN = ("vehicle.mass", "vehicle.damping")
KNOWN = {"speed": 0.01, "vehicle.load": 0.05, "vehicle.stiffness": 0.2}
LEVELS = {
    "calibrated": (KNOWN, (0.001, 0.003)),
    "h and C": (KNOWN | {"contact.constant": 0.05, "irregularity.0.height": 0.05}, (0.025, 0.03)),
    "all": (
        KNOWN | {"contact.constant": 0.1, "irregularity.0.height": 0.05, "track.mass": 0.01, "track.stiffness": 0.05,
                 "track.damping": 0.2, "vehicle.radius": 0.04},
        (0.04, 0.04),
    ),
}  # fmt: skip
RATE, SIGMA = 20e3, 0.0666
"""Hz, and 1 % of the acceleration's rms in the first 0.2 s, m/s²."""


def site(level="calibrated", **changes):
    passage = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.Hertz(constant=1.405e11),
        track=wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4),
        irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
        speed=9.0,
        duration=0.2111,
    )
    sensor = Sensor(rate=RATE, noise=SIGMA / np.sqrt(RATE / 2), **changes)
    return Site(passage=passage, sensor=sensor, uncertainty=LEVELS[level][0])


def bound(recording, where):
    """Return the least standard deviations of ln m and ln c, with the priors, at the truth."""
    truth = recording.truth["scenario"]
    problem = FitProblem(recording, where.sensor, SIGMA, truth, priors_of(where, UNKNOWN))
    jacobian = problem.jacobian(np.zeros(len(problem.paths)), len(recording.samples), SIGMA)
    return np.sqrt(np.diag(covariance_of(jacobian)))[:2]


def measured(level, count, seed):
    """Return errors of ln m and ln c over the bound, errors, whether intervals cover, and the estimates."""
    where = site(level)
    ratios, errors, covered, found = [], [], [], []
    for recording in synthesise(where, count, seed=seed):
        estimate = identify(recording, where)
        error = np.array([np.log(estimate["vehicle.mass"] / 1500), np.log(estimate["vehicle.damping"] / 5e4)])
        errors.append(error)
        ratios.append(error / bound(recording, where))
        for path, truth in zip(UNKNOWN, (1500.0, 5e4), strict=True):
            low, high = estimate.interval(path)
            covered.append(low < truth < high)
        found.append(estimate)
    return np.array(ratios), np.array(errors), np.mean(covered), found


@pytest.mark.slow
@pytest.mark.parametrize("level", ["calibrated", "h and C"])
def test_a_recording_tells_mass_and_damping_as_well_as_it_can(level):
    ratios, errors, _, found = measured(level, 3, seed=1)
    assert all(estimate.converged for estimate in found)
    assert np.all(np.abs(ratios) < 4.0)
    assert np.all(np.sqrt((errors**2).mean(axis=0)) < LEVELS[level][1])
    for estimate in found:
        assert estimate.reduced == pytest.approx(1.0, abs=0.1)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("level", sorted(LEVELS))
def test_errors_are_at_the_bound_and_intervals_cover(level):
    ratios, errors, covered, found = measured(level, 10, seed=2)
    rms = np.sqrt((errors**2).mean(axis=0))
    assert np.all(rms < LEVELS[level][1])
    assert np.all(np.sqrt((ratios**2).mean(axis=0)) < 1.6)  # ten of them scatter by 22 %
    assert covered > 0.75
    assert np.mean([estimate.converged for estimate in found]) > 0.98


def test_clipped_samples_are_bounds_and_missing_ones_left_out():
    where = site(range="20 m/s^2", bits=16)
    (recording,) = synthesise(where, 1, seed=3)
    assert 20 < recording.clipped.sum() < 1000
    clipped = identify(recording, where)
    assert clipped["vehicle.mass"] == pytest.approx(1500, rel=2e-3)
    assert clipped.converged
    ignored = identify(replace(recording, clipped=np.zeros(len(recording.samples), dtype=bool)), where)
    assert ignored.reduced > 5 * clipped.reduced
    gappy = replace(recording, samples=np.where(np.arange(len(recording.samples)) % 7 == 0, np.nan, recording.samples))
    assert identify(gappy, where)["vehicle.mass"] == pytest.approx(1500, rel=2e-3)


def test_recordings_are_reproducible_and_say_what_was_drawn():
    where = site("all")
    few, many = synthesise(where, 2, seed=4), synthesise(where, 3, seed=4)
    for one, other in zip(few, many, strict=False):
        np.testing.assert_array_equal(one.samples, other.samples)
    assert set(where.uncertainty) < set(few[0].truth)
    assert few[0].truth["speed"] != few[1].truth["speed"]
    plain, filtered = site(), site(cutoff=8e3)
    (one,), (other,) = (synthesise(w, 1, seed=4, vary=False, noise=0.0) for w in (plain, filtered))
    assert 1e-3 < np.abs(one.samples - other.samples).max() < 0.5 * np.abs(one.samples).max()
    assert onset(one, SIGMA) == pytest.approx(0.001, abs=5e-4)
    (noisy,) = synthesise(plain, 1, seed=4, vary=False)
    assert noise_of(noisy, Sensor(rate=RATE)) == pytest.approx(SIGMA, rel=0.1)


def test_a_broken_spring_is_seen_from_any_start():
    where = site("h and C")
    (recording,) = synthesise(where, 1, changes={"vehicle.mass": 2170.0, "vehicle.load": 91_307 - 670 * 9.81}, seed=6)
    found = identify(recording, where, start={"vehicle.mass": 2170.0})
    assert found["vehicle.mass"] == pytest.approx(2170, rel=0.06)
    assert found.reduced == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_fit_that_says_it_has_converged_stands_in_the_minimum(seed):
    """Heights, contact constant and mass lie in a narrow valley, in which damped steps are small everywhere."""
    where = site("all")
    (recording,) = synthesise(where, seed=seed)
    spread = noise_of(recording, where.sensor)
    problem = FitProblem(recording, where.sensor, spread, where.passage, priors_of(where, UNKNOWN))
    fit = fit_over_windows(problem, onset(recording, spread))
    assert fit.converged
    again = FitProblem(recording, where.sensor, spread, fit.scenario, priors_of(where, UNKNOWN))
    at = np.zeros(len(again.paths))
    for _ in range(3):
        at, _ = fit_window(again, at, len(recording.samples), spread, steps=30)
    assert np.all(np.abs(at) < 0.1 * np.sqrt(np.diag(fit.covariance)))


def test_a_model_departs_where_a_difference_is_more_than_noise():
    off = np.random.default_rng(1).normal(0.0, 0.1, 4000)
    assert departure_sample(off, 0.1, 20, 500) == 4000
    off[2500:] += 1.0
    assert departure_sample(off, 0.1, 20, 500) == 2500
    assert departure_sample(off, 0.1, 20, 3000) == 3000
    off[1000] += 3.0  # one sample alone, of thirty deviations: over a millisecond that is much, too
    assert departure_sample(off, 0.1, 20, 500) == 1000
    assert departure_sample(np.zeros(5), 0.1, 20, 0) == 5
