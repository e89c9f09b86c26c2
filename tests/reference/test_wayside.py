"""Trains in recordings, against a finite-element track under moving wheels that knows what it was given."""

from functools import cache

import numpy as np
import pytest

import wheeltapper as wt
from tests.wayside import Line, Wheel, low_passed, slow_train, spoiled, train_of
from wheeltapper.diagnosis import Recording, Site, calibrated, measure_trains
from wheeltapper.diagnosis.wayside.vehicles import vehicles_of

RATE = 10e3
WAGONS = (np.array([0.0, 1.8, 9.0, 10.8]) + 14.4 * np.arange(6)[:, None]).ravel()
LOADS = np.random.default_rng(3).uniform(3e4, 1.1e5, len(WAGONS))
KINDS = {"pair": "rail shear force", "pad": "pad force", "sleeper": "sleeper force"}


@cache
def crib_line(cribs):
    return Line([("pair", 0.6 * k + 0.1, 0.6 * k + 0.5) for k in cribs])


def site_of(line, **more):
    sensors = []
    for number, (kind, *places) in enumerate(line.channels):
        where = dict(zip(("x1", "x2") if kind == "pair" else ("x",), places, strict=True))
        sensors.append({"kind": KINDS[kind], "name": str(number), "side": "left", "gain_uncertainty": 0.05} | where)
    return Site(sensor=sensors, **more)


def recorded(readings, level=40.0, seed=1, drift=3e3, gains=0.0, rate=RATE):
    rng = np.random.default_rng(seed)
    out = spoiled(readings, rate, readings > 5e3, level, 1.0 + gains * rng.standard_normal(len(readings)), drift, rng)
    return {str(number): Recording(row, rate, "force") for number, row in enumerate(out)}


def times(duration):
    return np.arange(0.0, duration, 1.0 / RATE)


LINE = crib_line((0, 5, 6))
STEADY = slow_train(LINE, -4.0 + 15.0 * times(6.8), WAGONS, LOADS)


def test_axles_speeds_and_vehicles_of_a_train():
    (train,) = measure_trains(recorded(STEADY, 20.0), site_of(LINE), name="wagons")
    assert len(train.axles) == len(WAGONS)
    assert np.allclose([axle["speed"] for axle in train.axles], 15.0, rtol=3e-3)
    assert np.allclose([axle["place"] for axle in train.axles], WAGONS, rtol=1e-3, atol=0.02)
    assert [vehicle["axles"] for vehicle in train.vehicles] == [4] * 6
    assert {axle["direction"] for axle in train.axles} == {1}


def test_forces_of_wheels_that_move_slowly_are_their_loads():
    (train,) = measure_trains(recorded(STEADY), site_of(LINE))
    assert np.allclose([axle["wheels"][0]["static_force"] for axle in train.axles], LOADS, rtol=5e-3)
    assert not any(row["strikes"] for row in train.table())
    assert "sensors of one rail" in str(train)


def test_gains_follow_from_a_train_of_known_loads():
    gains = np.array([1.05, 0.93, 1.02])
    (train,) = measure_trains(recorded(gains[:, None] * STEADY), site_of(LINE))
    site = calibrated(site_of(LINE), train, {axle + 1: (load, load) for axle, load in enumerate(LOADS[:8])})
    assert np.allclose([one.gain for one in site.sensors], gains, rtol=3e-3)
    assert max(one.gain_uncertainty for one in site.sensors) < 5e-3
    other = gains[:, None] * slow_train(LINE, -4.0 + 20.0 * times(4.5), WAGONS[:12], LOADS[:12][::-1])
    (after,) = measure_trains(recorded(other), site)
    assert np.allclose([axle["wheels"][0]["static_force"] for axle in after.axles], LOADS[:12][::-1], rtol=5e-3)


def test_a_train_that_runs_the_other_way():
    backwards = STEADY[:, ::-1]  # time reversed: the last axle comes first, towards falling x
    (train,) = measure_trains(recorded(backwards), site_of(LINE))
    assert {axle["direction"] for axle in train.axles} == {-1}
    assert np.allclose([axle["wheels"][0]["static_force"] for axle in train.axles], LOADS[::-1], rtol=5e-3)


def test_a_train_that_accelerates():
    t = times(14.0)
    (train,) = measure_trains(recorded(slow_train(LINE, -4.0 + 5.0 * t + 0.2 * t**2, WAGONS, LOADS)), site_of(LINE))
    assert np.allclose([axle["place"] for axle in train.axles], WAGONS, atol=0.15)
    assert [vehicle["axles"] for vehicle in train.vehicles] == [4] * 6
    assert any("the speed changes" in note for note in train.notes)


