"""The bump with hysteresis and on a deck: heyoka's time over ours at our error, in one run.

    uv run --group peers python benchmarks/terms.py [--rounds 10]

Errors are those against heyoka at round-off, another code with equations of its own.
"""

from __future__ import annotations

from dataclasses import replace
from math import nan

from core import HEYOKA_TOLERANCES, OWN, Entry, matches, measure, row, show
from machine import prepare, store
from options import need_peers, parser_of
from own import Marched
from problems import TERMS, Case, check_counts, largest_end_error, largest_force_error, largest_time_error, scaled


def entries(case: Case) -> tuple[Case, list[Entry]]:
    """Return the case with its counts, and the codes with their errors."""
    from peer_heyoka import Heyoka

    problem = scaled(case)
    exact = Heyoka(problem, 0.0)
    reference = exact.read(exact())
    case = replace(case, impacts=len(reference.impacts), maxima=len(reference.peak_forces))
    codes = [Entry(OWN, method, Marched(case, method)) for method in ("default", "strict")]  # type: ignore[arg-type]
    codes += [Entry("heyoka", f"{t:.0e}", Heyoka(problem, t)) for t in HEYOKA_TOLERANCES if t]
    for entry in codes:
        found = entry.runner.read(entry.runner())
        check_counts(f"{entry.code} {entry.setting}", case, found)
        entry.force_error = largest_force_error(found, reference)
        alike = len(found.losses) == len(reference.losses)  # the last one may lie at the end of the run
        entry.time_error = largest_time_error(found, reference) if alike else nan
        entry.end_error = largest_end_error(found, reference)
    return case, codes


def main() -> None:
    """Measure, print and store."""
    parser = parser_of(__doc__)
    parser.add_argument("--rounds", type=int, default=10, help="rounds of the interleaved measurement (default 10)")
    options = parser.parse_args()
    need_peers()
    around, out = prepare(), {}
    for name in TERMS:
        case, codes = entries(TERMS[name])
        measure(codes, 1 if options.smallest else options.rounds)
        found = matches(codes)
        show(case, codes, found)
        out[name] = {"rows": [row(entry) for entry in codes], "ratios": [vars(one) for one in found]}
    if not options.smallest:
        store("terms", around | {"cases": out})


if __name__ == "__main__":
    main()
