"""A wagon on rails against the general march: half a coach that cannot roll is a bogie in the vertical plane."""

import numpy as np
import pytest
import xarray as xr
from scipy import optimize

import wheeltapper as wt

from ..marks import slow

HELD = ("x", "y", "roll", "yaw")
NUMBERS = {
    "wheelset_mass": 1350.0, "frame_mass": 2900.0, "pitch_inertia": 1700.0, "wheelbase": 2.4,
    "primary_stiffness": 2.1e6, "primary_damping": 2.5e4, "secondary_stiffness": 7e5, "secondary_damping": 3e4,
}  # fmt: skip
TRACK = wt.tracks.Ballasted(**wt.tracks.Ballasted.example | {"bays": 90, "first_sleeper": 0.15})


def half_coach():
    half = 0.5 * NUMBERS["wheelbase"]
    frame = wt.vehicles.Body(
        name="frame", mass=NUMBERS["frame_mass"], inertia=(2e3, NUMBERS["pitch_inertia"], 3e3),
        position=(-half, 0.0, 0.6), held=HELD,
    )  # fmt: skip
    axles = tuple(
        wt.vehicles.Axle(
            mass=NUMBERS["wheelset_mass"], inertia=(800.0, 90.0, 800.0), position=x, held=(*HELD, "pitch"), load=5.2e4
        )
        for x in (0.0, -2.0 * half)
    )
    ends = {f"wheelset {n}": ("primary", (axle.position, 0.0, 0.6)) for n, axle in enumerate(axles, 1)}
    ends["ground"] = "secondary", (-half, 0.0, 0.6)
    elements = []
    for end, (name, at) in ends.items():
        common = {"between": ("frame", end), "at": at}
        elements += [
            wt.vehicles.Spring(name=f"spring {end}", stiffness=(0.0, 0.0, NUMBERS[f"{name}_stiffness"]), **common),
            wt.vehicles.Damper(name=f"damper {end}", damping=(0.0, 0.0, NUMBERS[f"{name}_damping"]), **common),
        ]
    return wt.Wagon(bodies=(frame,), axles=axles, elements=tuple(elements))