def test_a_train_that_stops_loses_no_axle():
    t = times(50.0)
    speed = np.interp(t, [0.0, 3.0, 7.35, 27.0, 37.0, 60.0], [10.0, 10.0, 0.0, 0.0, 8.0, 8.0])
    readings = slow_train(LINE, -4.0 + np.cumsum(speed) / RATE, WAGONS, LOADS)
    (train,) = measure_trains(recorded(readings), site_of(LINE))
    assert len(train.axles) == len(WAGONS)
    assert any("the train stopped" in note for note in train.notes)
    forces = [axle["wheels"][0]["static_force"] for axle in train.axles[:8]]
    assert np.allclose(forces, LOADS[:8], rtol=0.04)  # it brakes with 2.3 m/s² while they are on the sensors


def test_two_trains_in_one_recording():
    t = times(30.0)
    readings = sum(slow_train(LINE, -4.0 + v * (t - t0), WAGONS, LOADS) for v, t0 in ((15.0, 0.0), (18.0, 20.0)))
    first, second = measure_trains(recorded(readings), site_of(LINE))
    assert (len(first.axles), len(second.axles)) == (24, 24)
    assert abs(second.axles[0]["speed"] - 18.0) < 0.05


def test_an_axle_that_one_channel_lost_is_named():
    lost = STEADY.copy()
    at = int((4.0 + WAGONS[5] + 0.3) / 15.0 * RATE)
    lost[0, at - 400 : at + 400] = 0.0
    (train,) = measure_trains(recorded(lost), site_of(LINE))
    assert len(train.axles) == len(WAGONS)
    assert "axle 6: lost in 1 of 3 channels: 0" in train.notes


def test_the_speed_where_all_sensors_are_at_one_place():
    line = crib_line((0,))
    readings = recorded(slow_train(line, -4.0 + 15.0 * times(6.8), WAGONS, LOADS))
    (train,) = measure_trains(readings, site_of(line), distances=["1.8 m", "7.2 m", "1.8 m"])
    assert np.allclose([axle["speed"] for axle in train.axles], 15.0, rtol=3e-3)
    assert any("the known vehicle begins at axle 1" in note for note in train.notes)
    assert any("direction is unknown" in note for note in train.notes)


def test_sensors_at_seats_count_axles():
    line = Line([("pad", 0.6 * k) for k in (0, 5, 6)])
    loads = np.full(len(WAGONS), 9e4)
    (train,) = measure_trains(recorded(slow_train(line, -4.0 + 15.0 * times(6.8), WAGONS, loads)), site_of(line))
    assert len(train.axles) == len(WAGONS)
    assert np.allclose([axle["speed"] for axle in train.axles], 15.0, rtol=5e-3)
    assert any("no force is taken" in note for note in train.notes)


def test_noise_is_no_train():
    noise = 1e3 * np.random.default_rng(1).standard_normal((3, 20_000))
    assert measure_trains({str(k): Recording(row, RATE, "force") for k, row in enumerate(noise)}, site_of(LINE)) == ()


def test_vehicles_by_the_distances_of_axles():
    kinds = {
        "wagon": ([0, 1.8, 9, 10.8], 3.6), "two axles": ([0, 8.0], 4.2), "locomotive": ([0, 2.6, 8.9, 11.5], 4.4),
        "six axles": ([0, 2.1, 4.2, 10.5, 12.6, 14.7], 5.0), "coach": ([0, 2.5, 19, 21.5], 4.9),
        "close": ([0, 1.8, 6.3, 8.1], 2.9), "articulated": ([0, 2.7, 18.5, 21.2, 37, 39.7, 55.5, 58.2], 5.0),
    }  # fmt: skip
    rng = np.random.default_rng(0)
    for _ in range(60):
        names = rng.choice(list(kinds), rng.integers(2, 40))
        places, at = [], 0.0
        for name in names:
            axles, gap = kinds[name]
            places += [at + axle for axle in axles]
            at += axles[-1] + gap
        places = np.array(places) * (1.0 + 2e-3 * rng.standard_normal()) + 3e-3 * rng.standard_normal(len(places))
        assert [len(one.axles) for one in vehicles_of(places.tolist())] == [len(kinds[name][0]) for name in names]


