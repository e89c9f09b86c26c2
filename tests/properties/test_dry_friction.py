"""What must hold of dry friction and piecewise linear dampers of wagons: energy, mirrors, limits, modes, rails."""

import os

import numpy as np
import pytest

import wheeltapper as wt
from tests.properties.test_wagon_elements import AXLE, HELD, PLACE, run, spring, vehicle
from wheeltapper.ground.outcome import Outcome
from wheeltapper.lower.lowered import wagon_energy
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import replay
from wheeltapper.record.files.earlier import _assembly_of

COACH = wt.Wagon.erri_b176()
RUBBED = ("primary damper {} left", "primary damper {} right")


def friction(name="it", along="z", **numbers):
    return wt.vehicles.Friction(name=name, along=along, **({"force": 800.0} | PLACE | numbers))


def rubbing_coach(series):
    """The coach with friction instead of its vertical primary dampers."""
    wagon = COACH
    for old in [item for item in COACH.elements if item.name.startswith("primary damper")]:
        wagon = wagon.with_element(
            wt.vehicles.Friction(
                name=old.name, between=old.between, at=old.at, along="z", force=2.5e3, static_force=3e3,
                series_stiffness=series,
            )
        )  # fmt: skip
    return wagon


def coach_scene(irregularity, series, duration=0.08, **changes):
    fields = {
        "vehicle": rubbing_coach(series), "contact": wt.Hertz(constant_per_wheel=7.025e10),
        "creep": wt.creep.Polach(friction=0.35), "speed": 20.0,
    } | changes  # fmt: skip
    return wt.Scenario(irregularity=irregularity, duration=duration, **fields)


def drawn_law(draw):
    """A random element between body and wheelset: friction, or a damper of two to seven pieces."""
    series = 10 ** draw.uniform(6.0, 7.7) if draw.random() < 0.5 else None
    if draw.random() < 0.5:
        force = 10 ** draw.uniform(2.0, 4.3)
        limit = force * draw.choice([1.0, draw.uniform(1.0, 2.0)])
        return {"force": force, "static_force": limit, "series_stiffness": series}
    one, other = (np.cumsum(10 ** draw.uniform(-2.5, -0.7, draw.integers(1, 4))) for _ in range(2))
    more, less = (np.cumsum(10 ** draw.uniform(1.5, 3.5, len(side))) for side in (one, other))
    if draw.random() < 0.5:
        return {"rate": (0.0, *one), "force": (0.0, *more), "series_stiffness": series}
    rate, force = (*-other[::-1], 0.0, *one), (*-less[::-1], 0.0, *more)
    return {"rate": rate, "force": force, "series_stiffness": series}


def element_of(law, name):
    kind = wt.vehicles.Damper if "rate" in law else wt.vehicles.Friction
    return kind(name=name, along="z", **law, **PLACE)


MOST_RUNS, MANY_PARTS = int(os.environ.get("WHEELTAPPER_RUNS", "600")), 4
"""Random runs of the long test; WHEELTAPPER_RUNS=10000 takes up to an hour of one core."""


def check_random_run(seed):
    """A wagon with random elements falls off a random bump or step: no element may give energy."""
    draw = np.random.default_rng(seed)
    elements = [element_of(drawn_law(draw), f"it {k}") for k in range(draw.integers(1, 4))]
    wagon = vehicle(spring(10 ** draw.uniform(5.5, 6.7)), *elements, mass=draw.uniform(2e3, 2e4))
    height = draw.choice([-1.0, 1.0]) * 10 ** draw.uniform(-4.5, -2.8)
    rough = (
        wt.Step(height=height, position=0.02)
        if draw.random() < 0.3
        else wt.CosineBump(height=height, length=draw.uniform(0.03, 0.5), start=0.01)
    )
    record = run(wagon, 0.05, irregularity=rough, speed=draw.uniform(2.0, 20.0), rolling="point")
    works = wagon_energy.works(record._lowered, record._march)[0]
    balance = record.energy
    exchanged = float(balance.exchanged)
    assert record.outcome is Outcome.COMPLETED, seed
    assert works[:, [replay.DAMPER_POWER, replay.SLIDER_POWER]].min() >= -1e-10 * exchanged, seed
    assert abs(float(balance.imbalance)) <= 1e-10 * exchanged, seed


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # some bumps are sharper than a wheel
def test_energy_is_never_created():
    for seed in range(60):
        check_random_run(seed)


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("part", range(MANY_PARTS))
def test_energy_is_never_created_in_many_runs(part):
    for seed in range(60 + part, MOST_RUNS, MANY_PARTS):
        check_random_run(seed)


