"""Dry friction, bumpstops, springs with corners and dampers that blow off: against another program, and limits."""

from math import pi

import numpy as np
import pytest

import wheeltapper as wt
from tests import pieces
from wheeltapper.describe.scenario import Start
from wheeltapper.lower.plane import lower_plane
from wheeltapper.march.general.contract import STRICT
from wheeltapper.march.general.march import march

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
WHEEL = {"mass": 1500.0, "load": 91_307.0, "stiffness": 2.44e6, "damping": 5e3}
KINKS = {
    "friction": {"friction": 3.3e3, "friction_stiffness": 2e7},
    "bumpstops": {"bumpstop_gap": 1.5e-4, "rebound_gap": 1e-4, "bumpstop_stiffness": 1.5e7},
    "corners": {"spring_corners": ((-1e-4, 0.5e6), (0.8e-4, 6e6), (1.8e-4, 1.2e7))},
    "blow-off": {"blow_off_force": 700.0, "blow_off_damping": 1e3},
}
KINKS["all"] = {name: value for kind in KINKS.values() for name, value in kind.items()}
SPEED, CONTACT = 9.0, 1.2e9
WHEEL["load"] += WHEEL["stiffness"] * (WHEEL["load"] + 9.81 * WHEEL["mass"]) / CONTACT  # what the spring bears at rest
WAVES = ((4e-5, 2 * pi / 0.061), (6e-5, 2 * pi / 0.11))
TIMES = {"default": 3e-10, "strict": 1e-12}
"""By how much times of events may differ, s."""
BOGIE = {
    "wheelset_mass": 1200.0, "frame_mass": 2600.0, "pitch_inertia": 1500.0, "wheelbase": 2.56,
    "primary_stiffness": 2.4e6, "primary_damping": 3e4, "secondary_stiffness": 8e5, "secondary_damping": 4e4,
    "wheel_load": 1e5,
}  # fmt: skip


def corrugated(vehicle, duration=0.05, pulls=False, **changes):
    waves = [wt.Corrugation(amplitude=size, wavelength=2 * pi / number, start=0.0) for size, number in WAVES]
    return wt.Scenario(
        vehicle=vehicle, contact=wt.Linear(stiffness=CONTACT, bilateral=pulls), irregularity=waves, rolling="point",
        speed=SPEED, duration=duration, **changes,
    )  # fmt: skip


def static_of(wheel):
    """Return the static force on the contact, N: the spring has none at first touch (the paper, Eq. 2.3)."""
    return (wheel["load"] + 9.81 * wheel["mass"]) * CONTACT / (CONTACT + wheel["stiffness"])


def elements_of(fields, along, stiffness, damping):
    """Return what another program knows of one suspension's fields; the springs and dampers are among them."""
    out = []
    if "friction" in fields:
        out.append(pieces.Friction(along, fields["friction"], fields["friction_stiffness"]))
    if "bumpstop_gap" in fields:
        held = fields["bumpstop_stiffness"]
        out.append(pieces.Corners(along, [-fields["rebound_gap"], fields["bumpstop_gap"]], [held, 0.0, held]))
    places, beyond = zip(*fields.get("spring_corners", ((-1.0, stiffness),)), strict=True)
    slopes = list(beyond)
    slopes.insert(sum(place < 0 for place in places), stiffness)
    out.append(pieces.Corners(along, list(places), slopes))
    rate = fields.get("blow_off_force", 1e9) / damping
    after = fields.get("blow_off_damping", damping)
    return [*out, pieces.Corners(along, [-rate, rate], [after, damping, after], by_rate=True)]


def told(record):
    """Return events of contacts, and of elements, as the other program tells them."""
    wheels = getattr(record.events, "wheelset", None)
    numbers = np.zeros(record.events.sizes["event"]) if wheels is None else wheels.values - 1
    return [
        *zip(record.events.time.values, numbers, record.events.kind.values, strict=True),
    ], record.suspension_events  # fmt: skip


