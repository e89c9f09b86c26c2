"""What a moving picture shows: shapes that move, a window that follows them, and the contact force beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ASPECT = 0.38
"""Height over width of the panel that shows the motion."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A line or an area; in the frame i it is (x[i] + shift[i, 0], y[i] + shift[i, 1]).

    Attributes
    ----------
    x, y
        (frames, points), or (points,) of a shape that keeps its form, m.
    colour
        Name of its colour: "wheel", "rail", "deck", "sleeper", "body", "faint".
    fill
        "": a line; "inside": an area; "below": everything below the line; "above": everything above it.
    shift
        (frames, 2) by how much it has moved, m; None: it does not move as a whole.
    """

    x: FloatArray
    y: FloatArray
    colour: str
    fill: str = ""
    shift: FloatArray | None = None

    def at(self, frame: int) -> tuple[FloatArray, FloatArray]:
        """Return the points of one frame, m."""
        x, y = (part[frame] if part.ndim == 2 else part for part in (self.x, self.y))
        return (x, y) if self.shift is None else (x + self.shift[frame, 0], y + self.shift[frame, 1])


@dataclass(frozen=True, eq=False)
class Disc:
    """A wheel that is drawn as a circle whatever the scales are; its lowest point is where it is.

    Attributes
    ----------
    x, y
        (frames,) place of the lowest point, m.
    radius
        m on the scale of x.
    turn
        (frames,) angle by which it has rolled, rad.
    """

    x: FloatArray
    y: FloatArray
    radius: float
    turn: FloatArray


@dataclass(frozen=True, eq=False)
class Film:
    """A moving picture.

    Attributes
    ----------
    title, motion
        Of the whole, and of the panel of the motion: how much slower, and how much higher than long.
    times
        (frames,) s.
    shapes, discs
        What moves, from back to front.
    left, width
        (frames,) left edge of the window, and its width, m.
    low, high
        Lower and upper edge of the window, m.
    force_times, forces
        (samples,) s and (lines, samples) N.
    names
        Of the lines.
    static
        Static force, N.
    losses
        (losses, 2) beginning and end of each loss of contact, s.
    frames_per_second
        Of the film.
    ruler
        Length of the bar that tells the scale of displacements, m, where bodies are drawn to the scale of lengths, so
        that the axis upwards has no numbers; 0: the axis tells heights.
    """

    title: str
    motion: str
    times: FloatArray
    shapes: tuple[Shape, ...]
    discs: tuple[Disc, ...]
    left: FloatArray
    width: float
    low: float
    high: float
    force_times: FloatArray
    forces: FloatArray
    names: tuple[str, ...]
    static: float
    losses: FloatArray
    frames_per_second: float
    ruler: float

    @property
    def exaggeration(self) -> float:
        """How many times higher a length is drawn upwards than along the rail."""
        return ASPECT * self.width / (self.high - self.low)


def in_words(factor: float) -> str:
    """Return a factor in words, with two digits: "66", "1.5", "0.02"."""
    return f"{float(f'{factor:.2g}'):g}"
