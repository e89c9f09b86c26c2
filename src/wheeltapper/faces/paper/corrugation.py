"""Claims on the corrugation of Fig. 7: 50 µm, 5 cm, at 2.25, 9 and 36 m/s. T is the time of one wavelength."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

import wheeltapper as wt
from wheeltapper.faces.paper.chaos import (
    FALLS,
    HIGH,
    RATE,
    RISES,
    WAVES,
    Run,
    count_forces,
    count_heights,
    drawn_runs,
)
from wheeltapper.faces.paper.claims import PINNED, STATED, Case, Measure, analysis, claim, said
from wheeltapper.faces.paper.setting import (
    CONSTANT,
    HERTZ,
    STATIC,
    STATIC_INDENTATION,
    harmonic,
    largest,
    losses,
    scene,
    sine,
)

AMPLITUDE, WAVELENGTH = 50e-6, 0.05
SIGNS = {"+": AMPLITUDE, "−": -AMPLITUDE}


def wavelength_time(speed: float) -> float:
    """Return the time of one wavelength, s."""
    return WAVELENGTH / speed


def settled_times(record: wt.Record, periods: int, of: float, samples: int = 64) -> NDArray[np.float64]:
    """Return times over the last whole periods of a record, evenly spread."""
    return np.asarray(record.end - of * np.arange(periods * samples, 0, -1) / samples)


def linear_motion(frequency: float) -> float:
    """Return the undamped wheel's motion over the irregularity's, signed, on a linear contact, at a frequency in Hz."""
    contact, spring = 1.5 * CONSTANT * np.sqrt(STATIC_INDENTATION), 2.44e6
    return float(contact / (contact + spring - 1500.0 * (2 * np.pi * frequency) ** 2))


LINEAR = analysis("k_H/(k_H + k − m·ω²) of the linear contact k_H")


def _late_response(record: wt.Record, after: float) -> float:
    peaks = record.peaks
    return float(peaks.normal_force.values[peaks.time.values > after].max()) / STATIC


@claim(
    "C27", "fig7", "the wheel's path is almost the irregularity itself",
    "but for its second harmonic, and its fourth one that meets the contact resonance at 2.25 m/s",
)  # fmt: skip
def path_is_nearly_the_irregularity() -> Iterator[Measure]:
    """Measure the harmonics of the rolled path, and the late response where the fourth one meets the resonance."""
    second = {}
    for amplitude in (AMPLITUDE, AMPLITUDE / 2):
        shape = wt.Corrugation(amplitude=amplitude, wavelength=WAVELENGTH, start=0.0)
        record = wt.simulate(scene(shape, 2e4, 9.0, 4 * wavelength_time(9.0)))
        times = settled_times(record, 1, wavelength_time(9.0), 4096)
        path = record.at(times).constraint.values
        first, second[amplitude] = (abs(harmonic(times, path, n / wavelength_time(9.0))) / amplitude for n in (1, 2))
        if amplitude == AMPLITUDE:
            yield said("almost identical", "section 5", "fundamental over amplitude", first)
            yield PINNED.relative("fundamental over amplitude", first, 0.983601)
            yield PINNED.relative("mean of the path [µm]", 1e6 * float(path.mean()), 4.53998)
    yield said("very small", "section 5: almost identical", "second harmonic over amplitude", second[AMPLITUDE])
    yield PINNED.relative("second harmonic over amplitude", second[AMPLITUDE], 0.0868722)
    doubled = second[AMPLITUDE] / second[AMPLITUDE / 2]
    small = "the leading order in the amplitude; 50 µm is not small"
    yield analysis("∝ a²").relative(
        "second harmonic over amplitude, over that of half the amplitude", doubled, 2.0, 5e-2, small
    )
    shape = wt.Corrugation(amplitude=-AMPLITUDE, wavelength=WAVELENGTH, start=0.0)
    record = wt.simulate(scene(shape, 2e4, 2.25, 60 * wavelength_time(2.25)))
    circle = _late_response(record, 40 * wavelength_time(2.25))
    yield PINNED.relative("late N_max/N0 at 2.25 m/s, on the path", circle, 1.34663)
    record = sine(-AMPLITUDE, 2e4, 2.25, 60 * wavelength_time(2.25))
    point = _late_response(record, 40 * wavelength_time(2.25))
    yield PINNED.relative("late N_max/N0 at 2.25 m/s, on the irregularity itself", point, 1.05909)
    late = Case("late force at 2.25 m/s", own=False)
    yield said("almost identical", "section 5", "late N_max on the path, over that", circle / point, True, late)


def residue(times: NDArray[np.float64], values: NDArray[np.float64], frequency: float) -> float:
    """Return what is left beside a harmonic at most, over the amplitude of the harmonic; over whole periods."""
    off, part = values - values.mean(), harmonic(times, values, frequency)
    return float(np.abs(off - np.real(part * np.exp(2j * np.pi * frequency * times))).max() / abs(part))


def off_overlay(motion: NDArray[np.float64], path: NDArray[np.float64]) -> float:
    """Return by how much a motion leaves the path at most, both without their means, over half the path's range."""
    return float(np.abs(motion - motion.mean() - path + path.mean()).max() / (0.5 * np.ptp(path)))


