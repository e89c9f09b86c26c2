"""Nouns complain in one line, whether they are made in Python, inside another noun, or from a file."""

import copy
import pickle

import numpy as np
import pint
import pytest

import wheeltapper as wt
from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.noun import nouns_by_name
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.vehicle.base import Vehicle


def listed(family):
    return ", ".join(repr(kind.__name__) for kind in makeable_nouns(family))


V = wt.vehicles
WHEELSET = wt.Wheelset(mass=1500, load=91_307)
ONE = wt.Wheelset(mass=1500, wheels=1)
TWO = {"wheelsets": (WHEELSET, WHEELSET), "positions": (0, -2)}
BOGIE = V.Bogie.example
ENDS = {"name": "a", "between": ("frame", "ground"), "at": (0, 0, 0)}
BODY = {"name": "frame", "mass": 1000, "inertia": (1, 1, 1), "position": (0, 0, 1)}
AXLE = {"mass": 1500, "inertia": (1, 1, 1), "position": 0}
SCENE = {"vehicle": WHEELSET, "speed": 5, "duration": 0.1}
BUMP = {"height": 1e-4, "length": 0.05, "start": 0.1}
WRONG = [
    (wt.Wheelset, {"mass": -1}, "mass: found -1; allowed: greater than 0"),
    (wt.Wheelset, {"mas": 1500}, "mas: found the unknown name 'mas'; allowed: mass, load"),
    (wt.Wheelset, {"mas": 1500}, "(did you mean 'mass'?)"),
    (wt.Wheelset, {}, "mass: found nothing; allowed: a value, which is required here"),
    (wt.Wheelset, {"mass": "1500 mm"}, "mass: found '1500 mm', which is not a mass; allowed: a mass"),
    (wt.Wheelset, {"mass": 1500, "gravity": 0}, "found load + mass·gravity = 0 N; allowed: more than 0 N"),
    (wt.Wheelset, {"mass": 1500, "wheels": 1.5}, "wheels: found 1.5; allowed: a valid integer"),
    (wt.Scenario, SCENE | {"speed": -1}, "speed: found -1 m/s; allowed: 0 m/s or more"),
    (wt.Scenario, SCENE | {"track": 5}, f"track: found 5; allowed: {listed(Track)}"),
    (wt.Scenario, SCENE | {"contact": len}, f"contact: found <built-in function len>; allowed: {listed(Contact)}"),
    (wt.Scenario, SCENE | {"vehicle": {"type": "Wheelset", "mass": -1}}, "vehicle.mass: found -1; allowed: greater"),
    (wt.Scenario, SCENE | {"vehicle": {"type": "Wheelst"}}, f"type: found 'Wheelst'; allowed: {listed(Vehicle)}"),
    (wt.Scenario, SCENE | {"vehicle": {"type": ["x"]}}, f"vehicle.type: found ['x']; allowed: {listed(Vehicle)}"),
    (wt.Scenario, SCENE | {"vehicle": {}}, "vehicle.type: found nothing; allowed: the type of the noun"),
    (wt.Scenario, SCENE | {"rolling": "cirle"}, "allowed: 'circle' or 'point' (did you mean 'circle'?)"),
    (wt.Scenario, SCENE | {"irregularity": {"left": 5}}, f"left.0: found 5; allowed: {listed(Irregularity)}"),
    (V.Wheelsets, {"wheelsets": (), "positions": ()}, "wheelsets: found 0 values; allowed: at least 1"),
    (V.Wheelsets, {"wheelsets": (WHEELSET,), "positions": (0, -2)}, "positions: found 2 values; allowed: 1, one a"),
    (V.Wheelsets, {"wheelsets": (WHEELSET,), "positions": (1,)}, "positions.0: found 1 m; allowed: 0 m, the leading"),
    (V.Wheelsets, TWO | {"positions": (0, "2 m")}, "positions.1: found 2 m; allowed: less than 0 m, behind"),
    (V.Wheelsets, TWO | {"positions": (0, 0)}, "positions.1: found 0 m; allowed: less than 0 m, behind"),
    (V.Wheelsets, TWO | {"wheelsets": (WHEELSET, {"mass": 0})}, "wheelsets.1.mass: found 0; allowed: greater than 0"),
    (V.Wheelsets, TWO | {"wheelsets": (WHEELSET, ONE)}, "wheelsets: found wheels = [2, 1]; allowed: the same number"),
    (V.Bogie, BOGIE | {"wheelbase": 0}, "wheelbase: found 0; allowed: greater than 0"),
    (V.Bogie, BOGIE | {"primary_damping": -1}, "primary_damping: found -1; allowed: greater than or equal to 0"),
    (V.Bogie, BOGIE | {"wheel_load": "10 t"}, "wheel_load: found '10 t', a mass where a force is needed"),
    (V.Bogie, BOGIE | {"wheels": 0}, "wheels: found 0; allowed: greater than or equal to 1"),
    (wt.Wagon, {"bodies": 5, "axles": ()}, "bodies: found 5; allowed: a list"),
    (wt.Wagon, {"bodies": (), "axles": ()}, "axles: found 0 values; allowed: at least 1"),
    (wt.Wagon, {"bodies": (), "axles": (WHEELSET,)}, "axles.0: found Wheelset(mass=1500.0"),
    (wt.Wagon, {"bodies": (), "axles": (AXLE | {"radius": 0},)}, "axles.0.radius: found 0; allowed: greater than 0"),
    (wt.Wagon, {"bodies": (BODY,), "axles": (AXLE,), "elements": 5}, "elements: found 5; allowed: a list"),
    (wt.Wagon, {"bodies": (BODY,), "axles": (AXLE,)}, "bodies: found 'frame' without a connection"),
    (V.Body, BODY | {"inertia": (1, 1)}, "inertia.2: found nothing; allowed: a value"),
    (V.Body, BODY | {"name": ""}, "name: found ''; allowed: at least 1 character"),
    (V.Body, BODY | {"held": ("z", "rol")}, "held.1: found 'rol'; allowed: 'x', 'y', 'z', 'roll', 'pitch' or 'yaw'"),
    (V.Axle, AXLE | {"mass": float("nan")}, "mass: found nan; allowed: a finite mass"),
    (V.Spring, ENDS | {"between": ("frame",)}, "between.1: found nothing"),
    (V.Spring, ENDS | {"between": ("a", "a")}, "between: found 'a' twice; allowed: two bodies"),
    (V.Damper, ENDS | {"damping": (0, 0, -1)}, "damping.2: found -1; allowed: greater than or equal to 0"),
    (V.Stop, ENDS | {"along": "y", "deflection": (0, 1), "force": (0,)}, "force: found 1 values; allowed: at least 2"),
    (V.Link, ENDS | {"along": ()}, "along: found 0 values; allowed: at least 1"),
    (V.ErriB176, {"dampers": "maybe"}, "dampers: found 'maybe'; allowed: a valid boolean"),
    (wt.FloatingDeck, {"mass": 1, "stiffness": 1, "length": 1}, "found a length without a start; allowed: both"),
    (wt.StiffTrack, {"mass": 1}, "mass: found the unknown name 'mass'"),
    (wt.Hertz, {"constant": 1e11, "constant_per_wheel": 1e11}, "found both constant and constant_per_wheel; allowed"),
    (wt.Hertz, {"restitution": 1.5, "impact_speed": 1}, "restitution: found 1.5; allowed: less than or equal to 1"),
    (wt.Linear, {"stiffness": 0}, "stiffness: found 0; allowed: greater than 0"),
    (wt.contact.Thornton, {"yield_force": 1, "hardness": 1}, "found yield_force and hardness; allowed: one of them"),
    (wt.contact.Stronge, {"poisson": 0.5}, "poisson: found 0.5; allowed: less than 0.5"),
    (wt.creep.Polach, {"friction": 0}, "friction: found 0; allowed: greater than 0"),
    (wt.profiles.Cones, {"conicity": 2}, "conicity: found 2; allowed: less than 1"),
    (wt.profiles.WheelRail, {"smoothing": "1 cm"}, "smoothing: found 0.01 m; allowed: 0.1 µm to 1 mm"),
    (wt.CosineBump, BUMP | {"length": -1}, "length: found -1; allowed: greater than 0"),
    (wt.Corrugation, {"amplitude": 1, "wavelength": 1, "start": 1, "end": 0}, "found end 0 m; allowed: more than"),
    (wt.WheelFlat, {"position": 0}, "found neither depth nor length; allowed: one of them"),
    (wt.OutOfRound, {"orders": (1,)}, "found 0 amplitudes for 1 orders; allowed: one for each"),
    (wt.Measured, {}, "found neither or both of path and positions with heights"),
    (wt.Profile, {"function": 5}, "function: found 5; allowed: callable"),
    (
        wt.Measured, {"positions": (0, 1), "heights": (0, 0), "columns": (0, 1)},
        "columns: found (0, 1), which does nothing without a path; allowed: no columns",
    ),
    (
        wt.OutOfRound, {"orders": (1,), "amplitudes": (1e-4,), "noise": 1e-6},
        "noise: found 1e-06, which does nothing beside orders; allowed: no noise",
    ),
    (
        wt.irregularities.Spectrum, {"curve": "ISO 3095:2013", "deviation_band": (0.1, 0.2)},
        "deviation_band: found (0.1, 0.2), which does nothing without a deviation",
    ),
    (wt.Repeated, {"of": 5, "period": 1}, "of: found 5; allowed: an irregularity of the rail"),
    (wt.Repeated, {"of": {"type": "CosineBmp"}, "period": 1}, "of.type: found 'CosineBmp'; allowed: Corrugation, Cos"),
    (wt.Repeated, {"of": BUMP | {"type": "CosineBump", "length": 0}, "period": 1}, "of.length: found 0; allowed: "),
    (wt.diagnosis.Sensor, {"bits": 3}, "bits: found 3; allowed: greater than or equal to 4"),
    (wt.diagnosis.Sensor, {"rat": 3}, "(did you mean 'rate'?)"),
    (wt.diagnosis.Site, {"passage": WHEELSET}, "passage: found Wheelset(mass=1500.0"),
    (wt.diagnosis.Site, {"passage": SCENE}, "passage.track: found a stiff track, which `diagnose` does not take"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "fields", "said"), WRONG, ids=lambda value: getattr(value, "__name__", None))
