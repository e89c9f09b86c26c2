"""Probability of detection from hits and misses: a generalised linear model with a binary outcome."""

from __future__ import annotations

from math import inf, log

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.diagnosis.detection.detection import (
    Bounds,
    Detection,
    Scale,
    as_ceiling,
    detection_of,
    standardised_sizes,
)
from wheeltapper.diagnosis.detection.fit import LEAST, DetectionFit, likeliest_peak, step_of
from wheeltapper.diagnosis.detection.likelihood import FloatArray, Likelihood, Link, Peak, quantile
from wheeltapper.diagnosis.detection.roc import finite_samples
from wheeltapper.ground.arguments import check_choice
from wheeltapper.ground.errors import InputError

BoolArray = NDArray[np.bool_]


def hit_miss(
    sizes: ArrayLike, hits: ArrayLike, *, link: Link = "probit", scale: Scale = "log", ceiling: float | None = 1.0,
    bounds: Bounds | None = None,
) -> Detection:  # fmt: skip
    """Return the probability of detection from hits and misses.

    The method is that of MIL-HDBK-1823A, appendix G, on hit/miss data: maximum likelihood of F⁻¹(POD/c) = β0 + β1·t.

    If all faults up to one size were missed and all larger ones were detected, the likelihood has no maximum at a
    finite slope. Then a50 and a90 are NaN, and so is the curve between the two sizes. The same holds if all faults were
    detected, or all missed. The likelihood ratio still gives bounds: the curves under which the probability of the data
    is at least one less the level.

    Parameters
    ----------
    sizes
        Sizes of the faults, one per inspection, (n,), any unit.
    hits
        Whether each fault was called, (n,).
    link
        "probit" or "logit".
    scale
        "log": t is the size's logarithm, the usual choice; "linear": t is the size.
    ceiling
        Largest probability of detection. It is given, for example as the share of a wheel's circumference that rolls
        over the deck. Or it is None: then it is estimated as a third parameter.
    bounds
        "wald": bound of the index, with the expected Fisher information; a90/95 is the size at which it reaches 0.9.
        "likelihood ratio": the handbook's choice. "delta": bound of the size, μ + σ·z, by the delta method. By default
        Wald's for a given ceiling, if the normal approximation holds; else the likelihood ratio. In designs of 60 to
        200 faults, a90/95 lay above the true a90 in 94 to 96 % of replicates by Wald's, in 91 to 95 % by the likelihood
        ratio and in 86 to 92 % by the delta method.

    Raises
    ------
    InputError
        If lengths differ, a value is not finite, a size not positive on a log scale, all sizes are equal, an outcome
        is neither hit nor miss, or a ceiling is to be estimated without any hit or for other bounds than the
        likelihood ratio's.
    """
    check_choice(link, "link", ("probit", "logit"))
    check_choice(scale, "scale", ("log", "linear"))
    ceiling = as_ceiling(ceiling, bounds)
    x, centre, width = standardised_sizes(sizes, scale)
    called = _checked_outcomes(hits, len(x))
    if ceiling is None and not called.any():
        raise InputError("", "hits", "none", "at least one hit, if the ceiling is to be estimated")
    rows = np.column_stack([np.ones(len(x)), x])
    likelihood = Likelihood(link, rows[called], rows[~called], np.zeros((0, 2)))
    peak, step = _likeliest_curve(likelihood, x, called, ceiling)
    fit = DetectionFit(likelihood, peak, np.zeros(0), centre, width, x, peak.ceiling, ceiling is None, step=step)
    by_theta = np.array([[1.0, -centre / width], [0.0, 1.0 / width]])
    coefficients = by_theta @ peak.theta if step is None else np.full(2, np.nan)
    return detection_of(
        fit, kind="hit/miss", scale=scale, threshold=np.nan, coefficients=coefficients, by_theta=by_theta,
        log_likelihood=peak.value, bounds=bounds, note=_data_note(fit, scale, int(called.sum())),
    )  # fmt: skip


def _checked_outcomes(hits: ArrayLike, count: int) -> BoolArray:
    found = finite_samples(hits, "hits")
    if len(found) != count:
        raise InputError("", "hits", f"{len(found)} outcomes", f"{count}, one for each size")
    if not np.all((found == 0.0) | (found == 1.0)):
        odd = found[(found != 0.0) & (found != 1.0)][0]
        raise InputError("", "hits", f"{odd:g}", "1 (or true) for a hit, 0 (or false) for a miss")
    return np.asarray(found == 1.0)


def _likeliest_curve(
    likelihood: Likelihood, x: FloatArray, called: BoolArray, ceiling: float | None
) -> tuple[Peak, tuple[float, float] | None]:
    """Return the most likely curve, and the two sizes of the step if it is one."""
    if called.all() or not called.any():
        far = quantile(likelihood.link, 1.0 - LEAST)
        most = 1.0 if ceiling is None else ceiling
        if called.all():
            return Peak(len(x) * log(most), np.array([far, 0.0]), most), (-inf, float(x.min()))
        return Peak(0.0, np.array([-far, 0.0]), most), (float(x.max()), inf)
    start = np.array([quantile(likelihood.link, float(called.mean())), 0.0])
    peak = likeliest_peak(likelihood, start, x, ceiling)
    last_miss, first_hit = float(x[~called].max()), float(x[called].min())
    if last_miss <= first_hit:
        return peak, (last_miss, first_hit)
    return peak, step_of(peak, likelihood, x)


def _data_note(fit: DetectionFit, scale: Scale, hits: int) -> str:
    """Return what is unusual in the data."""
    if fit.step is None:
        return ""
    if hits in (0, len(fit.sizes)):
        return f"all {len(fit.sizes)} faults were {'detected' if hits else 'missed'}: no curve is the likeliest"
    before, after = (fit.centre + fit.width * x for x in fit.step)
    if scale == "log":
        before, after = np.exp(before), np.exp(after)
    where = f"at {after:.4g}" if before == after else f"between {before:.4g} and {after:.4g}"
    return f"detection rises {where} in one step: these data do not show how steeply"
