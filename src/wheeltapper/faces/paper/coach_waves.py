"""Claims on the coach over corrugation (the paper, Figs 7 to 10); b repeats a core model's claim."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper import coach_setting as setting
from wheeltapper.faces.paper import setting as core
from wheeltapper.faces.paper.chaos import (
    HIGH,
    RATE,
    RUNS,
    WAVES,
    Run,
    count_forces,
    count_heights,
    count_leaving,
    drawn_runs,
)
from wheeltapper.faces.paper.claims import PINNED, Case, Measure, claim, said
from wheeltapper.faces.paper.coach_setting import (
    AMPLITUDE,
    CHANGES,
    FREE,
    ORIGINAL,
    UNDAMPED,
    WAVELENGTH,
    ZONES,
    body,
    force,
    largest,
    times,
)
from wheeltapper.faces.paper.corrugation import HARMONIC, LINEAR, OVERLAYS, linear_motion, off_overlay, residue

# -- Fig. 7: both rails -----------------------------------------------------------------------------------------------

SETTLED = 60
"""Waves after which the paper's transients have decayed at 2.25 m/s; the paper says: after some time."""


def last_waves(record: wt.Record, speed: float, last: int = 1, samples: int = 512) -> Any:
    """Return the history over the last whole waves of a record."""
    frequency = speed / WAVELENGTH
    return record.at(record.end - np.arange(samples * last, 0, -1) / (samples * frequency))


@claim(
    "C28b", "fig7coach",
    "2.25 m/s: once transients have decayed the rear wheelset overlays the irregularity, and the force is small, "
    "harmonic and in antiphase",
    "where something damps the contact's vibration, which else goes on for ever; with the original wagon's dampers it "
    "takes a third longer",
)  # fmt: skip
def in_phase() -> Iterator[Measure]:
    """Measure motion and force over the wave after 60 waves."""
    frequency = 2.25 / WAVELENGTH
    for case, changes in CHANGES.items():
        record, _ = setting.corrugation(2.25, SETTLED * WAVELENGTH / 2.25, **changes)
        history = last_waves(record, 2.25)
        at, normal, moved = history.time.values, force(history, 4), body(history, "wheelset 4")
        path = history.constraint.sel(wheelset=4, side="right").values
        wave, motion, answer = (core.harmonic(at, one - one.mean(), frequency) for one in (path, moved, normal))
        figure, goes_on = "section 5, Fig. 7", case is not ZONES
        yield said("almost identical", figure, "z/a", abs(motion / wave), case=case)
        yield said("in phase", figure, "phase of z [°]", float(np.angle(motion / wave, deg=True)), case=case)
        away = off_overlay(moved, path)
        yield said("overlays", OVERLAYS, "z away from the irregularity, over a", away, case is UNDAMPED, case)
        yield said("very small", "section 5: small", "force amplitude/N0", abs(answer), case=case)
        phase = abs(float(np.angle(answer / wave, deg=True)))
        yield said("in antiphase", figure, "phase of N [°]", phase, case=case)
        left = residue(at, normal, frequency)
        yield said("very small", HARMONIC, "N beside its harmonic, over that", left, goes_on, case)
    record, _ = setting.corrugation(2.25, 4.4, **CHANGES[ORIGINAL])
    history = last_waves(record, 2.25, 50, 256)
    at, moved = history.time.values, body(history, "wheelset 4")
    path = core.harmonic(at, history.constraint.sel(wheelset=4, side="right").values, frequency)
    motion, answer = (
        core.harmonic(at, moved - moved.mean(), frequency) / path,
        core.harmonic(at, force(history, 4), frequency),
    )
    settled = "over the last 50 of 198 waves, original wagon"
    yield LINEAR.relative(f"z/a, {settled}", abs(motion), linear_motion(frequency))
    phase = float(np.angle(motion, deg=True))
    yield PINNED.absolute(f"phase of z [°], {settled}", phase, -0.0785, 1e-3, "a difference of nearly equal numbers")
    answer *= AMPLITUDE / path
    yield PINNED.relative(f"force amplitude/N0, {settled}", abs(answer), 0.0590332)
    yield PINNED.relative(f"phase of N [°], {settled}", float(np.angle(answer, deg=True)), 178.718)


