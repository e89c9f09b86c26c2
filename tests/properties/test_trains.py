"""Trains: what a deck feels of neighbours, faults drawn, findings in one table and one JSON, alarms at their limits."""

import json
from dataclasses import replace
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.sensor import Sensor
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.alarms import compared, compared_value, wheel_forces
from wheeltapper.diagnosis.diagnose import diagnose
from wheeltapper.diagnosis.site.neighbours import Condition, Neighbour, deck_motion, motion_under_one_wheelset
from wheeltapper.diagnosis.site.synthetic import COACH, synthesise, synthesise_train
from wheeltapper.diagnosis.train import diagnose_train, train_of
from wheeltapper.record.limits.rule import VERIFY, Rule, read_rules

EXAMPLES = Path(__file__).parents[2] / "examples"
KNOWN = {"speed": 0.01, "vehicle.load": 0.05, "contact.constant": 0.05, "irregularity.0.height": 0.05}
LONG = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)
SHORT = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=4.7e5, start=-0.05, length=2.2)
TIMES = np.arange(4222) / 20e3
KIP = 4448.2216152605


def site(track=LONG):
    passage = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.Hertz(constant=1.405e11),
        track=track,
        irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
        speed=9.0,
        duration=0.2111,
    )
    return Site(passage=passage, sensor=Sensor(rate=20e3, noise=6.66e-4), uncertainty=KNOWN, name="test")


def rms(values):
    return float(np.sqrt((np.asarray(values) ** 2).mean()))


# -- neighbours -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spacing", [2.5, -0.9])
def test_superposition_adds_the_neighbours_passage_shifted_by_spacing_over_speed(spacing):
    own = site().passage
    other = own.replaced({"vehicle.mass": 1600.0})
    both = deck_motion(own, [(spacing, other)], coupled=False).at(TIMES)
    longer = other.replaced({"duration": 0.2111 + max(spacing, 0.0) / 9.0})
    shifted = TIMES + spacing / 9.0
    alone_there = wt.simulate(longer).at(np.maximum(shifted, 0.0)).deck_acceleration.values
    added = np.where(shifted >= 0.0, alone_there, 0.0)
    np.testing.assert_allclose(both - motion_under_one_wheelset(own).at(TIMES), added, rtol=0, atol=1e-8)
    assert rms(added) > 0.1


@pytest.mark.parametrize("bush", [None, 1e7])
def test_a_neighbour_that_is_not_on_the_deck_changes_nothing(bush):
    own = site(SHORT).passage.replaced({"vehicle.bush_stiffness": bush})
    both, by_itself = deck_motion(own, [(-2.56, own)]).at(TIMES), motion_under_one_wheelset(own).at(TIMES)
    np.testing.assert_allclose(both, by_itself, rtol=0, atol=1e-4 * rms(by_itself))


def test_superposition_is_the_limit_of_a_heavy_deck_and_far_off_on_the_reference_deck():
    off = {}
    for heavier in (1.0, 10.0, 100.0):
        deck = wt.FloatingDeck(mass=15e3 * heavier, stiffness=1.5e7 * heavier, damping=5e4 * heavier)
        own = site(deck).passage
        near = TIMES[:500]
        coupled, added = (deck_motion(own, [(2.5, own)], kind).at(near) for kind in (True, False))
        off[heavier] = rms(coupled - added) / rms(added)
    assert off[100.0] < 0.012
    assert off[10.0] < 0.05
    assert 0.1 < off[1.0] < 0.25  # 15 t: the resonance of the contacts couples the wheelsets


@pytest.mark.slow
def test_a_neighbour_on_the_deck_is_not_a_healthy_wheelset_alone_and_says_so():
    where = site()
    faults = ("broken spring", "lost damper", "weak damper")
    (ahead,) = synthesise(where, neighbour=2.5, seed=1)
    finding = diagnose(ahead, where, faults=faults)
    assert finding.verdict == "not explained"
    assert finding.reduced > 100.0
    (away,) = synthesise(where, neighbour=-2.5, coupled=False, seed=1)
    assert diagnose(away, where, faults=faults).verdict == "healthy"


