"""Guiding forces, Y/Q and T-gamma: geometry, momentum and energy, Fourier's filter, loops over a finer grid."""

import json
import warnings

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.record.assessment.guidance import PERCENTILES, statistics
from wheeltapper.record.simulate import ModelWarning

CONICITY, ARM, RADIUS, LOAD = 0.05, 0.75, 0.46, 1e5
AXLE = wt.vehicles.Axle(mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0, load=LOAD, radius=RADIUS)
CENTRE = {"between": ("wheelset 1", "ground"), "at": (0.0, 0.0, RADIUS)}
HELD = (
    wt.vehicles.Spring(name="springs", stiffness=(1e7, 5e6, 0.0), bending=(0.0, 0.0, 1e7), **CENTRE),
    wt.vehicles.Damper(name="dampers", damping=(1e5, 1e5, 4e4), **CENTRE),
)


def wheelset(irregularity=(), elements=HELD, **changes):
    fields = {
        "contact": wt.Hertz(constant_per_wheel=9e10), "profiles": wt.profiles.Cones(conicity=CONICITY, arm=ARM),
        "rolling": "point", "speed": 10.0, "duration": 1.0, "vehicle.elements": elements,
    } | changes  # fmt: skip
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=(), axles=(AXLE,)), contact=wt.Hertz(), irregularity=irregularity, speed=1, duration=1
    )
    return scene.replaced(fields)


@pytest.fixture(scope="module")
def swaying():
    """A wheelset over a dip under its right wheel, with creep."""
    dip = wt.CosineBump(height=-1e-3, length=1.0, start=2.0)
    return wt.simulate(wheelset({"right": dip}, creep=wt.creep.Polach(friction=0.35)))


def test_without_friction_y_over_q_is_the_slope_of_the_wheel_on_its_rail():
    found = wt.simulate(wheelset(duration=0.5)).guidance()
    np.testing.assert_allclose(found.derailment_quotient.dropna("time"), CONICITY, rtol=1e-9)
    np.testing.assert_allclose(found.wheel_force.dropna("time"), (LOAD + AXLE.mass * 9.81) / 2.0, rtol=1e-9)
    np.testing.assert_allclose(found.unloading.dropna("time"), 0.0, atol=1e-9)
    assert float(abs(found.sum_of_guiding_forces).max()) < 1e-6
    assert float(abs(found.t_gamma).max()) == 0.0


def test_on_a_rail_that_lies_higher_the_slope_is_that_of_the_rolled_wheelset():
    hill = 4e-3
    record = wt.simulate(wheelset({"left": wt.CosineBump(height=hill, length=20.0, start=0.1)}, duration=1.07))
    time = 1.01  # s: on the crest
    at = record.guidance(window=0).sel(time=time, method="nearest").sel(wheelset=1)
    body = record.at([time]).displacement.sel(body="wheelset 1").squeeze()
    roll, shift = float(body.sel(motion="roll")), float(body.sel(motion="y"))
    # δ is the same but for the difference of the two forces: R·φ = hill, less the lift of the cones as they shift
    cone_lift = 2 * CONICITY * (shift + RADIUS * roll)
    assert roll == pytest.approx((hill + cone_lift) / (2 * ARM), rel=2e-2)
    np.testing.assert_allclose(at.derailment_quotient, [CONICITY + roll, CONICITY - roll], rtol=2e-3)
    assert float(at.sum_of_guiding_forces) == pytest.approx(-5e6 * shift, rel=2e-2)


def test_guiding_forces_change_the_momentum_of_all_bodies():
    bump = wt.CosineBump(height=1e-3, length=1.0, start=0.3)
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(constant_per_wheel=7.025e10),
        creep=wt.creep.Polach(friction=0.35), irregularity={"left": bump}, speed=40.0, duration=0.1,
    )  # fmt: skip
    record = wt.simulate(scene)
    found, moved = record.guidance(cutoff=None, window=0, rate=1e4), record.history(1e4).acceleration.sel(motion="y")
    bodies = {body.name: body.mass for body in scene.vehicle.bodies}
    bodies |= {f"wheelset {i}": axle.mass for i, axle in enumerate(scene.vehicle.axles, 1)}
    gained = sum(mass * moved.sel(body=name) for name, mass in bodies.items())
    total = -found.sum_of_guiding_forces.sum("wheelset")
    assert float(abs(gained).max()) > 500.0
    np.testing.assert_allclose(total, gained, atol=1e-6 * float(abs(gained).max()))
    # what friction takes, over the way
    worn = float(found.t_gamma.sum(("surface", "wheelset", "side")).integrate("time")) * scene.speed
    assert worn == pytest.approx(float(record.energy.dissipated_creep), rel=1e-4)