@cache
def runs_at_resonance(case: Case, seed: int = 0) -> list[Run]:
    """Return what the rear wheelset does in ten runs near the resonance."""

    def run(speed: float, amplitude: float) -> Run:
        wave = WAVELENGTH / speed
        record, start = setting.corrugation(speed, WAVES * wave, amplitude=amplitude, **CHANGES[case])
        events = setting.wheel_rows(record.events, 4)
        height = body(record.history(RATE), "wheelset 4")
        leaves, is_high = (float(events.time[0]) - start) / wave, bool(np.max(height) - height[0] > HIGH)
        return Run(leaves, largest(record, 4), is_high, amplitude > 0.0)

    return drawn_runs(run, seed)


@claim("C29b", "fig7coach", "9 m/s: the normal force on the rear wheelset is several times the static one")
def several_times_static() -> Iterator[Measure]:
    """Measure the largest force within 10 periods, and count runs."""
    pinned = {UNDAMPED: {-1.0: 4.34888, 1.0: 5.15439}, ORIGINAL: {-1.0: 4.31772, 1.0: 4.41954}}
    for case, changes in CHANGES.items():
        for sign in (-1.0, 1.0):
            record, _ = setting.corrugation(9.0, 10 * WAVELENGTH / 9.0, amplitude=sign * AMPLITUDE, **changes)
            found, words = largest(record, 4), f"N_max/N0 in 10 periods, {'+' if sign > 0 else '−'}a"
            yield said("several times", "section 5, Fig. 7", words, found, case=case)
            if case in pinned:
                yield PINNED.relative(f"{words}, {case.name}", found, pinned[case][sign])
        yield count_forces(runs_at_resonance(case), case)


@claim(
    "C30b", "fig7coach", "9 m/s: the rear wheelset bounces off the rails within half a period",
    "if the rail rises first; printed is −a·sin, which falls first",
)  # fmt: skip
def lifts_off() -> Iterator[Measure]:
    """Count the runs that leave the rails within half a period."""
    yield from count_leaving(runs_at_resonance(ZONES))


@claim(
    "C31b", "fig7coach", "9 m/s: the rear wheelset rises within 0.6 s by as much as 1 mm and even more",
    "without the original wagon's dampers",
)  # fmt: skip
def rises() -> Iterator[Measure]:
    """Count the runs that rise by 1 mm."""
    for case in CHANGES:
        yield count_heights(runs_at_resonance(case), case, refutes=case is ORIGINAL)


@claim(
    "C33b", "fig7coach",
    "36 m/s: the rear wheelset moves significantly less than the irregularity, and the force is high and near zero",
)  # fmt: skip
def moves_less() -> Iterator[Measure]:
    """Measure the range of the motion, and the force's extremes; the settled fundamentals."""
    pinned = {UNDAMPED: (2.34159, 0.04827), ORIGINAL: (2.34058, 0.05376)}
    for case, changes in CHANGES.items():
        record, _ = setting.corrugation(36.0, 0.2, **changes)
        history = record.history(2e5)
        half = 0.5 * float(np.ptp(body(history, "wheelset 4"))) / AMPLITUDE
        yield said("significantly less", "section 5", "half the range of z/a in 0.2 s", half, case=case)
        highest, lowest = largest(record, 4), float(force(history, 4).min())
        yield said("much higher", "section 5, Fig. 7", "N_max/N0", highest, case=case)
        yield said("very small", "section 5: low or zero", "N_min/N0", lowest, case=case)
        if case in pinned:
            yield PINNED.relative(f"N_max/N0, {case.name}", highest, pinned[case][0])
            samples = "read from samples of 5 µs"
            yield PINNED.absolute(f"N_min/N0, {case.name}", lowest, pinned[case][1], 3e-4, samples)
    record, _ = setting.corrugation(36.0, 0.2, **CHANGES[ORIGINAL])
    history = last_waves(record, 36.0, 70, 256)
    at, moved = history.time.values, body(history, "wheelset 4")
    path, motion, answer = (
        core.harmonic(at, one - one.mean(), 36.0 / WAVELENGTH)
        for one in (history.constraint.sel(wheelset=4, side="right").values, moved, force(history, 4))
    )
    yield PINNED.relative("z/a at 720 Hz, original wagon", abs(motion / path), 0.0635115)
    yield PINNED.relative("its phase [°]", abs(float(np.angle(motion / path, deg=True))), 179.873)
    yield PINNED.relative("force amplitude/N0, original wagon", abs(answer / path) * AMPLITUDE, 0.919174)


