"""What cannot fit in memory is refused with its number before it is computed; what is long can be stopped."""

import time
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ground import memory
from wheeltapper.ground.outcome import Outcome
from wheeltapper.lower import extent
from wheeltapper.lower.paths import point
from wheeltapper.march.common import telling
from wheeltapper.record import simulate as simulating

COACH = Path(__file__).resolve().parents[2] / "examples" / "coach_step.toml"
COMMON = {"contact": wt.Hertz(constant=1.405e11), "speed": 9.0, "duration": 0.05}
BUMP = wt.CosineBump(height="0.2 mm", length="5 cm", start=0.009)


def wheelset(**changes):
    vehicle = wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=2e4)
    return wt.Scenario(**(COMMON | {"vehicle": vehicle, "irregularity": BUMP} | changes))


def test_a_duration_that_cannot_fit_is_refused_with_steps_and_bytes():
    with pytest.raises(wt.InputError, match=r"duration: found 1e\+09 s, .* steps or more, .*B; allowed: up to about"):
        wt.simulate(wheelset(duration=1e9))


def test_a_wagon_s_duration_that_cannot_fit_is_refused():
    coach = wt.Scenario.from_toml(COACH)
    with pytest.raises(wt.InputError, match="duration: found 1e"):
        wt.simulate(coach.replaced({"duration": 1e9}))


def test_the_duration_that_is_allowed_is_that_which_fits(monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 1e6)
    with pytest.raises(wt.InputError) as told:
        wt.simulate(wheelset(duration=100.0))
    fits = float(str(told.value).split("up to about ")[1].split(" s")[0])
    assert 1.0 < fits < 100.0


def test_more_samples_than_fit_are_refused():
    record = wt.simulate(wheelset())
    with pytest.raises(wt.InputError, match=r"rate: found .* samples"):
        record.history(1e15)


def test_more_samples_at_given_times_than_fit_are_refused(monkeypatch):
    record = wt.simulate(wheelset())
    monkeypatch.setattr(memory, "available_bytes", lambda: 1e5)
    with pytest.raises(wt.InputError, match="times: found"):
        record.at(np.linspace(0.0, 0.05, 1000))


def test_too_many_borders_of_periods_that_are_written_out_are_refused(monkeypatch):
    monkeypatch.setattr(point, "MOST_BORDERS", 100)
    flats = (wt.WheelFlat(depth=1e-4, position=0.1), BUMP)
    with pytest.raises(wt.InputError, match="borders of an irregularity"):
        wt.simulate(wheelset(irregularity=flats, speed=40.0, duration=10.0))


def test_a_march_that_outgrows_the_memory_ends_and_what_was_found_is_kept(monkeypatch):
    monkeypatch.setattr(telling, "CHUNK", 100)
    monkeypatch.setattr(extent, "TABLES", 1e30)
    record = wt.simulate(wheelset())
    assert record.outcome is Outcome.OUT_OF_MEMORY
    assert 0.0 < record.end < 0.05
    assert np.isfinite(record.history(1e4).normal_force.values).all()


def test_a_march_in_small_parts_is_the_same_march(monkeypatch):
    whole = wt.simulate(wheelset())
    monkeypatch.setattr(telling, "CHUNK", 50)
    parts = wt.simulate(wheelset())
    assert np.array_equal(whole.events.time.values, parts.events.time.values)
    assert np.array_equal(whole.peaks.normal_force.values, parts.peaks.normal_force.values)


def test_a_run_tells_how_far_it_is(monkeypatch):
    monkeypatch.setattr(telling, "CHUNK", 50)
    told = []
    wt.simulate(wheelset(), progress=lambda *one: told.append(one))
    marched = [(done, total) for what, done, total in told if what == "marching"]
    assert len(marched) > 2
    assert all(0.0 <= done <= total == 0.05 for done, total in marched)
    assert marched == sorted(marched)
    assert {"lowering", "checking the energy"} <= {what for what, _, _ in told}


def test_what_a_listener_raises_ends_runs_side_by_side():
    def stop(what, done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        wt.simulate([wheelset() for _ in range(4)], threads=2, progress=stop)


def test_a_scenario_that_is_refused_ends_those_beside_it(monkeypatch):
    begun = []

    def failing(scenario, _):
        begun.append(scenario)
        time.sleep(0.001)
        return 1 / 0

    monkeypatch.setattr(simulating, "simulated_scenario", failing)
    with pytest.raises(ZeroDivisionError):
        wt.simulate([wheelset() for _ in range(1000)], threads=1)
    assert len(begun) < 1000


@pytest.mark.filterwarnings("ignore:.*is implausible")
@pytest.mark.parametrize(
    "changes",
    [
        {"vehicle.stiffness": 1e15},
        {"track": {"type": "FloatingDeck", "mass": 1000, "stiffness": 1e20}},
    ],
)
def test_a_stiffness_beyond_all_bounds_is_marched_in_balance(changes):
    record = wt.simulate(wheelset(duration=1e-4).replaced(changes))
    assert record.outcome is Outcome.COMPLETED
    held = record.history(1e6)
    moved = held.wheel_displacement if "vehicle.stiffness" in changes else held.deck_displacement
    assert np.abs(moved.values - moved.values[0]).max() < 1e-12


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ({"length": 0.92}, "length: found 0.92 m on a wheel of the radius 0.46 m; allowed: less than 0.92 m"),
        ({"depth": 0.46}, "depth: found 0.46 m on a wheel of the radius 0.46 m; allowed: less than 0.46 m"),
    ],
)
def test_a_flat_that_is_larger_than_its_wheel_is_refused_in_one_line(size, message):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=9e4, radius=0.46), irregularity=wt.WheelFlat(position=0.2, **size),
        speed=5.0, duration=0.1,
    )  # fmt: skip
    with pytest.raises(wt.InputError, match=message):
        wt.simulate(scene)
