"""Every kind of sensor: it is a table of a site, is drawn, reads a run, and its recording is read back from files."""

import importlib
import json
import re
from typing import Literal

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe import registry
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.schema import json_schema
from wheeltapper.describe.sensor.along import AlongTrack, AtSeat
from wheeltapper.describe.sensor.base import DECK, Sensor
from wheeltapper.diagnosis import Site, read_channels, write_recording
from wheeltapper.record.recordings.units import SI

from ..registering import undone

WHEELSET = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
RAILS = {
    "rail": "UIC60", "spacing": 0.6, "pad_stiffness": 1.8e8, "pad_damping": 1.8e4, "sleeper_mass": 150.0,
    "ballast_stiffness": 1.05e8, "ballast_damping": 4.8e4,
}  # fmt: skip
PASSAGE = {
    "vehicle": WHEELSET, "contact": wt.Hertz(constant=1.405e11), "speed": 20.0, "duration": 0.15,
    "irregularity": wt.CosineBump(height=1e-4, length=0.06, start=0.5),
}  # fmt: skip
KINDS = [*(kind.__name__ for kind in makeable_nouns(Sensor)), "DummySensor"]
TRACK = [
    *(kind.__name__ for kind in makeable_nouns(Sensor) if issubclass(kind, AlongTrack)),
    "DummySensor",
]
VEHICLE = [name for name in KINDS if name not in ("DeckAcceleration", *TRACK)]


@pytest.fixture(autouse=True)
def _with_the_dummy():
    with undone():
        registry.register(
            importlib.import_module("tests.conformance.dummies").DummySensor, "wheeltapper.describe.sensor"
        )
        yield


def sensors():
    """Return the kinds by their names, for the suite of the registry."""
    return {kind.__name__: kind for kind in makeable_nouns(Sensor)}


def made(name, **fields):
    kind = sensors()[name]
    return kind(**kind.example | {"name": "it"} | fields)


@pytest.fixture(scope="module")
def runs():
    deck = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)
    tracks = {"deck": deck, "rails": wt.tracks.Ballasted(**RAILS)}
    return {name: wt.simulate(wt.Scenario(track=track, **PASSAGE)) for name, track in tracks.items()}


def run_of(name, runs):
    return runs["deck" if name == "DeckAcceleration" else "rails"]


def site_of(sensor):
    """Return a site that the sensor belongs to; what is on a vehicle belongs to none."""
    if isinstance(sensor, AlongTrack):
        return Site(sensors=[sensor], spacing=0.6)
    deck = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)
    return Site(passage=wt.Scenario(track=deck, **PASSAGE), sensor=sensor)


@pytest.mark.parametrize("name", KINDS)
def test_the_kind_in_a_table_says_which_it_is(name, tmp_path):
    sensor = made(name)
    table = sensor.model_dump(mode="json")
    assert table["kind"] == sensor.kind
    assert (
        Sensor.model_validate(table) == sensor == wt.diagnosis.Sensor(**{k: v for k, v in table.items() if k != "type"})
    )
    assert getattr(wt.sensors, name) is type(sensor)
    if name in VEHICLE:
        return
    site = site_of(sensor)
    site.to_toml(tmp_path / "site.toml")
    assert Site.from_toml(tmp_path / "site.toml") == site
    schema = json_schema(Site)["$defs"][name]["properties"]
    assert set(schema) == {"type", *type(sensor).model_fields}
    assert schema["kind"]["const"] == sensor.kind
    assert all("description" in schema[field] for field in type(sensor).model_fields)


