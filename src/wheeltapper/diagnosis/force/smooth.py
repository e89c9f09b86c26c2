"""The smooth force behind noisy samples: penalised least squares with the deck's dynamics, in banded matrices.

The deck's inertia shows g = -M·a, the sum of the dynamic force and the force of the bearing: g = F + K·y + C_d·v. Let a
be linear between samples. The second differences of F are then exactly a tridiagonal operator on g alone. A penalty on
the differences of F therefore needs neither y nor v. The estimate with white F'' or F''' is the solution of one banded
system. It equals that of a Kalman filter with Rauch's smoother over y, v, F and its derivatives.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

WINDOW = 2.7
"""Contact periods over which the local intensity of the noise that drives the force is averaged: an impact and the
flights beside it."""
QUIETEST = 1e-4
"""Lowest local intensity, over its mean. Without a lower bound a quiet part would be smoothed without limit."""
WIDEST = 80.0
"""Largest width of the smoothing kernel in samples, λ^(1/(2·order)); λ is the weight of the penalty."""
NARROWEST = 0.1
"""Smallest width of the smoothing kernel in samples. Such a kernel does not smooth at all."""


STIFFEST = 1e12
"""Largest weight of one difference. With a larger one the samples would be lost in the rounding of the matrix."""
UNMEASURED, LEAST = 1e-11, 1e-3
"""Weight of the condition g = 0 where a sample is missing: UNMEASURED times the largest weight of a difference, but at
most LEAST. It keeps the matrix regular in long gaps and has no other effect."""


class SmoothEstimate(NamedTuple):
    """An estimate of g."""

    values: FloatArray  # (n,) N
    variance: FloatArray  # (n,) N²: due to the intensity of the prior and the noise
    width: float  # samples: λ to the power of one over twice the order, in the mean intensity
    order: int

    def cutoff(self, rate: float, error: float) -> float:
        """Return the frequency, Hz, up to which the kernel 1/(1 + λ·|2·sin(πf/rate)|^(2·order)) errs by less."""
        sine = 0.5 * (error / (1.0 - error)) ** (0.5 / self.order) / self.width
        return float(rate / np.pi * np.arcsin(min(sine, 1.0)))


class SmoothingProblem(NamedTuple):
    """Minimise Σ weights·(measured - g)² + λ·Σ (L·g)²/shape."""

    measured: FloatArray  # (n,) N; anything where the weight is zero
    weights: FloatArray  # (n,) 1, or 0 where nothing was measured
    stencil: FloatArray  # (order + 1,): L's row
    shape: FloatArray  # (n - order,): relative intensity of L·g

    @property
    def order(self) -> int:
        """Of the differences."""
        return len(self.stencil) - 1

    def weight_bounds(self) -> tuple[float, float]:
        """Return the least and the largest ln λ."""
        return 2.0 * self.order * float(np.log(NARROWEST)), 2.0 * self.order * float(np.log(WIDEST))

    def roughness(self, g: FloatArray) -> FloatArray:
        """Return L·g, (n - order,)."""
        count = len(g) - self.order
        return np.asarray(sum(c * g[i : i + count] for i, c in enumerate(self.stencil)))

    def cholesky_factor(self, log_weight: float) -> FloatArray:
        """Return the banded Cholesky factor (upper form) of W + λ·Lᵀ·L/shape."""
        from scipy.linalg import cholesky_banded

        b, count = self.order, len(self.shape)
        penalty = np.minimum(np.exp(log_weight) / self.shape, STIFFEST)
        bands = np.zeros((b + 1, len(self.measured)))
        for i in range(b + 1):
            for j in range(i, b + 1):
                bands[b - j + i, j : j + count] += penalty * self.stencil[i] * self.stencil[j]
        bands[b] += np.where(self.weights > 0.0, self.weights, min(UNMEASURED * float(penalty.max()), LEAST))
        return np.asarray(cholesky_banded(bands, overwrite_ab=True, check_finite=False))

    def smoothed(self, factor: FloatArray) -> FloatArray:
        """Return the minimising g."""
        from scipy.linalg import cho_solve_banded

        return np.asarray(cho_solve_banded((factor, False), self.weights * self.measured, check_finite=False))

    def residual(self, g: FloatArray) -> float:
        """Return the sum of squares of the residual, N²."""
        return float(np.sum(self.weights * (self.measured - g) ** 2))

    def negative_log_likelihood(self, log_weight: float, noise: float) -> float:
        """Return minus the logarithm of the likelihood, up to a constant; `noise` is the deviation of g in N."""
        factor = self.cholesky_factor(log_weight)
        g = self.smoothed(factor)
        misfit = self.residual(g) + np.exp(log_weight) * float(np.sum(self.roughness(g) ** 2 / self.shape))
        determinant = float(np.sum(np.log(factor[-1]))) + 0.5 * float(np.sum(np.log(self.shape)))
        return float(determinant - 0.5 * len(self.shape) * log_weight + 0.5 * misfit / noise**2)

    def discrepancy(self, log_weight: float, noise: float) -> float:
        """Return the sum of squares over that of the noise alone, less one; positive if the estimate is too smooth.

        The noise alone leaves its variance times the number of samples less the degrees of freedom of the estimate.
        """
        step = 1e-3
        factors = [self.cholesky_factor(log_weight + d) for d in (-step, 0.0, step)]
        logs = [2.0 * float(np.sum(np.log(factor[-1]))) for factor in factors]
        left = max((logs[2] - logs[0]) / (2.0 * step) - (self.order + np.sum(self.weights == 0.0)), 1.0)
        return float(self.residual(self.smoothed(factors[1])) / (noise**2 * left) - 1.0)


def stencil(mass: float, stiffness: float, damping: float, interval: float, order: int) -> FloatArray:
    """Return the row that maps g to the second or third differences of F; a is linear between samples."""
    spring, damper = stiffness * interval**2 / mass, damping * interval / mass
    second = np.array([1.0 + spring / 6.0 - damper / 2.0, -2.0 + 2.0 * spring / 3.0, 1.0 + spring / 6.0 + damper / 2.0])
    return second if order == 2 else np.convolve(second, [-1.0, 1.0])


def by_discrepancy(problem: SmoothingProblem, noise: float) -> SmoothEstimate:
    """Return Tikhonov's estimate: the smoothest one whose residual is as large as the noise (Morozov's principle)."""
    from scipy.optimize import brentq

    low, high = problem.weight_bounds()
    if problem.discrepancy(low, noise) >= 0.0:
        return _estimate_at(problem, low, noise)
    if problem.discrepancy(high, noise) <= 0.0:
        return _estimate_at(problem, high, noise)
    return _estimate_at(problem, brentq(problem.discrepancy, low, high, args=(noise,), xtol=0.02), noise)


def by_likelihood(problem: SmoothingProblem, noise: float, period: float) -> SmoothEstimate:
    """Return the smoother's estimate: mean intensity by maximum likelihood, its variation from the force found.

    `period` is that of the wheel on its contact, in samples.
    """
    from scipy.optimize import minimize_scalar

    def likeliest(of: SmoothingProblem) -> float:
        found = minimize_scalar(
            of.negative_log_likelihood, bounds=of.weight_bounds(), args=(noise,), method="bounded",
            options={"xatol": 0.05},
        )  # fmt: skip
        return float(found.x)

    width = max(round(WINDOW * period), 1)
    for _ in range(2):
        rough = problem.roughness(problem.smoothed(problem.cholesky_factor(likeliest(problem)))) ** 2
        problem = problem._replace(shape=_local_intensity(rough, width))
    return _estimate_at(problem, likeliest(problem), noise)


def _local_intensity(power: FloatArray, width: int) -> FloatArray:
    """Return the running mean over the total mean, at least QUIETEST."""
    from scipy.ndimage import uniform_filter1d

    mean = float(power.mean())
    if mean == 0.0:
        return np.ones_like(power)
    return np.maximum(uniform_filter1d(power, width, mode="nearest") / mean, QUIETEST)


def _estimate_at(problem: SmoothingProblem, log_weight: float, noise: float) -> SmoothEstimate:
    factor = problem.cholesky_factor(log_weight)
    width = float(np.exp(log_weight / (2 * problem.order)))
    return SmoothEstimate(problem.smoothed(factor), noise**2 * _inverse_diagonal(factor), width, problem.order)


def _inverse_diagonal(factor: FloatArray) -> FloatArray:
    """Return the diagonal of the inverse, from the banded Cholesky factor of order up to three (Takahashi).

    With L's rows over their pivots (p, q, r), row i of the inverse follows from the three below it.
    """
    order, n = len(factor) - 1, factor.shape[1]
    pivots = factor[order]
    ratios = np.zeros((3, n))
    for d in range(1, order + 1):
        ratios[d - 1, : n - d] = factor[order - d, d:] / pivots[: n - d]
    out = []
    z11 = z12 = z13 = z22 = z23 = z33 = 0.0
    for own, p, q, r in zip(*(row[::-1].tolist() for row in (1.0 / pivots**2, *ratios)), strict=True):
        first = -(p * z11 + q * z12 + r * z13)
        second = -(p * z12 + q * z22 + r * z23)
        third = -(p * z13 + q * z23 + r * z33)
        diagonal = own - (p * first + q * second + r * third)
        out.append(diagonal)
        z33, z23, z22, z13, z12, z11 = z22, z12, z11, second, first, diagonal
    return np.array(out[::-1])