HARMONIC = "section 5, Fig. 7: harmonic after transients"
OVERLAYS = "section 5, Fig. 7: overlays after some time"
CIRCLE = Case("on the path of the round wheel", own=False)


@claim(
    "C28", "fig7",
    "2.25 m/s: once transients have decayed the wheel overlays the irregularity, and the force is small, harmonic and "
    "in antiphase",
    "of a wheel that follows by its lowest point; on the path of the round wheel the force is not harmonic",
)  # fmt: skip
def in_phase() -> Iterator[Measure]:
    """Measure the settled motion and force."""
    frequency = 1.0 / wavelength_time(2.25)
    for damping in (8e3, 2e4):
        record = sine(-AMPLITUDE, damping, 2.25, 400 * wavelength_time(2.25))
        times = settled_times(record, 50, wavelength_time(2.25), 512)
        history = record.at(times)
        path, motion, force = (
            harmonic(times, history[name].values, frequency)
            for name in ("constraint", "wheel_displacement", "normal_force")
        )
        end = f", c = {damping:g}"
        yield said("almost identical", "section 5, Fig. 7", f"y/a{end}", abs(motion / path))
        yield LINEAR.relative(f"y/a{end}", abs(motion / path), linear_motion(frequency))
        phase = float(np.angle(motion / path, deg=True))
        yield said("in phase", "section 5, Fig. 7", f"phase of y [°]{end}", phase)
        yield PINNED.absolute(f"phase of y [°]{end}", phase, {8e3: -0.072, 2e4: -0.180}[damping], 1e-3)
        yield said("very small", "section 5: small", f"force amplitude/N0{end}", abs(force) / STATIC)
        yield PINNED.relative(
            f"force amplitude/N0{end}", abs(force) / STATIC, {8e3: 0.0591417, 2e4: 0.0591989}[damping]
        )
        phase = float(np.angle(force / path, deg=True))
        yield said("in antiphase", "section 5, Fig. 7", f"phase of N [°]{end}", phase)
        yield PINNED.relative(f"phase of N [°]{end}", phase, {8e3: 178.825, 2e4: 177.064}[damping])
    for rolling, case in (("point", STATED), ("circle", CIRCLE)):
        record = sine(-AMPLITUDE, 2e4, 2.25, 100 * wavelength_time(2.25), rolling=rolling)
        times = settled_times(record, 1, wavelength_time(2.25), 512)
        history, round_wheel = record.at(times), rolling == "circle"
        left = residue(times, history.normal_force.values, frequency)
        yield said("very small", HARMONIC, "N beside its harmonic after 100 waves, c = 2e4", left, round_wheel, case)
        away = off_overlay(history.wheel_displacement.values, history.constraint.values)
        yield said("overlays", OVERLAYS, "y away from the path after 100 waves, over a", away, round_wheel, case)


@cache
def runs_at_resonance(damping: float, seed: int = 0) -> list[Run]:
    """Return what ten wheels do near the resonance."""

    def run(speed: float, amplitude: float) -> Run:
        wave = wavelength_time(speed)
        record = sine(amplitude, damping, speed, WAVES * wave)
        height = record.history(RATE).wheel_displacement.values
        leaves, is_high = float(record.events.time[0]) / wave, bool(np.max(height) - height[0] > HIGH)
        return Run(leaves, largest(record), is_high, amplitude > 0.0)

    return drawn_runs(run, seed)


DAMPINGS = {0.0: Case("with c = 0"), 8e3: Case("with c = 8e3 N s/m"), 2e4: Case("with c = 2e4 N s/m")}
"""Readings of a core model whose damping the paper does not tell."""