@pytest.mark.parametrize("name", VEHICLE)
def test_what_is_on_a_vehicle_belongs_to_no_site(name):
    sensor, pad = made(name), {"kind": "pad force", "name": "pad", "seat": 1}
    said = rf"{sensor.kind}'; allowed: a kind along the track; `Record\.recordings` takes one on a vehicle by itself$"
    tables = {"kind": sensor.kind, "name": "it"}, {"type": name, "name": "it"}
    for one in (sensor, *tables):
        with pytest.raises(wt.InputError, match=rf"^sensors\.1\.kind: found '{said}"):
            Site(sensors=[pad, one], spacing=0.6)
        with pytest.raises(wt.InputError, match=rf"^sensor\.0\.kind: found '{said}"):
            Site(sensor=[one, pad], spacing=0.6)
        with pytest.raises(wt.InputError, match=r"^sensor(\.kind|\.type)?: found .*[aA]xle.?[bB]ox.*; allowed: "):
            Site(sensor=one, sensors=[pad], spacing=0.6)


@pytest.mark.parametrize("name", KINDS)
def test_fields_of_other_kinds_are_refused_unless_they_say_nothing(name):
    own = type(made(name)).model_fields
    others = {field: info.default for kind in sensors().values() for field, info in kind.model_fields.items()}
    strange = {"side": "left", "unit": "kN", "name": "a", "x1": 1.0, "x2": 2.0, "x": 0.6, "seat": 2}
    for field in set(others) - set(own):
        silent = others[field] if isinstance(others[field], int | float) else None
        assert made(name, **{field: silent}) == made(name)
        with pytest.raises(wt.InputError, match=rf"^{field}: found it for a sensor of the kind '.*'; allowed: "):
            made(name, **{field: strange.get(field, 3.0)})


@pytest.mark.parametrize("name", KINDS)
def test_it_reads_a_run_and_files_give_the_same_back(name, runs, tmp_path):
    run, rate = run_of(name, runs), 8e3
    sensor = made(name, rate=rate)
    (recording,) = run.recordings(sensor).values()
    assert recording.quantity == type(sensor).quantity
    assert recording.rate == rate
    assert len(recording.samples) == int(run.end * rate) + 1
    assert np.isfinite(recording.samples).all()
    assert np.ptp(recording.samples) > 0.0
    path = write_recording(recording, tmp_path / "it.csv")
    again = read_channels(path, site_of(sensor))["it"] if isinstance(sensor, AlongTrack) else wt.read_recording(path)
    for one in (again, wt.read_recording(path), wt.read_recording(path, quantity=recording.quantity)):
        np.testing.assert_array_equal(one.samples, recording.samples)
        assert one.quantity == recording.quantity
    assert len(wt.plot(recording).axes) == 1
    if name in VEHICLE:
        return
    from_site = run.recordings(site_of(sensor))["it"]
    np.testing.assert_array_equal(from_site.samples, recording.samples)


@pytest.mark.parametrize("name", TRACK)
def test_a_gain_scales_what_it_reads_and_a_sensitivity_what_the_file_holds(name, runs, tmp_path):
    plain, doubled = (run_of(name, runs).recordings(made(name, gain=gain))["it"].samples for gain in (1.0, 2.0))
    np.testing.assert_allclose(doubled, 2.0 * plain, rtol=1e-15)
    unit = SI[sensors()[name].quantity]
    volts = plain / 250.0
    (tmp_path / "volts.csv").write_text("it [V]\n" + "\n".join(map(repr, volts.tolist())), encoding="utf-8")
    sensor = made(name, unit=f"250 {unit}/V", rate=8e3)
    np.testing.assert_allclose(
        read_channels(tmp_path / "volts.csv", site_of(sensor))["it"].samples, plain, 1e-12, 1e-300
    )
    other = "kN" if unit == "m/s^2" else "m/s^2"
    with pytest.raises(wt.InputError, match=rf"^unit: found '{re.escape(other)}' of a "):
        made(name, unit=other)


@pytest.mark.parametrize("name", KINDS)
def test_it_is_drawn_and_its_numbers_are_judged(name):
    sensor = made(name)
    for drawn in (sensor,) if name in VEHICLE else (sensor, site_of(sensor)):
        assert len(wt.plot(drawn).axes) >= 1
    if isinstance(sensor, AlongTrack):
        from wheeltapper.lower.plausible import site_notes

        (note,) = site_notes(site_of(made(name, gain=50.0)))
        assert str(note).startswith("sensors.0.gain = 50 is implausible")


