"""The energy check's share of `simulate`, in processor time: the shortest of many calls of both, in the same run.

uv run python benchmarks/energy_check.py [--rounds 15] [--limit 0.25]

With --limit the program ends with exit code 1 where an elastic contact's share is larger.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from machine import no_garbage_collection, prepare, store
from options import parser_of

import wheeltapper as wt
from wheeltapper.lower.lowered import balanced, wagon_energy

EXAMPLES = Path(__file__).parent.parent / "examples"
METHODS = ("default", "strict")
LONG = {"duration": 5.0}


def cases() -> dict[str, tuple[wt.Scenario, bool]]:
    """Return scenarios by name, and whether their share is meant to stay below the limit."""
    files = {file.stem: wt.load(file) for file in sorted(EXAMPLES.glob("*.toml")) if "[vehicle]" in file.read_text()}
    found = {f"{name}.toml": (scene, name != "coach_step") for name, scene in files.items()}
    long = {
        f"{name}, 5 s": files[name].replaced(LONG) for name in ("corrugation", "deck", "wheel_flat", "measured_flat")
    }
    bump = files["bump"]
    others = {
        "Hunt-Crossley": bump.replaced({"contact": wt.Hertz(constant=1.405e11, hysteresis=0.5)}),
        "yielding": bump.replaced({"contact": wt.contact.Thornton(constant=1.405e11, rail_share=1.0)}),
        "bush and play": bump.replaced({"vehicle.bush_stiffness": 1e7, "vehicle.damper_play": 1e-4}),
    }
    found |= {name: (scene, True) for name, scene in long.items()}
    return found | {name: (scene, False) for name, scene in others.items()}


class Clock:
    """Adds up the processor time of a function's calls."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function, self.spent = function, 0.0

    def __call__(self, *arguments: Any) -> Any:
        """Call the function and keep its time."""
        begun = time.process_time()
        try:
            return self.function(*arguments)
        finally:
            self.spent += time.process_time() - begun


def share(scenario: wt.Scenario, method: str, rounds: int) -> tuple[float, float, int]:
    """Return the shortest processor times of the check and of the rest of `simulate`, s, and the number of steps."""
    kept = balanced.missing_part, wagon_energy.missing_part
    clocks = Clock(kept[0]), Clock(kept[1])
    balanced.missing_part, wagon_energy.missing_part = clocks
    try:
        steps = len(wt.simulate(scenario, method)._march.steps)
        times = []
        with no_garbage_collection():
            for _ in range(rounds):
                for clock in clocks:
                    clock.spent = 0.0
                begun = time.process_time()
                wt.simulate(scenario, method)
                whole = time.process_time() - begun
                check = sum(clock.spent for clock in clocks)
                times.append((check, whole - check))
    finally:
        balanced.missing_part, wagon_energy.missing_part = kept
    return min(check for check, _ in times), min(rest for _, rest in times), steps


def main() -> None:
    """Print one line per case and method."""
    parser = parser_of(__doc__)
    parser.add_argument("--rounds", type=int, default=15, help="calls of each case (default 15)")
    parser.add_argument("--case", action="append", help="only cases whose name contains this (may be repeated)")
    parser.add_argument("--limit", type=float, help="largest share of an elastic contact")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    around = prepare()
    chosen = {n: c for n, c in cases().items() if not options.case or any(word in n for word in options.case)}
    if options.smallest:
        options.rounds, options.limit, chosen = 1, None, {"bump.toml": chosen["bump.toml"]}
    result, dear = {}, []
    print(f"{'case':24}{'method':>9}{'steps':>9}{'check, ms':>11}{'rest, ms':>10}{'us a step':>11}{'share':>8}")
    for name, (scene, limited) in chosen.items():
        for method in METHODS:
            check, rest, steps = share(scene, method, options.rounds)
            part = check / (check + rest)
            result[f"{name}, {method}"] = {"check": check, "rest": rest, "steps": steps, "share": part}
            print(
                f"{name:24}{method:>9}{steps:9}{1e3 * check:11.3f}{1e3 * rest:10.2f}{1e6 * check / steps:11.3f}"
                f"{part:8.3f}",
                flush=True,
            )
            if limited and options.limit is not None and part > options.limit:
                dear.append(f"{name}, {method}")
    if not options.smallest:
        store("energy_check", around | {"cases": result})
    if dear:
        raise SystemExit(f"more than {options.limit:g}: {'; '.join(dear)}")


if __name__ == "__main__":
    main()