@claim(
    "C50", "fig7coach", "36 m/s: the rear wheelset's amplitude decreases in time",
    "where something damps it; without any damping but friction it stays",
)  # fmt: skip
def decreases_in_time() -> Iterator[Measure]:
    """Measure the range of the motion in a late tenth of a second, over that in the first one."""
    for case, changes in CHANGES.items():
        record, start = setting.corrugation(36.0, 0.6, **changes)
        first, late = (
            np.ptp(body(record.at(times(start + begin, start + begin + 0.1, 2e4)), "wheelset 4"))
            for begin in (0.0, 0.5)
        )
        words = "range of z from 0.5 to 0.6 s, over that to 0.1 s"
        yield said("decreases", "section 5: decreases in time", words, float(late / first), case is UNDAMPED, case)


@claim("C51", "fig7coach", "36 m/s: high forces are at the irregularity's peaks, low or zero ones at its valleys")
def on_crests() -> Iterator[Measure]:
    """Measure the irregularity's height where the force is highest and lowest, over its amplitude."""
    for case, changes in CHANGES.items():
        record, start = setting.corrugation(36.0, 0.25, **changes)
        history = record.at(times(start + 0.05, start + 0.25))
        height, normal = history.constraint.sel(wheelset=4, side="right").values / AMPLITUDE, force(history, 4)
        inner, falls, rises_ = normal[1:-1], normal[1:-1] >= normal[2:], normal[1:-1] > normal[:-2]
        peaks, valleys = height[1:-1][falls & rises_], height[1:-1][~falls & ~rises_ & (inner < 0.5)]
        where = "section 5: high at peaks and low or zero at valleys"
        yield said("almost identical", where, "height at force maxima over a, the least", float(peaks.min()), case=case)
        low = -float(valleys.max())
        yield said("almost identical", where, "depth at force minima over a, the least", low, case=case)


@claim(
    "C57", "fig7coach", "losses of contact are very likely on corrugation at high speed",
    "with the exact constant of the contact, or from 60 µm on",
)  # fmt: skip
def losses_are_likely() -> Iterator[Measure]:
    """Count losses in 0.2 s at 36 m/s, by constant and amplitude."""
    softer = Case("constant of 180 Hz", own=False)
    for case, changes in ((ZONES, CHANGES[ZONES]), (softer, {})):
        for amplitude in (AMPLITUDE, 70e-6):
            record, _ = setting.corrugation(36.0, 0.2, amplitude=-amplitude, **changes)
            lost = int((setting.wheel_rows(record.events, 4).kind.values == "loss").sum())
            words, refutes = f"losses of the right wheel in 0.2 s, {1e6 * amplitude:g} µm", False
            if case is softer:
                refutes = amplitude == AMPLITUDE
            yield said("several times", "section 4: very likely", words, lost, refutes, case)


# -- Fig. 8: both wheelsets of a bogie --------------------------------------------------------------------------------

DEACTIVATED = UNDAMPED._replace(own=True)
"""The paper's own condition of Fig. 8."""
ELSE_DAMPED = ZONES._replace(own=False)
BOGIE_SPEEDS = (17.8, 18.2)
BOGIE_SPREAD = f"of {RUNS} runs at {BOGIE_SPEEDS[0]:g} to {BOGIE_SPEEDS[1]:g} m/s"


@cache
def runs_of_the_bogie(case: Case) -> list[tuple[float, float]]:
    """Return of each run the rear wheelset's motion before its start over that after; the frame's over the front's."""

    def run(speed: float, amplitude: float) -> tuple[float, float]:
        record, own = setting.both_of_the_rear_bogie(speed, amplitude, **CHANGES[case])
        at = times(0.0, record.end, 2e4)
        front, _, frame, rear = (np.abs(one) for one in setting.rear_bogie(record.at(at)).values())
        before = at < own
        return float(rear[before].max() / rear[~before].max()), float(frame[before].max() / front[before].max())

    return drawn_runs(run, spread=BOGIE_SPEEDS)


@claim("C36", "fig8", "18 m/s: the rear wheelset hardly moves before it meets the irregularity itself")
def pre_excitation() -> Iterator[Measure]:
    """Count the runs in which it moves less than a hundredth of what it moves in the equally long time after."""
    for case, changes in ((DEACTIVATED, UNDAMPED), (ELSE_DAMPED, ZONES)):
        share = float(np.mean([ratio < 0.01 for ratio, _ in runs_of_the_bogie(changes)]))
        words = f"share in which it moves less than a hundredth {BOGIE_SPREAD}"
        yield said("in most cases", "section 5, Fig. 8: almost unnoticeable", words, share, case=case)


