"""A figure of matplotlib as one of plotly: the same lines, areas and words, to zoom into and to read values from.

Each picture is drawn once, by matplotlib; here its artists are read back in the units of their axes. A kind of artist
that is not in `TRACES` is refused, so that no part of a picture is left out in silence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]
Trace = dict[str, Any]
INSTALL = "plotly, which is not installed"
HOW = "False, or after: pip install 'wheeltapper[interactive]'"
MARKS = {
    "o": "circle", ".": "circle", "s": "square", "v": "triangle-down", "^": "triangle-up", "d": "diamond-tall",
    "D": "diamond", "x": "x", "X": "x", "+": "cross", "P": "cross", "|": "line-ns-open", "_": "line-ew-open",
    "*": "star",
}  # fmt: skip
DASHES = {"-": "solid", "--": "dash", ":": "dot", "-.": "dashdot", "None": "solid", "": "solid"}
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ margin: 8px; overflow-x: auto; }}
@media screen and (prefers-color-scheme: dark) {{
  body {{ background: #1a1a1a; }}
  .plotly-graph-div {{ filter: invert(0.9) hue-rotate(180deg); }}
}}
</style>
</head>
<body>
{drawn}
</body>
</html>
"""
"""A page around a picture. In the dark its lightness is turned round, so that lines and words stay apart from it."""
ARROW = 9.0
"""Half the length of an arrow, in pixels of matplotlib."""


def check_plotly(path: Path | None) -> None:
    """Refuse a picture that plotly cannot make here."""
    if find_spec("plotly") is None:
        raise InputError("", "interactive", INSTALL, HOW)
    if path is not None and path.suffix.lower() not in (".html", ".htm"):
        raise InputError(str(path), "path", f"the suffix {path.suffix!r} of an interactive picture", ".html")


def interactive_figure(figure: Figure, path: Path | None = None) -> Any:
    """Return a figure as one of plotly, and save it as a page of HTML that needs no network."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from plotly import graph_objects

    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()  # places and limits are known then
    out = graph_objects.Figure()
    layout: dict[str, Any] = {"template": "plotly_white", "annotations": [], "hovermode": "closest"}
    wide, tall = figure.get_size_inches() * 96.0
    title = figure.get_suptitle().replace("\n", "<br>")
    layout |= {"width": float(wide), "height": float(tall) + 60.0, "title": {"text": title, "font": {"size": 14}}}
    layout["margin"] = {"l": 20, "r": 20, "t": 70, "b": 20}
    named: set[str] = set()
    for number, axis in enumerate(figure.axes, 1):
        own = "" if number == 1 else str(number)
        layout |= _axes_layout(figure, axis, own)
        layout["annotations"] += list(_words(axis, own))
        for trace in traces_of(axis):
            name = trace.get("name") or ""
            trace |= {"xaxis": f"x{own}", "yaxis": f"y{own}", "showlegend": bool(name) and name not in named}
            named.add(name)
            out.add_trace(trace)
    for legend in figure.legends:
        layout["annotations"].append(_legend_below(legend))
        layout["margin"]["b"] += 14 * len(legend.get_texts())
        layout["height"] += 14.0 * len(legend.get_texts())
    out.update_layout(layout)
    if path is not None:
        try:
            path.write_text(page_of(out, title), encoding="utf-8")
        except OSError as error:
            raise InputError(str(path), "path", f"a place that cannot be written ({error})", "a writable .html") from (
                error
            )
    return out


def page_of(figure: Any, title: str) -> str:
    """Return a figure of plotly as a page of HTML that loads nothing; its script, some megabytes, is in it."""
    drawn = figure.to_html(full_html=False, include_plotlyjs=True)
    return PAGE.format(title=escape(title.replace("<br>", "; ")) or "picture", drawn=drawn)


def _legend_below(legend: Any) -> dict[str, Any]:
    """Return the words of a figure's own legend, with its marks, as an annotation below all panels."""
    marks = [str(getattr(handle, "get_marker", lambda: "")()).strip("$") for handle in legend.legend_handles]
    both = zip(marks, legend.get_texts(), strict=True)
    lines = [text.get_text() if mark in ("", "None") else f"{mark}: {text.get_text()}" for mark, text in both]
    return {
        "text": "<br>".join(lines), "xref": "paper", "yref": "paper", "x": 0.0, "y": 0.0, "yshift": -40,
        "xanchor": "left", "yanchor": "top", "align": "left", "showarrow": False, "font": {"size": 10},
    }  # fmt: skip


