"""Tracks on sleepers that cannot be, and wrong questions to them: one clear line each."""

import tomllib

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.placement import Placement, check_places
from wheeltapper.describe.schema import json_schema
from wheeltapper.lower.track import reach

EXAMPLE = wt.tracks.Ballasted.example
RAIL = {"bending_stiffness": 6.378e6, "shear_stiffness": 2.43e8, "mass_per_length": 60.2}
LIGHT = wt.tracks.Slab(
    rail={"bending_stiffness": 2e5, "shear_stiffness": 2e9, "mass_per_length": 240.0}, spacing=1.8, pad_stiffness=1e9,
    pad_damping=1e4,
)  # fmt: skip
NAMES = "rolland_UIC60_example, rolland_Nordborg, Zhai2004, railFE_default"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"spacing": 0}, "spacing: found 0; allowed: greater than 0"),
        ({"spacing": "600"}, None),
        ({"spacing": "0.6 kg"}, "spacing: found '0.6 kg', which is not a length; allowed: a length"),
        ({"pad_damping": -1.0}, "pad_damping: found -1.0; allowed: greater than or equal to 0"),
        ({"ballast_damping": -1e-9}, "ballast_damping: found -1e-09; allowed: greater than or equal to 0"),
        ({"pad_stiffness": 0.0}, "pad_stiffness: found 0.0; allowed: greater than 0"),
        ({"ballast_stiffness": float("inf")}, "ballast_stiffness: found inf; allowed: a finite stiffness"),
        ({"sleeper_mass": 0.0}, "sleeper_mass: found 0.0; allowed: greater than 0"),
        ({"sleeper_roll_inertia": 0.0}, "sleeper_roll_inertia: found 0.0; allowed: greater than 0"),
        ({"ballast_roll_stiffness": 1e8}, "ballast_roll_stiffness: found one without sleeper_roll_inertia; allowed: "),
        ({"rail": "UIC 60"}, f"rail: found 'UIC 60'; allowed: UIC60, 60E1, {NAMES} (did you mean 'UIC60'?)"),
        ({"rail": 60}, "rail: found 60; allowed: Rail, or a table of its fields"),
        ({"rail": RAIL | {"damping": -1e-6}}, "rail.damping: found -1e-06; allowed: greater than or equal to 0"),
        (
            {"rail": RAIL | {"bending_stiffness": "6 MN"}},
            "rail.bending_stiffness: found '6 MN', which is not a bending",
        ),
        ({"rail": RAIL | {"damping": "1 ms"}}, "rail.damping: found '1 ms'; allowed: less than or equal to 0.00002"),
        ({"rail": {"shear_stiffness": 2e8, "mass_per_length": 60}}, "rail.bending_stiffness: found nothing; allowed:"),
        ({"sleper_mass": 1.0}, "sleper_mass: found the unknown name 'sleper_mass'; allowed: rail, spacing,"),
        ({"bays": 4}, "bays: found 4; allowed: greater than or equal to 8"),
        ({"cutoff": 0.0}, "cutoff: found 0.0; allowed: greater than or equal to 100"),
        ({"cutoff": "60 kHz"}, "cutoff: found '60 kHz'; allowed: less than or equal to 50000"),
    ],
)
def test_a_track_that_cannot_be_is_refused_in_one_line(changes, message):
    if message is None:  # a number without a unit is in SI units
        assert wt.tracks.Ballasted(**EXAMPLE | changes).spacing == 600.0
        return
    with pytest.raises(wt.InputError) as caught:
        wt.tracks.Ballasted(**EXAMPLE | changes)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["Grassie1982", "", None, 3])
def test_an_unknown_name_of_a_track_is_answered_with_the_known_ones(name):
    with pytest.raises(wt.InputError, match=f"name: found {name!r}; allowed: {NAMES}$"):
        wt.tracks.Ballasted.named(name)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"name": "Zhai2005"}, rf"track\.name: found 'Zhai2005'; allowed: {NAMES} \(did you mean 'Zhai2004'\?\)$"),
        ({"name": 7}, f"track.name: found 7; allowed: {NAMES}$"),
        ({"name": "Zhai2004", "spacing": 0}, "track.spacing: found 0; allowed: greater than 0"),
        ({"name": "Zhai2004", "sleper_mass": 100}, "track.sleper_mass: found the unknown name 'sleper_mass'"),
        ({"name": "Zhai2004", "rail": {"name": "UIC54"}}, "track.rail.name: found 'UIC54'; allowed: UIC60, 60E1"),
        ({"type": "Slab", "name": "Zhai2004"}, "track.name: found the unknown name 'name'; allowed: rail, spacing"),
    ],
)
def test_a_file_that_names_no_track_is_answered_in_one_line(table, message):
    with pytest.raises(wt.InputError, match=f"^{message}"):
        on_rails(**table)


