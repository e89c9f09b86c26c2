"""The static state of a wheel: how deep its contact is indented where nothing moves. Every march starts from it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[Any]  # floats, or complex numbers whose imaginary parts are derivatives
Bearing = Callable[[Any], tuple[Any, Any]]
"""The force of a contact at rest over its indentation δ > 0, and its derivative."""
MOST_NEWTON = 100
"""Newton's steps, or halvings, after which rounding alone is left."""


def power_bearing(quadratic: Any, cubic: Any) -> Bearing:
    """Return N = quadratic·δ + cubic·δ^1.5 as the static state asks for it."""
    return lambda delta: (delta * (quadratic + cubic * np.sqrt(delta)), quadratic + 1.5 * cubic * np.sqrt(delta))


def indentation_at_rest(bears: Bearing, weight: Any, stiffness: Any = 0.0, height: Any = 0.0) -> Numbers:
    """Return the indentation δ at rest, N(δ) = weight + stiffness·(height - δ), in units in which it is about one.

    Newton's method goes in √δ, in which the laws are smooth at touch. Where it leaves the bounds that are known by
    then, as at the corner of a law, these are halved. If all arguments are analytic, imaginary parts are derivatives.

    Parameters
    ----------
    bears
        The law; forces grow with the indentation.
    weight
        What the wheel bears where the spring beside the contact has no force.
    stiffness, height
        Of that spring, against a fixed guide, and of the path below the wheel: it has no force at first touch on level
        track (the paper, equation 2.3).
    """
    force, slope = bears(1.0)
    u = np.asarray(1.0 + 0.0 * (weight + stiffness + height + force + slope))
    low, high = np.zeros(u.shape), np.full(u.shape, np.inf)
    for _ in range(MOST_NEWTON):
        force, slope = bears(u * u)
        surplus = force + stiffness * (u * u - height) - weight
        step = surplus / (2.0 * u * (slope + stiffness))
        above = np.real(surplus) > 0.0
        low, high = np.where(above, low, np.real(u)), np.where(above, np.real(u), high)
        new = u - step
        inside = (low <= np.real(new)) & (np.real(new) <= high)
        u = np.where(inside, new, np.where(np.isinf(high), 2.0 * u, 0.5 * (low + high)))
        if np.all(np.abs(step) < 1e-16 * np.abs(u)):
            break
    return np.asarray(u * u)