def _axes_layout(figure: Figure, axis: Axes, own: str) -> dict[str, Any]:
    box, whole = axis.get_window_extent(), figure.bbox
    x = [max(box.x0 / whole.width, 0.0), min(box.x1 / whole.width, 1.0)]
    y = [max(box.y0 / whole.height, 0.0), min(box.y1 / whole.height, 1.0)]
    out = {
        f"xaxis{own}": _one_axis(axis.xaxis, axis.get_xlim(), axis.get_xscale(), axis.get_xlabel(), x, f"y{own}"),
        f"yaxis{own}": _one_axis(axis.yaxis, axis.get_ylim(), axis.get_yscale(), axis.get_ylabel(), y, f"x{own}"),
    }
    if str(axis.yaxis.get_label_position()) == "right":  # a second axis over a panel
        twin = next((one for one in axis.figure.axes if one is not axis and one.bbox.bounds == axis.bbox.bounds), None)
        if twin is not None:
            number = figure.axes.index(twin) + 1
            out[f"yaxis{own}"] |= {"overlaying": f"y{'' if number == 1 else number}", "side": "right"}
            out[f"xaxis{own}"] |= {"overlaying": f"x{'' if number == 1 else number}", "visible": False}
    return out


def _one_axis(
    axis: Any, limits: tuple[float, float], scale: str, label: str, domain: list[float], anchor: str
) -> dict[str, Any]:
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    logarithmic = scale == "log"
    out: dict[str, Any] = {
        "domain": domain, "anchor": anchor, "title": {"text": label, "standoff": 4, "font": {"size": 12}},
        "range": list(np.log10(limits)) if logarithmic else list(limits), "type": "log" if logarithmic else "linear",
        "showline": True, "linecolor": "#444", "zeroline": False, "ticks": "outside",
    }  # fmt: skip
    if isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter):
        ticks = [
            (place, text.get_text()) for place, text in zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=False)
        ]
        out |= {"tickmode": "array", "tickvals": [p for p, _ in ticks], "ticktext": [t for _, t in ticks]}
    return out


def _words(axis: Axes, own: str) -> Iterator[dict[str, Any]]:
    """Yield the title of a panel and the words in it as annotations."""
    title = axis.get_title(loc="left") or axis.get_title(loc="center")
    if title:
        yield {
            "text": title.replace("\n", "<br>"), "xref": f"x{own} domain", "yref": f"y{own} domain", "x": 0.0, "y": 1.0,
            "xanchor": "left", "yanchor": "bottom", "showarrow": False, "font": {"size": 12},
        }  # fmt: skip
    for text in axis.texts:
        place = _in_data(axis, np.array([text.get_unitless_position()]), text.get_transform())[0]
        if text.get_text() and np.isfinite(place).all() and not text.get_text().startswith("$"):
            scales = axis.get_xscale(), axis.get_yscale()
            at = zip(getattr(text, "xy", place), scales, strict=True)
            x, y = (float(np.log10(value)) if scale == "log" else float(value) for value, scale in at)
            yield {
                "text": text.get_text().replace("\n", "<br>"), "xref": f"x{own}", "yref": f"y{own}", "x": x, "y": y,
                "showarrow": False, "font": {"size": 10}, "yanchor": "bottom",
            }  # fmt: skip


# -- artists ----------------------------------------------------------------------------------------------------------


def traces_of(axis: Axes) -> Iterator[Trace]:
    """Yield the traces of all that is drawn in a panel, from back to front.

    Raises
    ------
    InputError
        If a kind of artist is not known.
    """
    artists = [*axis.images, *axis.collections, *axis.patches, *axis.lines]
    for artist in sorted(artists, key=lambda one: one.get_zorder()):
        if artist.get_visible():
            for kind in type(artist).__mro__:
                if kind.__name__ in TRACES:
                    yield from TRACES[kind.__name__](axis, artist)
                    break
            else:
                raise InputError("", "interactive", f"a picture with a {type(artist).__name__}", "False for this one")


