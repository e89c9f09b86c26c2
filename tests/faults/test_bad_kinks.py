"""Dry friction, bumpstops, corners and blow-off: one clear message for what cannot be, and exit code 2."""

import pytest

import wheeltapper as wt
from wheeltapper.faces.cli import main

GOOD = """
speed = 9.0
duration = 0.02
rolling = "point"
[vehicle]
type = "Wheelset"
mass = 1500
load = 91307
stiffness = "2.44 MN/m"
damping = 5e4
friction = "3 kN"
friction_stiffness = "20 MN/m"
bumpstop_gap = "20 mm"
bumpstop_stiffness = "10 MN/m"
spring_corners = [["-15 mm", "1 MN/m"], [0.01, "4 MN/m"]]
blow_off_force = "5 kN"
blow_off_damping = 1e3
[contact]
type = "Hertz"
constant = 1.405e11
[[irregularity]]
type = "CosineBump"
height = "0.2 mm"
length = "50 mm"
start = "10 mm"
"""
BOGIE = wt.vehicles.Bogie.example


def test_what_is_good_runs(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(GOOD, encoding="utf-8")
    record = wt.simulate(wt.load(path))
    assert [*record.at([0.0]).element.values] == [
        "primary friction 1", "primary bumpstop 1", "primary spring 1", "primary damper 1"
    ]  # fmt: skip
    assert wt.Scenario.from_toml(path).vehicle.spring_corners == ((-0.015, 1e6), (0.01, 4e6))


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('"3 kN"', '"-3 kN"', ("vehicle.friction", "-3 kN", "greater than or equal to 0")),
        ('friction_stiffness = "20 MN/m"\n', "", ("vehicle.friction: ", "3000 N without friction_stiffness", "both")),
        ('"20 MN/m"', '"1e12 N/m"', ("vehicle.friction_stiffness", "1e+12 N/m", "at most 1.5e+11 N/m", "1500 kg")),
        ('"20 MN/m"', "0", ("vehicle.friction_stiffness", "greater than 0")),
        ('bumpstop_gap = "20 mm"\n', "", ("vehicle.bumpstop_stiffness", "1e+07 N/m without bumpstop_gap or rebound")),
        ('bumpstop_stiffness = "10 MN/m"\n', "", ("vehicle.bumpstop_stiffness", "none with bumpstop_gap", "both")),
        ('"20 mm"', '"-20 mm"', ("vehicle.bumpstop_gap", "-20 mm", "greater than 0")),
        ('"-15 mm"', '"15 mm"', ("vehicle.spring_corners", "corners at 0.015, 0.01 m", "rising", "none of them zero")),
        ('"-15 mm"', "0", ("vehicle.spring_corners", "corners at 0, 0.01 m", "none of them zero")),
        ('"1 MN/m"]', '"-1 MN/m"]', ("vehicle.spring_corners.0.1", "greater than or equal to 0")),
        ('"1 MN/m"]', '"1e12 N/m"]', ("vehicle.spring_corners", "at most 1.5e+11 N/m")),
        ("damping = 1e3", "damping = 5e4", ("vehicle.blow_off_force", "= 50000 N·s/m beyond it", "less than the damp")),
        ('blow_off_force = "5 kN"\n', "", ("vehicle.blow_off_damping", "1000 N·s/m without blow_off_force", "both")),
        ("damping = 5e4", "damping = 5e4\nbush_stiffness = 1e8", ("vehicle.blow_off_force", "with bush_stiffness")),
        ('"5 kN"', '"5 kN"\nblow_of_force = 1', ("vehicle.blow_of_force", "did you mean 'blow_off_force'")),
    ],
)  # fmt: skip
def test_a_wrong_suspension_is_refused_with_one_message(tmp_path, capsys, old, new, parts):
    path = tmp_path / "scene.toml"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    assert main(["run", str(path)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"primary_friction": 1e3}, "primary_friction: found 1000 N without primary_friction_stiffness"),
        ({"secondary_blow_off_force": 1e3, "secondary_blow_off_damping": 4e4}, "secondary_blow_off_damping = 40000"),
        ({"secondary_bumpstop_stiffness": 1e7}, "without secondary_bumpstop_gap or secondary_rebound_gap"),
    ],
)
def test_so_is_that_of_a_bogie(fields, text):
    with pytest.raises(wt.InputError, match=text):
        wt.vehicles.Bogie(**BOGIE, **fields)
