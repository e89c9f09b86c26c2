"""The verb `widget`: the explorer in the output of a notebook's cell."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.faces.explore.widget import ExplorerWidget

NEEDED = ("anywidget", "bokeh")
"""What the extra `notebook` brings."""
LOWEST, USUAL = 200, 820
"""Least and usual height of a widget, pixels."""


def widget(scene: Scenario | str | Path | None = None, *, height: int = USUAL) -> ExplorerWidget:
    """Return the explorer's page as a widget, for the output of a notebook's cell.

    It uses the notebook's own connection, without a server or a port. It therefore also works if the kernel runs on
    another machine. It needs the extra `notebook`.

    Parameters
    ----------
    scene
        A scenario, or the path of its TOML file. None: a wheelset over a bump.
    height
        Height of the page, pixels.

    Returns
    -------
    ExplorerWidget
        On the last line of a cell it shows itself; its `scenario` is what the page shows now.

    Raises
    ------
    InputError
        If the extra is not installed, or there is no such scenario.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise InputError(
            "", "widget", f"no package {', '.join(missing)}", "pip install 'wheeltapper[notebook]', which brings it"
        )
    height = as_count(height, "height", LOWEST)
    found: Any = None
    if scene is not None:
        from wheeltapper.record.arguments import as_scenario

        found = as_scenario(scene)
    from wheeltapper.faces.explore.widget import ExplorerWidget

    return ExplorerWidget(found, height)