@pytest.mark.parametrize("series", [None, 2e7])
def test_a_mirrored_input_gives_a_mirrored_output(series):
    rough = wt.CosineBump(height=1e-3, length=0.3, start=0.1)
    one, other = (wt.simulate(coach_scene({side: rough}, series), "strict") for side in ("right", "left"))
    assert {"stick", "slip"} <= set(one.suspension_events.kind.values)
    swap = {"left": "right", "right": "left"}
    found = {}
    for record, swapped in ((one, False), (other, True)):
        wheels, elements = record.events, record.suspension_events
        rows = [
            *zip(wheels.time.values, wheels.kind.values, wheels.side.values, strict=True),
            *zip(elements.time.values, elements.kind.values, elements.element.values, strict=True),
        ]
        found[swapped] = sorted(
            (" ".join(swap.get(word, word) if swapped else word for word in f"{kind} {where}".split()), time)
            for time, kind, where in rows
        )
    assert [what for what, _ in found[False]] == [what for what, _ in found[True]]
    np.testing.assert_allclose(*([time for _, time in found[side]] for side in (False, True)), rtol=0, atol=1e-10)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*implausible")
@pytest.mark.parametrize("series", [None, 2e7])
def test_on_rails_energy_closes_and_stiff_rails_are_rigid(series):
    from tests.properties.test_wagon_on_rails import BALLASTED, stronger

    rough = wt.CosineBump(height=1e-3, length=0.3, start=0.1)
    soft = wt.simulate(coach_scene(rough, series, 0.04, track=BALLASTED), "strict")
    assert {"slip"} <= set(soft.suspension_events.kind.values)
    assert float(soft.energy.dissipated_friction) > 1.0
    assert float(soft.energy.relative_imbalance) < 1e-8
    records = [
        wt.simulate(coach_scene(rough, series, 0.04, **track), "strict") for track in ({}, {"track": stronger(1e6)})
    ]
    for rigid, stiff in ([one.events for one in records], [one.suspension_events for one in records]):
        assert list(rigid.kind.values) == list(stiff.kind.values)
        np.testing.assert_allclose(rigid.time, stiff.time, rtol=0, atol=1e-6)


def test_two_that_share_a_place_are_one():
    # their forces are not determined while both stick, their sum is
    for series in (None, 4e6):
        numbers = {"static_force": 1800.0, "series_stiffness": series}
        whole = {"static_force": 3600.0, "series_stiffness": series and 2.0 * series}
        both = run(vehicle(spring(1e6), friction("a", **numbers), friction("b", **numbers)))
        one = run(vehicle(spring(1e6), friction(force=1600.0, **whole)))
        assert len(one.events.time) + len(one.suspension_events.time) > 40
        for kind in ("loss", "impact"):
            times = [record.events.time[record.events.kind == kind] for record in (both, one)]
            np.testing.assert_allclose(*times, rtol=0, atol=1e-9)


HUMP = {"irregularity": wt.CosineBump(height=2e-3, length=1.0, start=0.3), "speed": 25.0, "rolling": "point"}


def over_hump(*elements, free=(), wheelbase=None, **changes):
    """Run a body on springs beside both rails, with friction elements {name: (side, numbers)}, over a long bump."""
    numbers = (1,) if wheelbase is None else (1, 2)
    held = tuple(motion for motion in HELD if motion not in free)
    body = wt.vehicles.Body(name="body", mass=5e3, inertia=(1e3, 4e3, 1e3), position=(0.0, 0.0, 1.0), held=held)
    axles, made = [], []
    for number in numbers:
        x = 0.0 if wheelbase is None else (1.5 - number) * wheelbase
        axles.append(wt.vehicles.Axle(position=x, **AXLE))
        ends = {"between": ("body", f"wheelset {number}")}
        for y in (1.0, -1.0):
            name = f"spring {number} {y:g}"
            made.append(wt.vehicles.Spring(name=name, at=(x, y, 0.8), stiffness=(0.0, 0.0, 5e5), **ends))
        for name, y, force, limit in elements:
            law = {"along": "z", "force": force, "static_force": limit}
            made.append(wt.vehicles.Friction(name=f"{name} {number}", at=(x, y, 0.8), **law, **ends))
    return run(wt.Wagon(bodies=(body,), axles=tuple(axles), elements=tuple(made)), 0.13, **HUMP | changes)


