"""Every benchmark can be imported, and those that need no other codes run."""

import ast
import inspect
import os
import re
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "benchmarks").glob("*.py"))
PROGRAMS = [file for file in FILES if "\ndef main(" in file.read_text(encoding="utf-8")]
IMPORTS = """
import importlib, sys, traceback
sys.path.insert(0, "benchmarks")
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except ImportError as error:
        print(f"{name}: {error!r} {getattr(error, 'name', None)}")
"""


def needs_peers(file):
    return "need_peers()" in file.read_text(encoding="utf-8") and file.name != "options.py"


@pytest.mark.slow
def test_every_benchmark_can_be_imported():
    names = [file.stem for file in FILES if file not in PROGRAMS or needs_peers(file)]  # the others run, below
    assert len(FILES) > 20
    arguments = [sys.executable, "-c", IMPORTS, *names]
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    left_out = dict(line.split(": ", 1) for line in done.stdout.splitlines())
    for name, why in left_out.items():
        assert name.startswith("peer_"), why
        module = re.search(r"No module named '(\w+)'", why)
        assert module is not None, why
        assert find_spec(module[1]) is None
        assert module[1] in ("heyoka", "sksundae", "diffrax", "jax")


def is_module(home, name):
    return hasattr(home, "__path__") and find_spec(f"{home.__name__}.{name}") is not None


def modules_of(tree):
    """Return the package's modules that a program imports, by the names that they have there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((one.asname or one.name, one.name) for one in node.names if one.name == "wheeltapper")
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("wheeltapper"):
            home = import_module(node.module)
            names = {one.asname or one.name: one.name for one in node.names}
            yield from ((name, f"{node.module}.{own}") for name, own in names.items() if is_module(home, own))


def missing_names(text):
    """Return what a program's text asks of modules of the package that these do not have."""
    tree = ast.parse(text)
    modules = {name: import_module(path) for name, path in modules_of(tree)}

    def value_of(node):
        if isinstance(node, ast.Name):
            return modules.get(node.id)
        home = value_of(node.value) if isinstance(node, ast.Attribute) else None
        return getattr(home, node.attr, None) if inspect.ismodule(home) else None

    asked = (node for node in ast.walk(tree) if isinstance(node, ast.Attribute))
    asked = [node for node in asked if inspect.ismodule(value_of(node.value))]
    return [ast.unparse(node) for node in asked if not hasattr(value_of(node.value), node.attr)]


def test_benchmarks_ask_modules_for_what_these_have():
    """Also where no run of the smallest size comes by."""
    assert [(file.name, names) for file in FILES if (names := missing_names(file.read_text(encoding="utf-8")))] == []
    wrong = (
        "import wheeltapper as wt\nfrom wheeltapper.march.wagon import rates\nrates.contact_forces\nwt.tracks.Slap.x"
    )
    assert missing_names(wrong) == ["rates.contact_forces", "wt.tracks.Slap"]


def ran(file, *arguments):
    return subprocess.run(
        [sys.executable, str(file), *arguments], cwd=ROOT, capture_output=True, text=True, timeout=600,
        env=os.environ | {"PYTHONWARNINGS": "ignore"},
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("file", [file for file in PROGRAMS if needs_peers(file)], ids=lambda file: file.stem)
def test_a_benchmark_without_its_peers_says_so(file):
    if all(find_spec(name) for name in ("heyoka", "sksundae", "diffrax", "jax")):
        pytest.skip("the peers are installed")
    done = ran(file, "--smallest")
    assert done.returncode == 2
    assert re.fullmatch(r"not installed: .*; `uv run --group peers python ...` installs them\n", done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize("file", [file for file in PROGRAMS if not needs_peers(file)], ids=lambda file: file.stem)
def test_a_benchmark_runs_at_its_smallest_size_and_leaves_nothing(file):
    results = ROOT / "benchmarks" / "results"
    before = set(results.glob("*"))
    done = ran(file, "--smallest")
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert set(results.glob("*")) == before


@pytest.mark.slow
def test_the_models_of_the_map_are_compared_without_peers():
    done = ran(ROOT / "benchmarks" / "maps.py", "--models", "--smallest")
    assert done.returncode == 0, done.stderr
    ratios = dict(re.findall(r"^  (\w+: .*?)  .* us a cell +([\d.]+)$", done.stdout, re.MULTILINE))
    assert len(ratios) == 8
    assert ratios["bump: point, given constant"] == "1.00"
