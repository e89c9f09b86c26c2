"""The feature map against its peers, all on all cores of this machine, in one run.

    uv run --group peers python benchmarks/maps.py [--side 256] [--samples 64] [--rounds 3] [--scaling]
    uv run python benchmarks/maps.py --models [--side 64]  # what the models cost, without peers
    uv run python benchmarks/maps.py --gradients [--side 32]  # what their derivatives cost, without peers

A map of two features over (c, m), each run stopped at its third landing: the time between the second and the third
impact, and the ratio of the force maxima after the first and the second. The peers compute a sample of the cells,
spread over the map, in as many processes as there are cores; their times are extrapolated to the map. The error of a
code is the largest relative difference of a feature on its sample to our strict method, whose series has another order.

The same map with other models is compared with the fastest one, a point follower with a given contact constant: the
circle, the computed constant, a floating deck; over the bump and over a corrugation. The march of these models with
derivatives is compared with the march without them, in lanes and one by one, for 1, 2 and 4 parameters.

diffrax finds no landings: it marches all cells to the time of the map's last third landing, and its error is that of
the last state, against heyoka at round-off.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
from machine import prepare, shortest, store
from matching import Match, Point, match
from options import need_peers, parser_of
from own import scenario
from problems import CASES, Case, FloatArray, IntArray, Outcome, largest_end_error
from workers import Code, Workers

import wheeltapper as wt
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.many import LoweredCells
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import core_count
from wheeltapper.march.wheel import gradients
from wheeltapper.march.wheel.ensemble import Marched, march_all, march_in_lanes, march_one_by_one

CASE = CASES["bump"]
FEATURES = [wt.features.impact_interval(2, 3), wt.features.force_ratio(1, 2)]
LANDINGS = 3
TOLERANCES = {
    "heyoka": (1e-8, 1e-10, 1e-12, 0.0),
    "scipy DOP853": (1e-9, 1e-11, 1e-13),
    "CVODE Adams": (1e-10, 1e-12, 1e-14),
    "diffrax Tsit5": (1e-8, 1e-10, 1e-12),
}
COMPILED, BLIND = ("heyoka", "diffrax Tsit5"), ("diffrax Tsit5",)
MORE = 16
"""How many times as many cells the compiled codes compute."""
LARGEST_SIDE = 64
"""Cells along each axis with which the models are compared: a corrugation takes a millisecond a cell."""
PARAMETER_COUNTS = (1, 2, 4)
CALLS = 3
"""Calls of our own code in one round."""


@dataclass
class Entry:
    """A peer at one tolerance, and what it costs and misses on its sample."""

    code: Code
    sample: list[Case]
    error: float
    times: list[float] = field(default_factory=list)

    @property
    def finds_events(self) -> bool:
        """False where the error is one of the last state."""
        return self.code.landings is not None

    @property
    def setting(self) -> str:
        """The tolerance, as text."""
        return f"{self.code.tolerance:.0e}" if self.code.tolerance else "round-off"

    def point(self, cells: int) -> Point:
        """Return the error, and the time extrapolated to a number of cells."""
        return Point(self.error, min(self.times) / len(self.sample) * cells)


class Map:
    """The map: its axes, its cells in rows, and our features."""

    def __init__(self, side: int) -> None:
        self.base, self.over = scenario(CASE), axes(side)
        damping, mass = (mesh.ravel() for mesh in np.meshgrid(*self.over.values(), indexing="ij"))
        self.values = dict(zip(self.over, (damping, mass), strict=True))
        self.cells = len(damping)

    def sweep(self) -> FloatArray:
        """Return both features of each cell, as a user would ask for them."""
        chart = wt.sweep(self.base, self.over, FEATURES)
        return np.stack([chart.impact_interval.values.ravel(), chart.force_ratio.values.ravel()])

    def strict(self, chosen: IntArray) -> FloatArray:
        """Return both features of some cells by the strict method."""
        some = {path: value[chosen].tolist() for path, value in self.values.items()}
        chart = wt.sweep(self.base, some, FEATURES, zipped=True, method="strict")
        return np.stack([chart.impact_interval.values, chart.force_ratio.values])

    def lowered(self) -> LoweredCells:
        """Return all cells ready to march up to the third landing."""
        many = LoweredCells(self.base, self.values)
        many.cells.numbers[:, contract.LAST_IMPACT] = LANDINGS
        return many

    def case(self, index: int, duration: float) -> Case:
        """Return one cell."""
        damping, mass = (repr(float(value[index])) for value in self.values.values())
        return Case(**(vars(CASE) | {"damping": damping, "mass": mass, "duration": repr(duration)}))


def axes(side: int) -> dict[str, FloatArray]:
    """Return the map's axes."""
    return {
        "vehicle.damping": float(CASE.damping) * np.linspace(0.5, 1.5, side),
        "vehicle.mass": float(CASE.mass) * np.linspace(0.7, 1.3, side),
    }


