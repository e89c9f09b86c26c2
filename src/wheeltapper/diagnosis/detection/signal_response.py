"""Probability of detection from signals: regression on size, and the probability of exceeding a threshold.

log y (or y) = b0 + b1·t + τ·ε,  ε normal;   POD = c·Φ((t - μ)/σ),  μ = (y_dec - b0)/b1,  σ = τ/b1
"""

from __future__ import annotations

from math import log
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.diagnosis.detection.detection import (
    Bounds,
    Detection,
    Scale,
    as_ceiling,
    detection_of,
    on_scale,
    standardised_sizes,
)
from wheeltapper.diagnosis.detection.fit import DetectionFit, likeliest_peak
from wheeltapper.diagnosis.detection.likelihood import FloatArray, Likelihood, Peak
from wheeltapper.diagnosis.detection.roc import finite_samples
from wheeltapper.ground.arguments import as_between, check_choice, check_flag
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.quantities import to_si

BoolArray = NDArray[np.bool_]

FEWEST = 3
"""Smallest number of signals that are not censored. The regression has three parameters; with fewer signals it is
refused."""
SAME = 1e-9
"""If the sizes of all uncensored signals differ by less than this many standard deviations of all sizes, they count as
equal, and the regression is refused."""
EXACT = 1e-9
"""Smallest standard deviation of the signals about their line, over their standard deviation. With less, the signals
have no scatter, and the regression is refused."""


def signal_response(
    sizes: ArrayLike, signals: ArrayLike, threshold: float, *, floor: float | None = None,
    saturation: float | None = None, scale: Scale = "log", signal_scale: Scale = "log",
    ceiling: float | None = 1.0, seen_only: bool = False, bounds: Bounds | None = None,
) -> Detection:  # fmt: skip
    """Return the probability of detection from signals.

    The method is that of MIL-HDBK-1823A, appendix G, on "â against a": linear regression by maximum likelihood, with
    signals below the floor and beyond saturation censored (Tobit), then μ and σ of the curve and their covariance by
    the delta method. The standard deviation τ is that of maximum likelihood, not corrected for the number of
    coefficients.

    With a ceiling below one, an unseen fault gives a signal below the floor. Such a signal has the probability 1 - c +
    c·Φ(...).

    Parameters
    ----------
    sizes
        Sizes of the faults, one per inspection, (n,), any unit.
    signals
        Signal of the detector for each fault, (n,), any unit.
    threshold
        Smallest signal that is called a fault.
    floor, saturation
        Signals at or below the floor, and at or beyond saturation, are censored.
    scale, signal_scale
        "log" (natural logarithm) or "linear": the scales on which the relation is a straight line with uniform scatter.
    ceiling
        Probability that a fault is seen at all. None: it is estimated.
    seen_only
        Whether the data contain only faults that were seen. The given ceiling then does not enter the regression, and
        multiplies the curve.
    bounds
        "wald": bound of the index (b0 + b1·t - y_dec)/τ, with the observed information; a90/95 is the size at which it
        reaches 0.9. "delta": the handbook's bound of the size μ + σ·z. "likelihood ratio". By default Wald's for a
        given ceiling, else the likelihood ratio. Of 100 signals with 30 % censored, a90/95 lay above the true a90 in 94
        % of replicates by Wald's and the likelihood ratio and in 92 % by the delta method.

    Raises
    ------
    InputError
        If lengths differ, a value is not finite, a size, or a signal between the limits, is not positive on a log
        scale, all sizes are equal, fewer than three signals lie between the limits, or these are of one size or on a
        line without scatter, the threshold is beyond a limit, or the data do not suffice for a ceiling.
    """
    for name, value in (("scale", scale), ("signal_scale", signal_scale)):
        check_choice(value, name, ("log", "linear"))
    check_flag(seen_only, "seen_only")
    ceiling = as_ceiling(ceiling, bounds)
    threshold = to_si(threshold, "number", "threshold")
    floor = None if floor is None else to_si(floor, "number", "floor")
    saturation = None if saturation is None else to_si(saturation, "number", "saturation")
    _check_ceiling(ceiling, floor, seen_only)
    x, centre, width = standardised_sizes(sizes, scale)
    y, below, beyond, decided = _censored_signals(signals, threshold, floor, saturation, signal_scale)
    if len(y) != len(x):
        raise InputError("", "signals", f"{len(y)} signals", f"{len(x)}, one for each size")
    known = ~(below | beyond)
    if known.sum() < FEWEST:
        raise InputError("", "signals", f"{int(known.sum())} between the limits", f"at least {FEWEST}; or use hit_miss")
    if np.ptp(x[known]) < SAME:
        raise InputError("", "signals", "those between the limits of one size only", "two sizes; or use hit_miss")
    middle, spread = float(y[known].mean()), float(y[known].std())
    start = _line_start(x[known], (y[known] - middle) / max(spread, 1e-300), spread)
    rows = np.column_stack([np.ones(len(x)), x, (middle - y) / spread])
    likelihood = Likelihood("probit", rows[beyond], rows[below], rows[known])
    inner = likeliest_peak(likelihood, start, x, 1.0 if seen_only else ceiling)
    most = ceiling if seen_only and ceiling is not None else inner.ceiling
    tail = np.array([(middle - decided) / spread])
    fit = DetectionFit(likelihood, inner, tail, centre, width, x, most, ceiling is None, seen_only)
    coefficients, by_theta = _coefficients_of(inner, centre, width, middle, spread)
    return detection_of(
        fit, kind="signal response", scale=scale, threshold=threshold, coefficients=coefficients,
        by_theta=by_theta, log_likelihood=inner.value - int(known.sum()) * log(spread), bounds=bounds, note="",
    )  # fmt: skip


