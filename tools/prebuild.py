"""Compile the kernels that a wheel brings along, for each level of processors, and check that no level lacks any.

    uv run python tools/prebuild.py && uv build --wheel

runs the examples and the table of abilities once for each level, with an empty folder of kernels, and moves what they
have compiled to src/wheeltapper/march/prebuilt. Any edit of a march, another Python or Numba voids it: build last.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from functools import reduce
from operator import or_
from pathlib import Path

import numba

from wheeltapper.march.compiling.prebuilt import LEVELS, PLACE, counted

ASKED = [
    "-m", "pytest", "-q", "-m", "slow or not slow", "tests/conformance/test_abilities.py", "tests/house/test_examples.py",
]  # fmt: skip


def compile_for(level: str, folder: Path, program: list[str]) -> None:
    """Run a Python program with kernels for a level; what it compiles lies in a folder."""
    processor = {"NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": "", "WHEELTAPPER_CACHE": str(folder)}
    subprocess.run([sys.executable, *program], env=os.environ | processor, check=True)


def gather(cache: Path, place: Path) -> None:
    """Copy what Python calls, and leave out what only compilers take."""
    for file in cache.rglob("*.code"):
        (place / file.parent.name).mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, place / file.parent.name / file.name)


def main() -> None:
    """Fill the folder; it is replaced when all levels are there and alike."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="*", default=ASKED, help="a Python program to be run instead of all, after --")
    program = parser.parse_args().program
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "prebuilt"
        for level in LEVELS:
            compile_for(level, Path(folder) / level, program)
            gather(Path(folder) / level, made / level)
        found = counted(made)
        first, *others = found.values()
        if not first:
            sys.exit("no kernel was compiled")
        if any(other != first for other in others):
            every = reduce(or_, found.values())
            sys.exit(f"levels lack kernels: { {level: dict(every - one) for level, one in found.items()} }")
        by = [f"Numba {numba.__version__}", f"Python {platform.python_version()}", platform.system()]
        (made / "made.json").write_text(json.dumps(by), encoding="utf-8")
        shutil.rmtree(PLACE, ignore_errors=True)
        shutil.move(made, PLACE)
    size = sum(file.stat().st_size for file in PLACE.rglob("*.code"))
    print(f"{PLACE}: {first.total()} kernels for each of {len(found)} levels, {size / 2**20:.1f} MB in all")


if __name__ == "__main__":
    main()
