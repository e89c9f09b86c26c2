"""One recording against one family of models: priors, residuals, and derivatives of the residuals."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.motion import motion_at
from wheeltapper.ask.trajectory import is_derivable, trajectory
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.sensor.deck_acceleration import DeckAcceleration
from wheeltapper.diagnosis.inference.timing import TIME_ZERO, TimedPassage, timed, zero_of
from wheeltapper.diagnosis.scale import Scale
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.shown import page_of, picture_of
from wheeltapper.lower.fields import Fields
from wheeltapper.march.common import program as contract
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]
SURE = 3.5
"""Largest deviation of the speed from the stated one, and of time zero from the trigger, that is considered plausible,
in standard deviations; it is exceeded once in 2000 passages."""
FARTHEST = 4.0
"""Standard deviations of a lognormal prior beyond which a parameter is not sought. A fault's size would run to where
nothing shows it any more, and a bush would become so stiff that its motion is slow to compute."""
FORGOTTEN = 20.0
"""Periods of the cutoff frequency. Samples are computed from this long before the first one wanted; the initial state
of the sensor's filter then has no effect."""
DIFFERENCE, BETWEEN = 3e-7, ("vehicle.damper_play_start",)
"""Relative step of difference quotients, for motions without exact derivatives. In the fields BETWEEN, whose values lie
between -1 and 1, the step is absolute and points towards zero, so that it stays within these bounds. That of the time
zero is taken of the end of the recording: it moves that end as far as the same step of the speed."""


class Prior(NamedTuple):
    """Prior distribution of a parameter.

    normal: centre and relative standard deviation. lognormal: centre and standard deviation of the logarithm. uniform:
    between centre - deviation and centre + deviation. shift: centre and standard deviation of the value itself;
    infinite where nothing is known. flat: the parameter is positive, and nothing else is known.
    """

    centre: float
    deviation: float = np.inf
    kind: Literal["flat", "normal", "lognormal", "uniform", "shift"] = "flat"

    def plot(self, path: Any = None, **options: Any) -> Any:
        """Return its picture, as `Shown` has it; a named tuple has no other base."""
        return picture_of(self, path, **options)

    def _repr_html_(self) -> str:
        return page_of(self)

    @property
    def is_flat(self) -> bool:
        """Whether it says nothing, so that the parameter costs a degree of freedom."""
        return self.kind == "flat" or (self.kind == "shift" and not isfinite(self.deviation))


class Exit(NamedTuple):
    """When the wheel leaves the deck: a stretch, s after the trigger, and the whole recording.

    The samples of that stretch do not count: the acceleration jumps somewhere in it, and a fit cannot follow a jump.
    `seen`: the time at which the recording shows the jump, and its standard deviation, s; None if it was not looked
    for, or not found.
    """

    start: float
    end: float
    whole: Recording
    seen: tuple[float, float] | None = None


def number_at(scenario: Scenario, path: str) -> float:
    """Return the number at a path; refuse a path without one."""
    try:
        value = Fields(scenario)(path)
    except (AttributeError, IndexError, TypeError, ValueError):
        scenario.replaced({path: None})  # its message names the fields that exist
        value = None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError("", path, "no number there", "paths of fields that hold a number")
    return float(value)


def values_of(scenario: Scenario, times: FloatArray) -> FloatArray | None:
    """Return the deck's acceleration at some times after the trigger, m/s²; None if the model cannot be computed.

    Before the passage's time zero the deck is at rest.
    """
    own, begun = _own_times(scenario, times)
    if begun == len(times):
        return np.zeros(len(times))
    try:
        with np.errstate(invalid="ignore"):  # a trial may ask for a contact beyond the radius of the wheel
            found = motion_at(scenario, own)
    except (InputError, ValueError):
        return None
    return _if_complete(found.status, np.concatenate([np.zeros(begun), found.deck_acceleration]))


def _own_times(scenario: Scenario, times: FloatArray) -> tuple[FloatArray, int]:
    """Return the times after the passage's time zero, by its own clock, and the number of those before it."""
    own = times - zero_of(scenario)
    begun = int(np.searchsorted(own, 0.0))
    return own[begun:], begun


