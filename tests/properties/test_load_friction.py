"""What must hold of friction that follows a load, and of springs that only press: energy, mirrors, rest, files."""

import os

import numpy as np
import pytest

import wheeltapper as wt
from tests.moved_bodies import changes_of, element, moved, spring
from tests.properties.test_wagon_elements import PLACE, run, vehicle
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.lowered import wagon_energy
from wheeltapper.lower.structure import Slider, equivalent_of
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march.common import program as contract
from wheeltapper.march.wagon import replay

FREE = ("z", "roll", "pitch")
MOST_RUNS, MANY_PARTS = int(os.environ.get("WHEELTAPPER_RUNS", "200")), 4
"""Random drops of the long test; WHEELTAPPER_RUNS=10000 takes about two hours of one core."""


def drawn_network(draw, mirrored=False):
    """Bodies above each other on nests and springs, with friction that these press; mirrored, left is right."""
    sign = -1.0 if mirrored else 1.0
    names = ["lower", "upper"][: draw.integers(1, 3)]
    bodies = {name: draw.uniform(1e3, 2e4) for name in names}
    weights = np.cumsum(list(bodies.values())[::-1])[::-1] * 9.81
    elements, begin = [], {}
    for level, (name, weight) in enumerate(zip(names, weights, strict=True)):
        ends = (name, "ground" if level == 0 else names[level - 1])
        loads = []
        for corner in range(draw.integers(2, 5)):
            at = (draw.choice([-1.0, 1.0]), sign * (1.0 if corner % 2 else -1.0), 1.0)
            nest, sinks = f"nest {level}{corner}", draw.uniform(0.01, 0.05)
            force = 0.3 * weight * draw.uniform(0.6, 1.4)
            if draw.random() < 0.5:
                stages = {
                    "compression": (0.0, sinks, 2.0 * sinks),
                    "force": (0.0, force, force * draw.uniform(2.2, 5.0)),
                }
                more = draw.choice([{}, {"preload": 0.4 * force}, {"gap": 0.2 * sinks}])
                elements.append(element("CompressionSpring", nest, ends, at=at, along="z", **stages, **more))
            else:
                elements.append(spring(nest, ends, force / sinks, at=at))
            loads.append((nest, at))
        elements.append(
            element(
                "Spring", f"hold {level}", ends, stiffness=(0.0, 0.0, weight / draw.uniform(0.05, 0.3)),
                bending=(weight * draw.uniform(0.1, 2.0), weight * draw.uniform(0.1, 2.0), 0.0),
            )
        )  # fmt: skip
        for number in range(draw.integers(1, 4)):
            nest, at = loads[draw.integers(len(loads))]
            slides = 10 ** draw.uniform(-1.5, -0.2, 2)
            begins = slides * (1.0 if draw.random() < 0.5 else draw.uniform(1.0, 1.8))
            elements.append(
                element(
                    "Friction", f"rubs {level}{number}", ends, at=at, along="z", load=nest, coefficient=tuple(slides),
                    static_coefficient=tuple(begins),
                    series_stiffness=weight * 10 ** draw.uniform(1.5, 3.5) if draw.random() < 0.5 else None,
                )
            )  # fmt: skip
        lift = draw.uniform(-0.01, 0.06)
        begin[name] = {
            "z": (lift, 0.0),
            "roll": (sign * draw.normal() * 0.01, 0.0),
            "pitch": (draw.normal() * 0.01, 0.0),
        }
    return bodies, elements, begin


def dropped(seed, mirrored=False, duration=0.4):
    draw = np.random.default_rng(seed)
    bodies, elements, begin = drawn_network(draw, mirrored)
    return moved(bodies, elements, begin, duration, FREE, (2e3, 3e3, 3e3))


def check_drop(seed):
    """No drop may gain energy; its friction takes what is missing."""
    lowered, march = dropped(seed)
    assert march.status == contract.DONE, seed
    done = wagon_energy.works(lowered, march)
    terms = wagon_energy.balance(lowered, march, done)
    exchanged = float(terms.exchanged)
    assert done[0][:, replay.SLIDER_POWER].min() >= -1e-10 * exchanged, seed
    change = terms.terms["kinetic"] + terms.terms["elastic"] + terms.terms["dissipated_friction"]
    given = terms.terms["work_of_load"] + terms.terms["work_of_irregularity"]
    assert abs(change - given) <= 1e-10 * exchanged, seed
    return len(changes_of(march))


