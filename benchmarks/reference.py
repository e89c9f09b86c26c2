"""Reference solutions of the benchmark cases: Taylor series of high order in numbers of many digits.

The method shares no code and no search for events with any of the codes compared: mpmath, order 36, 34 digits, and
signs looked at in many points of each short step. The result is kept in the folder `results`, which git ignores.

    python benchmarks/reference.py            compute what is missing
    python benchmarks/reference.py --check    compute again with 44 digits and order 46, and print the differences
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import mpmath  # type: ignore[import-untyped]
import numpy as np
from mpmath import mp
from options import parser_of
from problems import (
    CASES,
    Case,
    Number,
    Outcome,
    Piece,
    Scaled,
    largest_end_error,
    largest_force_error,
    largest_time_error,
    scaled,
)

RESULTS = Path(__file__).resolve().parent / "results"
DIGITS, ORDER = 34, 36
LOOKS = 8
"""Points of a step in which the signs are looked at."""

Series = list[Number]
Table = dict[str, list[float]]


def product(a: Series, b: Series, n: int) -> Number:
    """Return the coefficient n of the product of two series."""
    return mp.fdot(a[: n + 1], b[n::-1])


def value(series: Sequence[Number], s: Number) -> Number:
    """Return the value of a series at s."""
    return mp.polyval(series[::-1], s)


class Wave:
    """The series of F along the series of t, order by order."""

    def __init__(self, problem: Scaled, piece: Piece, t: Series) -> None:
        self.piece, self.omega, self.t = piece, problem.frequency, t
        self.sine, self.cosine = [mp.sin(self.omega * t[0])], [mp.cos(self.omega * t[0])]

    def coefficient(self, n: int) -> Number:
        """Return the coefficient n of F; asked in order, from zero."""
        if n:
            rates = [self.omega * k * self.t[k] for k in range(1, n + 1)]
            sine = mp.fdot(rates, self.cosine[n - 1 :: -1]) / n
            cosine = -mp.fdot(rates, self.sine[n - 1 :: -1]) / n
            self.sine.append(sine)
            self.cosine.append(cosine)
        total = self.piece.sine * self.sine[n] + self.piece.cosine * self.cosine[n]
        return total + self.piece.constant if n == 0 else total


def contact_series(problem: Scaled, piece: Piece, time: Number, u0: Number, w0: Number) -> tuple[Series, ...]:
    """Return the series of t, u and w in s, where the indentation is u² and dt = u ds."""
    t, u, w, q, g = [time], [u0], [w0], [], []
    wave = Wave(problem, piece, t)
    for n in range(ORDER):
        q.append(product(u, u, n))
        g.append(wave.coefficient(n) - problem.stiffness * q[n] - problem.damping * w[n] - product(q, u, n))
        t.append(u[n] / (n + 1))
        u.append(w[n] / (2 * (n + 1)))
        w.append(product(u, g, n) / (n + 1))
    return t, u, w


def flight_series(problem: Scaled, piece: Piece, time: Number, d0: Number, w0: Number) -> tuple[Series, ...]:
    """Return the series of t, of the (negative) indentation and of its rate in the time since `time`."""
    zero = mp.mpf(0)
    t, d, w = [time, mp.mpf(1)] + [zero] * ORDER, [d0], [w0]
    wave = Wave(problem, piece, t)
    for n in range(ORDER):
        rate = wave.coefficient(n) - problem.stiffness * d[n] - problem.damping * w[n]
        d.append(w[n] / (n + 1))
        w.append(rate / (n + 1))
    return t[: ORDER + 1], d, w


def step_length(series: Sequence[Series]) -> Number:
    """Return a step whose neglected terms lie beyond the last digit."""
    small = mp.mpf(10) ** (2 - mp.dps)
    sizes = [(max(abs(x[n]) for x in series), n) for n in (ORDER - 1, ORDER)]
    return min(mp.mpf("0.5"), *((small / size) ** (mp.mpf(1) / n) / 2 for size, n in sizes if size > 0))


def polished(series: Series, low: Number, high: Number) -> Number:
    """Return the root in [low, high], at whose ends the signs differ, by bisection and Newton's method."""
    below = value(series, high) > 0
    for _ in range(12):
        middle = (low + high) / 2
        low, high = (low, middle) if (value(series, middle) > 0) == below else (middle, high)
    slope = [k * c for k, c in enumerate(series)][1:]
    root = (low + high) / 2
    for _ in range(12):
        root -= value(series, root) / value(slope, root)
    return root


