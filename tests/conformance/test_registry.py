"""What is registered once is found everywhere, and gone when it is forgotten."""

import importlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe import registry
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.manual import room_table
from wheeltapper.describe.noun import nouns_by_name
from wheeltapper.describe.registry import unregister
from wheeltapper.describe.schema import json_schema

from ..registering import undone

ROOT = Path(__file__).parents[2]
WHEELSET = {"type": "Wheelset", "mass": 1500, "load": 91_307, "stiffness": 2.44e6, "damping": 2e4}
BUMP = {"type": "CosineBump", "height": 1e-4, "length": 0.06, "start": 0.05}
SCENE = {
    "vehicle": WHEELSET, "contact": {"type": "Hertz", "constant": 1.405e11}, "irregularity": BUMP,
    "rolling": "point", "speed": 8.0, "duration": 0.05,
}  # fmt: skip
AXLE = {"mass": 1500, "inertia": (1120, 112, 1120), "position": 0, "held": ("x", "y", "roll", "pitch", "yaw")}
BODY = {
    "name": "body", "mass": 5000, "inertia": (1e3, 1e3, 1e3), "position": (0, 0, 1),
    "held": ("x", "y", "roll", "pitch", "yaw"),
}  # fmt: skip
PLACE = {"between": ("body", "wheelset 1"), "at": (0, 0, 0.8)}
SPRING = {"type": "Spring", "name": "spring", "stiffness": (0, 0, 1e6)} | PLACE


def wagon(**fields):
    return {
        "vehicle": {"type": "Wagon", "bodies": [BODY], "axles": [AXLE], "elements": [SPRING]},
        "contact": {"type": "Hertz", "constant_per_wheel": 7e10}, "speed": 8.0, "duration": 0.01,
    } | fields  # fmt: skip


TRAM = {
    "tyre_mass": 400.0, "centre_mass": 700.0, "frame_mass": 2000.0, "pitch_inertia": 1000.0, "wheelbase": 1.8,
    "rubber_stiffness": 2e8, "rubber_damping": 5e4, "primary_stiffness": 2e6, "primary_damping": 3e4,
    "wheel_load": 8e4,
}  # fmt: skip
DUMMIES = {
    # name: room of the front door, field of the scenario, the table in it, the scenario, the suite's function
    "DummyBump": ("irregularities", "irregularity", BUMP, SCENE, "test_irregularities.laws"),
    "DummyPlastic": ("contact", "contact", {"constant": 1.405e11, "yield_force": 1e5}, SCENE, "test_plastic_laws.laws"),
    "DummyPower": ("contact", "contact", {"constant": 1.5e10}, SCENE, "test_contacts.laws"),
    "DummyContact": ("contact", "contact", {}, SCENE, "test_contacts.laws"),
    "DummyCreep": ("creep", "creep", {"friction": 0.3}, wagon(), "test_creep_laws.laws"),
    "DummyTram": ("vehicles", "vehicle", TRAM, SCENE, "test_vehicles.vehicles"),
    "DummyVehicle": ("vehicles", "vehicle", {}, SCENE, "test_vehicles.vehicles"),
    "DummyTrack": ("tracks", "track", {"depth": 0.2}, SCENE, "test_tracks.tracks"),
    "DummyElement": ("vehicles", "elements", {"name": "it"} | PLACE, wagon(), "test_elements.elements"),
    "dummy_feature": ("features", None, None, SCENE, "test_features.features"),
}
NOUNS = [name for name in DUMMIES if name[0].isupper()]


@pytest.fixture
def dummies():
    """Register the dummies for the length of a test."""
    with undone():
        module = importlib.import_module("tests.conformance.dummies")
        for kind in (*module.RUN[:-1], *module.DESCRIBED):
            registry.register(kind, registry.room_of(kind))
        wt.features.feature(module.dummy_feature)
        yield module


