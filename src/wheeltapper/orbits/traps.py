"""Traps: neighbourhoods of stable orbits that a motion never leaves again.

At a point z of a stable orbit, the map M of one period has a norm in which its linear part shrinks every deviation: by
at least σ = sqrt(ρ), ρ the largest modulus of a multiplier. The trap is the largest of some balls in that norm on whose
surface, and on those of smaller balls, the map itself shrinks deviations too. The map of a motion is continuous and can
be reversed, so that it takes the inside of a closed surface to the inside of its image: the ball is mapped into itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.wheel.orbits import STATE_SIZE, TRAP_CENTRE, TRAP_COLUMNS, TRAP_NORM, TRAP_ORBIT, TRAP_REACH
from wheeltapper.orbits.section_map import FixedPoint, SectionMap, Wave

FloatArray = NDArray[np.float64]
RADII = 0.5 ** np.arange(13)
"""Radii of balls that are tried, in static indentations, the largest first."""
ON_CIRCLE, ON_SPHERE = 24, 160
"""Points of a surface of which the images are computed, without a deck and with one."""


def norm_of(slopes: FloatArray) -> tuple[FloatArray, float]:
    """Return a matrix L in whose norm |L·x| a map shrinks every deviation, and the factor by which it does at least.

    The longest deviation of norm one has the length one.
    """
    from scipy.linalg import solve_discrete_lyapunov

    factor = float(np.sqrt(np.abs(np.linalg.eigvals(slopes)).max()))
    form = solve_discrete_lyapunov((slopes / max(factor, 1e-3)).T, np.eye(len(slopes)))
    norm = np.linalg.cholesky(0.5 * (form + form.T)).T
    return norm / np.linalg.svd(norm)[1][-1], factor


def traps_of(each: SectionMap, wave: Wave, found: FixedPoint, number: int) -> FloatArray:
    """Return the traps of a stable orbit, one for each of its waves, (waves, TRAP_COLUMNS), in the program's units."""
    out = np.zeros((each.waves, TRAP_COLUMNS))
    states = np.vstack([found.state, found.image.trail[:-1]])
    for row, state in zip(out, states, strict=True):
        image = found.image if state is states[0] else each.image(wave, state)
        norm, factor = norm_of(image.slopes)
        radius = _radius(each, wave, state, norm, 0.5 * (1.0 + factor))
        row[TRAP_ORBIT], row[TRAP_REACH] = number, radius**2
        row[TRAP_CENTRE : TRAP_CENTRE + each.size] = state * wave.to_program
        full = np.eye(STATE_SIZE)
        full[: each.size, : each.size] = norm / wave.to_program
        row[TRAP_NORM:] = full.ravel()
    return out


def _radius(each: SectionMap, wave: Wave, state: FloatArray, norm: FloatArray, factor: float) -> float:
    """Return the radius of the largest ball that shrinks, with all smaller ones."""
    surface = _surface(each.size)
    shapes = np.linalg.solve(norm, surface.T).T
    around = (state + RADII[:, None, None] * shapes).reshape(-1, each.size)
    images = (each.marched(wave, around) - state).reshape(len(RADII), len(surface), each.size)
    sizes = np.linalg.norm(images @ norm.T, axis=2).max(axis=1) / RADII
    shrinks = np.isfinite(sizes) & (sizes <= factor)
    held = np.flatnonzero(~shrinks)
    first = held[-1] + 1 if len(held) else 0
    return float(RADII[min(first, len(RADII) - 1)])


def _surface(size: int) -> FloatArray:
    """Return points that are spread over the unit circle, or the unit sphere in four dimensions."""
    if size == 2:
        turn = 2.0 * np.pi * np.arange(ON_CIRCLE) / ON_CIRCLE
        return np.column_stack([np.cos(turn), np.sin(turn)])
    points = np.random.default_rng(0).normal(size=(ON_SPHERE, size))
    return np.asarray(points / np.linalg.norm(points, axis=1)[:, None])
