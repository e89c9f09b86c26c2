"""One recording at one site, and the fits that were made of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from math import sqrt
from typing import NamedTuple

import numpy as np

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.faults.base import CATALOGUE, LOAD, Fault, fault_named
from wheeltapper.diagnosis.inference.estimate import LOUD, onset, priors_of, site_at_speed
from wheeltapper.diagnosis.inference.fitting import Fit, fit_over_windows
from wheeltapper.diagnosis.inference.problem import SURE, Exit, FitProblem, Prior, values_of
from wheeltapper.diagnosis.inference.timing import timed, zero_of
from wheeltapper.diagnosis.scale import Scale
from wheeltapper.ground.arguments import as_list
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import BILATERAL
from wheeltapper.march import run
from wheeltapper.record.recordings.recording import Recording

EXPLAINED = 1.3
"""Largest χ² per degree of freedom at which a model explains a recording. If the best model has more, the verdict is
"not explained"."""
CLEARLY, WRONG = 4.0, 1.1
"""A fit is clear if χ² per degree of freedom exceeds that of the recording's quiet beginning, or one if that is more,
by at most CLEARLY standard deviations, √(2/degrees of freedom) each for normal noise. WRONG is the largest χ² of the
beginning that counts, and the one where there is no beginning: the stated noise may be wrong by 5 % (1.05² = 1.1)."""
EARLY = 3.0
"""Standard deviations of the noise. If the model of the fastest plausible healthy wheelset stays below this up to the
onset, the irregularity of the site cannot have caused the onset: the wheel itself has."""
QUIET = 2.0
"""Contact periods after its entry within which a wheel that is out of round moves the deck: it comes onto it with a
force that differs from the static one."""
LEFT_OUT = 0.05
"""Largest share of the recording that is left out where the wheel leaves the deck at an uncertain time, or where no
model explains it."""

FLIGHTS, PLATEAU = 10.8, 97.0
"""The static force is estimated from flights, in which the deck's acceleration is N0/M. They are looked for in the
first FLIGHTS contact periods after the onset, eight impacts at the example's site: later ones are lower. The
acceleration in flight is taken as the PLATEAU-th percentile of the samples there: nearly the largest, but insensitive
to a few outliers."""


class Stretch(NamedTuple):
    """A part of a recording: from a time after the trigger to another, s."""

    start: float
    end: float


class Case:
    """One recording at one site, and the fits that were made of it."""

    def __init__(
        self, recording: Recording, site: Site, faults: Sequence[str] | None, noise: float,
        omitted: Stretch | None = None,
    ) -> None:  # fmt: skip
        self.whole, self.site, self.noise, self.omitted, self._asked = recording, site, noise, omitted, faults
        self.recording = _without(recording, omitted)
        self.stated = site_at_speed(site, recording.speed)
        self.faults, self.left_out = faults_of(site.passage, faults)
        self.scale = Scale(site.passage)
        self.begins = onset(self.recording, noise)
        self.exit: Exit | None = None
        self.passage, known = self._passage_with_onset()
        self.exit = self._uncertain_exit(known)
        self.recording = _without(self.recording, self.exit)
        self.fits: dict[str, Fit] = {}
        self.evidence: dict[str, float] = {}
        self.struck = False  # a late strike of a healthy wheelset: only a flat can be the cause

    def excluding(self, stretch: Stretch) -> Case:
        """Return the case of the same recording without one stretch, in which no model explains it."""
        return Case(self.whole, self.site, self._asked, self.noise, stretch)

    def after(self, periods: float) -> float:
        """Return the time, s after the trigger, that lies so many contact periods after the onset."""
        return self.begins + periods * self.scale.period

    def fit_problem(self, start: Scenario, priors: dict[str, Prior]) -> FitProblem:
        """Return the problem of fitting a family of models to the recording, from a starting model."""
        return FitProblem(self.recording, self.site.sensor, self.noise, start, priors, self.scale, self.exit)

    @property
    def best_fit(self) -> Fit | None:
        """The fit with the smallest χ² per degree of freedom."""
        return min(self.fits.values(), key=lambda fit: fit.reduced, default=None)

    @cached_property
    def moves_too_early(self) -> bool:
        """True if the deck moves before the site's irregularity can move it: the wheel itself is the cause."""
        stated, trigger = self.stated.passage, self.site.trigger
        if trigger is None:
            return False  # nothing says when the site's irregularity can move the deck
        fastest = stated.replaced({"speed": stated.speed * (1.0 + SURE * self.site.uncertainty.get("speed", 0.0))})
        fastest = timed(fastest, -SURE * trigger) if trigger else fastest
        count = int(np.searchsorted(self.recording.times, self.begins)) + 1
        found = self.fit_problem(fastest, {}).model_samples(fastest, count)
        return found is not None and bool(np.abs(found).max() < EARLY * self.noise)

    @cached_property
    def strikes_on_deck(self) -> bool:
        """True if the deck begins to move only some time after the wheel has rolled onto it."""
        return self.begins > self._entry(-1.0) + QUIET * self.scale.period

    def _entry(self, faster: float) -> float:
        """Return when the wheel enters the deck, s after the trigger, if it is `faster` times SURE deviations faster.

        An endless deck carries it from the start.
        """
        stated, late = self.stated.passage, SURE * (self.site.trigger or 0.0)
        share = faster * min(SURE * self.site.uncertainty.get("speed", 0.0), 0.5)
        return float(float(stated.track.start or 0.0) / (float(stated.speed) * (1.0 + share)) - faster * late)

    def _passage_with_onset(self) -> tuple[Scenario, bool]:
        """Return the stated passage whose irregularity moves the deck at the onset, if that is more precise; whether.

        The onset is V0/V times as late as in the stated passage, and later by the time zero. The difference is divided
        between speed and time zero by their variances.
        """
        stated, share = self.stated.passage, self.site.uncertainty.get("speed", 0.0)
        trigger = np.inf if self.site.trigger is None else self.site.trigger
        by_speed, plain = share * max(self.begins, 0.0), stated if trigger == 0.0 else timed(stated, 0.0)
        spread = float(np.hypot(by_speed, trigger))
        # The onset is known to a sample: it tells of the two only where they move it by several.
        if self.moves_too_early or spread * self.recording.rate < SURE:
            return plain, False
        end = self.begins + SURE * spread if np.isfinite(spread) else float(stated.duration)
        expected = self._stated_onset(end)
        if not abs(expected - self.begins) <= SURE * spread:
            return plain, False
        late = self.begins - expected
        zero = late if np.isinf(trigger) else late * (trigger / spread) ** 2
        at_speed = stated.replaced({"speed": stated.speed * expected / (self.begins - zero)})
        return (at_speed if trigger == 0.0 else timed(at_speed, zero)), True

    def _uncertain_exit(self, known: bool) -> Exit | None:
        """Return the stretch in which the wheel leaves the deck; None if it does not in the recording.

        `known`: the onset, which is found to a sample, has determined how time zero follows from the speed.
        """
        track, speed, trigger = self.passage.track, float(self.passage.speed), self.site.trigger
        if track.start is None or track.length is None or (trigger == 0.0 and not known):
            return None
        trigger, share = np.inf if trigger is None else trigger, self.site.uncertainty.get("speed", 0.0)
        way = (float(track.start) + float(track.length)) / speed
        time = zero_of(self.passage) + way
        if known:
            share *= 1.0 if np.isinf(trigger) else trigger / float(np.hypot(share * self.begins, trigger))
            spread = float(np.hypot(share * abs(time - self.begins), time / self.begins / self.whole.rate))
        else:
            spread = float(np.hypot(share * way, trigger))
        half = max(min(SURE * spread, 0.5 * LEFT_OUT * self.whole.duration), SURE / self.whole.rate)
        inside = self.begins + half < time < self.whole.times[-1] - half
        return Exit(time - half, time + half, self.whole) if inside else None

    def _stated_onset(self, end: float) -> float:
        """Return when the deck moves in the stated passage, s after its time zero; infinite if not before `end`."""
        times = np.arange(1, int(max(end, 0.0) * self.recording.rate) + 2) / self.recording.rate
        found = values_of(self.stated.passage.replaced({"duration": float(times[-1])}), times)
        shown = np.empty(0) if found is None else self.site.sensor.filtered(found)
        loud = np.flatnonzero(np.abs(shown) > LOUD * self.noise)
        return float(times[loud[0]]) if len(loud) else np.inf

    @cached_property
    def passage_with_measured_load(self) -> Scenario:
        """The passage with the load that the flights show: in flight the acceleration of the deck is N0/M."""
        passage, times, until = self.passage, self.recording.times, self.after(FLIGHTS)
        if self.moves_too_early:
            return passage  # what moves the deck is no passage of the irregularity
        part = (times >= self.begins) & (times < until) & np.isfinite(self.recording.samples)
        early = times[times < until]
        stated = values_of(passage.replaced({"duration": until - zero_of(passage)}), early)
        load, weight = float(passage.vehicle.load), float(passage.vehicle.weight)
        lost = self.recording.clipped & (self.recording.samples > 0.0)
        if stated is None or load <= 0.0 or lost[part].mean() > 1.0 - PLATEAU / 100.0:
            return passage
        both = self.recording.samples[part], stated[part[: len(stated)]]
        levels = [np.percentile(values, PLATEAU) for values in both]
        ratio = float(np.clip(levels[0] / levels[1], 0.5, 2.0)) if levels[1] > 0.0 else 1.0
        return passage.replaced({LOAD: max(load + (ratio - 1.0) * weight, 0.2 * load)})

    @cached_property
    def quiet(self) -> float:
        """χ² per sample, at least, of the recording's beginning without a wheel on the deck, between one and WRONG."""
        beginning = self.recording.samples[self.recording.times < min(self.begins, self._entry(1.0))]
        beginning = beginning[np.isfinite(beginning)]
        if not len(beginning):
            return WRONG
        least = np.mean(beginning**2) / self.noise**2 / (1.0 + 2.0 * sqrt(2.0 / len(beginning)))
        return float(np.clip(least, 1.0, WRONG))

    def is_clear(self, fit: Fit | None) -> bool:
        """Return True if a fit leaves no more than noise; a neighbouring minimum, or a similar fault, leaves more."""
        return fit is not None and fit.reduced <= self.quiet * (1.0 + CLEARLY * sqrt(2.0 / max(fit.freedom, 1)))

    @property
    def is_explained(self) -> bool:
        """True if one of the fits explains the recording."""
        return self.best_fit is not None and self.best_fit.reduced <= EXPLAINED

    def fit_fault(self, fault: Fault, start: Scenario, begins: float, patient: bool = True) -> Fit:
        """Fit a fault from a starting model; keep the fit if it is the best one of this fault."""
        priors = priors_of(self.stated) | fault.believed(self.passage)
        found, name = fit_over_windows(self.fit_problem(start, priors), begins, patient), fault.name
        if name not in self.fits or found.evidence > self.fits[name].evidence:
            self.fits[name], self.evidence[name] = found, found.evidence
        return found