def noise_threshold(
    noise: ArrayLike, false_call_rate: float, *, method: Literal["gaussian", "exact"] = "gaussian",
    scale: Scale = "linear", level: float | None = None,
) -> float:  # fmt: skip
    """Return the threshold that healthy wheels exceed with a given probability.

    MIL-HDBK-1823A, appendix G, on noise: the threshold follows from signals of inspections without a fault.

    Parameters
    ----------
    noise
        Signals of healthy wheels, (n,).
    false_call_rate
        Probability that another healthy wheel reaches the threshold.
    method
        "gaussian": from mean and standard deviation of the noise, on its scale. "exact": just beyond one of the
        signals, for any distribution.
    scale
        Scale of the gaussian method: "linear", or "log" if the logarithm of the noise is normal.
    level
        Confidence level: probability that the true rate is at most the given one. By default the threshold is an
        estimate. For "gaussian" it is the quantile of the normal distribution. For "exact" it is the signal that
        another healthy wheel exceeds with at most the given probability, on average.

    Raises
    ------
    InputError
        If values are not finite, too few for the rate, or not positive on a log scale.
    """
    check_choice(method, "method", ("gaussian", "exact"))
    check_choice(scale, "scale", ("log", "linear"))
    false_call_rate = as_between(false_call_rate, "false_call_rate", 0.0, 1.0)
    level = None if level is None else as_between(level, "level", 0.0, 1.0)
    found = finite_samples(noise, "noise")
    if method == "exact":
        return _exact_threshold(np.sort(found), false_call_rate, level)
    value = _gaussian_threshold(on_scale(found, scale, "noise"), false_call_rate, level)
    return float(np.exp(value)) if scale == "log" else value


def _gaussian_threshold(noise: FloatArray, rate: float, level: float | None) -> float:
    """Return the threshold from mean and standard deviation; with a level, the tolerance limit by non-central t."""
    from scipy.special import nctdtrit, ndtri

    count = len(noise)
    if count < 2:
        raise InputError("", "noise", "1 value", "at least 2")
    factor = float(ndtri(1.0 - rate))
    if level is not None:
        factor = float(nctdtrit(count - 1, np.sqrt(count) * factor, level) / np.sqrt(count))
    return float(noise.mean() + factor * noise.std(ddof=1))


def _exact_threshold(noise: FloatArray, rate: float, level: float | None) -> float:
    """Return the lowest sufficient order statistic; the share beyond the r-th of n has a beta distribution."""
    from scipy.special import bdtr

    count = len(noise)
    above = np.arange(count)  # number of signals beyond each one, from the largest down
    if level is None:
        will_do = (above + 1) / (count + 1) <= rate * (1.0 + 1e-12)
        least = int(np.ceil(1.0 / rate * (1.0 - 1e-12))) - 1
    else:
        will_do = bdtr(above, count, rate) <= 1.0 - level
        least = int(np.ceil(np.log1p(-level) / np.log1p(-rate) * (1.0 - 1e-12)))
    if not will_do.any():
        raise InputError("", "noise", f"{count} values", f"at least {least} for this rate; or the gaussian method")
    return float(np.nextafter(noise[count - 1 - int(np.flatnonzero(will_do)[-1])], np.inf))


def _check_ceiling(ceiling: float | None, floor: float | None, seen_only: bool) -> None:
    if ceiling is None and seen_only:
        raise InputError("", "ceiling", "None with seen_only", "a given ceiling: such data do not determine it")
    if ceiling != 1.0 and floor is None and not seen_only:
        raise InputError("", "floor", "None", "a floor below which faults that are not seen remain, or seen_only")


def _censored_signals(
    signals: ArrayLike, threshold: float, floor: float | None, saturation: float | None, scale: Scale
) -> tuple[FloatArray, BoolArray, BoolArray, float]:
    """Return signals on their scale, cut at their limits; which ones are censored; the threshold."""
    found = finite_samples(signals, "signals")
    low, high = -np.inf if floor is None else floor, np.inf if saturation is None else saturation
    if not low < high:
        raise InputError("", "saturation", f"{high:g}", f"more than the floor, {low:g}")
    if not low <= threshold <= high:
        raise InputError("", "threshold", f"{threshold:g}", f"from the floor, {low:g}, to saturation, {high:g}")
    limits = np.array([limit for limit in (floor, saturation, threshold) if limit is not None], dtype=np.float64)
    decided = float(on_scale(limits, scale, "floor, saturation or threshold")[-1])
    return on_scale(np.clip(found, low, high), scale, "signals"), found <= low, found >= high, decided


def _line_start(x: FloatArray, y: FloatArray, spread: float) -> FloatArray:
    """Return the starting point: the line through the uncensored signals."""
    rows = np.column_stack([np.ones(len(x)), x])
    line = np.linalg.lstsq(rows, y, rcond=None)[0]
    deviation = float(np.sqrt(np.mean((y - rows @ line) ** 2)))
    if spread == 0.0 or deviation < EXACT:
        raise InputError("", "signals", "all on one line, without scatter", "signals that scatter")
    return np.append(line, 1.0) / deviation


def _coefficients_of(
    peak: Peak, centre: float, width: float, middle: float, spread: float
) -> tuple[FloatArray, FloatArray]:
    """Return intercept, slope and standard deviation, and their derivatives with respect to θ."""
    a, b, h = (float(value) for value in peak.theta)
    tau, level = spread / h, a - b * centre / width
    by_theta = np.array([
        [tau, -tau * centre / width, -tau * level / h],
        [0.0, tau / width, -tau * b / (width * h)],
        [0.0, 0.0, -tau / h],
    ])  # fmt: skip
    return np.array([middle + tau * level, tau * b / width, tau]), by_theta
