"""Claims on the whole coach (the paper, Figs 4 to 10); a number with b repeats a core model's claim on the coach."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper import coach_setting as setting
from wheeltapper.faces.paper import setting as core
from wheeltapper.faces.paper.claims import PINNED, Measure, analysis, claim, said
from wheeltapper.faces.paper.coach_setting import COACH, FREE, HEIGHT, STATIC, WAGONS, body, force, largest, step, times
from wheeltapper.faces.paper.corrugation import CHAOTIC, LINEAR, linear_motion
from wheeltapper.faces.paper.single import SLOWER, bounces

SIGNS = {"up": HEIGHT, "down": -HEIGHT}
BOGIE = ("wheelset 1", "wheelset 2")
UNAFFECTED = "section 4, Fig. 4: not affected"
CLOSE = "a difference of nearly equal numbers"
FITTED = "the slope of a line through logarithms of maxima"
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
    "with dampers; without, its force maxima keep their heights, but their phases drift",
)  # fmt: skip
def front_is_unaffected() -> Iterator[Measure]:
    """Measure the front wheelset's force when the rear one meets the step, less that when it does not."""
    end = 1.2
    for wagon in WAGONS.values():
        both, alone = (step(HEIGHT, end, wagon, under) for under in (BOGIE, BOGIE[:1]))
        at = times(0.0, end)
        off = np.max([np.abs(force(both.at(at), 1, s) - force(alone.at(at), 1, s)) for s in ("left", "right")], axis=0)
        change = float(off.max())
        if wagon is COACH:
            yield said("practically none", UNAFFECTED, "largest change of N/N0 by 1.2 s, original", change)
            yield PINNED.relative("largest change of N/N0 by 1.2 s, original", change, 0.0028232, 1e-2, CLOSE)
            continue
        soon = at < setting.MEETS + setting.LATER + 0.19
        at_first = float(off[soon].max())
        yield PINNED.relative("largest change of N/N0 in 0.19 s, damping-free", at_first, 0.060763, 1e-2, CLOSE)
        yield said("practically none", UNAFFECTED, "... by 1.2 s, damping-free", change, refutes=True)
        yield PINNED.relative("... by 1.2 s, damping-free", change, 0.143129, 1e-2, CLOSE)
        heights = (setting.wheel_peaks(record)[1] for record in (both, alone))
        same = float(np.abs(np.subtract(*heights)).max())
        yield said("practically none", UNAFFECTED, "largest change of its peaks/N0 by 1.2 s, damping-free", same)
        yield PINNED.relative("largest change of its peaks/N0 by 1.2 s, damping-free", same, 0.0048804, 1e-2, CLOSE)


@claim("C16", "fig4coach", "the wheelsets of a bogie are practically uncoupled")
def wheelsets_are_uncoupled() -> Iterator[Measure]:
    """Measure the rear wheelset's force while only the front one is excited."""
    for name, wagon in WAGONS.items():
        record = step(HEIGHT, setting.MEETS + setting.LATER, wagon)
        range_ = float(np.ptp(force(record.at(times(0.0, setting.MEETS + setting.LATER)), 2)))
        yield said(
            "practically none", "section 4, Fig. 4: practically uncoupled", f"range of the rear N/N0, {name}", range_
        )
        expected = {"damping-free": 0.0052857, "original": 0.0028415}[name]
        yield PINNED.relative(f"range of the rear N/N0, {name}", range_, expected, 1e-2, CLOSE)


def _after_the_edge(record: wt.Record, index: int) -> float:
    """Return the time of an event of the right front wheel, in ms after the edge."""
    return 1e3 * (float(setting.wheel_rows(record.events).time[index]) - setting.MEETS)


def _impact_frequency(record: wt.Record) -> float:
    return 1.0 / float(setting.wheel_rows(record.impacts).interval[1])


@claim("C17b", "fig4coach", "a step up makes vibro-impacts of about 200 Hz under the coach", SLOWER)
def step_up() -> Iterator[Measure]:
    """Measure the damping-free coach's response to a step up."""
    record = step(HEIGHT, 0.05)
    _, heights = setting.wheel_peaks(record)
    yield from bounces(_impact_frequency(record))
    yield PINNED.relative("first peak/N0", float(heights[0]), 2.19904)
    yield PINNED.relative("second peak/N0", float(heights[1]), 2.88744)
    yield PINNED.relative("loss after the edge [ms]", _after_the_edge(record, 0), 0.961472)
    yield PINNED.relative("impact after the edge [ms]", _after_the_edge(record, 1), 2.65871)
    yield PINNED.relative("frequency [Hz]", _impact_frequency(record), 162.896)