def test_files_of_channels(tmp_path):
    site = site_of(LINE)
    one = {name: recording.samples for name, recording in recorded(STEADY).items()}
    np.savez(tmp_path / "all.npz", **one, unit="N", rate=RATE)
    (train,) = measure_trains(tmp_path / "all.npz", site)
    files = []
    for name, samples in one.items():
        files.append(tmp_path / f"{name}.csv.gz")
        np.savetxt(files[-1], samples[::2] / 1e3, header=f"rate: {RATE / 2} Hz\nunit: kN", fmt="%.4f")
    (again,) = measure_trains(files, site)
    assert np.allclose([a["speed"] for a in train.axles], [a["speed"] for a in again.axles], rtol=2e-3)
    with pytest.raises(wt.InputError, match="no column '2'"):
        measure_trains(files[:2], site)
    with pytest.raises(wt.InputError, match="a channel that is also in"):
        measure_trains([*files, tmp_path / "all.npz"], site)


# -- wheels that move fast over roughness, some with a flat -----------------------------------------------------------

CRIBS = crib_line(tuple(range(16)))


@cache
def library(speed, rate):
    rng = np.random.default_rng(7)
    start = CRIBS.way[0]
    rough = [Wheel(load, seed) for seed, load in enumerate(rng.uniform(3e4, 1.1e5, 10))]
    flats = [Wheel(load, 100 + k, (0.04, start + 0.48 * k + 0.1)) for k, load in enumerate((3e4, 6e4, 1e5) * 2)]
    return CRIBS.passages(rough + flats, speed, rate)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "rate"), [(20.0, 10e3), (60.0, 20e3)])
def test_wheels_of_fast_trains(speed, rate):
    alone = library(speed, rate)
    windows = np.array([CRIBS.window(k, alone.x) for k in range(len(CRIBS.channels))])
    means = (alone.forces * windows.sum(axis=0)).sum(axis=1) / windows.sum()
    rng = np.random.default_rng(5)
    right, axles, false, wrong_speed = 0, 0, 0, []
    off = {40.0: [], 30.0: [], 20.0: []}
    for number, level in enumerate([40.0, 30.0, 20.0] * 4):
        chosen = rng.integers(0, 10, len(WAGONS))
        struck = int(rng.integers(len(WAGONS)))
        chosen[struck] = 10 + number % 6
        readings, _ = train_of(CRIBS, alone, speed, rate, WAGONS, chosen)
        (train,) = measure_trains(recorded(readings, level, number, 5e3, rate=rate), site_of(CRIBS))
        assert len(train.axles) == len(WAGONS)
        wheels = [axle["wheels"][0] for axle in train.axles]
        found = [axle for axle, wheel in enumerate(wheels) if wheel["strikes"]]
        right += found == [struck]
        false += len(set(found) - {struck})
        axles += len(WAGONS) - 1
        off[level] += [wheel["static_force"] / means[kind] - 1.0 for wheel, kind in zip(wheels, chosen, strict=True)]
        wrong_speed += [axle["speed"] / speed - 1.0 for axle in train.axles]
    told = ", ".join(f"{level:g} dB {np.abs(one).max():.1e}" for level, one in off.items())
    print(f"{speed:g} m/s: flats {right} of 12, false {false} of {axles}, static at most {told}, "
          f"speed {np.abs(wrong_speed).max():.1e}")  # fmt: skip
    assert right >= 11
    assert false == 0
    assert max(np.abs(off[40.0]).max(), np.abs(off[30.0]).max()) < 0.01
    assert np.abs(off[20.0]).max() < 0.02  # white noise alone is 0.7 % of the lightest wheels
    assert np.std(off[20.0]) < 5e-3
    assert np.abs(wrong_speed).max() < 3e-3


@pytest.mark.slow
def test_peaks_of_strikes_between_gauges():
    alone = library(20.0, 10e3)
    for kind in range(10, 16):
        readings, _ = train_of(CRIBS, alone, 20.0, 10e3, np.array([0.0]), [kind])
        (train,) = measure_trains(recorded(readings, 60.0, kind, 0.0), site_of(CRIBS))
        between = np.array([CRIBS.window(k, alone.x) for k in range(16)]).sum(axis=0) > 0.999
        true = low_passed(alone.forces[kind], 10e3)[between].max()
        assert abs(train.axles[0]["wheels"][0]["largest_force"] / true - 1.0) < 0.15
