"""Implausible numbers are doubted in one note each; what people compute is not."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.noun import nouns_by_name
from wheeltapper.describe.track.published import track_names
from wheeltapper.ground.quantities import UNITS, si_unit
from wheeltapper.lower.plausible import USUAL, implausible_cells, implausible_notes
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
        record = wt.simulate(scene(irregularity=wt.WheelFlat(depth=0.1, position=0.1)))
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
            assert si_unit(usual.dimension)
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
