"""What fraction of the machine's peak the lanes reach: their arithmetic per second over that of bare multiply-adds.

    uv run python benchmarks/peak.py

The peak is measured: independent chains of packed multiply-adds in registers, four and eight numbers wide, on one core
and on all of them. Operations are counted in the machine code that runs: a packed multiply-add does two for each of its
numbers, a packed sum, difference or product one; divisions, roots, comparisons and moves do none. For a trajectory or a
map the steps that lead from event to event are counted, each once; the search for events in them is not, nor is a step
that is made again to find an event in it. So the last two figures say how much of the time is spent on the motion.
"""

from __future__ import annotations

import platform
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import inf, log2, pi
from typing import Any

import numba
import numpy as np
from ensembles import CELLS, TRAJECTORIES, repeated
from machine import prepare, shortest, store
from maps import Map, spread
from options import parser_of
from problems import CASES, FloatArray

from wheeltapper.march.common.blocks import core_count
from wheeltapper.march.common.kernel import FASTMATH
from wheeltapper.march.common.program import COSINE, DEFAULT_ORDER, FLIGHT, PHASE, PIECE, SINE, Program
from wheeltapper.march.steps.equations import FLAT, WAVE, Terms
from wheeltapper.march.steps.lane_rows import (
    LANE_AMP_COS,
    LANE_AMP_SIN,
    LANE_CUBIC,
    LANE_ENTRIES,
    LANE_G,
    LANE_GOAL,
    LANE_K,
    LANE_LOAD,
    LANE_OMEGA,
    LANE_RATE,
    LANE_U0,
    LANE_UNTIL,
    LANE_W0,
    LANES,
)
from wheeltapper.march.steps.variants import FLIGHTS, VARIANTS
from wheeltapper.march.steps.written import compiled, source_in_lanes
from wheeltapper.march.wheel.ensemble import Cells, march_all, march_in_lanes
from wheeltapper.march.wheel.single import march

CHAINS, LINKS = 12, 16
"""Chains of multiply-adds, enough to hide their latency, and multiply-adds of each between a load and a store."""
PASSES = 100_000
REPEATS = 200_000
STEPS = {"level rail": VARIANTS.index(Terms(FLAT)), "sinusoid": VARIANTS.index(Terms(WAVE)), "flight": FLIGHTS}
"""The lane kernels of a contact step on level rail and on a sinusoid, and of a step in flight."""
SAMPLED = 1024
"""Cells of the map whose steps are counted."""

PACKED = re.compile(r"^\s+v(fn?m(?:add|sub)\d+|mul|add|sub)pd\b.*%([xyz])mm", re.MULTILINE)
LONE = re.compile(r"^\s+v(?:fn?m(?:add|sub)\d+|mul|add|sub)sd\b", re.MULTILINE)
LABEL, JUMP = re.compile(r"^(\.L\w+):"), re.compile(r"^\s+j\w+\s+(\.L\w+)")
WIDTHS = {"x": 2, "y": 4, "z": 8}


@dataclass(frozen=True)
class Code:
    """The arithmetic in a kernel's machine code.

    Attributes
    ----------
    fused, single
        Packed multiply-adds; packed sums, differences and products.
    lone
        The same, one number at a time.
    width
        Numbers in the widest packed instruction.
    operations
        Of one pass through the code, each instruction taken once.
    loops
        True where the code jumps back.
    """

    fused: int
    single: int
    lone: int
    width: int
    operations: int
    loops: bool


def machine_code(kernel: Any, signature: str) -> Code:
    """Return the arithmetic of a kernel compiled for the signature alone; wrappers for Python come after its end."""
    kernel.compile(signature)
    (text,) = kernel.inspect_asm().values()
    body = text.partition(".Lfunc_end0")[0]
    found = [(name.startswith("f"), WIDTHS[register]) for name, register in PACKED.findall(body)]
    fused = sum(is_fused for is_fused, _ in found)
    operations = sum((1 + is_fused) * width for is_fused, width in found)
    widest = max((width for _, width in found), default=1)
    return Code(fused, len(found) - fused, len(LONE.findall(body)), widest, operations, jumps_back(body))


