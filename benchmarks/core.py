"""Compare the core with its peers: time ratios at matched accuracy, all codes interleaved in one run.

    uv run --group peers python benchmarks/core.py [--rounds 10] [--case bump]

The rules are in README.md beside this file.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import platform
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import pairwise
from math import exp, log
from pathlib import Path
from typing import Any

from own import march_case, scenario, simulate_case
from peer_cvode import Cvode
from peer_diffrax import Diffrax, numbers
from peer_heyoka import Heyoka
from peer_scipy import Scipy
from problems import CASES, Case, Runner, check_counts, largest_force_error, largest_time_error, scaled
from reference import RESULTS, cached

import wheeltapper as wt

OWN = "wheeltapper"
HEYOKA_TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12, 0.0)
SCIPY_TOLERANCES = (1e-9, 1e-11, 1e-13, 2.5e-14)
CVODE_TOLERANCES = (1e-10, 1e-12, 1e-13)
DIFFRAX_TOLERANCES = (1e-8, 1e-10, 1e-12)
CALLS = 5
"""Calls of a fast code in one round."""
SLOW_ROUNDS = 3
"""Rounds in which a slow code is called, once."""


@dataclass
class Entry:
    """A code at one setting: what it costs and how large its error is."""

    code: str
    setting: str
    runner: Runner
    slow: bool = False
    compared: bool = True
    times: list[float] = field(default_factory=list)
    force_error: float = 0.0
    time_error: float = 0.0

    @property
    def time(self) -> float:
        """The shortest time, s."""
        return min(self.times)


def entries(case: Case) -> list[Entry]:
    """Return all codes at all settings, prepared for a case."""
    problem = scaled(case)
    own = [Entry(OWN, method, march_case(case.name, method)) for method in ("default", "strict")]
    whole = [Entry("simulate()", "default", simulate_case(case.name, "default"), compared=False)]
    heyoka = [Entry("heyoka", f"{t:.0e}" if t else "round-off", Heyoka(problem, t)) for t in HEYOKA_TOLERANCES]
    scipy = [Entry("scipy DOP853", f"{t:.1e}", Scipy(problem, t), slow=True) for t in SCIPY_TOLERANCES]
    cvode = [Entry("CVODE Adams", f"{t:.1e}", Cvode(problem, t), slow=True) for t in CVODE_TOLERANCES]
    return own + whole + heyoka + scipy + cvode


def without_events(case: Case) -> list[dict[str, Any]]:
    """Measure diffrax, which knows no events: time, and error of the last state against our strict method."""
    problem = scaled(case)
    record = wt.simulate(scenario(case), method="strict")
    last = record.at(record.end).indentation.values.item()
    length = (problem.force_unit / float(case.constant)) ** (2 / 3)
    rows = []
    for tolerance in DIFFRAX_TOLERANCES:
        runner, times = Diffrax(numbers(problem), tolerance), []
        for _ in range(SLOW_ROUNDS):
            start = time.perf_counter()
            found = runner()
            times.append(time.perf_counter() - start)
        error = abs(float(found[0]) - last / length)
        rows.append({"setting": f"{tolerance:.0e}", "time": min(times), "error_of_last_indentation": error})
    return rows


def judge(case: Case, codes: Sequence[Entry]) -> None:
    """Check every code's counts and set its errors; this is also the run that warms it up."""
    reference = cached(case)
    check_counts("the reference", case, reference)
    for entry in codes:
        found = entry.runner.read(entry.runner())
        check_counts(f"{entry.code} {entry.setting}", case, found)
        entry.force_error = largest_force_error(found, reference)
        entry.time_error = largest_time_error(found, reference)


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Keep Python's garbage collector from stepping into a timed call."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def measure(codes: Sequence[Entry], rounds: int) -> None:
    """Time all codes, one after the other in each round."""
    for turn in range(rounds):
        for entry in codes:
            if entry.slow and turn >= SLOW_ROUNDS:
                continue
            with no_garbage_collection():
                for _ in range(1 if entry.slow else CALLS):
                    start = time.perf_counter()
                    entry.runner()
                    entry.times.append(time.perf_counter() - start)


@dataclass(frozen=True)
class Match:
    """A peer's time at our accuracy, over our time.

    `bound` is "" where the peer's curve covers our accuracy; ">" where the peer is not so accurate at any setting, so
    that its most accurate setting stands in; "<" where it is more accurate at every setting.
    """

    method: str
    peer: str
    ratio: float
    bound: str


