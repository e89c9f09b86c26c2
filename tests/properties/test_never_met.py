"""What a run never meets is said: its place, and what the wheels pass; what they meet is not doubted.

The witness is the run itself, apart from what the notes are made of: where a part is never met, the force is the static
one all along, as on a smooth rail; where it is met, it is not.
"""

import json
import warnings

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.faces.cli import main
from wheeltapper.lower.unmet import unmet_notes
from wheeltapper.record.simulate import ModelWarning

WHEEL = wt.Wheelset(mass=1500, load=91_307)
WAY = 80 / 3.6 * 0.15  # m
TURN = 2 * np.pi * 0.46  # m
DIP = wt.irregularities.DippedJoint(depth=1e-3, length=1.0, position=15.0)
GEOMETRY = {"positions": tuple(np.arange(12340.0, 12345.0, 0.25)), "heights": tuple(1e-4 * np.sin(np.arange(20)))}
LINE = wt.tracks.Ballasted.named("rolland_UIC60_example")
PAIR = wt.vehicles.Wheelsets(wheelsets=(WHEEL, WHEEL), positions=(0.0, -2.5))
DECK = {"mass": 15e3, "stiffness": 1.5e7}


def bump(start, **more):
    return wt.CosineBump(**{"height": 1e-4, "length": 0.05, "start": start} | more)


def corrugation(start, end=None):
    return wt.Corrugation(amplitude=2e-5, wavelength=0.05, start=start, end=end)


def wave(**ends):
    return wt.Profile(function=lambda x: 1e-5 * (1 - np.cos(2 * np.pi * x / 0.1)), **ends)


def scene(*items, **changes):
    given = {"vehicle": WHEEL, "contact": wt.Hertz(constant=1.405e11), "irregularity": items}
    return wt.Scenario(**(given | {"speed": "80 km/h", "duration": 0.15} | changes))


NEVER = {
    "a joint beyond the end": (DIP, "DippedJoint from x = 14.5 to 15.5 m"),
    "a flat that first meets the rail beyond it": (wt.WheelFlat(depth=1e-4, position=50.0), "WheelFlat from x = 49.9"),
    "a flat that met it once, before": (wt.WheelFlat(depth=1e-4, position=-1.0, repeat=False), "to -0.990"),
    "a geometry by its chainage": (wt.Measured(**GEOMETRY, beyond="flat"), "12344.8 m, is never met"),
    "a step behind the start": (wt.Step(height=1e-4, position=-1.0), "Step at x = -1 m"),
    "a step beyond the end": (wt.Step(height=1e-4, position=3.5), "Step at x = 3.5 m"),
    "a bump beyond the end": (bump(5.0), "CosineBump from x = 5 to 5.05 m"),
    "a bump before the start": (bump(-1.0), "CosineBump from x = -1 to -0.95 m"),
    "corrugation beyond the end": (corrugation(7.0), "Corrugation from x = 7 m on"),
    "corrugation that has ended": (corrugation(-7.0, -5.0), "Corrugation from x = -7 to -5 m"),
    "a weld behind": (wt.irregularities.Weld(height=1e-4, length=0.1, position=-7.0), "Weld from x = -7.05 to -6.95"),
    "a function of its own part of the line": (wave(start=5.0, end=6.0), "Profile from x = 5 to 6 m"),
    "repeated from beyond the end": (wt.Repeated(of=bump(5.0), period=1.0), "and every 1 m"),
    "repeated three times, before": (wt.Repeated(of=bump(-5.0), period=1.0, count=3), "from x = -5 to -2.95 m"),
}
MET = {
    "a joint at the end of the way": DIP.model_copy(update={"position": WAY}),
    "a flat that was on the rail before": wt.WheelFlat(depth=1e-4, position=-1.0),
    "a flat two turns before": wt.WheelFlat(depth=1e-4, position=0.1 - 2 * TURN),
    "a geometry with a start": wt.Measured(**GEOMETRY, beyond="flat", start=0.0),
    "a step that the wheel's front just touches": wt.Step(height=1e-3, position=WAY + 0.01),
    "corrugation from far behind": corrugation(-1e4),
    "repeated from behind": wt.Repeated(of=bump(-5.0), period=1.0),
    "a function of the whole line": wave(),
    "an uneven wheel": wt.OutOfRound(orders=(3,), amplitudes=(1e-4,), position=-40.0),
    "a measured wheel": wt.OutOfRound(places=(0.0, 0.7, 1.4, 2.1), deviations=(0.0, 1e-4, 0.0, 1e-4), position=9.0),
    "a spectrum": wt.irregularities.Spectrum(curve="ISO 3095:2013", wavelengths=(0.1, 0.4), added=10.0),
}


