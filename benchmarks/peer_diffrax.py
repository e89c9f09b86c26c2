"""A peer without events: diffrax (JAX), DOPRI8 in time over the whole motion, the contact force simply max(δ, 0)^1.5.

It is compiled before the clock starts, steps up to the borders between pieces, and returns the last state only: it
cannot say when contact is lost. So its accuracy is that of the last state, and no ratio at matched eN exists. Many
cells go at a time through `vmap`, on all cores.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from problems import FloatArray, Scaled

jax.config.update("jax_enable_x64", True)
COLUMNS = 11
"""Numbers of a cell: K, G, Ω, u and w at the start, both pieces' constant, sine and cosine (a single piece twice)."""


def numbers(problem: Scaled) -> FloatArray:
    """Return a cell's numbers, and where its pieces end: (COLUMNS + 2,)."""
    first, last = problem.pieces[0], problem.pieces[-1]
    waves = [value for piece in (first, last) for value in (piece.constant, piece.sine, piece.cosine)]
    head = [problem.stiffness, problem.damping, problem.frequency, problem.root, problem.rate]
    return np.array([*head, *waves, first.stop, last.stop])


def rates(time: Any, state: Any, cell: Any) -> Any:
    """Return the rates of the indentation and its rate."""
    delta, rate = state
    wave = jnp.where(time < cell[COLUMNS], cell[5:8], cell[8:11])
    load = wave[0] + wave[1] * jnp.sin(cell[2] * time) + wave[2] * jnp.cos(cell[2] * time)
    force = jnp.maximum(delta, 0.0) ** 1.5
    return jnp.stack([rate, load - cell[0] * delta - cell[1] * rate - force])


def last_state(tolerance: float) -> Callable[[Any], Any]:
    """Return the function from a cell's numbers to its last state."""

    def run(cell: Any) -> Any:
        border = cell[COLUMNS : COLUMNS + 1]
        steps = diffrax.ClipStepSizeController(diffrax.PIDController(rtol=tolerance, atol=tolerance), jump_ts=border)
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(rates), diffrax.Dopri8(), t0=0.0, t1=cell[COLUMNS + 1], dt0=None,
            y0=jnp.stack([cell[3] ** 2, cell[4]]), args=cell, stepsize_controller=steps, max_steps=10_000_000,
        )  # fmt: skip
        return found.ys[-1]

    return run


class Diffrax:
    """DOPRI8 at one tolerance, compiled for one cell or for many at a time."""

    def __init__(self, cells: FloatArray, tolerance: float) -> None:
        run = last_state(tolerance)
        self._cells = jnp.asarray(cells)
        self._run = jax.jit(jax.vmap(run) if cells.ndim == 2 else run)
        self()

    def __call__(self) -> FloatArray:
        """Return the last indentation and its rate, scaled, of each cell."""
        return np.asarray(self._run(self._cells))
