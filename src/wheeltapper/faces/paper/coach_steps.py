"""Claims on the coach over single irregularities (the paper, Figs 4 to 6); b repeats a core model's claim."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper import coach_setting as setting
from wheeltapper.faces.paper import setting as core
from wheeltapper.faces.paper.claims import PINNED, Case, Measure, analysis, claim, said
from wheeltapper.faces.paper.coach_setting import (
    CHANGES,
    COACH,
    FREE,
    HEIGHT,
    ORIGINAL,
    STATIC,
    UNDAMPED,
    ZONES,
    body,
    force,
    largest,
    step,
    times,
)
from wheeltapper.faces.paper.single import VIBRATIONS, bounces

SIGNS = {"up": HEIGHT, "down": -HEIGHT}
BOGIE = ("wheelset 1", "wheelset 2")
UNAFFECTED = "section 4, Fig. 4: not affected"
CLOSE = "a difference of nearly equal numbers"
FITTED = "the slope of a line through logarithms of maxima"
COMFORTABLE = 0.315
"""Weighted acceleration, m/s², below which ISO 2631-1, annex C, calls a ride not uncomfortable."""
PERCEIVED = 0.015
"""Acceleration that half of all people just feel, m/s² (ISO 2631-1, annex C)."""


# -- Fig. 4: steps ----------------------------------------------------------------------------------------------------


@claim("C14", "fig4coach", "mass and damper are a good reduced model: the coach's forces are those of the core model")
def core_and_coach() -> Iterator[Measure]:
    """Measure the first eight force peaks, over those of the core model, of the coach and its 17 vertical motions."""
    plane = setting.vertical_changes(FREE)
    pinned = {
        ("up", "coach"): 0.3194,
        ("up", "17 degrees"): 0.3209,
        ("down", "coach"): 0.0862,
        ("down", "17 degrees"): 0.0872,
    }
    for name, height in SIGNS.items():
        table = core.step(height, 0.0, 0.08).peaks
        expected = table.normal_force.values[~table.corner.values][:8] / core.STATIC
        for of, changes in (("coach", {"vehicle": FREE}), ("17 degrees", plane)):
            _, found = setting.wheel_peaks(step(height, 0.08, **changes))
            off = float(np.abs(found[:8] / expected - 1.0).max())
            case = f"step {name}, {of}"
            yield said(
                "practically identical", "section 4: good", f"peak that deviates most, over the core's, {case}", 1 + off
            )
            expected_off = pinned[name, of]
            yield PINNED.absolute(f"largest deviation of 8 peaks, {case} [%]", 100.0 * off, expected_off, 2e-3, CLOSE)
    sine = core.sine(-setting.AMPLITUDE, 0.0, 36.0, 0.2)
    record, _ = setting.corrugation(36.0, 0.2)
    off = largest(record, 4) / core.largest(sine) - 1.0
    yield said("practically identical", "section 5", "N_max over the core's, corrugation at 36 m/s", 1.0 + off)
    yield PINNED.absolute("deviation of N_max, corrugation at 36 m/s [%]", 100.0 * off, -0.0779, 2e-3, CLOSE)


@claim(
    "C15", "fig4coach", "the front wheelset is not affected by the excitation of the rear one",
    "with material damping or dampers; without any, its force maxima keep their heights, but their phases drift",
)  # fmt: skip
def front_is_unaffected() -> Iterator[Measure]:
    """Measure the front wheelset's force when the rear one meets the step, less that when it does not."""
    end = 1.2
    pinned = {ORIGINAL: 0.0028232, UNDAMPED: 0.143129}
    for case, changes in CHANGES.items():
        both, alone = (step(HEIGHT, end, under=under, **changes) for under in (BOGIE, BOGIE[:1]))
        at = times(0.0, end)
        off = np.max([np.abs(force(both.at(at), 1, s) - force(alone.at(at), 1, s)) for s in ("left", "right")], axis=0)
        change, words = float(off.max()), "largest change of N/N0 by 1.2 s"
        yield said("practically none", UNAFFECTED, words, change, refutes=case is UNDAMPED, case=case)
        if case in pinned:
            yield PINNED.relative(f"{words}, {case.name}", change, pinned[case], 1e-2, CLOSE)
        if case is UNDAMPED:
            at_first = float(off[at < setting.MEETS + setting.LATER + 0.19].max())
            yield PINNED.relative(f"largest change of N/N0 in 0.19 s, {case.name}", at_first, 0.060763, 1e-2, CLOSE)
            heights = (setting.wheel_peaks(record)[1] for record in (both, alone))
            same, words = float(np.abs(np.subtract(*heights)).max()), "largest change of its peaks/N0 by 1.2 s"
            yield said("practically none", UNAFFECTED, words, same, case=case)
            yield PINNED.relative(f"{words}, {case.name}", same, 0.0048804, 1e-2, CLOSE)