@claim("C18b", "fig4coach", "a step down makes vibro-impacts of about 200 Hz under the coach", SLOWER)
def step_down() -> Iterator[Measure]:
    """Measure the damping-free coach's response to a step down."""
    record = step(-HEIGHT, 0.05)
    yield from bounces(_impact_frequency(record))
    yield PINNED.relative("N_max/N0", largest(record), 2.64118)
    yield PINNED.relative("loss after the edge [ms]", _after_the_edge(record, 0), 6.54870)
    yield PINNED.relative("impact after the edge [ms]", _after_the_edge(record, 1), 7.55937)
    yield PINNED.relative("frequency [Hz]", _impact_frequency(record), 168.719)


@claim("C19b", "fig4coach", "an ideal jump of the rail gives the coach higher peaks, too")
def ideal_step() -> Iterator[Measure]:
    """Measure the limit of wheels of radius zero."""
    for (name, height), expected in zip(SIGNS.items(), (3.27756, 2.76086), strict=True):
        yield PINNED.relative(f"N_max/N0 {name}", largest(step(height, 0.05, ideal=True)), expected)


@claim("C20b", "fig4coach", "the sign of the step decides the coach's peak")
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
        ("damping-free", "up"): (0.0, 2.805), ("damping-free", "down"): (0.0, 3.279),
        ("original", "up"): (2.820, 5.577), ("original", "down"): (2.815, 6.183),
    }  # fmt: skip
    for name, wagon in WAGONS.items():
        for sign, height in SIGNS.items():
            both, right = (
                setting.decay_rate(step(height, 0.25, wagon, (under,)), 0.2)
                for under in ("wheelset 1", "wheelset 1 right")
            )
            case = f"{sign}, {name}"
            yield said("higher", "section 4: shorter", f"decay rate, one rail over both, {case}", right / both)
            on_both, on_one = pinned[name, sign]
            yield PINNED.absolute(f"decay rate, both rails [1/s], {case}", both, on_both, 0.02, FITTED)
            yield PINNED.absolute(f"decay rate, one rail [1/s], {case}", right, on_one, 0.02, FITTED)


# -- Figs 5 and 6: deck and car body ----------------------------------------------------------------------------------


@claim("C22b", "fig5coach", "the acceleration of a deck under one wheelset of the coach imitates its normal force")
def deck_imitates_force() -> Iterator[Measure]:
    """Measure correlation and slope of the deck's acceleration against the force's dynamic part."""
    record = setting.flat(0.2)
    history = record.history(50e3)
    dynamic = history.normal_force.sel(wheelset=1).sum("side").values - 2 * STATIC
    acceleration = history.deck_acceleration.values
    correlation = -float(np.corrcoef(dynamic, acceleration)[0, 1])
    yield said("linearly proportional", "section 4, Fig. 5", "correlation, acceleration downwards", correlation)
    yield PINNED.relative("slope times M", float(np.polyfit(dynamic, 15_000.0 * acceleration, 1)[0]), -1.000872)
    yield PINNED.relative("largest acceleration [m/s²]", float(np.abs(acceleration).max()), 16.6933)
    yield PINNED.relative("N_max/N0", largest(record), 3.36031)


def car_body(record: wt.Record, rate: float = 4e3) -> tuple[Any, Any]:
    """Return times and the vertical acceleration of the car body's centre of gravity, m/s²."""
    history = record.history(rate)
    return history.time.values, body(history, "car body", quantity="acceleration")


