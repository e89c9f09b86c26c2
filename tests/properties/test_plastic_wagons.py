"""Wagons whose treads yield: their records, marks, and many passes."""

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from tests.reference.test_plastic_on_rails import HEAVY, STRUCK, WAVY, in_a_row
from tests.reference.test_plastic_wagons import row_of_wheelsets
from tests.reference.test_wagon_on_rails import NUMBERS, TRACK, half_coach
from wheeltapper.ask.passes import Scatter, drawn_pass
from wheeltapper.lower.door import lowered_scenario
from wheeltapper.lower.lines.wagon import loaded, moved
from wheeltapper.lower.marks.wagon_marks import path_of
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import multibody

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
LEVEL = wt.profiles.Cones()
OF_WHEEL = {"contact": wt.contact.Thornton(constant_per_wheel=1.405e11 / 2, yield_force=1.5e5)}
COACH = wt.Scenario(
    vehicle=wt.Wagon.erri_b176(), contact=wt.contact.Thornton(yield_force="160 kN"),
    creep=wt.creep.Polach(friction=0.35), rolling="point", speed=20.0, duration=0.16,
    irregularity={"right": wt.CosineBump(height="0.3 mm", length="50 mm", start=0.1)},
)  # fmt: skip


@pytest.mark.slow
def test_the_record_of_a_coach_is_stored_and_balanced(tmp_path):
    record = wt.simulate(COACH, "strict")
    assert abs(float(record.energy.relative_imbalance)) < 1e-8
    assert set(record.events.wheelset.values[record.events.kind.values == "yield"]) == {1, 2}
    record.save(tmp_path / "run.nc")
    loaded = wt.load(tmp_path / "run.nc")
    xr.testing.assert_identical(loaded.events, record.events)
    xr.testing.assert_allclose(loaded.history("2 kHz"), record.history("2 kHz"), rtol=1e-9, atol=1e-15)
    xr.testing.assert_allclose(wt.wear.marks(loaded).table, wt.wear.marks(record).table, rtol=1e-9, atol=1e-15)


@pytest.mark.whole
@pytest.mark.slow
def test_the_record_of_half_a_coach_on_sleepers_is_stored_and_balanced(tmp_path):
    scene = wt.Scenario(
        vehicle=half_coach(), track=TRACK, profiles=LEVEL, speed=20.0, duration=0.15, rolling="point",
        contact=wt.contact.KogutEtsion(constant_per_wheel=8e10, yield_force=1.2e5),
        irregularity={"left": wt.Corrugation(amplitude=2e-4, wavelength=0.1, start=0.05)},
    )  # fmt: skip
    record = wt.simulate(scene, "strict")
    assert abs(float(record.energy.relative_imbalance)) < 1e-8
    record.save(tmp_path / "run.nc")
    loaded = wt.load(tmp_path / "run.nc")
    xr.testing.assert_identical(loaded.events, record.events)
    xr.testing.assert_allclose(loaded.history("2 kHz"), record.history("2 kHz"), rtol=1e-9, atol=1e-14)
    ask = {"rate": "2 kHz", "rail": [0.0], "seat": [0]}
    xr.testing.assert_allclose(loaded.track(**ask), record.track(**ask), rtol=1e-9, atol=1e-14)
    xr.testing.assert_allclose(wt.wear.marks(loaded).table, wt.wear.marks(record).table, rtol=1e-9, atol=1e-14)


