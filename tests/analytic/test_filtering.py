"""Filters of forces, against the response that is asked for: gain 1/√2 at the cut-off, no phase, 24 dB per octave."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.record.filtering import checked_filter, low_passed, sliding_mean

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


def test_a_sliding_mean_of_a_straight_line_is_its_middle():
    line = np.stack([np.arange(50.0), 2.0 * np.arange(50.0)], axis=1)
    np.testing.assert_allclose(sliding_mean(line, 5), line[2:-2], rtol=1e-12)


@pytest.mark.parametrize(
    ("cutoff", "order", "part"),
    [("90 m", 4, "frequency"), (0.0, 4, "more than 0"), (90.0, 3, "even"), (90.0, 0, "whole number"), (90.0, "4", "4")],
)
def test_a_filter_that_is_none_is_refused(cutoff, order, part):
    with pytest.raises(wt.InputError, match=part):
        checked_filter(cutoff, order)
