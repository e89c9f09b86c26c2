"""Measure a map on ballasted track, in multiples of the march of one bump on a stiff rail in the same run.

    uv run python benchmarks/track_maps.py [--side 64] [--rounds 2] [--parts]
    uv run python benchmarks/track_maps.py --threads [--side 32] [--rounds 5]  # one thread over all, nothing else

The largest force over speed (5 to 40 m/s) and length of a fresh flat (10 to 80 mm), from its first strike to 0.15 s
after it. The wheel starts in equilibrium 50 mm before the flat's middle meets the rail; the longest flat begins 10 mm
ahead, and a cell lasts until 0.16 s, 10 ms of which the slowest wheel needs to come there. The map is computed by one
thread and by one per core, and as a store that is stopped and resumed; all must hold the same bits. Some cells are
computed by `simulate` as well. `--parts` shows where the time goes in a map of one speed. `--threads` takes turns with
one thread and one per core, each time with tables made anew, and compares the shortest times.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from machine import no_garbage_collection, prepare, store
from options import parser_of
from own import march_case
from track import shortest as shortest_cpu

import wheeltapper as wt
from wheeltapper.ask.fill import fill_store
from wheeltapper.ask.spec import described_study
from wheeltapper.ask.store import Store
from wheeltapper.lower.plane_cells import PlaneCells
from wheeltapper.march.common.blocks import core_count
from wheeltapper.march.general import march as general
from wheeltapper.march.general.ensemble import march_all
from wheeltapper.march.general.tables import forget_tables

MOST = 2.5e5
"""Marches of the bump that a map of 64 x 64 cells may take on two cores."""
FEATURE = "largest_force"
SCENE = wt.Scenario(
    vehicle=wt.Wheelset(mass=1200, load=188_228), track=wt.tracks.Ballasted.named("rolland_UIC60_example"),
    contact=wt.Hertz(constant=1.8825e11), irregularity=wt.WheelFlat(length=0.04, position=0.05), speed=20,
    duration=0.16,
)  # fmt: skip


def spec_of(side: int) -> dict[str, Any]:
    """Return the study."""
    return {
        "scenario": SCENE.model_dump(mode="json"), "features": [FEATURE],
        "over": {
            "speed": np.linspace(5.0, 40.0, side).tolist(),
            "irregularity.0.length": np.linspace(0.01, 0.08, side).tolist(),
        },
    }  # fmt: skip


def wall_time(call: Callable[[], Any], rounds: int) -> tuple[float, Any]:
    """Return the shortest time of some calls, s, and what the last one returned."""
    best, out = np.inf, None
    with no_garbage_collection():
        for _ in range(rounds):
            start = time.perf_counter()
            out = call()
            best = min(best, time.perf_counter() - start)
    return best, out


def against_records(chart: xr.Dataset, samples: int) -> float:
    """Return the largest relative difference of some cells to records."""
    rng, worst = np.random.default_rng(0), 0.0
    for _ in range(samples):
        i, j = (int(rng.integers(size)) for size in chart[FEATURE].shape)
        one = {path: float(chart[path][k]) for path, k in zip(chart[FEATURE].dims, (i, j), strict=True)}
        force = float(wt.features.largest_force()(wt.simulate(SCENE.replaced(one), progress=False)))
        worst = max(worst, abs(float(chart[FEATURE][i, j]) / force - 1.0))
    return worst


def resumed(spec: dict[str, Any], folder: Path) -> xr.Dataset:
    """Return the map from a store that was interrupted after its first chunk, and resumed."""
    path, plain, written = folder / "map.zarr", Store.write, []

    def stopping(self: Store, place: tuple[int, ...], threads: int) -> Any:
        if written:
            raise KeyboardInterrupt
        written.append(place)
        return plain(self, place, threads)

    Store.write = stopping  # type: ignore[method-assign]
    try:
        fill_store(Store(path, spec))
    except KeyboardInterrupt:
        pass
    finally:
        Store.write = plain  # type: ignore[method-assign]
    if len(written) == 1 and not path.exists():
        raise RuntimeError("an interrupted store is lost")
    fill_store(Store(path, spec), resume=True)
    return xr.open_zarr(path).load()


def prepared_anew(task):
    """Make the tables of a task, those of its track too."""
    forget_tables()
    general.prepare(task.system, task.method)


def parts(cells: int) -> None:
    """Print where the time goes for cells of one speed."""
    many = PlaneCells(SCENE, {"irregularity.0.length": np.linspace(0.01, 0.08, cells)})
    first, steps = many.tasks[0], 0.16 / 2e-4
    prepared = general.prepare(first.system, first.method)
    tables = shortest_cpu(lambda: prepared_anew(first), 3)
    alone = shortest_cpu(lambda: general.run(prepared, 0.16), 3)
    print(f"  tables of one speed: {1e3 * tables:.0f} ms; a cell alone: {1e6 * alone / steps:.2f} us a macro step")
    for count in (4, 16, 64):
        some = many.tasks[:count]
        together = shortest_cpu(lambda some=some: march_all(some, 1, lambda numbers, found: None), 3)
        print(f"  {len(some):3} cells in step: {1e6 * together / len(some) / steps:.2f} us")


def compare_threads(swept: Callable[[int], Any], rounds: int) -> dict[str, float]:
    """Print and return how much longer a map takes on one thread than on one per core, in turns; tables are new."""
    times = {1: [], core_count(): []}
    with no_garbage_collection():
        for _ in range(rounds):
            for threads, found in times.items():
                forget_tables()
                start = time.perf_counter()
                swept(threads)
                found.append(time.perf_counter() - start)
    one, all_cores = (min(found) for found in times.values())
    ratios = sorted(a / b for a, b in zip(*times.values(), strict=True))
    print(f"  shortest of {rounds}: one thread {one:.2f} s, {core_count()} threads {all_cores:.2f} s")
    print(f"  one thread takes {one / all_cores:.2f} times as long (aim 1.8); round by round ", end="")
    print(f"{ratios[0]:.2f} to {ratios[-1]:.2f}")
    return {"one": one, "all": all_cores, "cores": core_count()}


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = parser_of(__doc__.partition("\n")[0])
    parser.add_argument("--side", type=int, default=64, help="cells along each axis (default 64)")
    parser.add_argument("--rounds", type=int, default=2, help="rounds of each measurement (default 2)")
    parser.add_argument("--parts", action="store_true", help="where the time goes")
    parser.add_argument("--threads", action="store_true", help="only what one thread takes over one per core")
    return parser.parse_args()


def main() -> None:
    options = arguments()
    around = prepare()
    warnings.simplefilter("ignore")
    side, rounds = (3, 1) if options.smallest else (options.side, options.rounds)
    bump = march_case("bump", "default")
    unit = shortest_cpu(bump, 40)
    spec = spec_of(side)
    study = described_study(spec)
    over = {axis.path: axis.values for axis in study.axes}

    def swept(threads: int) -> xr.Dataset:
        return wt.sweep(SCENE, over, FEATURE, threads=threads, progress=False)

    wt.sweep(SCENE, {path: values[:1] for path, values in over.items()}, FEATURE, progress=False)  # compiles
    if options.threads:
        if core_count() < 2:
            raise SystemExit("there is but one core")
        compared = compare_threads(swept, rounds)
        if not options.smallest:
            store("track_maps_threads", around | {"side": side} | compared)
        return
    cores = core_count()
    one, alone = wall_time(lambda: swept(1), rounds)
    all_cores, chart = wall_time(lambda: swept(cores), rounds)
    unit = min(unit, shortest_cpu(bump, 10))
    print(f"\none bump on a stiff rail: {1e6 * unit:.0f} us; {side} x {side} cells, largest force over speed and flat")
    print(f"  {cores} threads: {all_cores:.2f} s, {all_cores / unit:.3g} bumps (at most {MOST:.3g} for 64 x 64)")
    print(f"  one thread: {one:.2f} s, {one / all_cores:.2f} times as long")
    print(f"  the same bits from 1 and {cores} threads: {chart.equals(alone)}")
    with tempfile.TemporaryDirectory() as folder:
        held = resumed(spec | {"chunk": max(1, side * side // 8)}, Path(folder))
    same = np.array_equal(held[FEATURE].values, chart[FEATURE].values)
    print(f"  the same bits from a store, interrupted and resumed: {same}")
    worst = against_records(chart, 2 if options.smallest else 12)
    print(f"  against `simulate`: {worst:.1e}")
    if options.parts:
        parts(8 if options.smallest else 64)
    if not options.smallest:
        result = {"bump": unit, "side": side, "one": one, "all": all_cores, "cores": cores, "worst": worst}
        store("track_maps", around | result | {"same": bool(chart.equals(alone)) and bool(same)})


if __name__ == "__main__":
    main()
