"""Reconstruction of the contact force from the acceleration of the deck."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import factorial, log10, pi, sin, sqrt
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.describe.sensor.deck_acceleration import DeckAcceleration
from wheeltapper.describe.site import Site, as_site
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.diagnosis.detection.roc import number_or_array
from wheeltapper.diagnosis.force import bearing as force_bearing
from wheeltapper.diagnosis.force import smooth as force_smooth
from wheeltapper.diagnosis.scale import Scale
from wheeltapper.ground.arguments import check_choice
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.shown import Shown
from wheeltapper.record.recordings.given import as_recording
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Method = Literal["auto", "inertia", "bearing", "tikhonov", "smoother"]

RIGHT = 0.01
"""Largest relative error of the modulus of the force at frequencies within the band of a method."""
LOUD = 60.0
"""Ratio of signal to noise, dB, from which on the method `auto` does not smooth."""
CONTACT = 100.0
"""Frequency of a wheel that bounces on the rail, Hz. At this frequency `auto` judges what the bearing contributes."""
EARLY = 36.0
"""Contact periods in which `auto` compares signal and noise: those in which a wheel bounces most."""
NEGLIGIBLE = 0.003
"""Relative error of the force at that frequency below which `auto` neglects the force of the bearing."""
SHORTEST = 16
"""Smallest number of usable samples (neither missing nor clipped); a recording with fewer is refused."""
ORDER = 6
"""Order of the differences of the samples from which the noise is estimated. A smooth signal has almost no sixth
differences, so that they are noise."""
NORMAL = 1.482602218505602
"""Ratio of the standard deviation of a normal distribution to the median of its modulus."""
FASTEST = 3
"""Number of samples that are left out at each end of a flight if the force is not smoothed."""
AROUND = 2.0
"""Samples that are left out at each end of a flight if the force is smoothed, over the width of the smoothing kernel.
Within that distance smoothing mixes flight and contact."""


@dataclass(frozen=True, eq=False)
class Force(Shown):
    """A contact force over time.

    Attributes
    ----------
    times
        Times after the trigger, s, (n,), corrected for the delay of the sensor's filter.
    force
        Normal force of the wheelset, N, (n,); NaN where the method gives no value.
    deviation
        Its standard error due to the sensor's noise, N, (n,); infinite where a clipped sample is used.
    band
        Lowest and highest frequency, Hz, between which the error of the method is at most 1 %.
    method
        "inertia", "bearing", "tikhonov", "smoother", or "recorded" if the recording is one of the force.
    notes
        What the user should know.
    """

    times: FloatArray
    force: FloatArray
    deviation: FloatArray
    band: tuple[float, float]
    method: str
    notes: tuple[str, ...]


class _ForceProblem(NamedTuple):
    """What all methods need."""

    recording: Recording
    deck: FloatingDeck
    g: FloatArray  # -M·a, N
    is_good: BoolArray  # neither missing nor clipped
    noise: float  # m/s², of a sample
    static: float  # N
    cutoff: float  # Hz, to 1 % of the modulus
    period: float  # s, of the wheel on its contact


class _MethodResult(NamedTuple):
    """What a method found."""

    force: FloatArray
    deviation: FloatArray
    band: tuple[float, float]
    notes: tuple[str, ...] = ()


def reconstructed(recording: Recording | str | Path, site: Site | str | Path, method: Method = "auto") -> Force:
    """Return the contact force behind a recording: N = N0 - M·a - K·y - C_d·v.

    Parameters
    ----------
    recording
        Recording of the deck's acceleration; one of the force is returned as it is. If it begins at the trigger or
        before it, the deck is assumed to be at rest at its start.
    site
        Deck, static force and sensor; or the path of its TOML file.
    method
        "inertia": N0 - M·a. Missing samples stay missing.

        "bearing": inertia less K·y + C_d·v, with a integrated twice from rest. The drift is estimated from N = 0 in
        flight and, loosely, from the static force as the mean.

        "tikhonov": the smoothest force, by second differences, whose residual is as large as the noise (the discrepancy
        principle, with the degrees of freedom that the force uses), and the bearing. One weight holds for the whole
        recording: it flattens impacts if a long quiet part follows.

        "smoother": states y, v, F, F', F'' with white noise F''' (equivalent to a Kalman filter with Rauch's smoother),
        and the bearing. The intensity of the noise is that of maximum likelihood; it varies over time with the force.

        The last two leave out missing samples. For a clipped sample they use the fact that the true value lies beyond
        it.

        "auto": the smoother if samples are missing or clipped, or if the signal's rms in the first 36 contact periods
        is less than 60 dB above the noise. Otherwise inertia if the bearing contributes less than 0.3 % at 100 Hz, else
        bearing.

    Raises
    ------
    InputError
        If the method is unknown, or the recording has too few samples.
    """
    recording, site = as_recording(recording), as_site(site)
    check_choice(method, "method", ("auto", *METHODS))
    good = np.isfinite(recording.samples) & ~recording.clipped
    if int(good.sum()) < SHORTEST:
        usable = f"{int(good.sum())} samples that are neither missing nor clipped"
        raise InputError(recording.source, "samples", usable, f"{SHORTEST} or more")
    if recording.quantity == "force":
        return _recorded_force(recording)
    setting, notes = _force_problem(recording, site, good)
    chosen: str = method
    if method == "auto":
        chosen, why = _chosen_method(setting)
        notes = (*notes, why)
    found = METHODS[chosen](setting)
    times = recording.times - _filter_delay(site.sensor)
    return Force(times, found.force, found.deviation, found.band, chosen, (*notes, *found.notes))


def imitation(site: Site | str | Path, frequencies: ArrayLike) -> NDArray[np.complex128]:
    """Return -M·A/ΔN, the share of the dynamic force that the deck's inertia shows (claim C22).

    1/(1 - r² - 2i·ζ·r), r = f_deck/f: with ÿ = A·exp(2πi·f·t) of M·ÿ = -ΔN - K·y - C_d·ẏ.

    Parameters
    ----------
    site
        Site with its deck, or the path of its TOML file.
    frequencies
        Frequencies, Hz, more than 0; one or an array of them.

    Raises
    ------
    InputError
        If a frequency is not positive.
    """
    site = as_site(site)
    f = number_or_array(frequencies, "frequencies", "frequencies in Hz")
    if not np.all((f > 0.0) & np.isfinite(f)):
        raise InputError("", "frequencies", f"{np.min(f):g} Hz", "more than 0 Hz")
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1.0 / _force_over_inertia(_site_deck(site), f))


def noise_of(recording: Recording, sensor: DeckAcceleration) -> float:
    """Return the standard deviation of the samples' noise, m/s²: that of the sensor, or one estimated from the samples.

    The estimate is the median of the modulus of the sixth differences, which contain hardly any signal, scaled.
    """
    if sensor.noise > 0.0:
        return sensor.spread(recording.rate)
    differences = np.diff(np.where(recording.clipped, np.nan, recording.samples), ORDER)
    differences = differences[np.isfinite(differences)]
    if len(differences) == 0:
        return float(sensor.step / sqrt(12.0))
    gain = sqrt(factorial(2 * ORDER)) / factorial(ORDER)
    return float(max(NORMAL * np.median(np.abs(differences)) / gain, sensor.step / sqrt(12.0)))


# -- methods ----------------------------------------------------------------------------------------------------------


def _by_inertia(setting: _ForceProblem) -> _MethodResult:
    deviation = np.full(len(setting.g), setting.deck.mass * setting.noise)
    deviation[setting.recording.clipped] = np.inf
    deviation[np.isnan(setting.g)] = np.nan
    lowest = _lowest_frequency(setting.deck)
    note = f"the bearing's force is left out: right from {lowest:.3g} Hz on"
    return _MethodResult(setting.static + setting.g, deviation, (lowest, setting.cutoff), (note,))


def _by_bearing(setting: _ForceProblem) -> _MethodResult:
    inertia = _by_inertia(setting)
    if np.all(setting.is_good):
        filled, width = setting.g, 0.0
    else:
        smooth = _smooth_inertia(setting, "smoother")
        filled, width = np.where(setting.is_good, setting.g, smooth.values), smooth.width
    term, note = _bearing_term(setting, filled, setting.deck.mass * setting.noise, width)
    deviation = np.sqrt(inertia.deviation**2 + term.variance)
    return _MethodResult(inertia.force - term.values, deviation, (0.0, setting.cutoff), (note,))


def _by_tikhonov(setting: _ForceProblem) -> _MethodResult:
    return _of_smooth(setting, _smooth_inertia(setting, "tikhonov"))


def _by_smoother(setting: _ForceProblem) -> _MethodResult:
    return _of_smooth(setting, _smooth_inertia(setting, "smoother"))


METHODS: dict[str, Callable[[_ForceProblem], _MethodResult]] = {
    "inertia": _by_inertia,
    "bearing": _by_bearing,
    "tikhonov": _by_tikhonov,
    "smoother": _by_smoother,
}
"""The methods of `reconstructed`, by name."""


def _of_smooth(setting: _ForceProblem, smooth: force_smooth.SmoothEstimate) -> _MethodResult:
    deviation = float(np.sqrt(np.median(smooth.variance)))
    term, note = _bearing_term(setting, smooth.values, deviation, smooth.width)
    highest = smooth.cutoff(setting.recording.rate, RIGHT)
    return _MethodResult(
        setting.static + smooth.values - term.values,
        np.sqrt(smooth.variance + term.variance),
        (0.0, min(highest, setting.cutoff)),
        (note,),
    )


def _smooth_inertia(setting: _ForceProblem, method: str) -> force_smooth.SmoothEstimate:
    """Return the smooth g. A clipped sample is used only if g would otherwise stay below it."""
    deck, rate = setting.deck, setting.recording.rate
    noise = deck.mass * max(setting.noise, 1e-9 * float(np.abs(setting.g[setting.is_good]).max()), 1e-12)
    order = 2 if method == "tikhonov" else 3
    row = force_smooth.stencil(deck.mass, deck.stiffness, deck.damping, 1.0 / rate, order)
    measured, is_used = np.nan_to_num(setting.g), setting.is_good
    while True:
        shape = np.ones(len(measured) - order)
        problem = force_smooth.SmoothingProblem(measured, is_used.astype(float), row, shape)
        if method == "tikhonov":
            smooth = force_smooth.by_discrepancy(problem, noise)
        else:
            smooth = force_smooth.by_likelihood(problem, noise, rate * setting.period)
        short = setting.recording.clipped & ~is_used & (smooth.values * np.sign(measured) < np.abs(measured))
        if not np.any(short):
            return smooth
        is_used = is_used | short


def _bearing_term(
    setting: _ForceProblem, g: FloatArray, deviation: float, width: float
) -> tuple[force_bearing.BearingTerm, str]:
    """Return the force of the bearing, and a note on how it was computed."""
    deck, recording = setting.deck, setting.recording
    at_rest = recording.start <= 0.0
    bearing = force_bearing.Bearing(
        float(deck.mass),
        float(deck.stiffness),
        float(deck.damping),
        1.0 / recording.rate,
        setting.period,
        setting.noise,
        at_rest,
    )
    trim = max(FASTEST, int(np.ceil(AROUND * width)))
    term = force_bearing.bearing_term(bearing, g, deviation, trim, setting.static)
    start = "from rest" if at_rest else "from an unknown state, as the recording begins after the trigger"
    return term, f"the bearing's force is integrated {start}, and tied in {term.flights} flights"


# -- what all methods need --------------------------------------------------------------------------------------------


def _force_problem(recording: Recording, site: Site, good: BoolArray) -> tuple[_ForceProblem, tuple[str, ...]]:
    from wheeltapper.lower.build import lower

    deck, sensor = _site_deck(site), site.sensor
    known = sensor.offset + sensor.drift * recording.times
    g = -deck.mass * (recording.samples - known)
    cutoff = 0.5 * recording.rate
    if sensor.cutoff is not None:
        cutoff = min(cutoff, sensor.cutoff * ((1.0 - RIGHT) ** -2 - 1.0) ** (0.5 / sensor.order))
    static = float(lower(site.passage, "default").static_force)
    period = Scale(site.passage).period
    setting = _ForceProblem(recording, deck, g, good, noise_of(recording, sensor), static, float(cutoff), period)
    return setting, _sample_notes(recording)


def _sample_notes(recording: Recording) -> tuple[str, ...]:
    clipped, missing = int(recording.clipped.sum()), int(np.isnan(recording.samples).sum())
    notes = (
        (missing, f"{missing} samples are missing"),
        (clipped, f"{clipped} samples are clipped: the force lies beyond what they show"),
    )
    return tuple(note for count, note in notes if count)


def _recorded_force(recording: Recording) -> Force:
    deviation = np.full(len(recording.samples), noise_of(recording, DeckAcceleration()))
    deviation[recording.clipped] = np.inf
    deviation[np.isnan(recording.samples)] = np.nan
    note = "the recording is one of the force, and is passed on as it is"
    return Force(
        recording.times, recording.samples, deviation, (0.0, 0.5 * recording.rate), "recorded",
        (*_sample_notes(recording), note),
    )  # fmt: skip


def _chosen_method(setting: _ForceProblem) -> tuple[str, str]:
    """Return the method that is chosen automatically, and the reason."""
    early = setting.is_good & (setting.recording.times <= EARLY * setting.period)
    a = setting.g[early if np.any(early) else setting.is_good] / setting.deck.mass
    signal = float(np.sqrt(np.mean(a**2)))
    ratio = np.inf if setting.noise == 0.0 else 20.0 * log10(max(signal, 1e-300) / setting.noise)
    if not np.all(setting.is_good):
        return "smoother", "smoother: samples are missing or clipped"
    if ratio < LOUD:
        return "smoother", f"smoother: the signal is {ratio:.0f} dB above the noise, less than {LOUD:g} dB"
    error = 1.0 / float(np.abs(_force_over_inertia(setting.deck, np.array(CONTACT)))) - 1.0
    method = "inertia" if abs(error) < NEGLIGIBLE else "bearing"
    loud = f"the signal is {ratio:.0f} dB above the noise"
    return method, f"{method}: {loud}, and the bearing makes {100 * error:.2g} % at {CONTACT:g} Hz"


def _lowest_frequency(deck: FloatingDeck) -> float:
    """Return the lowest frequency, Hz, above which inertia gives the modulus of the force to 1 %."""
    f = np.geomspace(1e-2, 1e5, 20_001)
    parts = np.abs(_force_over_inertia(deck, f))
    return float(f[(parts * (1.0 - RIGHT) > 1.0) | (parts * (1.0 + RIGHT) < 1.0)].max(initial=0.0))


def _force_over_inertia(deck: FloatingDeck, f: FloatArray) -> NDArray[np.complex128]:
    inertia = deck.mass * 2.0 * pi * f
    return np.asarray(1.0 - deck.stiffness / (inertia * 2.0 * pi * f) - 1j * deck.damping / inertia)


def _filter_delay(sensor: DeckAcceleration) -> float:
    """Return the delay, s, of the sensor's Butterworth filter at low frequencies."""
    if sensor.cutoff is None:
        return 0.0
    return float(1.0 / (2.0 * pi * sensor.cutoff * sin(0.5 * pi / sensor.order)))


def _site_deck(site: Site) -> FloatingDeck:
    assert isinstance(site.passage.track, FloatingDeck)
    return site.passage.track
