"""Flats of a train's wheels, told and sized by a site with a track, on recordings of finite elements."""

import json
import pickle
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import wheeltapper as wt
from tests.wayside import BALLAST, HERTZ, MASS, PAD, PAD_DAMPING, RADIUS, SPACING, Line, Wheel, train_of
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis import Recording, measure_trains
from wheeltapper.diagnosis.gauges.known import known_of
from wheeltapper.diagnosis.processes import Lost
from wheeltapper.diagnosis.wayside import sizes
from wheeltapper.diagnosis.wayside.channels import channels_of
from wheeltapper.diagnosis.wayside.measure import trains_in
from wheeltapper.diagnosis.wayside.sizes import Fitted, Wheels, is_lost, rails_of
from wheeltapper.faces.cli import main
from wheeltapper.ground.errors import InputError
from wheeltapper.record.assessment.filtering import low_passed

from .test_gauges import RATE, SHEAR, SPREAD, TRACK

SPEED, AXLES = 20.0, (0.0, 1.8, 9.0, 10.8)
PAIRS = tuple((SPACING * k + 0.1, SPACING * k + 0.5) for k in range(4))
UNCERTAIN = {
    path.replace("vehicle.mass", "unsprung_mass").replace("vehicle.", ""): share for path, share in SPREAD.items()
}
FLATS = {1: (0.040, -0.7, False), 2: (0.036, 1.1, True), 3: (0.030, -1.9, False)}
"""Lengths, m, where they meet the rail, m, and whether they are rounded, by axle from 0; two are 1.8 m apart."""


def site(**changes):
    sensors = [
        wt.sensors.RailShearForce(name=f"{number}", x1=a, x2=b, rate=RATE, gain_uncertainty=0.05)
        for number, (a, b) in enumerate(PAIRS)
    ]
    known = {"track": TRACK, "radius": RADIUS, "unsprung_mass": MASS, "uncertainty": UNCERTAIN}
    return Site(
        **{"sensors": sensors, "contact": wt.Hertz(constant_per_wheel=HERTZ), "name": "gauges", **known, **changes}
    )


def mirrored(place):
    """Return a site whose x runs the other way."""
    turned = [one.model_copy(update={"x1": -one.x2, "x2": -one.x1}) for one in place.sensors]
    return place.replaced({"sensors": turned, "track.first_sleeper": -place.track.first_sleeper})


def line_of():
    """Return a track that differs from the site's in all that is uncertain."""
    return Line(
        [("pair", *one) for one in PAIRS], before=14.0, pad=0.93 * PAD, ballast=1.1 * BALLAST,
        pad_damping=1.15 * PAD_DAMPING, shear=SHEAR, per_bay=12, hertz=1.04 * HERTZ,
    )  # fmt: skip


@cache
def recordings(flawed):
    """Return what the gauges recorded of a wagon, its wheels, and what they did."""
    line = line_of()
    rng = np.random.default_rng(11)
    wheels = []
    for axle in range(len(AXLES)):
        length, first, worn = FLATS[axle] if flawed and axle in FLATS else (0.0, 0.0, False)
        wheels.append(Wheel(float(rng.uniform(50e3, 90e3)), 40 + axle, (length, first) if length else None, worn))
    passages = line.recorded(wheels, SPEED, RATE)
    read, _ = train_of(line, passages, SPEED, RATE, AXLES, range(len(AXLES)))
    gains = 1.0 + 0.05 * rng.standard_normal((len(PAIRS), 1))
    noisy = gains * read + 500.0 * rng.standard_normal(read.shape)
    return {f"{number}": Recording(row, RATE, "force") for number, row in enumerate(noisy)}, wheels, passages


def wheels_of(found, place):
    """Return the wheels of the train in recordings of one rail."""
    (train,) = trains_in(channels_of(found, place), place, (), None, "", "")
    (rail,) = rails_of(train.passage, train.pulses, train.sides, known_of(place))
    return Wheels(rail, train.passage, train.sides[0].mean)


@pytest.mark.whole
@pytest.mark.slow
def test_wheels_without_a_flaw_are_healthy():
    found, _, _ = recordings(False)
    (train,) = measure_trains(found, site(), diagnosed="all")
    findings = [axle["wheels"][0]["finding"] for axle in train.axles]
    assert [one["verdict"] for one in findings] == ["healthy"] * len(AXLES)
    assert max(one["gain"] for one in findings) < 25.0
    unfiltered = [one.model_copy(update={"anti_alias": False}) for one in site().sensors]
    (train,) = measure_trains(found, site(sensors=unfiltered), diagnosed="suspicious")
    assert sum("without an anti-aliasing filter" in note for note in train.notes) == 1
    assert all("finding" not in axle["wheels"][0] for axle in train.axles)
    assert not train.wheels