def first_crossing(series: Series, length: Number, rising: bool) -> Number | None:
    """Return the first zero in (0, length] with the wanted direction, or None."""
    sign = 1 if rising else -1
    looks = [length * k / LOOKS for k in range(LOOKS + 1)]
    values = [sign * value(series, s) for s in looks]
    for k in range(LOOKS):
        before = values[k] < 0 if k else values[1] < 0 or sign * next(c for c in series if c) < 0
        if before and values[k + 1] >= 0:
            return polished(series, looks[k], looks[k + 1])
    return None


class Walk:
    """The march of one case, event by event."""

    def __init__(self, case: Case) -> None:
        self.problem = scaled(case, mp.mpf, +mp.pi)
        self.time, self.first, self.rate, self.touching = mp.mpf(0), self.problem.root, self.problem.rate, True
        self.found: Table = {"losses": [], "impacts": [], "peak_times": [], "peak_forces": []}

    def run(self) -> Table:
        """Return the times in s, the forces in N and the last state in scaled numbers."""
        for piece in self.problem.pieces:
            while self.time < piece.stop:
                self.step(piece)
        return self.found | {"end": [float(self.first**2 if self.touching else self.first), float(self.rate)]}

    def step(self, piece: Piece) -> None:
        """Make one step, as far as the next event or the end of the piece."""
        make = contact_series if self.touching else flight_series
        t, first, rate = make(self.problem, piece, self.time, self.first, self.rate)
        length = step_length((first, rate))
        ends = value(t, length) >= piece.stop
        if ends:
            length = polished([t[0] - piece.stop, *t[1:]], mp.mpf(0), length)
        crossing = first_crossing(first, length, rising=not self.touching)
        length = length if crossing is None else crossing
        if self.touching:
            self.note_maximum(t, first, rate, length)
        self.time = piece.stop if ends and crossing is None else value(t, length)
        self.first, self.rate = value(first, length), value(rate, length)
        if crossing is not None:
            self.change()

    def change(self) -> None:
        """Go from contact to flight, or back."""
        self.first = mp.mpf(0)
        self.found["losses" if self.touching else "impacts"].append(float(self.time * self.problem.time_unit))
        self.touching = not self.touching

    def note_maximum(self, t: Series, u: Series, w: Series, length: Number) -> None:
        """Keep the force maximum inside a contact step."""
        at = first_crossing(w, length, rising=False)
        if at is not None:
            self.found["peak_times"].append(float(value(t, at) * self.problem.time_unit))
            self.found["peak_forces"].append(float(value(u, at) ** 3 * self.problem.force_unit))


def compute(case: Case, digits: int = DIGITS, order: int = ORDER) -> Outcome:
    """Return the reference solution of a case."""
    global ORDER
    kept, ORDER = ORDER, order
    with mpmath.workdps(digits):
        found = Walk(case).run()
    ORDER = kept
    return outcome(found)


def outcome(found: Table) -> Outcome:
    """Return a table as arrays."""
    return Outcome(**{name: np.array(column) for name, column in found.items()})


def cached(case: Case, make: Callable[[Case], Outcome] = compute) -> Outcome:
    """Return the reference solution, from the folder of results if it was computed for the same case before."""
    path = RESULTS / f"reference-{case.name}.json"
    if path.exists():
        kept = json.loads(path.read_text(encoding="utf-8"))
        if kept["case"] == case.inputs and "end" in kept["found"]:
            return outcome(kept["found"])
    print(f"computing the reference solution of {case.name} (about a minute, once)", file=sys.stderr)
    found = make(case)
    RESULTS.mkdir(exist_ok=True)
    table = {name: column.tolist() for name, column in vars(found).items()}
    path.write_text(json.dumps({"case": case.inputs, "found": table}), encoding="utf-8")
    return found


def main() -> None:
    parser = parser_of("Compute the reference solutions that are missing.")
    parser.add_argument("--check", action="store_true", help="compute again with 44 digits and order 46, and compare")
    options = parser.parse_args()
    if options.smallest:
        short = replace(CASES["bump"], duration="0.01")
        print(f"bump, {short.duration} s: {len(compute(short, digits=20, order=12).losses)} losses")
        return
    for case in CASES.values():
        found = cached(case)
        print(f"{case.name}: {len(found.impacts)} impacts, {len(found.peak_forces)} force maxima")
        if options.check:
            finer = compute(case, digits=44, order=46)
            force, time = largest_force_error(found, finer), largest_time_error(found, finer)
            print(f"  against 44 digits, order 46: forces differ by {force:.1e} (relative), times by {time:.1e} s,")
            print(f"  the last state by {largest_end_error(found, finer):.1e}")


if __name__ == "__main__":
    main()