@claim("C29", "fig7", "9 m/s: the normal force is several times the static one")
def several_times_static() -> Iterator[Measure]:
    """Measure the largest force within 10 periods, and count runs."""
    early = {
        ("+", 0.0): 5.28799, ("+", 8e3): 4.47574, ("+", 2e4): 4.22035,
        ("−", 0.0): 4.35392, ("−", 8e3): 4.32221, ("−", 2e4): 4.27444,
    }  # fmt: skip
    for sign, amplitude in SIGNS.items():
        for damping, case in DAMPINGS.items():
            found = largest(sine(amplitude, damping, 9.0, 10 * wavelength_time(9.0)))
            words = f"N_max/N0 in 10 periods, {sign}a"
            yield said("several times", "section 5, Fig. 7", words, found, case=case)
            yield PINNED.relative(f"{words}, c = {damping:g}", found, early[sign, damping])
    for damping, case in DAMPINGS.items():
        yield count_forces(runs_at_resonance(damping), case)


@claim(
    "C30", "fig7", "9 m/s: the wheel lifts off within half a period",
    "if the rail rises first; printed is −a·sin, which falls first",
)  # fmt: skip
def lifts_off() -> Iterator[Measure]:
    """Measure the first loss in periods, and count runs."""
    expected = {"+": (0.496893, 0.497775, 0.499107), "−": (0.857453, 0.858448, 0.859949)}
    for sign, amplitude in SIGNS.items():
        for damping, pinned in zip((0.0, 8e3, 2e4), expected[sign], strict=True):
            first = float(sine(amplitude, damping, 9.0, 2 * wavelength_time(9.0)).events.time[0]) / wavelength_time(9.0)
            yield PINNED.relative(f"first loss/T, {sign}a, c = {damping:g}", first, pinned)
            over, case = f"first loss over half a period, c = {damping:g}", RISES if sign == "+" else FALLS
            yield said("lower", "section 5", over, 2.0 * first, case is FALLS, case)


@claim(
    "C31", "fig7", "9 m/s: the wheel rises by as much as 1 mm and even more",
    "with little damping: nearly all runs without any, two in ten with 8e3 N s/m, none with 2e4 N s/m",
)  # fmt: skip
def rises() -> Iterator[Measure]:
    """Count the runs that rise by 1 mm."""
    for damping, case in DAMPINGS.items():
        yield count_heights(runs_at_resonance(damping), case, refutes=damping > 0.0)


@claim("C32", "fig7", "9 m/s: the time between impacts is generally longer than a period")
def longer_than_a_period() -> Iterator[Measure]:
    """Measure the median interval."""
    settling = {("−", 8e3): 1.17047, ("+", 2e4): 1.21996, ("−", 2e4): 1.47587}
    for sign, amplitude in SIGNS.items():
        for damping in (0.0, 8e3, 2e4):
            record = sine(amplitude, damping, 9.0, 60 * wavelength_time(9.0))
            median = float(np.median(np.diff(record.impacts.time.values))) / wavelength_time(9.0)
            yield said("higher", "section 5: generally longer", f"median interval/T, {sign}a, c = {damping:g}", median)
            if (sign, damping) in settling:
                expected = settling[sign, damping]
                yield PINNED.relative(f"median interval/T, {sign}a, c = {damping:g}", median, expected)


@claim("C33", "fig7", "36 m/s: the wheel moves significantly less than the irregularity")
def moves_less() -> Iterator[Measure]:
    """Measure the range of the motion, and its fundamental, which is in antiphase, and that of the force."""
    for damping in (8e3, 2e4):
        record = sine(-AMPLITUDE, damping, 36.0, 0.2)
        whole = 0.5 * float(np.ptp(record.history(2e5).wheel_displacement.values)) / AMPLITUDE
        yield said("significantly less", "section 5", f"half the range of y/a in 0.2 s, c = {damping:g}", whole)
        times = settled_times(record, 70, wavelength_time(36.0))
        history, frequency = record.at(times), 1.0 / wavelength_time(36.0)
        path, motion, force = (
            harmonic(times, history[name].values, frequency)
            for name in ("constraint", "wheel_displacement", "normal_force")
        )
        moved, phase = abs(motion / path), abs(float(np.angle(motion / path, deg=True)))
        softer = "the force swings between almost 0 and 2.3 N0, where the contact is softer on average"
        yield LINEAR.relative(f"y/a at 720 Hz, c = {damping:g}", moved, -linear_motion(720.0), 6e-2, softer)
        yield PINNED.relative(f"y/a at 720 Hz, c = {damping:g}", moved, {8e3: 0.0634408, 2e4: 0.0635344}[damping])
        yield PINNED.relative(f"phase [°], c = {damping:g}", phase, {8e3: 179.875, 2e4: 179.747}[damping])
        at = {8e3: 0.920185, 2e4: 0.921762}[damping]
        yield PINNED.relative(f"force amplitude/N0, c = {damping:g}", abs(force) / STATIC, at)


