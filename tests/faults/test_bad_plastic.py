"""Elastic-plastic contacts and wear: one clear message for what cannot be, exit code 2, and nothing lost."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.faces.cli import main

GOOD = """
speed = 9.0
duration = 0.05
rolling = "point"
[vehicle]
type = "Wheelset"
mass = 1500
load = 91307
[contact]
type = "Thornton"
constant = 1.405e11
yield_force = "212 kN"
[[irregularity]]
type = "Corrugation"
amplitude = "-50 um"
wavelength = "50 mm"
start = "10 mm"
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(GOOD, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('"212 kN"', '"212 kN"\nhardness = "2.5 GPa"', ("contact", "yield_force and hardness", "one of them")),
        ('"212 kN"', '"-1 kN"', ("contact.yield_force", "greater than 0")),
        ('"212 kN"', '"212 kN"\nrail_hardness = "2.5 GPa"', ("contact", "one of rail_hardness and wheel_hardness")),
        ('"212 kN"', '"212 kN"\nrail_share = 1.5', ("contact.rail_share", "1.5", "less than or equal to 1")),
        ('"212 kN"', '"212 kN"\npoisson = 0.25', ("contact", "a given constant together with poisson")),
        ('"212 kN"', '"212 kN"\nrestitution = 0.9', ("contact", "restitution")),
        ('"Thornton"', '"Thorntom"', ("Thorntom", "Thornton")),
    ],
)
def test_a_wrong_contact_is_refused_with_one_message(file, capsys, old, new, parts):
    file.write_text(GOOD.replace(old, new), encoding="utf-8")
    assert main(["run", str(file)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("arguments", "old", "new", "parts"),
    [
        (["--passes", "0"], "", "", ("passes", "0", "at least 1")),
        (["--passes", "3", "--hardening", "2"], "", "", ("hardening", "2", "0 to 1")),
        (["--passes", "3"], '"point"', '"circle"', ("rolling", "circle", "point")),
        (["--passes", "3"], '"Thornton"\nconstant = 1.405e11\nyield_force = "212 kN"', '"Hertz"', ("elastic-plastic",)),
        (["--passes", "3", "--plot", "wear.gif"], "", "", ("--plot", ".gif", ".png")),
        (["--passes", "3", "--method", "exact"], "", "", ("method", "exact", "strict")),
    ],
)
def test_wear_refuses_with_one_message_and_writes_nothing(file, capsys, arguments, old, new, parts):
    file.write_text(GOOD.replace(old, new), encoding="utf-8")
    output = file.with_name("wear.nc")
    assert main(["wear", str(file), "--output", str(output), *arguments]) == 2
    message = capsys.readouterr().err
    assert message.strip().count("\n") == 0
    for part in parts:
        assert part in message
    assert not output.exists()


@pytest.mark.slow
def test_wear_goes_on_and_says_what_it_did(file, capsys):
    output, picture = file.with_name("wear.nc"), file.with_name("wear.png")
    assert main(["wear", str(file), "--passes", "2", "--output", str(output)]) == 0
    assert main(["wear", str(file), "--passes", "4", "--output", str(output), "--plot", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "4 passes: largest force" in said
    assert "marks are averaged over the contact patch" in said
    assert wt.load(output).sizes["pass"] == 4
    assert picture.stat().st_size > 5_000
    assert main(["wear", str(file), "--passes", "5", "--output", str(output), "--seed", "3"]) == 2
    assert "another scenario, or with other options" in capsys.readouterr().err
    assert wt.load(output).sizes["pass"] == 4


@pytest.mark.slow
def test_wear_that_runs_away_ends_with_what_is_computed(file, capsys):
    output = file.with_name("wear.nc")
    text = GOOD.replace("duration = 0.05", "duration = 0.2").replace("load = 91307", "load = 91307\ndamping = 8000")
    file.write_text(text, encoding="utf-8")
    arguments = ["wear", str(file), "--passes", "60", "--hardening", "0", "--output", str(output)]
    assert main(arguments) == 3
    assert "the marks run away" in capsys.readouterr().err
    done = wt.load(output).sizes["pass"]
    assert 5 < done < 60
    assert main(arguments) == 3
    assert wt.load(output).sizes["pass"] == done


def test_what_has_no_plastic_contacts_says_so(file):
    scene = wt.load(file)
    for ask in (
        lambda: trajectory(scene, ("vehicle.mass",), np.array([0.001])),
        lambda: wt.orbits.returns(scene, {"vehicle.mass": [1400, 1500]}, 1, 1),
    ):
        with pytest.raises(
            wt.InputError, match=r"contact: found an elastic-plastic contact, which `\w+` does not take"
        ):
            ask()
    standing = {"vehicle": {"type": "ErriB176"}, "contact": {"type": "Thornton"}, "speed": 0.0, "duration": 0.1}
    with pytest.raises(wt.InputError, match=r"speed: found 0 m/s on a contact that yields together with a Wagon"):
        wt.simulate(wt.Scenario.of(standing | {"creep": {"type": "Polach", "friction": 0.35}}))


def test_two_hardnesses_share_the_marks_and_the_softer_body_yields():
    hard = {"constant": 1.405e11, "rail_hardness": "2.5 GPa", "wheel_hardness": "3.0 GPa"}
    both, one = wt.contact.Thornton(**hard), wt.contact.Thornton(constant=1.405e11, hardness=2.5e9)
    assert both.share_of_rail == pytest.approx(3.0 / 5.5)
    assert both.yield_indentation(1.405e11, 2, 1e5) == one.yield_indentation(1.405e11, 2, 1e5)
    assert wt.contact.Thornton(**hard, yield_force=2e5).yield_indentation(1.405e11, 2, 1e5) == pytest.approx(
        (2e5 / 1.405e11) ** (2 / 3)
    )
    assert wt.contact.Thornton().share_of_rail == 0.5
    strength = wt.contact.Thornton(constant=1.405e11, yield_strength=2.5e9 / 2.8)
    assert strength.yield_indentation(1.405e11, 2, 1e5) == pytest.approx(one.yield_indentation(1.405e11, 2, 1e5))
    wheelset, law = wt.Wheelset(mass=1500, load=91_307), wt.contact.Thornton(yield_strength=5e8)
    computed = wt.Scenario(vehicle=wheelset, contact=law, speed=0, duration=0.01)
    elastic = computed.replaced({"contact": wt.Hertz(curvature=False)})
    assert wt.simulate(computed).contact_constant == pytest.approx(wt.simulate(elastic).contact_constant, rel=1e-12)
    assert np.isfinite(wt.simulate(computed).static_force)