def features(outcomes: Sequence[Outcome]) -> FloatArray:
    """Return both features of each cell: (2, cells)."""
    rows = []
    for found in outcomes:
        peaks = list(zip(found.peak_times, found.peak_forces, strict=True))
        after = [max(force for time, force in peaks if a < time < b) for a, b in pairwise(found.impacts)]
        rows.append((found.impacts[2] - found.impacts[1], after[0] / after[1]))
    return np.array(rows).T


def largest_difference(found: FloatArray, reference: FloatArray) -> float:
    """Return the largest relative difference of a feature."""
    return float(np.abs(found / reference - 1.0).max())


def spread(cells: int, samples: int) -> IntArray:
    """Return `samples` cells, spread over the map."""
    return np.linspace(0, cells - 1, samples).astype(np.int64)


def last_of_all(chart: Map) -> float:
    """Return the time of the map's last third landing, s."""
    many = chart.lowered()
    ends = np.zeros(chart.cells)

    def keep(block: slice, marched: Marched) -> None:
        ends[block] = marched.end

    march_all(many.cells, core_count(), keep)
    return float((ends * many.units.time).max())


def with_events(name: str, chart: Map, samples: int, workers: Workers) -> list[Entry]:
    """Return a peer at all its tolerances, with its errors against our strict method; this also warms it up."""
    chosen = spread(chart.cells, samples * (MORE if name in COMPILED else 1))
    sample, strict = [chart.case(index, float(CASE.duration)) for index in chosen], chart.strict(chosen)
    found = []
    for tolerance in TOLERANCES[name]:
        code = Code(name, tolerance, LANDINGS)
        answers = features(workers.answers(code, sample))
        found.append(Entry(code, sample, largest_difference(answers, strict)))
    return found


def without_events(name: str, chart: Map, samples: int, workers: Workers) -> list[Entry]:
    """Return the same for a peer without events, with its errors of the last state against heyoka."""
    latest = last_of_all(chart)
    sample = [chart.case(index, latest) for index in spread(chart.cells, samples * MORE)]
    reference = workers.answers(Code("heyoka", 0.0, None), sample)
    found = []
    for tolerance in TOLERANCES[name]:
        code = Code(name, tolerance, None)
        pairs = zip(workers.answers(code, sample), reference, strict=True)
        found.append(Entry(code, sample, max(largest_end_error(ours, theirs) for ours, theirs in pairs)))
    return found


def entries(chart: Map, samples: int, workers: Workers) -> list[Entry]:
    """Return all peers at all tolerances."""
    return [
        entry
        for name in TOLERANCES
        for entry in (without_events if name in BLIND else with_events)(name, chart, samples, workers)
    ]


def measure(chart: Map, peers: Sequence[Entry], workers: Workers, rounds: int) -> tuple[float, float]:
    """Time all codes, one after the other in each round; return the times of our bare kernel and of `wt.sweep`."""
    cells, threads = chart.lowered().cells, core_count()
    kernel, whole = [], []
    for _ in range(rounds):
        kernel.append(shortest(lambda: march_all(cells, threads, lambda block, marched: None), CALLS))
        whole.append(shortest(chart.sweep, CALLS))
        for entry in peers:
            entry.times.append(workers.seconds(entry.code, entry.sample))
    return min(kernel), min(whole)


def matches(own: Point, peers: Sequence[Entry], cells: int) -> list[Match]:
    """Compare `wt.sweep` with each peer that finds events."""
    curves: dict[str, list[Point]] = {}
    for entry in peers:
        if entry.finds_events:
            curves.setdefault(entry.code.name, []).append(entry.point(cells))
    return [match("wt.sweep", own, name, points) for name, points in curves.items()]