@pytest.mark.slow
@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("name", "place", "value"),
    [("pieces", 5, np.nan), ("lanes", 8 * asm.LAST_PIECE, 1e6), ("lanes", 8 * asm.BODY, 2.0)],
)
def test_damaged_paths_are_refused(tmp_path, name, place, value):
    record = wt.simulate(COACH)
    record.save(tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as opened:
        data = opened.load()
    del data.attrs["checksum"]
    data[f"march_{name}"].values.flat[place] = value
    data.to_netcdf(tmp_path / "b.nc", engine="h5netcdf")
    assert wt.load(tmp_path / "a.nc").history(5000.0).identical(record.history(5000.0))
    with pytest.raises(wt.InputError, match=f"march_{name}: found"):
        wt.load(tmp_path / "b.nc")


def test_the_paths_of_a_record_give_its_run_again():
    """Wheels that follow meet what those before them have left: marched over these paths, nothing changes."""
    lowered = lowered_scenario(COACH)
    found = multibody.march(lowered.assembly, memory=lowered.memory)
    paved = found.assembly
    assert len(paved.pieces) > len(lowered.assembly.pieces) + 10
    again = multibody.march(paved)
    np.testing.assert_array_equal(again.events[:, 1], found.events[:, 1])
    np.testing.assert_allclose(again.events[:, 0], found.events[:, 0], rtol=0, atol=1e-9)
    marking = lowered.memory.begin()
    marking.press(again)
    end, x = paved._replace(**marking.paths()._asdict()), np.linspace(0.0, 0.999 * again.end * 20.0, 4000)
    for lane in np.flatnonzero(paved.lanes[0, asm.SIDE]):
        np.testing.assert_allclose(path_of(end, lane).height_at(x), path_of(paved, lane).height_at(x), atol=1e-12)


def test_a_law_that_never_yields_is_hertz():
    plastic = COACH.replaced({"contact": wt.contact.Thornton(yield_force="9 MN")})
    hertz = COACH.replaced({"contact": wt.Hertz(curvature=False)})
    one, other = wt.simulate(plastic), wt.simulate(hertz)
    np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=2e-9)
    assert float(wt.wear.marks(one).table.permanent_indentation.max()) == 0.0


def test_wheels_that_cease_to_yield_within_rounding_of_each_other_go_on():
    """Both wheels of a wheelset come to the border together, on a deck that has sunk by 22 mm: some 1e-18 m apart."""
    deck = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)
    for mass in (1505, 1510, 1515):
        scene = wt.Scenario(
            vehicle=wt.Wagon.erri_b176(), track=deck, speed=9.0, duration=0.007, profiles=LEVEL,
            contact=wt.contact.Thornton(constant_per_wheel=7.025e10), creep=wt.creep.Polach(friction=0.35),
            irregularity=wt.CosineBump(height=1e-4, length=0.05, start=0.005), start={"displacement": 1e-5},
        )  # fmt: skip
        record = wt.simulate(scene.replaced({"vehicle.axles.0.mass": mass}))
        assert record.outcome.name == "COMPLETED"
        assert len(record._march.steps) < 1000


@pytest.mark.slow
@pytest.mark.parametrize("rolling", ["point", "circle"])
def test_marks_of_half_a_coach_are_those_of_a_bogie(rolling):
    common = {
        "contact": wt.contact.Stronge(constant_per_wheel=8e10, yield_force=1.6e5), "speed": 20.0, "duration": 0.17,
        "irregularity": wt.CosineBump(height=3e-4, length=0.05, start=0.3), "rolling": rolling,
    }  # fmt: skip
    coach = wt.simulate(wt.Scenario(vehicle=half_coach(), profiles=LEVEL, **common), "strict")
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common), "strict")
    own, expected = wt.wear.marks(coach), wt.wear.marks(bogie)
    assert float(expected.table.permanent_indentation.max()) > 1e-6
    for side in ("left", "right"):
        found = own.table.permanent_indentation.sel(side=side).values
        np.testing.assert_allclose(found, expected.table.permanent_indentation.values, rtol=0, atol=1e-11)
    assert len(own.wheels) == 2 * len(expected.wheels)
    for number, wheel in enumerate(expected.wheels):
        for side in range(2):
            np.testing.assert_allclose(own.wheels[2 * number + side].deviations, wheel.deviations, rtol=0, atol=1e-11)
    assert len(own.rails) == 2


def test_cells_of_a_sweep_are_runs():
    scene = COACH.replaced({"duration": 0.02})
    chart = wt.sweep(scene, {"contact.yield_force": [1.3e5, 1.7e5]}, ["largest_force"])
    for force in (1.3e5, 1.7e5):
        record = wt.simulate(scene.replaced({"contact.yield_force": force}))
        cell = chart.sel({"contact.yield_force": force})
        np.testing.assert_allclose(cell.largest_force, wt.features.largest_force()(record), rtol=1e-12)