def jumps_back(body: str) -> bool:
    """Return True where machine code jumps to a label above."""
    seen = set()
    for line in body.splitlines():
        if label := LABEL.match(line):
            seen.add(label[1])
        elif (jump := JUMP.match(line)) and jump[1] in seen:
            return True
    return False


def chains(width: int) -> Any:
    """Return a kernel of independent chains of multiply-adds on `width` numbers at a time."""
    names = [f"x{k}" for k in range(CHAINS)]
    inner = [f"{x} = A[{width * k} + i]" for k, x in enumerate(names)]
    inner += [f"{x} = {x} * b + c" for _ in range(LINKS) for x in names]
    inner += [f"A[{width * k} + i] = {x}" for k, x in enumerate(names)]
    lines = ["def chained(A, passes, b, c):", "  for _ in range(passes):", f"    for i in range({width}):"]
    space: dict[str, Any] = {}
    exec("\n".join([*lines, *("      " + line for line in inner)]), space)
    return numba.njit(fastmath={"contract"}, error_model="numpy", nogil=True)(space["chained"])


@numba.njit(nogil=True)
def repeat(kernel: Any, times: int, L: FloatArray, start: FloatArray) -> None:
    """Make the same step again and again."""
    for _ in range(times):
        for k in range(len(start)):
            L[k] = start[k]
        kernel(L)


def peak(width: int, threads: int, rounds: int) -> float:
    """Return the operations per second of packed multiply-adds of one width, 0 where they cannot be had."""
    kernel = chains(width)
    code = machine_code(kernel, "void(float64[::1], int64, float64, float64)")
    if code.fused != CHAINS * LINKS or code.lone or code.width != width:
        return 0.0
    fields = [np.ones(width * CHAINS) for _ in range(threads)]
    with ThreadPoolExecutor(threads) as pool:
        took = shortest(lambda: list(pool.map(lambda numbers: kernel(numbers, PASSES, 0.5, 0.5), fields)), rounds)
    return threads * 2.0 * width * CHAINS * LINKS * PASSES / took


def lanes_in_contact(omega: float) -> FloatArray:
    """Return eight contact steps in progress."""
    L, draw = np.zeros(LANE_ENTRIES), np.random.default_rng(3)
    rows: dict[int, Any] = {
        LANE_U0: draw.uniform(0.8, 1.2, LANES), LANE_W0: draw.uniform(-0.3, 0.3, LANES), LANE_K: 2e-3, LANE_G: 7e-3,
        LANE_CUBIC: 1.0, LANE_LOAD: 1.0, LANE_UNTIL: inf, LANE_GOAL: log2(1e-7),
    }  # fmt: skip
    if omega:
        rows |= {LANE_AMP_SIN: -0.12, LANE_AMP_COS: -0.06, LANE_OMEGA: omega, LANE_RATE: omega / (2 * pi)}
    for row, values in rows.items():
        L[row : row + LANES] = values
    return L


@dataclass(frozen=True)
class Step:
    """A step of eight lanes: the operations in it, and how long it takes."""

    code: Code
    operations: int
    time: float  # s

    @property
    def speed(self) -> float:
        """Operations per second."""
        return self.operations / self.time


