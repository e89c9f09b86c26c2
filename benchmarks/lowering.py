"""How long lowering takes, in seconds of the processor: random wheelsets and wagons on random irregularities.

uv run python benchmarks/lowering.py [--wheelsets 200] [--wagons 150] [--seed 1] [--longest 100]

Wheels roll as circles or follow, on corrugation with flats, users' functions, samples, bumps, joints and wheels out of
round; contacts follow the curvature or not. Each case is lowered by the default and the strict method, wagons by the
strict one. Goals: 2 s and 5 s of a wheelset, 10 s of a wagon.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from time import process_time
from typing import Any

import numpy as np
from options import parser_of

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.lower.wagon import lower_wagon

GOALS = {"default": 2.0, "strict": 5.0, "wagon": 10.0}
"""Seconds."""
Random = np.random.Generator


def _log(random: Random, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _height(random: Random, low: float, high: float) -> float:
    return _log(random, low, high) * (1.0 if random.random() < 0.5 else -1.0)


def _waves(random: Random) -> Any:
    return wt.Corrugation(
        amplitude=_height(random, 2e-6, 2e-4), wavelength=_log(random, 0.02, 0.5), start=random.uniform(-0.5, 0.3)
    )


def _flat(random: Random) -> Any:
    shape = "fresh" if random.random() < 0.5 else "rounded"
    return wt.WheelFlat(length=_log(random, 0.01, 0.08), position=random.uniform(0.05, 0.5), shape=shape)


def _function(random: Random) -> Any:
    size, number, phase = (random.uniform(*bounds, 4) for bounds in ((-1e-4, 1e-4), (5.0, 200.0), (0.0, 6.0)))
    size /= 1.0 + (number / 50.0) ** 2

    def heights(x: Any) -> Any:
        return sum(a * np.sin(k * x + p) for a, k, p in zip(size, number, phase, strict=True))

    return wt.Profile(function=heights)


def _samples(random: Random) -> Any:
    count = int(random.integers(50, 2000))
    x = np.linspace(0.0, count * _log(random, 1e-3, 1e-2), count)
    smooth = np.convolve(random.normal(size=count + 20), np.hanning(21), mode="valid")
    y = _log(random, 1e-6, 1e-4) * smooth / np.abs(smooth).max()
    return wt.Measured(positions=tuple(x), heights=tuple(y), beyond="flat")


def _bump(random: Random) -> Any:
    return wt.CosineBump(height=_height(random, 1e-5, 1e-3), length=_log(random, 0.02, 2.0), start=random.random())


def _joints(random: Random) -> Any:
    once = wt.CosineBump(height=_height(random, 1e-5, 1e-3), length=_log(random, 0.02, 0.3), start=random.random())
    return wt.Repeated(of=once, period=_log(random, 0.4, 20.0))


def _step(random: Random) -> Any:
    return wt.Step(height=_height(random, 1e-5, 1e-3), position=random.uniform(0.0, 0.5), ideal=random.random() < 0.3)


def _oval(random: Random) -> Any:
    orders = tuple(int(order) for order in random.choice(np.arange(1, 25), random.integers(1, 5), replace=False))
    return wt.OutOfRound(orders=orders, amplitudes=tuple(_log(random, 1e-6, 3e-4) / order for order in orders))


SHAPES: tuple[Callable[[Random], Any], ...] = (_waves, _flat, _function, _samples, _bump, _joints, _step, _oval)


def _items(random: Random) -> tuple[Any, ...]:
    """Return up to three irregularities; in every third case corrugation with a flat, and perhaps more."""
    held = [_waves, _flat] if random.random() < 0.35 else []
    more = random.choice(len(SHAPES), random.integers(0 if held else 1, 3), replace=False)
    return tuple(shape(random) for shape in dict.fromkeys([*held, *(SHAPES[i] for i in more)]))


def _run(random: Random, longest: float) -> dict[str, Any]:
    speed, length = _log(random, 1.0, 80.0), _log(random, 0.3, longest)
    rolling = "circle" if random.random() < 0.75 else "point"
    return {"speed": speed, "duration": length / speed, "rolling": rolling}


def wheelsets(count: int, seed: int, longest: float) -> Iterator[wt.Scenario]:
    """Return random scenarios of a wheelset."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        vehicle = wt.Wheelset(
            mass=random.uniform(800, 2000), load=random.uniform(2e4, 1.2e5), stiffness=_log(random, 1e5, 1e7),
            damping=_log(random, 1e3, 1e5), radius=random.uniform(0.3, 0.6),
        )  # fmt: skip
        contacts = (
            wt.Hertz(rail_radius=random.uniform(0.1, 0.5)), wt.Hertz(constant=1.4e11, curvature=True),
            wt.Hertz(constant=1.4e11), wt.Linear(stiffness=1.2e9), wt.contact.Thornton(constant=1.4e11),
        )  # fmt: skip
        track = wt.StiffTrack() if random.random() < 0.5 else wt.FloatingDeck(mass=15_000, stiffness=1.5e7)
        chosen = contacts[random.choice(5, p=(0.35, 0.25, 0.2, 0.1, 0.1))]
        run = _run(random, longest)
        yield wt.Scenario(vehicle=vehicle, track=track, contact=chosen, irregularity=_items(random), **run)


