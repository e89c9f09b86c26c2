"""Claims on the corrugation of Fig. 7: 50 µm, 5 cm, at 2.25, 9 and 36 m/s. T is the time of one wavelength."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

import wheeltapper as wt
from wheeltapper.faces.paper.claims import Measure, absolute, claim, count, relative, within
from wheeltapper.faces.paper.setting import HERTZ, STATIC, harmonic, largest, losses, scene, sine

AMPLITUDE, WAVELENGTH = 50e-6, 0.05
SIGNS = {"+": AMPLITUDE, "−": -AMPLITUDE}


def period(speed: float) -> float:
    """Return the time of one wavelength, s."""
    return WAVELENGTH / speed


def settled(record: wt.Record, periods: int, of: float, samples: int = 64) -> NDArray[np.float64]:
    """Return times over the last whole periods of a record, evenly spread."""
    return np.asarray(record.end - of * np.arange(periods * samples, 0, -1) / samples)


def _late(record: wt.Record, after: float) -> float:
    peaks = record.peaks
    return float(peaks.normal_force.values[peaks.time.values > after].max()) / STATIC


@claim("C27", "fig7", "the wheel's path is practically the irregularity itself: but for a harmonic that may resonate")
def path_is_nearly_the_irregularity() -> Iterator[Measure]:
    """Measure the harmonics of the rolled path, and the late response where the fourth one meets the resonance."""
    second = {}
    for amplitude in (AMPLITUDE, AMPLITUDE / 2):
        shape = wt.Corrugation(amplitude=amplitude, wavelength=WAVELENGTH, start=0.0)
        record = wt.simulate(scene(shape, 2e4, 9.0, 4 * period(9.0)))
        times = settled(record, 1, period(9.0), 4096)
        path = record.at(times).constraint.values
        first, second[amplitude] = (abs(harmonic(times, path, n / period(9.0))) / amplitude for n in (1, 2))
        if amplitude == AMPLITUDE:
            yield relative("fundamental over amplitude", first, 0.984, 1e-2)
            yield relative("mean of the path [µm]", 1e6 * float(path.mean()), 4.540, 1e-3)
    yield absolute("second harmonic over amplitude", second[AMPLITUDE], 0.087, 5e-3)
    yield relative("... and over that of half the amplitude", second[AMPLITUDE] / second[AMPLITUDE / 2], 2.0, 5e-2)
    shape = wt.Corrugation(amplitude=-AMPLITUDE, wavelength=WAVELENGTH, start=0.0)
    record = wt.simulate(scene(shape, 2e4, 2.25, 60 * period(2.25)))
    yield relative("late N_max/N0 at 2.25 m/s, circle", _late(record, 40 * period(2.25)), 1.34, 1e-2)
    record = sine(-AMPLITUDE, 2e4, 2.25, 60 * period(2.25))
    yield relative("late N_max/N0 at 2.25 m/s, point", _late(record, 40 * period(2.25)), 1.06, 1e-2)


@claim("C28", "fig7", "2.25 m/s: the wheel moves in phase with the irregularity and by the same amplitude")
def in_phase() -> Iterator[Measure]:
    """Measure the settled fundamental of motion and force."""
    for damping in (8e3, 2e4):
        record = sine(-AMPLITUDE, damping, 2.25, 400 * period(2.25))
        times = settled(record, 50, period(2.25), 512)
        history, frequency = record.at(times), 1.0 / period(2.25)
        path, motion, force = (
            harmonic(times, history[name].values, frequency)
            for name in ("constraint", "wheel_displacement", "normal_force")
        )
        yield relative(f"y/a, c = {damping:g}", abs(motion / path), 1.065, 5e-3)
        yield within(f"phase of y [°], c = {damping:g}", float(np.angle(motion / path, deg=True)), -1.0, 0.0)
        yield relative(f"force amplitude/N0, c = {damping:g}", abs(force) / STATIC, 0.0592, 5e-3)
        yield within(f"phase of N [°], c = {damping:g}", float(np.angle(force / path, deg=True)), 177.0, 180.0)


@claim("C29", "fig7", "9 m/s: the normal force is several times the static one")
def several_times_static() -> Iterator[Measure]:
    """Measure the largest force within 10 and 60 periods."""
    later = {
        ("+", 0.0): (10.0, 12.0), ("+", 8e3): (10.0, 12.0), ("−", 0.0): (14.0, 17.0),
        ("+", 2e4): (4.2, 4.3), ("−", 2e4): (4.2, 4.3),
    }  # fmt: skip
    for sign, amplitude in SIGNS.items():
        for damping in (0.0, 8e3, 2e4):
            record = sine(amplitude, damping, 9.0, 60 * period(9.0))
            peaks = record.peaks
            early = peaks.normal_force.values[peaks.time.values < 10 * period(9.0)].max() / STATIC
            yield within(f"N_max/N0 in 10 periods, {sign}a, c = {damping:g}", float(early), 4.2, 5.3)
            if (sign, damping) in later:
                allowed = later[sign, damping]
                yield within(f"N_max/N0 in 60 periods, {sign}a, c = {damping:g}", largest(record), *allowed)


@claim("C30", "fig7", "9 m/s: the wheel lifts off within half a period, if the rail rises first")
def lifts_off() -> Iterator[Measure]:
    """Measure the first loss in periods."""
    for (sign, amplitude), expected in zip(SIGNS.items(), (0.499, 0.859), strict=True):
        for damping in (0.0, 8e3, 2e4):
            first = float(sine(amplitude, damping, 9.0, 2 * period(9.0)).events.time[0])
            yield absolute(f"first loss/T, {sign}a, c = {damping:g}", first / period(9.0), expected, 5e-3)


@claim("C31", "fig7", "9 m/s: the wheel rises by as much as 1 mm, with low damping or the right sign")
def rises() -> Iterator[Measure]:
    """Measure the largest displacement within 60 periods."""
    expected = {"+": (1.65, 1.33, 0.255), "−": (2.58, 0.27, 0.255)}
    for sign, amplitude in SIGNS.items():
        for damping, height in zip((0.0, 8e3, 2e4), expected[sign], strict=True):
            record = sine(amplitude, damping, 9.0, 60 * period(9.0))
            highest = 1e3 * float(record.history(2e5).wheel_displacement.values.max())
            yield relative(f"largest y [mm], {sign}a, c = {damping:g}", highest, height, 0.4)


@claim("C32", "fig7", "9 m/s: the time between impacts is generally longer than a period")
def longer_than_a_period() -> Iterator[Measure]:
    """Measure the median interval."""
    for sign, amplitude in SIGNS.items():
        for damping in (0.0, 8e3, 2e4):
            record = sine(amplitude, damping, 9.0, 60 * period(9.0))
            median = float(np.median(np.diff(record.impacts.time.values))) / period(9.0)
            yield within(f"median interval/T, {sign}a, c = {damping:g}", median, 1.1, np.inf)


@claim("C33", "fig7", "36 m/s: the wheel moves little and in antiphase")
def antiphase() -> Iterator[Measure]:
    """Measure the fundamental of motion and force."""
    for damping in (8e3, 2e4):
        record = sine(-AMPLITUDE, damping, 36.0, 0.2)
        times = settled(record, 70, period(36.0))
        history, frequency = record.at(times), 1.0 / period(36.0)
        path, motion, force = (
            harmonic(times, history[name].values, frequency)
            for name in ("constraint", "wheel_displacement", "normal_force")
        )
        yield relative(f"y/a at 720 Hz, c = {damping:g}", abs(motion / path), 0.064, 2e-2)
        yield absolute(f"phase [°], c = {damping:g}", abs(float(np.angle(motion / path, deg=True))), 180.0, 1.0)
        yield relative(f"force amplitude/N0, c = {damping:g}", abs(force) / STATIC, 0.916, 2e-2)


@claim("C34", "fig7", "36 m/s: the force is high, and near zero in the valleys")
def high_force() -> Iterator[Measure]:
    """Measure both extremes, and the losses with the stiffer contact of set `hertz`."""
    for damping in (8e3, 2e4):
        record = sine(-AMPLITUDE, damping, 36.0, 0.2)
        yield relative(f"N_max/N0, c = {damping:g}", largest(record), 2.34, 5e-3)
        lowest = float(record.history(5e5).normal_force.values.min()) / STATIC
        yield within(f"N_min/N0, c = {damping:g}", lowest, 0.05, 0.16)
    for damping, expected in ((0.0, 50), (2e4, 16)):
        record = sine(-AMPLITUDE, damping, 36.0, 0.2, **HERTZ)
        peak = float(record.peaks.normal_force.max()) / record.static_force
        yield relative(f"N_max/N0, set hertz, c = {damping:g}", peak, 2.73, 5e-3)
        yield count(f"losses in 0.2 s, set hertz, c = {damping:g}", losses(record), expected, 1)


@claim("C35", "fig7", "above the resonance the wheel's amplitude falls with speed")
def falls_with_speed() -> Iterator[Measure]:
    """Measure half the range of the settled motion."""
    for speed, expected in ((22.0, 10.2), (36.0, 3.65), (72.0, 1.03)):
        record = sine(-AMPLITUDE, 2e4, speed, 1.0)
        motion = record.at(settled(record, int(0.5 / period(speed)), period(speed))).wheel_displacement.values
        yield relative(f"amplitude [µm] at {speed:g} m/s", 1e6 * float(np.ptp(motion)) / 2.0, expected, 5e-2)


def spectrum(record: wt.Record, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return frequencies in Hz and amplitudes of a quantity over the whole record, with a Hann window."""
    history = record.history(2e4)
    values = history[name].values - history[name].values.mean()
    window = np.hanning(len(values))
    amplitude = 2.0 * np.abs(np.fft.rfft(values * window)) / window.sum()
    return np.asarray(np.fft.rfftfreq(len(values), 1.0 / 2e4), dtype=float), np.asarray(amplitude, dtype=float)


@claim("C45", "spectra", "the spectrum of the wheel's motion differs from the irregularity's")
def spectra_differ() -> Iterator[Measure]:
    """Measure where the main component lies, and what the irregularity does not contain."""
    record = sine(AMPLITUDE, 8e3, 9.0, 180 * period(9.0))
    frequency, motion = spectrum(record, "wheel_displacement")
    _, path = spectrum(record, "constraint")
    own = 1.0 / period(9.0)
    audible = frequency > 5.0
    main = float(frequency[audible][np.argmax(motion[audible])])
    yield within("main component of the motion over the irregularity's", main / own, 0.0, 0.95)
    absent = audible & (path < 1e-3 * path.max())
    strongest = float(motion[absent].max() / motion[audible].max())
    yield within("strongest component that the irregularity lacks, over the main one", strongest, 0.1, 1.0)
