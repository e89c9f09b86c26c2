"""Runs of scenarios on rails: forces over passing sleepers from another program, and sixteen wheelsets."""

import json
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt

CASES = json.loads((Path(__file__).parents[1] / "data" / "track_cases.json").read_text(encoding="utf-8"))
PASSING = CASES["sleeper_passing"]
WHEEL = {"mass": 600.0, "load": 1e5 - 600.0 * 9.81, "radius": 0.46, "wheels": 1}
CONTACT = wt.Hertz(constant=9.4125e10)


@pytest.mark.slow
@pytest.mark.parametrize("case", PASSING["cases"], ids=lambda case: f"{case['set']}-{case['speed_m_s']:g}")
def test_the_force_over_passing_sleepers_is_that_of_another_program(case):
    """In the steady state, without irregularity; tolerance of the table."""
    speed, bays = case["speed_m_s"], 1.0
    track = wt.tracks.Ballasted.named(case["set"])
    scene = wt.Scenario(
        vehicle=wt.Wheelset(**WHEEL), track=track, contact=CONTACT, speed=speed, duration=1.2 + bays * 0.6 / speed
    )
    record = wt.simulate(scene)
    force = record.at(np.linspace(record.end - bays * track.spacing / speed, record.end, 4001)).normal_force
    assert float(force.min()) == pytest.approx(case["force_min_N"], abs=PASSING["tolerance_N"])
    assert float(force.max()) == pytest.approx(case["force_max_N"], abs=PASSING["tolerance_N"])


@pytest.mark.parametrize(
    "row", CASES["linear_track_and_moving_load"]["constant_100kN_moving_on_discrete_rolland"],
    ids=lambda row: f"{row['speed_m_s']:g}",
)  # fmt: skip
def test_the_rail_under_a_wheel_without_mass_is_that_under_another_programs_moving_load(row):
    """A wheel of 2 kg presses with 100 kN ± 0.7 %; over the last bay of 0.5 s."""
    speed, track = row["speed_m_s"], wt.tracks.Ballasted.named("rolland_UIC60_example")
    light = wt.Wheelset(mass=2.0, load=1e5, gravity=1e-3, wheels=1)
    bay = track.spacing / speed
    with pytest.warns(UserWarning, match=r"vehicle\.(mass|gravity) = .* is implausible"):
        record = wt.simulate(
            wt.Scenario(vehicle=light, track=track, contact=wt.Linear(stiffness=1.4e9), speed=speed, duration=0.5 + bay)
        )
    found = record.at(np.linspace(record.end - bay, record.end, 2001)[:-1])
    np.testing.assert_allclose(found.normal_force, 1e5, rtol=7e-3)
    down = -found.rail_displacement.values
    expected = [row["mean_m"], row["min_m"], row["max_m"]]
    np.testing.assert_allclose([down.mean(), down.min(), down.max()], expected, rtol=5e-4)


@pytest.mark.whole
@pytest.mark.slow
def test_sixteen_wheelsets_far_apart_are_sixteen_wheelsets_alone():
    """At 12 m the rail carries nothing but a hundredth; each strikes its own flat as one wheelset alone does."""
    track = wt.tracks.Ballasted.named("rolland_UIC60_example")
    positions = tuple(-12.0 * n for n in range(16))
    flat = wt.WheelFlat(length="40 mm", position=0.9, repeat=False)
    own = {f"wheelset {n + 1}": flat.moved(x) for n, x in enumerate(positions)}
    common = {"track": track, "contact": CONTACT, "speed": 20.0, "duration": 0.06}
    many = wt.Scenario(
        vehicle=wt.vehicles.Wheelsets(wheelsets=(WHEEL,) * 16, positions=positions), irregularity=own, **common
    )
    one = wt.simulate(wt.Scenario(vehicle=wt.Wheelset(**WHEEL), irregularity=flat, **common))
    record = wt.simulate(many)
    each = record.peaks.groupby("wheelset").max().normal_force.values
    assert len(each) == 16
    np.testing.assert_allclose(each, float(one.peaks.normal_force.max()), rtol=0.02)