def jumps_of(scenario: Scenario, times: FloatArray) -> FloatArray:
    """Return by how much the deck's acceleration falls if the wheel leaves it at some times, m/s²: (N0 - N)/M."""
    own, begun = _own_times(scenario, times)
    force = np.concatenate([np.full(begun, np.nan), motion_at(scenario, own).force])
    return np.asarray((float(scenario.vehicle.weight) - force) / float(scenario.track.mass))


def slopes_of(scenario: Scenario, paths: tuple[str, ...], times: FloatArray) -> FloatArray | None:
    """Return the derivatives (parameters, times) of the deck's acceleration; None if the model cannot be computed.

    They are exact if the motion has exact derivatives. Otherwise they are difference quotients: for a damper whose end
    can move, and for a plastic contact.
    """
    if not is_derivable(scenario):
        return _difference_quotients(scenario, paths, times)
    (own, begun), out = _own_times(scenario, times), np.zeros((len(paths), len(times)))
    fields = tuple(path for path in paths if path != TIME_ZERO)
    if begun == len(times):
        return out
    try:
        with np.errstate(invalid="ignore"):
            found = trajectory(scenario, fields, own)
    except (InputError, ValueError):
        return None
    if _if_complete(found.status, found.deck_acceleration) is None:
        return None
    slopes = dict(zip(fields, found.of_deck_acceleration, strict=True)) | {TIME_ZERO: -found.deck_jerk}
    for row, path in zip(out, paths, strict=True):
        row[begun:] = slopes[path]
    return out


def _difference_quotients(scenario: Scenario, paths: tuple[str, ...], times: FloatArray) -> FloatArray | None:
    here, out = values_of(scenario, times), np.empty((len(paths), len(times)))
    for row, path in zip(out, paths, strict=True):
        value = float(Fields(scenario)(path))
        size = float(times[-1]) if path == TIME_ZERO else abs(value)
        step = DIFFERENCE * (size if path not in BETWEEN else -1.0 if value > 0.0 else 1.0)
        there = values_of(scenario.replaced({path: value + step}), times)
        if here is None or there is None:
            return None
        row[:] = (there - here) / step
    return out


def _if_complete(status: int, acceleration: FloatArray) -> FloatArray | None:
    there = status in (contract.DONE, contract.ENOUGH) and bool(np.all(np.isfinite(acceleration)))
    return acceleration if there else None


