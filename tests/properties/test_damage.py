"""Samples that a sensor, its logger or another event has spoilt: they are left out, said, and hide no fault."""

from dataclasses import replace

import numpy as np
import pytest

import wheeltapper as wt
from tests import passages
from wheeltapper.diagnosis import Recording
from wheeltapper.diagnosis.inference.damage import spikes_in, stuck_in, without_damage

from .test_identification import site as identified_site
from .test_trigger import ENDS, measured, site

EXACT = {"irregularity.0.start": 1.5, "track.start": 0.3, "track.length": 5.0}
PERIOD = 5.56e-3
"""Contact period, s."""
SIGMA = passages.Sensor().spread
FIRST = 0.25
"""Behind the bump, s."""


def recording_of(fault, seed, spoil=None):
    """Return a recording of the second program, spoilt by a function of its times and samples."""
    _, size, clean, _ = measured(fault, seed, trigger=0.0)
    samples = clean.samples if spoil is None else spoil(clean.times, clean.samples.copy())
    return Recording(samples, clean.rate, clipped=clean.clipped, speed=clean.speed), size


def spiked(times, samples):
    random = np.random.default_rng(3)
    places = random.choice(len(samples) // 10, 12, replace=False) * 10 + 4
    samples[places] += random.choice([-1.0, 1.0], 12) * random.uniform(3.0, 40.0, 12)
    return samples


def stuck(times, samples):
    samples[(times >= FIRST) & (times < FIRST + 0.015)] = 0.0
    return samples


def gapped(times, samples):
    samples[(times >= FIRST) & (times < FIRST + 0.015)] = np.nan
    return samples


def knocked(times, samples):
    """Something knocks at the sensor: it rings for a while."""
    after = times - FIRST
    return samples + np.where(after >= 0.0, 20.0 * np.sin(2e3 * after) * np.exp(-after / 4e-3), 0.0)


@pytest.mark.parametrize("fault", ["healthy", "wheel flat", "lost damper"])
@pytest.mark.parametrize(
    "sensor",
    [
        passages.Sensor(),
        passages.Sensor(rate=2e3),  # its spikes and impacts last as many samples
        *(pytest.param(passages.Sensor(rate=rate), marks=pytest.mark.slow) for rate in (1e4, 4e3, 500.0)),
        pytest.param(passages.Sensor(noise=1e-5), marks=pytest.mark.slow),
    ],
)
def test_no_impact_entry_or_exit_is_taken_for_damage(fault, sensor):
    random = np.random.default_rng([5, len(fault)])
    truth, _, _ = passages.drawn(ENDS, fault, random)
    found = passages.recorded(truth, sensor, 5.3 / truth.speed + 0.05, random)
    recording = Recording(found.samples, found.rate, clipped=found.clipped)
    assert without_damage(recording, sensor.spread, PERIOD) is recording


def test_spikes_are_found_where_they_are():
    clean, _ = recording_of("wheel flat", 1)
    samples = clean.samples.copy()
    samples[[3000, 5000, 5001, 7000, 7003]] += [1.0, -30.0, -20.0, 40.0, 30.0]
    assert np.flatnonzero(spikes_in(samples, SIGMA)).tolist() == [3000, 5000, 5001, 7000, 7001, 7002, 7003]


@pytest.mark.parametrize("length", [1, 8, 20])
def test_short_recordings_have_no_spikes(length):
    assert not spikes_in(np.arange(length) % 2 * 1e3, 1.0).any()


def test_noise_that_repeats_a_value_is_not_stuck():
    random = np.random.default_rng(2)
    coarse = Recording(np.round(random.standard_normal(20_000)), 1e4)  # a step of one deviation: 28 % repeat
    assert not stuck_in(coarse).any()
    fine = np.round(random.standard_normal(20_000), 2)
    assert not stuck_in(Recording(fine, 1e4)).any()
    fine[500:520] = fine[500]
    assert np.flatnonzero(stuck_in(Recording(fine, 1e4))).tolist() == list(range(500, 520))
    clipped = np.arange(20_000) // 20 == 25
    assert not stuck_in(Recording(fine, 1e4, clipped=clipped)).any()


def test_too_much_damage_is_taken_for_what_was_measured():
    samples = np.random.default_rng(1).standard_normal(2000)
    samples[::50] = 100.0
    recording = Recording(samples, 1e4)
    assert spikes_in(samples, 1.0).sum() == 39  # the first has no neighbours before it
    assert without_damage(recording, 1.0, 0.01) is recording


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("fault", "spoil", "said"),
    [
        ("healthy", spiked, "12 samples are left out: spikes"),
        ("broken spring", stuck, "stuck at one value, 250.0 to 265.0 ms"),
        pytest.param("wheel flat", spiked, "12 samples are left out: spikes", marks=pytest.mark.slow),
        pytest.param("wheel flat", gapped, "", marks=pytest.mark.slow),
        pytest.param("lost damper", stuck, "stuck at one value", marks=pytest.mark.slow),
        pytest.param("healthy", knocked, "are left out: no model explains them", marks=pytest.mark.slow),
        pytest.param("wheel flat", knocked, "are left out: no model explains them", marks=pytest.mark.slow),
        pytest.param("lost damper", knocked, "are left out: no model explains them", marks=pytest.mark.slow),
    ],
)
@pytest.mark.slow
def test_damage_hides_no_fault(fault, spoil, said):
    recording, size = recording_of(fault, 1, spoil)
    found = wt.diagnose(recording, site(0.0, **EXACT), progress=False)
    assert found.verdict == fault
    assert found.reduced < 1.1
    assert any(said in note for note in found.notes) or not said
    if fault == "wheel flat":
        assert found.size == pytest.approx(size, abs=1e-4)
        assert found.interval[0] < found.size < found.interval[1]


def test_identify_leaves_spikes_out_too():
    here = identified_site()
    (whole,) = wt.synthesise(here, 1, seed=3)
    broken = replace(whole, samples=spiked(whole.times, whole.samples.copy()))
    first, second = (wt.diagnosis.identify(one, here, progress=False) for one in (broken, whole))
    assert first["vehicle.mass"] == pytest.approx(second["vehicle.mass"], rel=1e-3)
    assert first.reduced < 1.1
