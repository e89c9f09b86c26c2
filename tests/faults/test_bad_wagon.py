"""Bad input about wagons: one clear message, exit code 2; a wheel off the rails is an outcome, with its time."""

import numpy as np
import pytest

import wheeltapper as wt
from tests.faults.test_bad_input import refused
from wheeltapper.faces.cli import main

COACH = """
speed = 5.0
duration = 0.02
[vehicle]
type = "ErriB176"
[contact]
type = "Hertz"
[creep]
type = "Polach"
[[irregularity.right]]
type = "Step"
height = "0.1 mm"
position = 0.05
"""
OWN = """
speed = 5.0
duration = 0.02
[vehicle]
type = "Wagon"
[[vehicle.bodies]]
name = "body"
mass = 10e3
inertia = [5e3, 5e3, 5e3]
position = [0.0, 0.0, 1.0]
[[vehicle.axles]]
mass = 1500
inertia = [1120, 112, 1120]
position = 0.0
[[vehicle.elements]]
type = "Spring"
name = "spring"
between = ["body", "wheelset 1"]
at = [0.0, 0.0, 0.5]
stiffness = [1e7, 1e7, 1e6]
bending = [1e6, 1e6, 1e6]
[profiles]
type = "WheelRail"
"""


COMMON = 'name = "it"\nbetween = ["body", "wheelset 1"]\nat = [0.0, 0.0, 0.5]\n'
LAW = 'type = "Damper"\nalong = "z"\n'


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('"Polach"', '"Polack"', ("creep.type", "Polack", "Polach")),
        ('type = "Polach"', 'type = "Polach"\nfriction = -0.1', ("creep.friction", "greater than 0")),
        ("irregularity.right", 'irregularity."wheelset 5"', ("wheelset 5", "1 to 4")),
        ("irregularity.right", "irregularity.rihgt", ("rihgt", "left")),
        ('type = "Hertz"', 'type = "Hertz"\nconstant = 1e11', ("contact.constant", "constant_per_wheel")),
        ('type = "Hertz"', 'type = "Hertz"\nhysteresis = -0.2', ("contact.hysteresis", "greater than or equal to 0")),
        ("speed = 5.0", "speed = 5.0\nstart = {hight = 0.001}", ("start", "hight")),
        ('"ErriB176"', '"ErriB176"\nwithout = ["damper 9"]', ("vehicle.elements", "damper 9", "primary spring 1 left")),
        ('"ErriB176"', '"ErriB176"\nwheelset_mass = -3', ("vehicle.wheelset_mass", "greater than 0")),
    ],
)
def test_a_wrong_coach_is_refused(tmp_path, capsys, old, new, parts):
    refused(tmp_path, capsys, COACH.replace(old, new), *parts)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('["body", "wheelset 1"]', '["wheelset 1", "ground"]', ("bodies", "'body'", "without a connection")),
        ('["body", "wheelset 1"]', '["bodi", "wheelset 1"]', ("elements", "'bodi'", "body, wheelset 1, ground")),
        ("inertia = [5e3, 5e3, 5e3]", "inertia = [5e3, -5e3, 5e3]", ("vehicle.bodies.0.inertia.1", "greater than 0")),
        ("stiffness = [1e7, 1e7, 1e6]", "stiffness = [1e7, 1e7, 0]", ("'body'", "in z", "hold every body")),
        ("bending = [1e6, 1e6, 1e6]", "", ("'body'", "nothing that holds", "hold every body")),
        ('"WheelRail"', '"WheelRail"\ngauge = 1.0', ("profiles", "gauge", "1 m", "flanges")),
        ('"WheelRail"', '"WheelRail"\ngauge = 1.6', ("profiles", "gauge", "1.6 m")),
        ('"WheelRail"', '"WheelRail"\nwheel = "nowhere.prw"', ("nowhere.prw", "no such file")),
        ('"WheelRail"', '"WheelRail"\nwheel = "rail.txt"', ("rail.txt", "wheel")),
        ('"WheelRail"', '"WheelRail"\nrail = "metres.txt"', ("metres.txt", "metres")),
        ("mass = 1500", "mass = 1500\nload = -2e5", ("wheelset 1", "static load", "carry")),
        *(
            ("[profiles]", f"[[vehicle.elements]]\n{COMMON}{fields}\n[profiles]", ("vehicle.elements.1", *parts))
            for fields, *parts in (
                ('type = "Friction"\nalong = "z"\nforce = 0', "force", "greater than 0"),
                ('type = "Friction"\nalong = "up"\nforce = 100', "along", "'x', 'y', 'z'"),
                ('type = "Friction"\nalong = "z"\nforce = 100\nstatic_force = 90', "static_force", "90 N", "100 N"),
                ('type = "Damper"', "damping", "none of them", "damping, or along, rate and force"),
                ('type = "Damper"\ndamping = [0, 0, 1]\nalong = "z"', "damping, along", "or along, rate and force"),
                (f"{LAW}rate = [0, 1]\nforce = [0, 1, 2]", "2 rates and 3 forces", "as many of both"),
                (f"{LAW}rate = [0, 2, 1]\nforce = [0, 1, 2]", "rate", "strictly rising"),
                (f"{LAW}rate = [1, 2]\nforce = [1, 2]", "rate", "does not pass through zero", "rate 0 with force 0"),
                (f"{LAW}rate = [0, 1, 2]\nforce = [0, 2, 1]", "force", "do not rise", "ones that do not fall"),
                (f"{LAW}rate = [0, 1, 2]\nforce = [0, 1, 1]\nseries_stiffness = 1e7", "force", "rising ones"),
            )
        ),
    ],
)
def test_a_wrong_vehicle_or_profile_is_refused(tmp_path, capsys, old, new, parts):
    from wheeltapper.describe.profile.rail_60e1 import rail_60e1

    y = np.linspace(-36, 36, 300)
    rows = np.column_stack([y, rail_60e1(y)])
    np.savetxt(tmp_path / "rail.txt", rows[np.isfinite(rows).all(axis=1)])
    np.savetxt(tmp_path / "metres.txt", 1e-3 * rows[np.isfinite(rows).all(axis=1)])
    assert old in OWN
    refused(tmp_path, capsys, OWN.replace(old, new), *parts)


