"""Rails under many wheels: passes per second, and what a pass spends its time on.

    uv run python benchmarks/wear.py

Corrugated rail of 2 m (examples/corrugation_wear.toml), default accuracy, one thread, compilation apart, best of
several runs; then two scenarios side by side on two threads.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xarray as xr
from machine import no_garbage_collection, surroundings
from options import parser_of

import wheeltapper as wt
from wheeltapper.march import run
from wheeltapper.march.wheel.march import Marched

REPEATS = 3
LENGTH = 2.0
EXAMPLE = wt.load(Path(__file__).resolve().parent.parent / "examples" / "corrugation_wear.toml")
CASES: dict[str, tuple[float, int, float]] = {
    "36 m/s, hardening 1": (36.0, 1000, 1.0),
    "36 m/s, hardening 0": (36.0, 200, 0.0),
    "9 m/s, hardening 1": (9.0, 200, 1.0),
}
"""Speed, passes and hardening."""
GOAL = 10.0
"""Seconds that 1000 passes at 36 m/s with hardening may take on one core."""


def scene(speed: float) -> wt.Scenario:
    """Return the example at another speed, over the same length."""
    return EXAMPLE.replaced({"speed": speed, "duration": LENGTH / speed})


@contextmanager
def spent(home: Any, name: str, times: dict[str, float]) -> Iterator[None]:
    """Add up in `times` what calls of a function of a module, or of a class, take."""
    function: Callable[..., Any] = getattr(home, name)

    def timed(*arguments: Any) -> Any:
        began = time.perf_counter()
        found = function(*arguments)
        times[name] += time.perf_counter() - began
        return found

    setattr(home, name, timed)
    try:
        yield
    finally:
        setattr(home, name, function)


def measured(speed: float, passes: int, hardening: float) -> tuple[xr.Dataset, float, dict[str, float]]:
    """Return an evolution, how long it took, and the time of marching and of reading indentations; best of several."""
    best, parts, wear = float("inf"), {}, None
    one = scene(speed)
    for _ in range(REPEATS):
        times = {"march": 0.0, "at": 0.0}
        with no_garbage_collection(), spent(run, "march", times), spent(Marched, "at", times):
            began = time.perf_counter()
            wear = wt.wear_in(one, passes, hardening=hardening)
            wall = time.perf_counter() - began
        if wall < best:
            best, parts = wall, times
    return wear, best, parts


def side_by_side(passes: int) -> float:
    """Return how many times as fast two scenarios pass on two threads as on one, best of several."""
    scenes = [scene(36.0), scene(35.0)]
    wall = {1: float("inf"), 2: float("inf")}
    for _ in range(REPEATS):
        for threads in wall:
            began = time.perf_counter()
            wt.wear_in(scenes, passes, threads=threads)
            wall[threads] = min(wall[threads], time.perf_counter() - began)
    return wall[1] / wall[2]


def main() -> None:
    """Print the table."""
    smallest = parser_of(__doc__).parse_args().smallest
    print({name: held for name, held in surroundings().items() if name in ("cpu", "cores", "commit", "load")})
    wt.wear_in(scene(36.0), 2)  # compiles
    print(f"{'case':22} {'passes':>6} {'s':>6} {'passes/s':>8} {'ms/pass':>8} {'march':>6} {'read':>6} {'rest':>6}")
    for name, (speed, passes, hardening) in CASES.items():
        wear, wall, parts = measured(speed, 2 if smallest else passes, hardening)
        made = wear.sizes["pass"]
        shares = [parts["march"] / wall, parts["at"] / wall]
        shares.append(1.0 - sum(shares))
        print(
            f"{name:22} {made:6d} {wall:6.2f} {made / wall:8.0f} {1e3 * wall / made:8.2f} "
            + " ".join(f"{100 * share:5.0f}%" for share in shares)
            + (f"   goal: under {GOAL:g} s" if made == 1000 else "")
        )
    if smallest:
        return
    print(f"two scenarios on two threads: {side_by_side(200):.2f} times as fast as on one")


if __name__ == "__main__":
    main()
