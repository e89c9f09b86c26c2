"""Compile the kernels that a wheel brings along, for each level of processors, and check that no level lacks any.

    uv run python tools/prebuild.py && uv build --wheel

does for each level what `wheeltapper cache --fill` does, in a folder of its own, and moves what that has compiled to
src/wheeltapper/march/prebuilt. Any edit of a march, another Python or Numba voids it: build last. With --check it asks
afterwards, of each level that this machine has, whether the examples and the table of abilities compile anything more.
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

from wheeltapper.march.compiling.prebuilt import LEVELS, PLACE, counted, levels_of_host

FILL = "import sys; from wheeltapper.faces.cli import main; sys.exit(main(['cache', '--fill']))"
NEEDS = ["-q", "-m", "slow or not slow", "tests/conformance/test_abilities.py", "tests/house/test_examples.py"]


def compile_for(level: str, folder: Path) -> None:
    """Compile all kernels for a level; they lie in a folder."""
    processor = {"NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": "", "WHEELTAPPER_CACHE": str(folder)}
    subprocess.run([sys.executable, "-c", FILL], env=os.environ | processor, check=True)


def check(level: str) -> None:
    """End with an error if the examples or the table of abilities compile anything beside what there is for a level."""
    with tempfile.TemporaryDirectory() as folder:
        beside = {"WHEELTAPPER_PREBUILT": level, "WHEELTAPPER_CACHE": folder}
        subprocess.run([sys.executable, "-m", "pytest", *NEEDS], env=os.environ | beside, check=True)
        if more := sorted(file.name for file in Path(folder).rglob("*.code")):
            sys.exit(f"{level} lacks {', '.join(more)}")


def gather(cache: Path, place: Path) -> None:
    """Copy what Python calls, and leave out what only compilers take."""
    for file in cache.rglob("*.code"):
        (place / file.parent.name).mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, place / file.parent.name / file.name)


def main() -> None:
    """Fill the folder; it is replaced when all levels are there and alike."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="ask for more of each level, which takes long")
    checked = parser.parse_args().check
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "prebuilt"
        for level in LEVELS:
            compile_for(level, Path(folder) / level)
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
    for level in levels_of_host() if checked else ():
        check(level)


if __name__ == "__main__":
    main()
