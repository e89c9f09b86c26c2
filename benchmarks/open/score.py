"""Score answers to the cases of this folder. It needs Python 3.11 and NumPy, and nothing else.

    python benchmarks/open/score.py RESULTS_FOLDER [--case NAME] [--digits 3]

RESULTS_FOLDER holds files NAME.csv, in the format of README.md. A case without a file counts as not run. The exit code
is 0 if all given cases pass, 1 if one fails, and 2 where a file cannot be read.
"""

from __future__ import annotations

import argparse
import math
import sys
from itertools import zip_longest
from pathlib import Path

import numpy as np
from reading import COLUMNS, HERE, STATE, Row, names, read

MOST = 16.0
"""Digits beyond which the truth's own rounding begins."""


HEADS = ("events", "maxima at", "forces", "state")
"""What is scored: times of events, times of force maxima, their forces, the state at the end."""


class BadInputError(Exception):
    """A file that cannot be scored."""


def answer(path: Path) -> list[Row]:
    """Return the rows of an answer."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(f"{path.name}: cannot be read: {error}") from error
    if not lines or [one.strip() for one in lines[0].split(",")] != list(COLUMNS):
        raise BadInputError(f"{path.name}, line 1: expected {','.join(COLUMNS)}")
    rows = []
    for k, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        cells = [one.strip() for one in line.split(",")]
        if len(cells) != len(COLUMNS):
            raise BadInputError(f"{path.name}, line {k}: {len(cells)} columns, expected {len(COLUMNS)}")
        valued = cells[0] == "maximum" or cells[0] in STATE
        try:
            row = Row(cells[0], int(cells[1]), float(cells[2]), float(cells[3]) if valued else None)
        except ValueError as error:
            raise BadInputError(f"{path.name}, line {k}: {error}") from error
        if not (math.isfinite(row.time) and (row.value is None or math.isfinite(row.value))):
            raise BadInputError(f"{path.name}, line {k}: a number that is not finite")
        rows.append(row)
    return rows


def digits_of(error: float) -> float:
    """Return how many digits are right, from a relative error."""
    return min(MOST, -math.log10(error)) if error > 0.0 else MOST


def largest(mine: list[Row], true: list[Row], field: str, scale: float) -> float:
    """Return the digits of the worst pair."""
    a, b = (np.array([getattr(row, field) for row in rows], dtype=float) for rows in (mine, true))
    return digits_of(float(np.max(np.abs(a - b))) / scale) if len(b) else math.nan


def difference(mine: list[Row], true: list[Row], what: str) -> str:
    """Return where two lists of events differ in kind or number, or an empty text."""
    for k, (a, b) in enumerate(zip_longest(mine, true), 1):
        if a is None or b is None or a[:2] != b[:2]:
            said = [f"{row.kind} {row.number} at {row.time:.6g} s" if row else "nothing" for row in (a, b)]
            return f"{len(mine)} {what} for {len(true)}: number {k} is {said[0]}, in truth {said[1]}"
    return ""


def parted(rows: list[Row]) -> dict[str, list[Row]]:
    """Return the events and the maxima in the order of time, and the state in that of its numbers."""
    out: dict[str, list[Row]] = {"events": [], "maxima": [], "state": []}
    for row in sorted(rows, key=lambda row: row.time):
        out["state" if row.kind in STATE else "maxima" if row.kind == "maximum" else "events"].append(row)
    out["state"].sort(key=lambda row: row[:2])
    return out


def score(name: str, rows: list[Row]) -> tuple[dict[str, float], str]:
    """Return the digits of each quantity of a case, and why it fails; an empty text where it counted right."""
    case, truth = read(name), answer(HERE / "truth" / f"{name}.csv")
    above = case["ask"]["maxima_above"]
    rows = [row for row in rows if row.kind != "maximum" or row.value > above]
    mine, true = parted(rows), parted(truth)
    for kind, several in (("loss", "losses"), ("impact", "impacts")):
        found, there = (sum(row.kind == kind for row in one["events"]) for one in (mine, true))
        if found != there:
            return {}, f"{'missed' if found < there else 'invented'} a loss: {found} {several}, {there} in truth"
    for key in true:
        wrong = difference(mine[key], true[key], "force maxima" if key == "maxima" else key)
        if wrong:
            return {}, wrong
    force = max((row.value for row in true["maxima"]), default=1.0)
    duration = case["duration"]
    state = []
    for kind in STATE:
        a, b = ([row for row in one["state"] if row.kind == kind] for one in (mine, true))
        state.append(largest(a, b, "value", case["ask"][kind]))
    return {
        "events": largest(mine["events"], true["events"], "time", duration),
        "maxima at": largest(mine["maxima"], true["maxima"], "time", duration),
        "forces": largest(mine["maxima"], true["maxima"], "value", force),
        "state": min(state),
    }, ""


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="folder of NAME.csv files")
    parser.add_argument("--case", help="score this case only")
    parser.add_argument("--digits", type=float, default=3.0, help="fewest digits of all quantities that pass (3)")
    options = parser.parse_args(arguments)
    try:
        if not options.folder.is_dir():
            raise BadInputError(f"{options.folder}: no such folder")
        if options.case and options.case not in names():
            raise BadInputError(f"{options.case}: no such case; cases are {', '.join(names())}")
        wanted = [options.case] if options.case else names()
        given = {name: options.folder / f"{name}.csv" for name in wanted}
        given = {name: path for name, path in given.items() if path.exists()}
        if not given:
            raise BadInputError(f"{options.folder}: no answer to any case, such as {wanted[0]}.csv")
        answers = {name: answer(path) for name, path in given.items()}
    except BadInputError as error:
        print(error, file=sys.stderr)
        return 2
    print(f"{'case':20s}" + "".join(f"{head:>11s}" for head in HEADS) + "   verdict")
    failed = 0
    for name in wanted:
        if name not in answers:
            print(f"{name:20s}" + f"{'-':>11s}" * len(HEADS) + "   not run")
            continue
        digits, why = score(name, answers[name])
        worst = min((one for one in digits.values() if not math.isnan(one)), default=0.0)
        if not why and worst < options.digits:
            why = f"{worst:.1f} digits are less than {options.digits:g}"
        failed += bool(why)
        shown = ["-" if math.isnan(digits.get(head, math.nan)) else f"{digits[head]:.1f}" for head in HEADS]
        print(f"{name:20s}" + "".join(f"{one:>11s}" for one in shown) + "   " + (f"FAIL: {why}" if why else "pass"))
    print(f"{len(answers) - failed} passed, {failed} failed, {len(wanted) - len(answers)} not run")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
