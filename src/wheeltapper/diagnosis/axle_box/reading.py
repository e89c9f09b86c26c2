"""From what an axle box recorded to a finding on its wheel and on the rail.

Theory: docs/theory/gauges.rst, section 16.11.
"""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from wheeltapper.describe.site import Site, as_any_site
from wheeltapper.diagnosis.axle_box.finding import AxleBoxFinding
from wheeltapper.diagnosis.axle_box.joints import RailFlaw, flaws_in
from wheeltapper.diagnosis.axle_box.turns import FEWEST, average_of, seats_of, turns_of
from wheeltapper.diagnosis.axle_box.wheel import Wheel, seen_of
from wheeltapper.diagnosis.gauges.fit import MEASURED_FORCE
from wheeltapper.diagnosis.gauges.known import RADIUS, known_of
from wheeltapper.diagnosis.gauges.weighing import ORDER
from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.plausible import SPEED
from wheeltapper.march.common.blocks import algebra_on_one_thread
from wheeltapper.record.assessment.filtering import low_passed
from wheeltapper.record.recordings.read import read_recording
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]
LOWEST = 1000.0
"""Samples per second that are needed."""
HIGHEST, PER_CUTOFF = 800.0, 3.0
"""The cut-off frequency, Hz, at most, and samples in its period, at least."""
SPEED_SPREAD = 0.02
"""Standard deviation of a measured speed, over it."""
WIDE = 3.0
"""The period is looked for within so many standard deviations."""
SEAT_SPREAD = 4e-3
"""Standard deviation of a radius that follows from the seats' passing, over it."""
BEFORE, BEHIND = 0.4, 1.6
"""A flaw of the rail is felt from so far before it to so far behind it, m."""
HARMONICS = 4
"""Of the seats' passing, that are taken away."""
FINER = 4
"""Turns are read so many times finer than samples, so that straight lines between them lose nothing."""
SHARE = 0.4
"""Where flaws of the rail leave less than this part of the turns, they all count."""
ROUNDS = 2
"""How often the rail's flaws are looked for, each time without the wheel's part of the time before."""


class Parts(NamedTuple):
    """The average turn with its standard error, m/s², what of a recording is left, and the rail's flaws in it."""

    average: FloatArray
    error: FloatArray
    left: FloatArray
    flaws: list[RailFlaw]


def diagnose_axle_box(
    recording: Recording | str | Path, site: Site | str | Path, *, speed: float | str | None = None
) -> AxleBoxFinding:
    """Diagnose a wheel, and find flaws of the rail, from the acceleration of an axle box.

    Parameters
    ----------
    recording
        Recording of the quantity "vertical acceleration" at a steady speed, over six turns of the wheel or more; or the
        path of its file.
    site
        Site with the track, the wheel and its `static_force`; or the path of its TOML file.
    speed
        Measured speed, m/s or as "80 km/h"; by default that of the recording.

    Raises
    ------
    InputError
        If the recording is of another quantity, too short, of too low a rate, or without a speed; or if the site does
        not state enough.
    """
    if not isinstance(recording, Recording):
        recording = read_recording(recording, quantity="vertical acceleration")
    site, source = as_any_site(site), recording.source
    if site.track is None or site.static_force is None:
        missing = "track" if site.track is None else "static_force"
        raise InputError(site.name, missing, "none", "a track, and the static force of the wheel")
    if recording.quantity != "vertical acceleration":
        raise InputError(source, "quantity", repr(recording.quantity), "'vertical acceleration'")
    if recording.rate < LOWEST:
        raise InputError(source, "rate", f"{recording.rate:g} Hz", f"at least {LOWEST:g} Hz")
    measured = abs(recording.speed or 0.0) if speed is None else as_quantity(speed, "speed", "speed")
    if not measured > 0.0:
        raise InputError(source, "speed", "none", "the measured speed of the vehicle, as 80 km/h")
    if not measured <= SPEED.most:
        raise InputError(source, "speed", f"{measured:.4g} m/s", f"at most {SPEED.most:g} m/s")
    known = known_of(site)
    spread = WIDE * float(np.hypot(SPEED_SPREAD, known.spread.get(RADIUS, 0.0)))
    least = FEWEST * 2.0 * pi * float(known.scene.vehicle.radius) / measured * (1.0 + spread)
    if recording.duration < least:
        found, allowed = f"{recording.duration:.3g} s", f"{FEWEST} turns of the wheel, {least:.3g} s"
        raise InputError(source, "samples", found, allowed)
    good = recording.samples[np.isfinite(recording.samples)]
    if len(good) and np.ptp(good) == 0.0:
        raise InputError(source, "samples", "a constant signal", "what an accelerometer on an axle box reads")
    with algebra_on_one_thread():
        return _read(recording, site, measured, spread)