# -- many passes ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("track", ["rigid", pytest.param("sleepers", marks=pytest.mark.slow)])
def test_passes_of_a_wheelset_without_roll_are_those_of_a_wheelset(track, tmp_path):
    plane = WAVY
    if track == "sleepers":
        plane = WAVY.replaced({"track": TRACK, "irregularity.0.amplitude": -2e-4})
    contact = wt.contact.Thornton(constant_per_wheel=1.405e11 / 2, yield_force=1.2e5)
    wagon = plane.replaced({"vehicle": row_of_wheelsets(1, 0.0), "contact": contact, "profiles": LEVEL})
    scatter = {"speed": 0.02, "load": 0.06, "start": 0.2}
    options = {"hardening": 0.3, "scatter": scatter, "seed": 3, "every": 1, "method": "strict"}
    expected = wt.wear_in(plane, 3, progress=False, **options)
    found = wt.wear_in(wagon, 3, progress=False, store=tmp_path / "worn.nc", **options)
    assert expected.permanent_indentation.max() > 3e-6
    for side in ("left", "right"):
        np.testing.assert_allclose(found.height.sel(side=side), expected.height, rtol=0, atol=1e-11)
    assert float(expected.start.max()) > 0.1  # within the waves
    for name in ("speed", "applied_load", "start", "largest_force", "plastic_work"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-5)
    xr.testing.assert_identical(wt.load(tmp_path / "worn.nc").height, found.height)
    more = wt.wear_in(wagon, 4, progress=False, store=tmp_path / "worn.nc", **options)
    xr.testing.assert_identical(more, wt.wear_in(wagon, 4, progress=False, **options))
    assert len(wt.plot(found).axes) == 9


@pytest.mark.slow
def test_wheelsets_that_follow_are_passes_of_wear_in():
    gap = 2.0
    ride = STRUCK | OF_WHEEL | {"profiles": LEVEL}
    row = wt.Scenario(vehicle=row_of_wheelsets(3, gap), duration=0.2 + 2.0 * gap / 10.0, **ride)
    left = wt.wear.marks(wt.simulate(row, "strict")).table.permanent_indentation
    alone = wt.Scenario(vehicle=row_of_wheelsets(1, gap), duration=0.2, **ride)
    worn = wt.wear_in(alone, 3, method="strict", progress=False).permanent_indentation.isel(kept=-1)
    inside = slice(0.1, 1.5)
    here = left.sel(position=inside)
    there = worn.interp(position=here.position)
    assert float(here.max()) > 5e-6
    np.testing.assert_allclose(here, there, rtol=0, atol=0.02 * float(here.max()))


def test_wagons_pass_in_turn():
    contact = wt.contact.Thornton(constant_per_wheel=1.405e11 / 2, yield_force=1.2e5)
    plane = WAVY.replaced({"duration": 0.1})
    wagon = plane.replaced({"vehicle": row_of_wheelsets(1, 0.0), "contact": contact, "profiles": LEVEL})
    heavy, light = row_of_wheelsets(1, 0.0), row_of_wheelsets(2, 1.5)
    one = {"mass": 900.0, "load": 95e3}
    light = light.model_copy(update={"axles": tuple(axle.model_copy(update=one) for axle in light.axles)})
    passing = [wt.Wheelset(**HEAVY), wt.vehicles.Wheelsets(wheelsets=(one, one), positions=(0.0, -1.5))]
    options = {"every": 1, "method": "strict", "progress": False}
    expected = wt.wear_in(plane, 3, scatter={"vehicles": passing}, **options)
    found = wt.wear_in(wagon, 3, scatter={"vehicles": [heavy, light]}, **options)
    assert expected.permanent_indentation.max() > 1e-6
    for side in ("left", "right"):
        for kept in range(4):
            here = expected.height.isel(kept=kept)
            own = found.height.isel(kept=kept).sel(side=side)
            np.testing.assert_allclose(own, here, rtol=0, atol=1e-10)
    np.testing.assert_allclose(found.largest_force, expected.largest_force, rtol=1e-6)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"scatter": {"start": 3.0}}, "scatter.start: found 3 m; allowed: less than the run of 1 m"),
        ({"scatter": {"vehicles": [wt.Wheelset(**HEAVY)]}}, "scatter.vehicles.0"),
    ],
)
def test_what_cannot_pass_is_refused(options, told):
    scene = wt.Scenario(vehicle=row_of_wheelsets(1, 0.0), duration=0.1, profiles=LEVEL, **STRUCK | OF_WHEEL)
    with pytest.raises(wt.InputError, match=told):
        wt.wear_in(scene, 1, progress=False, **options)