def _in_data(axis: Axes, points: FloatArray, transform: Any) -> FloatArray:
    """Return points of an artist in the units of the axis."""
    from matplotlib.transforms import IdentityTransform

    if transform == axis.transData:
        return np.asarray(points, dtype=float)
    shown = points if isinstance(transform, IdentityTransform) else transform.transform(points)
    return np.asarray(axis.transData.inverted().transform(shown), dtype=float)


def _colour(given: Any, alpha: float | None = None) -> str:
    from matplotlib.colors import to_rgba

    r, g, b, a = to_rgba(given, alpha)
    return f"rgba({r * 255:.0f},{g * 255:.0f},{b * 255:.0f},{a:.3g})"


def _label(artist: Any) -> str:
    label = str(artist.get_label() or "")
    return "" if label.startswith("_") else label


def _scatter(x: Any, y: Any, **more: Any) -> Trace:
    return {"type": "scatter", "x": np.asarray(x, dtype=float), "y": np.asarray(y, dtype=float)} | more


def _of_line(axis: Axes, line: Any) -> Iterator[Trace]:
    points = _in_data(axis, np.column_stack([line.get_xdata(), line.get_ydata()]).astype(float), line.get_transform())
    mark = MARKS.get(str(line.get_marker()))
    drawn = line.get_linestyle() not in ("None", "", " ")
    mode = "+".join([*(["lines"] if drawn else []), *(["markers"] if mark else [])])
    if not mode:
        return
    colour = _colour(line.get_color(), line.get_alpha())
    style = {"color": colour, "width": 1.3 * line.get_linewidth(), "dash": DASHES.get(line.get_linestyle(), "solid")}
    if line.get_drawstyle() == "steps-post":
        style["shape"] = "hv"
    more = {"marker": {"color": colour, "symbol": mark, "size": 1.4 * line.get_markersize()}} if mark else {}
    yield _scatter(*points.T, mode=mode, line=style, name=_label(line), **more)


def _polygons(axis: Axes, paths: Any, transform: Any, fill: str, edge: str, name: str) -> Iterator[Trace]:
    """Yield one trace with all polygons of a collection."""
    parts: list[FloatArray] = []
    back = axis.transData.inverted()
    for path in paths:  # curves become polygons in pixels, where they are fine enough
        for polygon in transform.transform_path(path).to_polygons(closed_only=False):
            parts += [np.asarray(back.transform(polygon), dtype=float), np.full((1, 2), np.nan)]
    if parts:
        x, y = np.concatenate(parts).T
        line = {"color": edge, "width": 1.0}
        yield _scatter(x, y, mode="lines", fill="toself", fillcolor=fill, line=line, name=name, hoverinfo="skip")


def _of_patch(axis: Axes, patch: Any) -> Iterator[Trace]:
    fill = _colour(patch.get_facecolor()) if patch.get_fill() else "rgba(0,0,0,0)"
    edge = _colour(patch.get_edgecolor())
    path = patch.get_path()
    yield from _polygons(axis, [path], patch.get_transform(), fill, edge, _label(patch))


def _of_polygons(axis: Axes, found: Any) -> Iterator[Trace]:
    faces, edges = found.get_facecolor(), found.get_edgecolor()
    hatched = bool(found.get_hatch())
    fill = _colour(faces[0]) if len(faces) else "rgba(128,128,128,0.25)" if hatched else "rgba(0,0,0,0)"
    edge = _colour(edges[0]) if len(edges) else "rgba(0,0,0,0)"
    yield from _polygons(axis, found.get_paths(), found.get_transform(), fill, edge, _label(found))


def _of_segments(axis: Axes, found: Any) -> Iterator[Trace]:
    parts: list[FloatArray] = []
    for segment in found.get_segments():
        points = np.asarray(segment, dtype=float).reshape(-1, 2)  # what is not known has none
        if len(points):
            parts += [_in_data(axis, points, found.get_transform()), np.full((1, 2), np.nan)]
    if parts:
        style = {"color": _colour(found.get_edgecolor()[0]), "width": 1.3 * float(found.get_linewidth()[0])}
        yield _scatter(*np.concatenate(parts).T, mode="lines", line=style, name=_label(found))