@claim("C25", "fig6", "a step hardly affects the comfort: small oscillations of the damping-free wagon's body")
def comfort() -> Iterator[Measure]:
    """Measure the largest acceleration after the front bogie's first wheelset, and after both; the frequencies."""
    pinned = ((2.65505e-3, 1.92878e-3), (2.79055e-3, 2.03127e-3))
    for (name, height), one, two in zip(SIGNS.items(), *pinned, strict=True):
        time, both = car_body(step(height, 1.2, FREE, BOGIE))
        soon = time < setting.MEETS + setting.LATER
        before, highest = float(np.abs(both[soon]).max()), float(np.abs(both).max())
        felt = f"largest over {PERCEIVED:g} m/s², which is just felt (ISO 2631-1), {name}"
        yield said("small", "section 4, Fig. 6: very small", felt, highest / PERCEIVED)
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
        (time, damped), (_, free) = (
            car_body(step(height, setting.MEETS + setting.LATER, wagon)) for wagon in (COACH, FREE)
        )
        highest = np.abs(damped).max()
        ratio = float(highest / np.abs(free).max())
        yield said("higher", "section 4, Fig. 6", f"largest over that of the damping-free wagon, {name}", ratio)
        yield PINNED.relative(f"largest [m/s²], {name}", float(highest), expected)
        lasts = float(time[np.abs(damped) > 0.5 * highest].max()) - setting.MEETS
        words = f"falls below half of it for good after [s], {name}"
        yield PINNED.absolute(words, lasts, late, 5.1e-4, "the step of the samples")


# -- Figs 7 to 10: corrugation ----------------------------------------------------------------------------------------


def _settled_fundamentals(
    speed: float, lasting: float, periods: int, vehicle: wt.Wagon = COACH
) -> tuple[complex, complex]:
    """Return the rear wheelset's settled motion, and its right wheel's force over N0, both over the path."""
    record, _ = setting.corrugation(speed, lasting, vehicle)
    frequency = speed / setting.WAVELENGTH
    at = record.end - np.arange(256 * periods, 0, -1) / (256 * frequency)
    history = record.at(at)
    path = core.harmonic(at, history.constraint.sel(wheelset=4, side="right").values, frequency)
    moved = body(history, "wheelset 4")
    return (
        core.harmonic(at, moved - moved.mean(), frequency) / path,
        core.harmonic(at, force(history, 4), frequency) / (path / setting.AMPLITUDE),
    )


@claim("C28b", "fig7coach", "2.25 m/s: the rear wheelset moves in phase with the irregularity, by the same amplitude")
def in_phase() -> Iterator[Measure]:
    """Measure the settled fundamental of motion and force, with the dampers of the coach."""
    motion, answer = _settled_fundamentals(2.25, 4.4, 50)
    yield said("almost identical", "section 5, Fig. 7", "z/a", abs(motion))
    yield LINEAR.relative("z/a", abs(motion), linear_motion(2.25 / setting.WAVELENGTH))
    phase = float(np.angle(motion, deg=True))
    yield said("in phase", "section 5, Fig. 7", "phase of z [°]", phase)
    yield PINNED.absolute("phase of z [°]", phase, -0.0785, 1e-3, CLOSE)
    yield said("very small", "section 5: small", "force amplitude/N0", abs(answer))
    yield PINNED.relative("force amplitude/N0", abs(answer), 0.0590332)
    phase = float(np.angle(answer, deg=True))
    yield said("in antiphase", "section 5, Fig. 7", "phase of N [°]", phase)
    yield PINNED.relative("phase of N [°]", phase, 178.718)


@claim("C29b", "fig7coach", "9 m/s: the normal force on the rear wheelset is several times the static one")
def several_times_static() -> Iterator[Measure]:
    """Measure the largest force within 10 periods."""
    pinned = {"damping-free": {-1.0: 4.34888, 1.0: 5.15439}, "original": {-1.0: 4.31772, 1.0: 4.41954}}
    for name, wagon in WAGONS.items():
        for sign in (-1.0, 1.0):
            record, _ = setting.corrugation(9.0, 10 * setting.WAVELENGTH / 9.0, wagon, sign * setting.AMPLITUDE)
            case = f"{'+' if sign > 0 else '−'}a, {name}"
            found = largest(record, 4)
            yield said("several times", "section 5, Fig. 7", f"N_max/N0 in 10 periods, {case}", found)
            yield PINNED.relative(f"N_max/N0 in 10 periods, {case}", found, pinned[name][sign])


