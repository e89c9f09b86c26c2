"""Films as GIF or MP4: each frame is a figure of matplotlib."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.faces.animation.film import ASPECT, Film
from wheeltapper.faces.panels import BLUE, COLOURS, RED, legend_above
from wheeltapper.ground.progress import report

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDE, TALL, DOTS = 7.2, 5.4, 90
"""Size of a frame in inches, and its resolution per inch."""
PALETTE = {
    "wheel": (BLUE, 0.35), "rail": ("0.45", 1.0), "deck": ("#b08d57", 1.0), "sleeper": ("0.65", 1.0),
    "body": (BLUE, 0.25), "faint": ("0.8", 1.0),
}  # fmt: skip
"""Colour and opacity of what moves."""
GREYS, SWATCH = 96, 40
"""Colours of a GIF, and the height of the strip in which those of the lines are beside a frame, pixels."""
SPOKES, TURN = 3, np.linspace(0.0, 2.0 * np.pi, 61)
MOST_NAMES = 8
"""Most wheels that are named above the force."""
IN_A_ROW = 6
"""Most words in a row above the force; where there are more, there are two rows."""


class Canvas:
    """A figure whose artists are moved from frame to frame."""

    def __init__(self, film: Film) -> None:
        from matplotlib.figure import Figure

        self.film = film
        self.figure: Figure = Figure(figsize=(WIDE, TALL), dpi=DOTS)
        self.figure.set_layout_engine("none")
        box = (0.11, 0.465, 0.86, 0.86 * ASPECT * WIDE / TALL)
        self.motion, self.force = self.figure.add_axes(box), self.figure.add_axes((0.11, 0.1, 0.86, 0.21))
        self._draw_force()
        self._begin_motion()
        self.figure.text(0.02, 0.975, film.title, fontsize=8, va="top")

    def _draw_force(self) -> None:
        axis, film = self.force, self.film
        for number, (line, name) in enumerate(zip(film.forces, film.names, strict=True)):
            label = name if len(film.names) > 1 and number < MOST_NAMES else None
            axis.plot(1e3 * film.force_times, line / 1e3, color=COLOURS[number % len(COLOURS)], linewidth=0.9,
                      label=label)  # fmt: skip
        axis.axhline(film.static / 1e3, color="0.5", linewidth=0.8, linestyle="--", label="static")
        spans = [(1e3 * a, 1e3 * (b - a)) for a, b in film.losses]
        if spans:
            over = axis.get_xaxis_transform()
            axis.broken_barh(spans, (0.0, 1.0), transform=over, color=RED, alpha=0.15, linewidth=0,
                             label="out of contact")  # fmt: skip
        axis.set(xlabel="time [ms]", ylabel="normal force [kN]", xlim=1e3 * film.force_times[[0, -1]])
        words = len(axis.get_legend_handles_labels()[0])
        legend_above(axis, IN_A_ROW if words <= IN_A_ROW else -(-words // 2))
        self.now = axis.axvline(0.0, color="0.2", linewidth=1.0)
        self.dots = [
            axis.plot([], [], "o", color=COLOURS[number % len(COLOURS)], markersize=5)[0]
            for number in range(len(film.forces))
        ]

    def _begin_motion(self) -> None:
        axis, film = self.motion, self.film
        axis.set(xlabel="position along the rail [m]", ylabel="height [mm]", ylim=(1e3 * film.low, 1e3 * film.high))
        if film.ruler:
            self._draw_ruler()
        axis.set_title(film.motion)
        axis.grid(False)
        self.areas: list[Any] = []
        for shape in film.shapes:
            colour, alpha = PALETTE[shape.colour]
            area: Any
            if shape.fill:
                (area,) = axis.fill([0.0, 0.0], [0.0, 0.0], facecolor=colour, alpha=alpha, edgecolor=colour)
            else:
                (area,) = axis.plot([], [], color=colour, linewidth=2.0)
            self.areas.append(area)
        self.rims = [axis.plot([], [], color="0.25", linewidth=1.2)[0] for _ in film.discs]
        self.spokes = [axis.plot([], [], color="0.25", linewidth=0.7)[0] for _ in film.discs]

    def _draw_ruler(self) -> None:
        """Draw a bar as long as a displacement in place of numbers, which would be wrong for the size of a body."""
        axis, film = self.motion, self.film
        axis.set(yticks=[], ylabel="")
        top = 1e3 * (film.high - 0.06 * (film.high - film.low))
        middle, beside = top - 500.0 * film.ruler, axis.get_yaxis_transform()
        axis.plot([0.02, 0.02], [top - 1e3 * film.ruler, top], "_-", color="0.2", transform=beside, markersize=6)
        axis.text(0.035, middle, f"displacement of {1e3 * film.ruler:g} mm", va="center", fontsize=8, transform=beside)

    def show(self, frame: int) -> None:
        """Move everything to where it is in a frame."""
        film = self.film
        left = float(film.left[frame])
        self.motion.set_xlim(left, left + film.width)
        bottom, top = 1e3 * film.low, 1e3 * film.high
        for shape, area in zip(film.shapes, self.areas, strict=True):
            x, y = shape.at(frame)
            if shape.fill in ("below", "above"):
                end = bottom - (top - bottom) if shape.fill == "below" else top + (top - bottom)  # out of sight
                x, y = np.concatenate([[x[0]], x, [x[-1]]]), np.concatenate([[end], 1e3 * y, [end]])
            else:
                y = 1e3 * y
            if shape.fill:
                area.set_xy(np.column_stack([x, y]))
            else:
                area.set_data(x, y)
        self._show_discs(frame)
        now = float(film.times[frame])
        self.now.set_xdata([1e3 * now, 1e3 * now])
        for dot, line in zip(self.dots, film.forces, strict=True):
            dot.set_data([1e3 * now], [np.interp(now, film.force_times, line) / 1e3])

    def _show_discs(self, frame: int) -> None:
        upward = 1e3 / self.film.exaggeration  # mm on the axis for each m that is as long on the other one
        for disc, rim, spokes in zip(self.film.discs, self.rims, self.spokes, strict=True):
            x, y, turned = float(disc.x[frame]), 1e3 * float(disc.y[frame]), float(disc.turn[frame])
            rim.set_data(x + disc.radius * np.cos(TURN), y + upward * disc.radius * (1.0 + np.sin(TURN)))
            angles = -turned + np.pi * np.arange(SPOKES) / SPOKES
            ends = 0.9 * disc.radius * np.array([-1.0, 1.0, np.nan])
            spokes.set_data(
                x + np.outer(np.cos(angles), ends).ravel(),
                y + upward * (disc.radius + np.outer(np.sin(angles), ends).ravel()),
            )

    def images(self) -> Iterator[NDArray[np.uint8]]:
        """Yield the frames as images, (height, width, 3)."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas: Any = FigureCanvasAgg(self.figure)
        count = len(self.film.times)
        for frame in range(count):
            self.show(frame)
            canvas.draw()
            report("drawing frames", frame + 1, count)
            yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def write_gif(film: Film, path: Path) -> None:
    """Write a film as GIF that goes on for ever."""
    from PIL import Image

    images = list(Canvas(film).images())
    held = _palette(images[0])
    first, *others = (Image.fromarray(one).quantize(palette=held, dither=Image.Dither.NONE) for one in images)
    pause = round(1e3 / film.frames_per_second)
    first.save(path, save_all=True, append_images=others, duration=pause, loop=0, optimize=False)


def _palette(image: NDArray[np.uint8]) -> Any:
    """Return an image with the colours of a GIF: those of a frame, thin lines' as much as those of large areas."""
    from matplotlib.colors import to_rgb
    from PIL import Image

    swatches = np.array([[255.0 * part for part in to_rgb(colour)] for colour in COLOURS]).astype(np.uint8)
    wide = np.repeat(np.resize(swatches, (1, image.shape[1], 3)), SWATCH, axis=0)
    return Image.fromarray(np.concatenate([image, wide])).quantize(GREYS, Image.Quantize.MEDIANCUT)


def write_mp4(film: Film, path: Path) -> None:
    """Write a film as MP4 by ffmpeg."""
    from matplotlib.animation import FFMpegWriter

    canvas = Canvas(film)
    writer = FFMpegWriter(
        fps=film.frames_per_second,  # type: ignore[arg-type]  # ffmpeg takes any rate
        extra_args=["-pix_fmt", "yuv420p", "-crf", "22"],
    )
    count = len(film.times)
    with writer.saving(canvas.figure, str(path), DOTS):
        for frame in range(count):
            canvas.show(frame)
            writer.grab_frame()
            report("drawing frames", frame + 1, count)
