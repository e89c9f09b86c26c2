"""What must hold for every wagon: energy, mirrors, convergence, faults as changed elements."""

import numpy as np
import pytest

import wheeltapper as wt

COACH = wt.Wagon.erri_b176(1500.0)
STEP = wt.Step(height=1e-4, position=0.02)


def coach(irregularity=STEP, vehicle=COACH, duration=0.04, **changes):
    fields = {
        "contact": wt.Hertz(constant_per_wheel=7.025e10), "creep": wt.creep.Polach(friction=0.35), "speed": 5.0,
    } | changes  # fmt: skip
    return wt.Scenario(vehicle=vehicle, irregularity=irregularity, duration=duration, **fields)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"irregularity": {"right": STEP}, "contact": wt.Hertz()},
        {"creep": None},
        {"creep": wt.creep.Polach(friction=0.1, wheel_spin="full")},
        {"creep": wt.creep.ShenHedrickElkins()},
        {"creep": wt.creep.KalkerLinear()},
        {"creep": wt.creep.Fastsim(friction=0.3)},
        {"vehicle": wt.Wagon.erri_b176(series_springs=True)},
        {"track": wt.FloatingDeck(mass=3e3, stiffness=1.2e7, damping=1e4, start=0.01, length=0.15)},
        {
            "irregularity": {"wheelset 1 left": wt.CosineBump(height=2e-4, length=0.05, start=0.01)},
            "rolling": "point",
            "contact": wt.Hertz(constant_per_wheel=7e10, curvature=True),
        },
    ],
)
def test_energy_closes(changes):
    record = wt.simulate(coach(**changes), method="strict")
    assert record.outcome.name == "COMPLETED"
    assert len(record.events.time) > 0
    assert float(record.energy.relative_imbalance) < 1e-8
    assert float(record.energy.dissipated_creep) >= -1e-12
    default = wt.simulate(coach(**changes))
    assert float(default.energy.relative_imbalance) < 1e-6


def test_a_mirrored_scenario_gives_mirrored_results():
    bump = wt.CosineBump(height=1.5e-4, length=0.05, start=0.01)
    one, other = (
        wt.simulate(coach({side: bump}, duration=0.03, rolling="point", speed=9.0)) for side in ("left", "right")
    )
    assert len(one.events.time) == len(other.events.time) >= 2
    assert list(one.events.side.values) == [{"left": "right", "right": "left"}[s] for s in other.events.side.values]
    np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=1e-13)
    times = np.linspace(0.0, 0.03, 61)
    a, b = one.at(times), other.at(times)
    np.testing.assert_allclose(
        a.normal_force.sel(side="left"), b.normal_force.sel(side="right"), rtol=0, atol=1e-9 * one.static_force
    )
    for motion, sign in (("x", 1), ("y", -1), ("z", 1), ("roll", -1), ("pitch", 1), ("yaw", -1)):
        place, mirrored = (r.displacement.sel(motion=motion).values for r in (a, b))
        np.testing.assert_allclose(place, sign * mirrored, rtol=0, atol=1e-14 + 1e-9 * np.abs(place).max())


def test_symmetric_excitation_stays_symmetric():
    record = wt.simulate(coach(duration=0.05))
    history = record.history(2e4)
    assert float(np.abs(history.displacement.sel(motion=["y", "roll", "yaw"])).max()) < 1e-13
    lateral = history.lateral_force
    touching = history.normal_force.min("side") > 0
    assert float(np.abs(lateral.sum("side")).max()) < 1e-6
    ratio = (lateral.sel(side="left") / history.normal_force.sel(side="left")).where(touching)
    assert float(ratio.max() - ratio.min()) < 0.01 * abs(float(ratio.mean()))
    assert -0.0075 < float(ratio.mean()) < -0.004


def test_event_times_converge_with_the_tolerance(monkeypatch):
    from wheeltapper.lower import wagon

    scene = coach(vehicle=COACH.without_dampers(), duration=0.15)
    found = {}
    for method, tolerance in (("default", None), ("strict", None), ("best", 1e-13)):
        monkeypatch.setitem(wagon.TOLERANCES, "strict", tolerance or wagon.TOLERANCES["strict"])
        events = wt.simulate(scene, method="strict" if method == "best" else method).events
        order = np.lexsort((events.time.values, events.contact.values))
        found[method] = events.time.values[order]
    assert len(found["best"]) >= 80
    default, strict = (np.median(np.abs(found[m] - found["best"])) for m in ("default", "strict"))
    assert default < 1e-8
    assert strict < 1e-10
    assert strict < default