def _read(recording: Recording, site: Site, measured: float, spread: float) -> AxleBoxFinding:
    known, rate = known_of(site), recording.rate
    radius, spacing = float(known.scene.vehicle.radius), float(known.scene.track.spacing)
    assert site.static_force is not None
    cutoff = min(HIGHEST, rate / PER_CUTOFF)
    filled, used = _filled(recording, cutoff)
    smooth = low_passed(filled - filled[used].mean(), rate, cutoff, ORDER)
    turn = 2.0 * pi * radius
    turns = turns_of(smooth, rate, turn / measured, spread, spacing / turn, cutoff)
    average, _ = average_of(turns.folded(np.where(used, smooth, np.nan), rate))
    times = np.arange(len(smooth)) / rate
    speed = turn / turns.mean
    passing = seats_of(smooth - turns.unfolded(average, times), rate, speed / spacing, spread)
    if passing is not None:
        speed = passing * spacing
        radius, uncertain = speed * turns.mean / (2.0 * pi), {**known.spread, RADIUS: SEAT_SPREAD}
        known = known._replace(scene=known.scene.replaced({RADIUS: radius}), spread=uncertain)
    force_spread = site.uncertainty.get("static_force", MEASURED_FORCE)
    wheel = Wheel(known, float(site.static_force), force_spread, turns, speed, cutoff)
    parts = _parts(wheel, smooth, used, rate, passing)
    seen = seen_of(wheel, parts.average, parts.error)
    return AxleBoxFinding(recording, wheel, seen, parts.average, parts.error, parts.left, tuple(parts.flaws), passing)


def _parts(wheel: Wheel, smooth: FloatArray, used: NDArray[np.bool_], rate: float, passing: float | None) -> Parts:
    """Return what is the wheel's, and what is left with the rail's flaws in it."""
    turns, times = wheel.turns, np.arange(len(smooth)) / rate
    own, turn = used.copy(), wheel.speed * wheel.period
    number = np.arange(FINER * len(smooth)) / FINER
    fine = CubicSpline(np.arange(len(smooth)), smooth)(number)

    def folded(good: NDArray[np.bool_]) -> FloatArray:
        return turns.folded(np.where(np.repeat(good, FINER), fine, np.nan), FINER * rate)

    average = np.nanmedian(folded(own), axis=0)
    for _ in range(ROUNDS):
        left = _without_seats(np.where(used, smooth - turns.unfolded(average, times), 0.0), times, passing)
        flaws = flaws_in(left, rate, wheel.speed, wheel.answer, turn)
        x, own = times * wheel.speed, used.copy()
        for one in flaws:
            own &= (x < one.place - BEFORE) | (x > one.place + BEHIND)
        every, kept = folded(used), folded(own)
        thin = np.isfinite(kept).sum(axis=0) < SHARE * turns.whole
        average, error = average_of(np.where(thin, every, kept))
    return Parts(average, error, left, flaws)


def _without_seats(left: FloatArray, times: FloatArray, passing: float | None) -> FloatArray:
    """Return samples without the harmonics of the seats' passing."""
    if passing is None:
        return left
    phases = 2.0 * np.pi * passing * times[:, None] * np.arange(1, HARMONICS + 1)
    columns = np.concatenate([np.cos(phases), np.sin(phases)], axis=1)
    return np.asarray(left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0])


def _filled(recording: Recording, cutoff: float) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return samples with those that are missing or clipped filled in, and which are not touched by such ones."""
    good = np.isfinite(recording.samples) & ~recording.clipped
    if not good.any():
        raise InputError(recording.source, "samples", "none that is good", "some")
    number = np.arange(len(good))
    filled = np.interp(number, number[good], recording.samples[good])
    around = int(recording.rate / cutoff)
    return filled, np.convolve(~good, np.ones(2 * around + 1), "same") == 0
