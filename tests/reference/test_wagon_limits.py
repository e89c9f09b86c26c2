"""The march of many bodies where it must be something known: the core model, and a wheelset that also rolls."""

import numpy as np
import pytest

import wheeltapper as wt
from tests.cases import reference
from tests.reference.test_wagon_on_rails import NUMBERS, half_coach

UNIT = {"between": ("wheelset 1", "ground"), "at": (0.0, 0.0, 0.46)}


def single(load, held, *elements, mass=1500.0):
    axle = wt.vehicles.Axle(mass=mass, inertia=(1120.0, 112.0, 1120.0), position=0.0, load=load, held=held)
    return wt.Wagon(bodies=(), axles=(axle,), elements=elements)


def damper(c):
    return wt.vehicles.Damper(name="damper", damping=(0.0, 0.0, c), **UNIT)


def spring(k):
    return wt.vehicles.Spring(name="spring", stiffness=(0.0, 0.0, k), **UNIT)


def fixed_arm(arm=0.75):
    return wt.profiles.Cones(arm=arm, moving_with="wheel")


@pytest.mark.parametrize(("method", "tolerance"), [("default", 1e-9), ("strict", 1e-11)])
def test_a_wheelset_that_rolls_on_one_rail_meets_the_reference_event_by_event(method, tolerance):
    case = reference()["static"]["roll_right_only_V9"]
    scene = wt.Scenario(
        vehicle=single(2 * 53011.0 - 1500 * 9.81, ("x", "y", "pitch", "yaw"), damper(8e3)),
        contact=wt.Hertz(constant_per_wheel=7.025e10),
        profiles=fixed_arm(),
        irregularity={"right": wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.01)},
        rolling="point",
        speed=9.0,
        duration=0.0294,
    )
    record = wt.simulate(scene, method=method)
    events = record.events
    expected = [event for event in case["events"] if float(event[0]) < 0.0294]
    assert [str(side)[0].upper() for side in events.side.values] == [side for _, side, _ in expected]
    kinds = {"release": "loss", "impact": "impact"}
    assert list(events.kind.values) == [kinds[kind] for _, _, kind in expected]
    np.testing.assert_allclose(events.time, [float(time) for time, _, _ in expected], atol=tolerance, rtol=0)
    for time, (z, roll, z_rate, roll_rate) in case["samples"].items():
        found = record.at(float(time)).isel(time=0).sel(body="wheelset 1")
        place = found.displacement.sel(motion=["z", "roll"]).values
        rate = found.velocity.sel(motion=["z", "roll"]).values
        # the reference counts y to the right: its roll is the other way round
        np.testing.assert_allclose(place, [z, -roll], rtol=0, atol=tolerance * 0.1)
        np.testing.assert_allclose(rate, [z_rate, -roll_rate], rtol=0, atol=tolerance * 200)


@pytest.mark.parametrize(
    ("irregularity", "rolling", "speed"),
    [
        (wt.CosineBump(height=2e-4, length=0.05, start=0.009), "point", 9.0),
        (wt.Step(height=1e-4, position=0.02), "circle", 5.0),
        (wt.Step(height=1e-4, position=0.02, ideal=True), "point", 5.0),
        (wt.WheelFlat(depth=1e-4, position=0.1), "circle", 5.0),
    ],
)
@pytest.mark.parametrize("deck", [False, True])
def test_one_wheelset_is_the_core_model(irregularity, rolling, speed, deck):
    shared = {"irregularity": irregularity, "rolling": rolling, "speed": speed, "duration": 0.08}
    if deck:
        shared["track"] = wt.FloatingDeck(mass=1500.0, stiffness=3e6, damping=2e4, start=0.01, length=0.2)
    core = wt.simulate(
        wt.Scenario(
            vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4, radius=0.46),
            contact=wt.Hertz(constant=1.405e11),
            **shared,
        ),
        method="strict",
    )
    vehicle = single(91_307.0, ("x", "y", "roll", "pitch", "yaw"), spring(2.44e6), damper(5e4))
    wagon = wt.simulate(
        wt.Scenario(vehicle=vehicle, contact=wt.Hertz(constant_per_wheel=0.7025e11), profiles=fixed_arm(), **shared),
        method="strict",
    )
    left = wagon.events.isel(event=wagon.events.side.values == "left")
    assert list(left.kind.values) == list(core.events.kind.values)
    assert len(core.events.time) >= 2
    np.testing.assert_allclose(left.time, core.events.time, rtol=0, atol=1e-9)
    times = np.linspace(0.0, 0.08, 401)
    one, other = wagon.at(times), core.at(times)
    scale = core.static_force
    np.testing.assert_allclose(one.normal_force.sum(("wheelset", "side")), other.normal_force, atol=1e-7 * scale)
    height = one.displacement.sel(body="wheelset 1", motion="z")
    np.testing.assert_allclose(height, other.wheel_displacement, rtol=0, atol=1e-9 * 8.3e-5 * 100)
    forces = wagon.peaks.isel(peak=wagon.peaks.side.values == "left").normal_force
    np.testing.assert_allclose(2 * forces, core.peaks.normal_force, rtol=1e-9 * 100)