def described(name):
    """Return the table of a scenario with one of the dummies."""
    _, field, table, scene, _ = DUMMIES[name]
    table = table | {"type": name}
    if field != "elements":
        return scene | {field: table}
    vehicle = scene["vehicle"]
    return scene | {"vehicle": vehicle | {"elements": [*vehicle["elements"], table]}}


def held(name, scene):
    """Return what a scenario holds in the place of a dummy."""
    field = DUMMIES[name][1]
    found = scene.vehicle.elements if field == "elements" else getattr(scene, field)
    return found[-1] if isinstance(found, tuple) else found


def in_suite(name):
    module, function = DUMMIES[name][4].split(".")
    return name in getattr(importlib.import_module(f"tests.conformance.{module}"), function)()


@pytest.mark.parametrize("name", NOUNS)
def test_a_registered_noun_is_found_by_scenario_file_and_schema(name, dummies, tmp_path):
    kind = getattr(dummies, name)
    scene = wt.Scenario(**described(name))
    assert type(held(name, scene)) is kind
    assert nouns_by_name()[name] is kind
    scene.to_toml(tmp_path / "scene.toml")
    assert wt.Scenario.from_toml(tmp_path / "scene.toml") == scene
    schema = json_schema()
    assert set(schema["$defs"][name]["properties"]) == {"type", *kind.model_fields}
    assert str(schema).count(f"'#/$defs/{name}'") >= 1
    with pytest.raises(wt.InputError, match=rf"{name[:-1]}.*did you mean '{name}'"):
        wt.Scenario(**_renamed(described(name), name, name[:-1]))
    with pytest.raises(wt.InputError, match=r"the unknown name 'no_such'; allowed: "):
        wt.Scenario(**_with_unknown(described(name), name))


def _renamed(table, name, other):
    if isinstance(table, dict):
        return {key: other if (key, value) == ("type", name) else _renamed(value, name, other)
                for key, value in table.items()}  # fmt: skip
    return [_renamed(item, name, other) for item in table] if isinstance(table, list) else table


def _with_unknown(table, name):
    if isinstance(table, dict):
        more = {"no_such": 1} if table.get("type") == name else {}
        return {key: _with_unknown(value, name) for key, value in table.items()} | more
    return [_with_unknown(item, name) for item in table] if isinstance(table, list) else table


@pytest.mark.parametrize("name", DUMMIES)
def test_what_is_registered_is_in_its_room_in_the_guides_list_and_in_its_suite(name, dummies):
    room = getattr(wt, DUMMIES[name][0])
    assert getattr(room, name) is getattr(dummies, name)
    assert name in dir(room)
    assert name in room.__all__
    assert f"``{name}(" in room_table(room.__name__)
    assert in_suite(name)


@pytest.mark.parametrize("name", DUMMIES)
def test_what_is_forgotten_is_gone(name, dummies):
    unregister(getattr(dummies, name))
    room = getattr(wt, DUMMIES[name][0])
    assert not hasattr(room, name)
    assert name not in [*dir(room), *nouns_by_name(), *json_schema()["$defs"]]
    assert name not in room_table(room.__name__)
    assert not in_suite(name)
    with pytest.raises(wt.InputError, match=rf"found '{name}'; allowed: "):
        wt.features.named(name) if name == "dummy_feature" else wt.Scenario(**described(name))


def test_a_study_and_a_map_take_a_registered_feature_by_its_name(dummies):
    chart = wt.sweep(wt.Scenario(**SCENE), {"speed": [8.0]}, ["dummy_feature"])
    assert chart.dummy_feature.attrs["units"] == "N"
    peaks = wt.simulate(wt.Scenario(**SCENE)).peaks.normal_force
    assert float(chart.dummy_feature[0]) == pytest.approx(float(peaks.mean()), rel=1e-12)