@claim("C34", "fig7", "36 m/s: the force is high, and near zero in the valleys")
def high_force() -> Iterator[Measure]:
    """Measure both extremes, and the losses with the stiffer contact of set `hertz`."""
    for damping, high, low in ((8e3, 2.34225, 0.05308), (2e4, 2.34123, 0.05976)):
        record = sine(-AMPLITUDE, damping, 36.0, 0.2)
        lowest = float(record.history(5e5).normal_force.values.min()) / STATIC
        yield said("much higher", "section 5, Fig. 7", f"N_max/N0, c = {damping:g}", largest(record))
        yield said("very small", "section 5: low or zero", f"N_min/N0, c = {damping:g}", lowest)
        yield PINNED.relative(f"N_max/N0, c = {damping:g}", largest(record), high)
        yield PINNED.absolute(f"N_min/N0, c = {damping:g}", lowest, low, 1e-4, "read from samples of 2 µs")
    for damping, expected, highest in ((0.0, 50, 2.73111), (2e4, 16, 2.72569)):
        record = sine(-AMPLITUDE, damping, 36.0, 0.2, **HERTZ)
        peak = float(record.peaks.normal_force.max()) / record.static_force
        yield PINNED.relative(f"N_max/N0, set hertz, c = {damping:g}", peak, highest)
        grazing = "one loss grazes"
        yield PINNED.count(f"losses in 0.2 s, set hertz, c = {damping:g}", losses(record), expected, 1, grazing)


@claim("C35", "fig7", "above the resonance the wheel's amplitude falls with speed")
def falls_with_speed() -> Iterator[Measure]:
    """Measure half the range of the settled motion."""
    slower = 0.0
    for speed, expected in ((22.0, 10.2475), (36.0, 3.65072), (72.0, 1.02904)):
        record = sine(-AMPLITUDE, 2e4, speed, 1.0)
        motion = record.at(
            settled_times(record, int(0.5 / wavelength_time(speed)), wavelength_time(speed))
        ).wheel_displacement.values
        amplitude = 1e6 * float(np.ptp(motion)) / 2.0
        if slower:
            ratio = amplitude / slower
            yield said("lower", "section 5", f"amplitude at {speed:g} m/s over that at the speed before", ratio)
        yield PINNED.relative(f"amplitude [µm] at {speed:g} m/s", amplitude, expected)
        slower = amplitude


def spectrum(record: wt.Record, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return frequencies in Hz and amplitudes of a quantity over the whole record, with a Hann window."""
    history = record.history(2e4)
    values = history[name].values - history[name].values.mean()
    window = np.hanning(len(values))
    amplitude = 2.0 * np.abs(np.fft.rfft(values * window)) / window.sum()
    return np.asarray(np.fft.rfftfreq(len(values), 1.0 / 2e4), dtype=float), np.asarray(amplitude, dtype=float)


@claim("C45", "spectra", "the bouncing wheel's main component is slower than the irregularity, and it has higher ones")
def spectra_differ() -> Iterator[Measure]:
    """Measure where the main component lies, and the strongest one above all that the irregularity contains."""
    record = sine(AMPLITUDE, 8e3, 9.0, 180 * wavelength_time(9.0))
    frequency, motion = spectrum(record, "wheel_displacement")
    _, path = spectrum(record, "constraint")
    own = 1.0 / wavelength_time(9.0)
    main = np.argmax(np.where(frequency > 5.0, motion, 0.0))
    lower = float(frequency[main]) / own
    yield said("lower", "section 6", "main component of the motion over the irregularity's", lower)
    above = frequency > frequency[path > 1e-3 * path.max()].max()
    strongest = float(motion[above].max() / motion[main])
    words = "strongest component above those of the irregularity, over the main one"
    yield said("not zero", "section 6: higher components", words, strongest)
