"""Any Python function as an irregularity of the rail."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import field_serializer, model_validator

from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.course import Course, Stretch, level
from wheeltapper.describe.noun import Length

NODES = np.cos(np.pi * (np.arange(13) + 0.5) / 13)
TO_MONOMIALS = np.linalg.inv(np.polynomial.chebyshev.chebvander(NODES, 12))


class Profile(Irregularity):
    """The height of the rail as a function of position, smooth between its breakpoints.

    Slope and curvature are taken from local Chebyshev interpolants that never reach across a breakpoint.

    Parameters
    ----------
    function
        From x in m to the height in m; an array at once, or one number after the other.
    breakpoints
        Positions in m at which the height or one of its derivatives jumps.
    start, end
        The function is used on start ≤ x ≤ end, m; elsewhere the rail is level at zero. None for without end.
    scale
        Length in m over which the function varies; by default a thousandth of the shortest smooth part, or 1 mm.
    """

    function: Callable[..., Any]
    breakpoints: tuple[Length, ...] = ()
    start: Length | None = None
    end: Length | None = None
    scale: Length | None = None

    @field_serializer("function")
    def _refuse_text(self, value: Any) -> str:
        raise ValueError("a Profile holds a Python function and cannot be written to a file; sample it into Measured")

    @model_validator(mode="after")
    def _ordered(self) -> Profile:
        edges = [-inf if self.start is None else self.start, *self.breakpoints, inf if self.end is None else self.end]
        if any(b <= a for a, b in zip(edges[:-1], edges[1:], strict=True)):
            raise ValueError(f"found start, breakpoints, end = {edges}; allowed: rising positions")
        return self

    def moved(self, distance: float) -> Profile:
        """Return the same profile farther along the rail (m)."""
        function = self.function
        moved = super().moved(distance) if self.start is not None or self.end is not None else self
        shifted = {"function": lambda x: function(x - distance)}
        return moved.model_copy(update=shifted | {"breakpoints": tuple(x + distance for x in self.breakpoints)})

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        first = -inf if self.start is None else self.start
        last = inf if self.end is None else self.end
        edges = [first, *self.breakpoints, last]
        smooth = [b - a for a, b in zip(edges[:-1], edges[1:], strict=True)]
        width = self.scale or min(min(smooth) / 1000.0, 1e-3)
        parts = [self._stretch(a, b, width) for a, b in zip(edges[:-1], edges[1:], strict=True)]
        if np.isfinite(first):
            parts.insert(0, level(-inf, first))
        if np.isfinite(last):
            parts.append(level(last, inf))
        x = np.linspace(max(first, -1e3), min(last, 1e3), 4097)
        height = float(np.abs(self._call(x)).max())
        return Course(tuple(parts), height or 1e-6)

    def _call(self, x: NDArray[Any]) -> NDArray[Any]:
        x = np.asarray(x)
        try:
            out = np.asarray(self.function(x))
        except (TypeError, ValueError):
            out = np.empty(0)
        if out.shape != x.shape:
            out = np.array([self.function(v) for v in x.ravel()]).reshape(x.shape)
        return out

    def _stretch(self, start: float, end: float, width: float) -> Stretch:
        def local(x: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
            middle = np.clip(x, start + width, end - width)
            values = self._call((middle[..., None] + width * NODES).ravel()).reshape(*middle.shape, len(NODES))
            return values @ TO_MONOMIALS.T, (x - middle) / width

        def derivative(x: NDArray[Any], order: int) -> NDArray[Any]:
            coefficients, xi = local(np.asarray(x, dtype=float))
            changed = np.polynomial.chebyshev.chebder(np.moveaxis(coefficients, -1, 0), order)
            return np.asarray(np.polynomial.chebyshev.chebval(xi, changed, tensor=False)) / width**order

        return Stretch(start, end, self._call, lambda x: derivative(x, 1), lambda x: derivative(x, 2))
