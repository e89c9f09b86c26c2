"""Measure marches on flexible tracks, in multiples of the march of one bump on a stiff rail in the same run.

    uv run python benchmarks/track.py [--rounds 5]

For comparison, a plain program of the same truncated track: modes by Newmark's method with fixed steps, the contact by
Newton's method in each step, and losses and impacts by bisecting the step in which they lie. Its steps are halved until
its event times are as near to those of finest steps as ours are, or until it has taken long enough.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from machine import no_garbage_collection, prepare, store
from options import parser_of
from own import march_case

from wheeltapper.march.general.contract import DEFAULT, STRICT, Contact, System
from wheeltapper.march.general.march import Found, Prepared, march, run
from wheeltapper.march.general.march import prepare as prepare_march
from wheeltapper.march.program import LOSS

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests import rails

ROLLAND, ZHAI = "rolland_UIC60_example", "Zhai2004"
COACH = 0.0, 2.56, 19.0, 21.56


def one_wheel() -> System:
    """Return a wheel with a flat of 40 mm at 20 m/s."""
    return rails.one_wheel(rails.flat(0.04, 3.0), 20.0, rails.ring(ROLLAND))


def corrugated() -> System:
    """Return a wheel that a corrugation of 200 µm shakes off the rail several hundred times a second, at 30 m/s."""
    return rails.one_wheel(rails.wave(200e-6, 0.05, 0.6), 30.0, rails.ring(ZHAI))


def four_wheels() -> System:
    """Return the wheels of a coach, with a flat each, at 20 m/s."""
    contacts = [
        Contact(rails.flat(0.04, 1.0 + 0.5 * i), rails.HERTZIAN, -behind) for i, behind in enumerate(COACH)
    ]  # fmt: skip
    return System(rails.free_wheels(4), tuple(contacts), 20.0, rails.ring(ROLLAND))


CASES: dict[str, tuple[Callable[[], System], float, float, float]] = {
    "one wheel, flat of 40 mm, 20 m/s": (one_wheel, 0.4, 150.0, 100.0),
    "one wheel, corrugation of 200 um, 30 m/s": (corrugated, 1.0, 360.0, 360.0),
    "four wheels, 20 m/s": (four_wheels, 0.4, 950.0, 700.0),
}
"""Each case, its time, s, and at most and aimed at how many marches of the bump a simulated second may cost."""
BUILDING = 2500.0
"""Marches of the bump that the ring and the tables of one wheel at 20 m/s may cost."""


def cpu_time(call: Callable[[], Any]) -> float:
    """Return the time that this thread's processor worked for a call, s."""
    start = time.thread_time()
    call()
    return time.thread_time() - start


def shortest(call: Callable[[], Any], rounds: int) -> float:
    """Return the shortest time of some calls, s."""
    call()
    with no_garbage_collection():
        return min(cpu_time(call) for _ in range(rounds))


def built() -> Prepared:
    """Build the ring and the tables of one wheel anew."""
    rails.ring.cache_clear()
    rails.rings.ring_of.cache_clear()
    return prepare_march(one_wheel())


def losses(found: Found) -> float:
    """Return losses per second in the second half of a march."""
    events = found.events[found.events[:, 0] > 0.5 * found.time]
    return float(np.sum(events[:, 1] == LOSS) / (0.5 * found.time))


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = parser_of(__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=7, help="rounds of each measurement (default 7)")
    return parser.parse_args()
