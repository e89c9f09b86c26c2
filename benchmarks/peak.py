"""How much of the processor the lanes use: their arithmetic per second against the machine's own peak, measured here.

    uv run python benchmarks/peak.py

The peak is that of long independent chains of packed multiply-adds on one core. What a lane kernel does is counted in
its machine code: packed multiply-adds as two operations per entry, packed sums, differences and products as one.
"""

from __future__ import annotations

import re
import time
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from wheeltapper.march import lane_rows as lane
from wheeltapper.march import unrolled_lanes
from wheeltapper.march.kernel import FASTMATH

FloatArray = NDArray[np.float64]
CHAINS, LENGTH = 12, 40
ENTRIES = {"x": 2, "y": 4, "z": 8}
PACKED = re.compile(r"\bv(fn?m(?:add|sub)\d+|add|sub|mul)pd\b[^\n]*%([xyz])mm")


def _chains() -> Any:
    """Return a kernel of independent chains of multiply-adds, eight lanes wide."""
    names = [f"a{k}" for k in range(CHAINS)]
    body = [f"{name} = L[{8 * k} + i]" for k, name in enumerate(names)]
    body += [f"{name} = {name} * x + y" for _ in range(LENGTH) for name in names]
    body += [f"L[{8 * k} + i] = {name}" for k, name in enumerate(names)]
    lines = ["def chains(L, x, y):", "    for i in range(8):", *("        " + line for line in body)]
    scope: dict[str, Any] = {}
    exec("\n".join(lines), scope)
    return numba.njit(error_model="numpy", fastmath=FASTMATH - {"reassoc"})(scope["chains"])


@numba.njit
def _repeat_chains(chains: Any, times: int, L: FloatArray) -> None:
    for _ in range(times):
        chains(L, 0.999, 0.001)


@numba.njit
def _repeat(kernel: Any, times: int, L: FloatArray, kept: FloatArray) -> None:
    for _ in range(times):
        kernel(L)
        for k in range(len(kept)):
            L[k] = kept[k]


def operations(kernel: Any) -> int:
    """Return the floating-point operations of one call for all eight lanes, counted in the machine code."""
    anew = numba.njit(error_model="numpy", fastmath=FASTMATH)(kernel.py_func)
    anew.compile("void(float64[::1])")
    (code,) = anew.inspect_asm().values()
    passes = {2: 4, 4: 2, 8: 1}
    total = 0
    for name, width in PACKED.findall(code):
        entries = ENTRIES[width]
        total += (2 if name.startswith("f") else 1) * entries * passes[entries]
    return total


def shortest(run: Any, rounds: int = 7) -> float:
    """Return the shortest time of some runs, s."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def working_lanes(omega: float) -> FloatArray:
    """Return eight contact steps in progress."""
    L = np.zeros(lane.ENTRIES)
    rows = {
        lane.U0: np.linspace(0.8, 1.2, 8), lane.W0: 0.3, lane.K: 0.004, lane.G: 0.002, lane.LOAD: 1.0,
        lane.GAIN_SIN: 0.2, lane.GAIN_COS: 0.1, lane.OMEGA: omega, lane.RATE: omega / (2 * np.pi), lane.UNTIL: np.inf,
        lane.GOAL: np.log2(1e-7),
    }  # fmt: skip
    for row, value in rows.items():
        L[row : row + 8] = value
    return L


def measure() -> dict[str, Any]:
    """Measure the peak and the lane kernels on one core; print and return them."""
    chains, repeats = _chains(), 200_000
    L = np.full(8 * CHAINS, 0.5)
    _repeat_chains(chains, 1, L)
    peak = 2.0 * 8 * CHAINS * LENGTH * repeats / shortest(lambda: _repeat_chains(chains, repeats, L))
    result: dict[str, Any] = {"peak_gflops": peak / 1e9, "kernels": {}}
    print(f"\npeak of packed multiply-adds on one core: {peak / 1e9:.0f} GFlop/s")
    for name, omega in (("lanes_flat_12", 0.0), ("lanes_wave_12", 1.0)):
        kernel, L = getattr(unrolled_lanes, name), working_lanes(omega)
        kept = L[: 3 * 8].copy()
        _repeat(kernel, 1, L, kept)
        took = shortest(lambda kernel=kernel, L=L, kept=kept: _repeat(kernel, repeats, L, kept)) / repeats  # type: ignore[misc]
        count = operations(kernel)
        share = count / took / peak
        result["kernels"][name] = {"time": took, "operations": count, "share_of_peak": share}
        print(f"  {name}: {1e9 * took:.0f} ns for eight steps, {count} operations, {100 * share:.0f} % of the peak")
    return result


if __name__ == "__main__":
    measure()
