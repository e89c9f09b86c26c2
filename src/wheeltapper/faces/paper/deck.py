"""Claims on the floating deck: dynamic stiffness, and acceleration as an image of the force."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import pi

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import PINNED, Case, Measure, analysis, claim, said
from wheeltapper.faces.paper.corrugation import settled_times
from wheeltapper.faces.paper.setting import bump, flat, harmonic, impacts, largest, sine, step
from wheeltapper.faces.paper.single import DIGITS, RESTARTED

HALF_DAMPED = Case("bearings half damped")
"""Of critical damping; the paper's dynamic stiffness has a damping of the bearings, without a value."""
BARE = Case("bearings without damping", own=False)
BEARINGS = {HALF_DAMPED: 0.5, BARE: 0.0}
"""Damping ratio by case."""
TRACKS = {name: wt.tracks.Ballasted.named(name) for name in wt.tracks.Ballasted.published_names()}
"""Published tracks of rails on sleepers in ballast."""
ON_BALLAST = Case("on four published tracks")


def tuned(mass: float, frequency: float, damping: float = 0.0) -> wt.FloatingDeck:
    """Return a deck of this mass (kg), natural frequency (Hz) and damping ratio."""
    turns = 2 * pi * frequency
    return wt.FloatingDeck(mass=mass, stiffness=mass * turns**2, damping=2.0 * damping * mass * turns)


@claim(
    "C09", "deck", "the tendency to bounce falls with the deck's dynamic stiffness",
    "on bearings with damping; without, impacts are more unless the deck is so light that none is left",
)  # fmt: skip
def bouncing_over_stiffness() -> Iterator[Measure]:
    """Measure the number of impacts over the deck's mass at 10 Hz, with and without damping of its bearings."""
    stiff = impacts(bump(5e4, 0.25))
    yield RESTARTED.count("impacts on stiff track", stiff, 11)
    for case, damping in BEARINGS.items():
        for mass, expected in ((3000.0, 18), (1500.0, 27), (750.0, 35), (300.0, 0)):
            found = impacts(bump(5e4, 0.25, track=tuned(mass, 10.0, damping)))
            if case is BARE:
                yield RESTARTED.count(f"impacts, M = {mass:g} kg", found, expected)
            ratio = f"impacts over those on stiff track, M = {mass:g} kg"
            yield said("lower", "section 3", ratio, found / stiff, refutes=found > stiff, case=case)


FLAT = Case("a flat, not a bump", own=False)


@claim(
    "C10", "deck", "the largest force falls with the deck's dynamic stiffness",
    "for a bump; the force of a flat first rises, and falls on decks lighter than half a wheelset",
)  # fmt: skip
def force_over_stiffness() -> Iterator[Measure]:
    """Measure the largest force over the deck's mass at 10 Hz."""
    stiff = largest(bump(5e4, 0.25))
    for mass, expected in ((3000.0, 5.40826), (1500.0, 5.18405), (750.0, 4.04569), (300.0, 1.66333)):
        found = largest(bump(5e4, 0.25, track=tuned(mass, 10.0)))
        yield PINNED.relative(f"N_max/N0, bump, M = {mass:g} kg", found, expected)
        yield said("lower", "section 3", f"N_max/N0 over that on stiff track, bump, M = {mass:g} kg", found / stiff)
    stiff = largest(flat(8e3, 0.25))
    yield PINNED.relative("N_max/N0, flat, stiff", stiff, 3.23192)
    rows = ((15_000, 3.31811), (3000, 3.55405), (1500, 3.67347), (750, 3.60553), (300, 2.85304), (150, 1.98855))
    for mass, expected in rows:
        found = largest(flat(8e3, 0.25, track=tuned(mass, 10.0)))
        yield PINNED.relative(f"N_max/N0, flat, M = {mass} kg", found, expected)
        ratio = f"N_max/N0 over that on stiff track, flat, M = {mass} kg"
        yield said("lower", "section 3", ratio, found / stiff, refutes=mass > 300, case=FLAT)


