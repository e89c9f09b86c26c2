"""Where a fit may start: how near a model is to a part of a recording, and until when it explains the recording."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.inference.fitting import INFLATED, STEPS, departure_sample, fit_window, rms, width_of
from wheeltapper.diagnosis.inference.problem import FitProblem

FloatArray = NDArray[np.float64]

NEAR = (1.98, 3.96, 7.2)
"""Ends of the windows, contact periods after the onset, in which a healthy wheelset is fitted to a recording that it
does not explain: up to the first, the second and the fifth impact at the example's site."""
LOOSELY = 2.0
"""Ratio of the noise that this fit assumes to the rms of the residual. It is above one so that the priors hold the
healthy wheelset although it does not explain the recording."""


def departs_at(problem: FitProblem, model: Scenario, since: float) -> float:
    """Return the time at which a recording departs from a model, s after the trigger; NaN if it never does."""
    times = problem.times
    found = problem.model_samples(model, len(times))
    if found is None:
        return since
    off = np.where(problem.there & ~problem.recording.clipped, found - problem.samples, 0.0)
    first = departure_sample(off, problem.noise, width_of(problem), int(np.searchsorted(times, since)))
    return float(times[first]) if first < len(times) else np.nan


def misfit(problem: FitProblem, model: Scenario, start: float, end: float, over: float = 0.0) -> float:
    """Return the mean squared difference between a model and the recording between two times.

    With `over` the difference is averaged before it is squared, by a Hann window of this length, s. It is
    infinite where nothing was recorded between them.
    """
    first, last = np.searchsorted(problem.times, [start, end]).tolist()
    last = min(max(last, first + 1), len(problem.times))
    found = problem.model_samples(model, last, first)
    if found is None:
        return np.inf
    off = (found - problem.samples[first:last])[problem.there[first:last]]
    width = min(round(over * problem.recording.rate), len(off))
    if width > 1:
        window = np.hanning(width + 2)
        off = np.convolve(off, window / window.sum(), mode="valid")
    return float((off**2).mean()) if len(off) else np.inf


def ranked(
    problem: FitProblem, models: Iterable[Scenario], start: float, end: float, over: float = 0.0
) -> list[Scenario]:
    """Return the models in the order of their `misfit` to the recording between two times, the best first."""
    off = {model: misfit(problem, model, start, end, over) for model in models}
    return [model for model in sorted(off, key=lambda one: off[one]) if np.isfinite(off[model])]


def near(problem: FitProblem, begins: float) -> tuple[FloatArray, int]:
    """Return coordinates at which a model is near the beginning of a recording that it does not explain.

    Also return the length of that beginning, as a number of samples.
    """
    at, count = np.zeros(len(problem.paths)), 0
    for window in NEAR:
        count = int(np.searchsorted(problem.times, begins + window * problem.scale.period))
        noise = LOOSELY * max(rms(problem.residuals(at, count)), INFLATED * problem.noise)
        at, _ = fit_window(problem, at, count, noise, STEPS)
    return at, count
