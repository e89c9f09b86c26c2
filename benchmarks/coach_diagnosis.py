"""The core model diagnoses a coach: what it leaves unexplained, and what that costs. Tests on one's own model flatter.

    uv run python benchmarks/coach_diagnosis.py

First, healthy passages of the ERRI B176 coach over a deck with a bump: which share of the acceleration's rms the best
core model leaves, χ² per sample at noise of 1 % of the rms, and mass and damping over the true ones, with speed, load,
height and contact constant known as well as the site states. Then faults of one wheelset, in passages that differ as
the site states: how often the verdict names the right part of the wheelset, says "not explained", "healthy", or names a
wrong part. The last columns are the core model's own recordings of the same faults.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from machine import surroundings
from options import parser_of

import wheeltapper as wt
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.describe.sensor import Sensor
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.diagnose import diagnose
from wheeltapper.diagnosis.inference.estimate import onset, priors_of
from wheeltapper.diagnosis.inference.fitting import FitProblem, fit_over_windows
from wheeltapper.diagnosis.site.neighbours import Condition
from wheeltapper.diagnosis.site.synthetic import synthesise
from wheeltapper.record.recordings.recording import Recording

RATE, SPEED, DURATION, SHARE = 20e3, 9.0, 0.2111, 0.01
"""Hz, m/s, s, and the noise over the acceleration's rms."""
TIMES = np.arange(int(DURATION * RATE)) / RATE
HIGH, GENTLE = 2e-4, 1e-4
"""Heights of the bump, m: wheels leave the rail for long, or hardly."""
DECK = {"mass": 15_000.0, "stiffness": 1.5e7}
ALLOWED = {HIGH: 0.01, GENTLE: 0.02}
"""What the model may leave, over the acceleration's rms: twice what it leaves of an even coach; and as much as it
leaves of one with its car body 0.1 m to the left, which the high bump does not allow."""
BEHIND = (0.0, 2.56, 19.0, 21.56)
"""Places of the wheelsets behind the first one, m."""
KNOWN = {"speed": 0.01, "vehicle.load": 0.05, "contact.constant": 0.05, "irregularity.0.height": 0.05}
SPREAD = {"vehicle.mass": 0.03, "vehicle.damping": 0.05}
"""Of healthy wheelsets; without it the core model's bias alone, 3 and 5 %, would be a fault."""
COMPARED = ("broken spring", "mass deviation", "lost damper", "weak damper", "load deviation", "wheel flat")
UNKNOWN = ("vehicle.mass", "vehicle.damping")
PASSAGES = 3
"""Of each fault."""
INFLATED = (1.0, 4.0, 32.0)
"""Factors on the noise with which a healthy passage is fitted; the best fit counts."""
HEALTHY = wt.Wagon.erri_b176()


def bump(height: float = HIGH) -> wt.CosineBump:
    """Return the site's bump."""
    return wt.CosineBump(height=height, length=0.05, start=0.009)


def coach(vehicle: wt.Wagon = HEALTHY, **changes: Any) -> wt.Scenario:
    """Return a passage of the coach; only wheelset 1 is on the deck unless a track says otherwise."""
    fields = {
        "contact": wt.Hertz(constant_per_wheel=7.025e10), "creep": wt.creep.Polach(friction=0.35), "speed": SPEED,
        "track": wt.FloatingDeck(**DECK, damping=5e4, wheelset=1), "irregularity": {"both": bump()},
        "duration": DURATION,
    }  # fmt: skip
    return wt.Scenario(vehicle=vehicle, **(fields | changes))


def deck_acceleration(scene: wt.Scenario, wheelset: int = 1) -> np.ndarray:
    """Return the deck's acceleration after a wheelset's trigger."""
    begins = BEHIND[wheelset - 1] / float(scene.speed)
    record = wt.simulate(scene.replaced({"duration": DURATION + begins}))
    return np.asarray(record.at(TIMES + begins).deck_acceleration.values)


def site_of(scene: wt.Scenario, rms: float) -> Site:
    """Return the site whose healthy wheelset is the equivalent of wheelset 1."""
    alone = scene.track.model_copy(update={"wheelset": None})
    height = scene.irregularities[0].height
    even = coach(scene.vehicle, contact=scene.contact, irregularity={"both": bump(height)})
    core = wt.reduced(even, 1).replaced({"track": alone})
    sensor = Sensor(rate=RATE, noise=SHARE * rms / np.sqrt(0.5 * RATE))
    return Site(passage=core, sensor=sensor, uncertainty=KNOWN)


