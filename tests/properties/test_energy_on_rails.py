"""Energy of runs on rails that give way: it closes, and what is lost by leaving out modes is small and told."""

import numpy as np
import pytest

import wheeltapper as wt

TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example")
FLAT = wt.Scenario(
    vehicle=wt.Wheelset(mass=600, load=1e5 - 600 * 9.81, wheels=1),
    track=TRACK,
    contact=wt.Hertz(constant=9.4125e10),
    irregularity=wt.WheelFlat(length=0.04, position=0.3, repeat=False),
    speed=20,
    duration=0.03,
)
BOGIE = FLAT.replaced({
    "vehicle": wt.vehicles.Bogie(**wt.vehicles.Bogie.example),
    "irregularity": wt.CosineBump(height=2e-4, length=0.1, start=0.2),
    "contact": wt.Hertz(constant=1.88e11),
})  # fmt: skip

OFF_THE_GRID = BOGIE.replaced({"track.first_sleeper": 0.1234, "vehicle.wheelbase": 2.537, "speed": 23.7})
"""Each wheelset passes seats at times of its own."""


def parts(record):
    return {name: float(value) for name, value in record.energy.data_vars.items()}


@pytest.mark.parametrize("scene", [FLAT, BOGIE, OFF_THE_GRID], ids=["flat", "bogie", "off the grid"])
@pytest.mark.slow
def test_strictly_the_energy_closes_to_1e_8(scene):
    found = parts(wt.simulate(scene, "strict"))
    assert abs(found["relative_imbalance"]) < 1e-8
    exchanged = ("track_dissipated", "dissipated", "work_of_irregularity", "work_of_load", "work_of_traction")
    assert abs(found["imbalance"]) < 1e-8 * sum(abs(found[name]) for name in exchanged)
    assert found["track_dissipated"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("contact", "irregularity"),
    [
        (wt.Hertz(), wt.CosineBump(height=1e-4, length=0.05, start=0.3)),
        (
            wt.Hertz(constant=9.4125e10, hysteresis=0.1),
            wt.irregularities.DippedJoint(position=0.3, length=0.1, angle=0.02),
        ),
    ],
    ids=["curvature", "kink"],
)
@pytest.mark.parametrize("method", ["default", "strict"])
def test_it_closes_where_the_force_jumps(contact, irregularity, method):
    scene = FLAT.replaced({"contact": contact, "irregularity": irregularity, "duration": 0.02})
    record = wt.simulate(scene, method)
    found = parts(record)
    times = np.linspace(0.0, 0.02, 20_001)
    assert np.abs(np.diff(record.at(times).normal_force)).max() > 100.0  # within a microsecond
    assert abs(found["relative_imbalance"]) < {"default": 1e-6, "strict": 1e-8}[method]
    given = found["into_track"] + found["work_of_traction"]
    kept = found["track_stored"] + found["track_dissipated"]
    largest = max(abs(value) for value in found.values())
    assert kept == pytest.approx(given, abs=0.01 * largest)  # but for the truncation


def test_by_default_it_closes_to_1e_6_and_the_truncation_is_within_1_percent():
    record = wt.simulate(FLAT)
    found = parts(record)
    assert record.events.kind.values.tolist() == ["loss", "impact"]
    assert abs(found["relative_imbalance"]) < 1e-6
    assert abs(found["truncation"]) < 0.01
    given = found["into_track"] + found["work_of_traction"]
    kept = found["track_stored"] + found["track_dissipated"]
    assert kept == pytest.approx(given, rel=0.01)  # but for the truncation


@pytest.mark.slow
@pytest.mark.parametrize("irregularity", [None, wt.CosineBump(height=-2e-4, length=0.5, start=0.2)], ids=str)
@pytest.mark.parametrize("name", ["rolland_UIC60_example", "Zhai2004"])
def test_the_truncation_is_within_3_percent_where_little_is_exchanged(name, irregularity):
    """Pads with strong dampers are the hardest: at rest, or all but at rest, they lose nothing."""
    track = wt.tracks.Ballasted.named(name)
    found = parts(wt.simulate(BOGIE.replaced({"track": track, "irregularity": irregularity, "duration": 0.05})))
    assert abs(found["truncation"]) < 0.03
    assert abs(found["relative_imbalance"]) < 1e-6


@pytest.mark.slow
def test_it_closes_where_the_end_is_that_of_a_step_but_for_rounding():
    """0.8 s at 4 m/s are a few units of rounding more than a whole number of macro steps."""
    scene = FLAT.replaced({"irregularity": None, "speed": 4.0, "duration": 0.8})
    assert abs(parts(wt.simulate(scene))["relative_imbalance"]) < 1e-6


def test_a_wheel_that_stands_still_loses_nothing():
    track = wt.tracks.Ballasted.named("Zhai2004")
    still = FLAT.replaced({"track": track, "irregularity": None, "speed": 0.0, "duration": 0.02})
    assert abs(parts(wt.simulate(still))["track_dissipated"]) < 1e-9


@pytest.mark.slow
def test_the_truncation_falls_with_the_cut_off():
    shares = [
        abs(parts(wt.simulate(FLAT.replaced({"track.cutoff": cutoff})))["truncation"]) for cutoff in (2e3, 5e3, 12e3)
    ]
    assert np.all(np.diff(shares) < 0.0), shares


def test_two_rails_exchange_twice_the_energy_of_one():
    twice = FLAT.replaced({
        "vehicle": wt.Wheelset(mass=1200, load=2e5 - 1200 * 9.81, wheels=2), "contact": wt.Hertz(constant=18.825e10),
    })  # fmt: skip
    one, two = parts(wt.simulate(FLAT)), parts(wt.simulate(twice))
    for name in ("track_stored", "track_dissipated", "into_track", "work_of_traction", "work_of_irregularity"):
        assert two[name] == pytest.approx(2.0 * one[name], rel=1e-9)


def test_impulses_do_not_wait_for_the_balance():
    record = wt.simulate(FLAT)
    assert record.impacts.sizes["impact"] == 1
    assert float(record._works.impulses.sum()) > 0.9 * 1e5 * FLAT.duration
    assert "energy" not in vars(record)