def test_a_flat_neighbour_has_struck_before_the_wheelset_of_interest_comes():
    own = site().passage
    flat = wt.WheelFlat(length=0.03, position=1.0)
    other = own.replaced({"irregularity": (*own.irregularity, flat)})
    assert (
        rms(deck_motion(own, [(-0.5, other)]).at(TIMES[:200]) - deck_motion(own, [(-0.5, own)]).at(TIMES[:200])) < 1e-6
    )
    struck = other.replaced({"irregularity.1.position": 2.6})  # one turn, 2.89 m, before that it is at -0.29 m
    assert (
        rms(deck_motion(own, [(-0.5, struck)]).at(TIMES[:600]) - deck_motion(own, [(-0.5, own)]).at(TIMES[:600])) > 0.1
    )


# -- drawn recordings -------------------------------------------------------------------------------------------------


def test_recordings_with_faults_are_reproducible_and_say_what_was_drawn():
    where = site()
    few, many = (
        synthesise(where, n, fault="wheel flat", size=(0.02, 0.06), seed=5, neighbour=Neighbour(spacing=2.5))
        for n in (2, 3)
    )
    for one, other in zip(few, many, strict=False):
        np.testing.assert_array_equal(one.samples, other.samples)
        assert one.truth["size"] == other.truth["size"]
    assert {r.truth["label"] for r in many} == {"wheel flat"}
    assert len({r.truth["size"] for r in many}) == 3
    assert len({r.truth["place"] for r in many}) == 3
    for recording in many:
        assert 0.02 <= recording.truth["size"] <= 0.06
        flat = recording.truth["scenario"].irregularity[-1]
        assert flat.length == recording.truth["size"]
        assert flat.position == pytest.approx(recording.truth["place"] * 2 * np.pi * 0.46)
        (beside,) = recording.truth["neighbours"]
        assert beside["scenario"].speed == recording.truth["speed"]
        assert beside["scenario"].vehicle.load != recording.truth["vehicle.load"]


def test_a_fault_is_drawn_about_the_faulty_passage_with_the_same_site():
    where = site()
    (sound,), (broken,) = (synthesise(where, fault=name, seed=8) for name in (None, "broken spring"))
    assert sound.truth["label"] == "healthy"
    assert broken.truth["size"] == 670.0
    assert broken.truth["scenario"].vehicle.mass == 2170.0
    assert broken.truth["speed"] == sound.truth["speed"]
    ratio = (91_307 - 670 * 9.81) / 91_307
    assert broken.truth["vehicle.load"] == pytest.approx(ratio * sound.truth["vehicle.load"])
    (given,) = synthesise(where, fault=Condition("lost damper", 0.5, 0.25), seed=8, vary=False, noise=0.0)
    assert given.truth["scenario"].vehicle.damping == 2.5e4
    assert given.truth["place"] == 0.25


def test_a_trains_wheelsets_share_the_site_and_feel_each_other_within_reach():
    where = site(SHORT)
    train = synthesise_train(where, {2: "broken spring"}, count=4, seed=2, speed=9.3)
    again = synthesise_train(where, [None, "broken spring", None, "healthy"], seed=2, speed=9.3)
    for one, other in zip(train, again, strict=True):
        np.testing.assert_array_equal(one.samples, other.samples)
    assert [r.truth["position"] for r in train] == list(COACH)
    assert [r.truth["label"] for r in train] == ["healthy", "broken spring", "healthy", "healthy"]
    assert {r.speed for r in train} == {9.3}
    assert len({r.truth["speed"] for r in train}) == 1
    assert len({r.truth["vehicle.load"] for r in train}) == 4
    apart = synthesise_train(where, {2: "broken spring"}, count=4, seed=2, speed=9.3, reach=0.0)
    changed = [rms(a.samples - b.samples) for a, b in zip(train, apart, strict=True)]
    assert changed[0] < 1e-3  # the leading ones of both bogies: nobody was on the deck before
    assert changed[1] > 0.1


# -- table and JSON ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def train():
    where = site()
    axles = [None, Condition("wheel flat", 0.04, 0.3), "broken spring", None]
    recordings = synthesise_train(where, axles, seed=3, reach=0.0)
    return recordings, diagnose_train(recordings, where, name="G 4711", date="2026-11-21T10:00")


