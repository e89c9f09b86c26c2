"""Claims on plastic deformation and damage (the paper, section 6)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import PINNED, Case, Measure, analysis, claim, said
from wheeltapper.faces.paper.deck import BARE, BEARINGS, FIRST, HEAVY, LIGHT, ON_BALLAST, TRACKS, tuned
from wheeltapper.faces.paper.setting import CONSTANT, STATIC, bump, scene

THORNTON = wt.contact.Thornton(constant=CONSTANT, yield_force=2.0 * STATIC, rail_share=1.0)
WAVELENGTH = 0.05
SMOOTHED = "section 6: may even help to smooth"
BOUNCES = "the deepest mark follows the highest bounce"
BEYOND_RESONANCE, AT_RESONANCE = 36.0, 9.0


def yielding_corrugation(speed: float, length: float = 2.0) -> wt.Scenario:
    """Return the corrugation of Fig. 7 with a contact that yields at twice the static force."""
    shape = wt.Corrugation(amplitude=-5e-5, wavelength=WAVELENGTH, start=0.01)
    return scene(shape, 8e3, speed, length / speed, contact=THORNTON, rolling="point")


def dropped_wheel(largest: float) -> wt.Record:
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


@claim(
    "C44", "plastic", "above twice the static force the contact yields, and high forces on the crests smooth the waves",
    "beyond the resonance; at it, without hardening, the marks grow. The limit of elasticity is given, not found",
)  # fmt: skip
def yields_and_smooths() -> Iterator[Measure]:
    """Measure residual indentations, and corrugated rail under 100 wheels.

    Beyond resonance the crests are smoothed even without hardening. At resonance the marks grow from wheel to wheel
    without hardening, and only hardening ends that.
    """
    for ratio, left in ((2.5, 1.23410), (3.0, 4.50659), (4.0, 15.4367), (5.0, 30.5168)):
        record = dropped_wheel(ratio)
        after = record.at([record.end]).permanent_indentation.values[0]
        yield PINNED.relative(f"left of {ratio:g} N0 [µm]", 1e6 * float(after), left)
    for ratio, onsets in ((1.99, 0), (2.01, 1)):
        given = analysis("the law is given to yield at 2 N0")
        yield given.count(f"onsets of yield in vibrations up to {ratio:g} N0", onsets_of_yield(ratio), onsets)
    worn = wt.wear_in(yielding_corrugation(BEYOND_RESONANCE), 100, hardening=0.0)
    waves = 1e6 * worn.amplitude.sel(wavelength=WAVELENGTH, method="nearest").values
    after = float(waves[-1])
    yield said(
        "lower", SMOOTHED, "amplitude of the waves after 100 wheels at 36 m/s, over that before", after / waves[0]
    )
    yield PINNED.relative("amplitude of the waves after 100 wheels at 36 m/s [µm]", after, 48.6600)
    force = worn.largest_force.values / STATIC
    yield PINNED.relative("largest force of the last wheel/N0", float(force[-1]), 2.29298)
    x = worn.position.values
    crests = share_on_crests(worn.permanent_indentation.values[-1], x)
    yield said("linearly proportional", "section 6: at peaks", "part of the marks on the crests, 36 m/s", crests)
    one = wt.wear_in(yielding_corrugation(AT_RESONANCE), 1)
    deepest = 1e6 * float(one.permanent_indentation[-1].max())
    yield PINNED.relative("deepest mark of one wheel at 9 m/s [µm]", deepest, 14.6639, 1e-2, BOUNCES)
    hard = wt.wear_in(yielding_corrugation(AT_RESONANCE), 30).largest_force.values / STATIC
    yield PINNED.relative(
        "largest force of 30 wheels at 9 m/s, hardening/N0", float(hard.max()), 4.06933, 1e-2, BOUNCES
    )
    soft = wt.wear_in(yielding_corrugation(AT_RESONANCE), 10, hardening=0.0)
    virgin, height = (1e6 * float(np.ptp(one)) for one in (soft.height.values[0], soft.height.values[-1]))
    words = "profile's height after 10 wheels at 9 m/s without hardening, over that before"
    resonance = Case("at the resonance, without hardening", own=False)
    yield said("lower", SMOOTHED, words, height / virgin, refutes=True, case=resonance)
    wide = "bounces grow from wheel to wheel, and rounding with them"
    yield PINNED.relative("profile after 10 wheels at 9 m/s, no hardening [µm]", height, 348.0, 0.1, wide)


@claim(
    "C48b", "plastic", "a long section of a stiff track undergoes hammering, and a flexible one is better",
    "on ballast and on decks with damped bearings; without that damping marks are more, as impacts are",
)  # fmt: skip
def marks_behind_a_bump() -> Iterator[Measure]:
    """Count the marks behind the bump of Fig. 2."""
    stiff, _ = marks_behind_bump(wt.StiffTrack())
    yield said("several times", "section 6: a long section", "marks on stiff track", stiff)
    yield PINNED.count("marks on stiff track", stiff, 14)
    for name, track in TRACKS.items():
        ratio = f"marks over those on stiff track, {name}"
        yield said("lower", "section 6: better", ratio, marks_behind_bump(track)[0] / stiff, case=ON_BALLAST)
    for case, damping in BEARINGS.items():
        for mass, expected in ((3000.0, 24), (1500.0, 35), (750.0, 52), (300.0, 0)):
            marks = marks_behind_bump(tuned(mass, 10.0, damping))[0]
            if case is BARE:
                last = "the last marks are faint"
                yield PINNED.count(f"marks, M = {mass:g} kg", marks, expected, 1 if marks else 0, last)
            ratio = f"marks over those on stiff track, M = {mass:g} kg"
            yield said("lower", "section 6: better", ratio, marks / stiff, refutes=marks > stiff, case=case)


@claim(
    "C49b", "plastic", "a flexible track cannot attenuate the highest impulse, nor the mark that it leaves",
    "four published ballasted tracks, on which a bump leaves no mark; it holds for a deck heavier than the wheelset",
)  # fmt: skip
def deepest_mark() -> Iterator[Measure]:
    """Measure the deepest mark behind the bump over that on stiff track."""
    _, stiff = marks_behind_bump(wt.StiffTrack())
    yield PINNED.relative("deepest mark on stiff track [µm]", stiff, 29.5670)
    deepest = max(marks_behind_bump(track)[1] for track in TRACKS.values()) / stiff
    yield said("impossible to attenuate", FIRST, "deepest mark over that, the most", deepest, True, ON_BALLAST)
    for mass, expected in ((15_000.0, 0.988980), (3000.0, 0.906399), (750.0, 0.345968), (300.0, 0.0)):
        ratio = marks_behind_bump(tuned(mass, 10.0))[1] / stiff
        words, case = f"deepest mark over that, M = {mass:g} kg", HEAVY if mass > 1500.0 else LIGHT
        yield PINNED.relative(words, ratio, expected)
        yield said("impossible to attenuate", FIRST, words, ratio, refutes=case is LIGHT, case=case)


def marks_behind_bump(track: wt.tracks.Track) -> tuple[int, float]:
    """Return the number of marks behind a bump, and the depth of the deepest one in µm."""
    record = bump(5e4, 0.25, contact=THORNTON, track=track)
    table = wt.wear.marks(record).table
    left = table.permanent_indentation.values * (table.position.values > 0.06)
    deep = left > 1e-8
    return int((np.diff(deep.astype(int)) == 1).sum()), 1e6 * float(left.max())