def test_a_wagon_on_which_nothing_presses_has_no_load_that_could_scatter():
    bare = row_of_wheelsets(1, 0.0)
    bare = bare.model_copy(update={"axles": tuple(axle.model_copy(update={"load": 0.0}) for axle in bare.axles)})
    scene = wt.Scenario(vehicle=bare, duration=0.1, profiles=LEVEL, **STRUCK | OF_WHEEL)
    with pytest.raises(wt.InputError, match=r"scatter\.load: found 0\.1 with a Wagon that has neither"):
        wt.wear_in(scene, 1, progress=False, scatter={"load": 0.1})


@pytest.mark.slow
def test_what_a_coach_carries_is_its_car_body_and_where_it_starts_is_where_all_of_it_stands():
    coach = COACH.vehicle
    heavy = loaded(coach, 1.25)
    assert [body.mass for body in heavy.bodies] == [1.25 * 32000.0, 2615.0, 2615.0]
    assert heavy.bodies[0].box == pytest.approx(coach.bodies[0].box)  # as dense everywhere as before
    light, laden = (wt.simulate(COACH.replaced({"vehicle": one, "duration": 0.001})) for one in (coach, heavy))
    more = float((laden.static_forces - light.static_forces).sum())
    assert more == pytest.approx(0.25 * 32000.0 * 9.81, rel=1e-9)
    ahead = wt.simulate(COACH.replaced({"vehicle": moved(coach, 0.037), "duration": 0.1}), "strict")
    nearer = wt.simulate(COACH.replaced({"irregularity.right.0.start": 0.063, "duration": 0.1}), "strict")
    np.testing.assert_allclose(ahead.events.time, nearer.events.time, rtol=0, atol=1e-10)
    assert ahead.events.sizes["event"] > 20
    held = {"scatter": {"load": 0.3, "start": 0.2}, "seed": 5, "progress": False}
    found = wt.wear_in(COACH.replaced({"duration": 0.02}), 3, **held)
    share = found.applied_load.values - light.static_forces.values[0].sum() + coach.axles[0].mass * 9.81
    drawn = [drawn_pass(Scatter(load=0.3, start=0.2, seed=5), number)[1] for number in range(3)]
    np.testing.assert_allclose(share, (np.array(drawn) - 1.0) * 32000.0 * 9.81 / 4.0, rtol=1e-6)


def test_two_bodies_without_bogies_are_both_carried():
    held = ("x", "y", "roll", "pitch", "yaw")
    body = wt.vehicles.Body(name="box", mass=8e3, inertia=(1e3, 1e3, 1e3), position=(0, 0, 1), held=held)
    spring = wt.vehicles.Spring(
        name="spring", between=("box", "wheelset 1"), at=(0, 0, 0.8), stiffness=(0.0, 0.0, 1e6)
    )  # fmt: skip
    wagon = wt.Wagon(bodies=(body,), axles=row_of_wheelsets(1, 0.0).axles, elements=(spring,))
    assert loaded(wagon, 0.5).bodies[0].mass == 4e3
    assert loaded(wagon, 0.5).axles[0].load == 0.5 * wagon.axles[0].load


def test_a_wagon_does_not_pass_where_the_scenario_has_none():
    scene = wt.Scenario(vehicle=in_a_row(1, 0.0), duration=0.1, **STRUCK)
    with pytest.raises(wt.InputError, match=r"scatter.vehicles.0: .* allowed: no Wagon"):
        wt.wear_in(scene, 1, progress=False, scatter={"vehicles": [row_of_wheelsets(1, 0.0)]})


def test_flanges_stay_elastic_on_paths_without_marks():
    lowered = wt.simulate(COACH.replaced({"duration": 0.001}))._lowered
    A = lowered.assembly
    treads = int(A.numbers[asm.TREADS])
    assert len(A.lanes) == 2 * treads
    flanges = A.lanes[treads:, asm.LAST_PIECE].max()
    assert flanges < A.lanes[:treads, asm.FIRST_PIECE][A.lanes[:treads, asm.SIDE] != 0.0].min()