def test_the_unharmed_vehicles_run(tmp_path):
    for name, text in (("coach", COACH), ("own", OWN)):
        file = tmp_path / f"{name}.toml"
        file.write_text(text, encoding="utf-8")
        assert main(["run", str(file)]) == 0


@pytest.mark.slow
def test_a_wheel_off_the_rails_is_an_outcome_with_its_time(tmp_path, capsys):
    axle = wt.vehicles.Axle(mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0, load=9e4)
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=(), axles=(axle,)),
        contact=wt.Hertz(constant_per_wheel=7e10),
        creep=wt.creep.Polach(),
        profiles=wt.profiles.Cones(conicity=0.2),
        irregularity={"left": wt.CosineBump(height=2e-3, length=1.0, start=1.0)},
        speed=30.0,
        duration=5.0,
    )
    record = wt.simulate(scene)
    assert record.outcome.name == "DERAILED"
    assert 0.1 < record.end < 5.0
    assert "left the rails" in str(record)
    last = record.at([record.end]).lateral_shift
    assert 0.010 < float(np.abs(last).max()) < 0.012
    scene.to_toml(tmp_path / "scene.toml")
    assert main(["run", str(tmp_path / "scene.toml"), "--output", str(tmp_path / "kept.nc")]) == 3
    assert "left the rails" in capsys.readouterr().err
    assert wt.load(tmp_path / "kept.nc").end == record.end


def test_sides_and_creep_are_for_wagons_only():
    wheelset = {"mass": 1500, "load": 9e4, "stiffness": 0, "damping": 0, "radius": 0.46, "type": "Wheelset"}
    base = {"vehicle": wheelset, "speed": 5, "duration": 0.1}
    step = {"type": "Step", "height": 1e-4, "position": 0.1}
    for more, said in (
        ({"irregularity": {"left": step}}, '\'left\'; allowed: "both", "wheelset 1"'),
        ({"creep": {"type": "Polach"}}, "Wagon"),
    ):
        with pytest.raises(wt.InputError, match=said):
            wt.Scenario.of(base | more)


def test_elastic_constants_beside_a_given_constant_shape_creep_on_a_wagon_only():
    contact = {"type": "Hertz", "constant_per_wheel": 7e10, "poisson": 0.28}
    wheelset = {"type": "Wheelset", "mass": 1500, "load": 9e4, "stiffness": 0, "damping": 0, "radius": 0.46}
    with pytest.raises(wt.InputError, match="one or the other"):
        wt.Scenario.of({"vehicle": wheelset, "contact": contact, "speed": 5, "duration": 0.1})
    forces = []
    for poisson in (0.28, 0.3):
        scene = wt.Scenario.of({
            "vehicle": {"type": "ErriB176", "wheelset_mass": 1500}, "contact": contact | {"poisson": poisson},
            "creep": {"type": "Polach", "friction": 0.35}, "speed": 5, "duration": 0.001,
        })  # fmt: skip
        forces.append(float(wt.simulate(scene).at([0.0]).lateral_force.sel(wheelset=1, side="left")[0]))
    # -1812 N of the normal force and 1514 N of spin (docs/theory/wagon.rst, section 7.6)
    assert forces[0] == pytest.approx(-298.0, abs=2.0)
    assert forces[1] < forces[0] - 15.0


def test_an_irregularity_under_a_wheel_at_the_start_is_blamed_and_not_the_vehicle():
    fields = {"vehicle": wt.Wagon.erri_b176(), "contact": wt.Hertz(), "speed": 20.0, "duration": 0.02}
    for place, position, where in (("left", -0.1, "1 left, at x = 0 m"), ("wheelset 3 right", -19.1, "3 right")):
        step = wt.Step(height=0.05, position=position)
        scene = wt.Scenario(**fields, creep=wt.creep.Polach(friction=0.35), irregularity={place: step})
        with pytest.raises(wt.InputError) as caught:
            wt.simulate(scene)
        assert caught.value.field == "irregularity"
        assert f"50 mm under wheelset {where}" in caught.value.found
        assert "ahead of the wheels" in caught.value.allowed
