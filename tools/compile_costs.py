"""Measure how long each kernel takes to be compiled, for the table that users are told from.

    WHEELTAPPER_CACHE=$(mktemp -d) uv run python tools/compile_costs.py

runs the table of abilities in this process, with an empty folder of kernels, and prints the table
(src/wheeltapper/march/compiling/costs.toml) with new times; kernels without words have their names.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import pytest

from wheeltapper.march.compiling import telling

HEAD = """\
# What kernels do, and how long their compilation took, s of wall time on a quiet core: what the commands and the table of
# abilities compile. `tools/compile_costs.py` measures the times anew and keeps the words.
"""


class Timed(telling.Compilation):
    """A compilation whose time is kept."""

    took: dict[str, float] = {}  # noqa: RUF012 - of all kernels

    def __init__(self, kernel: str) -> None:
        super().__init__(kernel)
        self.kernel = kernel

    def end(self) -> None:
        """Keep the time."""
        self.took[self.kernel] = max(self.took.get(self.kernel, 0.0), time.perf_counter() - self.begin)
        super().end()


def main() -> None:
    """Run the tests, and print the table."""
    telling.Compilation = Timed  # type: ignore[misc]
    failed = pytest.main(
        ["-q", "-p", "no:xdist", "-o", "addopts=", "-m", "slow", "tests/conformance/test_abilities.py"]
    )
    if failed:
        sys.exit(failed)
    known: dict[str, dict[str, Any]] = telling.costs()
    print(HEAD)
    for kernel in sorted(known.keys() | Timed.took.keys()):
        words = known.get(kernel, {}).get("what", kernel)
        seconds = Timed.took.get(kernel, known.get(kernel, {}).get("seconds", 0.0))
        print(f'["{kernel}"]\nwhat = "{words}"\nseconds = {seconds:.1f}\n')


if __name__ == "__main__":
    main()
