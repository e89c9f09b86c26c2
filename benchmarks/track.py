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
from peer_newmark import Newmark

import wheeltapper as wt
from wheeltapper.lower.laws.own_law import tabulated_law
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import LOSS, FloatArray
from wheeltapper.march.general.contract import STRICT, Bodies, Contact, System
from wheeltapper.march.general.gradients import tangent_arguments
from wheeltapper.march.general.march import Found, Prepared, march, run
from wheeltapper.march.general.march import prepare as prepare_march
from wheeltapper.march.general.tangent import tangent_kernel
from wheeltapper.march.general.turned import SystemTurn

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


OWN = 2.0
"""Marches with Hertz's contact that one with a law of one's own may cost."""


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


def shaken_off() -> System:
    """Return a wheel that a corrugation of 200 µm shakes off the rail more than 500 times a second, at 36 m/s."""
    return rails.one_wheel(rails.wave(200e-6, 0.05, 0.6), 36.0, rails.ring(ZHAI))


def directions(system: System) -> dict[str, list[SystemTurn]]:
    """Return one, two and four directions for a wheel's derivatives, and four with the speed."""
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    idle = SystemTurn(Bodies(none, none, none, none, np.zeros(1)), np.zeros(1), (np.zeros(1),), (None,))
    path = np.zeros_like(system.contacts[0].pieces)
    path[:, contract.COEFFICIENT : contract.WAVENUMBER] = system.contacts[0].pieces[
        :, contract.COEFFICIENT : contract.WAVENUMBER
    ]
    height, constant = idle._replace(paths=(path,)), idle._replace(laws=(np.ones(1),))
    mass, damping = (idle._replace(bodies=idle.bodies._replace(**{name: one})) for name in ("mass", "damping"))
    speed = idle._replace(speed=1.0)
    return {
        "the height": [height], "height and constant": [height, constant],
        "height, constant, mass, damping": [height, constant, mass, damping],
        "height, constant, mass, speed": [height, constant, mass, speed],
    }  # fmt: skip


def with_tangents(rounds: int, duration: float) -> dict[str, dict[str, float]]:
    """Print what runs with derivatives cost, in runs without; return it. The march alone, without tables."""
    rows = {}
    for name, system in (("corrugation of 200 um, 36 m/s", shaken_off()), ("flat of 40 mm, 20 m/s", one_wheel())):
        prepared = prepare_march(system)
        found = run(prepared, duration)
        print(f"\n{name}: runs with derivatives, in runs without (aim 2.5 for four); {len(found.events)} events")
        rows[name] = {}
        for by, turns in directions(system).items():
            passed = shortest_pass(found, turns, rounds)
            plain = shortest(lambda prepared=prepared: run(prepared, duration), rounds)
            rows[name][by] = 1.0 + passed / plain
            print(f"  by {by:38} {rows[name][by]:5.2f}")
    return rows


def shortest_pass(found: Found, turns: list[SystemTurn], rounds: int) -> float:
    """Return the shortest time of some passes of the tangents over a march, s; they change what they are given."""
    times = []
    for _ in range(rounds + 1):
        given = tangent_arguments(found, turns)
        times.append(cpu_time(lambda given=given: tangent_kernel(*given)))
    return min(times[1:])


def own_laws() -> dict[str, Callable[[FloatArray, FloatArray], FloatArray] | Callable[[FloatArray], FloatArray]]:
    """Return Hertz's law, and laws of one's own with a rate, as functions."""
    constant = float(rails.HERTZIAN.numbers[0])
    return {
        "Hertz's": lambda delta: constant * delta**1.5,
        "1 + 0.3 rate": lambda delta, rate: constant * delta**1.5 * (1.0 + 0.3 * rate),
        "exp(0.3 tanh(rate))": lambda delta, rate: constant * delta**1.5 * np.exp(0.3 * np.tanh(rate)),
    }


