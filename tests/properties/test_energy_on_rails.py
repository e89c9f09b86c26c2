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


def parts(record):
    return {name: float(value) for name, value in record.energy.data_vars.items()}


@pytest.mark.parametrize("scene", [FLAT, BOGIE], ids=["flat", "bogie"])
def test_strictly_the_energy_closes_to_1e_8(scene):
    found = parts(wt.simulate(scene, "strict"))
    assert abs(found["relative_imbalance"]) < 1e-8
    exchanged = ("track_dissipated", "dissipated", "work_of_irregularity", "work_of_load", "work_of_traction")
    assert abs(found["imbalance"]) < 1e-8 * sum(abs(found[name]) for name in exchanged)
    assert found["track_dissipated"] > 0.0


def test_by_default_it_closes_to_1e_6_and_the_truncation_is_within_3_percent():
    record = wt.simulate(FLAT)
    found = parts(record)
    assert record.events.kind.values.tolist() == ["loss", "impact"]
    assert abs(found["relative_imbalance"]) < 1e-6
    assert abs(found["truncation"]) < 0.03
    given = found["into_track"] + found["work_of_traction"]
    kept = found["track_stored"] + found["track_dissipated"]
    assert kept == pytest.approx(given, rel=0.05)  # but for the truncation


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
    assert float(record._step_integrals[0].sum()) > 0.9 * 1e5 * FLAT.duration
    assert "energy" not in vars(record)
