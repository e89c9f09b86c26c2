"""What is wrong with a picture to a reader's eye: labels, units, legends over data, words cut off, coarse lines."""

import re

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

NO_UNIT = re.compile(
    r"N/N₀|over|ratio|rate$|probability|/noise|/m₀|/c₀|losses of contact|impacts in|^wheel$|^pass|^size$|determinant"
    r"|multiplier|^waves"
)
"""Labels of pure numbers, or that name their unit in words."""
CODE = re.compile(r"[a-z]\.[a-z0-9]|[a-z]_[a-z]|\bnan\b", re.IGNORECASE)
"""Paths and names of fields, and numbers that are none."""
FEWEST = 50
"""Fewest points of a curve that is drawn as a line without marks."""


def flaws(figure):
    """Return what is wrong with a figure, as sentences."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    found = [flaw for axis in figure.axes for flaw in [*_labels(axis), *_legend(axis, renderer), *_lines(axis)]]
    titles = [axis.get_title(loc="left") for axis in figure.axes] + [figure.get_suptitle()]
    found += [f"the title {text!r} holds code" for text in titles if _code(text)]
    return [*found, *_room(figure, renderer)]


def _room(figure, renderer):
    """Yield titles and labels that are cut off by the figure's edge, or lie on those of other axes."""
    words = [
        text
        for axis in figure.axes
        for text in (axis.title, axis._left_title, axis._right_title, axis.xaxis.label, axis.yaxis.label)
    ]
    words = [text for text in words if text.get_text() and text.get_visible()]
    words += [figure._suptitle] if figure.get_suptitle() else []
    boxes = [text.get_window_extent(renderer) for text in words]
    for number, (text, box) in enumerate(zip(words, boxes, strict=True)):
        if box.x0 < -1 or box.x1 > figure.bbox.width + 1 or box.y0 < -1 or box.y1 > figure.bbox.height + 1:
            yield f"{text.get_text()!r} is cut off"
        for other, beside in zip(words[:number], boxes[:number], strict=True):
            if box.overlaps(beside):
                yield f"{text.get_text()!r} lies on {other.get_text()!r}"


def _code(text):
    return bool(CODE.search(re.sub(r"\$[^$]*\$", "", text)))


def _labels(axis):
    shared = axis.get_shared_x_axes().get_siblings(axis)
    x = axis.get_xlabel() or next((one.get_xlabel() for one in shared if one.get_xlabel()), "")
    if not x and any(tick.get_text() for tick in axis.get_xticklabels()):
        x = next((one.get_xlabel() for one in axis.figure.axes if one.get_xlabel()), "")
    y = axis.get_ylabel() or next((one.get_ylabel() for one in axis.figure.axes if one.get_ylabel()), "")
    beside = axis.get_shared_y_axes().get_siblings(axis)
    named = any(re.search(r"[a-z]", tick.get_text()) for one in beside for tick in one.get_yticklabels())
    for text, needed in ((x, axis.get_label() != "<colorbar>"), (y, not named)):
        if needed and not text:
            yield "an axis has no label"
        elif needed and not re.search(r"\[[^\]]+\]", text) and not NO_UNIT.search(text):
            yield f"the label {text!r} has no unit"
        if _code(text):
            yield f"the label {text!r} holds code"
    offsets = [one.get_offset_text().get_text() for one in (axis.xaxis, axis.yaxis)]
    if any(text.startswith(("+", "−", "-")) for text in offsets):
        yield f"the axis of {y!r} has an offset"
    for ticked in (axis.xaxis, axis.yaxis):
        ticks = [one.label1 for one in [*ticked.get_major_ticks(), *ticked.get_minor_ticks()]]
        boxes = [one.get_window_extent() for one in ticks if one.get_visible() and one.get_text()]
        if any(one.overlaps(other) for i, one in enumerate(boxes) for other in boxes[:i]):
            yield f"tick labels of {x!r}, {y!r} collide"


def _legend(axis, renderer):
    legend = axis.get_legend()
    if legend is None:
        return
    box = legend.get_window_extent(renderer)
    for line in axis.get_lines():
        points = line.get_transform().transform(np.column_stack([line.get_xdata(), line.get_ydata()]).astype(float))
        points = points[np.isfinite(points).all(axis=1)]
        inside = (points > [box.x0, box.y0]).all(axis=1) & (points < [box.x1, box.y1]).all(axis=1)
        if (inside & _shown(axis, points)).any():
            yield f"the legend covers {line.get_label()!r}"
    title = axis.title if axis.title.get_text() else axis._left_title
    if title.get_text() and title.get_window_extent(renderer).overlaps(box):
        yield f"the legend covers the title {title.get_text()!r}"
    if any(_code(text.get_text()) for text in legend.get_texts()):
        yield "the legend holds code"


def _shown(axis, points):
    box = axis.bbox
    return ((points >= [box.x0, box.y0]) & (points <= [box.x1, box.y1])).all(axis=1)


def _lines(axis):
    for line in axis.get_lines():
        count = len(line.get_xdata())
        plain = line.get_marker() in ("None", None, "") and line.get_drawstyle() == "default"
        straight = count <= 2 or line.get_linestyle() == "None"
        if plain and not straight and count < FEWEST:
            yield f"the curve {line.get_label()!r} has {count} points"