def changes_of(record, name):
    found = record.suspension_events
    mine = found.isel(suspension_event=[one.startswith(name) for one in found.element.values])
    return mine.time.values, list(mine.kind.values)


@pytest.mark.few(5)
@pytest.mark.parametrize("track", [None, "rails"])
@pytest.mark.parametrize("pitches", [False, True])
@pytest.mark.parametrize("limits", [(3600.0, 3600.0), (3000.0, 3000.0), (4600.0, 2600.0)])
def test_a_pair_that_moves_alike_sticks_and_slides_as_one(limits, pitches, track):
    from tests.properties.test_wagon_on_rails import BALLASTED

    two_axles = {"wheelbase": 1.8, "free": ("pitch",)} if pitches else {}
    below = {} if track is None else {"track": BALLASTED}
    forces = (3000.0, 3000.0) if limits[0] == limits[1] else (4000.0, 2000.0)
    pair = [
        (name, y, *of) for name, y, of in zip(("a", "b"), (1.0, -1.0), zip(forces, limits, strict=True), strict=True)
    ]
    one, both = (over_hump(*made, **two_axles, **below) for made in ([("one", 0.0, 6000.0, sum(limits))], pair))
    expected, kinds = changes_of(one, "one")
    assert {"stick", "slip"} == set(kinds)
    for name in "ab":
        times, found = changes_of(both, name)
        assert found == kinds
        np.testing.assert_allclose(times, expected, rtol=0, atol=1e-9)
    assert float(both.energy.dissipated_friction) == pytest.approx(float(one.energy.dissipated_friction), rel=1e-8)
    assert float(both.energy.relative_imbalance) < 1e-9


@pytest.mark.filterwarnings("ignore")  # some bumps are sharper than a wheel
def test_many_that_stick_in_turn_give_no_energy():
    # up to six elements of random forces beside a body that may roll and pitch, a bump below one side or both
    slips = 0
    for seed in range(24):
        draw = np.random.default_rng(seed)
        elements = []
        for number in range(draw.integers(1, 4)):
            force = 10 ** draw.uniform(2.0, 4.0)
            elements.append((f"{number}", draw.choice([-1.0, 0.0, 1.0]), force, force * draw.choice([1.0, 1.2, 1.8])))
        height = draw.choice([-1.0, 1.0]) * 10 ** draw.uniform(-4.5, -2.8)
        bump = wt.CosineBump(height=height, length=draw.uniform(0.05, 1.0), start=0.02)
        free = [(), ("roll",), ("pitch",), ("roll", "pitch")][seed % 4]
        record = over_hump(
            *elements, free=free, wheelbase=1.8, irregularity=bump if seed % 3 else {"left": bump},
            speed=draw.uniform(5.0, 30.0),
        )  # fmt: skip
        assert record.outcome is Outcome.COMPLETED, seed
        assert float(record.energy.relative_imbalance) < 1e-10, seed
        for name in np.unique(record.suspension_events.element):
            times, _ = changes_of(record, name)
            assert np.diff(times).min(initial=1.0) > 1e-10, seed  # none begins to slide and sticks at once
        slips += record.suspension_events.sizes["suspension_event"]
    assert slips > 200


@pytest.mark.parametrize("track", [None, "rails"])
def test_symmetric_input_stays_symmetric_where_a_body_may_roll(track):
    # let go one after the other, the first takes so much of what the body needs that the second holds
    from tests.properties.test_wagon_on_rails import BALLASTED

    below = {} if track is None else {"track": BALLASTED}
    pair = over_hump(("a", 1.0, 3000.0, 3600.0), ("b", -1.0, 3000.0, 3600.0), free=("roll",), **below)
    (left, kinds), (right, others) = (changes_of(pair, name) for name in "ab")
    assert kinds == others
    assert {"stick", "slip"} == set(kinds)
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-12)
    found = pair.at(np.linspace(0.0, 0.13, 200))
    assert float(np.abs(found.displacement.sel(body="body", motion="roll")).max()) < 1e-12
    apart = found.normal_force.sel(side="left") - found.normal_force.sel(side="right")
    assert float(np.abs(apart).max()) < 1e-9 * pair.static_force
    assert float(pair.energy.relative_imbalance) < 1e-9


