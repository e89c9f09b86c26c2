"""The coach: simulated seconds per wall second, events per second, and errors against the converged solution.

    uv run python benchmarks/coach.py

One thread, default accuracy, compilation apart, best of several runs; errors are medians of the event times' errors.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from machine import surroundings
from options import parser_of
from scipy.integrate import solve_ivp

import wheeltapper as wt
from wheeltapper.lower import wagon, wagon_on_rails
from wheeltapper.march.common.program import EVENT_KIND, LOSS
from wheeltapper.march.wagon import multibody, passing
from wheeltapper.march.wagon.assembly import flattened_assembly
from wheeltapper.march.wagon.pressing import contact_forces
from wheeltapper.march.wagon.rails.march import march as march_on_rails
from wheeltapper.march.wagon.rates import rates
from wheeltapper.march.wagon.wheel_rows import AWAKE, ON, ROW_DELTA

REPEATS = 7
LIGHT = wt.Wagon.erri_b176(1500.0).without_dampers()
HEAVY = wt.Wagon.erri_b176(1813.0).without_dampers()
POLACH = wt.creep.Polach(friction=0.35)
STEP = wt.Step(height=1e-4, position=0.02)
WAVE = wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.01)
FLAT = wt.WheelFlat(length="60 mm", position=0.5, repeat=False)
ROLLING = {"sleeper_roll_inertia": 120.0, "ballast_roll_stiffness": 7e7, "ballast_roll_damping": 2e4}
CASES: dict[str, dict[str, Any]] = {
    "step, both rails, 5 m/s": {"irregularity": STEP},
    "the same, no creep": {"irregularity": STEP, "creep": None},
    "the same, full spin": {"irregularity": STEP, "creep": wt.creep.Polach(friction=0.35, wheel_spin="full")},
    "the same, FASTSIM 10 x 10": {"irregularity": STEP, "creep": wt.creep.Fastsim(friction=0.35)},
    "corrugation right, 36 m/s": {"irregularity": {"right": WAVE}, "speed": 36.0, "rolling": "point"},
    "the same, stiffer contacts": {
        "vehicle": HEAVY, "irregularity": {"right": WAVE}, "speed": 36.0, "rolling": "point", "duration": 0.12,
        "contact": wt.Hertz(curvature=False),
    },
    "corrugation both, 9 m/s": {"vehicle": HEAVY, "irregularity": WAVE, "speed": 9.0, "rolling": "point"},
    "no irregularity, 20 m/s": {"irregularity": None, "speed": 20.0, "duration": 5.0},
}  # fmt: skip


def scene(**changes: Any) -> wt.Scenario:
    """Return a scenario of the coach."""
    fields = {
        "vehicle": LIGHT, "contact": wt.Hertz(constant_per_wheel=7.025e10), "creep": POLACH, "speed": 5.0,
        "duration": 0.3,
    }  # fmt: skip
    return wt.Scenario(**(fields | changes))


def error(one: multibody.MultibodyMarch, best: multibody.MultibodyMarch) -> float:
    """Return the median error of the event times, NaN where the events differ."""
    if len(one.events) != len(best.events) or not len(best.events):
        return float("nan")
    a, b = (m.events[np.lexsort((m.events[:, 0], m.events[:, 2])), 0] for m in (one, best))
    return float(np.median(np.abs(a - b)))


def on_rails(row: float, smallest: bool) -> None:
    """Print how fast the coach is on two rails that give way; `row`: s per s of the row it is held against."""
    for rolls in (False, True):
        track = wt.tracks.Ballasted(**wt.tracks.Ballasted.example | (ROLLING if rolls else {}))
        one = scene(
            vehicle=wt.Wagon.erri_b176(1500.0), irregularity=FLAT, track=track, speed=20.0,
            duration=0.02 if smallest else 0.25,
        )  # fmt: skip
        below = wagon_on_rails.lower_wagon_on_rails(one).below
        found = march_on_rails(below)
        wall = np.inf
        for _ in range(1 if smallest else REPEATS):
            began = time.perf_counter()
            march_on_rails(below)
            wall = min(wall, time.perf_counter() - began)
        losses = int((found.events[:, EVENT_KIND] == LOSS).sum())
        modes = " + ".join(str(len(held)) for held in below.modes)
        print(
            f"on rails, sleepers {'roll' if rolls else 'do not roll'}, {modes} modes, {losses} losses: "
            f"{found.end / wall:.2f} s per s, {found.end / wall / row:.3f} of the first row"
        )


def peer(smallest: bool) -> str:
    """Return how much longer SciPy's DOP853 takes with the same compiled rates: on one endless wave, without breaks."""
    wave = wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=-100.0)
    one = scene(vehicle=HEAVY, irregularity=wave, speed=9.0, rolling="point", duration=0.002 if smallest else 0.1)
    assembly = wagon.lower_wagon(one).assembly
    ours = np.inf
    for _ in range(1 if smallest else REPEATS):
        began = time.perf_counter()
        march = multibody.march(assembly)
        ours = min(ours, time.perf_counter() - began)
    data, plan = flattened_assembly(assembly)
    work = multibody.work_for(assembly, 1)
    passing.start_kernel(data, plan, assembly.start, work.w, work.wheels, work.pieces, work.S)
    work.wheels[1:, AWAKE] = 0.0
    work.wheels[:1, ON : ON + 8] = 1.0

    def of(t: float, w: Any) -> Any:
        out = np.empty_like(w)
        rates(t, data, plan, w, work.wheels, work.pieces, work.Q, out, True)
        return out

    def gap(lane: int) -> Any:
        def event(t: float, w: Any) -> float:
            contact_forces(t, data, plan, w, work.wheels)
            return float(work.wheels[0, ROW_DELTA + lane])

        return event

    tolerances = {"rtol": 1e-9, "atol": 1e-9 / np.maximum(assembly.scales, 1e-3)}
    began = time.perf_counter()
    gaps = [gap(lane) for lane in range(8)]
    found = solve_ivp(of, (0.0, one.duration), assembly.start, "DOP853", events=gaps, **tolerances)
    theirs = time.perf_counter() - began
    return (
        f"SciPy's DOP853, rtol 1e-9, same compiled rates, eight event functions: {theirs / ours:.0f} times as long; "
        f"{sum(len(t) for t in found.t_events)} events, here {len(march.events)}"
    )