def test_nothing_changes_on_level_rails():
    record = wt.simulate(coach((), duration=0.5, speed=30.0))
    assert len(record.events.time) == 0
    history = record.history(100)
    np.testing.assert_allclose(history.normal_force, record.static_forces.values[None].repeat(51, 0), rtol=1e-9)
    assert record.static_force == pytest.approx(53_010.7875, rel=1e-12)


def test_klingel_waves_of_a_wheelset_on_cones():
    conicity, arm, radius = 0.05, 0.75, 0.46
    axle = wt.vehicles.Axle(mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0, radius=radius)
    soft = wt.vehicles.Spring(name="k", between=("wheelset 1", "ground"), at=(0, 0, radius), stiffness=(1e5, 0, 0))
    kink = wt.Scenario(
        vehicle=wt.Wagon(bodies=(), axles=(axle,), elements=(soft,)),
        contact=wt.Hertz(constant_per_wheel=9e10),
        creep=wt.creep.KalkerLinear(wheel_spin="full"),
        profiles=wt.profiles.Cones(conicity=conicity, arm=arm),
        # a small dip under one wheel sets it swaying
        irregularity={"left": wt.CosineBump(height=-2e-5, length=0.5, start=0.2)},
        rolling="point",
        speed=2.0,
        duration=60.0,
    )
    record = wt.simulate(kink)
    times = np.linspace(5.0, 60.0, 5501)
    sway = record.at(times).displacement.sel(body="wheelset 1", motion="y").values
    crossings = np.flatnonzero((sway[:-1] < 0) & (sway[1:] >= 0))
    exact = times[crossings] - sway[crossings] * np.diff(times)[0] / (sway[crossings + 1] - sway[crossings])
    assert len(exact) >= 5
    wavelength = 2.0 * np.diff(exact).mean()
    assert wavelength == pytest.approx(2 * np.pi * np.sqrt(radius * arm / conicity), rel=1e-3)


def test_many_contacts_that_open_nearly_together_lose_no_event():
    wave = wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=-22.0)
    scene = coach(wave, wt.Wagon.erri_b176(1500.0).without_dampers(), 0.06, speed=9.0, rolling="point")
    one, other = (wt.simulate(scene, method=method).events for method in ("default", "strict"))
    assert len(one.time) == len(other.time) > 100
    orders = [np.lexsort((events.time.values, events.contact.values)) for events in (one, other)]
    kinds = [events.kind.values[order] for events, order in zip((one, other), orders, strict=True)]
    assert list(kinds[0]) == list(kinds[1])
    for contact in np.unique(one.contact.values):  # losses and impacts take turns
        turns = one.kind.values[one.contact.values == contact]
        assert all(a != b for a, b in zip(turns[:-1], turns[1:], strict=True))
        assert turns[0] == "loss"


@pytest.mark.slow
def test_a_hunting_coach_hits_its_rails_with_its_flanges():
    kick = {"left": wt.CosineBump(height=1e-3, length=3.0, start=1.0)}
    scene = coach(kick, wt.Wagon.erri_b176(), 1.5, speed=95.0)
    assert wt.stability.critical_speed(scene) < 95.0
    record = wt.simulate(scene)
    assert {"tread", "flange"} == set(record.events.surface.values)
    assert float(record.energy.relative_imbalance) < 1e-6
    history = record.history(2000)
    assert float(history.flange_force.max()) > record.static_force
    on_flange = history.flange_force.values > 0.0
    assert float(history.lateral_shift.values[on_flange].min()) > 5e-3  # m: the clearance
    pushed = history.lateral_force.sel(side="left").values[on_flange[:, :, 0]]
    assert np.median(pushed) < 0.0  # the left rail pushes to the right
    # T-gamma of treads and flanges over the way is what friction takes
    fine = record.history(5000)
    lost = scene.speed * float(fine.t_gamma.sum(("wheelset", "side")).integrate("time"))
    assert lost == pytest.approx(float(record.energy.dissipated_creep), rel=1e-3)
    assert float(fine.flange_t_gamma.sum()) > 0.3 * float(fine.t_gamma.sum())
    # what all rails push upwards, with the weight, is what all bodies gain
    vehicle = scene.vehicle
    masses = [part.mass for part in (*vehicle.bodies, *vehicle.axles)]
    gained = sum(
        mass * history.acceleration.sel(body=name, motion="z") for name, mass in zip(vehicle.names, masses, strict=True)
    )
    weight = vehicle.gravity * sum(masses)
    np.testing.assert_allclose(history.vertical_force.sum(("wheelset", "side")) - weight, gained, atol=1e-6 * weight)