@pytest.mark.parametrize("name", TRACK)
def test_a_place_that_the_run_does_not_have_is_refused(name, runs):
    if name != "ContactForce":
        with pytest.raises(wt.InputError, match=r"^track: found a FloatingDeck, of which nothing is read"):
            runs["deck"].recordings(made(name))
    if issubclass(sensors()[name], AtSeat):
        kind = sensors()[name]
        with pytest.raises(wt.InputError, match=r"^x: found 0.7 m, where no seat is; allowed: .* is 0.6 m"):
            runs["rails"].recordings(kind(x=0.7))
        same = runs["rails"].recordings(kind(x=1.8)), runs["rails"].recordings(kind(seat=3))
        np.testing.assert_array_equal(*(one[kind.model_fields["kind"].default].samples for one in same))


def test_the_decks_sensor_stands_apart_from_those_along_the_track():
    with pytest.raises(wt.InputError, match=r"^sensors\.0\.kind: found 'deck acceleration'; allowed: a kind along"):
        Site(sensors=[wt.sensors.DeckAcceleration(name="a")])
    with pytest.raises(wt.InputError, match=r"^sensors\.0\.kind: found nothing; allowed: a kind along the track"):
        Site(sensors=[{"name": "a", "seat": 3}])
    with pytest.raises(wt.InputError, match=r"^sensors\.0\.type: found 'PadForc'; .*did you mean 'PadForce'"):
        Site(sensors=[{"name": "a", "type": "PadForc", "seat": 3}])
    with pytest.raises(wt.InputError, match=r"^sensors: found a PadForce; allowed: a list"):
        Site(sensors=wt.sensors.PadForce(name="a", seat=1))
    with pytest.raises(wt.InputError, match=r"^sensor\.kind: found 'pad force'; allowed: 'deck acceleration'"):
        Site(sensor={"kind": "pad force", "seat": 1}, sensors=[wt.sensors.PadForce(name="a", x=0.0)])
    with pytest.raises(wt.InputError, match=r"^kind: found 'pad'; allowed: .*\(did you mean 'pad force'\?\)"):
        Sensor(kind="pad")
    for typed in ({}, {"type": "Sensor"}):
        with pytest.raises(wt.InputError, match=r"^x1: found no places of a contact force; allowed: x1 and x2, "):
            Sensor.model_validate({"kind": "contact force", **typed})
    assert type(Sensor()) is wt.sensors.DeckAcceleration
    assert Sensor().kind == DECK


@pytest.mark.parametrize("name", TRACK)
def test_a_site_with_it_is_changed_at_several_places_at_once(name):
    site = site_of(made(name))
    changed = site.replaced({"sensors.it.gain": 1.1, "sensors.it.gain_uncertainty": 0.02, "sensors.0.side": "left"})
    assert changed.sensors == (made(name, gain=1.1, gain_uncertainty=0.02, side="left"),)
    for table in (made(name).model_dump(exclude_unset=True), {"type": name, **sensors()[name].example, "name": "it"}):
        assert Sensor.model_validate(table) == made(name)
        assert Site(sensors=[table], spacing=0.6) == Site(sensor=[table], spacing=0.6) == site


def test_a_kind_is_one_name_that_no_other_class_has():
    with pytest.raises(wt.InputError, match=r"^kind: found 'pad force' of a SerialPad, beside that of a PadForce"):

        class SerialPad(wt.sensors.PadForce):
            serial: str = ""

    with pytest.raises(wt.InputError, match=r"^kind: found no name of a NoKind; allowed: one name, as "):

        class NoKind(AtSeat):
            pass

    with pytest.raises(wt.InputError, match=r"^quantity: found 'heat' of a Heated; allowed: deck acceleration, "):

        class Heated(AtSeat):
            quantity = "heat"
            kind: Literal["pad heat"] = "pad heat"

    assert [name for name in sensors() if name in ("SerialPad", "NoKind", "Heated")] == []


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            lambda self, seen: np.zeros(3),
            r"^true_values: found values of a geophone in the shape \(3,\); allowed: one ",
        ),
        (lambda self, seen: 3.0, r"^true_values: found values of a geophone in the shape \(\)"),
        (AtSeat.true_values, r"^kind: found 'geophone', of which nobody says what it reads of a run"),
    ],
)
def test_what_a_kind_of_ones_own_returns_is_checked(values, message, runs):
    class Geophone(AtSeat):
        """A geophone on a sleeper."""

        kind: Literal["geophone"] = "geophone"
        true_values = values

    with pytest.raises(wt.InputError, match=message):
        runs["rails"].recordings(Geophone(seat=0))


