"""Compare the core with its peers: time ratios at matched accuracy, all codes interleaved in one run.

    uv run --group peers python benchmarks/core.py [--rounds 10] [--case bump]

The rules are in README.md beside this file.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import nan
from typing import Any

from machine import no_garbage_collection, prepare, seconds, store
from matching import Match, Point, match
from options import need_peers, parser_of
from own import march_case, simulate_case
from peer_scipy import Scipy
from problems import (
    CASES,
    Case,
    Runner,
    check_counts,
    largest_end_error,
    largest_force_error,
    largest_time_error,
    scaled,
)
from reference import cached

OWN = "wheeltapper"
HEYOKA_TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12, 0.0)
SCIPY_TOLERANCES = (1e-9, 1e-11, 1e-13, 2.5e-14)
CVODE_TOLERANCES = (1e-10, 1e-12, 1e-13, 1e-14, 2e-15)
DIFFRAX_TOLERANCES = {"Tsit5": (1e-8, 1e-10, 1e-12, 1e-13, 1e-14), "Dopri8": (1e-10, 1e-12, 1e-13)}
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
    finds_events: bool = True
    times: list[float] = field(default_factory=list)
    force_error: float = nan
    time_error: float = nan
    end_error: float = nan

    @property
    def time(self) -> float:
        """The shortest time, s."""
        return min(self.times)


def entries(case: Case) -> list[Entry]:
    """Return all codes at all settings, prepared for a case."""
    from peer_cvode import Cvode
    from peer_diffrax import Diffrax
    from peer_heyoka import Heyoka

    problem = scaled(case)
    own = [Entry(OWN, method, march_case(case.name, method)) for method in ("default", "strict")]
    whole = [Entry("simulate()", "default", simulate_case(case.name, "default"), compared=False)]
    heyoka = [Entry("heyoka", f"{t:.0e}" if t else "round-off", Heyoka(problem, t)) for t in HEYOKA_TOLERANCES]
    scipy = [Entry("scipy DOP853", f"{t:.1e}", Scipy(problem, t), slow=True) for t in SCIPY_TOLERANCES]
    cvode = [Entry("CVODE Adams", f"{t:.0e}", Cvode(problem, t), slow=True) for t in CVODE_TOLERANCES]
    diffrax = [
        Entry(f"diffrax {solver}", f"{t:.0e}", Diffrax(problem, solver, t), slow=True, finds_events=False)
        for solver, tolerances in DIFFRAX_TOLERANCES.items()
        for t in tolerances
    ]
    return own + whole + heyoka + scipy + cvode + diffrax


def judge(case: Case, codes: Sequence[Entry]) -> None:
    """Check every code's counts and set its errors; this is also the run that warms it up."""
    reference = cached(case)
    check_counts("the reference", case, reference)
    for entry in codes:
        found = entry.runner.read(entry.runner())
        entry.end_error = largest_end_error(found, reference)
        if entry.finds_events:
            check_counts(f"{entry.code} {entry.setting}", case, found)
            entry.force_error = largest_force_error(found, reference)
            entry.time_error = largest_time_error(found, reference)


def measure(codes: Sequence[Entry], rounds: int) -> None:
    """Time all codes, one after the other in each round."""
    for turn in range(rounds):
        for entry in codes:
            if entry.slow and turn >= SLOW_ROUNDS:
                continue
            with no_garbage_collection():
                for _ in range(1 if entry.slow else CALLS):
                    entry.times.append(seconds(entry.runner))


def matches(codes: Sequence[Entry]) -> list[Match]:
    """Compare each of our methods with each peer: by eN, or by the last state with a peer that finds no events."""
    ours = [e for e in codes if e.code == OWN]
    peers: dict[str, list[Entry]] = {}
    for entry in codes:
        if entry.compared and entry.code != OWN:
            peers.setdefault(entry.code, []).append(entry)
    return [
        match(own.setting, point(own, peer[0]), name, [point(e, e) for e in peer])
        for own in ours
        for name, peer in peers.items()
    ]


def point(entry: Entry, peer: Entry) -> Point:
    """Return time and error of a code, the error being one that the peer has too."""
    return Point(entry.force_error if peer.finds_events else entry.end_error, entry.time)


def show(case: Case, codes: Sequence[Entry], found: Sequence[Match]) -> None:
    """Print what was measured."""
    print(f"\n{case.name}: {case.impacts} impacts and {case.maxima} force maxima, found by every code with events;")
    print("  one trajectory, one thread, latency")
    print(f"  {'code':16}{'setting':>10}{'time, ms':>12}{'eN':>11}{'event times, s':>17}{'last state':>13}")
    for e in codes:
        events = f"{e.force_error:11.1e}{e.time_error:17.1e}" if e.finds_events else f"{'no events':>28}"
        end = f"{e.end_error:13.1e}" if e.end_error == e.end_error else f"{'-':>13}"
        print(f"  {e.code:16}{e.setting:>10}{1e3 * e.time:12.3f}{events}{end}")
    print("  time ratios at matched eN; diffrax at a matched error of the last state, without events")
    for m in found:
        print(f"    {m}")


def row(entry: Entry) -> dict[str, Any]:
    """Return an entry as plain data."""
    names = ("code", "setting", "time", "force_error", "time_error", "end_error")
    return {name: getattr(entry, name) for name in names} | {"repeats": len(entry.times)}


def run(case: Case, rounds: int) -> dict[str, Any]:
    """Measure a case, print it, and return it as plain data."""
    codes = entries(case)
    judge(case, codes)
    measure(codes, rounds)
    found = matches(codes)
    show(case, codes, found)
    return {"rows": [row(e) for e in codes], "ratios": [vars(m) for m in found]}


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = parser_of("Compare wheeltapper's core with its peers.")
    parser.add_argument("--rounds", type=int, default=10, help="rounds of the interleaved measurement (default 10)")
    parser.add_argument("--case", choices=sorted(CASES), action="append", help="only this case (may be repeated)")
    return parser.parse_args()


def main() -> None:
    options = arguments()
    need_peers()
    around = prepare()
    names, rounds = (["bump"], 1) if options.smallest else (options.case or CASES, options.rounds)
    found = {name: run(CASES[name], rounds) for name in names}
    if not options.smallest:
        store("core", around | {"cases": found})


if __name__ == "__main__":
    main()
