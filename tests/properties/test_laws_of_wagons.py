"""Contacts with hysteresis and linear contacts on wagons: energy, mirrors, rails, files, maps, starts."""

import json

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from tests.properties.test_wagon_on_rails import FULL, NARROW, SLAB, WAVE
from tests.properties.test_wagon_on_rails import coach as on_rails

STEP = wt.Step(height=1e-4, position=0.02)
DAMPED, STRAIGHT = wt.Hertz(constant_per_wheel=7.025e10, hysteresis=2.0), wt.Linear(stiffness=1.9e9)
POLACH = wt.creep.Polach(friction=0.35)
DECK = wt.FloatingDeck(mass=3e3, stiffness=1.2e7, damping=1e4, start=0.01, length=0.15)


def coach(irregularity=STEP, duration=0.03, **changes):
    fields = {"vehicle": wt.Wagon.erri_b176(1500.0), "contact": DAMPED, "creep": POLACH, "speed": 5.0} | changes
    return wt.Scenario(irregularity=irregularity, duration=duration, **fields)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"contact": wt.Hertz(hysteresis=2.0), "irregularity": {"right": STEP}, "track": DECK},
        {"contact": STRAIGHT, "creep": wt.creep.Fastsim(friction=0.3)},
        {"contact": STRAIGHT, "irregularity": {"left": STEP}, "track": DECK},
        {"contact": wt.Hertz(hysteresis=1.0), "profiles": NARROW, "irregularity": {"left": STEP}},  # with flanges
        {"contact": STRAIGHT, "profiles": NARROW, "irregularity": {"left": STEP}},
    ],
)
def test_energy_closes(changes):
    scene = coach(**changes)
    record = wt.simulate(scene, "strict")
    assert len(record.events.time) > 0
    assert float(record.energy.relative_imbalance) < 1e-8
    assert float(record.energy.dissipated_creep) >= -1e-12
    if scene.contact != STRAIGHT:
        assert float(record.energy.dissipated_contact) > 0.0
    assert float(wt.simulate(scene).energy.relative_imbalance) < 1e-6


@pytest.mark.parametrize("contact", [DAMPED, STRAIGHT])
def test_a_mirrored_scenario_gives_mirrored_results(contact):
    bump = wt.CosineBump(height=1.5e-4, length=0.05, start=0.01)
    one, other = (
        wt.simulate(coach({side: bump}, rolling="point", speed=9.0, contact=contact)) for side in ("left", "right")
    )  # fmt: skip
    assert len(one.events.time) == len(other.events.time) >= 2
    assert list(one.events.side.values) == [{"left": "right", "right": "left"}[s] for s in other.events.side.values]
    np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=1e-12)
    times = np.linspace(0.0, 0.03, 61)
    a, b = one.at(times).normal_force, other.at(times).normal_force
    np.testing.assert_allclose(a.sel(side="left"), b.sel(side="right"), rtol=0, atol=1e-9 * one.static_force)
    np.testing.assert_allclose(a.sel(side="right"), b.sel(side="left"), rtol=0, atol=1e-9 * one.static_force)


@pytest.mark.slow
def test_a_saved_record_answers_as_before(tmp_path):
    for contact in (DAMPED, STRAIGHT):
        record = wt.simulate(coach({"right": STEP}, 0.01, contact=contact))
        record.save(tmp_path / "wagon.nc")
        again = wt.load(tmp_path / "wagon.nc")
        assert str(again) == str(record)
        times = np.linspace(0.0, 0.01, 21)
        for name, values in record.at(times).data_vars.items():
            np.testing.assert_array_equal(values, again.at(times)[name])
        assert float(again.energy.relative_imbalance) == float(record.energy.relative_imbalance)


@pytest.mark.slow
def test_a_file_with_another_law_than_its_scenario_is_refused(tmp_path):
    record = wt.simulate(coach({"right": STEP}, 0.005))
    record.save(tmp_path / "wagon.nc")
    with xr.open_dataset(tmp_path / "wagon.nc", engine="h5netcdf") as opened:
        data = opened.load()
    table = json.loads(data.attrs["scenario"])
    for contact in ({"type": "Linear", "stiffness": 1e9}, table["contact"] | {"hysteresis": 0.3}):
        other = data.assign_attrs(scenario=json.dumps(table | {"contact": contact}))
        del other.attrs["checksum"]
        other.to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
        with pytest.raises(wt.InputError, match="scenario: found another one than that of the record"):
            wt.load(tmp_path / "other.nc")


def test_a_map_over_the_damping_is_made_of_runs():
    scene, factors = coach(duration=0.01), [0.5, 4.0]
    found = wt.sweep(scene, {"contact.hysteresis": factors}, [wt.features.largest_force()])
    for i, factor in enumerate(factors):
        record = wt.simulate(scene.replaced({"contact.hysteresis": factor}))
        np.testing.assert_array_equal(
            found.largest_force.isel({"contact.hysteresis": i}), wt.features.largest_force()(record)
        )  # fmt: skip


