"""Filters of forces: gain 1/√2 at the cut-off, no phase, 24 dB per octave; SciPy; readings that no end changes."""

import warnings

import numpy as np
import pytest
from scipy.signal import butter, freqz_sos, sosfilt

import wheeltapper as wt
from wheeltapper.record.assessment.filtering import (
    REMAINS,
    checked_filter,
    low_passed,
    note_of_ends,
    readings,
    settling_time,
    sliding_mean,
)
from wheeltapper.record.simulate import ModelWarning

RATE = 10e3


def gain(cutoff, order, frequency):
    """Return the filter's complex gain, from a long wave away from the ends."""
    time = np.arange(int(RATE)) / RATE
    wave = np.exp(2j * np.pi * frequency * time)
    passed = low_passed(wave.real, RATE, cutoff, order) + 1j * low_passed(wave.imag, RATE, cutoff, order)
    middle = slice(len(time) // 4, -len(time) // 4)
    return np.mean(passed[middle] / wave[middle])


@pytest.mark.parametrize("order", [2, 4, 8])
@pytest.mark.parametrize("cutoff", [20.0, 90.0, 500.0])
def test_three_decibels_are_lost_at_the_cutoff_and_no_phase(order, cutoff):
    found = gain(cutoff, order, cutoff)
    assert found.real == pytest.approx(0.5**0.5, rel=1e-6)
    assert abs(found.imag) < 1e-6


@pytest.mark.parametrize("frequency", [20.0, 60.0, 180.0, 360.0])
def test_the_gain_is_that_of_the_order(frequency):
    tangents = np.tan(np.pi * np.array([frequency, 90.0]) / RATE)  # of the bilinear transform
    expected = 1.0 / (1.0 + (2.0**0.5 - 1.0) * (tangents[0] / tangents[1]) ** 4)
    assert gain(90.0, 4, frequency).real == pytest.approx(expected, rel=1e-6)
    if frequency == 360.0:  # two octaves: 48 dB but what the corner costs
        assert 20 * np.log10(gain(90.0, 4, 360.0).real / gain(90.0, 4, 180.0).real) == pytest.approx(-24.0, abs=1.3)


def test_a_constant_passes_from_end_to_end():
    np.testing.assert_allclose(low_passed(np.full(700, 3.0), RATE, 20.0), 3.0, rtol=1e-9)


@pytest.mark.parametrize(("cutoff", "order"), [(20.0, 4), (90.0, 4), (20.0, 2), (90.0, 8)])
def test_far_from_the_ends_it_is_scipys_filter_there_and_back(cutoff, order):
    """By hand: SciPy's sections forwards, then backwards, over samples with a second of silence on either side."""
    burst = np.random.default_rng(5).standard_normal(3000)
    samples = np.concatenate([np.zeros(int(RATE)), burst, np.zeros(int(RATE))])
    lost_twice = 1.0 / np.sqrt(np.sqrt(2.0) - 1.0)  # over each pass |H|² = 1/√2 at the cut-off
    corner = np.arctan(np.tan(np.pi * cutoff / RATE) * lost_twice ** (2.0 / order)) * RATE / np.pi
    sections = butter(order // 2, corner, fs=RATE, output="sos")
    assert abs(freqz_sos(sections, [cutoff], fs=RATE)[1][0]) ** 2 == pytest.approx(0.5**0.5, rel=1e-9)
    expected = sosfilt(sections, sosfilt(sections, samples)[::-1])[::-1]
    for at_rest in (True, False):
        found = low_passed(samples, RATE, cutoff, order, at_rest=at_rest)
        np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("order", [2, 4, 8, 12])
@pytest.mark.parametrize("cutoff", [20.0, 90.0])
def test_what_is_farther_away_than_the_settling_time_weighs_little(cutoff, order):
    pulse = np.zeros(2 * int(RATE) + 1)
    pulse[len(pulse) // 2] = 1.0
    weights = low_passed(pulse, RATE, cutoff, order)  # a corner of 1.4 % of the rate is warped by 0.2 %
    assert weights.sum() == pytest.approx(1.0, rel=1e-6)
    beyond = weights[len(pulse) // 2 + int(np.ceil(settling_time(cutoff, order) * RATE)) :]
    assert REMAINS / 4.0 < np.abs(beyond).sum() < 1.03 * REMAINS  # of what follows, whatever it is
    if order == 4:
        assert settling_time(cutoff) * cutoff == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("cutoff", [20.0, 90.0])
def test_readings_do_not_depend_on_what_follows_the_end_nor_on_what_was_before_it(cutoff):
    """A record cut out of a longer one, against the same filter over all of it."""
    rng, steps = np.random.default_rng(6), int(RATE)
    whole = np.cumsum(rng.choice([-1.0, 1.0], 4 * steps) * (rng.random(4 * steps) < 0.01))
    expected = low_passed(whole, RATE, cutoff)[2 * steps : 3 * steps]
    samples = whole[2 * steps : 3 * steps]
    read = readings(low_passed(samples, RATE, cutoff), RATE, cutoff, at_rest=False)
    known = np.isfinite(read)
    unknown = int(np.ceil(settling_time(cutoff) * RATE))
    assert known.sum() == steps - 2 * unknown
    far = np.abs(whole - samples.mean()).max()
    assert np.abs(read - expected)[known].max() < 2.0 * REMAINS * far
    still = np.concatenate([np.full(steps, whole[0]), whole[:steps]])  # it was at rest before
    begun = readings(low_passed(whole[:steps], RATE, cutoff, at_rest=True), RATE, cutoff)
    settled = low_passed(still, RATE, cutoff)[steps:-unknown]
    np.testing.assert_allclose(begun[:-unknown], settled, atol=2.0 * REMAINS * far)
    assert abs(begun[0] - settled[0]) < 1e-4 * far
    assert np.isnan(begun[-unknown:]).all()


@pytest.mark.parametrize(
    ("seconds", "pulse", "said", "doubtful"),
    [
        (0.04, None, "nothing is left", True),
        (1.0, 0.98, "larger values may be there", True),
        (1.0, 0.5, "", False),
        (1.0, None, "", False),
    ],
)
def test_what_is_not_read_is_said(seconds, pulse, said, doubtful):
    samples = np.full((int(seconds * RATE), 2), 50e3)
    if pulse is not None:
        samples[round(pulse * RATE) :][:20, 1] += 400e3
    filtered = low_passed(samples, RATE, 20.0, at_rest=True)
    note = note_of_ends(filtered, readings(filtered, RATE, 20.0), 20.0)
    assert note.startswith("forces below 20 Hz are not read in the last 0.05 s of the run")
    assert said in note
    assert (":" in note) == bool(said)
    assert note.doubtful == doubtful


WHEELSET = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4)
TWO = wt.vehicles.Wheelsets(wheelsets=(WHEELSET, WHEELSET), positions=(0.0, -2.4))
BOGIE = wt.vehicles.Bogie(**wt.vehicles.Bogie.example)
FLAT = wt.WheelFlat(length="40 mm", position=1.0)
ENDS = 0.05 + 2.0 * np.pi * 0.46 / 20.0 + np.linspace(-3e-3, 38e-3, 10)
"""s: from just before the flat's second strike to 38 ms after it: with a period of 20 Hz to settle it is never read."""


@pytest.mark.parametrize(
    ("vehicle", "irregularity"),
    [(WHEELSET, FLAT), (TWO, {"wheelset 1": FLAT}), (BOGIE, {"wheelset 1": FLAT})],
    ids=["wheelset", "two wheelsets", "bogie"],
)
@pytest.mark.slow
def test_a_strike_is_read_alike_wherever_the_run_ends_behind_it(vehicle, irregularity):
    scene = wt.Scenario(
        vehicle=vehicle, contact=wt.Hertz(constant=1.405e11), irregularity=irregularity, speed=20.0, duration=1.0
    )
    found, told = [], []
    for end in ENDS:
        record = wt.simulate(scene.replaced({"duration": float(end)}))
        static = record.static_forces
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelWarning)  # of the second strike
            slow, unloaded = wt.features.filtered_force()(record), wt.features.wheel_unloading()(record)
        rule = wt.limits.Rule("own", "dynamic_ratio", 9.0, "warning", low_pass=20.0)
        check = wt.limits.check(record, [rule])
        found.append([*np.atleast_1d(slow / static), *np.atleast_1d(unloaded), check["own"].value])
        told.append([slow.attrs["note"], *check.notes])
    found = np.array(found)
    assert found.max() > 1.002
    # what follows weighs REMAINS; over the settling time its mean is the static force within a tenth
    np.testing.assert_allclose(found, np.tile(found[0], (len(ENDS), 1)), atol=0.1 * REMAINS)
    assert all(any("not read in the last 0.05 s" in note for note in notes) for notes in told)


def test_a_sliding_mean_is_missing_only_where_a_sample_of_its_window_is():
    line = np.arange(9.0)
    line[4] = np.nan
    np.testing.assert_array_equal(np.isnan(sliding_mean(line, 3)), [False, False, True, True, True, False, False])
    np.testing.assert_allclose(sliding_mean(line, 3)[-2:], [6.0, 7.0])


def test_a_sliding_mean_of_a_straight_line_is_its_middle():
    line = np.stack([np.arange(50.0), 2.0 * np.arange(50.0)], axis=1)
    np.testing.assert_allclose(sliding_mean(line, 5), line[2:-2], rtol=1e-12)


@pytest.mark.parametrize(
    ("cutoff", "order", "part"),
    [
        ("90 m", 4, "frequency"),
        (0.0, 4, "more than 0"),
        (90.0, 3, "even"),
        (1e-300, 4, r"at least 0.01 Hz"),
        (90.0, 0, "whole number"),
        (90.0, "4", "4"),
    ],
)
def test_a_filter_that_is_none_is_refused(cutoff, order, part):
    with pytest.raises(wt.InputError, match=part):
        checked_filter(cutoff, order)
