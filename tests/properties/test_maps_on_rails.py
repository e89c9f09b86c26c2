"""Maps and borders on rails that give way: single records, the march of one wheel on a rigid rail, and bisection."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ask.border import _Plane
from wheeltapper.describe.registry import registered_in
from wheeltapper.describe.scenario import Start
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.plane_cells import PlaneCells
from wheeltapper.march.general.ensemble import works_of
from wheeltapper.record.features.base import ROOM

from ..marks import slow_but

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example").model_copy(update={"cutoff": 3000.0, "bays": 40})
FLAT = wt.Scenario(
    vehicle=wt.Wheelset(mass=1200, load=188_228), track=TRACK, contact=wt.Hertz(constant=1.8825e11),
    irregularity=wt.WheelFlat(length=0.06, position=0.05), speed=20, duration=0.03,
)  # fmt: skip
BEHIND = wt.vehicles.Wheelsets(
    wheelsets=(wt.Wheelset(mass=1200, load=188_228), wt.Wheelset(mass=1000, load=150e3)), positions=(0.0, -1.8)
)
OWN = wt.contact.Law(lambda depth: 1.8825e11 * depth**1.5, largest=2e-3)
PAIR = FLAT.replaced({"vehicle": BEHIND, "contact": OWN})
ON_SLAB = FLAT.replaced({
    "vehicle": wt.vehicles.Bogie(**wt.vehicles.Bogie.example),
    "track": wt.tracks.Slab(**wt.tracks.Slab.example, cutoff=3000.0, bays=40),
    "irregularity": wt.Corrugation(amplitude=2e-4, wavelength=0.05, start=0.02), "rolling": "point",
})  # fmt: skip
HANGING = FLAT.replaced({
    "track": TRACK.model_copy(update={"anomalies": (wt.tracks.HangingSleeper(seat=1, void=2e-4),)})
})  # fmt: skip
SCATTERED = FLAT.replaced({
    "track": TRACK.model_copy(update={"anomalies": (wt.tracks.Scatter(pads=0.2, ballast=0.2, seed=3),)})
})  # fmt: skip
F = wt.features
PLAIN = [
    F.largest_force(), F.largest_force(over_static=True), F.number_of_impacts(), F.time_in_air(), F.first_loss(),
    F.last_loss(), F.force_ratio(), F.impact_interval(), F.impact_interval(between="peaks").renamed("between_peaks"),
    F.contact_frequency(), F.decay_rate(), F.missing_energy(),
]  # fmt: skip
CASES = {
    "a wheelset": (
        FLAT,
        {"speed": [20.0, 31.0], "irregularity.0.length": [0.02, 0.06], "vehicle.mass": [900.0, 1300.0]},
    ),
    "masses and springs": (FLAT, {"vehicle.load": [1e5, 2e5], "track.pad_stiffness": [1e8, 3e8]}),
    "two wheelsets, a law of one's own": (PAIR, {"speed": [20.0, 26.0], "vehicle.positions.1": [-1.8, -2.537]}),
    "a hanging sleeper": (HANGING, {"track.anomalies.0.void": [1e-4, 3e-4], "irregularity.0.length": [0.04, 0.06]}),
    "scattered pads": (SCATTERED, {"speed": [20.0, 26.0], "irregularity.0.length": [0.04, 0.06]}),
    "two wheelsets dropped on a deck": (
        PAIR.replaced(
            {
                "contact": FLAT.contact,
                "start": Start(displacement=1e-4),
                "track": wt.FloatingDeck(mass=4e3, stiffness=2e7, damping=3e4),
            }
        ),
        {"start.displacement": [1e-4, 3e-4], "track.mass": [3e3, 5e3], "vehicle.wheelsets.0.mass": [1e3, 1200.0]},
    ),
    "dropped on rails": (
        FLAT.replaced({"start": Start(displacement=1e-4)}),
        {"start.displacement": [-2e-4, 3e-4], "speed": [20.0, 26.0]},
    ),
    "a bogie on a slab": (ON_SLAB, {"irregularity.0.wavelength": [0.04, 0.05], "vehicle.frame_mass": [2e3, 3e3]}),
}


def swept(scene, over, features, **more):
    return wt.sweep(scene, over, features, progress=False, **more)


def far(found, expected):
    """Return the relative difference of values, both of which may be NaN."""
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    known = ~np.isnan(expected)
    return np.max(np.abs(found - expected)[known] / np.maximum(np.abs(expected[known]), 1e-30), initial=0.0)


@pytest.mark.slow
@pytest.mark.few(2)
@pytest.mark.parametrize("name", slow_but(CASES, "masses and springs"))
def test_a_map_holds_what_records_say(name):
    scene, over = CASES[name]
    chart = swept(scene, over, PLAIN)
    assert (chart.status == 0).all()
    several = len(getattr(scene.vehicle, "positions", (0.0,))) > 1
    assert chart.largest_force.dims == (("wheelset",) if several else ()) + tuple(over)
    hit = 0
    for cell in np.ndindex(*(len(values) for values in over.values())):
        one = {path: values[i] for (path, values), i in zip(over.items(), cell, strict=True)}
        record = wt.simulate(scene.replaced(one), progress=False)
        hit += len(record.events.time)
        for feature in PLAIN:
            own, alone = chart[feature.name].values[(..., *cell)], feature(record).values
            if feature.name == "missing_energy":  # an error itself
                assert np.all((own > 0.0) & (own < 1e-6))
                np.testing.assert_allclose(own, alone, rtol=0.0, atol=1e-10)
                continue
            loose = 1e-10 if feature.name == "decay_rate" else 1e-12  # small differences of logarithms
            assert far(own, alone) < loose, feature.name
    assert hit > 0


@pytest.mark.slow
def test_what_comes_of_a_cell_depends_on_no_other_cell_and_no_thread():
    over = {"speed": [20.0, 31.0], "irregularity.0.length": np.linspace(0.02, 0.08, 7)}
    whole = swept(FLAT, over, PLAIN, threads=1)
    assert swept(FLAT, over, PLAIN, threads=2).equals(whole)
    some = swept(FLAT, {"speed": [31.0], "irregularity.0.length": over["irregularity.0.length"][3:5]}, PLAIN)
    assert some.equals(whole.sel(speed=[31.0]).isel({"irregularity.0.length": slice(3, 5)}))


def test_cells_of_one_speed_share_the_tables_of_the_track():
    over = {"speed": np.repeat([20.0, 30.0], 3), "vehicle.mass": np.array([900.0, 1000.0, 1100.0] * 2)}
    many = PlaneCells(FLAT, over)
    assert sorted(len(work.numbers) for work in works_of(many.tasks, 1)) == [3, 3]
    assert len({id(task.system.ring) for task in many.tasks}) == 1
    assert len({id(task.system.contacts[0].pieces) for task in many.tasks}) == 1
    assert len({id(task.system.bodies) for task in many.tasks}) == 3


def test_threads_take_the_dearest_tracks_first_each_its_own_and_there_the_longest_cells():
    over = {"speed": np.repeat([40.0, 20.0, 10.0, 30.0], 8), "duration": np.tile(np.linspace(0.01, 0.03, 8), 4)}
    tasks = PlaneCells(FLAT, over).tasks
    works = works_of(tasks, 2, 4)
    of_works = [{tasks[number].system.speed for number in work.numbers} for work in works]
    assert of_works == [{10.0}, {20.0}, {10.0}, {20.0}, {30.0}, {40.0}, {30.0}, {40.0}]
    lengths = [np.mean([tasks[number].duration for number in work.numbers]) for work in works]
    for first, second in ((0, 2), (1, 3), (4, 6), (5, 7)):
        assert lengths[first] > lengths[second]
    np.testing.assert_array_equal(np.sort(np.concatenate([work.numbers for work in works])), np.arange(32))


@pytest.mark.parametrize("name", sorted(registered_in(ROOM)))
def test_every_feature_works_as_in_a_record_or_is_refused_by_name(name):
    feature = F.named(name)
    if name == "growth_exponent":
        with pytest.raises(InputError, match=r"features.growth_exponent.*`orbits` does not take"):
            swept(FLAT, {"speed": [20.0]}, [feature])
        return
    chart = swept(FLAT, {"speed": [20.0, 31.0]}, [feature])
    for i, speed in enumerate((20.0, 31.0)):
        record = wt.simulate(FLAT.replaced({"speed": speed}), progress=False)
        most = 1e-12 if name != "missing_energy" else 1e-3  # of an error itself
        assert far(chart[feature.name].values[i], float(feature(record))) < most


def test_a_map_that_ends_early_says_the_same():
    over = {"irregularity.0.length": [0.05, 0.07]}
    short = swept(FLAT, over, [F.first_loss(), F.impact_interval()])
    whole = swept(FLAT, over, [F.first_loss(), F.impact_interval(), F.largest_force()])
    assert far(short.first_loss, whole.first_loss) == 0.0
    assert far(short.impact_interval, whole.impact_interval) == 0.0


def test_cells_that_cannot_be_computed_are_refused_one_by_one():
    with pytest.warns(UserWarning, match="1 of 2 cells"):
        chart = swept(FLAT, {"speed": [20.0, 1500.0]}, [F.largest_force()])
    assert list(chart.status.values) == [0, 5]
    assert np.isnan(chart.largest_force.values[1])
    assert chart.largest_force.values[0] > 1e5


# -- borders ----------------------------------------------------------------------------------------------------------

DIP = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=85_285), contact=wt.Hertz(constant=9e10), rolling="point", speed=5,
    irregularity=wt.CosineBump(height=-6e-5, length=0.02, start=0.05), duration=0.2,
)  # fmt: skip
GENERALLY = DIP.replaced({"vehicle": wt.vehicles.Wheelsets(wheelsets=(DIP.vehicle,), positions=(0.0,))})
PATHS = ("irregularity.0.height", "speed")


@pytest.mark.slow
@pytest.mark.parametrize(("losses", "hysteresis"), [(1, None), (2, None), (1, 0.3), (2, 0.3), (1, 3.0)])
def test_on_a_rigid_rail_the_margin_is_that_of_the_wheels_march(losses, hysteresis):
    height, speed = np.meshgrid(np.linspace(-1.5e-4, -3e-5, 6), np.linspace(3.0, 8.0, 4))
    contact = {"contact": DIP.contact.model_copy(update={"hysteresis": hysteresis})}
    general = _Plane(GENERALLY.replaced(contact), PATHS, losses, "strict", 2).margin(height, speed)
    wheel = _Plane(DIP.replaced(contact), PATHS, losses, "strict", 2).margin(height, speed)
    assert (wheel < 0.0).any()
    assert np.array_equal(general < 0.0, wheel < 0.0)
    if losses == 1:
        assert np.abs(general - wheel).max() < 1e-11
    assert np.abs(general - wheel)[wheel < 0.0].max() < 1e-11


def test_the_threshold_of_the_dip():
    """0.06407 mm at 5 m/s, and no contact change below (docs/theory/accuracy.rst, section 10.3)."""
    over = {"irregularity.0.height": [-6.6e-5, -6.2e-5], "speed": [4.9, 5.1]}
    curve = wt.border(GENERALLY, over, resolution=2, progress=False)
    onset = float(curve["irregularity.0.height"].values[np.abs(curve.speed.values - 5.0) < 1e-12][0])
    assert -onset == pytest.approx(0.06407e-3, abs=1e-8)
    changes = [
        len(wt.simulate(GENERALLY.replaced({"irregularity.0.height": share * onset}), progress=False).events.time)
        for share in (1.0005, 1.0 - 1e-9, 0.9995)
    ]
    assert changes[1:] == [0, 0]
    assert changes[0] > 0


DAMPED = wt.Hertz(constant=1.8825e11, restitution=0.5, impact_speed=0.2)
RATED = wt.contact.Law(lambda depth, rate: 1.8825e11 * depth**1.5 * (1.0 + 8.0 * rate), largest=2e-3)


@pytest.mark.parametrize("contact", [FLAT.contact, DAMPED, RATED])
@pytest.mark.slow
def test_a_border_on_rails_is_where_bisection_of_runs_finds_it(contact):
    scene = FLAT.replaced({"contact": contact})
    over = {"speed": [12.0, 28.0], "irregularity.0.length": [0.02, 0.055]}
    curve = wt.border(scene, over, resolution=2, progress=False)
    assert curve.sizes["point"] >= 2
    number = curve.sizes["point"] // 2
    speed, length = float(curve.speed[number]), float(curve["irregularity.0.length"][number])

    def run(length):
        return wt.simulate(scene.replaced({"speed": speed, "irregularity.0.length": length}), progress=False)

    low, high = 0.98 * length, 1.02 * length
    assert len(run(high).events.time) > 0
    assert len(run(low).events.time) == 0
    while high - low > 1e-9 * length:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if len(run(middle).events.time) > 0 else (middle, high)
    assert low == pytest.approx(length, rel=1e-6)
    first = run(high)
    indentation = first.at(first.events.time.values[0]).indentation.item()
    assert (indentation > 1e-6) == (contact is not FLAT.contact)  # a damped force ends while the surfaces overlap


def test_a_border_over_a_void_is_where_runs_begin_to_lose_contact():
    margin = _Plane(HANGING, ("track.anomalies.0.void", "irregularity.0.length"), 1, "default", 2).margin
    lengths = np.array([0.02, 0.03, 0.05, 0.06])
    found = margin(np.full(4, 2e-4), lengths)
    for length, here in zip(lengths, found, strict=True):
        record = wt.simulate(HANGING.replaced({"irregularity.0.length": length}), progress=False)
        assert (len(record.events.time) > 0) == (here < 0.0)
        if here < 0.0:  # the largest clearance
            lowest = record.history(rate=2e5).indentation.min()
            assert here == pytest.approx(float(lowest), rel=1e-3)


@pytest.mark.parametrize("asked", [("force_ratio", ["vehicle.mass"]), ("impulse", False)])
def test_what_needs_the_log_of_a_run_is_refused_where_no_log_fits(asked):
    feature, gradient = asked
    long = FLAT.replaced({"duration": 1e7})
    with pytest.raises(InputError, match=r"^duration: found 1e\+07 s, .* steps or more, .*; allowed: up to about "):
        wt.sweep(long, {"vehicle.mass": [1200.0]}, [feature], gradient=gradient, progress=False)
