"""First derivatives of functions that take real numbers only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

STEP = 2e-3
"""Step of the central differences, relative to the argument."""
WEIGHTS = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
"""Weights of the central differences of sixth order, by the distance in steps."""


def first_order(function: Callable[..., NDArray[Any]], *arguments: Any) -> NDArray[Any]:
    """Return f(a + i·ε·b) = f(a) + i·ε·f'(a)·b of a smooth real function, element by element.

    For real arguments the function is simply called. The derivative is a central difference of sixth order along b,
    with steps of some thousandths of a. Therefore no argument with a derivative may be zero.
    """
    values = [np.asarray(a) for a in arguments]
    if not any(np.iscomplexobj(a) for a in values):
        return np.asarray(function(*values))
    real = [a.real for a in values]
    tilt = [a.imag for a in values]
    relative: Any = sum(np.abs(b / a) for a, b in zip(real, tilt, strict=True) if np.any(b))
    size = STEP / np.where(relative == 0.0, 1.0, relative)

    def value_at_step(k: int) -> NDArray[Any]:
        return np.asarray(function(*(a + k * size * b for a, b in zip(real, tilt, strict=True))))

    slope = sum(weight * (value_at_step(k) - value_at_step(-k)) for k, weight in WEIGHTS.items()) / size
    return np.asarray(function(*real) + 1j * slope)
