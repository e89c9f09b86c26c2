"""A peer without events: diffrax in time over the whole motion in one go, on numbers of double precision.

The contact force max(δ, 0)^1.5 is part of one right-hand side, which is not smooth at a loss and an impact; steps end
at the borders of the pieces. It cannot say when contact is lost or made, nor where the force is largest: its answer is
the last state alone, and so is the error that it is judged by. Everything is compiled before the clock starts, one case
for itself or many with `vmap`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from problems import FloatArray, Outcome, Piece, Scaled

jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]

SOLVERS = {"Tsit5": diffrax.Tsit5, "Dopri8": diffrax.Dopri8}
Waves = tuple[tuple[Any, Any, Any, Any], ...]
"""Of each piece: where it stops, and its constant, sine and cosine."""


class Numbers(NamedTuple):
    """What a case consists of, as jax takes it."""

    stiffness: Any
    damping: Any
    frequency: Any
    pieces: Waves
    start: tuple[Any, Any]


def numbers_of(problem: Scaled) -> Numbers:
    """Return the numbers of a case."""
    pieces = tuple((float(p.stop), float(p.constant), float(p.sine), float(p.cosine)) for p in problem.pieces)
    start = (float(problem.root**2), float(problem.rate))
    return Numbers(float(problem.stiffness), float(problem.damping), float(problem.frequency), pieces, start)


def load(time: Any, numbers: Numbers, flat: Sequence[bool]) -> Any:
    """Return F(t); level pieces, as `flat` says, need no sine and cosine."""
    phase = numbers.frequency * time
    force: Any = None
    for (stop, constant, sine, cosine), is_flat in reversed(list(zip(numbers.pieces, flat, strict=True))):
        here = constant if is_flat else constant + sine * jnp.sin(phase) + cosine * jnp.cos(phase)
        force = here if force is None else jnp.where(time < stop, here, force)
    return force


def last_state(numbers: Numbers, pieces: Sequence[Piece], solver: str, tolerance: float) -> tuple[Any, Any]:
    """Return indentation and rate at the end."""
    flat = [piece.is_flat for piece in pieces]

    def rates(time: Any, state: tuple[Any, Any], numbers: Numbers) -> tuple[Any, Any]:
        delta, rate = state
        pressed = jnp.maximum(delta, 0.0)
        force = pressed * jnp.sqrt(pressed)
        return rate, load(time, numbers, flat) - numbers.stiffness * delta - numbers.damping * rate - force

    steps: Any = diffrax.PIDController(rtol=tolerance, atol=tolerance)
    borders = [piece[0] for piece in numbers.pieces[:-1]]
    if borders:
        steps = diffrax.ClipStepSizeController(steps, jump_ts=jnp.stack(borders))
    found = diffrax.diffeqsolve(
        diffrax.ODETerm(rates), SOLVERS[solver](), 0.0, numbers.pieces[-1][0], None, numbers.start, args=numbers,
        stepsize_controller=steps, saveat=diffrax.SaveAt(t1=True), max_steps=None,
    )  # fmt: skip
    delta, rate = found.ys
    return delta[0], rate[0]


def outcome(end: FloatArray) -> Outcome:
    """Return what is known without events."""
    nothing = np.empty(0)
    return Outcome(nothing, nothing, nothing, nothing, end)


class Diffrax:
    """One case with one of its solvers, at one relative and absolute tolerance."""

    def __init__(self, problem: Scaled, solver: str, tolerance: float) -> None:
        self._numbers = jax.tree.map(jnp.asarray, numbers_of(problem))
        self._march = jax.jit(lambda numbers: last_state(numbers, problem.pieces, solver, tolerance))

    def __call__(self) -> Any:
        """March the case once."""
        return jax.block_until_ready(self._march(self._numbers))  # type: ignore[no-untyped-call]

    def read(self, raw: Any) -> Outcome:
        """Return the last state."""
        return outcome(np.array(raw))


class DiffraxMany:
    """Many cases with the same kinds of pieces, marched side by side."""

    def __init__(self, problems: Sequence[Scaled], solver: str, tolerance: float) -> None:
        self._numbers = jax.tree.map(lambda *values: jnp.array(values), *map(numbers_of, problems))
        pieces = problems[0].pieces
        self._march = jax.jit(jax.vmap(lambda numbers: last_state(numbers, pieces, solver, tolerance)))

    def __call__(self) -> Any:
        """March all cases once."""
        return jax.block_until_ready(self._march(self._numbers))  # type: ignore[no-untyped-call]

    def read(self, raw: Any) -> list[Outcome]:
        """Return the last states."""
        return [outcome(end) for end in np.array(raw).T]
