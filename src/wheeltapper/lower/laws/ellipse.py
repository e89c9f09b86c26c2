"""Hertz's contact ellipse, exactly: the contact constant from radii and elastic constants.

The gap of the unloaded bodies is A·x² + B·y² with A = (1/R_w + κ)/2 along the rail and B = 1/(2·R_rail) across it. With
the eccentricity e of the ellipse (semi-axes a ≥ b) and complete elliptic integrals K, E of modulus e:

    larger/smaller of A, B = [(a/b)²·E - K]/[K - E],     a³ = 3·N·(K - E)/(2π·A·e²·E*),     δ = 3·N·K/(2π·a·E*)

so that C = N/δ^1.5 does not depend on N (K. L. Johnson, Contact Mechanics, 1985, section 4.2;
docs/theory/contact.rst, section 3.1).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.first_order import STEP, WEIGHTS

FloatArray = NDArray[np.float64]
Contact = Hertz | Linear | ElasticPlastic
FactorSlopes = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
KNOWN, INTERPOLANT = 12.0, 48
"""Up to this logarithm of the ratio of the two curvatures an interpolant is used; beyond it the equation is solved. The
interpolant is a Chebyshev polynomial of degree INTERPOLANT, exact to 1e-9."""


def _elliptic_integrals(p: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return K, E and D = (K - E)/e² for p = 1 - e² = (b/a)²; near the circle D comes from its series."""
    from scipy.special import ellipe, ellipkm1  # imported here, because a given constant does not need it

    e2 = np.asarray(1.0 - p)
    k, e = ellipkm1(p), ellipe(e2)
    d = np.asarray((k - e) / np.maximum(e2, 0.05))
    round_ = e2 <= 0.05
    if np.any(round_):
        term, series = 1.0, np.zeros(np.count_nonzero(round_))
        for n in range(1, 30):  # D = (π/2)·Σ [(2n-1)!!/(2n)!!]²·(2n/(2n-1))·e^(2n-2)
            term *= ((2 * n - 1) / (2 * n)) ** 2
            series += term * (2 * n / (2 * n - 1)) * e2[round_] ** (n - 1)
        d[round_] = 0.5 * np.pi * series
    return k, e, d


def _curvature_ratio(p: FloatArray) -> FloatArray:
    """Return the ratio (≥ 1) of the principal curvatures whose ellipse has (b/a)² = p."""
    k, _, d = _elliptic_integrals(p)
    # [(1/p)·E - K]/(K - E) with E = K - e²·D is (K - D)/(p·D): free of cancellation
    return np.asarray((k - d) / (p * d))


def _solved_log_ratio(target: FloatArray) -> FloatArray:
    """Return ln (b/a)² for the logarithm of a ratio of curvatures, by Newton's method."""
    lo, hi = np.full_like(target, -40.0), np.zeros_like(target)
    z = np.clip(-4.0 / 3.0 * target, -39.0, 0.0)  # z = ln p; near the circle and far from it b/a ~ ratio^(-2/3)
    for _ in range(100):
        f = np.log(_curvature_ratio(np.exp(z))) - target
        lo, hi = np.where(f > 0, z, lo), np.where(f > 0, hi, z)
        h = 1e-6
        slope = (np.log(_curvature_ratio(np.exp(np.minimum(z + h, 0.0)))) - np.log(_curvature_ratio(np.exp(z - h)))) / (
            np.minimum(z + h, 0.0) - (z - h)
        )
        new = z - f / slope
        new = np.where((new >= lo) & (new <= hi), new, 0.5 * (lo + hi))
        settled = np.all(np.abs(new - z) <= 1e-9 * (1.0 + np.abs(z)))  # and the error after it far below rounding
        z = new
        if settled:
            break
    return np.asarray(z)


@cache
def _log_ratio_interpolant() -> tuple[np.polynomial.Chebyshev, np.polynomial.Chebyshev]:
    """Return an interpolant of `_solved_log_ratio` up to KNOWN, and its derivative."""
    line = np.polynomial.Chebyshev.interpolate(_solved_log_ratio, INTERPOLANT, domain=[0.0, KNOWN])
    return line, line.deriv()


def axis_ratio_squared(curvature_ratio: ArrayLike) -> FloatArray:
    """Return (b/a)² of the contact ellipse for a ratio ≥ 1 of the principal relative curvatures."""
    target = np.log(np.atleast_1d(np.asarray(curvature_ratio, dtype=float)))
    if target.size < INTERPOLANT:
        return np.asarray(np.exp(_solved_log_ratio(target)))
    line, slope = _log_ratio_interpolant()
    known = np.minimum(target, KNOWN)
    z = np.minimum(line(known), 0.0)
    z -= (np.log(_curvature_ratio(np.exp(z))) - known) * slope(known)  # from 1e-9 to rounding
    beyond = target > KNOWN
    if np.any(beyond):
        z[beyond] = _solved_log_ratio(target[beyond])
    return np.asarray(np.exp(np.minimum(z, 0.0)))


