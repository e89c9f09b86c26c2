"""Borders of wagons: on one side of them a wheel loses its rail, on the other none does."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ground.outcome import Outcome

DIP = wt.Scenario(
    vehicle=wt.Wagon.erri_b176(), irregularity=wt.CosineBump(height=-5e-5, length=0.05, start=0.02), speed=20.0,
    duration=0.01,
)  # fmt: skip
FLAT = DIP.replaced({
    "irregularity": {"wheelset 2 left": wt.WheelFlat(length=0.03, position=-2.51, repeat=False)},
    "creep": wt.creep.Polach(friction=0.35), "track": wt.tracks.Slab(**wt.tracks.Slab.example, cutoff=1000, bays=160),
})  # fmt: skip
DECK = DIP.replaced({"track": wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)})
TWICE = DIP.replaced({"duration": 0.02})
LOSSY = {"contact": wt.Hertz(restitution=0.5, impact_speed=0.2)}
WAVES = DIP.replaced({
    "irregularity": wt.Corrugation(amplitude=3e-5, wavelength=0.03, start=0.009), "rolling": "point",
    "contact": wt.Hertz(restitution=0.1, impact_speed=0.05),
})  # fmt: skip
HEIGHT, AMPLITUDE, LENGTH = "irregularity.0.height", "irregularity.0.amplitude", "irregularity.wheelset 2 left.0.length"


def losses_of(scene, method):
    """Return the number of losses of the wheel that has most."""
    events = wt.simulate(scene, method).events
    lost = events.contact[(events.kind == "loss") & (events.surface == "tread")]
    return int(np.bincount(lost, minlength=1).max())


def bisected(scene, path, least, most, many, method):
    """Return where runs of the same method begin to lose contact, to 1e-9 of it."""
    while abs(most - least) > 1e-9 * abs(most):
        middle = 0.5 * (least + most)
        least, most = (least, middle) if losses_of(scene.replaced({path: middle}), method) >= many else (middle, most)
    return most


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("scene", "over", "many", "method"),
    [
        pytest.param(
            DIP, {HEIGHT: [-4e-5, -3e-5], "speed": [19.0, 21.0]}, 1, "default", id="a dip", marks=pytest.mark.slow
        ),
        pytest.param(TWICE, {HEIGHT: [-4e-5, -3e-5], "speed": [19.0, 21.0]}, 2, "default", id="the second loss"),
        pytest.param(DECK, {HEIGHT: [-4e-5, -3e-5], "speed": [19.0, 21.0]}, 1, "strict", id="on a deck"),
        pytest.param(
            FLAT,
            {LENGTH: [0.015, 0.03], "speed": [18.0, 22.0]},
            1,
            "default",
            id="a flat on rails",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            DIP.replaced(LOSSY), {HEIGHT: [-9e-5, -4e-5], "speed": [19.0, 21.0]}, 1, "default", id="a damped dip"
        ),
        pytest.param(
            TWICE.replaced(LOSSY),
            {HEIGHT: [-13e-5, -5e-5], "speed": [19.0, 21.0]},
            2,
            "default",
            id="damped, twice",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            WAVES,
            {AMPLITUDE: [0.2e-5, 2e-5], "speed": [19.0, 21.0]},
            1,
            "strict",
            id="damped waves",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            FLAT.replaced(LOSSY),
            {LENGTH: [0.012, 0.02], "speed": [18.0, 22.0]},
            1,
            "default",
            id="damped, on rails",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_runs_on_both_sides_of_a_border_differ_and_bisection_finds_it(scene, over, many, method):
    path = next(iter(over))
    curve = wt.border(scene, over, losses=many, resolution=2, method=method)
    middle = int(np.abs(curve.speed.values - 20.0).argmin())
    assert abs(float(curve.speed[middle]) - 20.0) < 1e-9
    onset = float(curve[path][middle])
    assert losses_of(scene.replaced({path: 0.9995 * onset}), method) < many
    assert losses_of(scene.replaced({path: 1.0005 * onset}), method) >= many
    found = bisected(scene, path, 0.9999 * onset, 1.0001 * onset, many, method)
    assert found == pytest.approx(onset, rel=1e-7)
    assert np.abs(curve.margin.values).max() < 1e-12  # m


def test_with_material_damping_the_force_ends_before_the_indentation():
    record = wt.simulate(WAVES.replaced({AMPLITUDE: 4e-6}), "strict")
    lost = record.events.isel(event=[int(np.flatnonzero(record.events.kind.values == "loss")[0])])
    at = record.at(lost.time.values[0]).indentation.sel(wheelset=lost.wheelset.item(), side=lost.side.item())
    assert at.item() > 1e-6
    free = WAVES.replaced({"contact": wt.Hertz(), AMPLITUDE: 4e-6})
    assert losses_of(free, "strict") == 0


@pytest.mark.parametrize(("length", "speed"), [(0.022, 18.0), (0.03, 22.0)])
@pytest.mark.slow
def test_a_contact_that_closes_by_its_grip_while_it_is_indented_goes_on(length, speed):
    """A rail springs back when a damped contact is lost; the next one begins before the indentation has ended."""
    record = wt.simulate(FLAT.replaced(LOSSY | {LENGTH: length, "speed": speed}), "strict")
    assert record.outcome is Outcome.COMPLETED
    events = record.events
    hits = events.isel(event=np.flatnonzero(events.kind.values == "impact"))
    assert float(record.at(hits.time.values[:1]).indentation.max()) > 4e-5
    force = record.at(hits.time.values[0] + np.linspace(0.0, 1e-5, 11)).normal_force
    force = force.sel(wheelset=hits.wheelset.values[0], side=hits.side.values[0])
    assert (np.diff(force.values) > 0.0).all()
    assert float(record.energy.relative_imbalance) < 1e-6


@pytest.mark.slow
def test_a_dropped_wagon_has_lost_nothing_before_its_first_impact():
    """A flight that it begins with is no loss: what bounds the first loss is the contact after it."""
    scene = DIP.replaced(
        LOSSY | {"start": {"displacement": 1e-4, "velocity": 0.0}, "irregularity": (), "duration": 0.02}
    )
    path = "start.displacement"
    found = wt.border(scene, {path: [5e-5, 8e-4], "speed": [19.0, 21.0]}, resolution=2)
    onset = float(found[path][np.abs(found.speed.values - 20.0).argmin()])
    for ratio, losses in ((0.9999, 0), (1.0001, 1)):
        assert losses_of(scene.replaced({path: ratio * onset}), "default") == losses