def test_refusals_of_lengths_say_which_units_there_are(tmp_path):
    with pytest.raises(wt.InputError, match=r"^unit: found 'mil'; allowed: m, mm, um, in \(length\), .*5 mm/V"):
        wt.sensors.SleeperDisplacement(seat=1, unit="mil")
    file = tmp_path / "sunk.csv"
    file.write_text("t [s],sunk [mm]\n" + "\n".join(f"{i / 1e3},{i}" for i in range(20)), encoding="utf-8")
    with pytest.raises(wt.InputError, match=r"unit: found the unit 'mm'; .*quantity='displacement' reads a length"):
        wt.read_recording(file)
    np.testing.assert_allclose(wt.read_recording(file, quantity="displacement").samples, 1e-3 * np.arange(20))
    file.write_text("sunk\n" + "\n".join(str(i) for i in range(20)), encoding="utf-8")
    gauge = wt.sensors.SleeperDisplacement(name="sunk", seat=1, rate=1e3)
    with pytest.raises(wt.InputError, match=r'unit: found no unit, .*"mm", "0\.1 mm", "5 mm/V"'):
        read_channels(file, Site(sensors=[gauge], spacing=0.6))


MICRO = 1e-6 * np.arange(20.0)
G = 9.80665


@pytest.mark.parametrize(
    ("kind", "in_file", "unit", "size"),
    [
        ("RailStrain", "m/m", None, 1.0),
        ("RailStrain", "mm/m", None, 1e-3),
        ("RailStrain", "um/m", None, 1e-6),
        ("RailStrain", "µm/m", "500 (um/m)/V", 1e-6),  # what a file says of itself counts
        ("RailStrain", "με", None, 1e-6),
        ("RailStrain", "microstrain", None, 1e-6),
        ("RailStrain", "", "um/m", 1e-6),
        ("RailStrain", "", "-2 microstrain", -2e-6),
        ("RailStrain", "V", "500 (um/m)/V", 500e-6),
        ("RailStrain", "mV", "500 um/m/V", 500e-9),
        ("RailStrain", "mV", "2 mV/(um/m)", 0.5e-6),
        ("RailStrain", "mV/V", "1000 um/m/(mV/V)", 1e-3),
        ("RailStrain", "mV/V", "2 mV/V/(mm/m)", 0.5e-3),
        ("RailAcceleration", "g", None, G),
        ("RailAcceleration", "mg", None, 1e-3 * G),
        ("SleeperAcceleration", "m/s^2", "100 mV/g", 1.0),
        ("SleeperAcceleration", "", "10 g", 10.0 * G),
        ("SleeperAcceleration", "mV", "100 mV/g", 0.01 * G),
        ("RailShearForce", "um/m", "0.8 kN/(um/m)", 800.0),
        ("RailShearForce", "kN", "0.8 kN/(um/m)", 1e3),
    ],
)
def test_strains_and_accelerations_have_their_units(kind, in_file, unit, size, tmp_path):
    """A strain is one only of a sensor of strains; of a sensor of forces it is what the bridge puts out."""
    file = tmp_path / "it.csv"
    head = f"it [{in_file}]" if in_file else "it"
    file.write_text("\n".join([head, *map(repr, MICRO.tolist())]), encoding="utf-8")
    sensor = made(kind, unit=unit, rate=1e3)
    read = read_channels(file, Site(sensors=[sensor], spacing=0.6))["it"]
    assert read.quantity == sensor.quantity
    np.testing.assert_allclose(read.samples, size * MICRO, rtol=1e-12)