def main() -> None:
    """Print the table."""
    smallest = parser_of(__doc__).parse_args().smallest
    print({name: held for name, held in surroundings().items() if name in ("cpu", "cores", "commit", "load")})
    columns = f"{'s per s':>8} {'strict':>7} {'events/s':>9} {'rates/s':>8} {'ns/rate':>8} {'error':>8} {'strict':>8}"
    print(f"{'case':28} {columns}")
    speeds: list[float] = []
    for name, changes in list(CASES.items())[: 1 if smallest else None]:
        one = scene(**(changes | {"duration": 0.02} if smallest else changes))
        found = {}
        for method in ("default", "strict"):
            assembly = wagon.lower_wagon(one, method).assembly
            march = multibody.march(assembly)
            wall = np.inf
            for _ in range(1 if smallest else REPEATS):
                began = time.perf_counter()
                multibody.march(assembly)
                wall = min(wall, time.perf_counter() - began)
            found[method] = march, wall
        held = wagon.TOLERANCES["strict"]
        wagon.TOLERANCES["strict"] = 1e-13
        best = multibody.march(wagon.lower_wagon(one, "strict").assembly)
        wagon.TOLERANCES["strict"] = held
        (march, wall), (strict, strict_wall) = found["default"], found["strict"]
        speeds.append(march.end / wall)
        print(
            f"{name:28} {march.end / wall:8.1f} {strict.end / strict_wall:7.1f} {len(march.events) / march.end:9.0f} "
            f"{march.evaluations / march.end:8.0f} {1e9 * wall / march.evaluations:8.0f} {error(march, best):8.0e} "
            f"{error(strict, best):8.0e}"
        )
    on_rails(speeds[0], smallest)
    print(peer(smallest))
    if smallest:
        return
    scenes = [scene(irregularity=STEP, speed=speed) for speed in np.linspace(4.0, 6.0, 24)]
    wall_of = {}
    for threads in (1, None):
        began = time.perf_counter()
        wt.simulate(scenes, threads=threads)
        wall_of[threads] = time.perf_counter() - began
    print(f"24 coaches on all cores: {wall_of[1] / wall_of[None]:.2f} times as fast as on one")


if __name__ == "__main__":
    main()
