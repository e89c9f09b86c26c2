"""Compiled kernels: the cache sees every change of their sources, and without compilation the answers are the same."""

import contextlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "wheeltapper"

SCRIPT = """
import json, sys
import wheeltapper as wt
scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=5e4),
    track=wt.FloatingDeck(mass=3000, stiffness=1e7) if "deck" in sys.argv else wt.StiffTrack(),
    contact=wt.Hertz(constant=1.405e11, hysteresis=0.2 if "deck" in sys.argv else None),
    irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.02),
    rolling="point", speed=9, duration=0.03,
)
record = wt.simulate(scene)
if "map" in sys.argv:
    over = {"vehicle.mass": [1400.0, 1500.0, 1600.0]}
    chart = wt.sweep(scene, over, [wt.features.first_loss(), wt.features.largest_force()])
    print(json.dumps({"times": chart.first_loss.values.tolist() * 2, "forces": chart.largest_force.values.tolist()}))
    sys.exit()
print(json.dumps({
    "times": record.events.time.values.tolist(),
    "forces": record.peaks.normal_force.values.tolist(),
    "end": record.at(record.end).wheel_displacement.values.tolist(),
}))
"""


def answer(*arguments, **environment):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *arguments], env=os.environ | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr


def answer_here(arguments, capsys, monkeypatch):
    """Return what the script says in this process, whose kernels are loaded already."""
    monkeypatch.setattr(sys, "argv", ["script", *arguments])
    with contextlib.suppress(SystemExit):
        exec(SCRIPT, {})
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    "arguments", [(), pytest.param(("deck",), marks=pytest.mark.slow), pytest.param(("map",), marks=pytest.mark.slow)]
)
def test_without_compilation_the_answers_are_the_same(arguments, capsys, monkeypatch):
    plain, _ = answer(*arguments, NUMBA_DISABLE_JIT="1")
    compiled = answer_here(arguments, capsys, monkeypatch)
    assert len(plain["times"]) == len(compiled["times"]) > 4
    for name in plain:
        assert plain[name] == pytest.approx(compiled[name], rel=1e-9, abs=1e-15)


@pytest.mark.slow
def test_an_edited_kernel_is_compiled_again(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "wheeltapper", ignore=shutil.ignore_patterns("__pycache__"))
    place = {"PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    first, said = answer(**place)
    assert "compiling" in said
    again, said = answer(**place)
    assert "compiling" not in said
    assert again == first
    events = tmp_path / "wheeltapper" / "march" / "events.py"  # a callee of the kernel that is called, in another file
    text = events.read_text(encoding="utf-8")
    assert text.count("follow_force(time + after, size, ") == 1
    events.write_text(text.replace("follow_force(time + after, size, ", "follow_force(time + after, 2.0 * size, "))
    edited, said = answer(**place)
    assert "compiling" in said
    assert edited["times"] == pytest.approx(first["times"])
    assert edited["forces"] == pytest.approx([2.0 * value for value in first["forces"]])


@pytest.mark.slow
def test_where_nothing_can_be_written_it_compiles_and_runs(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "wheeltapper", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "wheeltapper" / "march" / "__pycache__").write_text("in the way")  # even of the superuser
    (tmp_path / "home").write_text("in the way")
    place = {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "home"), "NUMBA_CACHE_DIR": ""}
    found, said = answer(**place)
    assert "compiling" in said
    assert len(found["times"]) > 4


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_folder_that_cannot_be_written_is_no_obstacle(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "wheeltapper", ignore=shutil.ignore_patterns("__pycache__"))
    for path in [tmp_path / "wheeltapper", *(tmp_path / "wheeltapper").rglob("*")]:
        path.chmod(path.stat().st_mode & ~0o222)
    place = {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "home")}
    answer(**place)
    _, said = answer(**place)
    assert "compiling" not in said
    assert list((tmp_path / "home").rglob("*.nbi"))