def test_a_second_wheelset_far_behind_meets_the_same_later():
    axle = {"mass": 1500.0, "inertia": (1120.0, 112.0, 1120.0), "load": 91_307.0, "held": ("x", "y", "pitch", "yaw")}
    axles = tuple(wt.vehicles.Axle(position=x, **axle) for x in (0.0, -0.31))
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=(), axles=axles),
        contact=wt.Hertz(constant_per_wheel=7.025e10),
        profiles=fixed_arm(),
        irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.02),
        speed=9.0,
        duration=0.2,
    )
    record = wt.simulate(scene, method="strict")
    first, second = (
        record.events.time.values[(record.events.wheelset.values == n) & (record.events.side.values == "left")]
        for n in (1, 2)
    )
    count = int((first < 0.2 - 0.31 / 9).sum())
    assert count >= 10
    np.testing.assert_allclose(second[:count], first[:count] + 0.31 / 9, rtol=0, atol=1e-9)


def as_core(irregularity, duration, method="strict"):
    vehicle = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=0.0, radius=0.46)
    scene = wt.Scenario(
        vehicle=vehicle, contact=wt.Hertz(constant=1.405e11), irregularity=irregularity, rolling="circle", speed=9.0,
        duration=duration,
    )  # fmt: skip
    return wt.simulate(scene, method=method).events


def as_wagon(irregularity, duration, method):
    vehicle = single(91_307.0, ("x", "y", "roll", "pitch", "yaw"), spring(2.44e6))
    scene = wt.Scenario(
        vehicle=vehicle, contact=wt.Hertz(constant_per_wheel=0.7025e11), profiles=fixed_arm(),
        irregularity=irregularity, rolling="circle", speed=9.0, duration=duration,
    )  # fmt: skip
    record = wt.simulate(scene, method=method)
    events = record.events
    assert (events.side.values == "left").sum() == (events.side.values == "right").sum()
    return events.isel(event=events.side.values == "left"), record


