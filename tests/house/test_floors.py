"""The floors: nothing imports upward, and only the door opens the kernels."""

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "wheeltapper"
KERNELS = {
    "single", "yielding", "damper_end", "multibody", "ensemble", "gradients", "margin", "dense", "damper_dense",
    "balance", "orbits",
}  # fmt: skip
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


def opened(path: Path) -> list[str]:
    """Return the kernels that a file calls; names of columns (capitals) and of what a march returns are none."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and str(node.module).rpartition(".")[0] == "wheeltapper.march":
            names = [name.name for name in node.names if name.name[0].islower()]
            found += names if str(node.module).rpartition(".")[2] in KERNELS else []
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            held = node.func.value
            found += [ast.unparse(node.func)] if isinstance(held, ast.Name) and held.id in KERNELS else []
    return found


def test_nothing_above_opens_a_kernel_but_by_the_door() -> None:
    assert {path.name: names for path in ABOVE if (names := opened(path))} == {}


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
