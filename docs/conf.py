"""Configuration of the documentation: Sphinx, numpydoc, the pydata theme and a gallery of the examples."""

import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import wheeltapper
from wheeltapper._version import __version__

sys.path.insert(0, str(Path(__file__).parent))  # for the modules of this folder
import abilities
import front_pictures
import gallery_figures
import paper_figures

project = "wheeltapper"
copyright = "The wheeltapper developers"
release = __version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
    "sphinx_design",
    "kinds",
    "speeds",
    "validation_report",
]
exclude_patterns = ["_build", "decisions"]
templates_path = ["_templates"]

html_theme = "pydata_sphinx_theme"
html_title = "wheeltapper"
html_show_sourcelink = False
html_static_path = ["_static"]
html_css_files = ["print.css"]
html_theme_options = {"navigation_with_keys": False, "secondary_sidebar_items": ["page-toc"]}


def names_in(room: ModuleType) -> list[str]:
    """Return the names of a room that have no page of their own elsewhere: at the front door, or among the sensors."""
    others = (wheeltapper,) if room is wheeltapper.sensors else (wheeltapper, wheeltapper.sensors)
    return [name for name in room.__all__ if not any(getattr(one, name, None) is getattr(room, name) for one in others)]


# The pages of the public names are written by autosummary into api/, from the docstrings alone; each name has one.
autosummary_generate = True
autosummary_context = {
    "names_in": {
        f"wheeltapper.{name}": names_in(room)
        for name in wheeltapper.__all__
        if isinstance(room := getattr(wheeltapper, name), ModuleType)
    }
}
autodoc_typehints = "none"  # the docstrings state types, shapes and units
python_maximum_signature_line_length = 88  # a longer one has a line for each parameter
numpydoc_show_class_members = False

# Every script in examples/ runs in seconds, so the gallery runs them all; a failing one fails the build.
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "image_scrapers": ("gallery_figures.drawn_figures",),
    "thumbnail_size": (640, 448),
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 60,
    "write_computation_times": False,
}


def as_written(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Keep formulas and units of docstrings as written: |X| is no substitution, and a line "m." is no list."""
    lines[:] = [re.sub(r"^(\s*)([a-z]\.)$", r"\1\\\2", line).replace("|", r"\|") for line in lines]


def readable(
    app: Any, what: str, name: str, obj: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Shorten defaults that would drown a signature: nouns, large numbers, and what only old calls give."""
    if signature:
        signature = signature.replace(", **older", "").replace("<factory>", "...")
        signature = re.sub(r"=([A-Z]\w*)\([^()]*\)", r"=\1()", signature)
        signature = re.sub(r"\b\d{5,}\.0\b", lambda found: f"{float(found[0]):g}".replace("e+", "e"), signature)
    return signature, returned


def for_readers(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out what classes have for the tests alone."""
    return True if what == "class" and name == "example" else None


def setup(app: Any) -> None:
    """Write what is made of data and of runs, and connect the hooks."""
    abilities.write()
    front_pictures.draw_missing()
    paper_figures.draw_missing()
    app.connect("autodoc-process-docstring", as_written)
    app.connect("autodoc-process-signature", readable)
    app.connect("autodoc-skip-member", for_readers)
    app.connect("html-page-context", gallery_figures.large_thumbnails)