@claim("C16", "fig4coach", "the wheelsets of a bogie are practically uncoupled")
def wheelsets_are_uncoupled() -> Iterator[Measure]:
    """Measure the rear wheelset's force while only the front one is excited."""
    pinned = {UNDAMPED: 0.0052857, ORIGINAL: 0.0028415}
    for case, changes in CHANGES.items():
        end = setting.MEETS + setting.LATER
        range_ = float(np.ptp(force(step(HEIGHT, end, **changes).at(times(0.0, end)), 2)))
        where, words = "section 4, Fig. 4: practically uncoupled", "range of the rear N/N0"
        yield said("practically none", where, words, range_, case=case)
        if case in pinned:
            yield PINNED.relative(f"{words}, {case.name}", range_, pinned[case], 1e-2, CLOSE)


@claim(
    "C54",
    "fig4coach",
    "the wheelset on its soft suspension is a filter: little energy comes to the frame, none to the body",
)
def filter_of_energy() -> Iterator[Measure]:
    """Measure the largest kinetic energies of vertical motion after a step under the leading wheelset."""
    where = "section 6: a small amount to the frame, practically none to the car body"
    body_mass, frame_mass = (one.mass for one in FREE.bodies[:2])
    for case, changes in CHANGES.items():
        history = step(HEIGHT, 0.25, **changes).at(times(0.0, 0.25))
        wheelset, frame, car = (
            0.5 * mass * float(np.max(body(history, name, quantity="velocity") ** 2))
            for name, mass in (("wheelset 1", FREE.axles[0].mass), ("bogie 1", frame_mass), ("car body", body_mass))
        )
        yield said("small", where, "energy of the bogie frame over the wheelset's", frame / wheelset, case=case)
        yield said("practically none", where, "energy of the car body over the wheelset's", car / wheelset, case=case)


def _after_the_edge(record: wt.Record, index: int) -> float:
    """Return the time of an event of the right front wheel, in ms after the edge."""
    return 1e3 * (float(setting.wheel_rows(record.events).time[index]) - setting.MEETS)


def _impact_frequency(record: wt.Record) -> float:
    return 1.0 / float(setting.wheel_rows(record.impacts).interval[1])


def _bounces_then_vibrations(height: float) -> Iterator[Measure]:
    """Measure the frequencies of a step's bounces, and of the vibrations from 0.2 s after it on."""
    record = step(height, 0.6, **CHANGES[ZONES])
    yield bounces(_impact_frequency(record), ZONES)
    time, _ = setting.wheel_peaks(record)
    late = float(1.0 / np.diff(time[time > setting.MEETS + 0.2]).mean())
    yield said("about", VIBRATIONS, "frequency of the vibrations after 0.2 s, over 200 Hz", late / 200.0, case=ZONES)


@claim(
    "C17b",
    "fig4coach",
    "a step up makes vibro-impacts of 100 to 200 Hz under the coach, then vibrations of about 200 Hz",
)
def step_up() -> Iterator[Measure]:
    """Measure the coach's response to a step up."""
    yield from _bounces_then_vibrations(HEIGHT)
    record = step(HEIGHT, 0.05)
    _, heights = setting.wheel_peaks(record)
    yield bounces(_impact_frequency(record), UNDAMPED)
    yield PINNED.relative("first peak/N0", float(heights[0]), 2.19904)
    yield PINNED.relative("second peak/N0", float(heights[1]), 2.88744)
    yield PINNED.relative("loss after the edge [ms]", _after_the_edge(record, 0), 0.961472)
    yield PINNED.relative("impact after the edge [ms]", _after_the_edge(record, 1), 2.65871)
    yield PINNED.relative("frequency [Hz]", _impact_frequency(record), 162.896)


@claim(
    "C18b",
    "fig4coach",
    "a step down makes vibro-impacts of 100 to 200 Hz under the coach, then vibrations of about 200 Hz",
)
def step_down() -> Iterator[Measure]:
    """Measure the coach's response to a step down."""
    yield from _bounces_then_vibrations(-HEIGHT)
    record = step(-HEIGHT, 0.05)
    yield bounces(_impact_frequency(record), UNDAMPED)
    yield PINNED.relative("N_max/N0", largest(record), 2.64118)
    yield PINNED.relative("loss after the edge [ms]", _after_the_edge(record, 0), 6.54870)
    yield PINNED.relative("impact after the edge [ms]", _after_the_edge(record, 1), 7.55937)
    yield PINNED.relative("frequency [Hz]", _impact_frequency(record), 168.719)


