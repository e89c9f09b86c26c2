"""Run all programs, score them, and write results.csv and the tables of README.md.

python benchmarks/open/table.py             ten minutes; truth and agreement.csv have to be there
python benchmarks/open/table.py --kept      the tables alone, from results.csv and agreement.csv
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Callable

import run_peers
import run_wheeltapper
from reading import HERE, STATE, Row, names
from score import HEADS, answer, score

PROGRAMS: dict[str, Callable[[str], list[Row] | None]] = {
    "wheeltapper, default": lambda name: run_wheeltapper.run(name, "default"),
    "wheeltapper, strict": lambda name: run_wheeltapper.run(name, "strict"),
    "SciPy DOP853": lambda name: run_peers.run(name, "dop853"),
    "CVODE Adams": lambda name: run_peers.run(name, "cvode"),
    "heyoka": lambda name: run_peers.run(name, "heyoka"),
    "naive RK45": lambda name: run_peers.run(name, "naive"),
}
RESULTS, AGREEMENT = HERE / "results.csv", HERE / "agreement.csv"


def results() -> list[list[str]]:
    """Return what each program reaches in each case."""
    lines = []
    for program, run in PROGRAMS.items():
        for name in names():
            rows = run(name)
            if rows is None:
                continue
            digits, why = score(name, rows)
            shown = [f"{digits[head]:.1f}" if not math.isnan(digits.get(head, math.nan)) else "" for head in HEADS]
            lines.append([program, name, *shown, why])
            print(", ".join(lines[-1]), flush=True)
    return lines


def agreement() -> str:
    """Return the table of the cases and of how far both methods agree."""
    with AGREEMENT.open(encoding="utf-8", newline="") as file:
        found = {row["case"]: row for row in csv.DictReader(file)}
    out = ["| case | events | maxima | times | forces | state |", "|---|---|---|---|---|---|"]
    for name in names():
        kinds = [row.kind for row in answer(HERE / "truth" / f"{name}.csv")]
        events = [kind for kind in dict.fromkeys(kinds) if kind not in (*STATE, "maximum")]
        said = ", ".join(f"{kinds.count(kind)} {kind}" for kind in events)
        one = found[name]
        maxima = kinds.count("maximum")
        out.append(f"| `{name}` | {said} | {maxima} | {one['times']} | {one['forces']} | {one['state']} |")
    return "\n".join(out)


def digits(lines: list[list[str]]) -> str:
    """Return the table of digits."""
    of = {(program, name): cells for program, name, *cells in lines}
    out = ["| case | " + " | ".join(PROGRAMS) + " |", "|---" * (1 + len(PROGRAMS)) + "|"]
    for name in names():
        cells = []
        for program in PROGRAMS:
            *held, why = of.get((program, name), ["", "", "", "", "not run"])
            least = min((float(one) for one in held if one), default=0.0)
            shown = " / ".join(one or "–" for one in held)
            cells.append(why if why == "not run" else f"**FAIL**: {why}" if not shown.strip("– /") else shown)
            if shown.strip("– /") and least < 3.0:
                cells[-1] = f"**FAIL**: {shown}"
        out.append(f"| `{name}` | " + " | ".join(cells) + " |")
    return "\n".join(out)


def main() -> None:
    if "--kept" in sys.argv:
        with RESULTS.open(encoding="utf-8", newline="") as file:
            lines = list(csv.reader(file))[1:]
    else:
        lines = results()
        with RESULTS.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([["program", "case", *HEADS, "fails"], *lines])
    page = HERE / "README.md"
    text = page.read_text(encoding="utf-8")
    for mark, table in (("agreement", agreement()), ("results", digits(lines))):
        before, _, rest = text.partition(f"<!-- {mark} -->\n")
        _, _, after = rest.partition(f"<!-- end of {mark} -->")
        text = f"{before}<!-- {mark} -->\n{table}\n<!-- end of {mark} -->{after}"
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
