"""The force behind a recording against the simulated one, with noise.

Witness: the exact simulation; bounds by method and noise are what another program of the same four methods reached.
"""

from functools import cache

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.sensor import Sensor
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.force.reconstruction import imitation, noise_of, reconstructed
from wheeltapper.diagnosis.site.synthetic import synthesise
from wheeltapper.record.recordings.recording import Recording

RATE = 20_000.0
SEEDS = 50


@cache
def passage(mass=15_000.0, stiffness=1.5e7, damping=5e4, duration=0.21):
    """Return record, times, deck acceleration, force; the bump is left after 6.6 ms."""
    record = wt.simulate(
        wt.Scenario(
            vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4, radius=0.46),
            contact=wt.Hertz(constant=1.405e11),
            irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
            track=wt.FloatingDeck(mass=mass, stiffness=stiffness, damping=damping),
            rolling="point",
            speed=9,
            duration=duration,
        )
    )
    times = np.arange(int(duration * RATE)) / RATE
    history = record.at(times)
    return record, times, history.deck_acceleration.values, history.normal_force.values


def noise_at(decibels, times, acceleration):
    after = (times > 0.0067) & (times <= 0.2067)
    return np.sqrt(np.mean(acceleration[after] ** 2)) * 10 ** (-decibels / 20)


def peaks(times, force, record):
    """Return the largest force of each impact, by the parabola through three samples."""
    onset = record.impacts.time.values
    out = []
    for a, b in zip(onset, np.minimum(np.append(onset[1:], record.end), onset + 8e-3), strict=True):
        i = np.arange(*np.searchsorted(times, [a, b]))
        k = i[np.argmax(force[i])]
        before, here, after = force[k - 1 : k + 2]
        bend = before - 2 * here + after
        out.append(here - (after - before) ** 2 / (8 * bend) if bend < 0 else here)
    return np.array(out)


def errors(method, decibels, count=1, duration=0.12, **deck):
    """Return the peaks' relative errors in %, (count, impacts); all impacts are over after 0.09 s."""
    record, times, acceleration, _ = passage(duration=max(duration, 0.21), **deck)
    sigma = noise_at(decibels, times, acceleration)
    site = Site(passage=record.scenario, sensor=Sensor(rate=RATE, noise=sigma / np.sqrt(RATE / 2)))
    times, acceleration = times[: int(duration * RATE)], acceleration[: int(duration * RATE)]
    out = []
    for seed in range(count):
        noisy = acceleration + sigma * np.random.default_rng(seed).standard_normal(len(times))
        force = reconstructed(Recording(noisy, RATE), site, method).force
        out.append(100 * (peaks(times, force, record) / record.impacts.peak_force.values - 1))
    return np.array(out)


def within(method, decibels, count=SEEDS, **deck):
    return float(np.quantile(np.abs(errors(method, decibels, count, **deck)), 0.9))


LIMITS = [  # the targets are 0.5 % at 40 dB and 1.5 % at 20 dB; `auto` is the smoother there
    ("inertia", 60, 0.06),
    ("tikhonov", 60, 0.04),
    ("smoother", 60, 0.04),
    ("inertia", 40, 0.51),
    ("tikhonov", 40, 0.22),
    ("auto", 40, 0.2),
    ("inertia", 30, 2.3),
    ("tikhonov", 30, 0.6),
    ("smoother", 30, 0.5),
    ("inertia", 20, 6.6),
    ("tikhonov", 20, 1.7),
    ("auto", 20, 1.35),
]


@pytest.mark.slow
@pytest.mark.few(4)
@pytest.mark.parametrize(("method", "decibels", "limit"), LIMITS)
def test_nine_of_ten_peaks_lie_within(method, decibels, limit):
    assert within(method, decibels) < limit


@pytest.mark.slow
def test_of_a_long_record_too():
    assert within("smoother", 40, 6, duration=1.2) < 0.25
    assert within("smoother", 20, 6, duration=1.2) < 1.5


def test_without_noise_inertia_errs_by_the_bearing():
    assert 0.02 < np.abs(errors("inertia", 300)).max() < 0.05
    assert 0.3 < np.abs(errors("inertia", 300, mass=1500.0)).max() < 0.45
    assert 5.0 < np.abs(errors("inertia", 300, stiffness=1e9)).max() < 10.0
    for deck in ({}, {"mass": 1500.0}, {"stiffness": 1e9}):
        for method in ("bearing", "tikhonov", "smoother"):
            assert np.abs(errors(method, 300, **deck)).max() < 0.01, (method, deck)


@pytest.mark.parametrize("deck", [{"mass": 1500.0}, {"stiffness": 1e9}])
@pytest.mark.slow
def test_the_bearing_does_not_drift_on_light_or_stiff_decks(deck):
    assert within("bearing", 40, 20, **deck) < min(0.6, within("inertia", 40, 20, **deck))
    assert within("smoother", 30, 20, **deck) < 0.8
    assert within("smoother", 20, 20, **deck) < 1.8


STIFF = {"stiffness": 1e9}  # its bearing is no noise: by inertia alone the errors are another matter