def test_a_class_statement_is_all_that_an_irregularity_of_ones_own_needs(tmp_path):
    with undone():

        class MyBump(wt.CosineBump):
            """A bump with its own name."""

        given = wt.Scenario(**SCENE | {"irregularity": MyBump(height=1e-4, length=0.06, start=0.05)})
        given.to_toml(tmp_path / "scene.toml")
        assert 'type = "MyBump"' in (tmp_path / "scene.toml").read_text(encoding="utf-8")
        read = wt.load(tmp_path / "scene.toml")
        assert read == given
        same = wt.simulate(wt.Scenario(**SCENE))
        np.testing.assert_array_equal(wt.simulate(read).events.time, same.events.time)
        record = wt.simulate(given)
        record.save(tmp_path / "record.nc")
        assert wt.load(tmp_path / "record.nc").scenario == given
        higher = given.replaced({"irregularity.0.height": 2e-4})
        assert isinstance(higher.irregularity[0], MyBump)
    with pytest.raises(wt.InputError, match=r"irregularity\.0\.type: found 'MyBump'; allowed: 'Corrugation'"):
        wt.load(tmp_path / "scene.toml")


@pytest.mark.parametrize("name", ["DummyPlastic", "DummyCreep"])
def test_laws_of_ones_own_are_computed_as_they_say(name, dummies):
    built_in = {"DummyPlastic": "Thornton", "DummyCreep": "Polach"}[name]
    scenes = described(name), _renamed(described(name), name, built_in)
    if name == "DummyCreep":
        coach = wt.Wagon.erri_b176()
        scenes = [table | {"vehicle": coach, "irregularity": {"right": BUMP}, "duration": 0.02} for table in scenes]
    mine, other = (wt.simulate(wt.Scenario(**table)) for table in scenes)
    assert mine.outcome.name == "COMPLETED"
    assert abs(float(mine.energy.relative_imbalance)) < 1e-6
    differ = [float(one.energy.dissipated + one.peaks.normal_force.max()) for one in (mine, other)]
    assert differ[0] != pytest.approx(differ[1], rel=1e-5)


VEHICLES = {
    "wheelset": wt.Wheelset(**WHEELSET), "wheelsets": wt.vehicles.Wheelsets(**wt.vehicles.Wheelsets.example),
    "bogie": wt.vehicles.Bogie(**wt.vehicles.Bogie.example), "wagon": wt.Wagon.erri_b176(),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_a_law_that_is_one_file_goes_with_every_vehicle_and_track(vehicle, dummies):
    """Its force is a method, and it marches as the function of the same force does, to the bit."""
    laws = dummies.DummyPower(constant=1.5e10), wt.contact.Law(lambda delta: 1.5e10 * delta**1.25, exponent=1.25)
    slab = wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 1000.0, "bays": 120})
    bump = wt.CosineBump(**BUMP | {"start": 0.01})
    for track in (wt.StiffTrack(), wt.FloatingDeck(mass=5000, stiffness=2e7, damping=1e4), slab):
        mine, other = (
            wt.simulate(
                wt.Scenario(
                    vehicle=VEHICLES[vehicle], contact=law, track=track, irregularity=bump, speed=20, duration=0.01
                )
            )
            for law in laws
        )
        assert mine.outcome.name == "COMPLETED"
        np.testing.assert_array_equal(mine.events.time, other.events.time)
        np.testing.assert_array_equal(mine.peaks.normal_force, other.peaks.normal_force)
        assert abs(float(mine.energy.relative_imbalance)) < 1e-6