def dynamic_stiffness(mass: float, stiffness: float, frequency: float) -> float:
    """Return |force/displacement| in N/m of a deck, from a wheel that rolls over corrugation of this frequency (Hz)."""
    speed = frequency * 0.05
    deck = wt.FloatingDeck(mass=mass, stiffness=stiffness)
    record = sine(1e-6, 2e5, speed, 3.0, track=deck)
    times = settled_times(record, int(0.5 * frequency), 1.0 / frequency)
    history = record.at(times)
    force, motion = (harmonic(times, history[n].values, frequency) for n in ("normal_force", "deck_displacement"))
    return abs(force / motion)


def printed_stiffness(mass: float, stiffness: float, frequency: float) -> float:
    """Return the magnitude of a deck's dynamic stiffness as the paper prints it, M·ω² + C·ω + K without damping C."""
    return mass * (2 * pi * frequency) ** 2 + stiffness


@claim(
    "C11", "deck", "the magnitude of the deck's dynamic stiffness is M·ω² + C·ω + K",
    "inertia and spring subtract: it is |K − M·ω² + i·ω·C|",
)  # fmt: skip
def stiffness_modulus() -> Iterator[Measure]:
    """Measure force over displacement at 180 Hz of a deck of 1500 kg on 1e9 N/m, which has no damper."""
    found = dynamic_stiffness(1500.0, 1e9, 180.0)
    exact = abs(1e9 - 1500.0 * (2 * pi * 180.0) ** 2)
    yield analysis("|K − M·ω²|").relative("dynamic stiffness [N/m], M = 1500 kg, K = 1e9 N/m", found, exact, 1e-6)
    ratio = found / printed_stiffness(1500.0, 1e9, 180.0)
    yield said("practically identical", "section 3", "dynamic stiffness over M·ω² + K", ratio, refutes=True)


@claim("C48", "deck", "a stiff track gives a long series of impacts, and a flexible one is better")
def series_on_flexible_track() -> Iterator[Measure]:
    """Measure the number of impacts against that on the stiff track, on ballast and on decks with damped bearings."""
    stiff = impacts(bump(5e4, 0.25))
    yield said("several times", "section 6: a long series", "impacts on stiff track", stiff)
    flexible = {f"M = {mass:g} kg": (HALF_DAMPED, tuned(mass, 10.0, 0.5)) for mass in (3000.0, 1500.0, 750.0, 300.0)}
    for name, (case, track) in (flexible | {name: (ON_BALLAST, track) for name, track in TRACKS.items()}).items():
        ratio = impacts(bump(5e4, 0.25, track=track)) / stiff
        yield said("lower", "section 6: better", f"impacts over those on stiff track, {name}", ratio, case=case)


HEAVY = Case("heavy deck", own=False)
LIGHT = Case("light deck", own=False)
JUMP = Case("ideal jump on four published tracks", own=False)
FLATS = Case("flat at 20 m/s on four published tracks", own=False)
FIRST = "section 6: impossible to attenuate"


