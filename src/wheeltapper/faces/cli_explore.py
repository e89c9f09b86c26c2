"""The command `explore`: the explorer in the browser."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE


def explore(
    file: Path | None = None,
    *,
    port: int | None = None,
    browser: Annotated[bool, Parameter(negative="--no-browser")] = True,
) -> int:
    """Open a page that shows what a scenario does while its fields are changed; Ctrl-C ends it.

    The page is served on this machine only and needs the extra explore. Files that a scenario on the page names must be
    in the current folder.

    Parameters
    ----------
    file
        A scenario in TOML; without it, the browser's last scenario or a wheelset over a bump.
    port
        Port of the server; by default a free one.
    browser
        Open the page in the browser.
    """
    from wheeltapper.faces.explore.launch import Explorer, check_installed

    check_installed()
    scene = None
    if file is not None:
        from wheeltapper.describe.scenario import Scenario

        scene = Scenario.from_toml(file)
    explorer = Explorer(scene, port)
    print(f"explorer: {explorer.address}", flush=True)
    if browser:
        webbrowser.open(explorer.address)
    try:
        explorer.serve()
    except KeyboardInterrupt:
        print("wheeltapper: explorer ended", file=sys.stderr)
    return DONE