@claim(
    "C36b", "fig8", "18 m/s: the front wheelset slightly excites the bogie frame",
    "in most runs without any damping; with damped contact zones the frame moves more than that in most",
)  # fmt: skip
def excitation_of_the_frame() -> Iterator[Measure]:
    """Count the runs in which the frame above the rear wheelset moves by less than a quarter of the front wheelset."""
    for case, changes in ((DEACTIVATED, UNDAMPED), (ELSE_DAMPED, ZONES)):
        share = float(np.mean([ratio < 0.25 for _, ratio in runs_of_the_bogie(changes)]))
        words = f"share in which the frame moves less than a quarter of the front wheelset {BOGIE_SPREAD}"
        yield said("in most cases", "section 5, Fig. 8: slightly excites", words, share, case is ELSE_DAMPED, case)


# -- Figs 9 and 10: the right rail only -------------------------------------------------------------------------------

WINDOWS = ((0.0, 0.02), (0.02, 0.06), (0.06, 0.12))
"""Times after the start of the corrugation, s, in which motions and forces are compared."""
NO_CREEP = Case("no friction", own=False)
ONE_SIDED = CHANGES | {NO_CREEP: {"creep": None}}
"""The changes that each run of Figs 9 and 10 makes to the setting."""


def right_rail(lasting: float = 0.12, **changes: Any) -> tuple[wt.Record, float]:
    """Simulate corrugation under the rear wheelset's right wheel at 36 m/s, rising first; return its start, too."""
    return setting.corrugation(36.0, lasting, amplitude=AMPLITUDE, where="wheelset 4 right", **changes)


@claim(
    "C37", "fig9", "corrugation on the right rail: its frequency is in the right force only; the left one's is lower"
)
def right_force_and_left() -> Iterator[Measure]:
    """Measure ranges over 0.12 s and amplitudes at 720 Hz."""
    pinned = {
        UNDAMPED: (0.0773700, 2.22563, 0.828405, 1.19297, 0.913466, 0.00802246),
        NO_CREEP: (0.0623075, 2.30371, 0.770304, 1.24673, 0.911982, 0.00828745),
    }
    for case in (ZONES, UNDAMPED, NO_CREEP):
        record, start = right_rail(**ONE_SIDED[case])
        at = times(start, record.end)
        history = record.at(at)
        right, left = (force(history, 4, side) for side in ("right", "left"))
        at_right, at_left = (setting.amplitude_at(at, one, 720.0) for one in (right, left))
        share, words = 2.0 * at_left / float(np.ptp(left)), "left amplitude at 720 Hz over half the left range"
        yield said("very small", "section 5, Fig. 9: only a lower component", words, share, case=case)
        ratio, words = float(np.ptp(left) / np.ptp(right)), "range of the left force over the right one's"
        yield said("lower", "section 5, Fig. 9: smaller", words, ratio, case=case)
        named = {
            "least right N/N0": right.min(), "largest right N/N0": right.max(), "least left N/N0": left.min(),
            "largest left N/N0": left.max(), "right amplitude at 720 Hz/N0": at_right,
            "left amplitude at 720 Hz/N0": at_left,
        }  # fmt: skip
        for (words, value), expected in zip(named.items(), pinned.get(case, ()), strict=False):
            yield PINNED.relative(f"{words}, {case.name}", float(value), expected)


@claim("C52", "fig9", "the right force is very similar to that over corrugation on both rails")
def like_both_rails() -> Iterator[Measure]:
    """Measure the correlation of the two forces in three windows after the start."""
    for case in (ZONES, UNDAMPED):
        one, start = right_rail(**CHANGES[case])
        both, _ = setting.corrugation(36.0, 0.12, amplitude=AMPLITUDE, **CHANGES[case])
        for begin, end in WINDOWS:
            at = times(start + begin, min(start + end, one.end, both.end))
            alike = float(np.corrcoef(force(one.at(at), 4), force(both.at(at), 4))[0, 1])
            words = f"correlation, {1e3 * begin:g} to {1e3 * end:g} ms"
            yield said("very similar", "section 5, Fig. 9", words, alike, case=case)