def on_rails(**table):
    track = {"type": "Ballasted"} | table
    return wt.Scenario.of({"vehicle": {"type": "Wheelset", "mass": 1500}, "track": track, "speed": 9, "duration": 0.1})


def test_a_file_takes_a_published_track_by_its_name_and_overrules_it(tmp_path):
    scene = on_rails(name="Zhai2004", pad_stiffness="40 kN/mm", cutoff=900.0)
    plain = wt.tracks.Ballasted.named("Zhai2004")
    assert on_rails(name="Zhai2004").track == plain
    assert scene.track == wt.tracks.Ballasted.named("Zhai2004", pad_stiffness=40e6, cutoff=900.0)
    assert (scene.track.pad_stiffness, scene.track.cutoff, scene.track.rail) == (40e6, 900.0, plain.rail)
    assert scene.track.source == f"{plain.source}; pad stiffness given instead"
    scene.to_toml(tmp_path / "scene.toml")
    assert wt.load(tmp_path / "scene.toml") == scene
    rail = on_rails(name="Zhai2004", rail={"name": "60E1", "damping": 1e-6}).track.rail
    assert (rail.damping, rail.bending_stiffness) == (1e-6, wt.tracks.Rail.named("UIC60").bending_stiffness)


def test_a_published_track_may_replace_another_one_and_its_fields_go_on_from_there():
    changed = on_rails(name="Zhai2004").replaced(
        {"track": {"type": "Ballasted", "name": "railFE_default"}, "track.pad_damping": 2e4}
    )
    assert changed.track == wt.tracks.Ballasted.named("railFE_default", pad_damping=2e4)
    with pytest.raises(wt.InputError, match="no such field 'name'"):
        changed.replaced({"track.name": "Zhai2004"})


def test_the_schema_takes_a_name_instead_of_what_is_required():
    table = json_schema()["$defs"]["Ballasted"]
    assert table["properties"]["name"]["enum"] == NAMES.split(", ")
    assert table["required"] == ["type"]
    assert {"required": ["name"]} in table["anyOf"]
    assert any("pad_stiffness" in one["required"] for one in table["anyOf"])


def test_a_rail_of_unknown_name_is_answered_with_the_known_ones():
    with pytest.raises(wt.InputError, match=f"found 'UIC54'; allowed: UIC60, 60E1, {NAMES}"):
        wt.tracks.Rail.named("UIC54")


@pytest.mark.parametrize(
    ("question", "message"),
    [
        (lambda t: wt.tracks.receptance(wt.StiffTrack(), 100.0, 0.0), "track: found StiffTrack(); allowed: a track"),
        (lambda t: wt.tracks.decay_rate("Zhai2004", 100.0), "track: found 'Zhai2004'; allowed: a track"),
        (lambda t: wt.tracks.receptance(t, -1.0, 0.0), "frequencies: found -1 Hz; allowed: 0 Hz or more"),
        (lambda t: wt.tracks.receptance(t, [], 0.0), "frequencies: found none; allowed: a frequency, or"),
        (lambda t: wt.tracks.decay_rate(t, "3 m"), "frequencies: found '3 m', which is not a frequency"),
        (lambda t: wt.tracks.decay_rate(t, [1.0, np.inf]), "frequencies: found inf; allowed: a finite frequency"),
        (
            lambda t: wt.tracks.receptance(LIGHT, [500.0, 2e3], 0.0),
            "frequencies: found 2000 Hz, at which the rail's near",
        ),
        (lambda t: wt.tracks.receptance(t, 100.0, None), "where: found None; allowed: a length"),
        (lambda t: wt.tracks.static_deflection(t, [0.0, np.nan]), "where: found nan; allowed: a finite length"),
        (lambda t: wt.tracks.receptance(t, 1.0, [0, 1], [1, 2, 3]), "at: found 3 places; allowed: one, or 2"),
        (lambda t: wt.plot(wt.tracks.receptance(t, 1.0, 0.0)), "what: found values at fewer than two"),
        (lambda t: wt.plot(wt.tracks.static_deflection(t, 0.0)), "what: found one static deflection; allowed:"),
    ],
)
def test_a_wrong_question_is_refused_in_one_line(question, message):
    with pytest.raises(wt.InputError) as caught:
        question(wt.tracks.Ballasted(**EXAMPLE))
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_more_bays_than_memory_are_refused_with_how_many_fit():
    track = wt.tracks.Ballasted(**EXAMPLE, bays=10**9)
    with pytest.raises(
        wt.InputError, match=r"track.bays: found a ring of 1000000000 bays, .*; allowed: at most \d+ bays"
    ):
        reach.modes_of(track)


def test_a_ring_shorter_than_the_train_is_refused_with_the_length_that_would_do():
    track = wt.tracks.Ballasted(**EXAMPLE, bays=40)
    with pytest.raises(
        wt.InputError, match=r"track.bays: found 40 bays, a ring of 24 m, .*; allowed: more than 67, or"
    ):
        reach.modes_of(track, extent=20.0)