def check_as_other_program(record, others, most):
    """Compare all events with those of the other program."""
    mine, table = told(record)
    contacts = [(time, number, what) for time, family, number, what in others if family == "contact"]
    elements = [(time, what) for time, family, _, what in others if family == "element"]
    assert [(number, what) for _, number, what in mine] == [(number, what) for _, number, what in contacts]
    np.testing.assert_allclose([one[0] for one in mine], [one[0] for one in contacts], rtol=0, atol=most)
    assert table.sizes["suspension_event"] == len(elements)
    np.testing.assert_allclose(table.time.values, [time for time, _ in elements], rtol=0, atol=most)
    for kind, (_, what) in zip(table.kind.values, elements, strict=True):
        assert (kind == "slip") == what.startswith("slides")
        assert (kind == "stick") == (what == "sticks")
    return len(elements), len(contacts)


@pytest.mark.parametrize("method", TIMES)
@pytest.mark.parametrize("kinks", KINKS)
@pytest.mark.parametrize("pulls", [True, False])
def test_a_wheelset_over_an_irregular_rail_is_that_of_another_program(kinks, method, pulls):
    """Where its contact also pulls it is an oscillator; where it does not, it leaves the rail and strikes it."""
    fields = KINKS[kinks]
    contact = pieces.Contact(0, CONTACT, static_of(WHEEL), tuple((*wave, 0.0) for wave in WAVES), pulls=pulls)
    elements = elements_of(fields, np.ones(1), WHEEL["stiffness"], WHEEL["damping"])
    others = pieces.run(np.diag([WHEEL["mass"]]), [[0.0]], [[0.0]], [contact], elements, SPEED, 0.05)
    record = wt.simulate(corrugated(wt.Wheelset(**WHEEL, **fields), pulls=pulls), method)
    count, lost = check_as_other_program(record, others, TIMES[method])
    assert count >= 7
    assert (lost >= 10) != pulls


@pytest.mark.slow
@pytest.mark.parametrize("method", TIMES)
def test_a_bogie_is_that_of_another_program(method):
    primary = KINKS["friction"] | KINKS["bumpstops"]
    secondary = {"friction": 500.0, "friction_stiffness": 1e7, "spring_corners": ((-2e-5, 4e5), (3e-5, 3e6))}
    secondary |= {"blow_off_force": 500.0, "blow_off_damping": 4e3}
    named = {f"primary_{name}": value for name, value in primary.items()}
    named |= {f"secondary_{name}": value for name, value in secondary.items()}
    half = 0.5 * BOGIE["wheelbase"]
    contacts = [
        pieces.Contact(0, CONTACT, BOGIE["wheel_load"], tuple((*wave, 0.0) for wave in WAVES)),
        pieces.Contact(1, CONTACT, BOGIE["wheel_load"]),
    ]
    elements = []
    for along in ([1.0, 0.0, -1.0, -half], [0.0, 1.0, -1.0, half]):
        elements += elements_of(primary, np.array(along), BOGIE["primary_stiffness"], BOGIE["primary_damping"])
    up = np.array([0.0, 0.0, 1.0, 0.0])
    elements += elements_of(secondary, up, BOGIE["secondary_stiffness"], BOGIE["secondary_damping"])
    masses = np.diag([BOGIE["wheelset_mass"]] * 2 + [BOGIE["frame_mass"], BOGIE["pitch_inertia"]])
    others = pieces.run(masses, np.zeros((4, 4)), np.zeros((4, 4)), contacts, elements, SPEED, 0.05)
    record = wt.simulate(corrugated(wt.vehicles.Bogie(**BOGIE, **named)), method)
    count, lost = check_as_other_program(record, others, TIMES[method])
    assert count >= 30
    assert lost >= 4
    seen = {name: (record.suspension_events.element == name).sum().item() for name in record.history().element.values}
    assert min(seen[name] for name in ("primary friction 1", "primary bumpstop 1", "secondary friction")) >= 2


