"""Hunting as a limit cycle: where it ends, against a search of the tests' own among motions that die away or do not."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march import run
from wheeltapper.march.wagon.assembly import MOTION_Y, PLACES

pytestmark = pytest.mark.filterwarnings("ignore:undamped")
SUBCRITICAL = wt.profiles.WheelRail(wheel="EN 15302 A", rail="54E1")


def scene(profiles=SUBCRITICAL, vehicle=None, **changes):
    fields = {
        "vehicle": vehicle or wt.vehicles.CooperriderCar(), "contact": wt.Hertz(constant_per_wheel=7e10),
        "creep": wt.creep.Polach(friction=0.15), "speed": 20.0, "duration": 0.1, "profiles": profiles,
    } | changes  # fmt: skip
    return wt.Scenario(**fields)


WHEELSET = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, stiffness=2e6, damping=2e4, load=1e5), contact=wt.Hertz(constant=1e11), speed=10.0,
    duration=0.1,
)  # fmt: skip


def marched(one, speed, seconds, state=None):
    """March a wagon; at first all wheelsets are 4 mm aside. Return its state, and how far wheelsets move in the end."""
    lowered = lower_wagon(one.replaced({"speed": float(speed), "duration": float(seconds)}))
    bodies = lowered.layout.bodies
    places = [bodies.index(f"wheelset {k}") * PLACES + MOTION_Y for k in range(1, 5)]
    if state is None:
        state = lowered.assembly.start.copy()
        state[places] += 4e-3
    found = run.march(lowered.assembly._replace(start=state))
    late = found.steps[:, 0] > seconds - 2.0
    return found.state, 0.5 * float(np.ptp(found.states[late][:, places], axis=0).max())


@pytest.mark.slow
def test_the_end_of_a_branch_is_where_hunting_dies_away_that_began_at_a_higher_speed():
    one = scene()
    found = wt.stability.limit_cycles(one, highest=56.0, step=2.0, progress=False)
    end = found.nonlinear_critical_speed
    assert end < 0.85 * wt.stability.critical_speed(one, progress=False)
    fast, _ = marched(one, 56.0, 20.0)
    slower, _ = marched(one, 46.0, 20.0, fast)
    assert marched(one, 0.99 * end, 60.0, slower)[1] < 1e-5
    assert marched(one, 1.01 * end, 60.0, slower)[1] == pytest.approx(float(found.amplitude[-1].max()), rel=0.1)
    amplitude = found.amplitude.max("wheelset")
    assert (np.diff(amplitude[:-1]) > 0.0).all()  # towards its end it grows
    assert float(amplitude[-1]) > 2e-3
    assert bool(found.settled.all())


@pytest.mark.slow
def test_between_the_steady_run_and_the_cycle_lies_the_least_disturbance_that_grows():
    one = scene()
    found = wt.stability.limit_cycles(one, highest=56.0, lowest=46.0, step=2.0, unstable=True, progress=False)
    assert np.isnan(found.nonlinear_critical_speed)  # it hunts at all these speeds
    assert np.isnan(found.unstable_amplitude.sel(speed=[56.0, 54.0, 52.0])).all()  # where the steady run is unstable
    found = found.sel(speed=[50.0, 48.0, 46.0])
    least, most = found.unstable_amplitude, found.amplitude.max("wheelset")
    assert (least < most).all()
    assert (np.diff(least) > 0.0).all()
    fast, _ = marched(one, 56.0, 20.0)
    cycle, size = marched(one, 48.0, 30.0, fast)
    assert size == pytest.approx(float(most.sel(speed=48.0)), rel=1e-2)
    steady = lower_wagon(one.replaced({"speed": 48.0})).assembly.start
    share = float(least.sel(speed=48.0)) / size
    assert marched(one, 48.0, 40.0, steady + 0.6 * share * (cycle - steady))[1] < 0.1 * float(least.sel(speed=48.0))
    assert 0.7 * size < marched(one, 48.0, 40.0, steady + 1.6 * share * (cycle - steady))[1] < 1.01 * size


@pytest.mark.slow
def test_a_branch_that_begins_at_the_steady_run_ends_at_the_linear_critical_speed():
    one = scene(wt.profiles.WheelRail())
    found = wt.stability.limit_cycles(one, highest=40.0, lowest=30.0, progress=False)
    assert found.nonlinear_critical_speed == pytest.approx(wt.stability.critical_speed(one, progress=False), rel=2e-3)
    assert (np.diff(found.amplitude.max("wheelset")) < 0.0).all()
    assert float(found.amplitude[-1].max()) < 5e-4


def test_another_disturbance_leads_to_the_same_cycle():
    one, other = (
        wt.stability.limit_cycles(scene(), highest=56.0, lowest=54.0, disturbance=aside, progress=False)
        for aside in ("3 mm", "4 mm")
    )
    np.testing.assert_allclose(one.amplitude, other.amplitude, rtol=2e-2)
    np.testing.assert_allclose(one.frequency, other.frequency, rtol=1e-2)
    axes = wt.plot(one).axes[0]
    assert "lateral amplitude" in axes.get_ylabel()
    both = wt.plot({"one": one, "other": other}).axes[0]
    assert len(both.lines) == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"lowest": 60.0, "highest": 50.0}, "lowest, highest: found 60 m/s and 50 m/s"),
        ({"step": "1 km"}, "step: "),
        ({"disturbance": -1.0}, "disturbance: "),
        ({"unstable": "yes"}, "unstable: "),
        ({"tolerance": 0.0}, "tolerance: "),
    ],
)
def test_wrong_arguments_are_refused(arguments, words):
    with pytest.raises(wt.InputError, match=words):
        wt.stability.limit_cycles(scene(), progress=False, **arguments)


def test_a_wheelset_alone_does_not_hunt_here():
    with pytest.raises(wt.InputError, match="a Wagon"):
        wt.stability.limit_cycles(WHEELSET, progress=False)


@pytest.mark.parametrize("vehicle", [wt.vehicles.CooperriderCar, wt.vehicles.Gz18])
def test_published_cars_stand_and_take_faults(vehicle):
    whole = vehicle().wagon()
    assert len(whole.axles) == 4
    lowered = lower_wagon(scene(vehicle=vehicle()))
    assert lowered.structure.prestress.weight == pytest.approx(9.81 * whole.mass)
    np.testing.assert_allclose(lowered.static_force, 9.81 * whole.mass / 8.0, rtol=1e-9)
    name = next(one.name for one in whole.elements if isinstance(one, wt.vehicles.Damper))
    assert len(vehicle(without=(name,)).wagon().elements) == len(whole.elements) - 1
    assert not any(isinstance(one, wt.vehicles.Damper) for one in vehicle(dampers=False).wagon().elements)
    # left is right
    ys = sorted(round(one.at[1], 9) for one in whole.elements)
    assert ys == sorted(-y for y in ys)