@pytest.mark.parametrize("name", ["DummyContact", "DummyTrack", "DummyElement"])
def test_what_is_described_only_is_refused_in_one_line_and_never_taken_for_another(name, dummies):
    with pytest.raises(wt.InputError, match=rf"found a? ?{name}.*of which nothing is lowered; allowed: ") as error:
        wt.simulate(wt.Scenario(**described(name)))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("family", "field", "scene"),
    [
        (wt.vehicles.Vehicle, "vehicle", SCENE),
        (wt.contact.ElasticContact, "contact", SCENE),
        (wt.tracks.Track, "track", wagon()),
        (wt.creep.CreepLaw, "creep", wagon()),
    ],
)
def test_a_kind_that_no_march_knows_is_refused_in_every_field(family, field, scene):
    with undone():
        mine = type("Mine", (family,), {"__module__": "mine"})
        with pytest.raises(wt.InputError, match=rf"^{field}: found Mine, of which nothing is lowered; allowed: "):
            wt.simulate(wt.Scenario(**scene | {field: mine()}))


def test_a_vehicle_that_stands_for_a_wagon_is_that_wagon():
    with undone():
        table = wagon()["vehicle"]

        class Known(wt.vehicles.Vehicle):
            """A wagon of the library of somebody."""

            def wagon(self):
                return wt.Wagon.model_validate(table)

        assert wt.Scenario(**wagon(vehicle={"type": "Known"})) == wt.Scenario(**wagon())


def test_a_name_that_is_taken_is_refused_and_a_cell_that_runs_again_is_not():
    with undone():
        with pytest.raises(wt.InputError, match=r"^Step: found a second Step, beside that of wheeltapper"):
            type("Step", (Irregularity,), {"__module__": "mine"})
        first, second = (type("Mine", (Irregularity,), {"__module__": "mine"}) for _ in range(2))
        assert nouns_by_name()["Mine"] is second
        assert wt.Scenario(**SCENE | {"irregularity": first()}).irregularity == (first(),)
        with pytest.raises(wt.InputError, match="beside that of mine"):
            type("Mine", (Irregularity,), {"__module__": "another"})
    assert wt.irregularities.Step is wt.Step


def test_a_family_itself_cannot_be_chosen():
    with pytest.raises(wt.InputError, match=r"irregularity.0: found Irregularity\(\); allowed: 'Corrugation'"):
        wt.Scenario(**SCENE | {"irregularity": Irregularity()})
    assert "Irregularity" in dir(wt.irregularities)


NEW_FILE = """
from wheeltapper.describe.irregularity.bump import CosineBump
class FromItsFile(CosineBump):
    "A bump whose file somebody has added."
"""


@pytest.mark.slow
def test_a_new_file_in_a_room_is_all_that_a_new_kind_needs(tmp_path):
    (tmp_path / "somebodys.py").write_text(NEW_FILE, encoding="utf-8")
    code = (
        "import wheeltapper.describe.irregularity as room; room.__path__.append('.'); import wheeltapper as wt\n"
        f"scene = wt.Scenario(**{SCENE | {'irregularity': BUMP | {'type': 'FromItsFile'}}!r})\n"
        "print(type(scene.irregularity[0]) is wt.irregularities.FromItsFile, 'FromItsFile' in dir(wt.irregularities))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["True", "True"], done.stderr


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize(
    ("names", "and_of", "outcome"),
    [
        (("DummyBump", "DummyPlastic", "DummyPower", "DummyCreep", "DummyTram", "dummy_feature"), "test", "PASSED"),
        (("DummyContact", "DummyTrack", "DummyVehicle", "DummyElement"), "(energy or rest)", "FAILED"),
    ],
)
def test_the_suites_pass_what_is_sound_and_fail_what_is_not_lowered(names, and_of, outcome):
    chosen = f"({' or '.join(names)}) and {and_of}"
    command = [sys.executable, "-m", "pytest", "-n", "0", "-rA", "-p", "tests.conformance.dummies", "-k", chosen]
    done = subprocess.run(
        [*command, "-m", "slow or not slow", "tests/conformance"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    told = [line for line in done.stdout.splitlines() if line.startswith(("PASSED", "FAILED", "ERROR"))]
    assert {line.partition(" ")[0] for line in told} == {outcome}, done.stdout
    for name in names:
        assert any(name in line for line in told), (name, done.stdout)