@pytest.mark.whole
@pytest.mark.slow
def test_flats_of_neighbours_are_told_and_sized(tmp_path):
    found, wheels, passages = recordings(True)
    (train,) = measure_trains(found, site(), diagnosed="suspicious")
    for axle, (length, _, worn) in FLATS.items():
        one = train.wheels[axle + 1, None]
        finding = train.axles[axle]["wheels"][0]["finding"]
        assert finding["verdict"] == ("rounded flat" if worn else "wheel flat"), finding
        assert abs(finding["size"] - length) < 2e-3
        assert finding["alike"] == (["wheel flat"] if worn else [])
        if not worn:
            assert finding["size_interval"] == finding["sizes"]["wheel flat"]["size_interval"]
        low, high = finding["sizes"][finding["verdict"]]["size_interval"]
        assert low < finding["size"] < high
        assert 0.5e-3 < 0.5 * (high - low) < 3e-3
        assert finding["static_force"] == pytest.approx(wheels[axle].load, rel=0.06)
        inside = (passages.x > one.passing.x[0]) & (passages.x < one.passing.x[-1])
        assert finding["largest_force"] == pytest.approx(passages.forces[axle][inside].max(), rel=0.12)
        row = train.table()[axle]
        assert row["model"] == finding["verdict"]
        assert "mm" in row["size"]
    later = train.wheels[2, None].outlook([30.0]).isel(speed=0, static_force=0)
    length, _, worn = FLATS[1]
    faster = line_of().passages([Wheel(wheels[1].load, None, (length, 0.15 * k), worn) for k in range(4)], 30.0, 2e4)
    below = [low_passed(force, 2e4, 500.0).max() for force in faster.forces]
    assert later.largest_force.sel(quantile="median") == pytest.approx(faster.forces.max(axis=1).mean(), rel=0.12)
    assert later.largest_below_500.sel(quantile="median") == pytest.approx(np.mean(below), rel=0.08)
    healthy = train.axles[0]["wheels"][0].get("finding", {"verdict": "healthy"})
    assert healthy["verdict"] == "healthy"
    json.dumps(train.to_dict())
    wt.plot(train.wheels[2, None], tmp_path / "wheel.svg")
    assert "mm long" in str(train.wheels[2, None])


@pytest.mark.slow
@pytest.mark.whole
def test_a_train_without_a_steady_speed_is_told():
    cut = {
        name: replace(one, samples=one.samples[:6000], clipped=one.clipped[:6000])
        for name, one in recordings(False)[0].items()
    }
    (train,) = measure_trains(cut, site(), diagnosed="all")
    assert any("does not keep its speed" in note for note in train.notes)
    assert all("finding" not in axle["wheels"][0] for axle in train.axles)


@pytest.mark.slow
@pytest.mark.whole
def test_a_train_that_runs_the_other_way_is_the_same_for_the_model():
    found, place = recordings(True)[0], site()
    wheels, turned = (wheels_of(found, one) for one in (place, mirrored(place)))
    rail, other = wheels.rail, turned.rail
    assert rail.known.scene.track.first_sleeper == other.known.scene.track.first_sleeper
    assert [(one.x1, one.x2) for one in rail.sensors] == [(one.x1, one.x2) for one in other.sensors[::-1]]
    for axle in range(len(AXLES)):
        one, same = wheels.passing(axle), turned.passing(axle)
        np.testing.assert_allclose(same.x, one.x, atol=1e-6)
        np.testing.assert_allclose(same.readings[:, ::-1], one.readings, atol=1e-3)
        np.testing.assert_array_equal(same.used[:, ::-1], one.used)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"unsprung_mass": None}, "unsprung_mass: found none, with a track"),
        ({"radius": None}, "radius: found none, with a track"),
        ({"track": None, "uncertainty": {}}, "unsprung_mass: found given, without a track"),
        ({"track": wt.StiffTrack(), "uncertainty": {}}, "track: found a StiffTrack"),
        ({"spacing": 0.65}, "spacing: found 0.65 m, on a track with 0.6 m"),
        ({"uncertainty": {"speed": 0.1}}, "uncertainty: found 'speed'"),
        ({"uncertainty": {"track.pad": 0.1}}, "uncertainty: found 'track.pad'"),
        ({"contact": wt.Hertz(constant=1e11)}, "contact.constant: found a wheelset's constant"),
        ({"passage": wt.load("examples/site.toml").passage, "uncertainty": {}}, "track: found one besides a passage"),
    ],
)
def test_what_a_site_with_a_track_lacks_or_has_too_much_is_said(changes, said):
    with pytest.raises(InputError, match=said):
        site(**changes)