def test_a_row_of_units_below_the_names_may_have_strains(tmp_path):
    file = tmp_path / "many.csv"
    rows = "\n".join(f"{1e-3 * i};{i};{2 * i};{3 * i}" for i in range(20))
    file.write_text(f"time;foot;pair;rail\ns;um/m;um/m;g\n{rows}", encoding="utf-8")
    foot, rail = wt.sensors.RailStrain(name="foot", x=0.3), wt.sensors.RailAcceleration(name="rail", x=0.3)
    pair = wt.sensors.RailShearForce(name="pair", x1=0.1, x2=0.5, unit="0.8 kN/(um/m)")
    read = read_channels(file, Site(sensors=[foot, pair, rail]))
    for name, quantity, size in (("foot", "strain", 1e-6), ("pair", "force", 1600.0), ("rail", "vertical acc", 3 * G)):
        assert read[name].quantity.startswith(quantity)
        np.testing.assert_allclose(read[name].samples, size * np.arange(20), rtol=1e-12)


def test_a_bridge_says_which_strain_a_ratio_is_where_the_sensitivity_is_of_volts(tmp_path):
    file = tmp_path / "it.csv"
    file.write_text("\n".join(["it [mV/V]", *map(repr, MICRO.tolist())]), encoding="utf-8")
    sensor = made("RailStrain", unit="500 (um/m)/V", rate=1e3)
    with pytest.raises(wt.InputError, match=r"excitation: found none; allowed: the voltage of the bridge's excitation"):
        read_channels(file, Site(sensors=[sensor]))
    powered = sensor.model_copy(update={"excitation": 5.0})
    read = read_channels(file, Site(sensors=[powered]))["it"]
    np.testing.assert_allclose(read.samples, 500e-6 * 5e-3 * MICRO, rtol=1e-12)


@pytest.mark.parametrize(
    ("kind", "unit", "message"),
    [
        (
            "RailStrain",
            "0.8 kN/(um/m)",
            r"^unit: found '0.8 kN/\(um/m\)' of a rail strain; allowed: a strain, as \"um/m",
        ),
        ("RailStrain", "kN", r"^unit: found 'kN' of a rail strain; allowed: a strain, as "),
        (
            "RailStrain",
            "mV/V",
            r"^unit: found 'mV/V'; allowed: m/m, mm/m, um/m, microstrain \(strain\), or one of these",
        ),
        ("RailStrain", "um", r"^unit: found 'um'; allowed: m/m, mm/m, "),
        ("RailStrain", "0.5 um/m/(um/m)", r"^unit: found '0.5 um/m/\(um/m\)'; allowed: m/m, mm/m, "),
        ("RailStrain", "0.5 (um/m)/(um/m)", r"^unit: found .*; allowed: m/m, mm/m, "),
        ("RailStrain", "%", r"^unit: found '%'; allowed: m/m, mm/m, "),
        ("RailShearForce", "um/m", r"^unit: found 'um/m'; allowed: m/s\^2, g \(acceleration\), N, kN"),
        ("RailAcceleration", "mm", r"^unit: found 'mm'; allowed: m/s\^2, g \(acceleration\), or one of these per V"),
        (
            "SleeperAcceleration",
            "250 kN/V",
            r"^unit: found '250 kN/V' of a sleeper .*a vertical acceleration, as \"g\"",
        ),
    ],
)
def test_a_unit_of_something_else_is_refused(kind, unit, message):
    with pytest.raises(wt.InputError, match=message):
        made(kind, unit=unit)


