"""Lines through the lengths of one wheel's flat, and the passages before which a line begins anew.

Theory: docs/theory/gauges.rst, section 16.8.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr
from scipy.stats import chi2

from wheeltapper.diagnosis.gauges.sizing import OWN_LENGTH
from wheeltapper.diagnosis.gauges.weighing import Weights

FloatArray = NDArray[np.float64]
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""All passages share the model's error `OWN_LENGTH`. Each has an error of its own besides, with these parts of its
variance: nobody knows the part, and each is tried."""
MISSED = 0.05
"""A wheel counts as healthy with this probability however long its flat is."""
NINE_TENTHS = 1.2816
"""The normal quantile of nine tenths."""
PENALTY = 20.0
"""A course begins anew where this lowers -2 log likelihood by so much. In 1200 drawn courses of 50 passages without a
change none did."""
MUCH = 1.3
"""And where its flat is so many times longer or shorter than that of the course before: wear does neither at once."""
WIDEST = 0.1
"""Standard deviation, before, of what a flat grows over all passages, m: it says nothing, but of a single length."""
ROUNDS, SETTLED, LEAST = 8, 2e-5, 1e-3
"""A line is fitted so often at most, since errors are parts of its own lengths, until it moves by less than this, m;
for that it is at least so long, m."""
BENT = 0.01
"""A line holds unless its χ² is exceeded with a probability of less than this."""


class Lengths(NamedTuple):
    """What passages show, (passages,).

    Attributes
    ----------
    at
        When they were.
    length
        Of the flat, m; NaN where the wheel seemed healthy.
    own, common
        Standard deviations over the length: of each passage alone, and of what they share, (passages, values).
    half, most
        Lengths that would have been found on half of the circumference, m, and on nine tenths.
    """

    at: FloatArray
    length: FloatArray
    own: FloatArray
    common: FloatArray
    half: FloatArray
    most: FloatArray

    @property
    def wide(self) -> FloatArray:
        """Standard deviation of the logarithms of lengths that would be found, over the circumference."""
        return np.maximum(np.log(self.most / self.half) / NINE_TENTHS, 0.02)

    @property
    def found(self) -> NDArray[np.bool_]:
        """Where there is a length."""
        return np.isfinite(self.length)

    def course(self, starts: Sequence[int]) -> NDArray[np.int64]:
        """Return the number of each passage's course."""
        return np.searchsorted(starts, np.arange(len(self.at)), side="right")


class Lines(NamedTuple):
    """Lines through the courses that have a flat.

    Attributes
    ----------
    courses
        Their numbers.
    centres
        Where each has the length of its first value.
    values, covariance
        Length, m, and rate of each, one after the other.
    at_passages
        Lengths at all passages by their lines, m; 0 where there is none.
    chi
        χ² of the lengths.
    misfit
        -2 log likelihood, but for a constant.
    evidence
        The same where all lines are thought possible.
    """

    courses: NDArray[np.int64]
    centres: FloatArray
    values: FloatArray
    covariance: FloatArray
    at_passages: FloatArray
    chi: float
    misfit: float
    evidence: float


def _fitted(data: Lengths, starts: Sequence[int], share: float) -> Lines:
    """Return the lines of courses that begin at these passages; `share` is one of `SHARES`."""
    course, found = data.course(starts), data.found
    courses = np.unique(course[found])
    centres = np.array([data.at[found & (course == one)].mean() for one in courses])
    means = np.array([data.length[found & (course == one)].mean() for one in courses])
    own = (course[:, None] == courses).astype(float)
    along = own * (data.at[:, None] - centres)
    basis = np.stack([own, along], axis=2).reshape(len(course), -1)
    flawed = own.any(axis=1)
    span = max(float(np.ptp(data.at)), 1e-9)
    before = np.diag(np.tile([0.0, (span / WIDEST) ** 2], len(courses)))
    line, shared = own @ means, np.column_stack([data.common, np.full(len(course), OWN_LENGTH)])
    own_error = np.sqrt(np.maximum(data.own**2 + share * OWN_LENGTH**2, 1e-8))
    for _ in range(ROUNDS if len(courses) else 0):
        at_least = np.maximum(line, LEAST)
        target, deviation = np.where(found, data.length, 0.0), own_error * at_least
        missed = flawed & ~found
        target[missed], deviation[missed] = _as_lengths(data, at_least, missed)
        weights = Weights(deviation[flawed], (shared * (found * at_least)[:, None])[flawed])
        columns, over = weights.over(basis[flawed]), weights.over(target[flawed])
        normal = columns.T @ weights.weighed(columns) + before
        values = np.asarray(np.linalg.solve(normal, columns.T @ weights.weighed(over)))
        moved, line = np.abs(basis @ values - line).max(), basis @ values
        if moved < SETTLED:
            break
    if not len(courses):
        return Lines(courses, centres, np.empty(0), np.empty((0, 0)), line, 0.0, 0.0, 0.0)
    at_least = np.maximum(line, LEAST)
    weights = Weights((own_error * at_least)[found], (shared * at_least[:, None])[found])
    left = weights.over((data.length - line)[found])
    chi = weights.square(left)
    misfit = chi + weights.logarithm - 2.0 * float(_chance_missed(data, at_least, missed)[0].sum())
    evidence = misfit + float(np.linalg.slogdet(normal)[1])
    return Lines(courses, centres, values, np.asarray(np.linalg.inv(normal)), line, chi, misfit, evidence)


