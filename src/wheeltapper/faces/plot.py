"""The verb `plot`: pictures of all nouns and results."""

from __future__ import annotations

import sys
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, overload

from wheeltapper.faces.drawers import drawer_of, is_drawn_by
from wheeltapper.faces.panels import Wheels
from wheeltapper.ground.arguments import as_count, as_list, as_path, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import SEVERAL_BODIES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from wheeltapper.record.record import Record

STYLE = Path(__file__).with_name("wheeltapper.mplstyle")
"""The style sheet of all figures."""
CHART, RECORD = "wheeltapper chart", "record.record.Record"
PICTURES = "image/png", "image/svg+xml", "image/jpeg", "application/pdf"
"""Kinds of pictures that a notebook shows of a figure."""


@overload
def plot(
    what: Any, path: str | Path | None = None, features: list[str] | None = None, border: xr.Dataset | None = None,
    against: Record | None = None, wheelset: int = 1, *, wheels: Wheels = "one", interactive: Literal[False] = False,
) -> Figure: ...  # fmt: skip
@overload
def plot(
    what: Any, path: str | Path | None = None, features: list[str] | None = None, border: xr.Dataset | None = None,
    against: Record | None = None, wheelset: int = 1, *, wheels: Wheels = "one", interactive: bool,
) -> Any: ...  # fmt: skip
def plot(
    what: Any,
    path: str | Path | None = None,
    features: list[str] | None = None,
    border: xr.Dataset | None = None,
    against: Record | None = None,
    wheelset: int = 1,
    *,
    wheels: Wheels = "one",
    interactive: bool = False,
) -> Any:
    """Draw a scenario or a part of it, a result, or several of a kind over one another.

    A record: path and wheel, normal force with losses shaded and impacts marked, and the deck if there is one. The
    record of a wagon: normal forces of all wheels, and the acceleration of the car body. A chart of two varied fields:
    level curves of each feature, with arrows of the gradient and its specificity if there are gradients; cells without
    a value or a reliable gradient are hatched. A chart of one field: lines; of samples: clouds; of a gradient: its
    elasticities. A wagon: side view, end view and plan, with its elements by name. Its modes: their roots, and the
    shapes of those that decay most slowly. A scenario: where everything stands before the run. A law: its force.

    Parameters
    ----------
    what
        A result of this package that is not a plain number: records and their tables, histories, guidance and comfort;
        charts, borders, modes, marks and wear; findings, forces, recordings, trains and sites; orbits and tracks, and
        what is computed of them. Or a scenario or a part of it. Lists of several records, recordings, laws of contact
        or creep, modes at rising speeds, or branches, diagrams, ramps or borders of orbits are drawn together; a
        dictionary of recordings or of orbits names them.
    path
        Path of the picture, a .html if it is interactive; None: it is only returned.
    features
        Features of a chart that are drawn; by default all.
    border
        Result of `wheeltapper.border`, drawn over a chart of the same two fields.
    against, wheelset
        For a wagon's record: the record of a core model, such as that of `wheeltapper.reduced`. It is drawn over the
        response of this wheelset, with the differences in peaks, intervals and times.
    wheels
        Of a chart's feature that each wheel has: "one" draws the map of the wheel in which it is largest, "all" one
        map for each. For another wheel draw ``chart.sel(wheelset=2, side="left")``.
    interactive
        Whether the same picture is returned as a figure of plotly, in which one can zoom and read values.

    Returns
    -------
    matplotlib.figure.Figure or plotly.graph_objects.Figure
        The figure. A figure of matplotlib is not registered with pyplot: show it in a notebook, or save it.

    Raises
    ------
    InputError
        If there is no picture of `what`, an argument does not apply to it, or plotly is needed and not installed.
    """
    import matplotlib.style

    path = None if path is None else as_path(path, "path", "the path of a .png, .pdf or .svg")
    if interactive:
        from wheeltapper.faces.interactive import check_plotly

        check_plotly(path)
    options = _checked_options(what, features, border, wheels)
    wheelset = as_count(wheelset, "wheelset")
    _check_against(what, against, wheelset)
    draw = drawer_of(what)
    with matplotlib.style.context(STYLE):
        if against is not None:
            from wheeltapper.faces.wagons import draw_comparison

            figure = draw_comparison(what, against, wheelset)
        else:
            figure = draw(what, **options)
        if interactive:
            from wheeltapper.faces.interactive import interactive_figure

            return interactive_figure(figure, path)
        if path is not None:
            save(figure, path)
    _let_notebooks_show(type(figure))
    return figure


def _let_notebooks_show(figures: type[Figure]) -> None:
    """Let IPython show figures as pictures where it does not yet: it asks pyplot to tell it, which is not used here."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if shell is None:
        return
    formatters = shell.display_formatter.formatters
    if not any(figures in formatters[kind].type_printers for kind in PICTURES):
        formatters["image/png"].for_type(figures, _as_png)


def _as_png(figure: Figure) -> bytes:
    """Return a figure as a cell of a notebook shows it."""
    written = BytesIO()
    figure.savefig(written, format="png", bbox_inches="tight")
    return written.getvalue()


def _checked_options(
    what: Any, features: list[str] | None, border: xr.Dataset | None, wheels: Wheels
) -> dict[str, Any]:  # fmt: skip
    """Return the options of a chart; refuse wrong ones, and those of anything else."""
    if features is not None:
        features = as_list(features, "features", "names of the chart's features")
        if not features:
            raise InputError("", "features", "none", "names of the chart's features, or None for all")
    if border is not None and "line" not in getattr(border, "data_vars", ()):
        raise InputError("", "border", value_text(border), "what `wheeltapper.border` returned")
    check_choice(wheels, "wheels", get_args(Wheels))
    asked = {"features": features, "border": border, "wheels": None if wheels == "one" else wheels}
    given = {name: value for name, value in asked.items() if value is not None}
    if not is_drawn_by(what, CHART):
        for name, value in given.items():
            usual = "'one'" if name == "wheels" else "None"
            raise InputError("", name, value_text(value), f"{usual}, unless `what` is a chart")
    return given


def _check_against(what: Any, against: Record | None, wheelset: int) -> None:
    if against is None:
        if wheelset != 1:
            found = f"{wheelset} without `against`"
            raise InputError("", "wheelset", found, "1, or a record to draw over that wheelset's")
        return
    if not is_drawn_by(against, RECORD):
        raise InputError("", "against", value_text(against), "a Record")
    if not is_drawn_by(what, RECORD) or SEVERAL_BODIES not in what.scenario.needs:
        raise InputError("", "against", "a record to draw over", "None, unless `what` is the record of a wagon")


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure; refuse a path that cannot be written."""
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise InputError(
            str(path), "plot", f"a place or suffix that cannot be written ({error})", "a writable .png, .pdf or .svg"
        ) from error
