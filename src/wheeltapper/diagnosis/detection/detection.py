"""Probability of detection (POD) as a function of size, and its confidence bounds.

POD(a) = c·F((t - μ)/σ), t the size a or its logarithm, F the distribution of the link, c the ceiling

The method follows MIL-HDBK-1823A (2009), appendix G, for hit/miss data and for signals; there c is one. A ceiling below
one describes faults that are missed whatever their size, such as flats that miss the deck. It is a further parameter,
known or estimated: "Profile likelihood: what to do when maximum probability of detection never gets to one", Materials
Evaluation, January 2015.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import inf
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from wheeltapper.diagnosis.detection.bounds import delta_lower, delta_size, location_scale, wald_lower, wald_size
from wheeltapper.diagnosis.detection.fit import DetectionFit
from wheeltapper.diagnosis.detection.likelihood import FloatArray, Link
from wheeltapper.diagnosis.detection.roc import finite_samples, number_or_array
from wheeltapper.ground.arguments import as_between, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.shown import Shown

Scale = Literal["log", "linear"]
Bounds = Literal["wald", "likelihood ratio", "delta"]

USUAL = 0.95
"""Confidence level of a bound if none is given: 95 %, as in a90/95."""


@dataclass(frozen=True, eq=False)
class Detection(Shown):
    """Probability of detection as a function of the size of a fault; `hit_miss` and `signal_response` return it.

    Sizes have the unit of the data. A size is infinite if the given probability of detection is never reached. It is
    NaN if the data do not determine it. `reason` says why.

    Attributes
    ----------
    kind
        "hit/miss" or "signal response".
    link
        F: "probit" (normal distribution) or "logit" (logistic distribution).
    scale
        "log" if t is the natural logarithm of the size, "linear" if it is the size.
    specimens
        Number of inspections.
    threshold
        Smallest signal that is called a fault; NaN for hit/miss data.
    ceiling
        Largest probability of detection, however large the fault.
    location, spread
        μ and σ: the value of t at which POD is half the ceiling, and the scale of F.
    covariance
        Covariance of μ and σ, (2, 2), by the delta method; of μ, σ and c, (3, 3), if the ceiling was estimated. NaN if
        the normal approximation does not hold.
    coefficients
        For hit/miss data, intercept and slope of the index F⁻¹(POD/c) over t. For signals, intercept, slope and
        standard deviation of the regression of the signal (or its logarithm) on t.
    coefficient_covariance
        (2, 2) or (3, 3): inverse of the Fisher information for hit/miss data, of the observed information for signals.
    log_likelihood
        Its maximum, with all constants.
    method
        Method of the bounds: "wald", "likelihood ratio" or "delta".
    note
        What is unusual in the data; otherwise empty.
    fit
        The fit to standardised sizes and signals, with its likelihood.
    """

    kind: str
    link: Link
    scale: Scale
    specimens: int
    threshold: float
    ceiling: float
    location: float
    spread: float
    covariance: FloatArray
    coefficients: FloatArray
    coefficient_covariance: FloatArray
    log_likelihood: float
    method: Bounds
    note: str
    fit: DetectionFit = field(repr=False)

    def at(self, sizes: ArrayLike) -> FloatArray:
        """Return the probability of detection at sizes, in their shape; NaN if the data do not determine it."""
        return self.fit.probability_at(self._standardised_sizes(sizes))

    def lower(self, sizes: ArrayLike, level: float = USUAL) -> FloatArray:
        """Return the lower confidence bound of the probability of detection at sizes.

        Parameters
        ----------
        sizes
            Sizes, in the unit of the data.
        level
            Confidence level, pointwise: probability that the bound lies below the true value at one size.

        Returns
        -------
        numpy.ndarray
            Probabilities in the shape of the sizes. NaN if the method needs the normal approximation and it does not
            hold.

        Raises
        ------
        InputError
            If a size is not finite, or not positive on a log scale, or the level is not between 0.5 and 1.
        """
        level = as_between(level, "level", 0.5, 1.0)
        x = self._standardised_sizes(sizes)
        if self.method == "likelihood ratio":
            found = np.array([self.fit.least_probability(float(one), level) for one in x.ravel()], dtype=np.float64)
            return found.reshape(x.shape)
        if not self.fit.is_regular:
            return np.full(x.shape, np.nan)
        return (wald_lower if self.method == "wald" else delta_lower)(self.fit.index, x, level)

    def size(self, probability: float, level: float | None = None) -> float:
        """Return the size that is detected with a probability; with a level, its upper confidence bound.

        The bound is the size at which `lower` reaches the probability.

        Parameters
        ----------
        probability
            Between zero and one.
        level
            Confidence level: probability that the bound lies above the true size. By default the estimate is returned.

        Returns
        -------
        float
            The size. Infinite if no size is detected with that probability, or if the data do not prove that one is.
            NaN if the data do not determine it.

        Raises
        ------
        InputError
            If the probability is not between 0 and 1, or the level not between 0.5 and 1.
        """
        probability = as_between(probability, "probability", 0.0, 1.0)
        if level is None:
            return self._original_size(self.fit.size_reaching(probability))
        level = as_between(level, "level", 0.5, 1.0)
        if probability >= self.ceiling:
            return inf
        if self.method == "likelihood ratio":
            return self._original_size(self.fit.largest_size(probability, level))
        if not self.fit.is_regular:
            return np.nan
        return self._original_size(
            (wald_size if self.method == "wald" else delta_size)(self.fit.index, probability, level)
        )

    @property
    def a50(self) -> float:
        """Size that is detected with probability 0.5."""
        return self.size(0.5)

    @property
    def a90(self) -> float:
        """Size that is detected with probability 0.9."""
        return self.size(0.9)

    @cached_property
    def a90_95(self) -> float:
        """Upper 95 % confidence bound of the size that is detected with probability 0.9."""
        return self.size(0.9, USUAL)

    @cached_property
    def reason(self) -> str:
        """Why a50, a90 or a90/95 is infinite or NaN, and what is unusual in the data; otherwise empty."""
        parts = [self.note] if self.note else []
        missing = [name for name, p in (("a50", 0.5), ("a90", 0.9)) if p >= self.ceiling]
        if missing:
            share = f"{'the likeliest ceiling is' if self.fit.is_estimated else 'the ceiling is'} {self.ceiling:.3g}"
            parts.append(f"{share}, so that there is no {' and no '.join(missing)}")
        elif self.a90_95 == inf:
            parts.append("the data do not prove that any size is detected with 0.9: there is no a90/95")
        elif np.isnan(self.a90_95):
            parts.append(f"there is no bound by {self.method}, but one by the likelihood ratio")
        return "; ".join(parts)

    def ceiling_interval(self, level: float = USUAL) -> tuple[float, float]:
        """Return the confidence interval of the ceiling, by the likelihood ratio; a given ceiling is returned twice."""
        return self.fit.ceiling_interval(as_between(level, "level", 0.5, 1.0))

    def _standardised_sizes(self, sizes: ArrayLike) -> FloatArray:
        """Return sizes in the coordinates of the fit."""
        t = on_scale(number_or_array(sizes, "sizes", "one size, or a list of them"), self.scale, "sizes")
        return np.asarray((t - self.fit.centre) / self.fit.width)

    def _original_size(self, x: float) -> float:
        t = self.fit.centre + self.fit.width * x
        with np.errstate(over="ignore"):
            return float(np.exp(t)) if self.scale == "log" else t


def detection_of(
    fit: DetectionFit, *, kind: str, scale: Scale, threshold: float, coefficients: FloatArray, by_theta: FloatArray,
    log_likelihood: float, bounds: Bounds | None, note: str,
) -> Detection:  # fmt: skip
    """Return a fit in the terms of the field.

    Parameters
    ----------
    fit
        Fit to standardised sizes (and signals).
    kind, scale, threshold, coefficients, log_likelihood, note
        As of `Detection`.
    bounds
        Method of the bounds. By default Wald's if the normal approximation holds, else the likelihood ratio.
    by_theta
        Derivatives of the coefficients with respect to the fit's parameters, (k, k).
    """
    method = bounds or ("wald" if fit.is_regular and not fit.is_estimated else "likelihood ratio")
    location, spread, of_coefficients = np.nan, inf, np.full(by_theta.shape, np.nan)
    covariance = np.full((2 + fit.is_estimated,) * 2, np.nan)
    if fit.is_regular:
        middle, slow, found = location_scale(fit.index)
        location, spread = fit.centre + fit.width * middle, fit.width * slow
        unit = np.array([fit.width, fit.width, 1.0])[: len(found)]
        covariance[: len(found), : len(found)] = found * np.outer(unit, unit)
        many = len(by_theta)
        of_coefficients = by_theta @ fit.covariance()[:many, :many] @ by_theta.T
    return Detection(
        kind, fit.likelihood.link, scale, len(fit.sizes), threshold, fit.ceiling, location, spread, covariance,
        coefficients, of_coefficients, log_likelihood, method, _note_on_fit(fit, note), fit,
    )  # fmt: skip


def _note_on_fit(fit: DetectionFit, note: str) -> str:
    if note or fit.is_regular:
        return note or ("the likeliest ceiling is one, its standard error unknown" if fit.is_at_one else "")
    if fit.step is None:
        return "detection does not grow with size in these data: they determine no a50 and no a90"
    return ""


def on_scale(sizes: FloatArray, scale: Scale, name: str) -> FloatArray:
    """Return sizes or signals on their scale."""
    if not np.all(np.isfinite(sizes)):
        raise InputError("", name, f"{int(np.sum(~np.isfinite(sizes)))} values that are not finite", "finite numbers")
    if scale == "linear":
        return sizes
    if np.any(sizes <= 0.0):
        raise InputError("", name, f"{float(sizes.min()):g}", "more than zero on a log scale")
    return np.asarray(np.log(sizes))


def standardised_sizes(sizes: ArrayLike, scale: Scale) -> tuple[FloatArray, float, float]:
    """Return standardised sizes of specimens, their mean and their standard deviation."""
    t = on_scale(finite_samples(sizes, "sizes"), scale, "sizes")
    centre, width = float(t.mean()), float(t.std())
    if width <= 1e-12 * max(abs(centre), 1.0):
        raise InputError("", "sizes", f"all {len(t)} equal", "at least two different sizes")
    return (t - centre) / width, centre, width


def as_ceiling(given: float | None, bounds: Bounds | None) -> float | None:
    """Return a ceiling, a probability or None; refuse bounds that do not exist for it."""
    ceiling = None if given is None else to_si(given, "number", "ceiling")
    if ceiling is not None and not 0.0 < ceiling <= 1.0:
        raise InputError("", "ceiling", value_text(given), "more than 0 and at most 1, or None: it is estimated")
    if bounds is not None:
        check_choice(bounds, "bounds", ("wald", "likelihood ratio", "delta"))
    if ceiling is None and bounds not in (None, "likelihood ratio"):
        raise InputError("", "bounds", f"{bounds!r} with a ceiling to be estimated", "'likelihood ratio'")
    return ceiling