def test_dry_friction_brings_an_oscillator_to_rest_as_in_the_closed_form():
    """From one turn to the next, a and b away from rest, ½k(a² - b²) = F(a + b - 2F/κ).

    Over the first 2F/κ the slider's spring, of stiffness κ, goes from one side to the other and does no work.
    """
    k, force, slider, mass = 1e9, 2e4, 4e8, 1000.0
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=mass, load=1e6, friction=force, friction_stiffness=slider),
        contact=wt.Linear(stiffness=k, bilateral=True), speed=0.0, duration=0.06,
        start=Start(displacement=0.0, velocity=0.0),
    )  # fmt: skip
    record = wt.simulate(scene, "strict")
    table = record.suspension_events
    sticks = table.time.values[table.kind.values == "stick"]
    turns = np.abs(record.at(sticks).wheel_displacement.values.ravel() + (1e6 + 9.81 * mass) / k)
    assert len(turns) >= 8
    before, after = turns[:-1], turns[1:]
    lost = 0.5 * k * (before**2 - after**2)
    np.testing.assert_allclose(lost, force * (before + after - 2.0 * force / slider), rtol=1e-9)
    assert record.energy.dissipated_friction > 0.0


# -- limits ------------------------------------------------------------------------------------------------------------

TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example").model_copy(update={"cutoff": 2000.0, "bays": 40})
BUMP = wt.CosineBump(height=3e-4, length=0.3, start=0.05)


def over_bump(vehicle, **changes):
    given = {"track": TRACK, "contact": wt.Hertz(), "irregularity": BUMP, "speed": 20.0, "duration": 0.04}
    return wt.Scenario(vehicle=vehicle, rolling="point", **given | changes)


def several(**fields):
    return wt.vehicles.Wheelsets(wheelsets=({**WHEEL, **fields},), positions=(0.0,))


@pytest.mark.parametrize("track", [wt.StiffTrack(), TRACK])
def test_friction_that_never_slips_is_a_spring_and_none_changes_no_bit(track):
    times = np.linspace(0.0, 0.04, 301)

    def motion(**fields):
        record = wt.simulate(over_bump(several(**fields), track=track), "strict")
        return record.at(times).normal_force.values, record

    stuck, record = motion(friction=1e12, friction_stiffness=2e7)
    sunk = float(record.at([0.0]).indentation.squeeze()) if track == wt.StiffTrack() else 0.0
    load = WHEEL["load"] + 2e7 * sunk  # friction has no force at rest, on a stiff track a spring has
    stiff, _ = motion(stiffness=WHEEL["stiffness"] + 2e7, load=load)
    np.testing.assert_allclose(stuck, stiff, rtol=1e-9)
    assert record.suspension_events.sizes["suspension_event"] == 0
    none, _ = motion(friction=0.0, friction_stiffness=2e7)
    plain, _ = motion()
    assert (none == plain).all()
    assert np.abs(stuck - plain).max() > 100.0


def test_a_blow_off_and_stops_out_of_reach_change_nothing():
    times = np.linspace(0.0, 0.04, 301)
    plain, far = (
        wt.simulate(over_bump(several(**fields)), "strict").at(times).normal_force.values
        for fields in ({}, {"blow_off_force": 1e9, "bumpstop_gap": 1.0, "bumpstop_stiffness": 1e7})
    )
    np.testing.assert_allclose(far, plain, rtol=1e-9)


def test_finer_steps_change_nothing_on_rails():
    fields = {name: value for name, value in KINKS["all"].items() if not name.startswith("spring")}
    scene = over_bump(several(**fields), duration=0.03)
    finest = None
    for method, most in (("default", 1e-8), ("strict", 1e-11)):
        task = lower_plane(scene, method).program
        if finest is None:
            finest = march(task.system, STRICT._replace(step=2.5e-5), task.duration)
            assert len(finest.events) >= 10
        found = march(task.system, task.method, task.duration)
        assert found.events[:, [1, 3]].tolist() == finest.events[:, [1, 3]].tolist()
        np.testing.assert_allclose(found.events[:, 0], finest.events[:, 0], rtol=0, atol=most)