@pytest.mark.slow
def test_the_table_of_a_train_tells_the_truth(train):
    recordings, found = train
    rows = found.table()
    assert [row["axle"] for row in rows] == [1, 2, 3, 4]
    assert [row["verdict"] for row in rows] == ["healthy", "wheel flat", "broken spring", "healthy"]
    assert rows[1]["size"] == "40 mm"
    for row, recording in zip(rows, recordings, strict=True):
        record = wt.simulate(recording.truth["scenario"])
        peak = float(record.peaks.normal_force.max())
        assert row["speed_kmh"] == pytest.approx(3.6 * recording.truth["speed"], rel=0.01)
        assert row["static_kn"] == pytest.approx(record.static_force / 1e3, rel=0.06)
        assert row["peak_kn"] == pytest.approx(peak / 1e3, rel=0.06)
        assert row["peak_kips"] == pytest.approx(row["peak_kn"] * 1e3 / KIP)
        assert row["dynamic_ratio"] == pytest.approx(row["peak_kn"] / row["static_kn"])
        assert row["dynamic_increment"] == pytest.approx(row["dynamic_ratio"] - 1.0)
        assert row["probability"] > 0.9
    assert "AAR 41, 90 kips" in rows[1]["alarms"]
    assert [bool(row["alarms"]) for row in rows] == [False, True, False, False]
    assert 5.0 < found.healthy_ratio < 6.0


@pytest.mark.slow
def test_the_printed_table_is_aligned_and_names_what_to_verify(train):
    text = str(train[1])
    lines = text.split("\n")
    assert lines[0] == "G 4711, 2026-11-21T10:00, test: 4 axles, not healthy: 2, 3"
    assert lines[1].split()[:2] == ["axle", "km/h"]
    place = lines[1].index("verdict")
    assert [line[place : place + 7] for line in lines[2:6]] == ["healthy", "wheel f", "broken ", "healthy"]
    assert sum("axle 2: " in line for line in lines) >= 3
    assert all(VERIFY in line for line in lines if line.startswith("axle 2:"))


def test_one_json_holds_the_train_and_gives_it_back(train):
    _, found = train
    held = json.loads(json.dumps(found.to_dict()))
    assert (held["format"], held["train"], held["site"]) == (1, "G 4711", "test")
    assert [entry["axle"] for entry in held["axles"]] == [1, 2, 3, 4]
    assert held["axles"][1]["alarms"][0]["verify"] == VERIFY
    assert len(held["rules"]) == len(read_rules())
    entries = [finding.to_dict() for finding in found.findings]
    again = train_of(json.loads(json.dumps(entries)), found.site)
    assert [alarm.rule.name for alarm in again.alarms] == [alarm.rule.name for alarm in found.alarms]
    for one, other in zip(again.table(), found.table(), strict=True):
        assert one == pytest.approx(other, rel=1e-6) if isinstance(one, float) else one["verdict"] == other["verdict"]
        assert one["level_kn"] == pytest.approx(other["level_kn"], rel=1e-6)
    assert train_of(entries, found.site, countries=["SE"]).alarms[0].rule.name == "Trafikverket, 350 kN"


@pytest.mark.whole
@pytest.mark.slow
def test_a_wheelset_that_neighbours_shake_is_not_explained_alone():
    where = wt.load(EXAMPLES / "site.toml")
    shaken = synthesise_train(where, [None, "broken spring"], seed=2)[0]
    assert wt.diagnose(shaken, where).verdict == "not explained"


@pytest.mark.slow
def test_alarms_of_what_is_not_explained_compare_the_force_of_the_recording():
    where = site()
    recordings = synthesise_train(where, [None, Condition("wheel flat", 0.04, 0.3)], seed=3, reach=0.0)
    found = diagnose_train(recordings, where, faults=["broken spring", "lost damper"])
    row, entry = found.table()[1], found.to_dict()["axles"][1]
    true = float(wt.simulate(recordings[1].truth["scenario"]).peaks.normal_force.max())
    assert (row["verdict"], row["forces_from"], row["level_kn"]) == ("not explained", "recording", None)
    assert row["peak_kn"] == pytest.approx(1e-3 * true, rel=0.02)
    assert entry["forces_from"] == "recording"
    assert entry["level_force"] is None
    assert entry["estimates"] == {}
    alarm = next(alarm for alarm in found.alarms if alarm.rule.name == "Trafikverket, 350 kN")
    static = entry["static_force"]
    assert alarm.value == pytest.approx(0.5 * static + entry["largest_force"] - static)
    assert {alarm["forces_from"] for alarm in entry["alarms"]} == {"recording"}
    text = str(found)
    assert "per wheel from the recording, more than 350 kN" in text
    assert "not explained: without a model there is no force on level track; forces are from the recording" in text
    again = train_of(json.loads(json.dumps([finding.to_dict() for finding in found.findings])), where)
    assert [str(one) for one in again.alarms] == [str(one) for one in found.alarms]


