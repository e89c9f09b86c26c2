"""All laws by their numbers: the one place that lists them."""

from __future__ import annotations

from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.plastic_law import plastic_force
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general.laws.corners import cornered_force
from wheeltapper.march.general.laws.free_play import free_play_force
from wheeltapper.march.general.laws.hertz import hertz_force
from wheeltapper.march.general.laws.hunt_crossley import CROSSLEY_LOSS, hunt_crossley_force
from wheeltapper.march.general.laws.kelvin import kelvin_force
from wheeltapper.march.general.laws.linear import bonded_force, linear_force
from wheeltapper.march.general.laws.slider import slider_force
from wheeltapper.march.general.laws.tabulated import tabulated_forces, tabulated_share

(
    HERTZ, LINEAR_LAW, HUNT_CROSSLEY, TABULATED, KELVIN, TWO_SIDED, FREE_PLAY, PLASTIC, SLIDER, CORNERED_SPRING,
    CORNERED_DAMPER,
) = range(11)  # fmt: skip
SWITCHING = SLIDER, CORNERED_SPRING, CORNERED_DAMPER
"""Laws of elements between bodies that go from stretch to stretch (`general/switching.py`)."""
LAW_KIND, LAW_RATED, LAW_PULLS = 0, 11, 12
"""Columns of a law's numbers: its kind, 1 where the force depends on the rate, and 1 where it also pulls, so that
contact is never lost; the others are the law's own."""
LAW_NUMBERS = 13


@uncounted_kernel
def forces(
    numbers: FloatArray, table: FloatArray, stretch: float, n: int, delta: FloatArray, rate: FloatArray,
    left: FloatArray, factor: FloatArray, N: FloatArray, slope: FloatArray, viscous: FloatArray,
) -> None:  # fmt: skip
    """Write forces at n nodes, times the factor of the path, and their derivatives by indentation and rate.

    `stretch` is that of a law with kinks, and `left` the indentation that earlier wheels have left.
    """
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
    elif kind == TWO_SIDED:
        for k in range(n):
            force, by_delta = bonded_force(delta[k], numbers)
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
    elif kind == FREE_PLAY:
        for k in range(n):
            N[k], viscous[k] = free_play_force(rate[k], numbers)
            slope[k] = 0.0
    elif kind == SLIDER:
        for k in range(n):
            N[k], slope[k] = slider_force(delta[k], stretch, numbers)
    elif kind == CORNERED_SPRING:
        for k in range(n):
            N[k], slope[k] = cornered_force(delta[k], stretch, numbers, table)
    elif kind == CORNERED_DAMPER:
        for k in range(n):
            N[k], viscous[k] = cornered_force(rate[k], stretch, numbers, table)
            slope[k] = 0.0
    elif kind == PLASTIC:
        for k in range(n):
            force, by_delta = plastic_force(delta[k], left[k], stretch, numbers, table)
            N[k] = factor[k] * force
            slope[k] = factor[k] * by_delta
    else:
        tabulated_forces(n, delta, rate, factor, numbers, table, N, slope, viscous)


@uncounted_kernel
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