def test_a_site_with_a_track_is_written_and_read_as_it_is(tmp_path):
    place = site()
    place.to_toml(tmp_path / "site.toml")
    assert Site.from_toml(tmp_path / "site.toml") == place
    assert hash(place) != hash(place.replaced({"track.pad_stiffness": 1e8}))


def test_the_contact_of_a_site_is_that_of_its_radius():
    given, computed = known_of(site()), known_of(site(contact=None))
    assert given.scene.contact.constant_per_wheel == HERTZ
    own = wt.Scenario(vehicle=wt.Wheelset(mass=1200.0, load=1.4e5, radius=RADIUS), speed=20.0, duration=0.01)
    explicit = own.replaced({"contact": wt.Hertz(constant_per_wheel=computed.scene.contact.constant_per_wheel)})
    assert float(wt.simulate(explicit).at(0.0).indentation[0]) == pytest.approx(
        float(wt.simulate(own).at(0.0).indentation[0]), rel=1e-12
    )


def test_models_are_refused_where_the_site_has_none():
    place, noise = site(track=None, unsprung_mass=None, contact=None, uncertainty={}), np.random.default_rng(1)
    nothing = {one.name: Recording(noise.standard_normal(5000), RATE, "force") for one in place.sensors}
    with pytest.raises(InputError, match="'none', or a site with a deck or a `track`"):
        measure_trains(nothing, place, diagnosed="all")


def simulated(speed, firsts, behind):
    """Return a site, and what its gauges record of wheels that follow one another so far behind, m.

    Flats of 40 mm first meet the rail so far ahead of the start of each wheel's run, m.
    """
    place = site().replaced({
        "sensors": [one.model_copy(update={"x1": one.x1 + 6.0, "x2": one.x2 + 6.0}) for one in site().sensors],
    })  # fmt: skip
    apart, noise = round(behind / speed * RATE), np.random.default_rng(1)
    read = {one.name: np.zeros(len(firsts) * apart + round(0.5 * RATE)) for one in place.sensors}
    for number, first in enumerate(firsts):
        passing = known_of(site()).scene.replaced({
            "vehicle.load": 7e4, "speed": speed, "duration": 15.0 / speed, "track.first_sleeper": 0.0,
            "irregularity": [wt.WheelFlat(length=0.04, position=first)],
        })  # fmt: skip
        for name, one in wt.simulate(passing).recordings(place).items():
            read[name][number * apart :][: len(one.samples)] += one.samples
    return place, {
        name: Recording(one + 500.0 * noise.standard_normal(len(one)), RATE, "force") for name, one in read.items()
    }


@pytest.mark.whole
@pytest.mark.slow
def test_flats_on_own_recordings_have_their_lengths_at_33_metres_a_second():
    """What is simulated and what is fitted pass the same filter of the recorder; two processes fit three wheels."""
    place, seen = simulated(33.0, (0.4, 1.3, 2.2), behind=20.0)
    (train,) = measure_trains(seen, place, diagnosed="suspicious", workers=2)
    found = [train.wheels[axle, None].sizes["wheel flat"][0] for axle in (1, 2, 3)]
    print("mm:", [f"{1e3 * one:.2f}" for one in found])
    assert found == pytest.approx([0.04] * 3, rel=0.025)  # the error of the model that a length is told with


@pytest.mark.slow
def test_wheels_that_may_feel_each_other_are_fitted_together():
    place, found = simulated(33.0, (0.4, 1.3), behind=1.8)
    wheels = wheels_of(found, place)
    wheels.seen = {axle: wheels.look(wheels.passing(axle)) for axle in (0, 1)}
    assert wheels.apart([0, 1]) == [[0, 1]]
    wheels.passage = replace(wheels.passage, places=np.add(wheels.passage.places, [0.0, 30.0]))
    assert sorted(wheels.apart([0, 1])) == [[0], [1]]
    wheels.seen[1] = wheels.seen[1]._replace(candidates=[wheels.seen[1].candidates[0]._replace(gain=0.0)])
    assert wheels.apart([0, 1]) == [[0]]  # nothing is fitted to the other one
    sent = pickle.loads(pickle.dumps(wheels))  # as another process has it
    np.testing.assert_array_equal(sent.passing(1).readings, wheels.passing(1).readings)


