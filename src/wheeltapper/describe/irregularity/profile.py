"""Any Python function as an irregularity of the rail."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import inf
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import field_serializer, model_validator

from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.course import Course, Stretch, level
from wheeltapper.describe.irregularity.interpolants import Interpolants
from wheeltapper.describe.noun import Length
from wheeltapper.ground.errors import InputError


def _function_error(found: str) -> InputError:
    return InputError("", "function", found, "a function from position in m to height in m, a finite real number each")


def _example_heights(x: NDArray[Any]) -> Any:
    return 1e-4 * np.sin(20.0 * x) ** 2


class Profile(Irregularity):
    """The height of the rail as a function of position, smooth between its breakpoints.

    Slope and curvature are taken from local Chebyshev interpolants that never reach across a breakpoint. A jump that is
    not among the breakpoints is refused when a run meets it. A kink leads to short pieces, and a note says so.

    Parameters
    ----------
    function
        Function that returns the height in m at x in m, for a whole array or for one number at a time.
    breakpoints
        Positions in m at which the height or one of its derivatives jumps.
    start, end
        The function is used on start ≤ x ≤ end, m; elsewhere the rail is level at zero. None: without end.
    scale
        Length in m over which the function varies; by default a thousandth of the shortest smooth part, at most 1 mm.
    """

    example: ClassVar[dict[str, Any]] = {"function": _example_heights, "breakpoints": (0.2,)}
    function: Callable[..., Any]
    breakpoints: tuple[Length, ...] = ()
    start: Length | None = None
    end: Length | None = None
    scale: Length | None = None

    @field_serializer("function")
    def _refuse_text(self, value: Any) -> str:
        raise ValueError("a Profile holds a Python function and cannot be written to a file; sample it into Measured")

    @model_validator(mode="after")
    def _sorted_breakpoints(self) -> Profile:
        edges = [-inf if self.start is None else self.start, *self.breakpoints, inf if self.end is None else self.end]
        if any(b <= a for a, b in zip(edges[:-1], edges[1:], strict=True)):
            raise InputError("", "", f"start, breakpoints, end = {edges}", "rising positions")
        return self

    def moved(self, distance: float) -> Profile:
        """Return the same profile farther along the rail (m)."""
        function = self.function
        moved = super().moved(distance) if self.start is not None or self.end is not None else self
        shifted = {"function": lambda x: function(x - distance)}
        return moved.model_copy(update=shifted | {"breakpoints": tuple(x + distance for x in self.breakpoints)})

    def span(self, start: float, end: float) -> float:
        """Return the highest less the lowest of many heights from start to end, m."""
        return float(np.ptp(self._checked_values(np.linspace(start, end, 4097))))

    def span_given(self, end: float) -> float:
        """Return the span of the heights from x = 0 to x = end (m)."""
        first, last = max(self.start or 0.0, 0.0), end if self.end is None else min(self.end, end)
        return self.span(first, last) if first < last else 0.0

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        first = -inf if self.start is None else self.start
        last = inf if self.end is None else self.end
        edges = [first, *self.breakpoints, last]
        smooth = [b - a for a, b in zip(edges[:-1], edges[1:], strict=True)]
        width = self.scale or min(min(smooth) / 1000.0, 1e-3)
        parts = [self._smooth_stretch(a, b, width) for a, b in zip(edges[:-1], edges[1:], strict=True)]
        if np.isfinite(first):
            parts.insert(0, level(-inf, first))
        if np.isfinite(last):
            parts.append(level(last, inf))
        height = 0.0
        if np.isfinite(last - first):  # otherwise it follows from the run
            height = self.span(first, last)
        return Course(tuple(parts), height or 1e-6, sampled=True)

    def _checked_values(self, x: NDArray[Any]) -> NDArray[Any]:
        x = np.asarray(x)
        try:
            out = self._function_values(x)
        except InputError:
            raise
        except Exception as error:
            raise _function_error(f"a function that raises {type(error).__name__}: {error}") from error
        if out.dtype.kind not in ("biufc" if np.iscomplexobj(x) else "biuf"):
            raise _function_error(
                f"a function that returns {out.ravel()[0]!r}" if out.size else "a function without values"
            )
        lost = np.flatnonzero(~np.isfinite(out.ravel()))
        if len(lost):
            raise _function_error(f"a function that is {out.ravel()[lost[0]]:g} at x = {x.ravel()[lost[0]].real:.9g} m")
        return out if out.dtype.kind in "fc" else out.astype(float)

    def _function_values(self, x: NDArray[Any]) -> NDArray[Any]:
        """Return the values of the function, called with an array, or with one number after the other."""
        try:
            out = np.asarray(self.function(x))
        except (TypeError, ValueError):
            out = np.empty(0)
        if out.shape == x.shape:
            return out
        each = [np.asarray(self.function(v)) for v in x.ravel()]
        wrong = next((one for one in each if one.shape != ()), None)
        if wrong is not None:
            raise _function_error(f"a function that returns an array of shape {wrong.shape} for one position")
        return np.array(each).reshape(x.shape)

    def _smooth_stretch(self, start: float, end: float, width: float) -> Stretch:
        first, last = np.nextafter(start, inf), np.nextafter(end, -inf)

        def value(x: NDArray[Any]) -> NDArray[Any]:  # at a breakpoint, the function may take the other side's value
            return self._checked_values(x if np.iscomplexobj(x) else np.clip(x, first, last))

        inside = Interpolants(self._checked_values, start, end, width)
        slope, curvature = (partial(inside.derivative, order=order) for order in (1, 2))
        return Stretch(start, end, value, slope, curvature, scatter=inside.scatter)
