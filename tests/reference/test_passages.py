"""Passages over a deck against a second program that integrates them in time (tests/passages.py)."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

import wheeltapper as wt
from tests import passages
from tests.passages import GRID, STEP, Passage, Sensor, Wheelset, Wrongs, acceleration, drawn, faulty, recorded, shown

NOISE = Sensor().spread
TIMES = np.arange(6001) / 20e3
STATED = Passage(deck_start=0.3, deck_length=2.0, bump_start=0.8)


def with_fault(fault, size, place=0.0, stated=STATED, **changes):
    return replace(stated, wheelset=faulty(stated.wheelset, fault, size, place), **changes)


CASES = {
    "healthy": STATED,
    "endless": Passage(),
    "spring": with_fault("broken spring", 670.0),
    "damper": with_fault("lost damper", 0.2),
    "play": with_fault("free play", 5e-5, 0.3),
    "wide play": with_fault("free play", 1.2e-4, -0.9),
    "bush": with_fault("soft bush", 1e7),
    "flat": with_fault("wheel flat", 0.04, 0.7),
    "long flat": with_fault("wheel flat", 0.08, 1.1, speed=6.0),
    "flat in the train": with_fault("wheel flat", 0.025, 0.95),
    "dip": replace(STATED, bump_height=-1e-4, speed=11.0),
    "steep bump": replace(STATED, bump_height=4e-4, bump_length=0.04, speed=5.0),
}
"""Passages on which both programs solve the same equations."""


def scenario(passage, end):
    """Return the passage as one of the package."""
    wheel, deck = passage.wheelset, {}
    if np.isfinite(passage.deck_start):
        deck = {"start": passage.deck_start, "length": passage.deck_length}
    rail = [wt.CosineBump(height=passage.bump_height, length=passage.bump_length, start=passage.bump_start)]
    if wheel.flat:
        rail.append(wt.WheelFlat(length=wheel.flat, position=wheel.flat_position))
    if wheel.amplitude:
        rail.append(wt.OutOfRound(orders=(wheel.order,), amplitudes=(wheel.amplitude,), position=wheel.round_position))
    return wt.Scenario(
        vehicle=wt.Wheelset(
            mass=wheel.mass, load=wheel.load, stiffness=wheel.stiffness, damping=wheel.damping, radius=wheel.radius,
            damper_play=wheel.play, damper_play_start=wheel.play_start,
            bush_stiffness=wheel.bush if np.isfinite(wheel.bush) else None,
        ),
        track=wt.FloatingDeck(
            mass=passage.deck_mass, stiffness=passage.deck_stiffness, damping=passage.deck_damping, **deck
        ),
        contact=wt.Hertz(constant=passage.constant),
        irregularity=rail, speed=passage.speed, duration=end,
    )  # fmt: skip


def off(passage, times=TIMES):
    """Return the rms of the difference between the programs over the example's noise, and the largest difference."""
    own = acceleration(passage, times)
    record = wt.simulate(scenario(passage, float(times[-1])))
    away = (own - record.at(times).deck_acceleration.values) / NOISE
    return np.sqrt(np.mean(away**2)), np.abs(away).max()


def test_the_defaults_are_the_numbers_of_the_example():
    site = wt.load("examples/site.toml")
    stated, end = scenario(Passage(), 0.4), site.passage.duration
    assert stated.replaced({"duration": end}) == site.passage
    sensor = Sensor()
    assert (
        wt.diagnosis.Sensor(rate=sensor.rate, noise=sensor.noise, range=sensor.range, bits=sensor.bits) == site.sensor
    )


@pytest.mark.parametrize("name", CASES)
def test_two_programs_agree_on_a_passage(name):
    rms, largest = off(CASES[name])
    assert rms < 1e-3
    assert largest < 1e-2


@pytest.mark.few(3)
@pytest.mark.slow
@pytest.mark.parametrize(
    "fault", ["healthy", "broken spring", "lost damper", "mass deviation", "free play", "soft bush", "wheel flat"]
)
def test_two_programs_agree_on_drawn_passages(fault):
    stated = Passage(deck_start=0.3, deck_length=5.0, bump_start=1.5)
    for seed in range(6):
        passage, _, place = drawn(stated, fault, np.random.default_rng([seed]))
        rms, _ = off(passage, np.arange(0.0, 5.4 / passage.speed, 5e-5))
        over_the_bump = fault == "wheel flat" and abs(place - 1.525) < 0.1
        assert rms < (0.4 if over_the_bump else 2e-3)


