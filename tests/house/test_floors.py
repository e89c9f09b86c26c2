"""The floors: nothing imports upward, and only the door opens the kernels."""

import ast
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from wheeltapper.march.compiling.guests import Kernel

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "wheeltapper"
NOUNS = "Wagon|Wheelset|ElasticPlastic|Hertz|Linear|FloatingDeck|StiffTrack|Start|CreepLaw"
ABOVE = [
    path
    for floor in ("record", "ask", "orbits", "diagnosis", "faces")
    for path in sorted((SOURCE / floor).rglob("*.py"))
]


def test_import_linter_keeps_every_contract() -> None:
    program = shutil.which("lint-imports", path=str(Path(sys.executable).parent))
    assert program is not None
    done = subprocess.run([program, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


def opened(text: str) -> list[str]:
    """Return the kernels that a program's text takes from the marches, by name or as part of a module."""
    found, modules, tree = [], dict[str, Any](), ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("wheeltapper.march"):
            home = import_module(str(node.module))
            for one in node.names:
                own = hasattr(home, one.name)
                held = getattr(home, one.name) if own else import_module(f"{node.module}.{one.name}")
                modules[one.asname or one.name] = held
                found += [one.name] if isinstance(held, Kernel) else []
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            held = getattr(modules.get(node.value.id), node.attr, None)
            found += [ast.unparse(node)] if isinstance(held, Kernel) else []
    return found


@pytest.mark.slow
def test_nothing_above_opens_a_kernel() -> None:
    """But for the points of contact of a rolling circle, which are a kernel of the paths' own."""
    above = [*ABOVE, *(path for path in sorted((SOURCE / "lower").rglob("*.py")) if path.parent.name != "paths")]
    assert {path.name: names for path in above if (names := opened(path.read_text(encoding="utf-8")))} == {}
    wrong = "from wheeltapper.march.wheel import dense\nfrom wheeltapper.march.wheel.single import march_kernel\n"
    assert opened(f"{wrong}dense.integrals(1)\ndense.OUT_FORCE") == ["march_kernel", "dense.integrals"]


def test_nothing_above_reaches_into_a_march_or_asks_which_it_is() -> None:
    reaches = re.compile(
        r"\.(?:prepared|logs)\b|marcher (?:is|is not|in|not in) run\.|marcher\.(?:name|cells)|type\(march\)"
    )
    above = [path for path in [*ABOVE, *sorted((SOURCE / "lower").rglob("*.py"))] if path.name != "door.py"]
    assert {path.name: lines for path in above if (lines := reaches.findall(path.read_text(encoding="utf-8")))} == {}
    assert len(reaches.findall("if marcher is run.GENERAL: march.found.prepared, march.logs.rows")) == 3


def test_records_and_questions_are_not_named_after_a_march_or_a_track() -> None:
    named = re.compile(r"on_rails|of_wagons|wagon|_rails|rail_")
    for floor in ("record", "ask", "diagnosis"):
        assert [path.stem for path in (SOURCE / floor).rglob("*.py") if named.search(path.stem)] == []


def test_nothing_above_asks_for_the_class_of_a_noun_to_choose() -> None:
    asks = re.compile(rf"(?<!assert )isinstance\((?:\w+\.)*(?:vehicle|contact|track|start|creep), (?:{NOUNS})\b.*")
    assert {path.name: lines for path in ABOVE if (lines := asks.findall(path.read_text(encoding="utf-8")))} == {}


def test_choosing_and_refusing_need_no_compiler() -> None:
    code = (
        "import sys, wheeltapper as wt; from wheeltapper.march import run\n"
        "scene = wt.Scenario(vehicle=wt.Wheelset(mass=1500), speed=9.0, duration=0.1)\n"
        "run.choose(run.SIMULATE, scene.needs); run.refusal(run.MODES, scene.needs)\n"
        "assert 'numba' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.slow
def test_lowering_a_wheel_imports_nothing_of_rails_that_bend() -> None:
    code = (
        "import sys, wheeltapper as wt; from wheeltapper.lower.door import lowered_scenario\n"
        "lowered_scenario(wt.Scenario(vehicle=wt.Wheelset(mass=1500, load=9e4), speed=9.0, duration=0.1)).contacts\n"
        "parts = 'wheeltapper.lower.track.ring', 'wheeltapper.lower.marks.marks', 'wheeltapper.march.general.tables'\n"
        "assert not {*parts} & {*sys.modules}"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