def test_t_gamma_over_the_way_is_the_energy_that_friction_dissipates(swaying):
    found = swaying.guidance(window=0, rate=2e4)
    lost = found.t_gamma.sum(("surface", "wheelset", "side"))
    worn = float(lost.integrate("time")) * swaying.scenario.speed
    assert worn == pytest.approx(float(swaying.energy.dissipated_creep), rel=1e-5)
    assert float(found.t_gamma.min()) >= 0.0
    history = swaying.at(found.time)  # the tread alone: cones have no flange
    spin = -history.spin_moment * history.spin_creepage
    slip = -history.longitudinal_force * history.longitudinal_creepage
    slip -= history.lateral_creep_force * history.lateral_creepage
    np.testing.assert_allclose(found.spin_t_gamma, spin, atol=1e-12)
    np.testing.assert_allclose(found.t_gamma.sel(surface="tread"), spin + slip, rtol=1e-9, atol=1e-12)


def fourier_low_pass(samples, rate, cutoff):
    """Return samples without what a fourth-order Butterworth filter without phase takes, 1/√2 at the cut-off."""
    before = len(samples)
    padded = np.concatenate([np.repeat(samples[:1], before, 0), samples, np.repeat(samples[-1:], before, 0)])
    frequency = np.fft.rfftfreq(len(padded), 1.0 / rate)
    left = 1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * (frequency / cutoff) ** 4)
    spectrum = np.fft.rfft(padded - padded[0], axis=0) * left[:, None]
    return (np.fft.irfft(spectrum, len(padded), axis=0) + padded[0])[before : 2 * before]


def test_filters_and_means_are_those_of_fourier_and_of_a_loop_over_a_finer_grid(swaying):
    window, rate, speed = 2.0, 4e4, swaying.scenario.speed
    history = swaying.history(rate)
    outwards = -history.lateral_force.values[:, 0] * [1.0, -1.0]
    guiding, pressing = (
        fourier_low_pass(values, rate, 20.0) for values in (outwards, history.vertical_force.values[:, 0])
    )
    found = swaying.guidance(window=window)
    assert float(found.guiding_force.max() - found.guiding_force.min()) > 1000.0
    coarse = slice(None, None, round(rate / found.rate))
    read = found.time < 1.0 - 1.0 / 20.0  # what follows depends on what follows the run
    np.testing.assert_allclose(found.guiding_force[read, 0], guiding[coarse][read], atol=2.0)
    np.testing.assert_allclose(found.wheel_force[read, 0], pressing[coarse][read], atol=20.0)
    assert np.isnan(found.wheel_force[found.time > 1.0 - 0.99 / 20.0]).all()
    half = round(0.5 * window / speed * rate)
    sums = (guiding * [1.0, -1.0]).sum(axis=1)
    for time in np.arange(0.15, 0.85, 0.05):
        k = round(time * rate)
        quotient = np.trapezoid(guiding[k - half : k + half + 1] / pressing[k - half : k + half + 1], axis=0)
        at = found.sel(time=time, method="nearest").sel(wheelset=1)
        np.testing.assert_allclose(at.derailment_quotient, quotient / (2 * half), atol=3e-4 * CONICITY)
        total = np.trapezoid(sums[k - half : k + half + 1]) / (2 * half)
        assert float(at.sum_of_guiding_forces) == pytest.approx(total, abs=1.0)


def test_a_mirrored_run_has_mirrored_guiding_forces():
    dip = wt.CosineBump(height=-1e-3, length=1.0, start=2.0)
    creep = wt.creep.Polach(friction=0.35)
    left, right = (
        wt.simulate(wheelset({side: dip}, creep=creep, duration=0.5)).guidance() for side in ("left", "right")
    )
    assert float(abs(left.sum_of_guiding_forces).max()) > 100.0
    for name in ("guiding_force", "wheel_force", "derailment_quotient", "t_gamma"):
        one, other = left[name].sel(side="left"), right[name].sel(side="right")
        np.testing.assert_allclose(one, other, atol=1e-7 * float(abs(one).max()), err_msg=name)
    np.testing.assert_allclose(left.sum_of_guiding_forces, -right.sum_of_guiding_forces, atol=1e-3)