@pytest.mark.slow
def test_the_picture_of_a_wagon_and_of_its_reduced_model(tmp_path):
    scene = coach(duration=0.03)
    record = wt.simulate(scene)
    figure = wt.plot(record, tmp_path / "wagon.png")
    assert len(figure.axes) == 5
    both = wt.plot(record, tmp_path / "both.png", against=wt.simulate(wt.reduced(scene)), wheelset=1)
    assert "largest differences: peaks" in both._suptitle.get_text()
    assert (tmp_path / "both.png").stat().st_size > 10_000
    with pytest.raises(wt.InputError, match="core model"):
        wt.plot(record, against=record)


def test_a_saved_wagon_answers_as_before(tmp_path):
    record = wt.simulate(coach({"right": STEP}, duration=0.02))
    record.save(tmp_path / "wagon.nc")
    again = wt.load(tmp_path / "wagon.nc")
    assert again.scenario == record.scenario
    assert str(again) == str(record)
    times = np.linspace(0.0, 0.02, 41)
    for name, values in record.at(times).data_vars.items():
        np.testing.assert_array_equal(values, again.at(times)[name])


def test_comfort_of_a_record_is_that_of_its_acceleration():
    record = wt.simulate(coach(duration=1.2))
    found = record.comfort(rate=1000)
    assert float(found.vibration_total_value) > 0.0
    assert np.isnan(float(found.mean_comfort))  # five minutes are asked, 5 s at least
    aside = record.comfort(at=(9.5, 1.0, -0.6), rate=1000)
    assert float(aside.vibration_total_value) > float(found.vibration_total_value)


def test_a_smaller_wheelset_rolls_faster_but_does_not_slip():
    worn = coach((), duration=0.01).replaced({"vehicle.axles.wheelset 2.radius": 0.43})
    record = wt.simulate(worn)
    history = record.history(1e3)
    plain = wt.simulate(coach((), duration=0.01)).history(1e3)
    found, expected = (h.longitudinal_creepage.sel(wheelset=2).values for h in (history, plain))
    np.testing.assert_allclose(found, expected, atol=2e-5)
    ratio = history.spin_creepage.sel(wheelset=2) / plain.spin_creepage.sel(wheelset=2)
    np.testing.assert_allclose(ratio, 0.46 / 0.43, rtol=1e-3)


@pytest.mark.parametrize("track", [wt.StiffTrack(), wt.tracks.Slab(**wt.tracks.Slab.example, cutoff=1000, bays=160)])
@pytest.mark.parametrize("start", [-0.12, -0.1, -0.075])
@pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
def test_wheels_that_nothing_holds_stand_in_a_dip_deeper_than_their_indentation(track, start):
    """They begin in the static state of a wheelset there; above the dip there is no spring that would tell of it."""
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307), track=track, speed=20.0, duration=0.002, rolling="point",
        contact=wt.Hertz(constant_per_wheel=7e10, curvature=False),
        irregularity=wt.Corrugation(amplitude=-2e-4, wavelength=0.1, start=start),
    )  # fmt: skip
    axle = wt.vehicles.Axle(
        mass=1500, inertia=(800.0, 90.0, 800.0), position=0.0, load=91_307, held=("x", "y", "roll", "pitch", "yaw")
    )  # fmt: skip
    wagon = scene.replaced({"vehicle": wt.Wagon(bodies=(), axles=(axle,)), "profiles": wt.profiles.Cones()})
    times = np.linspace(0.0, 0.002, 9)
    plane, own = (wt.simulate(one, "strict").at(times).normal_force.values for one in (scene, wagon))
    assert plane[0] == pytest.approx(91_307 + 1500 * 9.81)
    np.testing.assert_allclose(own[:, 0, 0], 0.5 * plane.ravel(), rtol=0, atol=0.1)


def test_a_coach_stands_with_one_wheel_on_a_step():
    """Newton's method from level rails lifted the other wheel, and found no state."""
    step = wt.Step(height="10 mm", position=-0.1)
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(), creep=wt.creep.Polach(friction=0.35), speed=20.0,
        duration=0.001, irregularity={"left": step},
    )  # fmt: skip
    record = wt.simulate(scene, "strict")
    found = record.at([0.0])
    assert np.abs(found.acceleration.values).max() < 1e-9
    assert found.normal_force.values[0].sum() == pytest.approx(float(record.static_forces.sum()), rel=1e-4)
    left, right = found.normal_force.values[0, 0]
    assert left > 1.2 * right