def test_files_of_strains_and_accelerations_are_not_taken_for_others(tmp_path):
    """Without a word on what they are, a strain has no quantity, and an acceleration is that of a deck, as ever."""
    file = tmp_path / "it.csv"
    file.write_text("\n".join(["it [um/m]", *map(repr, MICRO.tolist())]), encoding="utf-8")
    with pytest.raises(wt.InputError, match=r"unit: found the unit 'um/m', of what a sensor puts out; allowed: "):
        wt.read_recording(file, rate=1e3)
    np.testing.assert_allclose(wt.read_recording(file, rate=1e3, quantity="strain").samples, 1e-6 * MICRO)
    with pytest.raises(
        wt.InputError, match=r"unit: found '500 \(um/m\)/V', where the file says 'um/m'; allowed: a file"
    ):
        wt.read_recording(file, rate=1e3, quantity="strain", unit="500 (um/m)/V")
    file.write_text("\n".join(["it [mV/V]", *map(repr, MICRO.tolist())]), encoding="utf-8")
    with pytest.raises(wt.InputError, match=r"unit: found the unit 'mV/V'; allowed: m/m, .*500 \(um/m\)/V"):
        wt.read_recording(file, rate=1e3, quantity="strain")
    file.write_text("\n".join(["it [g]", *map(repr, MICRO.tolist())]), encoding="utf-8")
    assert wt.read_recording(file, rate=1e3).quantity == DECK
    assert wt.read_recording(file, rate=1e3, quantity="vertical acceleration").quantity == "vertical acceleration"
    with pytest.raises(
        wt.InputError, match=r"quantity: found 'strain', where the unit 'g' is one of deck acceleration"
    ):
        wt.read_recording(file, rate=1e3, quantity="strain")
    file.write_text("\n".join(["axle box [g]", *map(repr, MICRO.tolist())]), encoding="utf-8")
    with pytest.raises(wt.InputError, match="something else than a deck"):
        wt.read_recording(file, rate=1e3)
    read = wt.read_recording(file, rate=1e3, quantity="vertical acceleration")
    np.testing.assert_allclose(read.samples, G * MICRO)


def test_noise_is_drawn_for_each_sensor_by_itself(runs):
    one, two = (wt.sensors.DeckAcceleration(name=name, noise=1e-3, rate=2e3) for name in ("one", "two"))
    both, alone = runs["deck"].recordings([one, two], seed=3), runs["deck"].recordings(two, seed=3)
    np.testing.assert_array_equal(both["two"].samples, alone["two"].samples)
    assert np.abs(both["one"].samples - both["two"].samples).max() > 1e-3
    plain = runs["deck"].recordings(two)["two"].samples
    assert np.std(alone["two"].samples - plain) == pytest.approx(1e-3 * np.sqrt(1e3), rel=0.15)


def test_a_filter_beyond_what_is_sampled_is_refused():
    with pytest.raises(wt.InputError, match=r"^cutoff: found 8000 Hz; allowed: less than 8000 Hz, 4 times its rate"):
        wt.sensors.DeckAcceleration(rate=2e3, cutoff=8e3)


@pytest.mark.parametrize("name", [*TRACK, *VEHICLE])
def test_the_filter_of_its_recorder_is_one_of_its_fields(name, tmp_path):
    assert made(name).cutoff(5e3) == 2e3
    assert made(name, anti_alias=False).cutoff(5e3) is None
    assert made(name, anti_alias="1.5 kHz").cutoff(5e3) == 1500.0
    assert "anti_alias" not in made(name).model_dump(mode="json")  # files without it remain as they are
    for wrong, allowed in (("x", "a frequency"), (-3, "above 0 Hz"), (30e3, "less than its rate, 20000 Hz")):
        with pytest.raises(wt.InputError, match=rf"^anti_alias: found .*; allowed: .*{allowed}"):
            made(name, anti_alias=wrong)
    if name in TRACK:
        site = site_of(made(name, anti_alias="1.5 kHz")), site_of(made(name, anti_alias=False))
        for number, one in enumerate(site):
            one.to_toml(tmp_path / f"{number}.toml")
            assert Site.from_toml(tmp_path / f"{number}.toml") == one


