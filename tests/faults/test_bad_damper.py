"""Dampers with an end of their own: one clear message for what cannot be, and exit code 2."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.faces.cli import main

GOOD = """
speed = 9.0
duration = 0.02
rolling = "point"
[vehicle]
type = "Wheelset"
mass = 1500
load = 91307
damping = 5e4
damper_play = "25 um"
[contact]
type = "Hertz"
constant = 1.405e11
[[irregularity]]
type = "CosineBump"
height = "0.2 mm"
length = "50 mm"
start = "10 mm"
"""


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('"25 um"', '"-25 um"', ("vehicle.damper_play", "-2.5e-05", "greater than or equal to 0")),
        ("damping = 5e4\n", "", ("vehicle", "damper_play without damping", "more than 0 N·s/m")),
        ('damping = 5e4\ndamper_play = "25 um"', "bush_stiffness = 1e8", ("bush_stiffness without damping",)),
        ('"25 um"', '"25 um"\ndamper_play_start = 1.5', ("vehicle.damper_play_start", "1.5", "less than or")),
        ('damper_play = "25 um"', "damper_play_start = 0.5", ("0.5 without damper_play", "both, or neither")),
        ('"25 um"', '"25 um"\nbush_stiffness = 0', ("vehicle.bush_stiffness", "greater than 0")),
        ('"25 um"', '"25 um"\nbush_stiffness = "1e12 N/m"', ("2e+07 times damping", "at most 5e+10 N/m", "rigid")),
        ('"25 um"', '"25 um"\nbush_stiffnes = 1e8', ("vehicle.bush_stiffnes", "did you mean 'bush_stiffness'")),
    ],
)  # fmt: skip
def test_a_wrong_damper_is_refused_with_one_message(tmp_path, capsys, old, new, parts):
    path = tmp_path / "scene.toml"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    assert main(["run", str(path)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    for part in parts:
        assert part in message


@pytest.mark.parametrize("changes", [{}, {"vehicle.damper_play": 0.0, "vehicle.bush_stiffness": 1e8}])
def test_what_has_no_such_dampers_says_so(tmp_path, changes):
    path = tmp_path / "scene.toml"
    path.write_text(GOOD, encoding="utf-8")
    scene = wt.load(path).replaced(changes)
    for ask, name in (
        (lambda: trajectory(scene, ("vehicle.mass",), np.array([0.001])), "trajectory"),
        (lambda: trajectory(scene, (), np.array([0.001])), "trajectory"),
    ):
        with pytest.raises(
            wt.InputError, match=rf"(a damper with play or a bush|play of the damper), which `{name}` does"
        ):
            ask()
    plain = scene.replaced({"vehicle.damper_play": 0.0, "vehicle.bush_stiffness": None})
    with pytest.raises(wt.InputError, match=r"vehicle.damper_play: found a damper with play or a bush"):
        trajectory(plain, ("vehicle.damper_play",), np.array([0.001]))


def test_many_such_scenarios_march_side_by_side(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(GOOD, encoding="utf-8")
    scene = wt.load(path)
    records = wt.simulate([scene.replaced({"vehicle.damper_play": play}) for play in (1e-5, 1e-3)])
    assert [record.damper_events.sizes["damper_event"] for record in records] == [7, 0]
    assert wt.simulate(scene.replaced({"vehicle.damper_play": 0.0})).damper_events.sizes["damper_event"] == 0