# -- records -----------------------------------------------------------------------------------------------------------


@pytest.mark.few(1)
@pytest.mark.parametrize(
    "track",
    [
        pytest.param(wt.StiffTrack(), marks=pytest.mark.slow),
        pytest.param(wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4), marks=pytest.mark.slow),
        pytest.param(TRACK, marks=pytest.mark.slow),
    ],
    ids=["stiff", "deck", "rails"],
)
def test_energy_closes_and_files_keep_what_happened(track, tmp_path):
    kinked = {f"{level}_{name}": value for level in ("primary", "secondary") for name, value in KINKS["all"].items()}
    record = wt.simulate(over_bump(wt.vehicles.Bogie(**BOGIE, **kinked), track=track), "strict")
    energy = record.energy
    assert abs(float(energy.relative_imbalance)) < 1e-10
    assert 0.0 < float(energy.dissipated_friction) < float(energy.dissipated)
    table = record.suspension_events
    assert table.sizes["suspension_event"] > 10
    record.save(tmp_path / "run.nc")
    again = wt.load(tmp_path / "run.nc")
    times = np.linspace(0.0, record.end, 40)
    assert again.at(times).equals(record.at(times))
    assert again.suspension_events.equals(table)


def test_forces_and_slips_are_those_of_the_laws():
    scene = over_bump(wt.Wheelset(**WHEEL, **KINKS["all"]), track=wt.StiffTrack())
    record = wt.simulate(scene, "strict")
    seen = record.at(np.linspace(0.0, scene.duration, 2000))
    fields, u = KINKS["all"], seen.wheel_displacement.values - seen.wheel_displacement.values[0]
    force = {name: seen.element_force.sel(element=name).values for name in seen.element.values}
    for name in force:
        np.testing.assert_allclose(seen.element_compression.sel(element=name), u, rtol=0, atol=1e-14)
    slip = seen.element_slip.sel(element="primary friction 1").values
    held = fields["friction_stiffness"] * (u - slip)
    np.testing.assert_allclose(force["primary friction 1"], held, rtol=0, atol=1e-6)
    assert np.abs(held).max() == pytest.approx(fields["friction"], rel=1e-9)
    moving = np.abs(np.diff(slip)) > 1e-9
    assert moving.any()
    assert (np.sign(np.diff(slip)[moving]) == np.sign(held[1:][moving])).all()  # it brakes
    beyond = np.maximum(u - fields["bumpstop_gap"], 0.0) + np.minimum(u + fields["rebound_gap"], 0.0)
    stops = fields["bumpstop_stiffness"] * beyond
    np.testing.assert_allclose(force["primary bumpstop 1"], stops, rtol=0, atol=1e-6)
    rate, corner = seen.wheel_velocity.values, fields["blow_off_force"] / WHEEL["damping"]
    law = WHEEL["damping"] * np.clip(rate, -corner, corner)
    law += fields["blow_off_damping"] * (rate - np.clip(rate, -corner, corner))
    np.testing.assert_allclose(force["primary damper 1"], law, rtol=0, atol=0.05)


def test_maps_and_borders_take_kinks_and_orbits_refuse_them():
    scene = over_bump(wt.Wheelset(**WHEEL, **KINKS["friction"]), track=wt.StiffTrack(), duration=0.02)
    forces = [0.0, 2e3, 4e3]
    chart = wt.sweep(scene, {"vehicle.friction": forces}, ["largest_force"])
    alone = [float(wt.simulate(scene.replaced({"vehicle.friction": one})).peaks.normal_force.max()) for one in forces]
    np.testing.assert_allclose(chart.largest_force.values, alone, rtol=1e-12)
    with pytest.raises(wt.InputError, match=r"dry friction in a suspension, which `orbits` does not take"):
        wt.orbits.find(scene.replaced({"irregularity": wt.Corrugation(amplitude=1e-5, wavelength=0.05, start=0.0)}))