@pytest.mark.slow
def test_one_at_its_limit_sticks_while_the_other_holds(tmp_path):
    # equally shared, 2400 N are the limit of the first; together they hold 4800 N
    record, one = over_hump(("a", 1.0, 1e3, 1.2e3), ("b", -1.0, 3e3, 3.6e3)), over_hump(("one", 0.0, 4e3, 4.8e3))
    pieces = record._march.steps[:, asm.STEP_ELEMENTS :]
    assert (pieces[:, 0] > asm.FORTH).any()
    assert (pieces[:, 1] <= asm.FORTH).all()
    (first, _), (second, _), (whole, _) = changes_of(record, "a"), changes_of(record, "b"), changes_of(one, "one")
    np.testing.assert_array_equal(first, second)
    np.testing.assert_allclose(first, whole, rtol=0, atol=1e-9)
    record.save(tmp_path / "record.nc")
    again = wt.load(tmp_path / "record.nc")
    assert again.suspension_events.equals(record.suspension_events)
    assert again.at([0.02, 0.1]).equals(record.at([0.02, 0.1]))


def test_unequal_ones_that_share_a_place_slide_with_their_sum():
    unequal = run(vehicle(spring(1e6), friction("a", force=400.0), friction("b", force=1200.0)), 0.1)
    one = run(vehicle(spring(1e6), friction(force=1600.0)), 0.1)
    for kind in ("loss", "impact"):
        times = [record.events.time[record.events.kind == kind] for record in (unequal, one)]
        np.testing.assert_allclose(*times, rtol=0, atol=1e-9)
    assert float(unequal.energy.dissipated_friction) == pytest.approx(float(one.energy.dissipated_friction), rel=1e-8)


def test_what_never_slides_is_a_spring_or_a_link():
    stuck = {None: wt.vehicles.Link(name="it", along=("z",), **PLACE), 5e6: spring(5e6, "it")}
    for series, other in stuck.items():
        found = run(vehicle(spring(1e6), friction(force=1e8, series_stiffness=series)))
        expected = run(vehicle(spring(1e6), other))
        assert not found.suspension_events.sizes["suspension_event"]
        np.testing.assert_allclose(found.events.time, expected.events.time, rtol=0, atol=1e-10)
        assert float(found.energy.dissipated_friction) == 0.0


def test_modes_take_friction_that_sticks():
    for series in (None, 5e6):
        stuck = wt.vehicles.Link(name="it", along=("z",), **PLACE) if series is None else spring(series, "it")
        scenes = [
            wt.Scenario(
                vehicle=vehicle(spring(1e6), element), contact=wt.Hertz(constant_per_wheel=7e10), speed=9.0,
                profiles=wt.profiles.Cones(moving_with="wheel"), duration=0.1,
            )
            for element in (friction(series_stiffness=series), stuck)
        ]  # fmt: skip
        found, expected = (wt.modes(scene) for scene in scenes)
        assert found.sizes == expected.sizes
        np.testing.assert_allclose(found.frequency, expected.frequency, rtol=1e-6)


def test_a_piecewise_damper_of_one_slope_is_a_damper():
    law = {"along": "z", "rate": (0.0, 0.01, 0.05), "force": (0.0, 200.0, 1000.0)}
    for series in (None, 1e7):
        straight = wt.vehicles.Damper(name="d", series_stiffness=series, **law, **PLACE)
        plain = wt.vehicles.Damper(name="d", damping=(0.0, 0.0, 2e4), series_stiffness=series, **PLACE)
        one, other = (run(vehicle(spring(1e6), damper), 0.1) for damper in (straight, plain))
        assert len(one.events.time) > 10
        np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=1e-9)
        assert float(one.energy.dissipated) == pytest.approx(float(other.energy.dissipated), rel=1e-7)