def contact_constant(
    wheel_radius: ArrayLike,
    rail_radius: ArrayLike,
    youngs_modulus: ArrayLike,
    poisson: ArrayLike,
    rail_curvature: ArrayLike = 0.0,
) -> FloatArray:
    """Return C = N/δ^1.5 of one contact, N/m^1.5.

    Parameters
    ----------
    wheel_radius, rail_radius
        Rolling radius of the wheel and transverse radius of the rail's crown, m.
    youngs_modulus, poisson
        Elastic constants of both bodies.
    rail_curvature
        κ along the rail, 1/m, positive on a crest; an array gives an array.

    Raises
    ------
    InputError
        Where 1/R_w + κ ≤ 0: the surfaces conform and Hertz's theory does not hold.
    """
    wheel, rail, young, contraction, kappa = np.broadcast_arrays(
        wheel_radius, rail_radius, youngs_modulus, poisson, rail_curvature
    )
    along = 0.5 * (1.0 / wheel + kappa)
    if np.any(along <= 0.0):
        worst = np.unravel_index(np.argmin(along), along.shape)
        raise InputError(
            "", "contact",
            f"a hollow of curvature {kappa[worst]:.4g} 1/m under a wheel of curvature {1 / wheel[worst]:.4g} 1/m",
            "hollows less curved than the wheel where the contact follows the curvature (or curvature = false)",
        )  # fmt: skip
    across = 0.5 / rail
    small, large = np.minimum(along, across), np.maximum(along, across)
    p = axis_ratio_squared((large / small).ravel()).reshape(along.shape)
    k, _, d = _elliptic_integrals(p)
    modulus = young / (2.0 * (1.0 - contraction**2))
    # a³ = 3·N·D/(2π·A·E*), δ = 3·N·K/(2π·a·E*)  =>  C = δ^-1.5·N
    return np.asarray((2 * np.pi * modulus / (3 * k)) ** 1.5 * np.sqrt(3 * d / (2 * np.pi * small * modulus)))


def semi_axes(along: FloatArray, across: FloatArray, youngs_modulus: float, poisson: float) -> tuple[FloatArray, ...]:
    """Return the semi-axes along and across the rolling of contacts that carry 1 N, m; they grow with N^(1/3).

    Parameters
    ----------
    along, across
        A and B of the gap A·x² + B·y², 1/m.
    youngs_modulus, poisson
        Elastic constants of both bodies.
    """
    small, large = np.minimum(along, across), np.maximum(along, across)
    p = axis_ratio_squared(large / small)
    _, _, d = _elliptic_integrals(p)
    modulus = youngs_modulus / (2.0 * (1.0 - poisson**2))
    longer = np.cbrt(3.0 * d / (2.0 * np.pi * small * modulus))
    shorter = longer * np.sqrt(p)
    is_longer_along = along < across
    return np.where(is_longer_along, longer, shorter), np.where(is_longer_along, shorter, longer)


def _per_wheel(contact: Hertz, vehicle: Wheelset, kappa: FloatArray) -> FloatArray:
    return contact_constant(vehicle.radius, contact.rail_radius, contact.youngs_modulus, contact.poisson, kappa)


def factor_function(contact: Contact, vehicle: Wheelset) -> Callable[[FloatArray], FloatArray] | None:
    """Return C/C(smooth) as a function of the profile's second derivative (1/m), or None if C is constant."""
    if not isinstance(contact, Hertz) or not contact.follows_curvature:
        return None
    smooth = _per_wheel(contact, vehicle, np.zeros(1))[0]

    def factor_at(second_derivative: FloatArray) -> FloatArray:
        return np.asarray(_per_wheel(contact, vehicle, -np.asarray(second_derivative)) / smooth)

    return factor_at


def factor_slopes(contact: Contact, vehicle: Wheelset, path: str) -> FactorSlopes | None:
    """Return the derivatives of the factor over the profile's second derivative and over a field; None without one."""
    if factor_function(contact, vehicle) is None:
        return None

    def factor(k: int, curvature: FloatArray) -> FloatArray:
        changed = vehicle, contact
        if path == "vehicle.radius":
            changed = vehicle.model_copy(update={"radius": vehicle.radius * (1.0 + k * STEP)}), contact
        elif path == "contact.rail_radius" and isinstance(contact, Hertz):
            changed = vehicle, contact.model_copy(update={"rail_radius": contact.rail_radius * (1.0 + k * STEP)})
        of = factor_function(changed[1], changed[0])
        assert of is not None
        return of(curvature)

    def slopes_at(curvature: FloatArray) -> tuple[FloatArray, FloatArray]:
        wide = STEP / vehicle.radius
        along = (
            sum(w * (factor(0, curvature + k * wide) - factor(0, curvature - k * wide)) for k, w in WEIGHTS.items())
            / wide
        )
        held = {"vehicle.radius": vehicle.radius, "contact.rail_radius": getattr(contact, "rail_radius", 1.0)}
        if path not in held:
            return np.asarray(along), np.zeros_like(curvature)
        direct = sum(w * (factor(k, curvature) - factor(-k, curvature)) for k, w in WEIGHTS.items()) / (
            STEP * held[path]
        )
        return np.asarray(along), np.asarray(direct)

    return slopes_at
