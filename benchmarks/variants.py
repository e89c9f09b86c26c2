"""What each term of the equations costs a march: the time of a recorded step, over that of the plainest model.

uv run python benchmarks/variants.py [--rounds 20] [--method default]

One trajectory on one thread, over the bump of problems.py, and for comparison over its corrugation. Beside the time of
a recorded step stands the whole run's: with another model the wheel bounces otherwise, and makes other steps. A march
is prepared before it is timed, and all are timed in turn, so that a busy machine slows all of them down alike; the
shortest time counts.
"""

from __future__ import annotations

from math import inf

from machine import no_garbage_collection, prepare, seconds, store
from options import parser_of
from own import scenario
from problems import CASES

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march.common.program import DONE, Program
from wheeltapper.march.wheel.single import march

METHODS = ("default", "strict")
PLAIN = "plain"
CIRCLE = {"rolling": "circle"}
COMPUTED = CIRCLE | {"contact": wt.Hertz()}
GIVEN = 1.9e11
"""The constant of the plain model, N/m^1.5."""
DECK = {"track": wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)}


def models() -> dict[str, wt.Scenario]:
    """Return the models by name."""
    bump = scenario(CASES["bump"])
    changes = {
        PLAIN: {},
        "circle": CIRCLE,
        "default model": COMPUTED,
        "hysteresis": {"contact": wt.Hertz(constant=GIVEN, hysteresis=0.1)},
        "deck": DECK,
        "default model on deck": COMPUTED | DECK,
        "default model on deck, hysteresis": COMPUTED | DECK | {"contact": wt.Hertz(hysteresis=0.1)},
        "Thornton": {"contact": wt.contact.Thornton(constant=GIVEN, rail_share=1.0)},
        "bush": {"vehicle.bush_stiffness": 1e7},
        "play": {"vehicle.damper_play": 1e-4},
        "bush and play": {"vehicle.bush_stiffness": 1e7, "vehicle.damper_play": 1e-4},
    }
    found = {name: bump.replaced(change) for name, change in changes.items()}
    return found | {"corrugation": scenario(CASES["corr"])}


def marched(program: Program) -> int:
    """March a program to its end; return the number of its steps."""
    found = march(program)
    if found.status != DONE:
        raise RuntimeError(f"the march ended with status {found.status}")
    return len(found.steps)


def main() -> None:
    """Print a line for each model and method."""
    parser = parser_of(__doc__)
    parser.add_argument("--rounds", type=int, default=20, help="calls of each march (default 20)")
    parser.add_argument("--method", choices=METHODS, action="append", help="only this (may be repeated)")
    options = parser.parse_args()
    around, chosen, methods = prepare(), models(), options.method or METHODS
    if options.smallest:
        options.rounds, methods, chosen = 1, METHODS[:1], {name: chosen[name] for name in (PLAIN, "hysteresis")}
    programs = {(name, method): lower(scene, method).program for name, scene in chosen.items() for method in methods}
    steps = {key: marched(program) for key, program in programs.items()}
    best = dict.fromkeys(programs, inf)
    with no_garbage_collection():
        for _ in range(options.rounds):
            for key, program in programs.items():
                best[key] = min(best[key], seconds(lambda program=program: marched(program)))  # type: ignore[misc]
    result = {}
    print(f"{'model':36}{'method':>9}{'steps':>8}{'ns a step':>11}{'to plain':>10}{'run, us':>10}{'to plain':>10}")
    for (name, method), took in best.items():
        plain = PLAIN, METHODS[0] if METHODS[0] in methods else method
        step, base = 1e9 * took / steps[name, method], 1e9 * best[plain] / steps[plain]
        print(
            f"{name:36}{method:>9}{steps[name, method]:8}{step:11.0f}{step / base:10.2f}{1e6 * took:10.0f}"
            f"{took / best[plain]:10.2f}"
        )
        result[f"{name}, {method}"] = {"steps": steps[name, method], "step": step, "run": took}
    if not options.smallest:
        store("variants", around | {"models": result})


if __name__ == "__main__":
    main()