def with_own_laws(rounds: int, duration: float) -> dict[str, dict[str, float]]:
    """Print what marches with laws of one's own cost, in marches with Hertz's contact in turn; return it."""
    rows = dict[str, dict[str, float]]()
    for name, system in (("corrugation of 200 um, 30 m/s", corrugated()), ("flat of 40 mm, 20 m/s", one_wheel())):
        print(f"\n{name}: laws of one's own, over Hertz's contact (at most {OWN:g})")
        prepared = {"": prepare_march(system)}
        for by, force in own_laws().items():
            law, _ = tabulated_law(wt.contact.Law(force))
            contacts = tuple(one._replace(law=law) for one in system.contacts)
            prepared[by] = prepare_march(system._replace(contacts=contacts))
        times = dict.fromkeys(prepared, np.inf)
        for _ in range(rounds + 1):
            for by, one in prepared.items():
                times[by] = min(times[by], cpu_time(lambda one=one: run(one, duration)))
        rows[name] = {by: times[by] / times[""] for by in prepared if by}
        for by, ratio in rows[name].items():
            print(f"  {by:38} {ratio:5.2f}")
    return rows


def against_newmark(rounds: int, steps: tuple[float, ...]) -> None:
    """Print what a plain program costs, and what it would at our error, by the order of its convergence."""
    system, duration = one_wheel(), 0.152
    exact = march(system, STRICT, duration).events[:, 0]
    prepared = prepare_march(system)
    own = shortest(lambda: run(prepared, duration), rounds)
    error = float(np.abs(run(prepared, duration).events[:, 0] - exact).max())
    print(f"\nflat of 40 mm, {duration} s, events against the strict march: ours {1e3 * own:.2f} ms, {error:.1e} s")
    errors, times = [], []
    for step in steps:
        peer = Newmark(prepared, step)
        found = peer(duration)
        times.append(cpu_time(lambda peer=peer: peer(duration)))
        errors.append(float(np.abs(found - exact).max()) if len(found) == len(exact) else np.nan)
        print(f"  Newmark, {step:.1e} s: {1e3 * times[-1]:9.1f} ms, {errors[-1]:.1e} s, {times[-1] / own:6.0f} x")
    if len(steps) > 1:
        share = float(np.exp(np.mean(np.log(np.array(errors) / np.square(steps)))))
        ratio = np.array(times) @ np.array(steps) / len(steps) / np.sqrt(error / share) / own
        print(f"  at our error, extrapolated by the order 2 of its method: {ratio:.2g} x")


def main() -> None:
    options = arguments()
    around = prepare()
    rounds = 1 if options.smallest else options.rounds
    bump = march_case("bump", "default")
    unit = shortest(bump, 40)
    print(f"\none bump on a stiff rail: {1e6 * unit:.0f} us; all below in multiples of it, per simulated second")
    rows = {}
    for name, (system, duration, most, aim) in CASES.items():
        prepared = prepare_march(system())
        length = 0.02 if options.smallest else duration
        found = run(prepared, length)
        unit = min(unit, shortest(bump, 10))
        ratio = shortest(lambda prepared=prepared, length=length: run(prepared, length), rounds) / length / unit
        rows[name] = {"ratio": ratio, "most": most, "aim": aim, "losses": losses(found)}
        print(f"  {name:42} {ratio:7.0f}   (at most {most:.0f}, aim {aim:.0f}; {losses(found):.0f} losses per s)")
    cost = shortest(built, rounds) / unit
    print(f"  {'ring and tables of one wheel at 20 m/s':42} {cost:7.0f}   (at most {BUILDING:.0f}, in all)")
    tangents = with_tangents(rounds, 0.02 if options.smallest else 0.4)
    own = with_own_laws(rounds, 0.02 if options.smallest else 0.3)
    against_newmark(rounds, (1e-5,) if options.smallest else (8e-6, 4e-6, 2e-6, 1e-6))
    if not options.smallest:
        store("track", around | {"bump": unit, "rows": rows, "building": cost, "tangents": tangents, "own": own})


if __name__ == "__main__":
    main()
