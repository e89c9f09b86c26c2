"""Elements of wagons against closed forms and against each other: links, stops, series dampers, free play, flats."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.wagon import lower_wagon

AXLE = {"mass": 1500.0, "inertia": (1120.0, 112.0, 1120.0), "held": ("x", "y", "roll", "pitch", "yaw")}
PLACE = {"between": ("body", "wheelset 1"), "at": (0.0, 0.0, 0.8)}
HELD = ("x", "y", "roll", "pitch", "yaw")


def vehicle(*elements, mass=5000.0, free=()):
    held = tuple(motion for motion in HELD if motion not in free)
    body = wt.vehicles.Body(name="body", mass=mass, inertia=(1e3, 1e3, 1e3), position=(0.0, 0.0, 1.0), held=held)
    return wt.Wagon(bodies=(body,), axles=(wt.vehicles.Axle(position=0.0, **AXLE),), elements=elements)


def run(wagon, duration=0.2, method="strict", **changes):
    fields = {
        "contact": wt.Hertz(constant_per_wheel=7e10), "profiles": wt.profiles.Cones(moving_with="wheel"), "speed": 9.0,
        "irregularity": wt.CosineBump(height=5e-4, length=0.1, start=0.02),
    } | changes  # fmt: skip
    return wt.simulate(wt.Scenario(vehicle=wagon, duration=duration, **fields), method=method)


def spring(k, name="spring"):
    return wt.vehicles.Spring(name=name, stiffness=(0.0, 0.0, k), **PLACE)


def test_a_link_makes_one_mass_of_two():
    linked = run(vehicle(wt.vehicles.Link(name="link", along=("z",), **PLACE)))
    heavy = wt.vehicles.Axle(position=0.0, load=0.0, **(AXLE | {"mass": 6500.0}))
    whole = run(wt.Wagon(bodies=(), axles=(heavy,)))
    assert linked.static_force == pytest.approx(6500 * 9.81 / 2, rel=1e-12)
    assert len(whole.events.time) > 0
    np.testing.assert_allclose(linked.events.time, whole.events.time, rtol=0, atol=1e-10)
    history = linked.at(np.linspace(0, 0.2, 101))
    gap = history.displacement.sel(body="body", motion="z") - history.displacement.sel(body="wheelset 1", motion="z")
    assert float(np.abs(gap).max()) < 1e-14
    assert float(linked.energy.relative_imbalance) < 1e-8


def test_a_damper_in_series_with_a_stiff_spring_is_a_damper():
    # f' = k(v - f/c): the damper's force follows within c/k
    plain = wt.vehicles.Damper(name="damper", damping=(0.0, 0.0, 2e4), **PLACE)
    stiff = plain.model_copy(update={"series_stiffness": 1e10})
    one, other = (run(vehicle(spring(1e6), damper), duration=0.1) for damper in (plain, stiff))
    assert len(one.events.time) > 10
    np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=2 * 2e4 / 1e10)
    for record in (one, other):
        assert float(record.energy.dissipated) > 0.01
        assert float(record.energy.relative_imbalance) < 1e-8
    assert float(one.energy.dissipated) == pytest.approx(float(other.energy.dissipated), rel=1e-3)


def test_free_play_lies_between_a_damper_and_none():
    worn = {"damping": (0.0, 0.0, 2e4), "series_stiffness": 1e8}
    dampers = [wt.vehicles.Damper(name="d", free_play=play, **worn, **PLACE) for play in (0.0, 2e-4, 0.1)]
    lost = [float(run(vehicle(spring(1e6), damper)).energy.dissipated) for damper in dampers]
    assert lost[0] > 1.1 * lost[1] > 10.0
    assert lost[2] == pytest.approx(0.0, abs=1e-9)
    bare, loose = run(vehicle(spring(1e6))), run(vehicle(spring(1e6), dampers[2]))
    np.testing.assert_allclose(bare.events.time, loose.events.time, rtol=0, atol=1e-12)
    with_play = run(vehicle(spring(1e6), dampers[1]))
    assert float(with_play.energy.relative_imbalance) < 1e-8
    with pytest.raises(ValueError, match="free_play"):
        wt.vehicles.Damper(name="d", damping=(0, 0, 1e3), free_play=1e-3, **PLACE)


def test_a_stop_is_passed_corner_by_corner():
    # a stop of one slope throughout is a spring; one with a gap is felt beyond it only
    straight = wt.vehicles.Stop(
        name="stop", along="z", deflection=(0.0, 1e-4, 3e-4), force=(0.0, 100.0, 300.0), **PLACE
    )
    as_spring = run(vehicle(spring(1e6), spring(1e6, "more")))
    as_stop = run(vehicle(spring(1e6), straight))
    assert as_stop.static_force == as_spring.static_force
    np.testing.assert_allclose(as_stop.events.time, as_spring.events.time, rtol=0, atol=1e-10)
    gap = wt.vehicles.Stop(name="stop", along="z", deflection=(0.0, 2e-4, 4e-4), force=(0.0, 0.0, 2e4), **PLACE)
    felt = run(vehicle(spring(1e6), gap))
    assert float(felt.energy.relative_imbalance) < 1e-8
    between = felt.at(np.linspace(0, 0.2, 2001)).displacement.sel(motion="z")
    deflection = np.abs(between.sel(body="body") - between.sel(body="wheelset 1"))
    assert float(deflection.max()) > 2.2e-4
    assert np.abs(felt.events.time.values[-1] - run(vehicle(spring(1e6))).events.time.values[-1]) > 1e-6


def test_a_flat_on_one_wheel_is_felt_there():
    coach = wt.Wagon.erri_b176()
    flat = {"wheelset 3 left": wt.WheelFlat(depth=1e-4, position=-18.9, repeat=False)}
    scene = wt.Scenario(
        vehicle=coach, contact=wt.Hertz(constant_per_wheel=7.025e10), creep=wt.creep.Polach(), irregularity=flat,
        speed=5.0, duration=0.06,
    )  # fmt: skip
    record = wt.simulate(scene)
    first = record.events.isel(event=0)
    assert (int(first.wheelset), str(first.side.values)) == (3, "left")
    assert float(first.position) == pytest.approx(-18.9, abs=0.03)
    assert float(first.time) == pytest.approx(0.02, abs=0.006)
    repeated = scene.replaced({"irregularity.wheelset 3 left.0.repeat": True, "speed": 30.0, "duration": 0.3})
    seen = wt.simulate(repeated).peaks
    hard = seen.normal_force.values > 1.3 * record.static_force
    blows = seen.time.values[(seen.wheelset.values == 3) & (seen.side.values == "left") & hard]
    assert np.ptp(blows) > 2 * np.pi * 0.46 / 30.0


def test_a_vehicle_on_one_side_stands_askew_but_stands():
    body = wt.vehicles.Body(
        name="body", mass=5000.0, inertia=(2e3, 2e3, 2e3), position=(0.0, 0.1, 1.0), held=("x", "yaw")
    )
    springs = tuple(
        wt.vehicles.Spring(
            name=f"spring {y}", between=("body", "wheelset 1"), at=(0.0, y, 0.6), stiffness=(1e6, 1e6, 1e6),
            bending=(1e6, 1e6, 1e6),
        )
        for y in (1.0, -1.0)
    )  # fmt: skip
    axle = wt.vehicles.Axle(mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0)
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=(body,), axles=(axle,), elements=springs), contact=wt.Hertz(constant_per_wheel=7e10),
        creep=wt.creep.Polach(), speed=5.0, duration=0.2,
    )  # fmt: skip
    record = wt.simulate(scene)
    left, right = record.static_forces.values[0]
    assert left + right == pytest.approx(6500 * 9.81, rel=1e-3)
    assert left > 1.05 * right
    history = record.history(200)
    assert float((history.normal_force.max("time") - history.normal_force.min("time")).max()) < 1e-3
    assert len(lower_wagon(scene).notes) == 0


def test_six_wheelsets_fill_two_octets():
    bodies, axles, elements = [], [], []
    for number in range(6):
        x = -2.0 * number
        axles.append(wt.vehicles.Axle(position=x, **AXLE))
        place = {"between": ("frame", f"wheelset {number + 1}"), "at": (x, 0.0, 0.8)}
        elements.append(wt.vehicles.Spring(name=f"spring {number + 1}", stiffness=(0.0, 0.0, 1e6), **place))
    bodies.append(
        wt.vehicles.Body(
            name="frame", mass=60e3, inertia=(1e5, 1e6, 1e6), position=(-5.0, 0.0, 1.0), held=("x", "y", "roll", "yaw")
        )
    )
    wagon = wt.Wagon(bodies=tuple(bodies), axles=tuple(axles), elements=tuple(elements))
    record = run(
        wagon, 0.1, irregularity={"wheelset 6": wt.CosineBump(height=3e-4, length=0.1, start=-9.9)},
        profiles=wt.profiles.WheelRail(),
    )  # fmt: skip
    assert record.static_force == pytest.approx((60e3 / 6 + 1500) * 9.81 / 2, rel=1e-12)
    assert set(record.events.wheelset.values) == {6}
    assert record.history(1e3).normal_force.sizes["wheelset"] == 6
    assert float(record.energy.relative_imbalance) < 1e-8
    too_many = wagon.model_copy(update={"axles": tuple(wt.vehicles.Axle(position=-2.0 * k, **AXLE) for k in range(13))})
    with pytest.raises(wt.InputError, match="12 at most"):
        run(too_many)