@pytest.mark.slow
def test_dropped_networks_gain_no_energy():
    assert sum(check_drop(seed) for seed in range(40)) > 300


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize("part", range(MANY_PARTS))
def test_many_dropped_networks_gain_no_energy(part):
    for seed in range(40 + part, MOST_RUNS, MANY_PARTS):
        check_drop(seed)


def test_mirrored_networks_move_as_mirror_images():
    changes = 0
    for seed in range(12):
        one, other = (changes_of(dropped(seed, mirrored, 0.2)[1]) for mirrored in (False, True))
        assert [what for _, *what in one] == [what for _, *what in other], seed
        times = [[time for time, *_ in found] for found in (one, other)]
        np.testing.assert_allclose(*times, rtol=0, atol=1e-12)
        changes += len(one)
    assert changes > 50


@pytest.mark.parametrize("series", [None, 5e6])
def test_friction_below_a_constant_load_is_friction_of_a_constant_force(series):
    weight = wt.vehicles.Body(
        name="weight", mass=1000.0, inertia=(1e3,) * 3, position=(0.0, 0.0, 2.0),
        held=("x", "y", "roll", "pitch", "yaw"),
    )  # fmt: skip
    below = wt.vehicles.Spring(name="below", between=("weight", "ground"), at=(0, 0, 2), stiffness=(0.0, 0.0, 1e6))
    main = wt.vehicles.Spring(name="spring", stiffness=(0.0, 0.0, 1e6), **PLACE)
    laws = {"load": "below", "coefficient": 0.08, "static_coefficient": 0.1}, {
        "force": 0.08 * 9810.0, "static_force": 0.1 * 9810.0,
    }  # fmt: skip
    records = []
    for law in laws:
        rubs = wt.vehicles.Friction(name="it", along="z", series_stiffness=series, **law, **PLACE)
        made = vehicle(main)
        both = wt.Wagon(bodies=(*made.bodies, weight), axles=made.axles, elements=(main, below, rubs))
        records.append(run(both))
    for name in ("events", "suspension_events"):
        one, other = (getattr(record, name) for record in records)
        assert list(one.kind.values) == list(other.kind.values)
        np.testing.assert_allclose(one.time, other.time, rtol=0, atol=1e-11)
    assert len(records[0].suspension_events.time) > 5
    one, other = (float(record.energy.dissipated_friction) for record in records)
    assert one == pytest.approx(other, rel=1e-9)


def nest(**more):
    fields = {"along": "z", "compression": (0.0, 0.02, 0.05), "force": (0.0, 2e4, 8e4)} | PLACE | more
    return wt.vehicles.CompressionSpring(name="nest", **fields)


def rubbed(**numbers):
    return wt.vehicles.Friction(name="it", along="z", **({"load": "nest", "coefficient": 0.2} | PLACE | numbers))


def test_a_spring_that_never_parts_is_a_spring():
    straight = nest(compression=(0.0, 0.2), force=(0.0, 2e5))
    one, other = (
        run(vehicle(*elements, rubbed(load=load)))
        for elements, load in (
            ((straight,), "nest"), ((wt.vehicles.Spring(name="s", stiffness=(0.0, 0.0, 1e6), **PLACE),), "s")
        )
    )  # fmt: skip
    assert one.static_force == pytest.approx(other.static_force, rel=1e-12)
    for name in ("events", "suspension_events"):
        found = [getattr(record, name) for record in (one, other)]
        np.testing.assert_allclose(*(table.time for table in found), rtol=0, atol=1e-11)
    assert len(one.events.time) > 5


def test_how_far_a_nest_is_pressed_follows_from_what_it_carries():
    light, heavy = (lower_wagon(run(vehicle(nest(), mass=mass), 0.01).scenario) for mass in (1000.0, 5000.0))
    assert light.structure.prestress.force_of("nest") == pytest.approx(9810.0, rel=1e-12)
    assert light.structure.prestress.one_ways[0] == pytest.approx(9810.0 / 1e6, rel=1e-12)
    assert heavy.structure.prestress.one_ways[0] == pytest.approx(0.02 + (49050.0 - 2e4) / 2e6, rel=1e-12)
    beside = wt.vehicles.Spring(name="beside", stiffness=(0.0, 0.0, 1e6), **PLACE)
    both = lower_wagon(run(vehicle(nest(), beside), 0.01).scenario)
    assert both.structure.prestress.one_ways[0] == pytest.approx(0.02 + (49050.0 - 4e4) / 3e6, rel=1e-12)
    stated = lower_wagon(run(vehicle(nest(preload=5e3), beside), 0.01).scenario)
    assert stated.structure.prestress.force_of("nest") == pytest.approx(5e3)
    assert float(stated.structure.prestress.loads.sum()) == pytest.approx(-6500 * 9.81, rel=1e-12)


