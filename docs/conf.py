"""Configuration of the documentation: Sphinx, numpydoc, the pydata theme and a gallery of the examples."""

import re
import sys
from pathlib import Path
from typing import Any

import wheeltapper
from wheeltapper._version import __version__

sys.path.insert(0, str(Path(__file__).parent))  # for the modules of this folder
import abilities
import front_pictures
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
]
exclude_patterns = ["_build", "decisions"]
templates_path = ["_templates"]

html_theme = "pydata_sphinx_theme"
html_title = "wheeltapper"
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": False, "secondary_sidebar_items": ["page-toc"]}

# The pages of the public names are written by autosummary into api/, from the docstrings alone.
autosummary_generate = True
autodoc_typehints = "none"  # the docstrings state types, shapes and units
numpydoc_show_class_members = False

# Every script in examples/ runs in seconds, so the gallery runs them all; a failing one fails the build.
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "image_scrapers": ("gallery_figures.drawn_figures",),
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 60,
    "write_computation_times": False,
}


def as_written(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Keep formulas and units of docstrings as written: |X| is no substitution, and a line "m." is no list."""
    lines[:] = [re.sub(r"^(\s*)([a-z]\.)$", r"\1\\\2", line).replace("|", r"\|") for line in lines]


def at_the_front_door(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out of a room's page what has a page of its own, and of the diagnosis what is of a sensor."""
    of_a_sensor = getattr(wheeltapper.sensors, name, None) is obj and not app.env.docname.endswith("sensors")
    return True if what == "module" and (getattr(wheeltapper, name, None) is obj or of_a_sensor) else None


def setup(app: Any) -> None:
    """Write what is made of data and of runs, and connect the hooks."""
    abilities.write()
    front_pictures.draw_missing()
    paper_figures.draw_missing()
    app.connect("autodoc-process-docstring", as_written)
    app.connect("autodoc-skip-member", at_the_front_door)
