"""Spoiled recordings of trains: each has an honest answer; trains on rough rails do not strike, though they stop."""

import numpy as np
import pytest

from tests.mutilated import KINDS, told_of
from tests.reference.test_wayside import crib_line, recorded, site_of
from tests.wayside import RADIUS, Wheel
from wheeltapper.diagnosis import Recording, Site, measure_trains
from wheeltapper.ground.errors import InputError


@pytest.mark.few(3)
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_spoiled_train_has_an_honest_answer(kind):
    assert told_of(kind, seed=2) == []


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize("place", [9.9, 12.0])
def test_a_train_that_stops_on_rough_rails_is_whole_and_strikes_nowhere(place):
    line, rate, every, speed, brakes, waits = crib_line(tuple(range(6))), 5e3, 2, 7.0, 1.0, 4.0
    axles, loads = np.array([0.0, 1.8, 9.0, 10.8]), np.array([80e3, 50e3, 100e3, 65e3])
    free = (place + 5.0 - 0.5 * speed**2 / brakes) / speed
    stops = free + speed / brakes
    runs = stops + waits + speed / brakes
    last = runs + (axles[-1] + line.way[1] + 7.0 - place - 5.0) / speed
    times = np.arange(0.0, last, 1.0 / (every * rate))
    speeds = np.interp(times, [0.0, free, stops, stops + waits, runs, last], [speed, speed, 0.0, 0.0, speed, speed])
    lead = (-5.0 + np.cumsum(speeds) / (every * rate))[: len(times) // every * every]
    a, b = line.way
    x = np.clip(lead - axles[:, None], a, b - 1e-6)
    alone = line.along([Wheel(load, 60 + k) for k, load in enumerate(loads)], x, rate, every)
    inside = (x[:, ::every] > a + 0.5) & (x[:, ::every] < b - 0.5)
    readings = (alone.readings * inside[:, None]).sum(axis=0)
    (train,) = measure_trains(recorded(readings, 40.0, 3, 1e3, rate=rate), site_of(line, radius=RADIUS))
    (told,) = (note for note in train.notes if "stopped" in note or "may have stood" in note)
    assert len(train.axles) == 4
    assert [vehicle["axles"] for vehicle in train.vehicles] == [4]
    assert not any(axle["wheels"][0]["strikes"] for axle in train.axles)
    forces = np.array([axle["wheels"][0]["static_force"] for axle in train.axles])
    assert np.abs(forces / loads - 1.0).max() < 0.01
    assert "about 4 s" in told or "about 5 s" in told
    assert not any("place, its" in note or "lost in" in note for note in train.notes)


@pytest.mark.parametrize("length", [6.0, 9.0, 12.0])
def test_seats_that_feel_wheels_from_afar_are_refused(length):
    axles = np.array([0.0, 2.5, 13.4, 15.9, 21.2, 23.7, 34.6, 37.1])
    rng, rate = np.random.default_rng(1), 1024.0
    t, recordings = np.arange(0.0, 3.2, 1.0 / rate), {}
    for name, place in (("a", 0.0), ("b", 1.0), ("c", -1.0)):
        far = np.abs(21.0 * t - 8.0 - axles[:, None] - place)
        row = 8e4 * np.maximum(1.0 - far / (0.5 * length), 0.0).sum(axis=0) + 800.0 * rng.standard_normal(len(t))
        recordings[name] = Recording(row, rate, "force")
    sensors = [{"kind": "sleeper force", "name": name, "x": x} for name, x in (("a", 0.0), ("b", 1.0), ("c", -1.0))]
    with pytest.raises(InputError, match=r"recordings: found .*; allowed: forces of sensors at the places"):
        measure_trains(recordings, Site(sensor=sensors))