def _without(recording: Recording, part: Stretch | Exit | None) -> Recording:
    """Return a recording without the samples of a part of it."""
    if part is None:
        return recording
    lost = (recording.times >= part.start) & (recording.times <= part.end)
    samples, clipped = np.where(lost, np.nan, recording.samples), recording.clipped & ~lost
    return replace(recording, samples=samples, clipped=clipped)


def feels_load(passage: Scenario) -> bool:
    """Return True if the recording depends on the load: on a bilateral contact all is linear, and it does not."""
    return BILATERAL not in passage.needs


def faults_of(passage: Scenario, names: Sequence[str] | None = None) -> tuple[dict[str, Fault], dict[str, str]]:
    """Return the faults, by name, that a passage can have, and the reasons why it cannot have others.

    Without names all faults of the catalogue are taken. A fault that is named, but that the passage cannot have, is
    refused.
    """
    faults, left_out = {}, {}
    for name in CATALOGUE if names is None else as_list(names, "faults", "names of faults"):
        fault = fault_named(name)
        try:
            faulty = fault.passage(passage)
            run.choose(run.DIAGNOSE, faulty.needs)
            if fault.path == LOAD and not feels_load(passage):
                raise InputError("", LOAD, "a bilateral contact, on which motions are the same under any load", "")
        except InputError as error:
            if names is not None:
                raise InputError("", "faults", f"{name!r}: {error.found}", error.allowed) from error
            left_out[name] = error.found
        else:
            faults[name] = fault
    return faults, left_out