def test_a_wheel_that_is_off_its_rail_has_no_finite_quotient():
    fall = {"right": wt.Step(height="-10 mm", position=5.0), "left": wt.Step(height="-10 mm", position=5.0)}
    light = wheelset(fall, (), **{"vehicle.axles.0.load": 0.0}, duration=0.6)
    record = wt.simulate(light)
    found = record.guidance(rate=1e4)
    lifted = (found.wheel_force <= 0.0).values[:, 0, 0]
    assert 0.02 < lifted.mean() < 0.5
    means = found.derailment_quotient.values[:, 0, 0]
    assert np.isnan(means).sum() == 2499  # half of the window at both ends, and where the filter settles, 49.8 ms
    touched = np.convolve(lifted[:-499], np.ones(2001), "valid") > 0.0  # any of the window, 2 m
    assert 0.1 < touched.mean() < 0.9
    np.testing.assert_array_equal(np.isinf(means[1000:-1499]), touched)
    assert np.isinf(statistics(found).derailment_quotient.sel(statistic="largest")).all()
    assert float(found.unloading.max()) > 1.0
    rule = wt.limits.Rule("ours", "derailment_quotient", 0.8, "stop", sliding_mean=2.0)
    check = wt.limits.check(record, [rule], rate=1e4)
    assert check["ours"].exceeded
    assert "exceeded: ours: verify current edition" in str(check)
    assert json.loads(json.dumps(check.to_dict(), allow_nan=False))["limits"][0]["value"] is None
    wt.plot(check)


@pytest.fixture(scope="module")
def ending():
    """A coach with a flat, in runs that end from just before its second strike to 45 ms after it."""
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(), creep=wt.creep.Polach(friction=0.35), speed=20.0, duration=1,
        irregularity={"wheelset 1 right": wt.WheelFlat(length="40 mm", position=1.5)},
    )  # fmt: skip
    second = (1.5 + 2.0 * np.pi * 0.46) / 20.0
    return [wt.simulate(scene.replaced({"duration": float(end)})) for end in second + np.linspace(-2e-3, 45e-3, 10)]


@pytest.mark.filterwarnings("ignore:forces below 20 Hz are not read")
@pytest.mark.slow
def test_a_strike_is_read_alike_wherever_the_run_ends(ending):
    tables = [record.running_safety(window=0.5) for record in ending]
    unloading = [wt.features.wheel_unloading()(record) for record in ending]
    first = tables[0]
    for table, unloaded in zip(tables, unloading, strict=True):
        assert "not read in the last 0.05 s" in table.note
        for name, size in {
            "guiding_force": 20.0, "wheel_force": 200.0, "derailment_quotient": 5e-4, "sum_of_guiding_forces": 20.0,
            "unloading": 1e-3,
        }.items():  # fmt: skip
            for statistic in ("99.85 %", "largest"):
                one, other = (held[name].sel(statistic=statistic) for held in (table, first))
                np.testing.assert_allclose(one, other, atol=size, err_msg=f"{name}, {statistic}")
        np.testing.assert_allclose(unloaded, unloading[0], atol=1e-3)
    rules = [rule for rule in wt.limits.read_rules() if rule.name.startswith("EN 14363")]
    check = wt.limits.check(ending[5], rules)
    assert any("larger values may be there" in note for note in check.notes)


def test_wear_and_comfort_at_a_time_do_not_depend_on_what_follows(ending):
    short, long = ending[0], ending[-1]
    for table in ("guidance", "comfort"):
        one, other = (
            getattr(record, table)(**({"window": 0.5, "cutoff": None} if table == "guidance" else {}))
            for record in (short, long)
        )
        for name in ("t_gamma", "spin_t_gamma") if table == "guidance" else ("weighted_acceleration",):
            values = one[name].dropna("time")
            scale = float(abs(values).max())
            np.testing.assert_allclose(values, other[name].sel(time=values.time), atol=1e-6 * scale, rtol=0)