@claim(
    "C33b",
    "fig7coach",
    "36 m/s: the rear wheelset moves little and in antiphase, the force is high and nearly falls to zero",
)
def antiphase() -> Iterator[Measure]:
    """Measure the fundamental of motion and force, and the force's extremes."""
    motion, answer = _settled_fundamentals(36.0, 0.2, 70)
    phase = abs(float(np.angle(motion, deg=True)))
    yield said("very small", "section 5: significantly less", "z/a at 720 Hz", abs(motion))
    yield PINNED.relative("z/a at 720 Hz", abs(motion), 0.0635115)
    yield said("in antiphase", "section 5: presses the peaks", "phase [°]", phase)
    yield PINNED.relative("phase [°]", phase, 179.873)
    yield PINNED.relative("force amplitude/N0", abs(answer), 0.919174)
    pinned = {"damping-free": (2.34159, 0.04827), "original": (2.34058, 0.05376)}
    for name, wagon in WAGONS.items():
        record, _ = setting.corrugation(36.0, 0.2, wagon)
        highest, lowest = largest(record, 4), float(force(record.history(2e5), 4).min())
        yield said("much higher", "section 5, Fig. 7", f"N_max/N0, {name}", highest)
        yield said("very small", "section 5: low or zero", f"N_min/N0, {name}", lowest)
        yield PINNED.relative(f"N_max/N0, {name}", highest, pinned[name][0])
        yield PINNED.absolute(f"N_min/N0, {name}", lowest, pinned[name][1], 3e-4, "read from samples of 5 µs")


@claim("C36", "fig8", "18 m/s: the rear wheelset hardly moves before it meets the irregularity itself")
def pre_excitation() -> Iterator[Measure]:
    """Measure its largest motion before its start, over that in the equally long time after it."""
    pinned = {"damping-free": 0.406, "original": 0.0547}
    for name, wagon in WAGONS.items():
        record, own = setting.both_of_the_rear_bogie(18.0, wagon)
        at = times(0.0, record.end)
        moved = body(record.at(at), "wheelset 4")
        moved = np.abs(moved - moved[0])
        before, after = moved[at < own].max(), moved[at >= own].max()
        yield said(
            "practically none", "section 5, Fig. 8", f"before its own start, over after it, {name}", before / after
        )
        yield PINNED.relative(f"before its own start [µm], {name}", 1e6 * float(before), pinned[name], 0.1, CHAOTIC)


@claim(
    "C36b", "fig8", "18 m/s: the front wheelset slightly excites the bogie frame",
    "with dampers; without, the front wheelset bounces by millimetres, and the frame swings further than the rear one",
)  # fmt: skip
def excitation_of_the_frame() -> Iterator[Measure]:
    """Measure the front wheelset before the rear one's start, and the frame above the rear one before and after it."""
    pinned = {"damping-free": (2326.0, 316.0, 1447.0), "original": (153.4, 9.20, 100.0)}
    wide = {"damping-free": (0.1, 0.1, 0.1), "original": (0.1, 0.1, 0.4)}  # 81 to 129 at speeds that differ by 1e-13
    for name, wagon in WAGONS.items():
        record, own = setting.both_of_the_rear_bogie(18.0, wagon)
        at = times(0.0, record.end)
        before = at < own
        front, _, frame, rear = (np.abs(one) for one in setting.rear_bogie(record.at(at)).values())
        bounces, swings, later = front[before].max(), frame[before].max(), frame[~before].max()
        for words, value, expected, share in zip(
            ("front wheelset, before", "frame above the rear wheelset, before", "frame above the rear wheelset, after"),
            (bounces, swings, later), pinned[name], wide[name], strict=True,
        ):  # fmt: skip
            yield PINNED.relative(
                f"{words} the rear one's start [µm], {name}", 1e6 * float(value), expected, share, CHAOTIC
            )
        slightly = "section 5, Fig. 8: slightly excites"
        yield said("small", slightly, f"frame over front wheelset, before, {name}", float(swings / bounces))
        ratio = float(later / rear[~before].max())
        yield said("lower", slightly, f"frame over rear wheelset, after, {name}", ratio, refutes=wagon is FREE)


ONE_SIDED: dict[str, dict[str, Any]] = {
    "damping-free": {}, "original": {"vehicle": COACH}, "no creep": {"creep": None},
}  # fmt: skip
"""The changes that each run of Figs 9 and 10 makes to the setting."""


def right_rail(lasting: float = 0.12, **changes: Any) -> tuple[wt.Record, float]:
    """Simulate corrugation under the rear wheelset's right wheel at 36 m/s, rising first; return its start, too."""
    return setting.corrugation(36.0, lasting, amplitude=setting.AMPLITUDE, where="wheelset 4 right", **changes)