@claim(
    "C49", "deck", "a flexible track cannot attenuate the first and highest impulse",
    "four published ballasted tracks, on which a step and a bump lose more than half of it; it holds for an ideal "
    "jump, a flat at 20 m/s and a deck heavier than the wheelset",
)  # fmt: skip
def first_impulse() -> Iterator[Measure]:
    """Measure the largest force on ballast and on decks over that on stiff track."""
    runs: dict[str, tuple[Case, Callable[..., wt.Record]]] = {
        "step of 0.1 mm at 5 m/s": (ON_BALLAST, lambda **track: step(1e-4, 8e3, 0.1, **track)),
        "bump of 5 cm at 9 m/s": (ON_BALLAST, lambda **track: bump(5e4, 0.25, **track)),
        "jump of 0.1 mm": (JUMP, lambda **track: step(1e-4, 0.0, 0.06, ideal=True, **track)),
        "flat of 0.1 mm at 20 m/s": (FLATS, lambda **track: flat(8e3, 0.1, 20.0, **track)),
    }
    for words, (case, run) in runs.items():
        stiff = largest(run())
        ratios = np.array([largest(run(track=track)) for track in TRACKS.values()]) / stiff
        for end, ratio in (("least", ratios.min()), ("most", ratios.max())):
            name = f"largest force over that on stiff track, {words}, {end}"
            yield said("impossible to attenuate", FIRST, name, float(ratio), refutes=case is ON_BALLAST, case=case)
    stiff = largest(bump(5e4, 0.25))
    for mass, expected in ((15_000.0, 0.997583), (3000.0, 0.971725), (750.0, 0.726905), (300.0, 0.298857)):
        ratio = largest(bump(5e4, 0.25, track=tuned(mass, 10.0))) / stiff
        name, case = f"largest force over that on stiff track, M = {mass:g} kg", HEAVY if mass > 1500.0 else LIGHT
        yield PINNED.relative(name, ratio, expected)
        yield said("impossible to attenuate", FIRST, name, ratio, refutes=case is LIGHT, case=case)


@claim("C22", "fig5", "the heavy deck's acceleration imitates the normal force")
def deck_imitates_force() -> Iterator[Measure]:
    """Measure correlation and slope of the deck's acceleration, downwards, against the force's dynamic part."""
    for frequency, slope in ((5.0, -1.000868), (10.0, -1.003490), (20.0, -1.014057)):
        record = flat(0.0, 0.2, track=tuned(15_000.0, frequency))
        history = record.history(50e3)
        force = history.normal_force.values - record.static_force
        acceleration = history.deck_acceleration.values
        fitted = float(np.polyfit(force, 15_000.0 * acceleration, 1)[0])
        correlation = -float(np.corrcoef(force, acceleration)[0, 1])
        yield said("linearly proportional", "section 4, Fig. 5", f"correlation, {frequency:g} Hz", correlation)
        yield PINNED.relative(f"slope times M, {frequency:g} Hz", fitted, slope, 1e-4)
        if frequency == 5.0:
            yield PINNED.relative("largest acceleration [m/s²]", float(np.abs(acceleration).max()), 16.6780)


@claim(
    "C23", "fig5", "the force on a heavy deck is that on a stiff track",
    "peaks and intervals nearly are; the intervals' difference adds up to half a bounce within 15 bounces",
)  # fmt: skip
def nearly_a_stiff_track() -> Iterator[Measure]:
    """Measure peak and interval of the flat with and without the deck, and the time of a late impact."""
    deck = wt.FloatingDeck(mass=15_000, stiffness=1.5e7)
    found = []
    for name, track, peak, interval in (
        ("stiff", wt.StiffTrack(), 3.280872, 6.544460),
        ("deck", deck, 3.362815, 6.323999),
    ):
        record = flat(0.0, 0.13, track=track)
        found.append((largest(record), 1e3 * float(record.impacts.interval[0]), 1e3 * float(record.impacts.time[15])))
        yield DIGITS.relative(f"N_max/N0, {name}", found[-1][0], peak, 1e-6)
        yield DIGITS.relative(f"interval [ms], {name}", found[-1][1], interval, 1e-6)
    where = "section 4: practically identical"
    for name, on_rail, on_deck in zip(("N_max", "first interval"), *found, strict=False):
        yield said(
            "practically identical", "section 4", f"{name} on the deck over that on stiff track", on_deck / on_rail
        )
    late = abs(found[1][2] - found[0][2]) / found[0][1]
    drift = Case("phase after 15 bounces", own=False)
    yield said("very small", where, "difference in the time of impact 16, over an interval", late, True, drift)
    heavy = largest(flat(0.0, 0.1, track=tuned(150_000.0, 5.0))) / largest(flat(0.0, 0.1)) - 1.0
    yield PINNED.relative("peak with ten times the mass, over that on stiff track, less 1 [%]", 100.0 * heavy, 0.26646)