def varies(record):
    force = record.history(20e3).normal_force.values
    return np.ptp(force) > 1e-6 * record.static_force


@pytest.mark.parametrize(("item", "told"), NEVER.values(), ids=NEVER)
def test_what_lies_beyond_the_way_is_said_in_one_note(item, told):
    with pytest.warns(ModelWarning, match="is never met: wheels pass x = 0 to 3.33333 m only") as caught:
        record = wt.simulate(scene(item))
    assert not varies(record)
    assert len(caught) == len(record.notes) == 1
    assert record.notes[0].startswith("irregularity.0, a ")
    assert told in record.notes[0]
    assert ("its field start" in record.notes[0]) == isinstance(item, wt.Measured)


@pytest.mark.parametrize("item", MET.values(), ids=MET)
def test_what_a_wheel_meets_is_not_doubted(item):
    record = wt.simulate(scene(item, rolling="circle"))  # a warning would be an error
    assert varies(record)
    assert not [note for note in record.notes if "never met" in note]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"irregularity": {"wheelset 2": bump(1.0)}}, "irregularity.wheelset 2.0, a CosineBump"),
        ({"irregularity": {"wheelset 2": bump(1.0)}}, "wheels pass x = -2.5 to 0.833333 m only"),
        ({"irregularity": {"wheelset 2": bump(-2.0)}}, None),
        ({"irregularity": bump(-2.0)}, None),  # the second wheelset meets it
        ({"irregularity": bump(-2.6)}, "is never met"),
        ({"irregularity": (bump(1.0), bump(4.0))}, "irregularity.1, a CosineBump"),
        ({"irregularity": bump(-1.0), "speed": 5.0}, "wheels pass x = -2.5 to -1.75 and 0 to 0.75 m only"),
        ({"track": wt.FloatingDeck(**DECK, start=5.0, length=2.0)}, "track, a FloatingDeck from x = 5 to 7 m"),
        ({"track": wt.FloatingDeck(**DECK, start=-5.0, length=2.0)}, "track, a FloatingDeck from x = -5 to -3 m"),
        ({"track": wt.FloatingDeck(**DECK, start=1.0, wheelset=2)}, "track, a FloatingDeck from x = 1 m on"),
        ({"track": wt.FloatingDeck(**DECK, start=1.0)}, None),
        ({"track": wt.FloatingDeck(**DECK)}, None),
    ],
)
def test_each_wheelset_has_its_own_way(changes, told):
    found = unmet_notes(scene(vehicle=PAIR, **changes))
    assert len(found) == (told is not None)
    assert told is None or told in found[0]


SPRUNG = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
CORNERED = wt.Wheelset(mass=1500, load=91_307, damping=2e4, spring_corners=((5e-4, 1e6),))
COACH = wt.Wagon.erri_b176()
BETWEEN = {"speed": 10.0, "duration": 0.02}  # 0.2 m, within which no wheel comes to the step


@pytest.mark.parametrize(
    ("vehicle", "track", "item", "felt"),
    [
        (SPRUNG, wt.StiffTrack(), wt.Step(height=1e-3, position=-1.0), True),
        (SPRUNG, wt.FloatingDeck(**DECK), wt.Step(height=1e-3, position=-1.0), True),
        (SPRUNG, LINE, wt.Step(height=1e-3, position=-1.0), False),  # there springs begin without a force
        (SPRUNG, wt.StiffTrack(), wt.Step(height=1e-3, position=1.0), False),
        (SPRUNG, wt.StiffTrack(), bump(-1.0), False),
        (CORNERED, wt.StiffTrack(), wt.Step(height=1e-3, position=-1.0), True),
        (CORNERED, wt.StiffTrack(), wt.Step(height=1e-4, position=-1.0), False),  # its corner is at 0.5 mm
        (PAIR, wt.StiffTrack(), wt.Step(height=1e-3, position=-1.0), False),  # nothing joins the two
        (COACH, wt.StiffTrack(), wt.Step(height=1e-3, position=-1.0), True),  # wheelset 1 above the others
        (COACH, wt.StiffTrack(), wt.Step(height=1e-3, position=-10.0), True),  # the leading bogie above the other
        (COACH, wt.StiffTrack(), wt.Step(height=1e-3, position=-25.0), False),  # all of it is higher
        (COACH, wt.StiffTrack(), {"left": wt.Step(height=1e-3, position=-25.0)}, True),  # it leans
        (COACH, wt.StiffTrack(), {"wheelset 2": wt.Step(height=1e-3, position=-10.0)}, True),
        (COACH, wt.StiffTrack(), {"wheelset 2": wt.Step(height=1e-3, position=2.0)}, False),
    ],
)
def test_a_step_on_which_wheels_stand_is_met_if_it_moves_the_static_state(vehicle, track, item, felt):
    contact = wt.Hertz() if vehicle is COACH else wt.Hertz(constant=1.405e11)
    places = item if isinstance(item, dict) else (item,)
    made = wt.Scenario(vehicle=vehicle, track=track, contact=contact, irregularity=places, **BETWEEN)
    forces = []
    for one in (made, made.replaced({"irregularity": ()})):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelWarning)
            forces.append(wt.simulate(one).at([0.0, 0.01]).normal_force.values)
    assert (abs(forces[0] - forces[1]).max() > 1e-6 * forces[1].max()) == felt
    assert [note for note in unmet_notes(made) if "is never met" in note] == list(unmet_notes(made))
    assert (unmet_notes(made) == ()) == felt