class FitProblem:
    """The residuals of one recording against one family of models, and their derivatives by the coordinates.

    Parameters
    ----------
    recording, sensor, noise
        The samples, the sensor that recorded them, and the standard deviation of their noise, m/s².
    start
        The model to start from.
    priors
        The parameters and their priors, by path.
    scale
        In which windows are measured; by default that of the model to start from.
    exit
        Where the wheel leaves the deck at an uncertain time; that it is seen in the recording is one more datum.
    """

    def __init__(
        self, recording: Recording, sensor: DeckAcceleration, noise: float, start: Scenario,
        priors: Mapping[str, Prior], scale: Scale | None = None, exit: Exit | None = None,
    ) -> None:  # fmt: skip
        self.scale, self.exit = scale or Scale(start), exit
        if TIME_ZERO in priors and not isinstance(start, TimedPassage):
            start = timed(start, 0.0)
        self.recording, self.sensor, self.noise, self.start = recording, sensor, noise, start
        self.paths, self.priors = tuple(priors), tuple(priors.values())
        self.first = np.array([float(Fields(start)(path)) for path in self.paths])
        self.linear = np.array([prior.kind in ("uniform", "shift") for prior in self.priors], dtype=bool)
        self.bounded = np.array([prior.kind == "uniform" for prior in self.priors], dtype=bool)
        far = [FARTHEST * prior.deviation if prior.kind == "lognormal" else 0.0 for prior in self.priors]
        self.reach = np.where(self.bounded, 1.0, far)
        widths = [prior.deviation if isfinite(prior.deviation) else self.scale.period for prior in self.priors]
        self.widths = np.where(self.linear, widths, 1.0)
        if np.any((self.first <= 0.0) & ~self.linear):
            path = self.paths[int(np.argmax((self.first <= 0.0) & ~self.linear))]
            raise InputError("", path, f"{float(Fields(start)(path)):g}", "a positive value to start from")
        self.times = recording.times
        self.samples = np.nan_to_num(recording.samples)
        self.there = np.isfinite(recording.samples)
        self._model: tuple[FloatArray, Scenario] | None = None
        self._residuals: tuple[FloatArray, FloatArray, NDArray[np.bool_]] | None = None  # third: which count
        self._slopes: tuple[FloatArray, FloatArray] | None = None

    def with_exit(self, seen: tuple[float, float] | None) -> FitProblem:
        """Return the same problem with the time at which the wheel is seen to leave the deck, and its deviation, s."""
        priors, exit = dict(zip(self.paths, self.priors, strict=True)), self.exit
        known = None if exit is None else exit._replace(seen=seen)
        return FitProblem(self.recording, self.sensor, self.noise, self.start, priors, self.scale, known)

    def from_model(self, start: Scenario) -> FitProblem:
        """Return the same problem with another model to start from."""
        priors = dict(zip(self.paths, self.priors, strict=True))
        return FitProblem(self.recording, self.sensor, self.noise, start, priors, self.scale, self.exit)

    def until(self, time: float) -> FitProblem:
        """Return the same problem with the recording up to a time only, s after the trigger."""
        part, priors = self.recording.until(time), dict(zip(self.paths, self.priors, strict=True))
        return FitProblem(part, self.sensor, self.noise, self.start, priors, self.scale)

    def parameter_values(self, at: FloatArray) -> FloatArray:
        """Return the values of the parameters at some coordinates, which are zero at the start."""
        near = np.where(self.linear, 0.0, at)
        return np.asarray(np.where(self.linear, self.first + self.widths * at, self.first * np.exp(near)))

    def coordinates_of(self, values: FloatArray) -> FloatArray:
        """Return the coordinates of some values of the parameters."""
        ratio = np.where(self.linear, 1.0, values / np.where(self.linear, 1.0, self.first))
        return np.asarray(np.where(self.linear, (values - self.first) / self.widths, np.log(ratio)))

    def model_at(self, at: FloatArray) -> Scenario:
        """Return the model at some coordinates."""
        if self._model is None or not np.array_equal(self._model[0], at):
            values = dict(zip(self.paths, self.parameter_values(at).tolist(), strict=True))
            self._model = at.copy(), self.start.replaced(values)
        return self._model[1]

    def within_bounds(self, at: FloatArray) -> FloatArray:
        """Return the nearest coordinates that uniform and lognormal priors allow."""
        centre = np.array([prior.centre for prior in self.priors])
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = np.where(self.bounded, (centre - self.first) / self.widths, np.log(centre / self.first))
        return np.where(self.reach > 0.0, np.clip(at, middle - self.reach, middle + self.reach), at)

    def model_samples(self, model: Scenario, count: int, first: int = 0) -> FloatArray | None:
        """Return the samples from `first` to before `count` that a model gives; None if it cannot be computed."""
        if not count:
            return np.empty(0)
        begin = max(first - int(FORGOTTEN * self.recording.rate / (self.sensor.cutoff or np.inf)), 0)
        times = self.times[begin:count]
        found = values_of(self.model_until(model, count), times)
        return None if found is None else self.sensor.drifted(self.sensor.filtered(found), times)[first - begin :]

    def residuals(self, at: FloatArray, count: int) -> FloatArray | None:
        """Return model less recording for the first `count` samples, m/s²; None if the model cannot be computed."""
        if self._residuals is None or _is_outdated(*self._residuals[:2], at, count):
            model = self._model_or_none(at)
            found = None if model is None else self.model_samples(model, count)
            if found is None:
                return None
            off, samples = found - self.samples[:count], self.samples[:count]
            beyond = self.recording.clipped[:count] & (off * np.sign(samples) > 0.0)
            counts = self.there[:count] & ~beyond  # a clipped sample is only a bound
            self._residuals = at.copy(), np.where(counts, off, 0.0), counts
        return self._residuals[1][:count]

    def residual_slopes(self, at: FloatArray, count: int) -> FloatArray | None:
        """Return the derivatives (samples, parameters) of the residuals; None if the model cannot be computed."""
        if not count:
            return np.empty((0, len(self.paths)))
        if self.residuals(at, count) is None:
            return None
        assert self._residuals is not None
        if self._slopes is None or _is_outdated(*self._slopes, at, count):
            found = slopes_of(self.model_until(self.model_at(at), count), self.paths, self.times[:count])
            if found is None:
                return None
            per = np.where(self.linear, self.widths, self.parameter_values(at))
            shown = np.array([self.sensor.filtered(row) for row in found]).reshape(len(per), count)
            self._slopes = at.copy(), np.where(self._residuals[2][:count], shown * per[:, None], 0.0).T
        return self._slopes[1][:count]

    def _model_or_none(self, at: FloatArray) -> Scenario | None:
        try:
            return self.model_at(at)
        except (InputError, ValueError):
            return None

    def model_until(self, model: Scenario, count: int) -> Scenario:
        """Return a model that ends with the first `count` samples."""
        end = float(self.times[count - 1]) - zero_of(model)
        return model.replaced({"duration": max(end, 0.0) + 0.5 / self.recording.rate})

    def prior_residuals(self, at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the scaled deviations of the parameters from the centres of their priors, and derivatives."""
        out, slopes = [], []
        values = zip(self.priors, self.parameter_values(at).tolist(), self.widths.tolist(), strict=True)
        for prior, value, width in values:
            if prior.kind == "normal":
                out.append((value / prior.centre - 1.0) / prior.deviation)
                slopes.append(value / prior.centre / prior.deviation)
            elif prior.kind == "lognormal":
                out.append(np.log(value / prior.centre) / prior.deviation)
                slopes.append(1.0 / prior.deviation)
            elif prior.kind == "shift":
                out.append((value - prior.centre) / prior.deviation)
                slopes.append(width / prior.deviation)
            else:
                out.append(0.0)
                slopes.append(0.0)
        if self.exit is None or self.exit.seen is None:
            return np.array(out), np.diag(slopes)
        late, slope = self._exit_residual(at, *self.exit.seen)
        return np.append(out, late), np.vstack([np.diag(slopes), slope])

    def _exit_residual(self, at: FloatArray, seen: float, deviation: float) -> tuple[float, FloatArray]:
        """Return by how many standard deviations the model leaves the deck late, and the derivatives."""
        model = self.model_at(at)
        ends = {"track.start": float(model.track.start), "track.length": float(model.track.length)}
        speed, place, slope = float(model.speed), sum(ends.values()), np.zeros(len(self.paths))
        for i, path in enumerate(self.paths):
            if path == TIME_ZERO:
                slope[i] = self.widths[i]
            elif path == "speed":
                slope[i] = -place / speed
            elif path in ends:
                slope[i] = ends[path] / speed
        return (zero_of(model) + place / speed - seen) / deviation, slope / deviation

    def weighted_residuals(self, at: FloatArray, count: int, noise: float) -> FloatArray | None:
        """Return all residuals over their standard deviations: those of the samples, then those of the priors."""
        found = self.residuals(at, count)
        return None if found is None else np.concatenate([found / noise, self.prior_residuals(at)[0]])

    def jacobian(self, at: FloatArray, count: int, noise: float) -> FloatArray | None:
        """Return the derivatives of the weighted residuals."""
        found = self.residual_slopes(at, count)
        return None if found is None else np.vstack([found / noise, self.prior_residuals(at)[1]])


def _is_outdated(known_at: FloatArray, known: FloatArray, at: FloatArray, count: int) -> bool:
    return len(known) < count or not np.array_equal(known_at, at)