TRACK_ALLOWED = {"default": (2e-6, 1.5e-3), "strict": (1e-7, 2e-4)}
"""Of the largest value, and of the largest acceleration: that jumps where a force begins, and moves with the event."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "rolling", "irregularity"),
    [
        (20.0, "point", wt.Corrugation(amplitude=2e-4, wavelength=0.1, start=0.05)),
        (33.0, "circle", wt.WheelFlat(length="60 mm", position=0.4, repeat=False)),
    ],
)
@pytest.mark.parametrize("first_sleeper", [0.15, 0.1234], ids=["even steps", "uneven steps"])
@pytest.mark.parametrize(("method", "allowed"), slow([("default", 3e-9), ("strict", 1e-11)], ("strict", 1e-11)))
def test_half_a_coach_is_a_bogie(speed, rolling, irregularity, method, allowed, first_sleeper):
    common = {
        "contact": wt.Hertz(constant_per_wheel=8e10, curvature=False), "speed": speed, "duration": 0.06,
        "irregularity": irregularity, "rolling": rolling,
        "track": TRACK.model_copy(update={"first_sleeper": first_sleeper}),
    }  # fmt: skip
    coach = wt.simulate(wt.Scenario(vehicle=half_coach(), profiles=wt.profiles.Cones(), **common), method)
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common), method)
    for side in ("left", "right"):
        own = coach.events.time[coach.events.side == side]
        assert len(own) == len(bogie.events.time) >= 2
        np.testing.assert_allclose(own, bogie.events.time, rtol=0, atol=allowed)
    times = np.linspace(0.0, 0.06, 301)
    one, other = coach.at(times), bogie.at(times)
    for side in ("left", "right"):
        force, rail = (one[name].sel(side=side) for name in ("normal_force", "rail_displacement"))
        np.testing.assert_allclose(2.0 * force, other.normal_force, rtol=0, atol=1e-4 * load)
        np.testing.assert_allclose(rail, other.rail_displacement, rtol=0, atol=1e-8)
    beside = {"rate": 4321.0, "rail": [0.5, -1.0], "seat": [1, -3]}
    own, under = coach.track(**beside), bogie.track(**beside)
    for name, values in under.data_vars.items():
        allowed = TRACK_ALLOWED[method]["acceleration" in name] * float(np.abs(values).max())
        for side in ("left", "right"):
            np.testing.assert_allclose(own[name].sel(side=side), values, rtol=0, atol=allowed)


ANOMALIES = (wt.tracks.MissingPad(seat=1), wt.tracks.HangingSleeper(seat=-1), wt.tracks.Scatter(pads=0.1, ballast=0.2))
UNEVEN = TRACK.model_copy(update={"cutoff": 1500.0, "anomalies": ANOMALIES})


@pytest.mark.slow
def test_half_a_coach_over_anomalies_of_the_track_is_a_bogie(tmp_path):
    common = {
        "contact": wt.Hertz(constant_per_wheel=8e10, curvature=False), "speed": 20.0, "duration": 0.03,
        "irregularity": wt.Corrugation(amplitude=2e-4, wavelength=0.1, start=0.05), "rolling": "point", "track": UNEVEN,
    }  # fmt: skip
    coach = wt.simulate(wt.Scenario(vehicle=half_coach(), profiles=wt.profiles.Cones(), **common), "strict")
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common), "strict")
    own = coach.events.time[coach.events.side == "left"]
    assert len(own) == len(bogie.events.time) > 4
    np.testing.assert_allclose(own, bogie.events.time, rtol=0, atol=5e-11)  # some 1e-11 of each march
    beside = {"rate": 4321.0, "rail": [0.5, -1.0], "seat": [1, -1, -3]}
    read, under = coach.track(**beside), bogie.track(**beside)
    for name, values in under.data_vars.items():
        allowed = TRACK_ALLOWED["strict"]["acceleration" in name] * float(np.abs(values).max())
        np.testing.assert_allclose(read[name].sel(side="left"), values, rtol=0, atol=allowed)
    assert any("come again every" in note for note in coach.notes)
    coach.save(tmp_path / "coach.nc")
    xr.testing.assert_identical(wt.load(tmp_path / "coach.nc").track(**beside), read)


@pytest.mark.slow
def test_below_a_sleeper_that_rolls_nothing_carries_where_the_ballast_is_gone_and_no_pad_where_it_is_missing():
    rolling = wt.tracks.Ballasted(**UNEVEN.model_dump() | {"sleeper_roll_inertia": 60.0, "anomalies": ANOMALIES[:2]})
    scene = wt.Scenario(
        vehicle=half_coach(), contact=wt.Hertz(constant_per_wheel=8e10), profiles=wt.profiles.Cones(), speed=20.0,
        duration=0.03, irregularity={"left": wt.Step(height=1e-4, position=0.1)}, track=rolling,
    )  # fmt: skip
    record = wt.simulate(scene, "strict")
    read = record.track(rate=2e3, seat=[1, -1, 2])
    largest = float(np.abs(read.pad_force.sel(seat=2)).max())
    assert largest > 1e4  # N
    assert float(np.abs(read.pad_force.sel(seat=1)).max()) < 1e-6 * largest
    assert float(np.abs(read.ballast_force.sel(seat=-1)).max()) < 1e-6 * largest
    apart = read.pad_force.sel(side="left", seat=2) - read.pad_force.sel(side="right", seat=2)
    assert float(np.abs(apart).max()) > 1.0
    assert float(record.energy.relative_imbalance) < 1e-7


HEIGHTS = wt.Step(height=1e-3, position=-1.0), wt.CosineBump(height=3e-4, length=0.4, start=-0.1)


@pytest.mark.parametrize("irregularity", HEIGHTS, ids=["step", "bump"])
@pytest.mark.parametrize(("method", "allowed"), [("default", 1e-6), ("strict", 1e-9)])
def test_half_a_coach_and_a_bogie_stand_on_heights_as_statics_have_it(irregularity, method, allowed):
    """Each wheel's contact bears its load and its spring, and the frame's forces and moments are zero."""
    common = {
        "contact": wt.Hertz(constant_per_wheel=8e10, curvature=False), "speed": 20.0, "duration": 0.02,
        "rolling": "point",
    }  # fmt: skip
    level = wt.Scenario(vehicle=half_coach(), profiles=wt.profiles.Cones(), **common)
    load = float(wt.simulate(level).static_forces[0].sum())
    bogie = wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), irregularity=irregularity, **common)
    coach, plane = (wt.simulate(one, method) for one in (level.replaced({"irregularity": irregularity}), bogie))
    times = np.linspace(0.0, 0.02, 201)[:-1]
    forces = plane.at(times).normal_force.values
    np.testing.assert_allclose(coach.at(times).normal_force.sum("side").values, forces, rtol=0, atol=allowed * load)

    half, rest = 0.5 * NUMBERS["wheelbase"], (load / 1.6e11) ** (2.0 / 3.0)
    course = irregularity.on_rail("left").course(0.46)
    heights = np.array([float(course.value(np.array([x]))[0]) for x in (0.0, -2.0 * half)])

    def left_over(u):
        springs = NUMBERS["primary_stiffness"] * (u[:2] - u[2] - half * np.array([u[3], -u[3]]))  # upwards in front
        contacts = 1.6e11 * np.maximum(rest + heights - u[:2], 0.0) ** 1.5 - load
        return [*(contacts - springs), springs.sum() - NUMBERS["secondary_stiffness"] * u[2], springs[0] - springs[1]]

    lifted = optimize.root(left_over, [*heights, 0.0, 0.0], tol=1e-12).x
    np.testing.assert_allclose(forces[0], 1.6e11 * (rest + heights - lifted[:2]) ** 1.5, rtol=1e-9)
    assert abs(forces[0] - load).max() > 20.0
