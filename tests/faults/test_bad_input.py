"""Bad input: one clear message that names file, field, what was found and what is allowed; exit code 2."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.faces.cli import main
from wheeltapper.record.simulate import ModelWarning

GOOD = """
speed = 5.0
duration = 0.05
[vehicle]
type = "Wheelset"
mass = 1500
load = 91307
[contact]
type = "Hertz"
constant = 1.405e11
[[irregularity]]
type = "WheelFlat"
depth = "0.1 mm"
position = 0.05
"""
MEASURED = 'type = "Measured"\npath = "profile.csv"'


def refused(tmp_path, capsys, text, *parts):
    file = tmp_path / "scene.toml"
    file.write_text(text, encoding="utf-8")
    assert main(["run", str(file)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "Traceback" not in message
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("speed = 5.0", "speeed = 5.0", ("'speeed'", "did you mean 'speed'")),
        ("depth =", "dept =", ("irregularity.0", "'dept'", "depth, length, position")),
        ('"0.1 mm"', '"5 kg"', ("irregularity.0.depth", "'5 kg'", "not a length", "mm")),
        ("mass = 1500", "mass = -1500", ("vehicle.mass", "-1500", "greater than 0")),
        ("mass = 1500", 'mass = "nan"', ("vehicle.mass",)),
        ("speed = 5.0", "speed = 0.0", ("speed", "irregularity", "drop test")),
        ("speed = 5.0", "speed = -1.0", ("speed", "-1")),
        ("duration = 0.05", "duration = 0", ("duration", "greater than 0")),
        ("constant = 1.405e11", "constant = 1e11\nconstant_per_wheel = 5e10", ("constant_per_wheel", "one of them")),
        ("position = 0.05", 'position = 0.05\nlength = "20 mm"', ("depth and length",)),
        ('"WheelFlat"', '"WheelFlatt"', ("WheelFlatt", "WheelFlat", "CosineBump")),
        (GOOD, "", ("empty",)),
        (GOOD, "speed = = 5", ("not TOML",)),
        ("speed = 5.0", "format = 99\nspeed = 5.0", ("format", "99")),
    ],
)
def test_a_wrong_scenario_is_refused_with_one_message(tmp_path, capsys, old, new, parts):
    refused(tmp_path, capsys, GOOD.replace(old, new), *parts)


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (b"x [m],y [mm]\n0,0\n0.1,nan\n0.2,0\n0.3,0\n", ("line 3", "nan", "finite")),
        (b"0,0\n0.2,0\n0.1,0\n0.3,0\n", ("line 3", "out of order")),
        (b"0,0\n0.1,0\n0.1,0\n0.3,0\n", ("line 3", "doubled")),
        (b"", ("empty file",)),
        (b"\x93\xfe\x00\x01", ("not text",)),
        (b"\xff\xfe\x00\x01", ("no line of numbers",)),  # a letter in UTF-16
        (b"1,5,0,01\n2,5,0,02\n3,5,0,9\n4,5,0,0\n", ("line 1", "'1,5,0,01'", "decimal commas")),
        (b"1,0,5\n2,05,1\n", ("line 1",)),
        (b"1,05\n2,10\n3,15\n4,20\n", ("line 1", "'1,05'", "decimal commas")),
        (b"1,500;2,300\n2,500;2,300\n3,500;2,300\n4,500;1,700\n", ("line 1", "thousands")),
        (b"x [m];z [mm]\n1,500;0.01\n2,500;0.02\n3,500;0.03\n", ("line 2, x", "'1,500'", "follow a point")),
        (b"x [m];z\n0;0\n1;0\n2;0\n3;0\n", ("line 1, header", "no unit of 'z', and m of 'x'", "[mm]")),
        (b"x [m];z [deg]\n0;0\n1;0\n2;0\n3;0\n", ("line 1, header", "'deg' of 'z'", "a unit of length")),
        (b"Km;z\n0;0\n1;0\n2;0\n3;0\n", ("line 1, header", "'Km', which is like the unit km", "'x [km]' or 'x [m]'")),
        (b"station KM;z\n0;0\n1;0\n2;0\n3;0\n", ("line 1, header", "'station KM'", "a unit in brackets")),
        (b"# all in mm\nx;z\n0;0\n1;0\n2;0\n3;0\n", ("line 1", "the unit mm in 'all in mm'", "header")),
        (b"No;x [m];z [m]\n0;0;1\n1;1;0\n2;2;0\n3;3;0\n", ("columns", "3 columns", "No, x, z")),
        (b"x [m],z [m]\n0,0\n1,0,0\n2,0\n3,0\n", ("line 3", "3 values", "allowed: 2")),
        (b"0,0\n0.1,zero\n0.2,0\n0.3,0\n", ("line 2", "zero", "number")),
        (b"0,0\n0.1,0\n", ("2 samples", "at least 4")),
        (b"x [kg],y [mm]\n0,0\n0.1,0\n0.2,0\n0.3,0\n", ("kg",)),
        (b"0,0\n0.01,0\n0.02,0\n0.03,0\n0.04,0\n0.9,0\n", ("line 6", "gap")),
        (b"0,0\n0.05,0\n0.1,0\n0.15,0\n0.2,0\n", ("0.2 m", "0.25 m", "flat")),
    ],
)
def test_a_wrong_profile_is_refused_with_its_line(tmp_path, capsys, content, parts):
    (tmp_path / "profile.csv").write_bytes(content)
    text = GOOD.split("[[irregularity]]")[0] + "[[irregularity]]\n" + MEASURED
    refused(tmp_path, capsys, text, "profile.csv" if b"0.15" not in content else "irregularity.0", *parts)


def test_what_lies_beyond_a_profile_may_be_stated(tmp_path, capsys):
    (tmp_path / "profile.csv").write_text("0,0\n0.05,0\n0.1,0.00001\n0.15,0\n0.2,0\n", encoding="utf-8")
    file = tmp_path / "scene.toml"
    file.write_text(
        GOOD.split("[[irregularity]]")[0] + "[[irregularity]]\n" + MEASURED + '\nbeyond = "flat"', encoding="utf-8"
    )
    assert main(["run", str(file)]) == 0


@pytest.mark.parametrize("target", ["missing_folder/record.nc", "record.foo"])
def test_an_output_that_cannot_be_written_is_found_before_the_run(tmp_path, capsys, monkeypatch, target):
    file = tmp_path / "scene.toml"
    file.write_text(GOOD, encoding="utf-8")
    monkeypatch.setattr("wheeltapper.record.simulate.simulate", lambda *_: pytest.fail("the run was started"))
    assert main(["run", str(file), "--output", str(tmp_path / target)]) == 2
    assert "--output" in capsys.readouterr().err


def test_a_missing_file_and_an_unknown_method(tmp_path, capsys):
    assert main(["run", str(tmp_path / "none.toml")]) == 2
    assert "No such file" in capsys.readouterr().err
    file = tmp_path / "scene.toml"
    file.write_text(GOOD, encoding="utf-8")
    assert main(["run", str(file), "--method", "quick"]) == 2
    assert "'quick'" in capsys.readouterr().err


def test_a_dip_sharper_than_the_wheel_is_a_warning_with_the_number():
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, radius=0.46),
        contact=wt.Hertz(constant=1.405e11),
        irregularity=wt.CosineBump(height=-1e-4, length=0.02, start=0.05),
        rolling="point",
        speed=5.0,
        duration=0.02,
    )
    with pytest.warns(ModelWarning, match="radius 202.6 mm"):
        wt.simulate(scene)


def test_mistakes_in_python_name_the_field():
    scene = wt.Scenario(vehicle=wt.Wheelset(mass=1500, load=9e4), contact=wt.Hertz(), speed=0, duration=0.01)
    with pytest.raises(wt.InputError, match=r"mas.*did you mean 'mass'"):
        scene.replaced({"vehicle.mas": 1})
    with pytest.raises(wt.InputError, match="times"):
        wt.simulate(scene).at(np.array([1.0]))
    with pytest.raises(wt.InputError, match=r".foo"):
        wt.load("record.foo")


def test_samples_over_more_than_a_wheel_s_circumference_are_refused():
    places = tuple(np.linspace(0.0, 4.0, 50))
    wheel = wt.OutOfRound(places=places, deviations=(1e-5,) * 50)
    scene = wt.Scenario(vehicle=wt.Wheelset(mass=1500, load=9e4), irregularity=wheel, speed=5, duration=0.01)
    with pytest.raises(wt.InputError, match="irregularity: found samples over 4 m; allowed: at most one revolution"):
        wt.simulate(scene)