def test_a_run_that_is_all_end_or_that_broke_off_is_doubted():
    short = wt.simulate(wheelset(duration=0.045))
    with pytest.warns(ModelWarning, match="nothing is left"):
        found = short.guidance(window=0)
    assert np.isnan(found.wheel_force).all()
    assert float(abs(found.t_gamma).max()) == 0.0
    with pytest.warns(ModelWarning, match="nothing is left"):
        assert np.isnan(short.running_safety(window=0).unloading).all()
    wt.plot(found)
    with pytest.warns(ModelWarning, match=r"shorter than the mean over 2 m: Y/Q and ΣY are NaN"):
        assert np.isnan(wt.simulate(wheelset(duration=0.24)).guidance().derailment_quotient).all()
    hill = {"left": wt.CosineBump(height=0.03, length=1.0, start=0.5)}
    lost = wt.simulate(wheelset(hill, speed=40.0, creep=wt.creep.Polach(friction=0.35)))
    assert lost.outcome.name == "DERAILED"
    with pytest.warns(ModelWarning, match="a wheel left the rails: computed up to"):
        assert "a wheel left the rails" in lost.guidance(window=0, cutoff=None).note
    assert lost.comfort("wheelset 1").note.startswith("a wheel left the rails: computed up to")
    started = wt.simulate(wheelset(start={"displacement": 0.0, "velocity": -0.01}, duration=0.3))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = started.guidance(window=0)
    assert "the first and the last 0.05 s" in found.note
    known = np.isfinite(found.wheel_force[:, 0, 0].values)
    assert (int(known.argmax()), int(known[::-1].argmax())) == (998, 998)  # 49.85 ms at 20 kHz


def test_where_t_gamma_is_not_known_it_is_not_drawn(swaying):
    found = swaying.guidance()
    (axis,) = (one for one in wt.plot(found).axes if one.get_ylabel() == "T-gamma [N]")
    drawn = axis.lines[0].get_ydata()
    half = round(0.5 * found.window / swaying.scenario.speed * found.rate)
    assert np.isnan(drawn[:half]).all()
    assert np.isnan(drawn[-half:]).all()
    assert np.nanmin(drawn) > 0.0


def test_the_feature_of_unloading_is_that_of_the_wheels(swaying):
    found = wt.features.wheel_unloading()(swaying)
    assert found.dims == ("wheelset", "side")
    np.testing.assert_allclose(found, swaying.guidance(window=0).unloading.max("time"), rtol=1e-3)
    assert 0.001 < float(found.max()) < 1.0


def test_statistics_are_those_of_sorted_samples(swaying):
    found = swaying.guidance(settling=0.1)
    assert float(found.time[0]) == pytest.approx(0.1)
    table = swaying.running_safety(settling=0.1)
    for name in ("derailment_quotient", "wheel_force", "sum_of_guiding_forces"):
        column = found[name].isel(wheelset=0) if name == "sum_of_guiding_forces" else found[name][:, 0, 1]
        ordered = np.sort(column.dropna("time").values)
        row = table[name].isel(wheelset=0) if name == "sum_of_guiding_forces" else table[name][:, 0, 1]
        expected = [ordered[0], *(ordered[int(np.ceil(p / 100.0 * len(ordered))) - 1] for p in PERCENTILES)]
        np.testing.assert_allclose(row, [*expected, ordered[-1], ordered.mean()], rtol=1e-12)
    assert list(table.statistic.values) == ["least", "0.15 %", "50 %", "99.85 %", "largest", "mean"]
    assert table.derailment_quotient.attrs["long_name"].startswith("Y/Q")


def test_a_run_that_is_shorter_than_its_window_is_refused(swaying):
    with pytest.raises(wt.InputError, match=r"12 m, in 9 m of way"):
        swaying.guidance(window=12.0, settling=0.1)
    with pytest.raises(wt.InputError, match="rate"):
        swaying.guidance(rate=30.0)
    with pytest.raises(wt.InputError, match="settling"):
        swaying.guidance(settling=1.0)
    single = wt.simulate(wt.load("examples/bump.toml"))
    with pytest.raises(wt.InputError, match="guidance"):
        single.guidance()
