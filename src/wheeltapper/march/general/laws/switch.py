"""All laws by their numbers: the one place that lists them."""

from __future__ import annotations

from wheeltapper.march.general.laws.hertz import hertz_force
from wheeltapper.march.general.laws.hunt_crossley import CROSSLEY_LOSS, hunt_crossley_force
from wheeltapper.march.general.laws.kelvin import kelvin_force
from wheeltapper.march.general.laws.linear import linear_force
from wheeltapper.march.general.laws.tabulated import tabulated_force, tabulated_share
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray

HERTZ, LINEAR_LAW, HUNT_CROSSLEY, TABULATED, KELVIN = range(5)
LAW_KIND, LAW_RATED = 0, 11
"""Columns of a law's numbers: its kind, and 1 where the force depends on the rate; the others are the law's own."""
LAW_NUMBERS = 12


@kernel
def forces(
    numbers: FloatArray, table: FloatArray, n: int, delta: FloatArray, rate: FloatArray, factor: FloatArray,
    N: FloatArray, slope: FloatArray, viscous: FloatArray,
) -> None:  # fmt: skip
    """Write forces at n nodes, times the factor of the path, and their derivatives by indentation and rate."""
    kind = numbers[LAW_KIND]
    if kind == HERTZ:
        for k in range(n):
            force, by_delta = hertz_force(delta[k], numbers)
            N[k] = factor[k] * force
            slope[k] = factor[k] * by_delta
    elif kind == LINEAR_LAW:
        for k in range(n):
            force, by_delta = linear_force(delta[k], numbers)
            N[k] = factor[k] * force
            slope[k] = factor[k] * by_delta
    elif kind == HUNT_CROSSLEY:
        for k in range(n):
            force, by_delta, by_rate = hunt_crossley_force(delta[k], rate[k], numbers)
            N[k] = factor[k] * force
            slope[k] = factor[k] * by_delta
            viscous[k] = factor[k] * by_rate
    elif kind == KELVIN:
        for k in range(n):
            force, by_delta, by_rate = kelvin_force(delta[k], rate[k], numbers)
            N[k] = factor[k] * force
            slope[k] = factor[k] * by_delta
            viscous[k] = factor[k] * by_rate
    else:
        for k in range(n):
            force, by_delta, by_rate = tabulated_force(delta[k], rate[k], numbers, table)
            N[k] = factor[k] * force
            slope[k] = factor[k] * by_delta
            viscous[k] = factor[k] * by_rate


@kernel
def trend(numbers: FloatArray, table: FloatArray, delta: float, rate: float) -> float:
    """Return what has the sign of a rate-dependent law's force while there is an indentation, and no zero at its end.

    Where it is negative the law would pull, and there is no force.
    """
    kind = numbers[LAW_KIND]
    if kind == HUNT_CROSSLEY:
        return 1.0 + numbers[CROSSLEY_LOSS] * rate
    if kind == KELVIN:
        force, _, _ = kelvin_force(delta, rate, numbers)
        return force
    share, _, _ = tabulated_share(delta, rate, numbers, table)
    return share