def test_axles_without_a_wheel_or_a_recording_keep_their_place_in_the_table():
    nothing = {"verdict": "no wheel", "probabilities": {}, "static_force": None, "largest_force": None, "speed": None}
    unread = {"source": "a.csv", "verdict": "not read", "paragraph": "a.csv: found nothing"}
    found = train_of([nothing, unread], site())
    assert [row["verdict"] for row in found.table()] == ["no wheel", "not read"]
    assert found.alarms == ()
    assert json.loads(json.dumps(found.to_dict()))["axles"][0]["largest_wheel_force"] is None
    assert "   -" in str(found)


# -- alarms -----------------------------------------------------------------------------------------------------------


def entry(verdict="healthy", static=100e3, peak=300e3, size=None):
    return {"verdict": verdict, "static_force": static, "largest_force": peak, "size": size}


def rule(quantity, limit, **more):
    return Rule("made up", quantity, limit, "warning", **more)


@pytest.mark.parametrize(
    ("given", "of", "value"),
    [
        (entry(), rule("peak_force", 1.0, per="axle"), 300e3),
        (entry(), rule("peak_force", 1.0), 150e3),
        (entry("wheel flat", size=0.04), rule("peak_force", 1.0), 250e3),  # 50 kN and all of the 200 kN
        (entry("not explained"), rule("peak_force", 1.0), 250e3),
        (entry("lost damper", size=0.2), rule("peak_force", 1.0), 150e3),
        (entry(), rule("dynamic_ratio", 1.0), 3.0),
        (entry(), rule("dynamic_increment", 1.0), 2.0),
        (entry("out of round", size=2e-4), rule("dynamic_ratio", 1.0), 5.0),
        (entry("out of round", size=2e-4), rule("dynamic_increment", 1.0), 4.0),
        (entry("out of round", size=2e-4), rule("dynamic_ratio", 1.0, per="axle"), 3.0),
        (entry("out of round", size=2e-4), rule("out_of_roundness", 1.0), 4e-4),
        (entry("rounded flat", size=0.06), rule("flat_length", 1.0), 0.06),
        (entry("lost damper", size=0.2), rule("flat_length", 1.0), nan),
        (entry("wheel flat", size=0.04), rule("flat_length", 1.0, diameter_up_to=0.84), nan),
        (entry("wheel flat", size=0.04), rule("flat_length", 1.0, diameter_above=0.84), 0.04),
        ({**entry("wheel flat", size=0.04), "level_force": 200e3}, rule("peak_force", 1.0), 150e3),
        ({"verdict": "not read"}, rule("peak_force", 1.0), nan),
    ],
)
def test_what_is_compared(given, of, value):
    assert compared_value(given, of, site()) == pytest.approx(value, nan_ok=True)


@pytest.mark.parametrize(("when", "at_the_limit"), [("reached", True), ("exceeded", False)])
def test_alarms_are_set_off_at_their_limits(when, at_the_limit):
    limit = 90 * KIP
    one = rule("peak_force", limit, when=when)
    peaks = [2 * limit * (1 - 1e-12), 2 * limit, 2 * limit * (1 + 1e-12)]
    raised, untested = compared([entry(peak=peak) for peak in peaks], [one], site())
    assert not untested
    assert [alarm.axle for alarm in raised] == ([2, 3] if at_the_limit else [3])
    assert "90 kips" in str(raised[0])


def test_one_wheel_bears_half_or_all_of_the_dynamic_force():
    assert wheel_forces(entry()) == (50e3, 150e3)
    assert wheel_forces(entry("wheel flat")) == (50e3, 250e3)
    assert wheel_forces(entry("wheel flat"), wheels=4) == (25e3, 225e3)


def test_the_packages_rules_are_dated_sourced_and_to_be_verified():
    rules = read_rules()
    assert {r.quantity for r in rules} >= {"peak_force", "flat_length"}
    for each in rules:
        assert each.verify == VERIFY
        assert each.body
        assert each.country
        assert each.source
        assert each.edition
        assert "found" in each.basis or "remembered" in each.basis
        assert 0.0 < each.limit < inf
        assert each.per == "wheel" or each.quantity == "sum_of_guiding_forces"
    by_name = {r.name: r for r in rules}
    assert by_name["AAR 41, 90 kips"].limit == pytest.approx(400_339.9, abs=0.1)
    assert by_name["AAR 41, 90 kips"].raised_by(90 * KIP)
    assert not by_name["Trafikverket, 350 kN"].raised_by(350e3)
    assert replace(by_name["GCU, flat of 60 mm"], diameter_above=0.0).raised_by(0.0601)
