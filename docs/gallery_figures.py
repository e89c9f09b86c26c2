"""How the gallery finds the figures of an example: `wt.plot` returns them without telling pyplot."""

from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst


def drawn_figures(block: Any, variables: dict[str, Any], gallery: dict[str, Any]) -> str:
    """Save what a block of an example has put into `figure`."""
    figure = variables["example_globals"].pop("figure", None)
    if figure is None:
        return ""
    path = Path(next(variables["image_path_iterator"]))
    figure.savefig(path, dpi=120)
    return str(figure_rst([str(path)], gallery["src_dir"]))