def show(side: int, kernel: float, own: Point, peers: Sequence[Entry], found: Sequence[Match]) -> None:
    """Print what was measured."""
    print(
        f"\nmap of {side} x {side} cells, two features, stopped at the third landing; {core_count()} threads or workers"
    )
    print(f"  {'code':16}{'setting':>10}{'time, s':>12}{'over ours':>11}{'error':>11}   cells computed")
    print(f"  {'bare kernel':16}{'default':>10}{kernel:12.3f}{kernel / own.time:11.2f}{'':14}all")
    print(f"  {'wt.sweep':16}{'default':>10}{own.time:12.3f}{1:11.2f}{own.error:11.1e}   all")
    for entry in peers:
        point = entry.point(side * side)
        figures = f"{point.time:12.1f}{point.time / own.time:11.1f}{point.error:11.1e}"
        note = "" if entry.finds_events else "; no events, error of the last state"
        print(f"  {entry.code.name:16}{entry.setting:>10}{figures}   {len(entry.sample)}, extrapolated{note}")
    print("  time ratios at matched error of the features")
    for m in found:
        print(f"    {m}")


def row(entry: Entry, cells: int) -> dict[str, Any]:
    """Return an entry as plain data."""
    point = entry.point(cells)
    return {
        "code": entry.code.name,
        "setting": entry.setting,
        "time": point.time,
        "error": point.error,
        "finds_events": entry.finds_events,
        "computed": len(entry.sample),
    }


def run(side: int, samples: int, rounds: int) -> dict[str, Any]:
    """Measure the map, print it, and return it as plain data."""
    chart, workers = Map(side), Workers(core_count())
    peers = entries(chart, samples, workers)
    chosen = spread(chart.cells, samples * MORE)
    error = largest_difference(chart.sweep()[:, chosen], chart.strict(chosen))
    kernel, sweep = measure(chart, peers, workers, rounds)
    workers.close()
    own = Point(error, sweep)
    found = matches(own, peers, chart.cells)
    show(side, kernel, own, peers, found)
    ours = {"cells": chart.cells, "threads": core_count(), "kernel": kernel, "sweep": sweep, "error": error}
    return ours | {"rows": [row(e, chart.cells) for e in peers], "ratios": [vars(m) for m in found]}


def models() -> dict[str, tuple[wt.Scenario, str]]:
    """Return the models of the map, each with the one that it is compared with."""
    bump = scenario(CASE)
    wave = bump.replaced({"irregularity": wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=-1.0)})
    circle, default = {"rolling": "circle"}, {"rolling": "circle", "contact": wt.Hertz()}
    deck = {"track": wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)}
    changes = {"point, given constant": {}, "circle, given constant": circle, "circle, computed constant": default}
    found = {}
    for name, base in (("bump", bump), ("corrugation", wave)):
        corner = f"{name}: point, given constant"
        found |= {f"{name}: {kind}": (base.replaced(change), corner) for kind, change in changes.items()}
        found[f"{name}: deck"] = (base.replaced(deck), corner)
    return found


def compare_models(side: int, rounds: int) -> dict[str, dict[str, float]]:
    """Measure the march of the map with each model on one thread, interleaved; print and return time and ratio."""
    marched, corners, times = {}, {}, {}
    values = Map(side).values
    for name, (base, corner) in models().items():
        cells = LoweredCells(base, values).cells
        cells.numbers[:, contract.LAST_IMPACT] = LANDINGS
        marched[name], corners[name], times[name] = cells, corner, inf
        march_in_lanes(cells)
    for _ in range(rounds):
        for name, cells in marched.items():
            times[name] = min(times[name], shortest(lambda cells=cells: march_in_lanes(cells), CALLS))  # type: ignore[misc]
    found = {name: {"time": took, "ratio": took / times[corners[name]]} for name, took in times.items()}
    print(f"\nthe march of {side} x {side} cells on one thread, and its ratio to the fastest model")
    for name, row in found.items():
        print(f"  {name:40}{1e6 * row['time'] / side**2:9.2f} us a cell{row['ratio']:8.2f}")
    return found