def test_it_begins_at_rest_without_a_force():
    level = run(vehicle(spring(1e6), friction(series_stiffness=1e7), friction("rigid")), irregularity=None)
    assert len(level.events.time) == len(level.suspension_events.time) == 0
    assert level.static_force == pytest.approx(6500 * 9.81 / 2, rel=1e-12)
    np.testing.assert_allclose(level.history(1e3).normal_force, level.static_force, rtol=1e-10)


@pytest.mark.slow
def test_events_name_their_element(tmp_path):
    record = run(vehicle(spring(1e6), friction(series_stiffness=1e7), friction("rigid", force=300.0)))
    found = record.suspension_events
    mine = found.isel(suspension_event=found.element.values == "it")
    kinds = list(mine.kind.values)
    assert kinds[:2] == ["slip", "stick"]
    assert all(a != b for a, b in zip(kinds[:-1], kinds[1:], strict=True))
    assert np.abs(mine.compression_rate[mine.kind == "stick"]).max() < 1e-12
    assert np.abs(mine.compression_rate[mine.kind == "slip"]).min() > 0.0
    slips = mine.isel(suspension_event=mine.kind.values == "slip")
    apart = record.at(slips.time.values).velocity.sel(motion="z")
    opens = (apart.sel(body="body") - apart.sel(body="wheelset 1")).values
    np.testing.assert_allclose(slips.compression_rate, -opens, rtol=0, atol=1e-12)
    assert [side == "extension" for side in slips.side.values] == list(opens > 0.0)
    assert {"loss", "impact"} == set(record.events.kind.values)
    record.save(tmp_path / "record.nc")
    again = wt.load(tmp_path / "record.nc")
    assert again.suspension_events.equals(found)
    assert again.at([0.05, 0.1]).equals(record.at([0.05, 0.1]))
    assert float(again.energy.dissipated_friction) == float(record.energy.dissipated_friction)


def test_assemblies_of_earlier_files_are_read():
    damper = wt.vehicles.Damper(name="d", damping=(0, 0, 2e4), series_stiffness=1e7, free_play=1e-4, **PLACE)
    scene = run(vehicle(spring(1e6), damper), 0.01).scenario
    new = lower_wagon(scene).assembly
    damping = np.where(new.element_inside >= 0, 2e4, 1.0)
    old = new._replace(
        corners=new.corners[:, :2], element_inside=np.column_stack([new.element_inside, damping]).astype(float)
    )
    made = _assembly_of(old._asdict())
    assert np.array_equal(made.element_inside, new.element_inside)
    np.testing.assert_allclose(made.corners, new.corners, rtol=1e-12)


def test_lateral_friction_holds_a_body_that_a_spring_centres():
    # a body free in y sticks to the wheelset although a lateral force grows, then slides
    held = tuple(name for name in HELD if name != "y")
    body = wt.vehicles.Body(name="body", mass=5000.0, inertia=(1e3,) * 3, position=(0.0, 0.0, 1.0), held=held)
    axle = wt.vehicles.Axle(mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0, held=("x", "pitch", "yaw"))
    elements = (
        wt.vehicles.Spring(name="spring", stiffness=(0.0, 1e5, 1e6), **PLACE),
        friction(along="y", force=60.0),
    )
    record = wt.simulate(
        wt.Scenario(
            vehicle=wt.Wagon(bodies=(body,), axles=(axle,), elements=elements), speed=9.0, duration=0.3,
            contact=wt.Hertz(constant_per_wheel=7e10), creep=wt.creep.Polach(friction=0.35),
            irregularity={"left": wt.CosineBump(height=1e-3, length=1.0, start=0.1)},
        ), "strict",
    )  # fmt: skip
    changes = record.suspension_events
    kinds = changes.kind.values[changes.element.values == "it"]
    assert kinds[0] == "slip"
    assert float(record.energy.relative_imbalance) < 1e-8
    first = float(changes.time[changes.element == "it"][0])
    y = record.at(np.linspace(0.0, first, 50)).velocity.sel(motion="y")
    roll = record.at(np.linspace(0.0, first, 50)).velocity.sel(motion="roll", body="wheelset 1")
    apart = y.sel(body="body") - y.sel(body="wheelset 1") + roll * (0.8 - axle.radius)
    assert float(np.abs(apart).max()) < 1e-12 < float(np.abs(y).max())
