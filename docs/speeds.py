"""The directive ``.. speeds::``: how long some runs take on the machine that builds the documentation."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import wheeltapper as wt
from wheeltapper.ground.progress import reporting

EXAMPLES = Path(__file__).parents[1] / "examples"
TIMES = 5
"""Each is timed so often, after a first time; the median counts."""


def cases() -> dict[str, Callable[[], Any]]:
    """Return what is timed, by what it is called."""
    bump, flat, coach = (wt.load(EXAMPLES / f"{name}.toml") for name in ("bump", "flat_on_ballast", "coach_on_ballast"))
    over = {"vehicle.damping": np.linspace(4e4, 6e4, 50), "vehicle.mass": np.linspace(1400, 1600, 50)}
    seconds = f"{flat.duration:g} s of a wheelset with a flat on rails on sleepers"
    return {
        "the example above": lambda: wt.simulate(bump),
        seconds: lambda: wt.simulate(flat),
        f"{coach.duration:g} s of a coach on rails on sleepers": lambda: wt.simulate(coach),
        "a map of 2500 such examples": lambda: wt.sweep(bump, over, ["largest_force"]),
    }


def taken(run: Callable[[], Any]) -> float:
    """Return the median of the times of a run, s."""
    spent = []
    for _ in range(TIMES + 1):
        begun = time.perf_counter()
        run()
        spent.append(time.perf_counter() - begun)
    return float(np.median(spent[1:]))


def words(seconds: float) -> str:
    """Return a time in words, with two digits."""
    size, unit = (1e3 * seconds, "ms") if seconds < 1.0 else (seconds, "s")
    return f"{float(f'{size:.2g}'):g} {unit}"


class Speeds(SphinxDirective):
    def run(self) -> list[nodes.Node]:
        with reporting(lambda *_: None, lambda _: None):
            rows = [f"   * - {name}\n     - {words(taken(run))}" for name, run in cases().items()]
        table = "\n".join([".. list-table::", "   :widths: 70 30", "", *rows])
        said = (
            f"These times were measured when this page was built, on {os.cpu_count()} cores, with compiled kernels. "
            "The folder ``benchmarks`` compares them with other programs.\n\n"
        )
        return self.parse_text_to_nodes(said + table)


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("speeds", Speeds)
    return {"parallel_read_safe": True}