LINKED = Case("rigid trailing links", own=False)


def _phase(record: wt.Record, start: float, begin: float, end: float) -> float:
    """Return the correlation of both wheel centres' motions in a window after the start."""
    both = setting.wheel_centre_heights(record.at(times(start + begin, min(start + end, record.end))))
    return float(np.corrcoef(both["left"], both["right"])[0, 1])


@claim(
    "C38", "fig10", "corrugation on the right rail: friction damps roll, and the wheels' centres soon move in phase",
    "until the motion that they share has decayed, too, and the right wheel's waves are left",
)  # fmt: skip
def centres_in_phase() -> Iterator[Measure]:
    """Measure the correlation of the two centres' motions in windows after the start."""
    pinned = {
        UNDAMPED: (0.30675, 0.83747, 0.92940), ORIGINAL: (0.31116, 0.82844, 0.89752),
        NO_CREEP: (-0.05931, -0.03501, 0.00581),
    }  # fmt: skip
    where, words = "section 5, Fig. 10: damped by friction", "correlation, 60 to 120 ms"
    for case, changes in ONE_SIDED.items():
        record, start = right_rail(**changes)
        found = [_phase(record, start, *window) for window in WINDOWS]
        for (begin, end), value, wanted in zip(WINDOWS, found, pinned.get(case, ()), strict=False):
            window = f"{1e3 * begin:g} to {1e3 * end:g} ms"
            yield PINNED.absolute(f"correlation, {window}, {case.name}", value, wanted, 1e-3)
        phrase = "not in phase" if case is NO_CREEP else "move in phase"
        yield said(phrase, where, words, found[2], case=case)
    late = Case("contact zones damped, from 0.4 s on", own=False)
    record, start = right_rail(0.6, **CHANGES[ZONES])
    yield said("move in phase", where, "correlation, 400 to 600 ms", _phase(record, start, 0.4, 0.6), True, late)
    links = setting.with_trailing_links(FREE, 1e9)
    record, start = right_rail(**CHANGES[ZONES] | {"vehicle": links})
    yield said("move in phase", where, words, _phase(record, start, *WINDOWS[2]), case=LINKED)


@claim(
    "C39", "fig10", "corrugation on the right rail: both centres move very little against the irregularity's 50 µm",
    "at its frequency, and as a whole once a free vibration of up to a third of that has decayed, after 0.4 s",
)  # fmt: skip
def centres_move_little() -> Iterator[Measure]:
    """Measure amplitudes at 720 Hz, and ranges from 5 ms after the start on, and from 0.4 s on."""
    pinned = {
        UNDAMPED: ((2.76360, 21.6370), (0.420240, 20.2101)), NO_CREEP: ((2.74136, 31.9632), (0.437158, 26.5233)),
    }  # fmt: skip
    where = "section 5, Fig. 10"
    for case in (ZONES, UNDAMPED, NO_CREEP):
        record, start = right_rail(**ONE_SIDED[case])
        at = times(start + 0.005, record.end)
        both = setting.wheel_centre_heights(record.at(at))
        for number, side in enumerate(("right", "left")):
            amplitude, range_ = setting.amplitude_at(at, both[side], 720.0), float(np.ptp(both[side]))
            yield said("very small", where, f"amplitude at 720 Hz, {side}, over a", amplitude / AMPLITUDE, case=case)
            if side == "left":
                filtered = f"{where}: filtered out on the left"
                share = 2.0 * amplitude / range_
                yield said("very small", filtered, "left amplitude at 720 Hz over half the range", share, case=case)
            half = 0.5 * range_ / AMPLITUDE
            soon = case._replace(name=f"{case.name}, 5 to 120 ms")
            yield said("very small", where, f"half the range, {side}, over a", half, True, soon)
            if case in pinned:
                first, whole = pinned[case][number]
                yield PINNED.relative(f"{side} at 720 Hz [µm], {case.name}", 1e6 * amplitude, first)
                yield PINNED.relative(f"{side}, peak to peak [µm], {case.name}", 1e6 * range_, whole)
    record, start = right_rail(0.6, **CHANGES[ZONES])
    both = setting.wheel_centre_heights(record.at(times(start + 0.4, start + 0.6)))
    for side, heights in both.items():
        half = 0.5 * float(np.ptp(heights)) / AMPLITUDE
        yield said("very small", where, f"half the range, {side}, over a", half, case=ZONES)
