"""Voids below a wagon on rails, against the general march: half a coach that cannot roll is a bogie."""

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from tests.reference.test_wagon_on_rails import NUMBERS, TRACK, TRACK_ALLOWED, half_coach
from wheeltapper.lower.door import lowered_scenario
from wheeltapper.lower.track.anomalies import Void
from wheeltapper.lower.wagon_on_rails import over_voids
from wheeltapper.march import run
from wheeltapper.march.common.program import EVENT_CONTACT, EVENT_TIME
from wheeltapper.march.wagon.assembly import HALF, LANES

VOIDS = wt.tracks.HangingSleeper(seat=1, void="0.2 mm"), wt.tracks.HangingSleeper(seat=-2, void="0.1 mm")
CORRUGATION = wt.Corrugation(amplitude=1e-4, wavelength=0.1, start=0.05)
FLAT = wt.WheelFlat(length="60 mm", position=0.4, repeat=False)


def over(track=None, **fields):
    """Return what both vehicles share; `track` changes fields of it."""
    held = {"anomalies": VOIDS, "cutoff": 1500.0} | (track or {})
    return {
        "contact": wt.Hertz(constant_per_wheel=8e10, curvature=False), "speed": 20.0, "duration": 0.03,
        "irregularity": CORRUGATION, "rolling": "point",
        "track": wt.tracks.Ballasted(**TRACK.model_dump() | held),
    } | fields  # fmt: skip


def coach_over(method="strict", vehicle=None, **fields):
    scene = {"vehicle": vehicle or half_coach(), "profiles": wt.profiles.Cones()} | fields
    return wt.simulate(wt.Scenario(**scene), method)


def at_seats(record, side=None):
    found = record.events.where(record.events.seat != -1, drop=True)
    return found if side is None else found.where(found.side == side, drop=True)


def times_of_general_march(scene):
    """Return times of events of voids in strict runs of the general march: medians of three lengths of macro steps.

    It is up to 2e-9 s wrong where a void closes or opens in a macro step in which another contact's force jumps: what
    contacts feel of each other in a macro step is a polynomial. Of other lengths these do not meet in one.
    """
    task = lowered_scenario(scene, "strict").program
    steps = [task._replace(method=task.method._replace(step=part * task.method.step)) for part in (1.0, 0.7, 0.5)]
    return np.median([run.march(one).seat_events[:, EVENT_TIME] for one in steps], axis=0)


def times_with_half_steps(scene):
    """Return times of events of voids on the left of a wagon, of a strict run with half as long macro steps."""
    below = lowered_scenario(scene, "strict").below
    method = below.track.method._replace(step=0.5 * below.track.method.step)
    found = run.march(below._replace(track=below.track._replace(method=method))).seat_events
    return found[found[:, EVENT_CONTACT] % LANES < HALF, EVENT_TIME]


def check_alike(coach, bogie, allowed, allowed_of_wheels):
    """Hold events of voids and of wheels below both rails of a coach against those of a bogie."""
    expected = at_seats(bogie)
    assert expected.sizes["event"] > 2
    for side in ("left", "right"):
        found = at_seats(coach, side)
        assert found.kind.values.tolist() == expected.kind.values.tolist()
        assert found.seat.values.tolist() == expected.seat.values.tolist()
        np.testing.assert_allclose(found.time, expected.time, rtol=0, atol=allowed)
        np.testing.assert_allclose(found.indentation_rate, expected.indentation_rate, rtol=1e-5, atol=1e-7)
        np.testing.assert_array_equal(found.position, expected.position)
        own = coach.events.where((coach.events.seat == -1) & (coach.events.side == side), drop=True)
        wheels = bogie.events.where(bogie.events.seat == -1, drop=True)
        np.testing.assert_allclose(own.time, wheels.time, rtol=0, atol=allowed_of_wheels)


UNDAMPED = pytest.mark.filterwarnings("ignore:the track is computed as a closed ring of 54 m")


