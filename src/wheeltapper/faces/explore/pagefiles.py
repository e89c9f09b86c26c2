"""Where the page's files lie: those of this package, and BokehJS."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from wheeltapper.ground.errors import InputError

PAGE = Path(__file__).with_name("page")
LIBRARIES = ("bokeh.min.js", "bokeh-api.min.js")
"""Files of the package bokeh that draw the curves."""


def library_folder() -> Path:
    """Return where the package bokeh keeps what a browser loads."""
    spec = find_spec("bokeh")
    if spec is None or not spec.submodule_search_locations:
        raise InputError("", "explore", "no package bokeh", "pip install 'wheeltapper[explore]'")
    return Path(next(iter(spec.submodule_search_locations))) / "server" / "static" / "js"