def threshold(build, low, high, count, duration):
    """Return the parameter from which on the core model has more than `count` events."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        if len(as_core(build(middle), duration).time) > count:
            high = middle
        else:
            low = middle
    return high


def one_bump(height):
    return wt.CosineBump(height=height, length=0.05, start=0.009)


def under_a_flight(height):
    """Return a bump that lets the wheel fly for 2 ms, and a shorter one under its flight."""
    return [one_bump(8e-5), wt.CosineBump(height=height, length=0.01, start=0.044)]


@pytest.mark.slow
@pytest.mark.parametrize(("method", "beyond"), [("default", 1e-5), ("strict", 1e-8)])
@pytest.mark.parametrize("brief", ["loss", "impact"])
def test_a_contact_that_changes_twice_within_a_step_is_found(method, beyond, brief):
    if brief == "loss":
        build, low, high, count, duration = one_bump, 1e-6, 2e-4, 0, 0.0068
    else:
        build, low, high, count, duration = under_a_flight, 0.0, 5e-5, 1, 0.0064
    least = threshold(build, low, high, count, duration)
    none, _ = as_wagon(build(least * (1 - beyond)), duration, method)
    assert len(none.time) == count
    expected = as_core(build(least * (1 + beyond)), duration)
    assert len(expected.time) == count + 2
    found, _ = as_wagon(build(least * (1 + beyond)), duration, method)
    assert list(found.kind.values) == list(expected.kind.values)
    middle, length = expected.time.values[-2:].mean(), np.ptp(expected.time.values[-2:])
    assert length < 1e-5  # a step is ten times as long
    assert np.ptp(found.time.values[-2:]) == pytest.approx(length, rel=0.03)
    assert found.time.values[-2:].mean() == pytest.approx(middle, abs=0.02 * length)


DECK = wt.FloatingDeck(mass=15_000.0, stiffness=1.5e7, damping=1e5)


@pytest.mark.parametrize("track", [wt.StiffTrack(), DECK], ids=["stiff", "deck"])
@pytest.mark.parametrize(
    "irregularity",
    [
        wt.CosineBump(height=3e-4, length=0.1, start=0.1),
        wt.Corrugation(amplitude=1e-4, wavelength=0.1, start=0.05),
        {"wheelset 2": wt.WheelFlat(length="60 mm", position=-2.0, repeat=False)},
    ],
    ids=["bump", "corrugation", "flat"],
)
def test_half_a_coach_that_cannot_roll_is_a_bogie_on_a_stiff_track_and_on_a_deck(track, irregularity):
    common = {
        "track": track, "contact": wt.Hertz(constant_per_wheel=8e10, curvature=False), "speed": 20.0,
        "duration": 0.04, "irregularity": irregularity,
    }  # fmt: skip
    coach = wt.simulate(wt.Scenario(vehicle=half_coach(), profiles=wt.profiles.Cones(), **common), "strict")
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common), "strict")
    own = coach.events.isel(event=coach.events.side.values == "left")
    assert own.kind.values.tolist() == bogie.events.kind.values.tolist()
    assert len(bogie.events.time) >= 4
    np.testing.assert_allclose(own.time, bogie.events.time, rtol=0, atol=1e-11)
    times = np.linspace(0.0, 0.04, 401)
    one, other = coach.at(times).normal_force.sum("side"), bogie.at(times).normal_force
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-7 * load)


@pytest.mark.parametrize("track", [wt.StiffTrack(), DECK], ids=["stiff", "deck"])
def test_the_same_under_a_mirrored_vehicle_gives_mirrored_forces(track):
    """Along the vehicle, too: without creep nothing knows which way it goes, but when each wheelset meets its bump."""
    places, masses, loads = (0.0, -1.7, -4.1), (1300.0, 1500.0, 1100.0), (5.2e4, 4e4, 6e4)
    held, primary = ("x", "y", "roll", "yaw"), ((2e6, 2e4), (3e6, 1e4), (1.5e6, 4e4))
    secondary, middle, when = ((-1.0, 6e5, 2e4), (-3.0, 4e5, 1e4)), -1.6, (0.005, 0.012, 0.009)

    def forces(mirrored):
        order = [2, 1, 0] if mirrored else [0, 1, 2]

        def place(x):
            return places[-1] - x if mirrored else x

        axles = tuple(
            wt.vehicles.Axle(
                mass=masses[i], inertia=(800.0, 90.0, 800.0), position=place(places[i]), held=(*held, "pitch"),
                load=loads[i],
            ) for i in order
        )  # fmt: skip
        frame = wt.vehicles.Body(
            name="frame", mass=5e3, inertia=(2e3, 6e3, 8e3), position=(place(middle), 0.0, 0.6), held=held
        )
        ends = [(f"wheelset {n}", place(places[i]), *primary[i]) for n, i in enumerate(order, 1)]
        ends += [("ground", place(x), k, c) for x, k, c in secondary]
        elements = []
        for n, (end, x, k, c) in enumerate(ends):
            common = {"between": ("frame", end), "at": (x, 0.0, 0.6)}
            elements.append(wt.vehicles.Spring(name=f"spring {n}", stiffness=(0.0, 0.0, k), **common))
            elements.append(wt.vehicles.Damper(name=f"damper {n}", damping=(0.0, 0.0, c), **common))
        bumps = {
            f"wheelset {n}": wt.CosineBump(height=3e-4, length=0.1, start=place(places[i]) + 20.0 * when[i])
            for n, i in enumerate(order, 1)
        }
        wagon = wt.Wagon(bodies=(frame,), axles=axles, elements=tuple(elements))
        scene = wt.Scenario(
            vehicle=wagon, track=track, contact=wt.Hertz(constant_per_wheel=8e10, curvature=False), irregularity=bumps,
            profiles=wt.profiles.Cones(), speed=20.0, duration=0.04,
        )  # fmt: skip
        found = wt.simulate(scene).at(np.linspace(0.0, 0.04, 401)).normal_force.values
        return found[:, ::-1] if mirrored else found

    plain, mirrored = forces(False), forces(True)
    assert (plain == 0.0).any()
    np.testing.assert_allclose(mirrored, plain, rtol=0, atol=1e-9 * plain[0].max())