def match(own: Entry, peer: Sequence[Entry]) -> Match:
    """Compare at our eN, on the peer's curve of log time over log eN."""
    curve = sorted(((log(e.force_error), log(e.time)) for e in peer), reverse=True)
    at, name = log(own.force_error), peer[0].code
    if at >= curve[0][0] or at <= curve[-1][0]:
        bound, (_, height) = ("<", curve[0]) if at >= curve[0][0] else (">", curve[-1])
        return Match(own.setting, name, exp(height) / own.time, bound)
    (x0, y0), (x1, y1) = next((a, b) for a, b in pairwise(curve) if b[0] < at)
    height = y0 + (y1 - y0) * (at - x0) / (x1 - x0)
    return Match(own.setting, name, exp(height) / own.time, "")


def matches(codes: Sequence[Entry]) -> list[Match]:
    """Compare each of our methods with each peer."""
    ours = [e for e in codes if e.code == OWN]
    peers: dict[str, list[Entry]] = {}
    for entry in codes:
        if entry.compared and entry.code != OWN:
            peers.setdefault(entry.code, []).append(entry)
    return [match(own, peer) for own in ours for peer in peers.values()]


def show(case: Case, codes: Sequence[Entry], found: Sequence[Match]) -> None:
    """Print what was measured."""
    print(f"\n{case.name}: {case.impacts} impacts and {case.maxima} force maxima, found by every code")
    print(f"  {'code':14}{'setting':>12}{'time, ms':>12}{'eN':>11}{'event times, s':>17}")
    for e in codes:
        print(f"  {e.code:14}{e.setting:>12}{1e3 * e.time:12.3f}{e.force_error:11.1e}{e.time_error:17.1e}")
    print("  time ratios at matched eN")
    for m in found:
        print(f"    {m.peer:14} / {OWN} {m.method:8}{m.bound or ' ':>3} {m.ratio:.3g}")


def cpu() -> str:
    """Return the processor's name."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def commit() -> str:
    """Return the commit of the source, with a sign if it was changed since."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        done = subprocess.run(command, cwd=RESULTS.parent.parent, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return done.stdout.strip()


def surroundings() -> dict[str, Any]:
    """Return what the figures depend on besides the codes."""
    packages = (
        "wheeltapper",
        "heyoka",
        "scipy",
        "scikit-sundae",
        "diffrax",
        "jax",
        "numpy",
        "numba",
        "llvmlite",
        "mpmath",
    )
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit(),
        "cpu": cpu(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.machine()}",
        "versions": {"python": platform.python_version()} | {name: version(name) for name in packages},
    }


def row(entry: Entry) -> dict[str, Any]:
    """Return an entry as plain data."""
    names = ("code", "setting", "time", "force_error", "time_error")
    return {name: getattr(entry, name) for name in names} | {"repeats": len(entry.times)}


def run_case(case: Case, rounds: int) -> dict[str, Any]:
    """Measure a case, print it, and return it as plain data."""
    codes = entries(case)
    judge(case, codes)
    measure(codes, rounds)
    found = matches(codes)
    show(case, codes, found)
    blind = without_events(case)
    print("  diffrax DOPRI8, without events: time and error of the last indentation (over the static one)")
    for line in blind:
        own = codes[0].time
        print(
            f"    {line['setting']:>8}{1e3 * line['time']:12.3f} ms{line['error_of_last_indentation']:11.1e}"
            f"    {line['time'] / own:.3g} times {OWN} default, which finds the events"
        )
    return {"rows": [row(e) for e in codes], "ratios": [vars(m) for m in found], "without_events": blind}


def arguments() -> argparse.ArgumentParser:
    """Return the options of the core's cases."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--rounds", type=int, default=10, help="rounds of the interleaved measurement (default 10)")
    parser.add_argument("--case", choices=sorted(CASES), action="append", help="only this case (may be repeated)")
    return parser


def introduced() -> dict[str, Any]:
    """Print and return what the figures depend on."""
    warnings.filterwarnings("ignore", message="the irregularity is more sharply hollow")  # true, and meant so
    around = surroundings()
    print(f"{around['cpu']}, {around['cores']} cores, load {around['load']}")
    print(", ".join(f"{name} {number}" for name, number in around["versions"].items()))
    return around


def store(kind: str, result: dict[str, Any]) -> None:
    """Write a result, with its date in its name."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{kind}-{datetime.now(UTC):%Y%m%dT%H%M%S}.json"
    path.write_text(json.dumps(result, indent=1), encoding="utf-8")
    print(f"\nwritten to {path}", file=sys.stderr)


def run(asked: argparse.Namespace) -> dict[str, Any]:
    """Measure the cases that are asked for."""
    return {name: run_case(CASES[name], asked.rounds) for name in asked.case or CASES}


def main() -> None:
    """Measure, print and store."""
    parser = argparse.ArgumentParser(description="Compare wheeltapper's core with its peers.", parents=[arguments()])
    asked = parser.parse_args()
    store("core", introduced() | {"cases": run(asked)})


if __name__ == "__main__":
    main()