def test_what_cannot_be_simulated_is_refused(runs):
    gauges = {"x1": 0.1, "x2": 0.5}
    cases = {
        r"^sensors: found none": [], r"^sensors: found 3": 3, r"^sensors\.0: found 'a'": ["a"],
        r"^kind: found 'deck acceleration' on a Ballasted": wt.sensors.DeckAcceleration(),
        r"^sensors\.1\.name: found a second 'rail shear force'": [wt.sensors.RailShearForce(**gauges)] * 2,
        r"^sensors\.b\.x: found 0.7 m, where no seat is; allowed: a seat's place; the nearest is 0.6 m": [
            wt.sensors.PadForce(name="a", seat=1), wt.sensors.PadForce(name="b", x=0.7),
        ],
        r"^x: found 1e\+300 m, where no seat is": wt.sensors.PadForce(x=1e300),
        r"^spacing: found 0.65 m; allowed: 0.6 m": Site(sensors=[wt.sensors.PadForce(name="a", seat=1)], spacing=0.65),
    }  # fmt: skip
    for message, given in cases.items():
        with pytest.raises(wt.InputError, match=message):
            runs["rails"].recordings(given)
    with pytest.raises(wt.InputError, match=r"^x: found nothing; allowed: a value, which is required here"):
        wt.sensors.RailStrain(name="a")


def test_an_axle_box_that_a_vehicle_does_not_have_is_refused(runs):
    box = wt.sensors.AxleBoxAcceleration
    with pytest.raises(wt.InputError, match=r"^wheelset: found 2; allowed: 1, the only wheelset of the run$"):
        runs["rails"].recordings(box(wheelset=2))
    two = wt.vehicles.Wheelsets(wheelsets=(WHEELSET, WHEELSET), positions=(0.0, -2.4))
    pair = wt.simulate(wt.Scenario(**PASSAGE | {"vehicle": two, "duration": 0.01}))
    with pytest.raises(
        wt.InputError, match=r"^sensors\.b\.wheelset: found 3; allowed: 1 to 2, the wheelsets of the run$"
    ):
        pair.recordings([box(name="a", wheelset=2), box(name="b", wheelset=3)])
    with pytest.raises(wt.InputError, match=r"^wheelset: found 0; "):
        box(wheelset=0)
    with pytest.raises(wt.InputError, match=r"^side: found 'both'; "):
        box(side="both")
    for field in ("unit", "gain", "x", "seat"):
        with pytest.raises(
            wt.InputError, match=rf"^{field}: found it for a sensor of the kind 'axle box acceleration'"
        ):
            box(**{field: 2})


def test_a_slab_has_no_sleepers_to_read():
    slab = wt.tracks.Slab(**{name: RAILS[name] for name in ("rail", "spacing", "pad_stiffness", "pad_damping")})
    record = wt.simulate(wt.Scenario(track=slab, **PASSAGE | {"duration": 0.01}))
    with pytest.raises(wt.InputError, match=r"^kind: found 'sleeper acceleration' on a Slab; allowed: a kind that "):
        record.recordings(wt.sensors.SleeperAcceleration(seat=0))


def test_a_site_written_before_kinds_had_fields_of_their_own_is_read():
    table = {
        "type": "Sensor", "kind": "rail shear force", "name": "left 1", "x1": 0.1, "x2": 0.5, "side": "left",
        "gain": 1.0, "gain_uncertainty": 0.05, "noise": 0.0, "order": 8, "offset": 0.0, "drift": 0.0,
    }  # fmt: skip
    deck = {"type": "Sensor", "kind": DECK, "name": "", "gain": 1.0, "gain_uncertainty": 0.0, "noise": 0.0, "order": 8}
    site = Site.model_validate({"type": "Site", "sensor": deck, "sensors": [table], "spacing": 0.6})
    assert site.sensors == (
        wt.sensors.RailShearForce(name="left 1", x1=0.1, x2=0.5, side="left", gain_uncertainty=0.05),
    )
    assert "noise" not in json.dumps(site.model_dump(mode="json")["sensors"])
