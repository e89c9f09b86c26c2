"""Measure how long each kernel takes to be compiled, for the table that users are told from.

    WHEELTAPPER_CACHE=$(mktemp -d) uv run python tools/compile_costs.py

asks what `wheeltapper cache --fill` does in this process, with an empty folder of kernels, and writes the table
(src/wheeltapper/march/compiling/costs.toml) with new times; kernels without words have their names.
"""

from __future__ import annotations

import time
import warnings
from typing import Any

from wheeltapper.faces.filling import asks
from wheeltapper.march.compiling import telling

HEAD = """\
# What kernels do, and how long their compilation took, s of wall time on a quiet core, each after those that were needed
# before it. `tools/compile_costs.py` measures the times anew and keeps the words.
"""


class Timed(telling.Compilation):
    """A compilation whose time is kept."""

    took: dict[str, float] = {}  # noqa: RUF012 - of all kernels

    def __init__(self, kernel: str) -> None:
        super().__init__(kernel)
        self.kernel = kernel

    def end(self) -> None:
        """Keep the time; of kernels that have one entry together none is kept."""
        if self._is_one_of_many:
            return
        self.took[self.kernel] = max(self.took.get(self.kernel, 0.0), time.perf_counter() - self.begin)
        super().end()


def main() -> None:
    """Ask, and write the table."""
    telling.Compilation = Timed  # type: ignore[misc]
    warnings.simplefilter("ignore")
    for question, scenario, method in asks():
        question(scenario, method)
    known: dict[str, dict[str, Any]] = telling.costs()
    parts = [HEAD]
    for kernel in sorted(known.keys() | Timed.took.keys()):
        words = known.get(kernel, {}).get("what", kernel)
        seconds = Timed.took.get(kernel, known.get(kernel, {}).get("seconds", 0.0))
        parts.append(f'["{kernel}"]\nwhat = "{words}"\nseconds = {seconds:.1f}\n')
    telling.COSTS.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