@pytest.mark.parametrize(
    ("method", "deck"),
    [("inertia", {}), *((method, deck) for method in ("bearing", "tikhonov", "smoother") for deck in ({}, STIFF))],
)
def test_deviations_are_those_of_the_errors(method, deck):
    record, times, acceleration, truth = passage(**deck)
    site = Site(passage=record.scenario)
    ratios = []
    for seed in range(5):
        noisy = acceleration + 0.21 * np.random.default_rng(seed).standard_normal(len(times))
        found = reconstructed(Recording(noisy, RATE), site, method)
        ratios.append(np.mean(((found.force - truth) / found.deviation) ** 2))
    assert (0.6 if deck else 0.85) < np.sqrt(np.mean(ratios)) < 1.2


def test_auto_says_why():
    record, times, acceleration, _ = passage()
    site = Site(passage=record.scenario)
    random = np.random.default_rng(1).standard_normal(len(times))
    quiet = reconstructed(Recording(acceleration + 1e-3 * random, RATE), site)
    assert quiet.method == "inertia"
    assert "dB" in " ".join(quiet.notes)
    assert reconstructed(Recording(acceleration + 0.07 * random, RATE), site).method == "smoother"
    record, _, acceleration, _ = passage(stiffness=1e9)
    assert reconstructed(Recording(acceleration, RATE), Site(passage=record.scenario)).method == "bearing"


@pytest.mark.parametrize("sigma", [7e-3, 0.07, 0.7])
def test_noise_is_found_from_the_samples(sigma):
    _, times, acceleration, _ = passage()
    noisy = Recording(acceleration + sigma * np.random.default_rng(2).standard_normal(len(times)), RATE)
    assert noise_of(noisy, Sensor()) == pytest.approx(sigma, rel=0.06)
    assert noise_of(noisy, Sensor(noise=1e-3)) == pytest.approx(0.1)
    assert noise_of(noisy, Sensor(noise=1e-3, range=100.0, bits=8)) == pytest.approx(np.hypot(0.1, 200 / 256 / 12**0.5))


@pytest.mark.parametrize("method", ["tikhonov", "smoother", "bearing", "inertia"])
def test_missing_samples_are_left_out(method):
    record, times, acceleration, truth = passage()
    samples = acceleration + 0.07 * np.random.default_rng(3).standard_normal(len(times))
    missing = np.arange(400, 410)  # on the flank of an impact
    samples[missing] = np.nan
    found = reconstructed(Recording(samples, RATE), Site(passage=record.scenario), method)
    assert any("10 samples are missing" in note for note in found.notes)
    rest = np.delete(np.arange(len(times)), missing)
    assert np.all(np.isfinite(found.force[rest]))
    if method in ("inertia", "bearing"):
        assert np.all(np.isnan(found.force[missing]))
    else:
        assert np.all(np.abs(found.force - truth)[missing] < 4 * found.deviation[missing])
        assert found.deviation[405] > 2 * found.deviation[380]


def test_a_long_gap():
    record, times, acceleration, truth = passage()
    samples = acceleration + 0.07 * np.random.default_rng(3).standard_normal(len(times))
    samples[2000:3500] = np.nan
    for method in ("tikhonov", "smoother"):
        found = reconstructed(Recording(samples, RATE), Site(passage=record.scenario), method)
        assert np.abs(found.force - truth)[:1990].max() < 0.1 * record.static_force
        assert np.all(np.isfinite(found.force))
        assert found.deviation[2750] > 20 * found.deviation[1000]


def test_clipped_samples_are_bounds():
    record, times, acceleration, truth = passage()
    noisy = acceleration + 0.07 * np.random.default_rng(4).standard_normal(len(times))
    clipped = np.abs(noisy) > 25.0
    assert clipped.sum() > 10
    recording = Recording(np.clip(noisy, -25.0, 25.0), RATE, clipped=clipped)
    site = Site(passage=record.scenario)
    found = reconstructed(recording, site)
    assert found.method == "smoother"
    assert any("clipped" in note for note in found.notes)
    assert np.all(np.abs(found.force - truth) < 6 * found.deviation)
    assert np.median(found.deviation[clipped]) > 1.5 * np.median(found.deviation)
    assert np.all(np.isinf(reconstructed(recording, site, "inertia").deviation[clipped]))


def test_a_sensor_with_offset_drift_and_filter():
    record, _, _, _ = passage()
    sensor = Sensor(rate=RATE, noise=7e-4, offset=0.3, drift=-0.5, cutoff=3000.0, range=100.0, bits=16)
    site = Site(passage=record.scenario, sensor=sensor)
    (recording,) = synthesise(site)
    found = reconstructed(recording, site)
    inside = (found.times >= 0) & (found.times < record.end)
    truth = record.at(found.times[inside]).normal_force.values
    assert np.sqrt(np.mean((found.force[inside] - truth) ** 2)) < 0.01 * record.static_force
    assert found.band[1] < 3000.0
    largest = peaks(found.times, found.force, record) / record.impacts.peak_force.values
    assert largest == pytest.approx(1.0, abs=6e-3)


