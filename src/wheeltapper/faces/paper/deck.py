"""Claims on the floating deck: dynamic stiffness, and acceleration as an image of the force."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import Measure, claim, count, relative, within
from wheeltapper.faces.paper.corrugation import settled
from wheeltapper.faces.paper.setting import bump, flat, harmonic, impacts, largest, sine


def tuned(mass: float, frequency: float) -> wt.FloatingDeck:
    """Return a deck of this mass (kg) and natural frequency (Hz)."""
    return wt.FloatingDeck(mass=mass, stiffness=mass * (2 * pi * frequency) ** 2)


@claim("C09", "deck", "bouncing falls with the deck's dynamic stiffness: only for a large drop of it")
def bouncing_over_stiffness() -> Iterator[Measure]:
    """Measure the number of impacts over the deck's mass at 10 Hz."""
    yield count("impacts on stiff track", impacts(bump(5e4, 0.25)), 11)
    for mass, expected in ((3000.0, 18), (1500.0, 27), (750.0, 35), (300.0, 0)):
        yield count(f"impacts, M = {mass:g} kg", impacts(bump(5e4, 0.25, track=tuned(mass, 10.0))), expected, 1)


@claim("C10", "deck", "the largest force falls with the deck's stiffness for a bump; for a flat it rises first")
def force_over_stiffness() -> Iterator[Measure]:
    """Measure the largest force over the deck's mass at 10 Hz."""
    for mass, expected in ((3000.0, 5.41), (1500.0, 5.18), (750.0, 4.05), (300.0, 1.66)):
        yield relative(f"bump, M = {mass:g} kg", largest(bump(5e4, 0.25, track=tuned(mass, 10.0))), expected, 5e-3)
    yield relative("flat, stiff", largest(flat(8e3, 0.25)), 3.23, 5e-3)
    rows = ((15_000, 3.32), (3000, 3.55), (1500, 3.67), (750, 3.61), (300, 2.85), (150, 1.99))
    for mass, expected in rows:
        yield relative(f"flat, M = {mass} kg", largest(flat(8e3, 0.25, track=tuned(mass, 10.0))), expected, 5e-3)


def dynamic_stiffness(mass: float, stiffness: float, frequency: float) -> float:
    """Return |force/displacement| in N/m of a deck, from a wheel that rolls over corrugation of this frequency (Hz)."""
    speed = frequency * 0.05
    deck = wt.FloatingDeck(mass=mass, stiffness=stiffness)
    record = sine(1e-6, 2e5, speed, 3.0, track=deck)
    times = settled(record, int(0.5 * frequency), 1.0 / frequency)
    history = record.at(times)
    force, motion = (harmonic(times, history[n].values, frequency) for n in ("normal_force", "deck_displacement"))
    return abs(force / motion)


@claim("C11", "deck", "the modulus of the deck's dynamic stiffness at 180 Hz: a misprint")
def stiffness_modulus() -> Iterator[Measure]:
    """Measure force over displacement of the paper's deck at 180 Hz; the paper prints 2.919e9 N/m."""
    yield relative("|K - M·ω²| [N/m], M = 1500 kg, K = 1e9 N/m", dynamic_stiffness(1500.0, 1e9, 180.0), 0.919e9, 1e-3)


@claim("C48", "deck", "a flexible track shortens the series of impacts: only a very light deck does")
def series_on_flexible_track() -> Iterator[Measure]:
    """Measure the number of impacts against that on the stiff track."""
    stiff = impacts(bump(5e4, 0.25))
    for mass in (3000.0, 1500.0, 750.0):
        more = impacts(bump(5e4, 0.25, track=tuned(mass, 10.0))) - stiff
        yield within(f"more impacts than on stiff track, M = {mass:g} kg", more, 1, np.inf)
    yield count("impacts, M = 300 kg", impacts(bump(5e4, 0.25, track=tuned(300.0, 10.0))), 0)


@claim("C49", "deck", "the first and highest impulse cannot be attenuated: true while the deck is heavy")
def first_impulse() -> Iterator[Measure]:
    """Measure the largest force on the deck over that on stiff track."""
    stiff = largest(bump(5e4, 0.25))
    for mass, low, high in ((15_000.0, 0.95, 1.05), (3000.0, 0.95, 1.05), (750.0, 0.0, 0.8), (300.0, 0.0, 0.4)):
        ratio = largest(bump(5e4, 0.25, track=tuned(mass, 10.0))) / stiff
        yield within(f"largest force over that on stiff track, M = {mass:g} kg", ratio, low, high)


@claim("C22", "fig5", "the heavy deck's acceleration imitates the normal force")
def deck_imitates_force() -> Iterator[Measure]:
    """Measure correlation and slope of the deck's acceleration against the force's dynamic part."""
    for frequency, slope in ((5.0, -1.0009), (10.0, -1.0035), (20.0, -1.0141)):
        record = flat(0.0, 0.2, track=tuned(15_000.0, frequency))
        history = record.history(50e3)
        force = history.normal_force.values - record.static_force
        acceleration = history.deck_acceleration.values
        fitted = float(np.polyfit(force, 15_000.0 * acceleration, 1)[0])
        correlation = float(np.corrcoef(force, acceleration)[0, 1])
        yield within(f"correlation, {frequency:g} Hz", correlation, -1.0, -1.0 + 1e-3)
        yield relative(f"slope times M, {frequency:g} Hz", fitted, slope, 1e-3)
        if frequency == 5.0:
            yield relative("largest acceleration [m/s²]", float(np.abs(acceleration).max()), 16.7, 3e-3)


@claim("C23", "fig5", "the force on a heavy deck is that on a stiff track: nearly, and not for long")
def nearly_a_stiff_track() -> Iterator[Measure]:
    """Measure peak and interval of the flat with and without the deck."""
    deck = wt.FloatingDeck(mass=15_000, stiffness=1.5e7)
    for name, track, peak, interval in (("stiff", wt.StiffTrack(), 3.281, 6.544), ("deck", deck, 3.363, 6.324)):
        record = flat(0.0, 0.1, track=track)
        yield relative(f"N_max/N0, {name}", largest(record), peak, 3e-3)
        yield relative(f"interval [ms], {name}", 1e3 * float(record.impacts.interval[0]), interval, 3e-3)
    heavy = largest(flat(0.0, 0.1, track=tuned(150_000.0, 5.0))) / largest(flat(0.0, 0.1)) - 1.0
    yield within("peak with ten times the mass [%]", 100.0 * heavy, 0.22, 0.32)