def _chance_missed(data: Lengths, lengths: FloatArray, missed: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Return the logarithms of the probability that flats are missed; and where they lie, as a normal quantile."""
    quantile = np.log(lengths[missed] / data.half[missed]) / data.wide[missed]
    return np.logaddexp(np.log(MISSED), np.log1p(-MISSED) + log_ndtr(-quantile)), quantile


def _as_lengths(data: Lengths, lengths: FloatArray, missed: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Return lengths and deviations, m, that would move a line as passages do at which its flat was missed.

    They are Newton's steps on the probability; its floor `MISSED` has no slope.
    """
    chance, quantile = _chance_missed(data, lengths, missed)
    hazard = np.exp(-0.5 * quantile**2 - log_ndtr(-quantile)) / np.sqrt(2.0 * np.pi)
    slope = 1.0 / (data.wide[missed] * lengths[missed])
    through = np.exp(np.log1p(-MISSED) + log_ndtr(-quantile) - chance)
    curvature = np.maximum(hazard * (hazard - quantile), 1e-12) * slope**2
    by = np.clip(hazard * slope / curvature, 0.0, 0.5 * lengths[missed])
    return lengths[missed] - by, 1.0 / np.sqrt(np.maximum(through * curvature, 1e-2))


def changes(data: Lengths) -> tuple[int, ...]:
    """Return the passages before which the wheel has changed; the likeliest is sought first, then others beside it."""
    ends = [n for n in range(1, len(data.at)) if data.found[n - 1 : n + 1].any()]  # not between healthy passages
    starts, now = tuple[int, ...](), _fitted(data, (), 1.0)
    while True:
        tried = [tuple(sorted((*starts, n))) for n in ends if n not in starts]
        lines = [(more, _fitted(data, more, 1.0)) for more in tried]
        best = min((one for one in lines if _is_much(data, *one)), key=lambda one: one[1].misfit, default=(starts, now))
        if best[1].misfit > now.misfit - PENALTY:
            return starts
        starts, now = best


def _is_much(data: Lengths, starts: Sequence[int], lines: Lines) -> bool:
    """Return whether each course begins with a flat that is much longer or shorter than the one before."""
    return all(max(one) > MUCH * min(one) for one in (around(data, start, lines, starts) for start in starts))


def around(data: Lengths, start: int, lines: Lines, starts: Sequence[int]) -> tuple[float, float]:
    """Return the lengths, m, before and after a change at a passage, by the lines on either side; 0 without a flat."""
    course = int(data.course(starts)[start])
    both = []
    for one in (course - 1, course):
        (own,) = np.nonzero(lines.courses == one)
        values = lines.values[2 * own[0] : 2 * own[0] + 2] if len(own) else np.zeros(2)
        centre = lines.centres[own[0]] if len(own) else 0.0
        both.append(max(float(values[0] + values[1] * (data.at[start] - centre)), 0.0))
    return both[0], both[1]


def lines_of(data: Lengths, starts: Sequence[int]) -> tuple[Lines, float | None, bool]:
    """Return lines over all `SHARES`, each as likely as its evidence; reduced χ², and whether they hold."""
    tried = [_fitted(data, starts, share) for share in SHARES]
    evidence = np.array([one.evidence for one in tried])
    odds = np.exp(-0.5 * (evidence - evidence.min()))
    odds /= odds.sum()
    values = np.array([one.values for one in tried])
    mean = odds @ values
    covariance = sum(
        odd * (one.covariance + np.outer(one.values - mean, one.values - mean))
        for odd, one in zip(odds, tried, strict=True)
    )
    chi = float(odds @ [one.chi for one in tried])
    counts = np.bincount(data.course(starts)[data.found])
    free = int(np.maximum(counts - 2, 0).sum())
    reduced = chi / free if free else None
    wider = max(1.0, reduced or 1.0)
    held = tried[0]._replace(values=mean, covariance=wider * np.asarray(covariance))
    return held, reduced, not free or bool(chi2.sf(chi, free) > BENT)