@pytest.mark.parametrize("name", ["healthy", "play", "bush", "flat", "long flat"])
@pytest.mark.slow
def test_the_second_program_has_converged(name):
    rough = acceleration(CASES[name], TIMES)
    fine = acceleration(CASES[name], TIMES, STEP / 2, GRID / 2, passages.ANGLE / 2)
    assert np.sqrt(np.mean((rough - fine) ** 2)) < 1e-3 * NOISE


@pytest.mark.parametrize(
    ("passage", "most"),
    [
        (with_fault("out of round", 1e-4, 1.0, Passage()), 1.0),  # a larger radius rolls further off its lowest point
        (with_fault("wheel flat", 0.04, 0.03, Passage()), 0.4),  # the flat rolls over the crest of the bump
    ],
)
def test_the_unrolled_wheel_is_one_to_second_order_in_the_slope(passage, most):
    """The package unrolls the wheel, so that points ahead of the lowest one are in the place of their arc."""
    assert 1e-2 < off(passage)[0] < most


def test_two_wheelsets_move_one_deck():
    """Each has its own static force, under which the deck rests at zero."""
    follower = Wheelset(ahead=-1.5)
    passage = Passage(neighbours=(follower,), bump_start=0.3)
    site = wt.load("examples/site.toml")
    moved = site.passage.replaced({"irregularity.0.start": 0.3, "duration": 0.3})
    site = wt.diagnosis.Site(passage=moved, sensor=wt.diagnosis.Sensor(rate=20e3))
    (other,) = wt.synthesise(site, vary=False, neighbour=-1.5, progress=False)
    own = acceleration(passage, other.times)
    rms = np.sqrt(np.mean((own - other.samples) ** 2))
    assert rms < 1e-3 * NOISE


def test_a_sensor_s_filter_is_the_one_of_the_package():
    site = wt.load("examples/site.toml")
    behind = wt.diagnosis.Sensor(rate=20e3, cutoff=2e3)
    site = wt.diagnosis.Site(passage=site.passage.replaced({"duration": 0.1}), sensor=behind)
    (other,) = wt.synthesise(site, vary=False, progress=False)
    own = shown(Passage(), Sensor(cutoff=2e3), other.times)
    assert np.sqrt(np.mean((own - other.samples) ** 2)) < 0.05 * NOISE


def test_recordings_have_the_noise_and_the_errors_that_are_stated():
    random = np.random.default_rng(1)
    wrongs = Wrongs(trigger=1e-3, gauge=0.01, spikes=3, spike=200.0, gaps=((0.05, 0.06),))
    all_ = [recorded(STATED, Sensor(), 0.08, random, wrongs) for _ in range(20)]
    left = np.array([one.samples - one.clean for one in all_])
    assert np.nanmedian(np.abs(left)) / 0.6745 == pytest.approx(NOISE, rel=0.05)
    assert all(int(np.isnan(one.samples).sum()) == 200 for one in all_)
    assert 0 < sum(int(one.clipped.sum()) for one in all_) <= 60
    assert np.std([one.late for one in all_]) == pytest.approx(1e-3, rel=0.5)
    assert np.std([one.speed / 9.0 for one in all_]) == pytest.approx(0.01, rel=0.5)
    late = max(all_, key=lambda one: one.late)
    times = np.arange(len(late.clean)) / 20e3 + late.late
    assert late.clean == pytest.approx(acceleration(STATED, times), abs=1e-6)


def test_the_circle_s_path_over_a_corner_of_a_flat_is_the_closed_form():
    wheel = Wheelset(flat=0.06, flat_position=0.5)
    path = passages.path_of(Passage(bump_start=5.0), wheel, 4.0)
    for x in (0.471, 0.485, 0.4999, 0.51, 0.529, 0.5 + 2 * pi * 0.46 + 0.01):
        away = abs((x - 0.5 + 1.0) % (2 * pi * 0.46) - 1.0)
        closed = np.sqrt(0.46**2 - (0.03 - away) ** 2) - 0.46
        assert path.at([x])[0] == pytest.approx(closed, abs=1e-10)