def test_a_constructor_complains_in_one_line(kind, fields, said):
    with pytest.raises(wt.InputError) as caught:
        kind(**fields)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).count("found ") == 1
    with pytest.raises(ValueError, match="found") as validated:
        kind.model_validate(fields)
    assert str(validated.value) == str(caught.value)


@pytest.mark.parametrize("kind", nouns_by_name().values(), ids=nouns_by_name())
def test_every_noun_refuses_unknown_names_and_values_without_one(kind):
    with pytest.raises(wt.InputError, match=r"^no_such: found the unknown name 'no_such'; allowed:"):
        kind(no_such=1)
    with pytest.raises(wt.InputError, match="found 5 without a name"):
        kind(*[None] * len(kind._leading), 5)


def test_a_file_and_python_say_the_same(tmp_path):
    file = tmp_path / "scene.toml"
    text = 'speed = 5\nduration = 0.1\n[vehicle]\ntype = "Wheelset"\nmass = 1500\ndampign = 1'
    file.write_text(text, encoding="utf-8")
    with pytest.raises(wt.InputError) as read:
        wt.load(file)
    table = {"type": "Wheelset", "mass": 1500, "dampign": 1}
    with pytest.raises(wt.InputError) as made:
        wt.Scenario(**SCENE | {"vehicle": table})
    assert str(read.value) == f"{file}: {made.value}"
    assert made.value.field == "vehicle.dampign"
    assert "did you mean 'damping'" in made.value.allowed


