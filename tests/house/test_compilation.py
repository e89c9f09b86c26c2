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


def answer(*arguments, script=SCRIPT, **environment):
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], env=os.environ | environment, capture_output=True, text=True
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


SMALL = """
import json, sys
import numpy as np
from wheeltapper.march.kernel import is_compiled
from wheeltapper.march.layout import SCRATCH
from wheeltapper.march.margin import _smallest_value

S = np.zeros(SCRATCH)
S[:3] = 5.0, -2.0, 1.0
arguments = 0, 2, 0.5, S
print(f"compiled: {is_compiled(_smallest_value, arguments)}", file=sys.stderr)
print(json.dumps(_smallest_value(*arguments)))
"""
"""Where 5 - 2·x + x² is smallest on (0, 0.5): a kernel that is compiled soon, with a callee in another file."""


@pytest.mark.slow
def test_an_edited_kernel_is_compiled_again(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "wheeltapper", ignore=shutil.ignore_patterns("__pycache__"))
    place = {"PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert answer(script=SMALL, **place) == (4.25, "compiled: False\n")
    assert answer(script=SMALL, **place) == (4.25, "compiled: True\n")
    roots = tmp_path / "wheeltapper" / "march" / "roots.py"
    text = roots.read_text(encoding="utf-8")
    assert text.count("    total = a[at + n]\n") == 1
    roots.write_text(text.replace("    total = a[at + n]\n", "    total = 2.0 * a[at + n]\n"))
    assert answer(script=SMALL, **place) == (4.5, "compiled: False\n")  # 5 - 2·x + 2·x²
    assert answer(script=SMALL, **place) == (4.5, "compiled: True\n")


PARTS = """
import json, sys
import numpy as np
from wheeltapper.march.layout import SCRATCH
from wheeltapper.march.margin import _smallest_value
from wheeltapper.march.roots import evaluate

S = np.zeros(SCRATCH)
S[:3] = 5.0, -2.0, 1.0
if "first" in sys.argv:
    evaluate(S, 0, 2, 0.5)
_smallest_value(0, 2, 0.5, S)
shown = len(evaluate.overloads)
evaluate(S, 0, 2, 0.5)
code = _smallest_value.inspect_asm(_smallest_value.signatures[0])
print(json.dumps({"shown": shown, "lines": [line.split()[0] for line in code.splitlines() if line[:1] == "\t"]}))
"""
"""A kernel, and one that it calls, which Python calls before it, or only afterwards."""


@pytest.mark.slow
def test_what_a_kernel_becomes_does_not_depend_on_what_python_has_called_before(tmp_path):
    alone, _ = answer(script=PARTS, NUMBA_CACHE_DIR=str(tmp_path / "alone"))
    after, _ = answer("first", script=PARTS, NUMBA_CACHE_DIR=str(tmp_path / "after"))
    again, _ = answer(script=PARTS, NUMBA_CACHE_DIR=str(tmp_path / "after"))
    assert (alone["shown"], after["shown"], again["shown"]) == (0, 1, 0)
    assert alone["lines"] == after["lines"]
    assert len(alone["lines"]) > 20


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
