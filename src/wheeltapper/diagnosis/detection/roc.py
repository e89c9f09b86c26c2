"""How well a score separates faulty wheels from healthy ones: ROC curve, its area, and false calls per 1,000 axles."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.ground.arguments import as_between, as_count
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.shown import Shown

FloatArray = NDArray[np.float64]

AXLES = 1000.0
"""Number of axles to which false calls are related."""


@dataclass(frozen=True, eq=False)
class Roc(Shown):
    """Receiver operating characteristic of a score: a wheel is called faulty if its score reaches a threshold.

    Attributes
    ----------
    thresholds
        Thresholds from infinity, at which nothing is called, down to the lowest score, (k,).
    false_call_rate, detection_rate
        Shares of the healthy and of the faulty wheels that are called, (k,).
    auc
        Area under the curve: the probability that a faulty wheel scores higher than a healthy one, ties counted half
        (Mann and Whitney's U over the number of pairs).
    deviation
        Standard error of the area (DeLong, DeLong and Clarke-Pearson 1988, Biometrics 44, 837); NaN if one kind has a
        single score.
    healthy, faulty
        Numbers of scores.
    """

    thresholds: FloatArray
    false_call_rate: FloatArray
    detection_rate: FloatArray
    auc: float
    deviation: float
    healthy: int
    faulty: int

    def rate_at(self, false_calls: float) -> float:
        """Return the largest detection rate with a false-call rate of no more than this.

        There is no interpolation between the thresholds that the scores give.
        """
        return float(self.detection_rate[self._threshold_index(false_calls)])

    def threshold_at(self, false_calls: float) -> float:
        """Return the threshold of `rate_at`; infinite if only calling nothing keeps the rate."""
        return float(self.thresholds[self._threshold_index(false_calls)])

    def _threshold_index(self, false_calls: float) -> int:
        rate = to_si(false_calls, "number", "false_calls")
        if not 0.0 <= rate <= 1.0:
            raise InputError("", "false_calls", value_text(false_calls), "a rate from 0 to 1")
        return int(np.searchsorted(self.false_call_rate, rate, side="right")) - 1

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the interval that holds the true area with this probability.

        The standard error is that of the logarithm of the odds auc/(1 - auc), so that the interval stays within zero
        and one. If the error is zero or unknown (for example because all faulty scores are above all healthy ones), it
        is useless. Then the interval is that of Clopper and Pearson for n independent pairs of one healthy and one
        faulty score; n is the largest possible number of such pairs. If all scores are separated, so are these pairs,
        which has at most the probability auc^n. At an area of one the lower bound is (0.5 - level/2)^(1/n).
        """
        from scipy.special import expit, ndtri

        level = as_between(level, "level", 0.0, 1.0)
        if not self.deviation > 0.0:
            pairs = min(self.healthy, self.faulty)
            return clopper_pearson(self.auc * pairs, pairs, level)
        middle = log(self.auc / (1.0 - self.auc))
        half = float(ndtri(0.5 + 0.5 * level)) * self.deviation / (self.auc * (1.0 - self.auc))
        return float(expit(middle - half)), float(expit(middle + half))


@dataclass(frozen=True)
class FalseCalls(Shown):
    """False calls per 1,000 axles.

    Attributes
    ----------
    count, axles
        Number of healthy axles that were called, and of all healthy axles.
    level
        Of the interval.
    per_thousand
        1000·count/axles.
    lower, upper
        Confidence interval of Clopper and Pearson (1934, Biometrika 26, 404): exact for independent axles.
    """

    count: int
    axles: int
    level: float
    per_thousand: float
    lower: float
    upper: float


def roc(scores_healthy: ArrayLike, scores_faulty: ArrayLike) -> Roc:
    """Return the ROC curve of a score.

    Parameters
    ----------
    scores_healthy, scores_faulty
        Scores of healthy wheels, (n,), and of wheels with the fault, (m,); a larger score is more suspect.

    Raises
    ------
    InputError
        If there is no score of a kind, or one is not finite.
    """
    healthy, faulty = finite_samples(scores_healthy, "scores_healthy"), finite_samples(scores_faulty, "scores_faulty")
    thresholds = np.unique(np.concatenate([healthy, faulty]))[::-1]
    healthy, faulty = np.sort(healthy), np.sort(faulty)
    above_healthy, above_faulty = _exceeded_shares(faulty, healthy), 1.0 - _exceeded_shares(healthy, faulty)
    return Roc(
        np.concatenate([[inf], thresholds]),
        _called_shares(healthy, thresholds),
        _called_shares(faulty, thresholds),
        float(above_healthy.mean()),
        _area_deviation(above_healthy, above_faulty),
        len(healthy),
        len(faulty),
    )


def false_calls(count: int, axles: int, level: float = 0.95) -> FalseCalls:
    """Return the false calls per 1,000 axles, with their interval.

    Parameters
    ----------
    count
        Healthy axles that were called faulty.
    axles
        All healthy axles that passed.
    level
        Confidence level: smallest probability that the interval contains the true value.

    Raises
    ------
    InputError
        If there is no axle, or more calls than axles.
    """
    axles = as_count(axles, "axles")
    count = as_count(count, "count", 0, axles)
    level = as_between(level, "level", 0.0, 1.0)
    low, high = clopper_pearson(count, axles, level)
    return FalseCalls(count, axles, level, AXLES * count / axles, AXLES * low, AXLES * high)


def clopper_pearson(hits: float, trials: int, level: float) -> tuple[float, float]:
    """Return the exact interval of a probability from a number of hits."""
    from scipy.special import betaincinv

    rest = 0.5 - 0.5 * level
    low = 0.0 if hits <= 0.0 else float(betaincinv(hits, trials - hits + 1.0, rest))
    high = 1.0 if hits >= trials else float(betaincinv(hits + 1.0, trials - hits, 1.0 - rest))
    return low, high


def number_or_array(values: ArrayLike, name: str, allowed: str) -> FloatArray:
    """Return one number or an array of them."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError("", name, value_text(values), allowed) from error


def finite_samples(values: ArrayLike, name: str) -> FloatArray:
    """Return values as an array, (n,), all of them finite and at least one."""
    found = number_or_array(values, name, "a list of numbers")
    if found.ndim != 1 or len(found) == 0:
        raise InputError("", name, f"shape {found.shape}", "a list of numbers, at least one")
    if not np.all(np.isfinite(found)):
        raise InputError("", name, f"{int(np.sum(~np.isfinite(found)))} values that are not finite", "finite numbers")
    return found


def _called_shares(scores: FloatArray, thresholds: FloatArray) -> FloatArray:
    """Return the share of the sorted scores that reaches each threshold, after a zero."""
    return np.concatenate([[0.0], (len(scores) - np.searchsorted(scores, thresholds)) / len(scores)])


def _exceeded_shares(values: FloatArray, others: FloatArray) -> FloatArray:
    """Return the share of the sorted others that each value exceeds; equal ones count half."""
    both = np.searchsorted(others, values, side="left") + np.searchsorted(others, values, side="right")
    return np.asarray(0.5 * both / len(others))


def _area_deviation(above_healthy: FloatArray, above_faulty: FloatArray) -> float:
    if min(len(above_healthy), len(above_faulty)) < 2:
        return float("nan")
    parts = (float(places.var(ddof=1)) / len(places) for places in (above_healthy, above_faulty))
    return sqrt(sum(parts))