def test_the_reduced_model_has_the_law_of_the_wagon():
    for contact in (DAMPED, STRAIGHT):
        scene = coach((), 0.01, contact=contact)
        wagon, lone = wt.simulate(scene), wt.simulate(wt.reduced(scene))
        assert lone.scenario.contact.needs == contact.needs
        assert lone.static_force == pytest.approx(2.0 * wagon.static_force, rel=1e-6)


def test_small_vibrations_are_damped_by_the_material():
    plain, damped = (
        wt.modes(coach((), contact=contact, creep=None)) for contact in (wt.Hertz(constant_per_wheel=7.025e10), DAMPED)
    )
    bounce = int(np.argmin(np.abs(plain.frequency.values - 180.0)))
    mass, stiff = 750.0, 1.5 * 53_010.8 / (53_010.8 / 7.025e10) ** (2 / 3)
    added = 0.5 * 2.0 * 53_010.8 / np.sqrt(mass * stiff)  # χ·N over twice the square root of m·k
    near = int(np.argmin(np.abs(damped.frequency.values - plain.frequency.values[bounce])))
    assert damped.damping_ratio.values[near] - plain.damping_ratio.values[bounce] == pytest.approx(added, rel=0.05)


def test_a_dropped_wagon_is_a_dropped_wheelset():
    axle = wt.vehicles.Axle(mass=1e4, inertia=(1120.0, 112.0, 1120.0), position=0.0)
    start = {"displacement": 5e-4, "velocity": -0.05}
    wagon = wt.Scenario(
        vehicle=wt.Wagon(bodies=(), axles=(axle,)), contact=DAMPED, profiles=wt.profiles.Cones(), speed=0.0,
        duration=0.05, start=start,
    )  # fmt: skip
    wheelset = wt.Scenario(
        vehicle=wt.Wheelset(mass=1e4, load=0.0), contact=wt.Hertz(constant=14.05e10, hysteresis=2.0), speed=0.0,
        duration=0.05, start=start,
    )  # fmt: skip
    one, other = (wt.simulate(scene, "strict") for scene in (wagon, wheelset))
    times = one.events.time[one.events.side == "left"]
    assert len(times) == len(other.events.time) >= 3
    np.testing.assert_allclose(times, other.events.time, rtol=0, atol=1e-11)
    with pytest.raises(wt.InputError, match=r"start.*modes"):
        wt.modes(wagon)


def test_a_start_that_a_link_forbids_is_refused():
    link = wt.vehicles.Link(name="bar", between=("bogie 1", "wheelset 1"), at=(0.0, 1.0, 0.46), along=("z",))
    tied = coach((), vehicle=wt.Wagon.erri_b176(1500.0).with_element(link), start={"displacement": 1e-4})
    with pytest.raises(wt.InputError, match="start: found a start of wheelset 1"):
        wt.simulate(tied)


# -- on rails ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.few(1)
@pytest.mark.parametrize(
    "changes",
    [
        {"contact": STRAIGHT, "track": SLAB, "irregularity": {"left": WAVE}, "speed": 45.0},
        pytest.param(
            {"creep": FULL, "contact": wt.Hertz(hysteresis=2.0), "irregularity": {"right": WAVE}},
            marks=pytest.mark.slow,
        ),
        pytest.param(  # with flanges
            {"contact": wt.Hertz(hysteresis=1.0), "profiles": NARROW, "irregularity": {"left": WAVE}},
            marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_energy_closes_on_rails(changes):
    scene = on_rails(**({"contact": DAMPED} | changes))
    record = wt.simulate(scene, "strict")
    assert len(record.events.time) > 0
    assert float(record.energy.relative_imbalance) < 1e-8
    assert float(wt.simulate(scene).energy.relative_imbalance) < 1e-6


@pytest.mark.slow
def test_a_record_of_damped_contacts_on_rails_is_the_same_in_a_file(tmp_path):
    record = wt.simulate(on_rails(duration=0.01, contact=DAMPED))
    record.save(tmp_path / "a.nc")
    again = wt.load(tmp_path / "a.nc")
    one, other = record.history("2 kHz"), again.history("2 kHz")
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name], other[name])
    place = {"rate": 2e3, "rail": [0.1], "seat": [0, 1]}
    np.testing.assert_array_equal(record.track(**place).pad_force, again.track(**place).pad_force)


@pytest.mark.slow
def test_a_mirrored_scenario_on_rails_gives_mirrored_results():
    one, other = (wt.simulate(on_rails({side: WAVE}, contact=DAMPED)) for side in ("left", "right"))
    swapped = {"left": "right", "right": "left"}
    assert len(one.events.time) >= 4
    assert list(one.events.side.values) == [swapped[side] for side in other.events.side.values]
    np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=1e-11)