@claim("C19b", "fig4coach", "an ideal jump of the rail gives the coach higher peaks, too", section=4)
def ideal_step() -> Iterator[Measure]:
    """Measure the limit of wheels of radius zero."""
    for (name, height), expected in zip(SIGNS.items(), (3.27756, 2.76086), strict=True):
        yield PINNED.relative(f"N_max/N0 {name}", largest(step(height, 0.05, ideal=True)), expected)


@claim("C20b", "fig4coach", "the sign of the step decides the coach's peak", section=4)
def sign_of_the_step() -> Iterator[Measure]:
    """Measure both signs with the dampers of the coach."""
    for (name, height), expected in zip(SIGNS.items(), (2.85507, 2.62403), strict=True):
        yield PINNED.relative(f"N_max/N0 {name}", largest(step(height, 0.1, COACH)), expected)


@claim("C47", "fig4coach", "a symmetric step makes lateral forces: small, towards the middle, and opposite")
def lateral_forces() -> Iterator[Measure]:
    """Measure lateral force over normal force on a step; the tread touches the rail at an angle of 0.034."""
    for name, height in SIGNS.items():
        record = step(height, 0.1)
        history = record.at(times(0.0, 0.1)).sel(wheelset=1)
        left = history.sel(side="left")
        touching = left.normal_force.values > 0.01 * STATIC
        ratio = (left.lateral_force / left.normal_force).values[touching]
        without = ((left.lateral_force - left.lateral_creep_force) / left.normal_force).values[touching]
        size = abs(float(ratio.mean()))
        yield said("not zero", "section 4, Fig. 4", f"|T/N|, {name}", size)
        yield said("very small", "section 4", f"|T/N|, {name}", size)
        yield PINNED.relative(f"T/N of the normal force's part, left, {name}", float(without.mean()), -0.0341498)
        yield PINNED.relative(f"T/N with spin creep, left, {name}", float(ratio.mean()), -0.0056207)
        spread = float(np.ptp(ratio)) / size
        yield said("practically none", "section 4, Fig. 4: T follows N", f"spread of T/N over its mean, {name}", spread)
        total = float(np.abs(history.lateral_force.sum("side")).max())
        yield analysis("symmetry").absolute(f"largest sum of left and right [N], {name}", total, 0.0, 1e-6)


@claim("C46", "onesided", "a step on one rail makes shorter transients than one on both")
def one_sided() -> Iterator[Measure]:
    """Measure how fast the right wheel's force maxima decay within 0.2 s."""
    pinned = {
        (UNDAMPED, "up"): (0.0, 2.805), (UNDAMPED, "down"): (0.0, 3.279),
        (ORIGINAL, "up"): (2.820, 5.577), (ORIGINAL, "down"): (2.815, 6.183),
    }  # fmt: skip
    for case, changes in CHANGES.items():
        for sign, height in SIGNS.items():
            both, right = (
                setting.decay_rate(step(height, 0.25, under=(under,), **changes), 0.2)
                for under in ("wheelset 1", "wheelset 1 right")
            )
            if case is not UNDAMPED:  # where nothing decays on both rails
                words = f"decay rate, one rail over both, {sign}"
                yield said("higher", "section 4: shorter", words, right / both, case=case)
            if (case, sign) in pinned:
                on_both, on_one = pinned[case, sign]
                end = f"{sign}, {case.name}"
                yield PINNED.absolute(f"decay rate, both rails [1/s], {end}", both, on_both, 0.02, FITTED)
                yield PINNED.absolute(f"decay rate, one rail [1/s], {end}", right, on_one, 0.02, FITTED)


@claim(
    "C53", "onesided", "after an irregularity on one rail the forces of both sides are not in phase",
    "for the first 20 ms; from 50 ms on they are",
)  # fmt: skip
def sides_are_not_in_phase() -> Iterator[Measure]:
    """Measure the correlation of the right and the left force after a step on the right rail."""
    later = Case("from 50 ms on", own=False)
    for case, changes in (CHANGES | {later: CHANGES[ZONES]}).items():
        begin, end = (0.05, 0.1) if case is later else (0.0, 0.02)
        record = step(HEIGHT, 0.12, under=("wheelset 1 right",), **changes)
        history = record.at(times(setting.MEETS + begin, setting.MEETS + end))
        both = float(np.corrcoef(force(history, 1, "right"), force(history, 1, "left"))[0, 1])
        words = f"correlation of N_R and N_L, {1e3 * begin:g} to {1e3 * end:g} ms"
        yield said("not in phase", "section 4", words, both, refutes=case is later, case=case)


# -- Figs 5 and 6: deck and car body ----------------------------------------------------------------------------------