@pytest.mark.slow
def test_wheels_without_a_model_say_why_and_are_not_healthy(monkeypatch):
    place, found = simulated(33.0, (0.4, 1.3), behind=1.8)

    def measured():
        (train,) = measure_trains(found, place, diagnosed="all")
        for axle in train.axles:
            assert {"finding", "fresh_flat_found_from"}.isdisjoint(axle["wheels"][0])
        assert not train.wheels
        return train

    def lost(_, shared, tasks, workers):
        return ((number, Lost("was killed")) for number in range(len(tasks)))

    with monkeypatch.context() as changed:
        changed.setattr(sizes, "in_processes", lost)
        train = measured()
        assert is_lost(train)
        assert [note for note in train.notes if "since its processes died" in note and "axles 1 to 2" in note]

    def refuse(*_):
        raise InputError("", "irregularity", "heights that differ by 2.78 m", "less")

    monkeypatch.setattr(sizes, "sized_flat", refuse)
    train = measured()
    assert not is_lost(train)
    assert any("axles 1 to 2: no model is fitted" in note and "2.78 m" in note for note in train.notes)
    doubtful = SimpleNamespace(sized=SimpleNamespace(is_doubtful=True))
    monkeypatch.setattr(Wheels, "_fit", lambda *_: Fitted(doubtful, None, {}))
    assert f"axles 1 to 2: {sizes.SHADOWED_BY}" in measured().notes


@pytest.mark.slow
def test_a_neighbour_that_is_not_weighed_is_left_out():
    place, found = simulated(33.0, (0.4, 1.3), behind=1.8)
    whole = wheels_of(found, place)
    without = Wheels(whole.rail, whole.passage, np.where([False, True], np.nan, whole.forces))
    assert without.neighbours(0) == [1]
    one, other = whole.passing(0), without.passing(0)
    behind = one.x - 1.8
    near = np.stack([(behind > s.x1 - 0.9) & (behind < s.x2 + 0.9) for s in whole.rail.sensors], axis=1)
    assert one.used[near].any()
    assert not other.used[near].any()
    np.testing.assert_allclose(other.readings, one.readings, atol=2e3)  # N: both wheels weigh nearly the same
    assert other.doubt.max() > 5.0 * one.doubt.max()


@pytest.mark.slow
def test_commands_tell_and_draw_a_flat_that_strikes_beside_the_gauges(tmp_path, capsys):
    passing = known_of(site()).scene.replaced({
        "vehicle.load": 6.4e4, "speed": 20.0, "duration": 0.75, "track.first_sleeper": 0.0,
        "irregularity": [wt.WheelFlat(length=0.035, position=2.81, shape="fresh")],
    })  # fmt: skip
    place = site().replaced({
        "sensors": [one.model_copy(update={"x1": one.x1 + 6.0, "x2": one.x2 + 6.0}) for one in site().sensors],
    })  # fmt: skip
    seen, noise = wt.simulate(passing).recordings(place), np.random.default_rng(3)
    rows = np.column_stack([one.samples + 500.0 * noise.standard_normal(len(one.samples)) for one in seen.values()])
    (tmp_path / "traffic").mkdir()
    header = f"rate: {RATE:g} Hz\n" + ",".join(f"{name} [N]" for name in seen)
    np.savetxt(tmp_path / "traffic" / "one.csv", rows, header=header, fmt="%.6g", delimiter=",")
    place.to_toml(tmp_path / "site.toml")
    given = ["--site", str(tmp_path / "site.toml"), "--output"]
    assert main(["diagnose", str(tmp_path / "traffic" / "one.csv"), *given, str(tmp_path / "found")]) == 0
    assert "axle 1: wheel flat" in capsys.readouterr().out
    assert (tmp_path / "found" / "one-axle-1.png").exists()
    told = json.loads((tmp_path / "found" / "one.json").read_text())["axles"][0]["wheels"][0]
    assert told["finding"]["size"] == pytest.approx(0.035, abs=1.5e-3)
    strikes = [2.81 + 2.0 * np.pi * RADIUS * turn for turn in (1, 2)]
    assert all(not 6.1 < x < 8.3 for x in strikes)  # no pair of gauges sees one
    one = [*given, str(tmp_path / "pages"), "--diagnosed", "suspicious", "--workers", "1"]
    assert main(["report", str(tmp_path / "traffic"), *one]) == 0
    page = next((tmp_path / "pages").glob("one*.html")).read_text()
    assert "flaw by the model" in page
    assert "By a model of wheel and track: wheel flat" in page
    assert page.count("data:image/svg+xml") == 2  # what the gauges read, and the model
    assert main(["diagnose", str(tmp_path / "traffic" / "one.csv"), *given, str(tmp_path / "f"), "--train"]) == 2
    assert "--train: found given, with a site that states a track" in capsys.readouterr().err