def test_cells_with_a_spring_meet_the_step_behind_them_and_those_without_do_not():
    base = scene(wt.Step(height=1e-3, position=-1.0), duration=0.02)
    with pytest.warns(ModelWarning, match="a Step at x = -1 m, is never met.*the worst of 1 such cells of 2"):
        chart = wt.sweep(base, {"vehicle.stiffness": [0.0, 2.44e6]}, ["largest_force"])
    static = 91_307 + 1500 * 9.81
    indentation = (static / 1.405e11) ** (2 / 3)
    assert abs(chart.largest_force[0] / static - 1) < 1e-9
    assert abs(chart.largest_force[1] / (static + 2.44e6 * (1e-3 - indentation)) - 1) < 1e-3


@pytest.mark.parametrize(("ideal", "place"), [(True, -0.005), (True, 3.3383), (False, -0.005)])
def test_only_a_circle_touches_a_step_before_its_place_and_only_a_step_up(ideal, place):
    step = wt.Step(height=1e-4, position=place, ideal=ideal)  # touched 9.6 mm before, where it is not ideal
    made = scene(step, rolling="circle")
    with pytest.warns(ModelWarning, match="is never met"):
        assert not varies(wt.simulate(made))
    down = made.replaced({"irregularity.0.height": -1e-4})
    assert (unmet_notes(down) == ()) == (not ideal)


def test_a_wagons_wheelset_far_behind_does_not_reach_its_flat():
    flat = wt.WheelFlat(length="40 mm", position=1.0)
    given = {"vehicle": wt.Wagon.erri_b176(), "speed": 30.0, "contact": wt.Hertz()}
    (note,) = unmet_notes(scene(**given, irregularity={"wheelset 4 right": flat}))
    assert "wheels pass x = -21.56 to -17.06 m only" in note  # its axles are 2.56 m, and its bogies 19 m apart
    assert unmet_notes(scene(**given, irregularity={"wheelset 2 right": flat})) == ()


@pytest.mark.parametrize(
    ("anomaly", "met"),
    [
        (wt.tracks.HangingSleeper(seat=9), False),  # at 5.4 m; the wheels end at 3.33 m, and the rail bends for 1.63 m
        (wt.tracks.HangingSleeper(seat=9, void=1e-3), False),
        (wt.tracks.HangingSleeper(seat=8), True),
        (wt.tracks.MissingPad(seat=-7), False),  # at -4.2 m; the second wheelset begins at -2.5 m
        (wt.tracks.MissingPad(seat=-6), True),
        (wt.tracks.Scatter(pads=0.1), True),
    ],
)
def test_seats_that_no_wheel_passes_are_said(anomaly, met):
    track = LINE.model_copy(update={"anomalies": (anomaly,)})
    found = unmet_notes(scene(vehicle=PAIR, track=track))
    assert (found == ()) == met
    assert met or f"a {type(anomaly).__name__} at x = {0.6 * anomaly.seat:.6g} m, is never met" in found[0]