def test_a_recording_that_begins_late():
    record, times, acceleration, truth = passage(stiffness=1e9)
    random = np.random.default_rng(5)
    late = slice(300, None)
    noisy = Recording(acceleration[late] + 0.07 * random.standard_normal(len(times) - 300), RATE, start=300 / RATE)
    found = reconstructed(noisy, Site(passage=record.scenario), "smoother")
    assert any("unknown state" in note for note in found.notes)
    assert np.sqrt(np.mean((found.force - truth[late])[200:1400] ** 2)) < 0.01 * record.static_force


def test_the_band_and_the_imitation():
    record, times, acceleration, _ = passage()
    site = Site(passage=record.scenario)
    expected = {5.0: 0.25, 10.0: 1.0, 20.0: 4.2, 41.0: 20.2}
    for own, percent in expected.items():
        track = {"track.stiffness": 15_000 * (2 * np.pi * own) ** 2, "track.damping": 0.0}
        soft = Site(passage=record.scenario.replaced(track))
        assert 100 * (abs(imitation(soft, np.array([100.0]))[0]) - 1) == pytest.approx(percent, abs=0.06)
    found = reconstructed(Recording(acceleration, RATE), site, "inertia")
    low = np.abs(imitation(site, np.array(found.band[0]) * np.array([0.99, 1.01])))
    assert low[0] > 1.01 > low[1]
    smooth = reconstructed(Recording(acceleration + 0.07 * np.sin(7e4 * times), RATE), site, "smoother")
    assert smooth.band[0] == 0.0
    assert smooth.band[1] <= RATE / 2


def test_the_imitation_is_the_transfer_of_a_real_deck():
    record, times, acceleration, truth = passage(stiffness=1e9, damping=2e6, duration=0.5)
    site = Site(passage=record.scenario)
    frequencies = np.array([60.0, 100.0, 150.0])
    waves = np.exp(-2j * np.pi * frequencies[:, None] * times)
    shown, real = waves @ (-15_000 * acceleration), waves @ (truth - record.static_force)
    assert shown / real == pytest.approx(imitation(site, frequencies), rel=2e-3)


@pytest.mark.parametrize(("own", "slope"), [(5.0, -1.0009), (10.0, -1.0035), (20.0, -1.0141)])
def test_the_deck_imitates_the_force(own, slope):
    deck = wt.FloatingDeck(mass=15_000.0, stiffness=15_000.0 * (2 * np.pi * own) ** 2)
    scenario = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, radius=0.46),
        contact=wt.Hertz(constant=1.405e11),
        irregularity=wt.WheelFlat(depth=1e-4, position=0.05, repeat=False),
        track=deck,
        speed=5,
        duration=0.2,
    )
    record = wt.simulate(scenario)
    times = np.arange(4000) / RATE
    history = record.at(times)
    recording = Recording(history.deck_acceleration.values, RATE)
    found = {m: reconstructed(recording, Site(passage=scenario), m) for m in ("inertia", "bearing")}
    shown, real = found["inertia"].force - record.static_force, found["bearing"].force - record.static_force
    assert np.corrcoef(shown, real)[0, 1] == pytest.approx(1.0, abs=1e-4)
    assert np.polyfit(real, shown, 1)[0] == pytest.approx(-slope, abs=1e-3)  # claim C22
    assert found["bearing"].force == pytest.approx(history.normal_force.values, abs=2e-3 * record.static_force)


def test_a_recording_of_the_force_is_passed_on():
    record, _, _, truth = passage()
    found = reconstructed(Recording(truth, RATE, quantity="force"), Site(passage=record.scenario))
    assert found.force is truth
    assert found.method == "recorded"
    assert "passed on" in found.notes[-1]


def test_what_cannot_be_is_refused():
    record, _, acceleration, _ = passage()
    site = Site(passage=record.scenario)
    with pytest.raises(wt.InputError, match="method: found 'magic'; allowed: 'auto', 'inertia'"):
        reconstructed(Recording(acceleration, RATE), site, "magic")
    with pytest.raises(wt.InputError, match="3 samples that are neither missing nor clipped"):
        reconstructed(Recording(acceleration[:3], RATE), site)
    with pytest.raises(wt.InputError, match="found 0 Hz"):
        imitation(site, np.array([0.0, 1.0]))


def test_the_map_of_the_imitation(tmp_path):
    site = wt.load("examples/site.toml")
    shown = wt.diagnosis.imitation_map(site, [7500.0, 15_000.0], [1e7, 1.5e7], [50.0, 100.0])
    here = shown.sel({"track.mass": 15_000.0, "track.stiffness": 1.5e7})
    assert here.modulus.values == pytest.approx(np.abs(imitation(site, np.array([50.0, 100.0]))), rel=1e-12)
    assert float(here.error[1]) < float(here.error[0]) < 0.2
    assert np.all(shown.error.diff("track.mass") < 0.0)
    wt.plot(shown, tmp_path / "imitation.png")
    assert (tmp_path / "imitation.png").stat().st_size > 5_000
    with pytest.raises(wt.InputError, match="positive"):
        wt.diagnosis.imitation_map(site, [0.0], [1e7], [50.0])
