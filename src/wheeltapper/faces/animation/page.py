"""Films as pages of HTML: the shapes as numbers, and a few lines of script that draw them. Nothing else is loaded."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from wheeltapper.faces.animation.film import ASPECT, Film
from wheeltapper.faces.panels import COLOURS

MOST_SAMPLES = 1200
"""Most samples of a force; where there are more, the lowest and the highest of each group are kept."""
DIGITS = 5
"""Significant digits of a number in the page."""


def page_of(film: Film) -> str:
    """Return a film as a page of HTML."""
    template = files(__package__).joinpath("film.html").read_text(encoding="utf-8")
    data = json.dumps(_numbers(film), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    return (
        template.replace("%TITLE%", escape(film.title)).replace("%MOTION%", escape(film.motion)).replace("%DATA%", data)
    )


def write_page(film: Film, path: Path) -> None:
    """Write a film as a page of HTML."""
    path.write_text(page_of(film), encoding="utf-8")


def _numbers(film: Film) -> dict[str, Any]:
    """Return a film as plain numbers: m, mm for heights, ms and kN."""
    times, forces = _fewer(film)
    return {
        "frames": len(film.times), "rate": film.frames_per_second, "aspect": ASPECT, "width": film.width,
        "low": _rounded(1e3 * film.low), "high": _rounded(1e3 * film.high), "exaggeration": film.exaggeration,
        "left": _rounded(film.left), "times": _rounded(1e3 * film.times),
        "shapes": [
            {"x": _rounded(shape.x), "y": _rounded(1e3 * shape.y), "colour": shape.colour, "fill": shape.fill,
             "shift": None if shape.shift is None else _rounded(shape.shift * [1.0, 1e3])}
            for shape in film.shapes
        ],
        "discs": [
            {"x": _rounded(disc.x), "y": _rounded(1e3 * disc.y), "radius": disc.radius, "turn": _rounded(disc.turn)}
            for disc in film.discs
        ],
        "forceTimes": _rounded(1e3 * times), "forces": _rounded(forces / 1e3), "names": list(film.names),
        "static": _rounded(film.static / 1e3), "losses": _rounded(1e3 * film.losses), "ruler": 1e3 * film.ruler,
        "colours": ["#4a90c2", *COLOURS[1:3], "#8e8e8e", *COLOURS[4:7], "#c2b04a"],
    }  # fmt: skip


def _fewer(film: Film) -> tuple[Any, Any]:
    """Return times and forces with at most twice as many samples as are drawn, peaks among them."""
    count = len(film.force_times)
    if count <= 2 * MOST_SAMPLES:
        return film.force_times, film.forces
    groups = np.array_split(np.arange(count), MOST_SAMPLES)
    total = film.forces.sum(axis=0)
    kept = np.unique([pick(total[group]) + group[0] for group in groups for pick in (np.argmin, np.argmax)])
    return film.force_times[kept], film.forces[:, kept]


def _rounded(values: Any) -> Any:
    """Return numbers as lists, with a few digits of the largest of them."""
    held = np.asarray(values, dtype=float)
    largest = float(np.abs(held).max(initial=0.0))
    places = DIGITS - 1 - int(np.floor(np.log10(largest))) if largest > 0.0 else 0
    return (np.round(held, places) + 0.0).tolist()