def recorded(samples: np.ndarray, noise: float, seed: int) -> Recording:
    """Return samples as a recording, with noise."""
    return Recording(samples + noise * np.random.default_rng([99, seed]).standard_normal(len(samples)), RATE)


# -- healthy passages -------------------------------------------------------------------------------------------------


def short(damping: float) -> wt.FloatingDeck:
    """Return a deck that ends before the next wheelset of the bogie comes."""
    return wt.FloatingDeck(**DECK, damping=damping, start=-0.05, length=2.2)


def aside(distance: float) -> wt.Wagon:
    """Return the coach with its car body's centre of gravity moved to the left."""
    body, *others = HEALTHY.bodies
    x, _, z = body.position
    bodies = (body.model_copy(update={"position": (x, distance, z)}), *others)
    return wt.Wagon(bodies=bodies, axles=HEALTHY.axles, elements=HEALTHY.elements, gravity=HEALTHY.gravity)


def _sound(height: float) -> dict[str, tuple[wt.Scenario, int]]:
    def of(vehicle: wt.Wagon = HEALTHY, **changes: Any) -> wt.Scenario:
        return coach(vehicle, **({"irregularity": {"both": bump(height)}} | changes))

    endless = wt.FloatingDeck(**DECK, damping=5e4)
    return {
        "only wheelset 1 on the deck": (of(), 1),
        "  car body 5 mm to the left": (of(aside(5e-3)), 1),
        "  car body 20 mm to the left": (of(aside(2e-2)), 1),
        "  car body 100 mm to the left": (of(aside(0.1)), 1),
        "  bump on the right rail only": (of(irregularity={"right": bump(height)}), 1),
        "only wheelset 2 on the deck": (of(track=wt.FloatingDeck(**DECK, damping=5e4, wheelset=2)), 2),
        "deck of 2.2 m, 5 % damped, wheelset 3": (of(track=short(5e4)), 3),
        "  wheelset 2": (of(track=short(5e4)), 2),
        "  50 % damped, wheelset 2": (of(track=short(4.7e5)), 2),
        "  100 % damped, wheelset 2": (of(track=short(9.5e5)), 2),
        "endless deck, wheelset 1": (of(track=endless), 1),
    }


SOUND: dict[str, tuple[wt.Scenario, int]] = {
    f"{1e3 * height:g} mm: {name}": case for height in (HIGH, GENTLE) for name, case in _sound(height).items()
} | {
    "0.2 mm: no creep": (coach(creep=None), 1),
    "0.2 mm: contacts from the profiles": (coach(contact=wt.Hertz()), 1),
    "0.2 mm: dampers in series with springs": (coach(wt.Wagon.erri_b176(series_springs=True)), 1),
}


@dataclass
class Left:
    """What the best core model leaves of a healthy passage."""

    share: float
    mass: float
    damping: float
    held: float


def left_over(scene: wt.Scenario, wheelset: int) -> Left:
    """Fit the core model to a healthy passage."""
    samples = deck_acceleration(scene, wheelset)
    rms = float(samples.std())
    site = site_of(scene, rms)
    recording, best = recorded(samples, SHARE * rms, 0), None
    for factor in INFLATED:
        noise = factor * SHARE * rms
        problem = FitProblem(recording, site.sensor, noise, site.passage, priors_of(site, UNKNOWN))
        fit = fit_over_windows(problem, onset(recording, noise))
        model = trajectory(fit.scenario.replaced({"duration": DURATION}), (), TIMES).deck_acceleration
        share = float(np.std(model - samples) / rms)
        if best is None or share < best.share:
            over = [fit.values[i] / float(getattr(site.passage.vehicle, n)) for i, n in enumerate(("mass", "damping"))]
            best = Left(share, *over, held=fit.held)
    assert best is not None
    return best