@pytest.mark.parametrize("track", [wt.StiffTrack(), LINE], ids=["stiff", "rails"])
def test_cells_of_a_sweep_that_do_not_meet_it_are_counted_and_the_farthest_is_told(track):
    over = {"speed": [4.0, 8.0], "irregularity.0.start": [0.05, 0.5, 5.0]}  # ways of 0.2 and 0.4 m
    base = scene(bump(0.1), track=track, duration=0.05)
    with pytest.warns(ModelWarning) as caught:
        chart = wt.sweep(base, over, ["largest_force"])
    (told,) = [str(one.message) for one in caught]
    assert "CosineBump from x = 5 to 5.05 m, is never met: wheels pass x = 0 to 0.2 m only" in told
    assert "the worst of 4 such cells of 6" in told
    assert told in json.loads(chart.attrs["notes"])
    over_static = chart.largest_force.values / (91_307 + 1500 * 9.80665)
    assert np.array_equal(over_static > 1.1, [[True, False, False], [True, False, False]])


def test_cells_know_a_deck_that_moves():
    base = scene(track=wt.FloatingDeck(**DECK, start=0.1), irregularity=bump(0.01), speed=4.0, duration=0.05)
    with pytest.warns(ModelWarning, match=r"track, a FloatingDeck from x = 3 m on.*the worst of 1 such cells of 2"):
        wt.sweep(base, {"track.start": [0.1, 3.0]}, ["force_ratio"])
    with pytest.warns(ModelWarning, match="track, a FloatingDeck from x = 0.1 to 0.15 m, is never met"):
        wt.sweep(base.replaced({"track.length": 0.05}), {"track.start": [0.1], "duration": [0.01]}, ["force_ratio"])


RULE = wt.limits.Rule("ours", "dynamic_ratio", 1.5, "warning")
SIZE = wt.limits.Rule("size", "flat_length", 0.06, "warning")


def checked(scenario, *rules):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        return wt.limits.check(wt.simulate(scenario), rules or [RULE])


def test_a_limit_is_not_met_where_the_run_does_not_meet_what_is_described(tmp_path):
    found = checked(scene(DIP))
    assert (found[0].exceeded, found[0].met, found[0].verdict) == (False, False, "not met")
    assert found.unmet == found.rows
    assert "  not met  " in str(found)
    assert "irregularity.0, a DippedJoint from x = 14.5 to 15.5 m, is never met" in str(found).splitlines()[-1]
    assert found.to_dict()["limits"][0]["met"] is False
    assert "1 not met by the run" in wt.plot(found, tmp_path / "limits.png").get_suptitle()
    assert "NOT MET" in found._repr_html_()


def test_what_is_met_beside_it_exceeds_and_the_rest_is_still_not_met():
    large = wt.WheelFlat(length="60 mm", position=1.0)
    found = checked(scene(large, DIP), RULE, SIZE, wt.limits.Rule("high", "dynamic_ratio", 100.0, "warning"))
    assert [row.verdict for row in found] == ["yes", "no", "not met"]  # the size of a flat is known without a run
    assert found.exceeded == found.rows[:1]


def test_a_limit_of_what_is_met_is_kept():
    found = checked(scene(bump(1.0, height=1e-6, length=1.0)))
    assert (found[0].verdict, found.unmet) == ("no", ())


def test_the_command_does_not_accept_what_was_never_met(tmp_path, capsys):
    file, rules = tmp_path / "joint.toml", tmp_path / "rules.toml"
    scene(DIP).to_toml(file)
    rules.write_text('[[rule]]\nname = "ours"\nquantity = "dynamic_ratio"\nlimit = 1.5\nlevel = "warning"\n')
    assert main(["limits", str(file), "--rules", str(rules)]) == 3
    out, err = capsys.readouterr()
    assert "not met" in out
    assert "a DippedJoint from x = 14.5 to 15.5 m, is never met: wheels pass x = 0 to 3.33333 m only" in err
    assert err.splitlines()[-1] == "wheeltapper: 1 limit is not met by this run: see the notes"
    assert main(["limits", str(file), "--rules", str(rules), "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["limits"][0]["met"] is False


def test_places_of_the_track_that_no_wheel_comes_near_are_said():
    record = wt.simulate(scene(bump(0.1), track=LINE, duration=0.05))
    with pytest.warns(ModelWarning, match=r"no readings at rail 100 m, seat -90 \(NaN\): .* up to 24 m from") as caught:
        found = record.track(2000, rail=[1.0, 100.0], seat=[1, -90])
    assert len(caught) == 1
    assert np.isnan(found.rail_strain.sel(rail=100.0)).all()
    assert np.isfinite(found.rail_strain.sel(rail=1.0)).all()
