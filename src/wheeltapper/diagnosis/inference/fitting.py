"""Nonlinear least squares of an exact model on one recording, over windows that grow.

window  The present model is similar to the recording up to some time. The fit covers this window; then the window
        grows.
noise   The noise that is assumed in a window is at least the rms of the residual at its start. Far from the solution
        the priors therefore dominate, and near it the samples.
step    A step of Levenberg and Marquardt, from the QR factorisation of the Jacobian: its condition may reach 1e8. If a
        step reduced the sum of squares as predicted, the next one uses the same derivatives.

See docs/theory/diagnosis.rst, section 8.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.inference.problem import Exit, FitProblem, Prior, jumps_of
from wheeltapper.diagnosis.inference.timing import TIME_ZERO

FloatArray = NDArray[np.float64]
WINDOWS = (1.98, 2.88, 3.96, 5.4, 7.2, 9.9, 13.5, 18, 25.2, 36, 54, 81, 117, 180, 270, 396, 594, 900)
"""Ends of the fit windows, contact periods after the onset. The first one holds the push of the irregularity, the
flight and the first impact. Each is 1.3 to 1.6 times as long as the one before: so much less
an error of the shorter window's fit may bring model and recording out of step. The last window of a fit is the whole
recording."""
IN_STEP = 0.6
"""Model and recording are similar over a part of the recording if the rms of their difference is at most this share of
the rms of the recording, apart from noise. A window is extended as long as they are similar."""
INFLATED = 20.0
"""Largest ratio of the standard deviation of the noise that a fit assumes in a window to the true one. A larger assumed
noise gives the priors more weight while the model is far from the recording."""
SETTLED, NEAR = 0.05, 0.3
"""Length of the undamped step in standard deviations of the parameters, as the largest over all parameters. Below
SETTLED a fit has converged. In a window that is not the last one a fit may end already below NEAR."""
STEPS, HASTY_STEPS, LAST_STEPS = 6, 4, 30
"""Largest number of steps in a window: of a patient fit, of a hasty one, and in the last window. Failed trials count,
too; twice as many trials are allowed as steps."""
REACH = 0.5
"""Largest change of any coordinate in one step. Coordinates are logarithms: no parameter changes by more than a factor
of 1.65 at once."""
DAMPING = 1e-5
"""Levenberg–Marquardt damping of the first step in a window, for a Jacobian whose columns have the length one. It falls
by a factor of 0.03 after a success and grows by 30 after a failure."""
IDLE, WORTH = 6, 0.1
"""A fit ends if the sum of squares has not fallen by WORTH in IDLE trials, while the damping grew by 30 each time: the
derivatives are wrong there, for example where the end of a damper just reaches a stop."""
AS_FORETOLD = 0.03
"""A step uses the derivatives of the step before if that one reduced the sum of squares as predicted, up to this share
of the reduction. This saves computing them again."""
NEARLY = 0.9
"""The fit of a window that is not the last one ends if a step leaves more than this share of the sum of squares: it has
nearly stopped improving, and a longer window says more."""
AHEAD = 2
"""Number of windows over which model and recording are compared at first. Most models differ from the recording within
these, and the longer windows then need not be computed."""
BLOCK = 256
"""Rows in one block of the QR factorisation. Linear algebra libraries start no threads for such small blocks; threads
cost far more here than they save (decision 15)."""
HOLDS = 2.0
"""Largest χ² per sample, with the true noise, at which a model explains a window. It is looser than the limit for a
whole recording, because fits of windows need not have converged."""
PATIENCE = 2
"""How often in a patient fit a shorter window is tried after a long one was not explained. A hasty fit tries none."""
LONG, PROGRESS = 9.0, 0.02
"""A fit that has explained at least LONG contact periods after the onset, six impacts at the example's site, is near
the right minimum and is not given up at the next window. It goes on in short windows, each longer than the one before
by at least the share PROGRESS."""
DEPARTS, OVER = 5.0, 0.18
"""A model departs from the recording where the rms of their difference over OVER contact periods first exceeds DEPARTS
standard deviations of the noise. Within so short a part of an impact a difference has not changed its sign."""
STUCK = 0.9
"""The noise that is assumed in a window is lowered step by step to the true noise. If lowering it leaves more than this
share of the mean square of the residual, the fit is stuck, and the window is not explained."""


@dataclass(frozen=True)
class Fit:
    """Result of a fit.

    Attributes
    ----------
    paths, values, covariance
        The parameters, their values, and the covariance (parameters, parameters) of their logarithms, and of the time
        zero itself. If only the beginning of the recording is explained, the covariance is that of this part.
    chi_squared, misfit
        Sum of squared residuals over their variances, with the terms of the priors and without them. Infinite if the
        model cannot be computed.
    freedom
        Degrees of freedom: number of samples that are not missing, less the number of parameters without a prior.
    evidence
        Logarithm of the marginal likelihood of the model, by Laplace's approximation, up to a constant that all models
        share.
    converged, scenario
        Whether the fit has converged, and the best model.
    held
        Time up to which the model explains the recording, s after the trigger; infinite if it explains all of it.
    """

    paths: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    chi_squared: float
    misfit: float
    freedom: int
    evidence: float
    converged: bool
    scenario: Scenario
    held: float = np.inf

    @property
    def reduced(self) -> float:
        """χ² per degree of freedom."""
        return self.chi_squared / max(self.freedom, 1)


def fit_over_windows(problem: FitProblem, begins: float, patient: bool = True) -> Fit:
    """Fit a family of models to a recording whose fit windows begin at `begins`, s after the trigger.

    A family that does not explain a window explains no longer one either. The fit then ends with the last window that
    it explains, or goes on from there in short windows. A fit that is not patient ends earlier.
    """
    nowhere, exit = np.zeros(len(problem.paths)), problem.exit
    if exit is None or exit.start <= begins:
        return _fit_from(problem, nowhere, begins, begins, patient)
    before = problem.until(exit.start)
    fit = _fit_from(before, nowhere, begins, begins, patient)
    at = problem.coordinates_of(fit.values)
    if np.isfinite(fit.held):
        used = max(int(np.searchsorted(problem.times, fit.held)), _window_counts(problem, begins)[0])
        return fit_summary(problem, at, False, used, fit.held)
    problem = problem.with_exit(_exit_seen(problem, exit, at))
    at, _ = fit_window(problem, at, len(before.times), problem.noise, LAST_STEPS)
    return _fit_from(problem, at, begins, exit.start, patient)


def _exit_seen(problem: FitProblem, exit: Exit, at: FloatArray) -> tuple[float, float] | None:
    """Return when a recording shows the wheel to leave the deck, and the standard deviation of that time, s.

    From the exit on, a model whose deck has no end differs from the recording by (N0 - N)/M. Each time within the
    stretch of the exit is as likely as this makes the samples. None if the recording shows no exit there, or if the
    model is wrong from the start of that stretch.
    """
    model, times = problem.model_at(at), exit.whole.times
    first, last = np.searchsorted(times, [exit.start, exit.end]).tolist()
    longer = float(model.track.length) + 2.0 * float(model.speed) * (exit.end - exit.start)
    endless = problem.model_until(model.replaced({"track.length": longer}), last)
    found = problem.model_samples(endless, last, first)
    if found is None:
        return None
    off, jump = found - exit.whole.samples[first:last], jumps_of(endless, times[first:last])
    gone = np.where(np.isfinite(off) & ~exit.whole.clipped[first:last], jump * (jump - 2.0 * off), 0.0)
    misfit = np.append(np.cumsum(gone[::-1])[::-1], 0.0) / problem.noise**2  # of an exit before each sample
    best = int(np.argmin(misfit))
    if not 0 < best < len(off):
        return None
    weights = np.exp(-0.5 * (misfit - misfit[best]))
    places = np.arange(len(misfit)) - 0.5
    mean = float(np.average(places, weights=weights))
    spread = float(np.sqrt(np.average((places - mean) ** 2, weights=weights)))
    return float(times[first] + mean / exit.whole.rate), max(spread, 1.0) / exit.whole.rate


def _fit_from(problem: FitProblem, at: FloatArray, begins: float, known: float, patient: bool) -> Fit:
    """Fit over windows from some coordinates, which explain the recording up to the time `known`."""
    times, counts = problem.times, _window_counts(problem, begins)
    window, longest = sum(times[count - 1] < known for count in counts) - 1, len(counts)
    patience, careful = PATIENCE if patient else 0, False
    steps = STEPS if patient else HASTY_STEPS
    while window + 1 < len(counts):
        chosen, noise = _next_window(problem, at, counts[:longest], window)
        trial = _explaining_coordinates(problem, at, counts[chosen], noise, steps)
        if trial is not None:
            at, window, longest = trial, chosen, len(counts)
        elif chosen > window + 1 and patience:
            longest, patience = (window + 1 + chosen) // 2 + 1, patience - 1
            continue
        elif careful or window < 0 or times[counts[window] - 1] < begins + LONG * problem.scale.period:
            break
        else:
            careful = True
        if careful and window + 1 < len(counts):
            end = _small_step(problem, at, begins, counts[window], counts[window + 1])
            if end is None:
                break
            counts[window + 1 : window + 1] = [end] if end < counts[window + 1] else []
            longest = window + 2
    if window + 1 < len(counts):
        held = float(times[counts[window] - 1]) if window >= 0 else begins
        return fit_summary(problem, at, False, counts[max(window, 0)], held)
    at, converged = fit_window(problem, at, counts[-1], problem.noise, LAST_STEPS)
    return fit_summary(problem, at, converged, counts[-1])


def _small_step(problem: FitProblem, at: FloatArray, begins: float, first: int, last: int) -> int | None:
    """Return the end of the next short window, as a number of samples, after the `first` samples, which are explained.

    It lies where the model departs from the recording, or a little beyond. None if the model cannot be computed.
    """
    found = problem.residuals(at, last)
    if found is None:
        return None
    held = float(problem.times[first - 1]) - begins
    least = min(int(np.searchsorted(problem.times, begins + (1.0 + PROGRESS) * held)), last)
    return max(departure_sample(found, problem.noise, width_of(problem), first), least)


def _are_similar(problem: FitProblem, found: FloatArray, first: int, last: int) -> bool:
    """Return True if the residuals between two samples are small against the recording."""
    off, loud = (float((values[first:last] ** 2).sum()) for values in (found, problem.samples * problem.there))
    return off <= IN_STEP**2 * loud + 4.0 * problem.noise**2 * (last - first)


def width_of(problem: FitProblem) -> int:
    """Return the number of samples over which a difference is compared with noise."""
    return max(round(OVER * problem.scale.period * problem.recording.rate), 1)


def departure_sample(off: FloatArray, noise: float, width: int, first: int) -> int:
    """Return the first sample, from `first` on, at which a difference exceeds noise; their number if none does."""
    total = np.concatenate([[0.0], np.cumsum(off**2)])
    loud = np.flatnonzero((total[width:] - total[:-width])[first:] > width * (DEPARTS * noise) ** 2)
    if not len(loud):
        return len(off)
    start = first + int(loud[0])
    beyond = np.flatnonzero(np.abs(off[start : start + width]) > DEPARTS * noise)
    return start + (int(beyond[0]) if len(beyond) else 0)


def keeps_step(problem: FitProblem, begins: float) -> bool:
    """Return True if the starting model is similar to the whole recording."""
    counts = _window_counts(problem, begins)
    return _next_window(problem, np.zeros(len(problem.paths)), counts, -1)[0] == len(counts) - 1


def _window_counts(problem: FitProblem, begins: float) -> list[int]:
    """Return the number of samples in each window that has any; the last window has all."""
    times, ends = problem.times, [begins + window * problem.scale.period for window in WINDOWS]
    ends = [end for end in ends if times[0] < end < times[-1]]
    return [*dict.fromkeys(int(np.searchsorted(times, end)) for end in ends), len(times)]


def _explaining_coordinates(
    problem: FitProblem, at: FloatArray, count: int, noise: float, steps: int
) -> FloatArray | None:
    """Return coordinates with which the model explains a window; None if it does not explain it."""
    before = np.inf
    while True:
        at, _ = fit_window(problem, at, count, noise, steps)
        found = problem.residuals(at, count)
        if found is None:
            return None
        left = float((found**2).mean())
        if left <= HOLDS * problem.noise**2:
            return at
        if noise == problem.noise or left > noise**2 or left > STUCK * before:
            return None
        noise, before = max(problem.noise, 0.1 * noise), left


def _next_window(problem: FitProblem, at: FloatArray, counts: list[int], window: int) -> tuple[int, float]:
    """Return the longest next window in which the model is similar to the recording, and its assumed noise."""
    first = window + 1
    chosen, noise = _in_step(problem, at, counts[: first + AHEAD], window)
    if first + AHEAD < len(counts) and chosen == first + AHEAD - 1:
        return _in_step(problem, at, counts, window)
    return chosen, noise


def rms(residual: FloatArray | None) -> float:
    """Return the root of the mean square; zero for None."""
    return 0.0 if residual is None else float(np.sqrt((residual**2).mean()))


def _in_step(problem: FitProblem, at: FloatArray, counts: list[int], window: int) -> tuple[int, float]:
    """Return the longest of these windows in which the model is similar to the recording, and its assumed noise."""
    found = problem.residuals(at, counts[-1])
    first = window + 1
    if found is None:
        return first, problem.noise * INFLATED
    chosen = first
    before = counts[window] if window >= 0 else 0
    for number in range(first, len(counts)):
        if not _are_similar(problem, found, before, counts[number]):
            break
        chosen, before = number, counts[number]
    spread = rms(found[: counts[chosen]])
    return chosen, float(np.clip(spread, problem.noise, INFLATED * problem.noise))


class _LinearStep(NamedTuple):
    """A linearised problem: R of the scaled Jacobian, target, Jacobian, residual, scales, standard deviations."""

    factor: FloatArray
    target: FloatArray
    jacobian: FloatArray
    residual: FloatArray
    size: FloatArray
    deviation: FloatArray  # of the scaled coordinates

    @staticmethod
    def linearised_at(residual: FloatArray, jacobian: FloatArray) -> _LinearStep:
        size = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
        many = jacobian.shape[1]
        triangle = triangle_of(np.column_stack([jacobian / size, residual]))
        factor = triangle[:many, :many]
        return _LinearStep(
            factor, -triangle[:many, -1], jacobian, residual, size, np.sqrt(np.diag(_inverse_of_square(factor)))
        )

    def damped_step(self, target: FloatArray, damping: float) -> FloatArray:
        """Return the damped step towards a target, in scaled coordinates."""
        many = len(self.size)
        rows = np.vstack([self.factor, np.sqrt(damping) * np.eye(many)])
        return np.asarray(np.linalg.lstsq(rows, np.append(target, np.zeros(many)), rcond=None)[0])

    def step_in_deviations(self) -> float:
        """Return the largest ratio, over the coordinates, of the undamped step to the standard deviation."""
        return float(np.max(np.abs(self.damped_step(self.target, 0.0)) / self.deviation))

    def geodesic_step(self, step: FloatArray, there: FloatArray, damping: float) -> FloatArray:
        """Return a step with geodesic acceleration, from the residuals at the end of the straight step."""
        return np.asarray(
            step - self.damped_step(self._projected_residual(there - self._predicted_residual(step)), damping)
        )

    def _predicted_residual(self, step: FloatArray) -> FloatArray:
        return np.asarray(self.residual + self.jacobian @ (step / self.size))

    def _projected_residual(self, residual: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.lstsq(self.factor.T, (self.jacobian / self.size).T @ residual, rcond=None)[0])

    def is_as_predicted(self, step: FloatArray, there: FloatArray) -> bool:
        """Return True if a step has reduced the sum of squares as the linear model predicts."""
        before, foretold = (float(residual @ residual) for residual in (self.residual, self._predicted_residual(step)))
        return abs(float(there @ there) - foretold) <= AS_FORETOLD * (before - foretold)

    def with_residual(self, residual: FloatArray) -> _LinearStep:
        """Return the same linearisation at other residuals."""
        return self._replace(residual=residual, target=-self._projected_residual(residual))


def fit_window(problem: FitProblem, at: FloatArray, count: int, noise: float, steps: int) -> tuple[FloatArray, bool]:
    """Return the coordinates of least squares over one window, and whether the fit has converged.

    With fewer steps than LAST_STEPS it also ends near the minimum, or when the sum of squares hardly falls any more.
    """
    if not len(at):
        return at, True  # there is no parameter
    residual, damping, tries = problem.weighted_residuals(at, count, noise), DAMPING, 2 * steps
    linear, held = None, False  # held: the derivatives are those from the start of the last step
    level, idle = np.inf, 0
    while tries > 0 and idle < IDLE and residual is not None:
        linear = linear or _linearised_problem(problem, at, residual, count, noise)
        if linear is None:
            return at, False
        idle = 0 if level - residual @ residual > WORTH else idle + 1
        level = float(residual @ residual) if not idle else level
        before, step = float(residual @ residual), linear.damped_step(linear.target, damping)
        far = linear.step_in_deviations()
        settled = far < SETTLED
        tries -= 1
        trial, there = _trial_of(problem, at, step / linear.size, count, noise)
        if there is not None and there @ there > before and not settled and not held:
            tries -= 1
            bent = linear.geodesic_step(step, there, damping)
            trial, there = _trial_of(problem, at, bent / linear.size, count, noise)
        if there is not None and there @ there <= before:
            at, residual, damping = trial, there, max(0.03 * damping, 1e-12)
            if settled or (steps < LAST_STEPS and (far < NEAR or there @ there > NEARLY * before)):
                return at, settled
            held = linear.is_as_predicted(step, there)
            linear = linear.with_residual(there) if held else None
        elif held:
            linear, held = None, False
        elif settled:
            return at, True
        else:
            damping *= 30.0
    return at, False


def _linearised_problem(
    problem: FitProblem, at: FloatArray, residual: FloatArray, count: int, noise: float
) -> _LinearStep | None:
    """Return a problem linearised at some coordinates; None if it has no derivatives there."""
    jacobian = problem.jacobian(at, count, noise)
    linear = None if jacobian is None else _LinearStep.linearised_at(residual, jacobian)
    return linear if linear is not None and np.all(np.isfinite(linear.factor)) else None


def _trial_of(
    problem: FitProblem, at: FloatArray, step: FloatArray, count: int, noise: float
) -> tuple[FloatArray, FloatArray | None]:
    """Return the coordinates at the end of a step, and the residuals there."""
    trial = problem.within_bounds(at + np.clip(step, -REACH, REACH))
    return trial, problem.weighted_residuals(trial, count, noise)


def triangle_of(matrix: FloatArray) -> FloatArray:
    """Return R of the QR factorisation of a tall matrix, block by block, because small blocks start no threads."""
    rows, columns = matrix.shape
    blocks = max(-(-rows // BLOCK), 1)
    padded = np.zeros((blocks * BLOCK, columns))
    padded[:rows] = matrix
    each = np.linalg.qr(padded.reshape(blocks, BLOCK, columns), mode="r")
    return np.asarray(np.linalg.qr(np.asarray(each).reshape(-1, columns), mode="r"))


def _inverse_of_square(factor: FloatArray) -> FloatArray:
    """Return the inverse of RᵀR, from the singular values of R."""
    if not np.all(np.isfinite(factor)):
        return np.full(factor.shape, np.inf)
    _, singular, rows = np.linalg.svd(factor)
    scaled = rows.T / np.maximum(singular, 1e-14 * singular[0])
    return np.asarray(scaled @ scaled.T)


def covariance_of(jacobian: FloatArray) -> FloatArray:
    """Return the inverse of JᵀJ."""
    if not jacobian.shape[1]:
        return np.empty((0, 0))
    size = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # one without effect has infinite variance
        return np.asarray(_inverse_of_square(triangle_of(jacobian / size)) / np.outer(size, size))


def fit_summary(problem: FitProblem, at: FloatArray, converged: bool, used: int, held: float = np.inf) -> Fit:
    """Return the result of a fit at some coordinates, to which the first `used` samples have led."""
    many, count = len(problem.paths), len(problem.times)
    residual, jacobian = problem.weighted_residuals(at, count, problem.noise), problem.jacobian(at, used, problem.noise)
    freedom = int(problem.there.sum()) - sum(prior.is_flat for prior in problem.priors)
    if residual is None or jacobian is None:
        nothing = np.full((many, many), np.inf)
        return Fit(
            problem.paths, problem.first, nothing, np.inf, np.inf, freedom, -np.inf, False, problem.start
        )  # fmt: skip
    covariance = covariance_of(jacobian)
    total = float((residual**2).sum())
    evidence = -0.5 * total + _of_priors(problem.priors)
    if np.all(np.isfinite(covariance)):
        evidence += 0.5 * float(np.linalg.slogdet(2.0 * np.pi * covariance)[1])
    misfit = float((residual[:count] ** 2).sum())
    values = problem.parameter_values(at)
    with np.errstate(divide="ignore"):
        per = np.where(problem.linear, problem.widths / values, 1.0)
        per = np.where([path == TIME_ZERO for path in problem.paths], problem.widths, per)
    return Fit(
        problem.paths, values, covariance * np.outer(per, per), total, misfit, freedom, evidence, converged,
        problem.model_at(at), held,
    )  # fmt: skip


def _of_priors(priors: tuple[Prior, ...]) -> float:
    """Return the logarithm of the largest values of the prior densities over the coordinates."""
    total = 0.0
    for prior in priors:
        if prior.kind == "uniform":
            total -= np.log(2.0)
        elif prior.kind == "shift":
            total -= 0.0 if prior.is_flat else np.log(np.sqrt(2.0 * np.pi))
        elif prior.kind != "flat":
            total -= np.log(np.sqrt(2.0 * np.pi) * prior.deviation)
    return float(total)