@pytest.mark.slow
@pytest.mark.few(1)
@UNDAMPED
@pytest.mark.parametrize(
    ("track", "scene"),
    [
        ({}, {}),
        ({"ballast_damping": 0.0, "bays": 90}, {}),
        ({"first_sleeper": 0.1234}, {"speed": 33.0, "irregularity": FLAT, "rolling": "circle", "duration": 0.06}),
    ],
    ids=["damped", "undamped", "flat"],
)
@pytest.mark.parametrize(
    ("method", "allowed"), [("default", 3e-9), pytest.param("strict", 1e-9, marks=pytest.mark.slow)]
)
def test_half_a_coach_over_voids_is_a_bogie(track, scene, method, allowed):
    common = over(track, **scene)
    coach = coach_over(method, **common)
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common), method)
    check_alike(coach, bogie, allowed, {"default": 3e-9, "strict": 3e-11}[method])
    if method == "strict":
        times = times_of_general_march(bogie.scenario)
        np.testing.assert_allclose(at_seats(coach, "left").time, times, rtol=0, atol=3e-11)
        np.testing.assert_allclose(times_with_half_steps(coach.scenario), times, rtol=0, atol=3e-11)
    beside = {"rate": 4321.0, "rail": [0.5, -1.0], "seat": [1, -2, -3]}
    own, under = coach.track(**beside), bogie.track(**beside)
    for name, values in under.data_vars.items():
        least = TRACK_ALLOWED[method]["acceleration" in name] * float(np.abs(values).max())
        for side in ("left", "right"):
            np.testing.assert_allclose(own[name].sel(side=side), values, rtol=0, atol=least)
    assert float(coach.energy.relative_imbalance) < {"default": 1e-6, "strict": 1e-8}[method]
    assert "closings of voids" in str(coach)


def rolling_scene(left=None, right=None, **fields):
    """Return a wagon whose sleepers roll, with other irregularities of both rails."""
    track = {"sleeper_roll_inertia": 60.0}
    return over(track, irregularity={"left": left or [], "right": right or []}) | fields


@pytest.mark.slow
def test_what_the_left_rail_does_over_voids_the_right_one_does_in_a_mirror():
    one = coach_over(**rolling_scene(left=CORRUGATION))
    other = coach_over(**rolling_scene(right=CORRUGATION))
    assert at_seats(one, "left").sizes["event"] > 4
    for side, mirrored in (("left", "right"), ("right", "left")):
        found, expected = at_seats(one, side), at_seats(other, mirrored)
        assert found.kind.values.tolist() == expected.kind.values.tolist()
        np.testing.assert_allclose(found.time, expected.time, rtol=0, atol=1e-12)
    assert at_seats(one, "left").time.values.tolist() != at_seats(one, "right").time.values.tolist()
    assert float(one.energy.relative_imbalance) < 1e-8


@UNDAMPED
@pytest.mark.slow
def test_ballast_presses_by_its_depth_under_each_half_of_a_sleeper_that_rolls():
    """Forces and deflections are read at the rails: those of the ballast are nearer to the middle by `arm`.

    Deflections are read with what the modes leave out at rest under the wheels, of which the march of voids knows
    nothing: at a cutoff of 1.5 kHz it is 3e-4 of the largest force.
    """
    scene = rolling_scene(left=CORRUGATION)
    track = scene["track"] = scene["track"].model_copy(update={"ballast_damping": 0.0, "cutoff": 5000.0})
    arm = np.sqrt(2.0 * 60.0 / track.seat_distance**2 / track.sleeper_mass)
    read = coach_over(**scene).track(rate=8e3, seat=[1, -2])

    def both(values, factor):
        left, right = values.sel(side="left"), values.sel(side="right")
        mean, half = 0.5 * (left + right), 0.5 * (left - right) * factor
        return mean + half, mean - half

    gap = xr.DataArray([2e-4, 1e-4], coords={"seat": [1, -2]}, dims="seat")
    forces = both(read.ballast_force, 1.0 / arm)
    for force, down in zip(forces, both(-read.sleeper_displacement, arm), strict=True):
        expected = track.ballast_stiffness * np.maximum(down - gap, 0.0)
        assert float(force.max()) > 1e3
        assert float((force == 0.0).mean()) > 0.1
        np.testing.assert_allclose(force, expected, rtol=0, atol=2e-5 * float(force.max()))
    assert float(np.abs(forces[0] - forces[1]).max()) > 100.0