def healthy_table(cases: dict[str, tuple[wt.Scenario, int]]) -> None:
    """Print what is left of healthy passages."""
    print(f"{'healthy coach':44} {'left/rms':>9} {'chi2':>9} {'m/m0':>6} {'c/c0':>6} {'explained up to':>16}")
    for name, (scene, wheelset) in cases.items():
        found = left_over(scene, wheelset)
        until = "all" if np.isinf(found.held) else f"{1e3 * found.held:.0f} ms"
        chi_squared = 1.0 + (found.share / SHARE) ** 2
        print(
            f"{name:44} {found.share:9.4f} {chi_squared:9.3g} {found.mass:6.3f} {found.damping:6.3f} {until:>16}",
            flush=True,
        )


# -- faults -----------------------------------------------------------------------------------------------------------


def weakened(factor: float, *sides: str) -> wt.Wagon:
    """Return the coach with the damping of dampers of wheelset 1 times a factor."""
    vehicle = HEALTHY
    for side in sides:
        damper = next(item for item in vehicle.elements if item.name == f"primary damper 1 {side}")
        x, y, z = damper.damping
        vehicle = vehicle.with_element(damper.model_copy(update={"damping": (x, y, factor * z)}))
    return vehicle


def broken(*sides: str) -> wt.Wagon:
    """Return the coach with springs of wheelset 1 that are rigid upwards."""
    vehicle = HEALTHY
    for side in sides:
        spring = next(item for item in vehicle.elements if item.name == f"primary spring 1 {side}")
        kept = spring.model_copy(update={"stiffness": (*spring.stiffness[:2], 0.0)})
        link = wt.vehicles.Link(name=f"broken {side}", between=spring.between, at=spring.at, along=("z",))
        vehicle = vehicle.with_element(kept).with_element(link)
    return vehicle


def heavier(factor: float) -> wt.Wagon:
    """Return the coach with another mass of wheelset 1."""
    first, *others = HEALTHY.axles
    axles = (first.model_copy(update={"mass": factor * float(first.mass)}), *others)
    return wt.Wagon(bodies=HEALTHY.bodies, axles=axles, elements=HEALTHY.elements, gravity=HEALTHY.gravity)


def flat(length: float, *places: str) -> dict[str, Any]:
    """Return irregularities with a flat on some wheels."""
    tread = wt.WheelFlat(length=length, position=1.2)
    return {f"wheelset 1 {place}": (tread,) for place in places}


@dataclass
class Fault:
    """A fault of the coach, the core model's, and the part of the wheelset where it is."""

    part: str
    vehicle: wt.Wagon = HEALTHY
    flats: dict[str, Any] = field(default_factory=dict)
    core: tuple[str | None, float | None] = (None, None)


FAULTS = {
    "healthy": Fault(""),
    "no damper, both sides": Fault("damper", weakened(1e-3, "left", "right"), core=("lost damper", 1e-3)),
    "c/5, both sides": Fault("damper", weakened(0.2, "left", "right"), core=("lost damper", 0.2)),
    "no damper, left": Fault("damper", weakened(1e-3, "left"), core=("weak damper", 0.5)),
    "c/5, left": Fault("damper", weakened(0.2, "left"), core=("weak damper", 0.6)),
    "broken spring, both sides": Fault("suspension", broken("left", "right"), core=("broken spring", None)),
    "broken spring, left": Fault("suspension", broken("left"), core=("broken spring", 335.0)),
    "mass + 10 %": Fault("suspension", heavier(1.1), core=("mass deviation", 1.1)),
    "mass - 10 %": Fault("suspension", heavier(0.9), core=("mass deviation", 0.9)),
    "flat of 40 mm, both wheels": Fault("wheel", flats=flat(0.04, "left", "right"), core=("wheel flat", 0.04)),
    "flat of 40 mm, right": Fault("wheel", flats=flat(0.04, "right"), core=("wheel flat", 0.04)),
    "flat of 20 mm, right": Fault("wheel", flats=flat(0.02, "right"), core=("wheel flat", 0.02)),
    "car body 0.1 m to the left": Fault("", aside(0.1)),
}


def passage(fault: Fault, number: int, height: float) -> np.ndarray:
    """Return a passage of the coach that differs from the stated one as the site is uncertain."""
    draws = np.random.default_rng([7, number]).standard_normal(len(KNOWN))
    speed, load, constant, high = (1.0 + share * z for share, z in zip(KNOWN.values(), draws, strict=True))
    contact = wt.Hertz(constant_per_wheel=7.025e10 * constant)
    rails = {"both": bump(height * high)} | fault.flats
    scene = coach(fault.vehicle, speed=SPEED * speed, contact=contact, irregularity=rails)
    more = (load - 1.0) * 4.0 * 91_513.0 / 9.81
    return deck_acceleration(scene.replaced({"vehicle.bodies.0.mass": scene.vehicle.bodies[0].mass + more}))