def _of_dots(axis: Axes, found: Any) -> Iterator[Trace]:
    points = _in_data(axis, np.asarray(found.get_offsets(), dtype=float), found.get_offset_transform())
    colours = [_colour(one) for one in found.get_facecolor()]
    marker = {"color": colours if len(colours) > 1 else colours[0], "size": 1.3 * float(np.sqrt(found.get_sizes()[0]))}
    more = {"text": [f"{value:.5g}" for value in found.get_array()]} if found.get_array() is not None else {}
    yield _scatter(*points.T, mode="markers", marker=marker, name=_label(found), **more)


def _of_contours(axis: Axes, found: Any) -> Iterator[Trace]:
    filled = bool(found.filled)
    for level, path, edge in zip(found.levels, found.get_paths(), _each(found.get_edgecolor(), found), strict=False):
        for polygon in path.to_polygons(closed_only=False):
            x, y = np.asarray(polygon, dtype=float).T
            if filled:
                yield _scatter(x, y, mode="lines", fill="toself", fillcolor="rgba(128,128,128,0.25)",
                               line={"width": 0}, hoverinfo="skip")  # fmt: skip
            else:
                yield _scatter(x, y, mode="lines", line={"color": _colour(edge), "width": 1.3}, text=f"{level:.4g}",
                               hoverinfo="text+x+y")  # fmt: skip


def _each(colours: Any, found: Any) -> list[Any]:
    held = list(colours) or ["black"]
    return [held[number % len(held)] for number in range(len(found.get_paths()))]


def _of_arrows(axis: Axes, found: Any) -> Iterator[Trace]:
    middle = axis.transData.transform(np.asarray(found.XY, dtype=float))
    way = np.column_stack([np.ma.filled(found.U, np.nan), np.ma.filled(found.V, np.nan)]) * ARROW
    ends = np.stack([middle - way, middle + way, np.full_like(middle, np.nan)], axis=1).reshape(-1, 2)
    colour = _colour(found.get_facecolor()[0])
    tips = axis.transData.inverted().transform(middle + way)
    yield _scatter(*axis.transData.inverted().transform(ends).T, mode="lines", line={"color": colour, "width": 1.2})
    yield _scatter(*tips.T, mode="markers", marker={"color": colour, "size": 4, "symbol": "circle"}, hoverinfo="skip")


def _of_image(axis: Axes, image: Any) -> Iterator[Trace]:
    values: FloatArray = np.ma.filled(np.ma.asarray(image.get_array(), dtype=float), np.nan)
    left, right, bottom, top = image.get_extent()
    rows, columns = values.shape[:2]
    if values.ndim == 2:
        x = left + (np.arange(columns) + 0.5) * (right - left) / columns
        y = (top if image.origin == "upper" else bottom) + (np.arange(rows) + 0.5) * (
            (bottom - top if image.origin == "upper" else top - bottom) / rows
        )
        yield _heat(image, x, y, values)


def _of_mesh(axis: Axes, mesh: Any) -> Iterator[Trace]:
    corners = np.asarray(mesh.get_coordinates(), dtype=float)
    values: FloatArray = np.ma.filled(np.ma.asarray(mesh.get_array(), dtype=float), np.nan)
    shape = corners.shape[0] - 1, corners.shape[1] - 1
    if values.size == corners.shape[0] * corners.shape[1]:  # shaded between corners
        yield _heat(mesh, corners[0, :, 0], corners[:, 0, 1], values.reshape(corners.shape[:2]))
    else:
        yield _heat(mesh, corners[0, :, 0], corners[:, 0, 1], values.reshape(shape))


def _heat(found: Any, x: FloatArray, y: FloatArray, values: FloatArray) -> Trace:
    low, high = found.get_clim()
    scale = [[share, _colour(found.get_cmap()(share))] for share in np.linspace(0.0, 1.0, 9)]
    return {"type": "heatmap", "x": x, "y": y, "z": values, "colorscale": scale, "zmin": low, "zmax": high,
            "showscale": False}  # fmt: skip


TRACES: dict[str, Callable[[Axes, Any], Iterator[Trace]]] = {
    "AxesImage": _of_image,
    "ContourSet": _of_contours,
    "Line2D": _of_line,
    "LineCollection": _of_segments,
    "Patch": _of_patch,
    "PathCollection": _of_dots,
    "PolyCollection": _of_polygons,
    "FillBetweenPolyCollection": _of_polygons,
    "QuadMesh": _of_mesh,
    "Quiver": _of_arrows,
}
"""What turns each kind of artist into traces; that of the nearest ancestor counts."""