@pytest.mark.slow
def test_a_damper_against_roll_that_no_void_can_have_is_told():
    scene = rolling_scene(duration=1e-3)
    scene["track"] = scene["track"].model_copy(update={"ballast_roll_damping": 1e4})
    assert any("ballast_roll_damping has no effect" in note for note in coach_over("default", **scene).notes)
    scene = rolling_scene(duration=1e-3)
    assert not any("ballast_roll_damping" in note for note in coach_over("default", **scene).notes)


@pytest.mark.slow
def test_a_record_over_voids_is_loaded_as_it_was_saved(tmp_path):
    record = coach_over("default", **rolling_scene(left=CORRUGATION))
    record.save(tmp_path / "coach.nc")
    loaded = wt.load(tmp_path / "coach.nc")
    xr.testing.assert_identical(loaded.events, record.events)
    beside = {"rate": 4321.0, "rail": [0.5], "seat": [1]}
    xr.testing.assert_identical(loaded.track(**beside), record.track(**beside))
    assert str(loaded) == str(record)


@pytest.mark.slow
def test_half_a_coach_over_voids_is_a_bogie_with_hysteresis():
    common = over(contact=wt.Hertz(constant_per_wheel=8e10, curvature=False, hysteresis=0.1))
    coach = coach_over("default", **common)
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common))
    check_alike(coach, bogie, 3e-9, 3e-8)


@pytest.mark.whole
@pytest.mark.slow
def test_a_coach_with_flanges_and_creep_does_the_mirrored_thing_over_voids():
    flat = wt.WheelFlat(length="50 mm", position=0.5, repeat=False)
    found = {}
    for side, other in (("left", "right"), ("right", "left")):
        common = rolling_scene(**{side: flat}, duration=0.04, rolling="circle", creep=wt.creep.Polach(friction=0.35))
        record = coach_over("default", wt.Wagon.erri_b176(), **common | {"profiles": wt.profiles.WheelRail()})
        assert float(record.energy.relative_imbalance) < 1e-5
        found[side] = at_seats(record, side)
        assert at_seats(record, other).sizes["event"] <= found[side].sizes["event"]
    assert found["left"].sizes["event"] > 1
    assert found["left"].kind.values.tolist() == found["right"].kind.values.tolist()
    np.testing.assert_allclose(found["left"].time, found["right"].time, rtol=0, atol=1e-9)


def test_many_wheelsets_without_voids_are_no_reason_to_refuse_any():
    """Sixteen wheelsets with flanges have more octets than there is room for with voids."""
    scene = wt.Scenario(vehicle=half_coach(), profiles=wt.profiles.Cones(), **over())
    assembly = lowered_scenario(scene).assembly
    many = assembly._replace(kinds=np.repeat([0, 1], 4), lanes=np.zeros((8, *assembly.lanes.shape[1:])))
    assert over_voids(many, ()).wheel_octets == 8
    with pytest.raises(wt.InputError, match="found 1 voids; allowed: at most 0 below this wagon"):
        over_voids(many, (Void(1, 1e-3, 1e8, 1e4),))


def test_more_voids_than_a_march_can_tell_apart_are_refused():
    many = tuple(wt.tracks.HangingSleeper(seat=seat, void="1 mm") for seat in range(-6, 15))
    common = over({"anomalies": many}, duration=0.3)
    with pytest.raises(wt.InputError, match=r"track.anomalies: found 21 voids; allowed: at most 20 below this wagon"):
        coach_over(**common)
