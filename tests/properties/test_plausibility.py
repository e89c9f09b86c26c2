"""Implausible numbers are doubted in one note each; what people compute is not."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from tests.wayside import plain_train
from wheeltapper.describe.noun import nouns_by_name
from wheeltapper.describe.track.published import track_names
from wheeltapper.ground.quantities import UNITS, si_unit
from wheeltapper.lower.plausible import USUAL, implausible_cells, implausible_notes, site_notes
from wheeltapper.record.limits.rule import rule_notes
from wheeltapper.record.simulate import ModelWarning

ROOT = Path(__file__).parents[2]
BUMP = wt.CosineBump(height=1e-4, length=0.05, start=0.02)
LINE = wt.tracks.Ballasted.named("rolland_UIC60_example")
WHEEL = wt.Wheelset(mass=1500, load=91_307)


def light_rail():
    return LINE.rail.model_copy(update={"mass_per_length": 0.06})


def scene(**changes):
    vehicle = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
    given = {"vehicle": vehicle, "contact": wt.Hertz(constant=1.405e11), "irregularity": BUMP}
    return wt.Scenario(**(given | {"speed": 5.0, "duration": 0.05} | changes))


def wheelset(**changes):
    return {"vehicle": wt.Wheelset(**({"mass": 1500, "load": 91_307} | changes))}


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"irregularity": wt.WheelFlat(depth=0.1, position=0.1)}, ("irregularity.0.depth = 0.1 m", "mm", '"0.1 mm"')),
        ({"irregularity": wt.Step(height=-1, position=0.1)}, ("irregularity.0.height = -1 m", '"-1 mm"')),
        ({"irregularity": wt.Corrugation(amplitude=50, wavelength=0.05, start=0)}, ("amplitude = 50 m", '"50 um"')),
        ({"irregularity": wt.Repeated(of=BUMP.model_copy(update={"height": 0.1}), period=1)}, ("irregularity.0.of.",)),
        ({"irregularity": wt.OutOfRound(orders=(1, 3), amplitudes=(1e-4, 0.3))}, ("amplitudes = 0.3 m", '"0.3 mm"')),
        ({"speed": 500_000}, ("speed = 500000 m/s", "1 to 100 m/s")),
        ({"speed": 250}, ("speed = 250 m/s", '"250 km/h"')),
        ({"duration": 1e6}, ("duration = 1e+06 s",)),
        (wheelset(radius=46), ("vehicle.radius = 46 m", '"46 cm"')),
        (wheelset(mass=1.5), ("vehicle.mass = 1.5 kg", '"1.5 t"')),
        (wheelset(load=22.5), ("vehicle.load = 22.5 N", '"22.5 kN"')),
        (wheelset(stiffness=1e14), ("vehicle.stiffness = 1e+14 N/m", "0.1 to 100 MN/m")),
        (wheelset(stiffness=2.44), ("vehicle.stiffness = 2.44 N/m", '"2.44 kN/mm"')),
        (wheelset(damping=1e8), ("vehicle.damping = 1e+08 N s/m",)),
        ({"contact": wt.Hertz(constant=4.44e6)}, ("contact.constant = 4.44e+06", "N/mm^1.5")),
        ({"contact": wt.Hertz(youngs_modulus=210)}, ("contact.youngs_modulus = 210 Pa", '"210 GPa"')),
        ({"contact": wt.contact.Thornton(yield_strength=500)}, ("contact.yield_strength = 500 Pa", '"500 MPa"')),
        ({"track": wt.FloatingDeck(mass=15, stiffness=59.2)}, ("track.stiffness = 59.2 N/m", '"59.2 kN/mm"')),
        ({"track": wt.FloatingDeck(mass=1e9, stiffness=1.5e7)}, ("track.mass = 1e+09 kg",)),
        ({"track": LINE.model_copy(update={"pad_stiffness": 180.0})}, ("track.pad_stiffness = 180 N/m", "kN/mm")),
        ({"track": LINE.model_copy(update={"rail": light_rail()})}, ("track.rail.mass_per_length = 0.06 kg/m", "t/m")),
        (
            {"track": LINE.model_copy(update={"anomalies": (wt.tracks.HangingSleeper(seat=1, void=2.0),)})},
            ("track.anomalies.0.void = 2 m", '"2 mm"'),
        ),
        (
            {
                "vehicle": wt.vehicles.Wheelsets(
                    wheelsets=(WHEEL, WHEEL.model_copy(update={"mass": 1.5})), positions=(0.0, -2.5)
                )
            },
            ("vehicle.wheelsets.1.mass = 1.5 kg", '"1.5 t"'),
        ),
        (
            {"vehicle": wt.vehicles.Bogie(**wt.vehicles.Bogie.example | {"wheel_load": 88.0})},
            ("vehicle.wheel_load = 88 N", '"88 kN"'),
        ),
    ],
)
def test_an_implausible_number_is_doubted_in_one_note(changes, parts):
    notes = implausible_notes(scene(**changes))
    assert len(notes) == 1
    assert "\n" not in notes[0]
    for part in (*parts, "is implausible: usual are"):
        assert part in notes[0]


LINEAR_OR_COMPLIANCE = ("a linear stiffness in N/m is another quantity, and so is a compliance G in m/N^(2/3)",)
HALF = ("half of a sleeper is asked",)
RADIUS = ("the radius is asked, not the diameter",)


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        # W. Zhai, K. Wang, C. Cai, Vehicle System Dynamics 47 (2009): G = 4.57e-8 R^-0.149, 5.13e-8 at 0.46 m
        *(
            ({"contact": wt.Hertz(constant=value)}, LINEAR_OR_COMPLIANCE)
            for value in (1.4e9, 9.1e-7, 5.13e-8, 5.0, 9e9)
        ),
        ({"contact": wt.Hertz(constant_per_wheel=1.4e9)}, LINEAR_OR_COMPLIANCE),
        ({"contact": wt.contact.Thornton(constant_per_wheel=5.13e-8)}, LINEAR_OR_COMPLIANCE),
        ({"contact": wt.contact.Linear(stiffness=1.405e11)}, ("Hertz's constant in N/m^1.5 is another quantity",)),
        ({"track": LINE.model_copy(update={"sleeper_mass": 300.0})}, HALF),
        ({"track": LINE.model_copy(update={"spacing": 600.0})}, ("track.spacing = 600 m", '"600 mm"')),
        (wheelset(radius=920), RADIUS),
        (wheelset(radius=0.92), RADIUS),
        ({"speed": "120"}, ("speed = 120 m/s", '"120 km/h"')),
    ],
)
def test_a_number_of_another_quantity_is_doubted_even_where_it_is_possible(changes, parts):
    (note,) = implausible_notes(scene(**changes))
    assert note.doubtful
    for part in (*parts, "is implausible: usual are"):
        assert part in note


@pytest.mark.parametrize(
    ("changes", "meant"),
    [
        (wheelset(radius="0.46 mm"), "0.46 m"),
        (wheelset(radius="460 um"), "0.46 m"),
        (wheelset(mass="1.2 g"), "1.2 t"),
        ({"track": LINE.model_copy(update={"pad_stiffness": 90e3})}, "90 MN/m"),  # of "90 kN/m"
        ({"track": LINE.model_copy(update={"spacing": 6e-4})}, "0.6 m"),
        ({"track": LINE.model_copy(update={"spacing": 0.04})}, None),  # and not 0.04 km
        ({"duration": 1e6}, None),
    ],
)
def test_a_hint_keeps_the_number_as_it_was_written_or_there_is_none(changes, meant):
    (note,) = implausible_notes(scene(**changes))
    assert note.rpartition("did you mean ")[2] == f'"{meant}"?' if meant else "did you mean" not in note


@pytest.mark.parametrize(
    ("contact", "vehicle", "other"),
    [
        (wt.Hertz(constant=9.41e10), WHEEL, "perhaps `constant_per_wheel` is meant"),
        (wt.Hertz(constant_per_wheel=1.882e11), WHEEL, "perhaps `constant` is meant"),
        (wt.Hertz(constant=1.405e11), WHEEL, None),  # the paper's
        (wt.Hertz(constant=1.882e11), WHEEL, None),
        (wt.Hertz(constant_per_wheel=9.41e10), WHEEL, None),
        (wt.Hertz(constant=9.41e10), WHEEL.model_copy(update={"wheels": 1}), None),
        (wt.Hertz(constant=9.41e10), WHEEL.model_copy(update={"mass": 600.0}), None),
    ],
)
def test_a_constant_of_one_wheel_for_a_wheelset_is_told_and_not_warned_of(contact, vehicle, other):
    # Hertz (1882): one wheel of 0.46 m on a crown of 0.3 m has 9.41e10 N/m^1.5 (docs/theory/contact.rst, section 3.1)
    notes = implausible_notes(scene(contact=contact, vehicle=vehicle))
    assert len(notes) == (other is not None)
    assert other is None or (notes[0].endswith(other) and not notes[0].doubtful)


def test_seats_too_far_apart_to_be_computed_are_refused_in_a_line():
    far = scene(track=LINE.model_copy(update={"spacing": 600.0}), irregularity=())
    with pytest.raises(wt.InputError, match=r"^track\.spacing: found 600 m; allowed: at most 10 m; usual are 0\.6 m$"):
        wt.simulate(far)
    with pytest.raises(wt.InputError, match=r"track\.spacing: found 600 m"):
        wt.tracks.decay_rate(far.track, [100.0])


# -- sites and rules --------------------------------------------------------------------------------------------------


def gauges(change=None, **more):
    given = [
        {"kind": "rail shear force", "name": f"{side} {i}", "x1": 0.1 + 0.6 * i, "x2": 0.5 + 0.6 * i, "side": side}
        for side in ("left", "right")
        for i in range(2)
    ]
    given[0] |= change or {}
    return wt.diagnosis.Site(**({"sensors": given, "spacing": 0.6, "radius": 0.46} | more))


@pytest.mark.parametrize(
    ("site", "parts"),
    [
        (gauges(), None),
        (gauges(radius=920), ("radius = 920 m", *RADIUS)),
        (gauges(spacing=600), ("spacing = 600 m", '"600 mm"')),
        (gauges({"x1": 0, "x2": 500}), ("the length of sensors.0 = 500 m", '"500 mm"')),
        (gauges({"gain": 10}), ("sensors.0.gain = 10", "usual are 0.8 to 1.25")),
        (gauges({"gain": 1048.0}), ("loads in kN taken for N",)),
        (gauges({"gain": 2.10}), ("a load of one wheel taken for that of an axle",)),
        (gauges({"gain": 0.5}), ("a load of an axle taken for that of each wheel",)),
        (gauges({"gain_uncertainty": 5}), ("sensors.0.gain_uncertainty = 5", '"5 %"')),
        (gauges({"rate": 5}), ("sensors.0.rate = 5 Hz", '"5 kHz"')),
        (gauges({"kind": "pad force", "x1": None, "x2": None, "x": 12_340.0}), ("sensors.0.x = 12340 m",)),
    ],
)
def test_the_numbers_of_a_site_are_doubted_in_one_note(site, parts):
    notes = site_notes(site)
    assert len(notes) == (parts is not None)
    for part in parts or ():
        assert part in notes[0]


def test_the_examples_sites_are_plausible():
    assert site_notes(wt.diagnosis.Site.from_toml(ROOT / "examples" / "detector.toml")) == ()
    assert site_notes(wt.diagnosis.Site.from_toml(ROOT / "examples" / "site.toml")) == ()


def test_a_train_says_what_is_doubtful_in_its_site_and_its_rules_and_calibration_warns():
    site = gauges({"gain": 1.02}, radius=920)
    recordings = {
        name: wt.diagnosis.Recording(samples, 10e3, "force") for name, samples in plain_train(site.sensors).items()
    }
    rule = wt.limits.Rule("ours", "peak_force", 350, "stop")
    (train,) = wt.diagnosis.measure_trains(recordings, site, rules=[rule])
    for part in ("radius = 920 m is implausible", "limit of the rule 'ours' = 350 N is implausible"):
        assert part in str(train)
        assert any(part in note for note in train.to_dict()["notes"])
    axles = [one["static_force"] for one in train.axles]
    right = gauges()
    loads = dict(enumerate(axles, 1))
    for share, told in ((1e-3, "loads in kN"), (0.5, "a load of one wheel"), (2.0, "a load of an axle")):
        wrong = {number: share * load for number, load in loads.items()}
        with pytest.warns(ModelWarning, match=rf"gain = .*{told}.*the worst of 4 such sensors"):
            wt.diagnosis.calibrated(right, train, wrong)
    wt.diagnosis.calibrated(right, train, loads)  # and a warning would be an error


@pytest.mark.parametrize(
    ("quantity", "limit", "more", "told"),
    [
        ("peak_force", 350, {}, "limit of the rule 'ours' = 350 N is implausible: usual are 40 to 1000 kN"),
        ("peak_force", "350 kN", {}, None),
        ("flat_length", 60, {}, 'did you mean "60 mm"?'),
        ("dynamic_ratio", 300, {}, 'did you mean "300 %"?'),
        ("peak_force", "90 kN", {"plus_static": 1.0, "at_most": 200}, "at_most of the rule 'ours' = 200 N"),
        ("peak_force", "90 kN", {"speed_up_to": 120}, 'did you mean "120 km/h"?'),
        ("peak_force", "90 kN", {"diameter_above": 840}, 'did you mean "840 mm"?'),
    ],
)
def test_the_numbers_of_a_rule_are_doubted_in_one_note(quantity, limit, more, told):
    notes = rule_notes([wt.limits.Rule("ours", quantity, limit, "stop", **more)])
    assert len(notes) == (told is not None)
    assert told is None or told in notes[0]


def test_the_packages_rules_are_plausible():
    assert rule_notes(wt.limits.read_rules()) == ()


def test_the_parts_of_a_wagon_are_doubted_by_name():
    wagon = wt.Wagon.erri_b176()
    light = wagon.bodies[0].model_copy(update={"mass": 32.0 / 32.0})
    spring = wagon.elements[0].model_copy(update={"stiffness": (0.0, 0.0, 1e20)})
    wagon = wagon.model_copy(update={"bodies": (light, *wagon.bodies[1:])}).with_element(spring)
    notes = implausible_notes(wt.Scenario(vehicle=wagon, irregularity={"left": [BUMP]}, speed=20, duration=1))
    assert [note.partition(" = ")[0] for note in notes] == [
        "vehicle.bodies.car body.mass",
        f"vehicle.elements.{spring.name}.stiffness",
    ]


PLACES = tuple(np.linspace(0.0, 0.2, 41))


def measured(size):
    return wt.Measured(positions=PLACES, heights=tuple(0.5 * size * np.sin(40.0 * np.array(PLACES))), beyond="flat")


def wave(size, **given):
    return wt.Profile(function=lambda x: 0.5 * size * np.sin(40.0 * x), **given)


@pytest.mark.parametrize(
    ("irregularity", "noun"),
    [
        (measured(0.3), "irregularity.0"),
        (wave(0.3), "irregularity.0"),
        (wave(0.3, start=-1.0, end=0.2), "irregularity.0"),
        (wt.Repeated(of=wave(0.3, start=0.0, end=0.05 * np.pi), period=1.0), "irregularity.0.of"),
        (wt.OutOfRound(places=PLACES, deviations=measured(0.3).heights), "irregularity.0"),
    ],
)
def test_heights_given_one_by_one_are_doubted_by_their_span(irregularity, noun):
    (note,) = implausible_notes(scene(irregularity=irregularity))
    assert note.startswith(f"the span of {noun}'s heights = 0.")
    assert 'm is implausible: usual are 0.01 to 10 mm; did you mean "0.' in note
    assert note.endswith(' mm"?')


@pytest.mark.parametrize(
    "irregularity",
    [
        measured(5e-3),
        wave(0.04),
        wave(0.3, start=10.0),  # behind the run's end
        wt.OutOfRound(places=PLACES, deviations=measured(2e-3).heights),
        wt.Corrugation(amplitude=0.02, wavelength=5.0, start=0.0),
    ],
)
def test_rough_rails_and_wheels_are_not_doubted(irregularity):
    assert implausible_notes(scene(irregularity=irregularity)) == ()


@pytest.mark.parametrize(
    ("corners", "told"),
    [
        ({"deflection": (0.0, 25.0, 30.0)}, ".deflection = 25 m is implausible: usual are 1 to 100 mm; did you mean"),
        ({"force": (0.0, 25.0, 25e3)}, '.force = 25 N is implausible: usual are 0.5 to 1000 kN; did you mean "25 kN"?'),
        ({"force": (0.0, 0.0, 25e12)}, ".force = 2.5e+13 N is implausible"),
        ({}, None),
    ],
)
def test_a_stop_is_doubted_in_one_note(corners, told):
    given = {"deflection": (0.0, 0.025, 0.03), "force": (0.0, 0.0, 25e3)} | corners
    stop = wt.vehicles.Stop(name="stop", between=("car body", "ground"), at=(0, 0, 1), along="z", **given)
    wagon = wt.Wagon.erri_b176().with_element(stop)
    notes = implausible_notes(wt.Scenario(vehicle=wagon, speed=20, duration=1))
    assert len(notes) == (told is not None)
    assert told is None or notes[0].startswith("vehicle.elements.stop" + told)


@pytest.mark.parametrize("vehicle", [scene().vehicle, wt.Wagon.erri_b176()])
def test_a_duration_that_is_refused_is_not_doubted_too(vehicle):
    with pytest.raises(wt.InputError, match=r"duration: found 1e\+12 s"):  # and no warning, which would be an error
        wt.simulate(wt.Scenario(vehicle=vehicle, speed=5.0, duration=1e12))


def test_a_record_holds_the_doubts_and_warns_of_them(tmp_path):
    with pytest.warns(ModelWarning, match=r'depth = 0\.1 m .* did you mean "0\.1 mm"') as caught:
        record = wt.simulate(scene(irregularity=wt.WheelFlat(depth=0.1, position=0.3)))
    assert [one.filename for one in caught] == [__file__]
    assert len(record.notes) == 1
    record.save(tmp_path / "record.nc")
    assert wt.load(tmp_path / "record.nc").notes == record.notes


def test_examples_and_the_coach_are_plausible():
    paths = sorted((ROOT / "examples").glob("*.toml"))
    loaded = [wt.load(path) for path in paths if "over" not in path.read_text(encoding="utf-8")]
    scenarios = [one for one in (getattr(one, "passage", one) for one in loaded) if one is not None]
    assert len(scenarios) >= 7
    scenarios += [
        wt.Scenario(vehicle=wt.Wagon.erri_b176(series_springs=series), speed=55, duration=60)
        for series in (True, False)
    ]
    scenarios += [scene(track=wt.tracks.Ballasted.named(name)) for name in track_names()]
    assert [note for scenario in scenarios for note in implausible_notes(scenario)] == []


def test_the_table_names_fields_that_exist_and_usual_numbers_are_plausible():
    for kind, fields in USUAL.items():
        assert set(fields) <= set(nouns_by_name()[kind].model_fields)
        for usual in fields.values():
            assert usual.unit in UNITS[usual.dimension]
            assert usual.dimension == "number" or si_unit(usual.dimension)
            assert all(low < high for low, high, _ in usual.mixups)
            assert not any(
                low <= usual.usual[0] <= high or low <= usual.usual[1] <= high for low, high, _ in usual.mixups
            )
            assert usual.least <= usual.usual[0] / 10 < usual.usual[1] * 1.9 <= usual.most


@pytest.mark.parametrize("field", ["stiffness", "damping"])
def test_a_suspension_that_would_need_ever_smaller_steps_is_refused(field):
    with pytest.raises(wt.InputError, match=rf"^{field}: found 1e\+20 N.*at most 1\.5e\+"):
        wt.Wheelset(mass=1500, load=9e4, **{field: 1e20})


@pytest.mark.parametrize(
    ("irregularity", "track", "large", "told"),
    [
        (wt.WheelFlat(length="40 mm", position=0.1), wt.StiffTrack(), True, True),
        (wt.Step(height="0.3 mm", position=0.1), wt.StiffTrack(), True, True),
        (wt.WheelFlat(length="2 mm", position=0.1), wt.StiffTrack(), False, False),
        (wt.CosineBump(height="0.5 mm", length="60 mm", start=0.05), wt.StiffTrack(), True, False),
        (wt.WheelFlat(length="40 mm", position=0.1), wt.FloatingDeck(mass=15_000, stiffness=1.5e7), True, False),
    ],
)
def test_large_forces_at_a_kink_of_a_rigid_track_say_that_it_is_rigid(irregularity, track, large, told):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        record = wt.simulate(scene(irregularity=irregularity, track=track, speed=8.3, duration=0.05))
    assert sum("the track is rigid" in note for note in record.notes) == told
    assert (float(record.peaks.normal_force.max()) > 2.5 * record.static_force) == large


@pytest.mark.slow
def test_the_line_of_a_record_says_whose_force_it_is():
    coach = wt.Scenario(vehicle=wt.Wagon.erri_b176(), irregularity=BUMP, speed=20, duration=0.01)
    assert "kN per wheelset)" in str(wt.simulate(scene()))
    assert "kN per wheel)" in str(wt.simulate(coach))


def test_a_sweep_doubts_the_implausible_values_of_its_axes_and_of_what_its_cells_share():
    shared = scene(**wheelset(load=22.5))
    with pytest.warns(ModelWarning) as caught:
        chart = wt.sweep(shared, {"vehicle.mass": [1.4, 1500, 1600], "speed": [4.0, 5.0]}, ["force_ratio"])
    told = [str(one.message) for one in caught if "implausible" in str(one.message)]
    assert [text.split(" is ")[0] for text in told] == ["vehicle.load = 22.5 N", "vehicle.mass = 1.4 kg"]
    assert "the worst of 2 such cells of 6" in told[1]
    assert all(text in chart.attrs["notes"] for text in ("vehicle.mass = 1.4 kg", "vehicle.load = 22.5 N"))


def test_each_number_of_a_field_is_judged_where_several_vary():
    round_about = scene(irregularity=wt.OutOfRound(orders=(1, 3), amplitudes=(1e-4, 1e-4)))
    for doubted, plain in ((0, 1), (1, 0)):
        path = "irregularity.0.amplitudes.{}".format
        changed = {path(doubted): np.array([0.3, 0.4]), path(plain): np.array([1e-4, 2e-4])}
        (note,) = implausible_cells(round_about, dict(sorted(changed.items())), 2)
        assert note.note.startswith(f"{path(doubted)} = 0.4 m is implausible")


def test_a_sweep_over_plausible_values_says_nothing_of_an_implausible_one_that_no_cell_has():
    chart = wt.sweep(scene(speed=250), {"speed": [4.0, 5.0]}, ["force_ratio"])
    assert "implausible" not in chart.attrs["notes"]