def parameters_of(name: str) -> tuple[str, ...]:
    """Return the parameters by which a model is differentiated: two of the vehicle, two of the irregularity."""
    shape = ("amplitude", "wavelength") if name.startswith("corrugation") else ("height", "length")
    return "vehicle.damping", "vehicle.mass", *(f"irregularity.0.{field}" for field in shape)


def marches_of(name: str, base: wt.Scenario, values: dict[str, FloatArray]) -> dict[str, Callable[[], Any]]:
    """Return the marches of a model's cells: in lanes, one by one, and with 1, 2 and 4 parameters."""
    parameters = parameters_of(name)
    fixed = {path: np.full(len(values["vehicle.mass"]), Fields(base)(path)) for path in parameters[2:]}
    many = LoweredCells(base, values | fixed)
    many.cells.numbers[:, contract.LAST_IMPACT] = LANDINGS
    found: dict[str, Callable[[], Any]] = {
        "lanes": lambda: march_in_lanes(many.cells),
        "alone": lambda: march_one_by_one(many.cells),
    }
    for count in PARAMETER_COUNTS:
        turned = many.turned([many.direction_along(path) for path in parameters[:count]])
        found[str(count)] = lambda turned=turned: gradients.march_all(*turned, 1, lambda *found: None)  # type: ignore[misc]
    return found


def compare_gradients(side: int, rounds: int) -> dict[str, dict[str, float]]:
    """Measure the march of each model with derivatives on one thread, interleaved; print and return the times."""
    values = Map(side).values
    marches = {name: marches_of(name, base, values) for name, (base, _) in models().items()}
    times = {(name, way): inf for name, ways in marches.items() for way in ways}
    for _ in range(rounds + 1):  # the first one compiles
        for (name, way), best in times.items():
            times[name, way] = min(best, shortest(marches[name][way], 1))
    found = {name: {way: 1e6 * times[name, way] / side**2 for way in ways} for name, ways in marches.items()}
    print(f"\nthe march of {side} x {side} cells on one thread: us a cell in lanes; multiples alone and with gradients")
    heads = "lanes", "alone", *(f"{n} par." for n in PARAMETER_COUNTS)
    print(f"  {'':40}" + "".join(f"{head:>9}" for head in heads))
    for name, row in found.items():
        ratios = "".join(f"{took / row['lanes']:9.2f}" for way, took in row.items() if way != "lanes")
        print(f"  {name:40}{row['lanes']:9.2f}{ratios}")
    return found


def scaling() -> dict[int, float]:
    """Measure maps of many sizes, print and return their times."""
    taken = {}
    print("\nwt.sweep on maps of many sizes")
    for side in (100, 316, 1000, 3162):
        cells = side * side
        taken[cells] = shortest(Map(side).sweep, 1)
        print(f"  {cells:9d} cells {taken[cells]:8.2f} s, {1e6 * taken[cells] / cells:.2f} us each")
    return taken


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the sizes of the map to a command line."""
    parser.add_argument("--side", type=int, default=256, help="cells along each axis of the map (default 256)")
    parser.add_argument("--samples", type=int, default=64, help="cells that the slow peers compute (default 64)")
    parser.add_argument("--scaling", action="store_true", help="also maps of 1e4 to 1e7 cells")


def main() -> None:
    """Measure, print and store."""
    parser = parser_of(__doc__)
    arguments(parser)
    parser.add_argument("--rounds", type=int, default=3, help="rounds of the interleaved measurement (default 3)")
    parser.add_argument("--models", action="store_true", help="only what the models cost, without peers")
    parser.add_argument("--gradients", action="store_true", help="only what derivatives cost, without peers")
    options = parser.parse_args()
    if not (options.models or options.gradients):
        need_peers()
    around = prepare()
    if options.smallest:
        options.side, options.samples, options.rounds = 16, 2, 1
    side = min(options.side, LARGEST_SIDE)
    compared = {}
    if not options.gradients:
        compared["models"] = compare_models(side, options.rounds)
    if not options.models:
        compared["gradients"] = compare_gradients(min(side, LARGEST_SIDE // 2), options.rounds)
    if options.models or options.gradients:
        return
    result = around | compared | run(options.side, options.samples, options.rounds)
    if options.smallest:
        return
    store("maps", result | ({"scaling": scaling()} if options.scaling else {}))


if __name__ == "__main__":
    main()
