"""The feature map against SciPy, both on all cores of this machine, in one run.

    uv run python benchmarks/maps.py [--side 256] [--samples 24] [--scaling]

A map of two features over (c, m), each run stopped at its third landing: the time between the second and the third
impact, and the ratio of the force maxima after the first and the second. SciPy (DOP853, rtol 1e-10, restarted at every
event and breakpoint, stopped at the third landing) computes a sample of the cells, spread over the map, in as many
processes as there are cores; its time is extrapolated. Both must agree on the sample.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

import numpy as np
from core import surroundings
from own import scenario
from peer_scipy import Scipy
from problems import CASES, Case, scaled
from reference import RESULTS

import wheeltapper as wt
from wheeltapper.ask.cells import cores
from wheeltapper.lower.many import Many
from wheeltapper.march import program as contract
from wheeltapper.march.ensemble import march_all

CASE = CASES["bump"]
FEATURES = [wt.features.impact_interval(2, 3), wt.features.force_ratio(1, 2)]
TOLERANCE = 1e-10
LANDINGS = 3


def cell(damping: float, mass: float) -> Case:
    """Return the bump at another damping and mass."""
    values = vars(CASE) | {"damping": repr(float(damping)), "mass": repr(float(mass))}
    return Case(**values)


def by_scipy(point: tuple[float, float]) -> tuple[float, float, float]:
    """Return both features of one cell, and how long that took."""
    start = time.perf_counter()
    problem = scaled(cell(*point))
    times, forces = stopped(Scipy(problem, TOLERANCE))
    took = time.perf_counter() - start
    return (times[2] - times[1]) * problem.time_unit, forces[0] / forces[1], took


def stopped(runner: Scipy) -> tuple[list[float], list[float]]:
    """Return the landings up to the third, and the largest force after each of the first two."""
    problem = runner.problem
    landings: list[float] = []
    peaks: list[tuple[float, float]] = []
    now, state, touching = 0.0, (problem.root**2, problem.rate), True
    for piece in problem.pieces:
        while True:
            run = runner._run(piece, now, state, touching)
            if touching:
                peaks += [(t, y[0] ** 1.5) for t, y in zip(run.t_events[1], run.y_events[1], strict=True)]
            if run.status == 0:
                now, state = piece.stop, tuple(run.y[:, -1])
                break
            now = float(run.t_events[0][0])
            state, touching = (0.0, float(run.y_events[0][0, 1])), not touching
            if touching:
                landings.append(now)
                if len(landings) == LANDINGS:
                    return landings, [max(f for t, f in peaks if a < t < b) for a, b in pairwise(landings)]
    raise RuntimeError("fewer than three landings")


def best(run: Any, rounds: int) -> float:
    """Return the shortest time of some runs, s."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def axes(side: int) -> dict[str, Any]:
    """Return the map's axes."""
    return {
        "vehicle.damping": float(CASE.damping) * np.linspace(0.5, 1.5, side),
        "vehicle.mass": float(CASE.mass) * np.linspace(0.7, 1.3, side),
    }


def main() -> None:
    """Measure, print and store."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, default=256)
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--scaling", action="store_true", help="also 1e4 to 1e7 cells")
    asked = parser.parse_args()
    base, over, threads = scenario(CASE), axes(asked.side), cores()
    damping, mass = (mesh.ravel() for mesh in np.meshgrid(*over.values(), indexing="ij"))
    chosen = np.linspace(0, len(damping) - 1, asked.samples).astype(int)
    with ProcessPoolExecutor(threads) as pool:
        list(pool.map(by_scipy, [(damping[0], mass[0])] * threads))
        start = time.perf_counter()
        found = list(pool.map(by_scipy, zip(damping[chosen], mass[chosen], strict=True)))
        scipy = (time.perf_counter() - start) / len(chosen) * len(damping)
    chart = wt.sweep(base, over, FEATURES)
    ours = np.stack([chart.impact_interval.values.ravel()[chosen], chart.force_ratio.values.ravel()[chosen]])
    off = float(np.abs(ours / np.array([row[:2] for row in found]).T - 1.0).max())
    many = Many(base, {"vehicle.damping": damping, "vehicle.mass": mass})
    many.cells.numbers[:, contract.LAST_IMPACT] = LANDINGS
    kernel = best(lambda: march_all(many.cells, threads, lambda block, marched: None), 7)
    whole = best(lambda: wt.sweep(base, over, FEATURES), 7)
    print(f"{asked.side} x {asked.side} cells, {threads} threads; largest difference on {len(chosen)} cells {off:.1e}")
    print(f"  bare kernel  {kernel:8.3f} s")
    print(f"  wt.sweep     {whole:8.3f} s   {100 * (whole / kernel - 1):.0f} % more than the kernel")
    print(f"  SciPy        {scipy:8.1f} s   extrapolated from {len(chosen)} cells: {scipy / whole:.0f} times wt.sweep")
    result = {"cells": len(damping), "kernel": kernel, "sweep": whole, "scipy": scipy, "off": off} | surroundings()
    if asked.scaling:
        result["scaling"] = {}
        for side in (100, 316, 1000, 3162):
            took = best(lambda side=side: wt.sweep(base, axes(side), FEATURES), 1)  # type: ignore[misc]
            result["scaling"][side * side] = took
            print(f"  {side * side:9d} cells {took:8.2f} s, {1e6 * took / side / side:.2f} us each")
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"maps-{datetime.now(UTC):%Y%m%dT%H%M%S}.json"
    path.write_text(json.dumps(result, indent=1), encoding="utf-8")
    print(f"written to {path}")


if __name__ == "__main__":
    main()