def test_of_several_errors_the_misspelt_name_is_told_and_then_the_first():
    with pytest.raises(wt.InputError, match=r"^dampign: "):
        wt.Wheelset(mass=-1, dampign=1)
    with pytest.raises(wt.InputError, match=r"^mass: "):
        wt.Wheelset(mass=-1, radius=-1)


def test_a_noun_never_changes_and_survives_copies():
    with pytest.raises(wt.InputError, match=r"mass: found a new value.*Scenario\.replaced"):
        WHEELSET.mass = 1600
    assert WHEELSET.mass == 1500
    scene = wt.Scenario(**SCENE)
    for one in (pickle.loads(pickle.dumps(scene)), copy.copy(scene), copy.deepcopy(scene), scene.model_copy()):
        assert one == scene


def test_a_scenario_with_a_function_is_not_written(tmp_path):
    scene = wt.Scenario(**SCENE | {"irregularity": wt.Profile(function=np.sin)})
    with pytest.raises(wt.InputError, match="a Profile, which holds a Python function"):
        scene.to_toml(tmp_path / "scene.toml")


Q = pint.UnitRegistry().Quantity


@pytest.mark.parametrize(
    ("field", "given", "si"),
    [
        ("mass", Q(1.5, "t"), 1500.0),
        ("mass", np.float32(1500), 1500.0),
        ("mass", np.int64(1500), 1500.0),
        ("mass", np.array(1500.0), 1500.0),
        ("load", Q(91.307, "kN"), 91_307.0),
        ("radius", Q(46, "cm"), 0.46),
        ("stiffness", Q(2.44, "kN/mm"), 2.44e6),
        ("damping", "8 kN s/m", 8e3),
        ("gravity", Q(1, "standard_gravity"), 9.80665),
    ],
)
def test_quantities_and_numbers_of_other_packages_are_taken(field, given, si):
    assert getattr(wt.Wheelset(**{"mass": 1500, field: given}), field) == pytest.approx(si, rel=1e-14)