def judged(name: str, recordings: list[Recording], site: Site, noise: float) -> tuple[Counter[str], float]:
    """Return how the verdicts on recordings of a fault are, and the median of χ²."""
    part, counts, left = FAULTS[name].part, Counter[str](), []
    for recording in recordings:
        finding = diagnose(recording, site, noise=noise, faults=COMPARED)
        left.append(finding.reduced)
        if finding.verdict == "not explained":
            counts["unexplained"] += 1
        else:
            kind = "healthy" if finding.verdict == "healthy" else "wrong"
            counts["right" if finding.part == part else kind] += 1
    return counts, float(np.median(left))


def at_first(recordings: list[Recording], site: Site, noise: float) -> str:
    """Return medians of m/m0 and c/c0 in the part of each recording that the core model explains, and its end."""
    vehicle, found = site.passage.vehicle, []
    bare = Site(passage=site.passage, sensor=site.sensor, uncertainty=KNOWN)
    for recording in recordings:
        fit = fit_over_windows(
            FitProblem(recording, site.sensor, noise, site.passage, priors_of(bare, UNKNOWN)), onset(recording, noise)
        )
        over = fit.values[:2] / np.array([vehicle.mass, vehicle.damping])
        found.append([*over, min(fit.held, DURATION)])
    mass, damping, held = np.median(found, axis=0)
    return f"{mass:.3f} {damping:.3f} {1e3 * held:4.0f} ms"


def fault_table(height: float) -> None:
    """Print how faults of the coach, and of the core model itself, are judged."""
    scene, share = coach(irregularity={"both": bump(height)}), ALLOWED[height]
    rms = float(deck_acceleration(scene).std())
    stated = site_of(scene, rms)
    site = Site(passage=stated.passage, sensor=stated.sensor, uncertainty=KNOWN | SPREAD)
    noise, whole = SHARE * rms, float(np.hypot(SHARE, share) * rms)
    print(
        f"\nbump of {1e3 * height:g} mm, {100 * share:g} % of the rms added to the noise in quadrature for the coach."
    )
    print(
        f"Of {PASSAGES} passages each: right part/not explained/healthy/wrong part; median of χ² (in brackets with the"
    )
    print("noise alone); m/m0 and c/c0 in the part of the recording that the core model explains, up to its end")
    print(f"{'fault of wheelset 1':28} {'core model':>18} {'coach':>34}  {'m, c, until':>24}")
    total: dict[str, Counter[str]] = {"core model": Counter(), "coach": Counter()}
    for name, fault in FAULTS.items():
        coaches = [recorded(passage(fault, n, height), noise, n) for n in range(PASSAGES)]
        kind, size = fault.core
        own = synthesise(stated, PASSAGES, fault=Condition(kind, size, 0.415) if kind else None, seed=7)
        cells = []
        for column, of, spread in zip(total, (own, coaches), (noise, whole), strict=True):
            counts, left = judged(name, of, site, spread)
            total[column].update(counts)
            shown = "/".join(str(counts[kind]) for kind in ("right", "unexplained", "healthy", "wrong"))
            bare = f" ({left * (spread / noise) ** 2:9.4g})" if spread > noise else ""
            cells.append(f"{shown} {left:9.4g}{bare}")
        print(f"{name:28} {cells[0]:>18} {cells[1]:>34}  {at_first(coaches, site, whole):>24}", flush=True)
    for column, counts in total.items():
        print(f"{column}: {dict(counts)}")


def main(clock: Callable[[], float] = time.perf_counter) -> None:
    """Print both tables."""
    smallest = parser_of(__doc__).parse_args().smallest
    began = clock()
    print({name: held for name, held in surroundings().items() if name in ("cpu", "cores", "commit", "load")})
    if smallest:
        healthy_table(dict(list(SOUND.items())[:1]))
        return
    healthy_table(SOUND)
    for height in ALLOWED:
        fault_table(height)
    print(f"{clock() - began:.0f} s")


if __name__ == "__main__":
    main()