def scene(**fields):
    vehicle = wt.Wheelset(mass=1200, load=1e5)
    return wt.Scenario(
        **{"vehicle": vehicle, "track": {"type": "Ballasted"} | EXAMPLE, "speed": 20.0, "duration": 0.1} | fields
    )


def test_anomalies_that_no_wheel_of_a_wagon_comes_near_are_refused():
    track = wt.tracks.Ballasted(**EXAMPLE, bays=90, anomalies=wt.tracks.MissingPad(seat=30))
    with pytest.raises(
        wt.InputError, match=r"track\.anomalies\.0\.seat: found 30, at x = .* near the way of the wheels"
    ):
        wt.simulate(scene(vehicle=wt.Wagon.erri_b176(), track=track, duration=0.001))


def test_what_a_wagon_on_rails_is_not_asked_is_refused_by_name():
    coach = scene(vehicle=wt.Wagon.erri_b176(), track=wt.tracks.Ballasted(**EXAMPLE, bays=90), duration=0.001)
    with pytest.raises(wt.InputError, match="track: found rails on sleepers, which `modes` does not take"):
        wt.modes(coach)


def test_on_rails_a_wheelset_has_one_wheel_or_two():
    with pytest.raises(
        wt.InputError, match=r"vehicle.wheels: found 4; allowed: 2, half on each of two rails, or 1, on"
    ):
        scene(vehicle=wt.Wheelset(mass=1200, load=1e5, wheels=4))


def test_places_on_one_side_are_refused_under_a_vehicle_in_the_plane():
    bump = wt.CosineBump(height=1e-4, length=0.05, start=0.1)
    bogie = wt.vehicles.Bogie(**wt.vehicles.Bogie.example)
    assert scene(vehicle=bogie, irregularity={"wheelset 2": bump}).irregularities == (bump,)
    with pytest.raises(wt.InputError, match=r"found the place 'wheelset 2 left'; allowed: .both., .wheelset 1."):
        scene(vehicle=bogie, irregularity={"wheelset 2 left": bump})
    with pytest.raises(wt.InputError, match="found the place 'wheelset 3'; allowed: wheelsets 1 to 2"):
        scene(vehicle=bogie, irregularity={"wheelset 3": bump})


def test_a_vehicle_in_the_plane_has_no_sides():
    check_places(Placement({"wheelset 2": (), "both": ()}), 2, sides=False)
    for place in ("right", "wheelset 1 left"):
        with pytest.raises(wt.InputError, match=f"found the place '{place}'; allowed: .both., .wheelset 1."):
            check_places(Placement({place: ()}), 2, sides=False)


def test_a_file_may_describe_the_rail_as_a_table_or_by_its_name():
    for rail in (
        'rail = "UIC60"\n',
        "[track.rail]\nbending_stiffness = 6.378e6\nshear_stiffness = 2.43e8\nmass_per_length = 60.2\n",
    ):
        text = '[track]\nspacing = 0.6\npad_stiffness = "180 kN/mm"\npad_damping = 18e3\n'
        found = wt.tracks.Slab.model_validate(tomllib.loads(text + rail)["track"])
        assert found == wt.tracks.Slab(rail="UIC60", spacing=0.6, pad_stiffness=1.8e8, pad_damping=18e3)


def test_a_speed_whose_tables_do_not_fit_is_refused():
    for method, slowest in (("default", "0.25"), ("strict", "0.51")):
        with pytest.raises(wt.InputError, match=rf"speed: found 0.1 m/s on rails, .* or at least {slowest} m/s"):
            wt.simulate(scene(vehicle=wt.Wheelset(mass=1200, load=1e5), speed=0.1), method)


def test_a_wheel_faster_than_the_waves_of_the_rail_is_refused():
    """The critical speed of the even track, as in `test_track_structure.py`."""
    with pytest.raises(wt.InputError, match=r"speed: found 940 m/s; allowed: less than 9[\d.]+ m/s, at which waves"):
        wt.simulate(scene(vehicle=wt.Wheelset(mass=1200, load=1e5), speed=940.0, duration=0.01))


def test_a_cutoff_below_what_the_irregularity_excites_is_told():
    wave = wt.Corrugation(amplitude=1e-6, wavelength=0.02, start=0.1)
    run = scene(vehicle=wt.Wheelset(mass=1200, load=1e5), irregularity=wave, duration=0.02, speed=60.0)
    with pytest.warns(UserWarning, match=r"excites .* 3000 Hz.* up to 2000 Hz.*; set track.cutoff = 6000 Hz"):
        wt.simulate(run.replaced({"track.cutoff": 2000}))
    assert not [note for note in wt.simulate(run.replaced({"track.cutoff": 6000})).notes if "excites" in note]
