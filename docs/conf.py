"""Configuration of the documentation: Sphinx, numpydoc, the pydata theme and a gallery of the examples."""

from wheeltapper._version import __version__

project = "wheeltapper"
copyright = "The wheeltapper developers"
release = __version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "decisions"]
nitpicky = False

html_theme = "pydata_sphinx_theme"
html_title = "wheeltapper"
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": False, "secondary_sidebar_items": ["page-toc"]}

# The pages of the public names are written by autosummary into api/, from the docstrings alone.
autosummary_generate = True
autodoc_typehints = "none"  # the docstrings state types, shapes and units
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# Every script in examples/ runs in seconds, so the gallery runs them all; a failing one fails the build.
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "copyfile_regex": r".*\.rst",
    "download_all_examples": False,
    "only_warn_on_example_error": False,
    "show_memory": False,
    "min_reported_time": 60,
}
