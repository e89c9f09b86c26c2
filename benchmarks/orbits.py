"""The costs of orbits, in multiples of the march of the bump alone, all measured in one run, on two cores.

    uv run python benchmarks/orbits.py [--rounds 3] [--only branch]

The wheel follows a corrugation of 50 µm and 5 cm, on a stiff track with a given contact constant; everything is warm.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import numpy as np
from machine import no_garbage_collection, prepare, seconds, store
from options import parser_of
from own import march_case

import wheeltapper as wt
from wheeltapper.orbits.asked import section_of
from wheeltapper.orbits.section_map import SectionMap

LIMITS = {"orbit": 15.0, "branch": 1.4e4, "diagram": 1.4e4, "basin": 4e5}
"""What each may cost, in marches of the bump."""
OFF = 1e-2
"""Distance, in static indentations, from which Newton's method finds the orbit."""
THREADS = 2
REPEATS = 50
"""How often the orbit is found and the bump is marched in one round."""

SCENE = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4), contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.0), rolling="point", speed=5.0, duration=1.0,
)  # fmt: skip


def tasks(smallest: bool) -> dict[str, Callable[[], Any]]:
    """Return what is measured, by name."""
    each = SectionMap(section_of(SCENE), 1)
    wave, first = each.wave_at(), wt.orbits.find(SCENE)
    near = first.state / each.scale + OFF
    side, many, top = (8, 20, 6.0) if smallest else (512, 1000, 60.0)
    speeds = {"speed": np.linspace(3.5, top, many)}
    starts = {
        "start.displacement": np.linspace(-1e-3, 1e-3, side), "start.velocity": np.linspace(-0.5, 0.5, side),
    }  # fmt: skip
    return {
        "orbit": lambda: each.fixed_point(wave, near),
        "branch": lambda: wt.orbits.follow(first, {"speed": (4.0 if smallest else 1.0, top)}),
        "diagram": lambda: wt.orbits.returns(SCENE, speeds, 300, 200, threads=THREADS),
        "basin": lambda: wt.orbits.fates(SCENE, starts, 70, threads=THREADS),
    }


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = parser_of(__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="rounds of the interleaved measurement (default 3)")
    parser.add_argument("--only", choices=sorted(LIMITS), action="append", help="only this (may be repeated)")
    return parser.parse_args()


def main() -> None:
    options = arguments()
    around = prepare()
    rounds = 1 if options.smallest else options.rounds
    bump, todo = march_case("bump", "default"), tasks(options.smallest)
    todo = {name: task for name, task in todo.items() if not options.only or name in options.only}
    times: dict[str, list[float]] = {name: [] for name in ("bump", *todo)}
    tasks(True)["branch"]()  # compiles what the strict method needs, too
    for _ in range(rounds):
        for name, task in (("bump", bump), *todo.items()):
            with no_garbage_collection():
                times[name] += [seconds(task) for _ in range(REPEATS if name in ("bump", "orbit") else 1)]
    unit = min(times["bump"])
    print(f"the march of the bump: {1e3 * unit:.3f} ms")
    found = {name: {"time": min(times[name]), "bumps": min(times[name]) / unit} for name in todo}
    for name, one in found.items():
        print(f"{name:8} {one['time']:10.4f} s {one['bumps']:12.4g} bumps, allowed {LIMITS[name]:g}")
    if not options.smallest:
        store("orbits", around | {"bump": unit, "found": found})


if __name__ == "__main__":
    main()
