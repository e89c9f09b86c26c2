"""Every benchmark can be imported, and those that need no other codes run."""

import os
import re
import subprocess
import sys
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


def test_every_benchmark_can_be_imported():
    names = [file.stem for file in FILES]
    assert len(names) > 20
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