def test_events_of_nests_and_friction_are_told_and_kept(tmp_path):
    record = run(vehicle(nest(gap=2e-4), wt.vehicles.Spring(name="s", stiffness=(0.0, 0.0, 1e6), **PLACE), rubbed()))
    found = record.suspension_events
    kinds = {(str(e), str(k)) for e, k in zip(found.element.values, found.kind.values, strict=True)}
    assert {("nest", "meet"), ("nest", "leave"), ("it", "meet"), ("it", "leave")} <= kinds
    for kind in ("meet", "leave"):
        times = [found.time[(found.element == name) & (found.kind == kind)] for name in ("nest", "it")]
        np.testing.assert_allclose(*times, rtol=0, atol=1e-11)
    assert float(record.energy.relative_imbalance) < 1e-9
    record.save(tmp_path / "record.nc")
    again = wt.load(tmp_path / "record.nc")
    assert again.suspension_events.equals(found)
    assert again.at([0.05, 0.1]).equals(record.at([0.05, 0.1]))


@pytest.mark.parametrize(
    ("elements", "field", "found"),
    [
        (lambda: (rubbed(load="nset"), nest()), "elements.it.load", "no element 'nset'; allowed: nest (did you mean"),
        (
            lambda: (rubbed(), wt.vehicles.Link(name="nest", along=("z",), **PLACE)), "elements.it.load",
            "'nest', a Link: its force is not unique",
        ),
        (
            lambda: (rubbed(), wt.vehicles.Damper(name="nest", damping=(0, 0, 1e4), **PLACE)), "elements.it.load",
            "'nest', a Damper",
        ),
        (lambda: (rubbed(force=100.0),), "force", "force, load, coefficient"),
        (lambda: (rubbed(static_force=100.0), nest()), "static_force", "beside load"),
        (lambda: (rubbed(static_coefficient=0.1), nest()), "static_coefficient", "0.1"),
        (lambda: (nest(force=(0.0, 2e4, 2e4)),), "force", "numbers that do not rise"),
        (lambda: (nest(compression=(0.01, 0.02, 0.05)),), "", "does not begin at zero"),
        (lambda: (nest(gap=1e-3, preload=10.0),), "gap", "a gap beside preload"),
        (
            lambda: (
                wt.vehicles.FrictionWedge(name="it", load="nest", friction=0.4, angle="20 deg", **PLACE), nest()
            ), "angle", "a slope of 0.364",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(elements, field, found):
    with pytest.raises(InputError) as error:
        vehicle(*elements())
    assert field in error.value.field
    assert found in str(error.value)


def test_a_spring_that_carries_nothing_presses_nothing():
    aside = wt.vehicles.Spring(name="aside", stiffness=(0.0, 1e6, 0.0), **PLACE)
    main = wt.vehicles.Spring(name="s", stiffness=(0.0, 0.0, 1e6), **PLACE)
    with pytest.raises(InputError, match="which carries nothing at rest"):
        run(vehicle(main, aside, rubbed(load="aside")))


@pytest.mark.parametrize("series", [None, 4e6])
def test_the_equivalent_of_friction_has_the_first_harmonic_of_its_force(series):
    # a slider that is moved to and fro, step by step, against its spring and damper
    force, amplitude = 900.0, 1e-3
    slider = Slider("it", np.ones(1), force, force, series)
    stiff, loss = equivalent_of(slider, amplitude)
    phase = 2.0 * np.pi * np.arange(80_000) / 20_000  # four turns
    motion, slid, pulls = amplitude * np.sin(phase), 0.0, []
    for here, ahead in zip(motion, np.cos(phase), strict=True):
        if series is None:
            pulls.append(force * np.sign(ahead))
            continue
        pull = np.clip(series * (here - slid), -force, force)
        slid = here - pull / series
        pulls.append(pull)
    last = np.array(pulls)[-20_000:]
    harmonic = 2.0 * np.mean(last * np.exp(-1j * phase[-20_000:]))
    assert stiff * amplitude == pytest.approx(-harmonic.imag, rel=1e-3, abs=1.0)
    assert loss * amplitude == pytest.approx(harmonic.real, rel=1e-3)
    assert equivalent_of(slider, 1e-7)[0] == (series or 0.0)


def test_modes_with_friction_at_an_amplitude_lie_between_stuck_and_free():
    main = wt.vehicles.Spring(name="s", stiffness=(0.0, 0.0, 1e6), **PLACE)
    scenes = {
        name: wt.Scenario(
            vehicle=vehicle(main, *elements), contact=wt.Hertz(constant_per_wheel=7e10), speed=9.0, duration=0.1,
            profiles=wt.profiles.Cones(moving_with="wheel"),
        )
        for name, elements in (("rubs", (rubbed(load="s", series_stiffness=3e6, coefficient=0.1),)), ("free", ()))
    }  # fmt: skip
    at = {"friction_frequency": "3 Hz"}
    free = wt.modes(scenes["free"]).frequency[0]
    stuck = wt.modes(scenes["rubs"]).frequency[0]
    found = [wt.modes(scenes["rubs"], friction_amplitude=size, **at) for size in ("0.01 mm", "3 mm", "30 mm", "1 m")]
    first = [float(one.frequency[0]) for one in found]
    assert first[0] == pytest.approx(float(stuck))
    assert first[-1] == pytest.approx(float(free), rel=1e-3)
    assert float(free) < first[2] < first[1] < float(stuck)
    ratios = [float(one.damping_ratio[0]) for one in found]
    assert ratios[0] == pytest.approx(0.0, abs=1e-6)
    assert ratios[1] > ratios[2] > ratios[3] > 0.0
    with pytest.raises(InputError, match="friction_amplitude: found it alone"):
        wt.modes(scenes["rubs"], friction_amplitude="1 mm")


def test_the_reduced_model_has_the_slope_of_a_nest():
    scenes = [
        run(vehicle(one), 0.01).scenario
        for one in (nest(), wt.vehicles.Spring(name="s", stiffness=(0.0, 0.0, 2e6), **PLACE))
    ]
    nested, plain = (wt.reduced(scene).vehicle for scene in scenes)
    assert nested.stiffness == pytest.approx(2e6)
    assert nested == plain or nested.stiffness == pytest.approx(plain.stiffness)


THREE_PIECE = {
    "body_mass": 80e3, "body_inertia": (1.2e5, 1.3e6, 1.3e6), "body_height": 2.2, "plate_radius": 0.17,
    "plate_friction": 0.25, "plate_stiffness": 1e8,
}  # fmt: skip


def test_a_wagon_on_three_piece_bogies_stands_and_rubs_over_a_joint():
    whole = wt.vehicles.ThreePieceWagon(**THREE_PIECE)
    made = whole.wagon()
    assert made.mass == pytest.approx(80e3 + 2 * 911.0 + 4 * 630.0 + 4 * 1777.55)
    joint = wt.irregularities.DippedJoint(angle="20 mrad", length="1 m", position=0.5)
    record = wt.simulate(
        wt.Scenario(
            vehicle=whole, contact=wt.Hertz(constant_per_wheel=9e10), creep=wt.creep.Polach(friction=0.35),
            irregularity=joint, speed=20.0, duration=0.1, rolling="point",
        )
    )  # fmt: skip
    assert record.static_force == pytest.approx(9.81 * made.mass / 8.0, rel=1e-9)
    prestress = record._lowered.structure.prestress
    nests = [force for name, force in prestress.forces if name.startswith("wedge spring")]
    assert np.ptp(nests) < 1e-6 * nests[0]
    upper = (80e3 / 2.0 + 911.0) * 9.81 / 2.0  # on a side: seven main springs and two of wedges share it
    assert nests[0] == pytest.approx(upper * 393046.0 / (7 * 572410.86 + 2 * 393046.0), rel=1e-6)
    rubs = {str(name) for name in record.suspension_events.element.values}
    assert {f"wedge 1 {side} {end}" for side in ("left", "right") for end in ("front", "rear")} <= rubs
    assert float(record.energy.relative_imbalance) < 1e-7
    left = {name.replace("left", "right") for name in rubs if "left" in name}
    assert left == {name for name in rubs if "right" in name}