def step_of(which: str, rounds: int) -> Step:
    """Measure a lane kernel."""
    kernel = compiled(source_in_lanes(STEPS[which], DEFAULT_ORDER))
    anew = numba.njit(error_model="numpy", fastmath=FASTMATH)(kernel.py_func)
    code = machine_code(anew, "void(float64[::1])")
    L = lanes_in_contact(1.3 if which == "sinusoid" else 0.0)
    start = L[:LANE_K].copy()  # time and motion, which a step moves on
    repeat(anew, 1, L, start)
    took = shortest(lambda: repeat(anew, REPEATS, L, start), rounds) / REPEATS
    return Step(code, code.operations * (LANES // code.width if code.loops else 1), took)


def steps_counted(cells: Cells, chosen: Any) -> dict[str, float]:
    """Return how many steps of each kind the chosen cells take, on average."""
    total = dict.fromkeys(STEPS, 0)
    for cell in chosen:
        table = cells.pieces[cells.first[cell] : cells.first[cell] + cells.many[cell]]
        steps = march(Program(table, cells.numbers[cell])).steps
        flies = steps[:, PHASE] == FLIGHT
        waves = np.any(table[steps[:, PIECE].astype(int)][:, [SINE, COSINE]] != 0.0, axis=1)
        for name, which in (("level rail", ~flies & ~waves), ("sinusoid", ~flies & waves), ("flight", flies)):
            total[name] += int(which.sum())
    return {name: count / len(chosen) for name, count in total.items()}


def spent(cells: Cells, chosen: Any, steps: dict[str, Step]) -> float:
    """Return the operations of the steps of a cell, on average."""
    counted = steps_counted(cells, chosen)
    return sum(counted[name] * step.operations / LANES for name, step in steps.items())


@dataclass(frozen=True)
class Whole:
    """Many cells from start to end: what one of them takes, of the peak of the cores that are busy."""

    operations: float
    time: float  # s
    peak: float

    @property
    def speed(self) -> float:
        """Operations per second."""
        return self.operations / self.time


def bumps(cells: int, steps: dict[str, Step], best: float, rounds: int) -> Whole:
    """Measure the ensemble of bumps in lanes on one thread."""
    many = repeated(CASES["bump"], TRAJECTORIES["bump"], cells)
    took = shortest(lambda: march_in_lanes(many), rounds)
    return Whole(spent(many, range(TRAJECTORIES["bump"]), steps), took / len(many.first), best)


def charted(side: int, steps: dict[str, Step], best: float, rounds: int) -> Whole:
    """Measure the feature map in lanes on all cores."""
    cells = Map(side).lowered().cells
    took = shortest(lambda: march_all(cells, core_count(), lambda block, marched: None), rounds)
    return Whole(spent(cells, spread(side * side, SAMPLED), steps), took / side**2, best)


def show(peaks: dict[int, dict[int, float]], steps: dict[str, Step], wholes: dict[str, Whole]) -> None:
    """Print what was measured."""
    print("\nfraction of the measured peak of multiply-adds")
    for threads, found in peaks.items():
        widths = ", ".join(f"{speed / 1e9:.1f} GFlop/s in {64 * width} bits" for width, speed in found.items())
        print(f"  peak, cores used {threads}: {widths}")
    best = max(peaks[1].values())
    print(f"  {'a step of eight lanes':24}{'time, ns':>10}{'operations':>12}{'GFlop/s':>9}{'of peak':>9}")
    for name, step in steps.items():
        figures = f"{1e9 * step.time:10.1f}{step.operations:12d}{step.speed / 1e9:9.1f}{step.speed / best:9.0%}"
        print(f"  {name:24}{figures}")
    print(f"  {'a cell, start to end':24}{'time, us':>10}{'operations':>12}{'GFlop/s':>9}{'of peak':>9}")
    for name, whole in wholes.items():
        figures = (
            f"{1e6 * whole.time:10.2f}{whole.operations:12.0f}{whole.speed / 1e9:9.1f}{whole.speed / whole.peak:9.0%}"
        )
        print(f"  {name:24}{figures}")


def run(side: int, cells: int, rounds: int) -> dict[str, Any]:
    """Measure peak and lanes, print them, and return them as plain data."""
    if platform.machine() not in ("x86_64", "AMD64"):
        print("\nfraction of the peak: operations are counted in x86 machine code only")
        return {}
    threads = core_count()
    peaks = {n: {width: peak(width, n, rounds) for width in (4, 8)} for n in sorted({1, threads})}
    best, together = max(peaks[1].values()), max(peaks[threads].values())
    steps = {name: step_of(name, rounds) for name in STEPS}
    wholes = {
        "bump, one thread": bumps(cells, steps, best, rounds),
        f"map, {threads} threads": charted(side, steps, together, rounds),
    }
    show(peaks, steps, wholes)
    return {
        "operations_per_second": {n: {64 * width: speed for width, speed in f.items()} for n, f in peaks.items()},
        "steps": {n: vars(s.code) | {"time": s.time, "eight_lanes": s.operations} for n, s in steps.items()},
        "cells": {n: vars(w) | {"fraction": w.speed / w.peak} for n, w in wholes.items()},
    }


def main() -> None:
    """Measure, print and store."""
    smallest = parser_of(__doc__).parse_args().smallest
    around = prepare()
    found = run(16, 64, 1) if smallest else run(256, CELLS, 10)
    if not smallest:
        store("peak", around | found)


if __name__ == "__main__":
    main()