@claim(
    "C37", "fig9", "corrugation on the right rail: its frequency is in the right force only; the left one's is lower"
)
def right_force_and_left() -> Iterator[Measure]:
    """Measure ranges over 0.12 s and amplitudes at 720 Hz."""
    pinned = {
        "damping-free": (0.0773700, 2.22563, 0.828405, 1.19297, 0.913466, 0.00802246),
        "no creep": (0.0623075, 2.30371, 0.770304, 1.24673, 0.911982, 0.00828745),
    }
    for name, (*ends, first, second) in pinned.items():
        record, start = right_rail(**ONE_SIDED[name])
        at = times(start, record.end)
        history = record.at(at)
        right, left = (force(history, 4, side) for side in ("right", "left"))
        for words, value, expected in zip(
            ("least right", "largest right", "least left", "largest left"),
            (right.min(), right.max(), left.min(), left.max()),
            ends,
            strict=True,
        ):
            yield PINNED.relative(f"{words} N/N0, {name}", float(value), expected)
        at_right, at_left = (setting.amplitude_at(at, one, 720.0) for one in (right, left))
        yield PINNED.relative(f"right amplitude at 720 Hz/N0, {name}", at_right, first)
        yield PINNED.relative(f"left amplitude at 720 Hz/N0, {name}", at_left, second)
        yield said(
            "practically none", "section 5, Fig. 9", f"left amplitude at 720 Hz over right, {name}", at_left / at_right
        )
        ratio = float(np.ptp(left) / np.ptp(right))
        yield said(
            "lower", "section 5, Fig. 9: smaller", f"range of the left force over the right one's, {name}", ratio
        )


@claim("C38", "fig10", "corrugation on the right rail: friction damps roll, and the wheels' centres soon move in phase")
def centres_in_phase() -> Iterator[Measure]:
    """Measure the correlation of the two centres' motions in three windows after the start."""
    pinned = {
        "damping-free": (0.30675, 0.83747, 0.92940), "original": (0.31116, 0.82844, 0.89752),
        "no creep": (-0.05931, -0.03501, 0.00581),
    }  # fmt: skip
    for name, expected in pinned.items():
        record, start = right_rail(**ONE_SIDED[name])
        found = []
        for begin, end in ((0.0, 0.02), (0.02, 0.06), (0.06, 0.12)):
            both = setting.wheel_centre_heights(record.at(times(start + begin, min(start + end, record.end))))
            found.append(float(np.corrcoef(both["left"], both["right"])[0, 1]))
        for window, value, wanted in zip(("0 to 20", "20 to 60", "60 to 120"), found, expected, strict=True):
            yield PINNED.absolute(f"correlation, {window} ms, {name}", value, wanted, 1e-3)
        words = "not in phase" if name == "no creep" else "move in phase"
        yield said(words, "section 5, Fig. 10: damped by friction", f"correlation, 60 to 120 ms, {name}", found[2])


@claim(
    "C39", "fig10", "corrugation on the right rail: both centres move very little against the irregularity's 50 µm",
    "at its frequency; a free vibration of a fifth of that is added",
)  # fmt: skip
def centres_move_little() -> Iterator[Measure]:
    """Measure amplitudes at 720 Hz, and ranges from 5 ms after the start on."""
    pinned = {
        "damping-free": ((2.76360, 21.6370), (0.420240, 20.2101)),
        "no creep": ((2.74136, 31.9632), (0.437158, 26.5233)),
    }
    for name, expected in pinned.items():
        record, start = right_rail(**ONE_SIDED[name])
        at = times(start + 0.005, record.end)
        both = setting.wheel_centre_heights(record.at(at))
        for side, (first, whole), words in zip(
            ("right", "left"), expected, ("very small", "practically none"), strict=True
        ):
            amplitude, range_ = setting.amplitude_at(at, both[side], 720.0), float(np.ptp(both[side]))
            over = f"{side}, over the irregularity's, {name}"
            yield said(words, "section 5, Fig. 10", f"amplitude at 720 Hz, {over}", amplitude / setting.AMPLITUDE)
            half = 0.5 * range_ / setting.AMPLITUDE
            yield said("very small", "section 5, Fig. 10", f"half the range, {over}", half, refutes=True)
            yield PINNED.relative(f"{side} at 720 Hz [µm], {name}", 1e6 * amplitude, first)
            yield PINNED.relative(f"{side}, peak to peak [µm], {name}", 1e6 * range_, whole)
