"""Measure what a user waits for on the command line, in processes of their own.

    uv run python benchmarks/startup.py [--repeats 5]

The first run compiles the kernels into a cache; it is measured with an empty one, in a folder that is thrown away.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from options import parser_of

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(sys.executable).with_name("wheeltapper")
EXAMPLE = ROOT / "examples" / "wheel_flat.toml"


def seconds(arguments: list[str], **environment: str) -> float:
    """Return the wall time of one call of the program, which must succeed."""
    start = time.perf_counter()
    done = subprocess.run([PROGRAM, *arguments], env=os.environ | environment, capture_output=True, text=True)
    elapsed = time.perf_counter() - start
    if done.returncode:
        raise SystemExit(f"wheeltapper {' '.join(arguments)} ended with {done.returncode}:\n{done.stderr}")
    return elapsed


def report(label: str, times: list[float]) -> None:
    """Print the shortest and the middle of some times."""
    print(f"  {label:44}{min(times):8.2f}{median(times):9.2f}")


def warm(label: str, arguments: list[str], repeats: int) -> None:
    """Measure a call whose kernels are in the cache."""
    seconds(arguments)
    report(label, [seconds(arguments) for _ in range(repeats)])


def first(repeats: int) -> None:
    """Measure runs with an empty cache of kernels."""
    times = []
    for _ in range(repeats):
        with TemporaryDirectory() as cache:
            times.append(seconds(["run", str(EXAMPLE)], WHEELTAPPER_CACHE=cache))
    report("run examples/wheel_flat.toml, empty cache", times)


def main() -> None:
    parser = parser_of("Measure the start of the command line.")
    parser.add_argument("--repeats", type=int, default=5, help="repeats of each warm call (default 5)")
    parser.add_argument("--first", type=int, default=1, help="repeats with an empty cache (default 1)")
    options = parser.parse_args()
    if options.smallest:
        options.repeats, options.first = 1, 0
    print(f"  {'wheeltapper ...':44}{'min, s':>8}{'median':>9}")
    with TemporaryDirectory() as folder:
        output = str(Path(folder) / "record.nc")
        warm("--help", ["--help"], options.repeats)
        warm("run examples/wheel_flat.toml", ["run", str(EXAMPLE)], options.repeats)
        warm("run examples/wheel_flat.toml --output", ["run", str(EXAMPLE), "--output", output], options.repeats)
    if options.first:
        first(options.first)


if __name__ == "__main__":
    main()
