"""The feature map against its peers, all on all cores of this machine, in one run.

    uv run --group peers python benchmarks/maps.py [--side 256] [--samples 24] [--scaling]

A map of two features over (c, m), each run stopped at its third landing: the time between the second and the third
impact, and the ratio of the force maxima after the first and the second. Peers with events (SciPy's DOP853, CVODE,
heyoka) stop there too. They compute a sample of the cells, spread over the map, in as many processes as there are
cores; their time is extrapolated, and all must agree with us on the sample. diffrax has no events: it marches a batch
of cells at a time up to the latest third landing of the map, and finds neither feature.
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from itertools import pairwise
from multiprocessing import get_context
from typing import Any

import core
import numpy as np
from own import scenario
from peer_cvode import Cvode
from peer_heyoka import Heyoka
from peer_scipy import Scipy
from problems import CASES, Case, Outcome, scaled

import wheeltapper as wt
from wheeltapper.ask.cells import cores
from wheeltapper.lower.many import Many
from wheeltapper.march import program as contract
from wheeltapper.march.ensemble import Cells, march_all, march_in_lanes, march_one_by_one

CASE = CASES["bump"]
FEATURES = [wt.features.impact_interval(2, 3), wt.features.force_ratio(1, 2)]
TOLERANCES = {"scipy DOP853": 1e-10, "CVODE Adams": 1e-11, "heyoka": 1e-10}
BLIND_TOLERANCE = 1e-8
LANDINGS = 3
BATCH = 512
"""Cells that diffrax marches at a time in one process."""
ENSEMBLES = {"bump": 64, "corr": 32}

Point = tuple[float, float]


def cell(damping: float, mass: float) -> Case:
    """Return the bump at another damping and mass."""
    return replace(CASE, damping=repr(float(damping)), mass=repr(float(mass)))


@cache
def _heyoka() -> Heyoka:
    """Return heyoka's integrators, compiled once in each process; a cell's numbers are their parameters."""
    return Heyoka(scaled(CASE), TOLERANCES["heyoka"])


def runner_of(peer: str, point: Point) -> Any:
    """Return a peer, ready to march one cell."""
    problem = scaled(cell(*point))
    if peer == "heyoka":
        _heyoka().problem = problem
        return _heyoka()
    return (Scipy if peer.startswith("scipy") else Cvode)(problem, TOLERANCES[peer])


def features_of(found: Outcome) -> tuple[float, float]:
    """Return both features of a run that was stopped at its third landing."""
    largest = [
        found.peak_forces[(found.peak_times > a) & (found.peak_times < b)].max() for a, b in pairwise(found.impacts)
    ]
    return float(found.impacts[2] - found.impacts[1]), float(largest[0] / largest[1])


def by_peer(peer: str, points: list[Point]) -> tuple[list[tuple[float, float]], float]:
    """Return both features of some cells, one after the other, and how long marching them took."""
    out, took = [], 0.0
    for point in points:
        runner = runner_of(peer, point)
        start = time.perf_counter()
        raw = runner(LANDINGS)
        took += time.perf_counter() - start
        out.append(features_of(runner.read(raw)))
    return out, took


def blindly(points: list[Point], end: float) -> float:
    """Return how long diffrax takes for a batch of cells up to a time (s), compiling apart."""
    from peer_diffrax import Diffrax, numbers

    rows = np.array([numbers(scaled(cell(*point))) for point in points])
    rows[:, -1] = [end / scaled(cell(*point)).time_unit for point in points]
    runner = Diffrax(rows, BLIND_TOLERANCE)
    return best(runner, 2)


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


def peers_on_map(points: list[Point], chosen: Any, ours: Any, end: float) -> dict[str, Any]:
    """Measure all peers on a sample of the cells; return their extrapolated times and how far they are off."""
    threads, out = cores(), {}
    sample = [points[index] for index in chosen]
    shares = [sample[first::threads] for first in range(threads)]
    with ProcessPoolExecutor(threads, mp_context=get_context("spawn")) as pool:
        for peer in TOLERANCES:
            list(pool.map(by_peer, [peer] * threads, [share[:1] for share in shares]))  # imports, compiles
            parts = list(pool.map(by_peer, [peer] * threads, shares))
            took = max(seconds for _, seconds in parts) / max(len(share) for share in shares) * len(points) / threads
            off = max(
                float(np.abs(ours[:, first::threads].T / np.array(found) - 1.0).max())
                for first, (found, _) in enumerate(parts)
            )
            out[peer] = {"time": took, "off": off, "extrapolated_from": len(sample)}
        spread = np.linspace(0, len(points) - 1, BATCH * threads).astype(int)
        batches: list[Future[float]] = [
            pool.submit(blindly, [points[index] for index in spread[first::threads]], end) for first in range(threads)
        ]
        took = max(batch.result() for batch in batches) / (BATCH * threads) * len(points)
        out["diffrax DOPRI8, no events"] = {"time": took, "off": None, "extrapolated_from": BATCH * threads}
    return out


def measure_map(side: int, samples: int) -> dict[str, Any]:
    """Measure the map, print it, and return it as plain data."""
    base, over, threads = scenario(CASE), axes(side), cores()
    damping, mass = (mesh.ravel() for mesh in np.meshgrid(*over.values(), indexing="ij"))
    points = list(zip(damping.tolist(), mass.tolist(), strict=True))
    chosen = np.linspace(0, len(points) - 1, samples).astype(int)
    chart = wt.sweep(base, over, FEATURES)
    ours = np.stack([chart.impact_interval.values.ravel()[chosen], chart.force_ratio.values.ravel()[chosen]])
    third = wt.features.custom(lambda train: train.impact_time[LANDINGS - 1], "third", "s", impacts=3, until="impact")
    end = float(wt.sweep(base, axes(8), [third]).third.max())
    peers = peers_on_map(points, chosen, ours, end)
    many = Many(base, {"vehicle.damping": damping, "vehicle.mass": mass})
    many.cells.numbers[:, contract.LAST_IMPACT] = LANDINGS
    kernel = best(lambda: march_all(many.cells, threads, lambda block, marched: None), 9)
    whole = best(lambda: wt.sweep(base, over, FEATURES), 9)
    print(f"\n{side} x {side} map of two features, up to the third landing, {threads} cores")
    print(f"  {'bare kernel':28}{kernel:10.3f} s")
    print(f"  {'wt.sweep':28}{whole:10.3f} s   {100 * (whole / kernel - 1):.0f} % more than the kernel")
    for peer, row in peers.items():
        off = "finds neither feature" if row["off"] is None else f"largest difference {row['off']:.0e}"
        print(f"  {peer:28}{row['time']:10.1f} s   {row['time'] / whole:.4g} times wt.sweep; {off}")
    print(f"  peers extrapolated from {samples} cells, diffrax from {BATCH * threads}")
    return {"cells": len(points), "kernel": kernel, "sweep": whole, "peers": peers}


def ensemble(name: str) -> dict[str, float]:
    """Measure whole trajectories of a case with its parameters spread by 10 %, and return microseconds of each."""
    draw, count = np.random.default_rng(1), ENSEMBLES[name]
    case = CASES[name]
    changed = {
        path: float(getattr(case, field)) * draw.uniform(0.9, 1.1, count)
        for path, field in (("vehicle.mass", "mass"), ("vehicle.damping", "damping"), ("speed", "speed"))
    }
    few = Many(scenario(case), changed).cells
    times = 1024 // count
    cells = Cells(few.pieces, *(np.concatenate([column] * times) for column in few[1:]))
    both = (march_in_lanes(few), march_one_by_one(few))
    if not np.array_equal(both[0].event_ends, both[1].event_ends):
        raise SystemExit(f"{name}: lanes and single cells find different events")
    threads = cores()
    return {
        "single cells": 1e6 * best(lambda: march_one_by_one(few), 5) / count,
        "lanes": 1e6 * best(lambda: march_in_lanes(cells), 3) / len(cells.first),
        f"lanes, {threads} cores": 1e6 * best(lambda: march_all(cells, threads, lambda *_: None), 3) / len(cells.first),
    }


def measure_ensembles() -> dict[str, Any]:
    """Measure whole trajectories, many at a time; print and return microseconds of each."""
    out = {name: ensemble(name) for name in ENSEMBLES}
    print("\nwhole trajectories, parameters spread by 10 %, microseconds of each")
    for name, row in out.items():
        print(f"  {name:6}" + ", ".join(f"{label} {value:.0f}" for label, value in row.items()))
    return out


def measure_scaling() -> dict[int, float]:
    """Measure maps of 1e4 to 1e7 cells; print and return their times."""
    out = {}
    for side in (100, 316, 1000, 3162):
        out[side * side] = best(lambda side=side: wt.sweep(scenario(CASE), axes(side), FEATURES), 1)  # type: ignore[misc]
        print(f"  {side * side:9d} cells {out[side * side]:8.2f} s, {1e6 * out[side * side] / side / side:.2f} us each")
    return out


def arguments() -> argparse.ArgumentParser:
    """Return the options of a map."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--side", type=int, default=256, help="cells along each side of the map (default 256)")
    parser.add_argument("--samples", type=int, default=24, help="cells that the peers compute (default 24)")
    parser.add_argument("--scaling", action="store_true", help="also maps of 1e4 to 1e7 cells")
    return parser


def run(asked: argparse.Namespace) -> dict[str, Any]:
    """Measure all that is asked, and return it as plain data."""
    result = {"map": measure_map(asked.side, asked.samples), "ensembles": measure_ensembles()}
    if asked.scaling:
        result["scaling"] = measure_scaling()
    return result


def main() -> None:
    """Measure, print and store."""
    asked = argparse.ArgumentParser(description="Compare feature maps.", parents=[arguments()]).parse_args()
    core.store("maps", core.introduced() | run(asked))


if __name__ == "__main__":
    main()