def wagons(count: int, seed: int, longest: float) -> Iterator[wt.Scenario]:
    """Return random scenarios of a coach with profiles of wheels and rails."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        vehicle = wt.Wagon.erri_b176(random.uniform(1200, 2000), series_springs=random.random() < 0.3)
        profiles = wt.profiles.WheelRail(
            inclination=random.choice((1 / 20, 1 / 40)), gauge=random.uniform(1.430, 1.437),
            smoothing=_log(random, 5e-6, 3e-5),
        )  # fmt: skip
        contact = wt.Hertz() if random.random() < 0.7 else wt.Hertz(constant_per_wheel=7e10)
        places = random.choice(("left", "right", "both", "wheelset 2", "wheelset 3 right"), 2, replace=False)
        items = {str(place): _items(random) for place in places[: random.integers(1, 3)]}
        creep = (None, wt.creep.Polach(), wt.creep.Fastsim())[random.integers(3)]
        given = {"profiles": profiles, "contact": contact, "creep": creep, "irregularity": items}
        yield wt.Scenario(vehicle=vehicle, **given, **_run(random, longest))


def timed(scenarios: Iterator[wt.Scenario], call: Callable[[wt.Scenario], object]) -> tuple[list[float], int]:
    """Return how long each scenario takes, and how many are refused."""
    took, refused = [], 0
    for scenario in scenarios:
        begun = process_time()
        try:
            call(scenario)
        except wt.InputError:
            refused += 1
        took.append(process_time() - begun)
    return took, refused


def told(words: str, took: list[float], refused: int, goal: float) -> None:
    """Print the distribution of some times."""
    shares = ", ".join(f"{name} {np.quantile(took, q):.3f}" for name, q in (("median", 0.5), ("95 %", 0.95)))
    over = sum(one > goal for one in took)
    print(
        f"{words:22} {len(took)} cases, {refused} refused: {shares}, longest {max(took):.3f} s "
        f"(case {np.argmax(took)}); {over} beyond {goal:g} s",
        flush=True,
    )


def main() -> None:
    """Print one line per vehicle and method."""
    parser = parser_of(__doc__)
    parser.add_argument("--wheelsets", type=int, default=200)
    parser.add_argument("--wagons", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--longest", type=float, default=100.0, help="m, of a run")
    options = parser.parse_args()
    if options.smallest:
        options.wheelsets, options.wagons, options.longest = 2, 1, 1.0
    warnings.simplefilter("ignore")
    (first,), (coach,) = wheelsets(1, 0, 1.0), wagons(1, 0, 1.0)
    lower(first)  # what is compiled and read once belongs to no case
    lower_wagon(coach)
    for method in ("default", "strict"):
        cases = wheelsets(options.wheelsets, options.seed, options.longest)
        took, refused = timed(cases, lambda one, method=method: lower(one, method))  # type: ignore[misc]
        told(f"wheelsets, {method}", took, refused, GOALS[method])
    took, refused = timed(wagons(options.wagons, options.seed, options.longest), lambda one: lower_wagon(one, "strict"))
    told("wagons, strict", took, refused, GOALS["wagon"])


if __name__ == "__main__":
    main()
