"""Claims on plastic deformation and damage (the paper, section 6)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import Measure, claim, count, relative, within
from wheeltapper.faces.paper.deck import tuned
from wheeltapper.faces.paper.setting import CONSTANT, STATIC, bump, scene

THORNTON = wt.contact.Thornton(constant=CONSTANT, yield_force=2.0 * STATIC, rail_share=1.0)
WAVELENGTH = 0.05
BEYOND_RESONANCE, AT_RESONANCE = 36.0, 9.0


def corrugated(speed: float, length: float = 2.0) -> wt.Scenario:
    """Return the corrugation of Fig. 7 with a contact that yields at twice the static force."""
    shape = wt.Corrugation(amplitude=-5e-5, wavelength=WAVELENGTH, start=0.01)
    return scene(shape, 8e3, speed, length / speed, contact=THORNTON, rolling="point")


def dropped(largest: float) -> wt.Record:
    """Drop the wheel, without suspension, on one spot so that the force reaches `largest` times the static one."""
    onset = THORNTON.yield_indentation(CONSTANT, 2, STATIC)
    depth = onset * (largest / 2.0 + 0.5) / 1.5
    force = 2.0 * STATIC
    work = 0.4 * force * onset + force * (0.75 * (depth**2 - onset**2) / onset - 0.5 * (depth - onset))
    speed = np.sqrt(2.0 * (work - STATIC * depth) / 1500.0)
    start = {"displacement": 0.0, "velocity": -float(speed)}
    free = {"stiffness": 0.0, "load": STATIC - 1500.0 * 9.81}
    return wt.simulate(scene(None, 0.0, 0.0, 0.01, contact=THORNTON, vehicle=free, start=start))


def onsets_of_yield(largest: float) -> int:
    """Return the number of onsets of yield in a vibration whose force starts at its largest value."""
    depth = (largest * STATIC / CONSTANT) ** (2.0 / 3.0)
    start = {"displacement": -depth, "velocity": 0.0}
    free = {"stiffness": 0.0, "load": STATIC - 1500.0 * 9.81}
    record = wt.simulate(scene(None, 0.0, 0.0, 0.02, contact=THORNTON, vehicle=free, start=start))
    return int((record.events.kind.values == "yield").sum())


def share_on_crests(marks: np.ndarray, position: np.ndarray) -> float:
    """Return the part of the permanent indentation that lies in the upper halves of the waves."""
    height = -5e-5 * np.sin(2.0 * np.pi * (position - 0.01) / WAVELENGTH)
    return float(marks[height > 0.0].sum() / marks.sum())


@claim("C44", "plastic", "above twice the static force the contact yields; beyond resonance the crests are smoothed")
def yields_and_smooths() -> Iterator[Measure]:
    """Measure residual indentations, and corrugated rail under 100 wheels.

    Beyond resonance the crests are smoothed even without hardening. At resonance the marks grow from wheel to wheel
    without hardening, and only hardening ends that.
    """
    for ratio, left in ((2.5, 1.24), (3.0, 4.51), (4.0, 15.5), (5.0, 30.6)):
        record = dropped(ratio)
        after = record.at([record.end]).permanent_indentation.values[0]
        yield relative(f"left of {ratio:g} N0 [µm]", 1e6 * float(after), left, 5e-3)
    for ratio, onsets in ((1.99, 0), (2.01, 1)):
        yield count(f"onsets of yield in vibrations up to {ratio:g} N0", onsets_of_yield(ratio), onsets)
    worn = wt.wear_in(corrugated(BEYOND_RESONANCE), 100, hardening=0.0)
    amplitude = 1e6 * worn.amplitude.sel(wavelength=WAVELENGTH, method="nearest").values
    yield within("amplitude of the waves after 100 wheels at 36 m/s [µm]", float(amplitude[-1]), 47.0, 49.0)
    force = worn.largest_force.values / STATIC
    yield within("largest force of the last wheel/N0", float(force[-1]), 2.2, 2.4)
    x = worn.position.values
    crests = share_on_crests(worn.permanent_indentation.values[-1], x)
    yield within("part of the marks on the crests, 36 m/s", crests, 0.999, 1.0)
    one = wt.wear_in(corrugated(AT_RESONANCE), 1)
    yield within(
        "deepest mark of one wheel at 9 m/s [µm]", 1e6 * float(one.permanent_indentation[-1].max()), 11.0, 17.0
    )
    hard = wt.wear_in(corrugated(AT_RESONANCE), 30).largest_force.values / STATIC
    yield within("largest force of 30 wheels at 9 m/s, hardening/N0", float(hard.max()), 0.0, 4.5)
    soft = wt.wear_in(corrugated(AT_RESONANCE), 10, hardening=0.0)
    height = 1e6 * float(np.ptp(soft.height.values[-1]))
    yield within("profile after 10 wheels at 9 m/s, no hardening [µm]", height, 200.0, 400.0)


@claim("C48b", "plastic", "an impulse marks a long section of a stiff track; a very light deck spares it")
def marks_behind_a_bump() -> Iterator[Measure]:
    """Count the marks behind the bump of Fig. 2; a moderately soft deck has more of them, as it has more impacts."""
    stiff, _ = hammered(wt.StiffTrack())
    yield count("marks on stiff track", stiff, 14, 1)
    for mass in (3000.0, 1500.0, 750.0):
        more = hammered(tuned(mass, 10.0))[0] - stiff
        yield within(f"more marks than on stiff track, M = {mass:g} kg", more, 1, np.inf)
    yield count("marks, M = 300 kg", hammered(tuned(300.0, 10.0))[0], 0)


@claim("C49b", "plastic", "the deepest mark cannot be avoided by a flexible track: true while the deck is heavy")
def deepest_mark() -> Iterator[Measure]:
    """Measure the deepest mark behind the bump over that on stiff track."""
    _, stiff = hammered(wt.StiffTrack())
    yield within("deepest mark on stiff track [µm]", stiff, 28.0, 31.0)
    for mass, low, high in ((15_000.0, 0.95, 1.0), (3000.0, 0.85, 1.0), (750.0, 0.0, 0.4), (300.0, 0.0, 0.0)):
        yield within(f"deepest mark over that, M = {mass:g} kg", hammered(tuned(mass, 10.0))[1] / stiff, low, high)


def hammered(track: wt.StiffTrack | wt.FloatingDeck) -> tuple[int, float]:
    """Return the number of marks behind a bump, and the depth of the deepest one in µm."""
    record = bump(5e4, 0.25, contact=THORNTON, track=track)
    table = wt.wear.marks(record).table
    left = table.permanent_indentation.values * (table.position.values > 0.06)
    deep = left > 1e-8
    return int((np.diff(deep.astype(int)) == 1).sum()), 1e6 * float(left.max())
