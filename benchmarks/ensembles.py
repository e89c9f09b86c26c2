"""Throughput of many trajectories: lanes against one after the other, on one thread and on all cores.

    uv run python benchmarks/ensembles.py [--cells 1024]

64 bumps and 32 corrugations march to their ends, with mass, stiffness, damping, height and speed spread by 10 % either
way. They are repeated until there are enough cells for a steady figure. The strict method says how accurate the default
one is. None of the drawn trajectories is chaotic: where one is, the two methods find different counts.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Any

import numpy as np
from machine import prepare, shortest, store
from options import parser_of
from own import scenario
from problems import CASES, Case, FloatArray

from wheeltapper.lower.many import LoweredCells
from wheeltapper.march.common.blocks import core_count
from wheeltapper.march.common.program import EVENT_KIND, IMPACT, PEAK_CORNER, PEAK_FORCE
from wheeltapper.march.wheel.ensemble import Cells, Marched, march_all, march_in_lanes, march_one_by_one

TRAJECTORIES = {"bump": 64, "corr": 32}
SPREAD = 0.1
SEED = 20
CELLS = 1024
"""Cells of a timed march, about."""


@dataclass(frozen=True)
class Accuracy:
    """How well the default method does over an ensemble.

    Attributes
    ----------
    median, worst
        Of eN over the trajectories, the strict method being the reference.
    differing
        Trajectories in which the two methods do not find equally many impacts and force maxima.
    impacts
        Mean number of impacts.
    """

    median: float
    worst: float
    differing: int
    impacts: float


def spread(case: Case, trajectories: int) -> dict[str, FloatArray]:
    """Return the parameters of the trajectories, by path."""
    nominal = {
        "vehicle.mass": case.mass,
        "vehicle.stiffness": case.stiffness,
        "vehicle.damping": case.damping,
        "irregularity.0.height" if case.is_bump else "irregularity.0.amplitude": case.height,
        "speed": case.speed,
    }
    draw = np.random.default_rng(SEED)
    return {path: float(value) * draw.uniform(1 - SPREAD, 1 + SPREAD, trajectories) for path, value in nominal.items()}


def forces(marched: Marched) -> list[FloatArray]:
    """Return the force maxima of each trajectory."""
    parts = np.split(marched.peaks, marched.peak_ends[:-1])
    return [part[part[:, PEAK_CORNER] == 0.0, PEAK_FORCE] for part in parts]


def impacts(marched: Marched) -> list[int]:
    """Return how many impacts each trajectory has."""
    return [int((part[:, EVENT_KIND] == IMPACT).sum()) for part in np.split(marched.events, marched.event_ends[:-1])]


def accuracy(case: Case, values: dict[str, FloatArray]) -> Accuracy:
    """Compare the lanes with the strict method."""
    ours = march_in_lanes(LoweredCells(scenario(case), values).cells)
    strict = march_one_by_one(LoweredCells(scenario(case), values, "strict").cells)
    pairs = list(zip(forces(ours), forces(strict), strict=True))
    counts = zip(impacts(ours), impacts(strict), strict=True)
    alike = [a == b and len(f) == len(g) for (a, b), (f, g) in zip(counts, pairs, strict=True)]
    errors = [float(np.abs(f / g - 1.0).max()) for (f, g), same in zip(pairs, alike, strict=True) if same]
    mean = float(np.mean(impacts(strict)))
    return Accuracy(float(np.median(errors)), max(errors), alike.count(False), mean)


def repeated(case: Case, trajectories: int, cells: int) -> Cells:
    """Return the trajectories of an ensemble, again and again."""
    values = {path: np.tile(value, cells // trajectories) for path, value in spread(case, trajectories).items()}
    return LoweredCells(scenario(case), values).cells


def run(case: Case, cells: int, rounds: int) -> dict[str, Any]:
    """Measure an ensemble, print it, and return it as plain data."""
    trajectories, threads = TRAJECTORIES[case.name], core_count()
    found = accuracy(case, spread(case, trajectories))
    many = repeated(case, trajectories, cells)
    ways = {
        "lanes, one thread": lambda: march_in_lanes(many),
        "one by one, one thread": lambda: march_one_by_one(many),
        f"lanes, {threads} threads": lambda: march_all(many, threads, lambda block, marched: None),
    }
    times: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, way in ways.items():
            times[name].append(shortest(way, 1) / len(many.first))
    best = {name: min(taken) for name, taken in times.items()}
    lanes, scalar = best["lanes, one thread"], best["one by one, one thread"]
    print(f"\nensemble {case.name}: {trajectories} trajectories, {found.impacts:.0f} impacts each, throughput")
    print(f"  median eN {found.median:.1e}, worst {found.worst:.1e}; counts differ in {found.differing} of them")
    for name, taken in best.items():
        print(f"  {name:26}{1e6 * taken:10.1f} us per trajectory")
    print(f"  one by one / lanes        {scalar / lanes:10.2f}")
    return {"trajectories": trajectories, "cells": len(many.first), "times": best, "accuracy": vars(found)}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the size of an ensemble to a command line."""
    parser.add_argument("--cells", type=int, default=CELLS, help=f"cells of a march of many (default {CELLS})")


def main() -> None:
    """Measure, print and store."""
    parser = parser_of(__doc__)
    arguments(parser)
    parser.add_argument("--rounds", type=int, default=10, help="rounds of the interleaved measurement (default 10)")
    options = parser.parse_args()
    around = prepare()
    if options.smallest:
        options.cells, options.rounds = max(TRAJECTORIES.values()), 1
    found = {name: run(CASES[name], options.cells, options.rounds) for name in TRAJECTORIES}
    if not options.smallest:
        store("ensembles", around | found)


if __name__ == "__main__":
    main()