@claim("C22b", "fig5coach", "the acceleration of a deck under one wheelset of the coach imitates its normal force")
def deck_imitates_force() -> Iterator[Measure]:
    """Measure correlation and slope of the deck's acceleration against the force's dynamic part."""
    for case, changes in ((ZONES, CHANGES[ZONES]), (UNDAMPED, {})):
        record = setting.flat(0.2, **changes)
        history = record.history(50e3)
        dynamic = history.normal_force.sel(wheelset=1).sum("side").values - 2 * STATIC
        acceleration = history.deck_acceleration.values
        correlation, words = -float(np.corrcoef(dynamic, acceleration)[0, 1]), "correlation, acceleration downwards"
        yield said("linearly proportional", "section 4, Fig. 5", words, correlation, case=case)
    yield PINNED.relative("slope times M", float(np.polyfit(dynamic, 15_000.0 * acceleration, 1)[0]), -1.000872)
    yield PINNED.relative("largest acceleration [m/s²]", float(np.abs(acceleration).max()), 16.6933)
    yield PINNED.relative("N_max/N0", largest(record), 3.36031)


def car_body(record: wt.Record, rate: float = 4e3) -> tuple[Any, Any]:
    """Return times and the vertical acceleration of the car body's centre of gravity, m/s²."""
    history = record.history(rate)
    return history.time.values, body(history, "car body", quantity="acceleration")


@claim(
    "C25", "fig6", "a step hardly affects the comfort: very small oscillations of the damping-free wagon's body",
    "against what is uncomfortable; they are a fifth of what is just felt",
)  # fmt: skip
def comfort() -> Iterator[Measure]:
    """Measure the largest acceleration after the front bogie's first wheelset, and after both; the frequencies."""
    where = "section 4, Fig. 6"
    felt = Case("over what is just felt, 0.015 m/s² (ISO 2631-1)", own=False)
    for name, height in SIGNS.items():
        highest = float(np.abs(car_body(step(height, 1.2, under=BOGIE, **CHANGES[ZONES]))[1]).max())
        over = "largest acceleration over 0.315 m/s², which is not uncomfortable (ISO 2631-1)"
        yield said("very small", where, f"{over}, {name}", highest / COMFORTABLE, case=ZONES)
        yield said("very small", where, f"largest acceleration, {name}", highest / PERCEIVED, True, felt)
    pinned = ((2.65505e-3, 1.92878e-3), (2.79055e-3, 2.03127e-3))
    for (name, height), one, two in zip(SIGNS.items(), *pinned, strict=True):
        time, both = car_body(step(height, 1.2, FREE, BOGIE))
        soon = time < setting.MEETS + setting.LATER
        before, highest = float(np.abs(both[soon]).max()), float(np.abs(both).max())
        yield PINNED.relative(f"largest [m/s²], {name}, before the rear wheelset", before, one)
        yield PINNED.relative(f"largest [m/s²], {name}, within 1.2 s", highest, two)
    time, alone = car_body(step(HEIGHT, 5.0), 500.0)
    frequencies = np.arange(0.5, 12.0, 0.02)
    spectrum = np.array([setting.amplitude_at(time, alone, float(f)) for f in frequencies])
    for low, high, expected in ((4.0, 12.0, 7.46), (0.5, 4.0, 1.08)):
        inside = (frequencies > low) & (frequencies < high)
        main = float(frequencies[inside][spectrum[inside].argmax()])
        grid = "the step of the frequencies"
        yield PINNED.absolute(f"main frequency from {low:g} to {high:g} Hz [Hz]", main, expected, 0.021, grid)


@claim("C26", "fig6", "the original wagon's dampers make the jerk after a step higher")
def dampers_are_worse() -> Iterator[Measure]:
    """Measure the largest acceleration with dampers, over that without, and how long the jerk lasts."""
    pinned = ((3.36982e-3, 2.63967e-3), (0.06275, 0.06875))
    for (name, height), expected, late in zip(SIGNS.items(), *pinned, strict=True):
        for case in (ZONES, UNDAMPED):
            (time, damped), (_, free) = (
                car_body(step(height, setting.MEETS + setting.LATER, wagon, **CHANGES[case])) for wagon in (COACH, FREE)
            )
            highest = np.abs(damped).max()
            words = f"largest over that of the damping-free wagon, {name}"
            yield said("higher", "section 4, Fig. 6", words, float(highest / np.abs(free).max()), case=case)
        yield PINNED.relative(f"largest [m/s²], {name}", float(highest), expected)
        lasts = float(time[np.abs(damped) > 0.5 * highest].max()) - setting.MEETS
        words = f"falls below half of it for good after [s], {name}"
        yield PINNED.absolute(words, lasts, late, 5.1e-4, "the step of the samples")