def test_units_of_pint_are_loaded_once(monkeypatch):
    """They take half a second."""
    loaded, make = [], pint.UnitRegistry
    monkeypatch.setattr(pint, "UnitRegistry", lambda: loaded.append(1) or make())
    for length in ("18 inches", "1.5 feet", "18 apples"):
        try:
            assert wt.Wheelset(mass=1500, radius=length).radius == pytest.approx(0.4572)
        except wt.InputError:
            assert length == "18 apples"
    assert len(loaded) <= 1


def test_speeds_in_words_of_the_trade_are_understood():
    for given in ("120 km/h", "120 kmh", "120 kph", Q(120, "km/h")):
        assert wt.Scenario(**SCENE | {"speed": given}).speed == pytest.approx(120 / 3.6, rel=1e-14)


@pytest.mark.parametrize(
    ("field", "given", "parts"),
    [
        ("mass", Q(1.5, "m"), ("mass: found '1.5 meter', whose unit is not one of mass", "kg, t")),
        ("mass", Q([1.5, 2], "t"), ("mass: found '[1.5 2.0] metric_ton'",)),
        ("load", Q(22.5, "t"), ("load: found '22.5 metric_ton', whose unit is not one of force", "N, ")),
        ("load", "22.5 t", ("load: found '22.5 t', a mass where a force is needed", "22.5 t weigh 220.65 kN")),
        (
            "mass",
            "1.5 tons",
            ("mass: found '1.5 tons', where a ton may be 907, 1000 or 1016 kg; allowed: t of 1000 kg",),
        ),
        ("mass", np.array([[1, 2], [3, 4]]), ("mass: found array([[1, 2], [3, 4]])",)),
        ("mass", 1j, ("mass: found 1j",)),
        ("mass", list(range(1000)), ("mass: found [0, 1, 2", "...; allowed")),
    ],
)
def test_a_wrong_quantity_is_refused_in_one_line(field, given, parts):
    with pytest.raises(wt.InputError) as caught:
        wt.Wheelset(**{"mass": 1500, field: given})
    assert "\n" not in str(caught.value)
    for part in parts:
        assert part in str(caught.value)


def test_quantities_are_taken_where_values_vary():
    from wheeltapper.ask.study import study_of

    scene = wt.Scenario(**SCENE)
    axes = study_of(
        scene, {"speed": [Q(18, "km/h"), "36 km/h"], "vehicle.mass": Q([1.5, 1.6], "t")}, "force_ratio"
    ).axes
    assert [axis.values.tolist() for axis in axes] == [[5.0, 10.0], [1500.0, 1600.0]]
    assert scene.replaced({"vehicle.mass": Q(1.6, "t")}).vehicle.mass == 1600.0
