"""How the gallery finds the pictures of an example: `wt.plot` returns them without telling pyplot; films are files."""

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst


def drawn_figures(block: Any, variables: dict[str, Any], gallery: dict[str, Any]) -> str:
    """Save what a block of an example has put into `figure`, and take the file that it has put into `film`."""
    held = variables["example_globals"]
    figure, film = held.pop("figure", None), held.pop("film", None)
    paths = []
    if figure is not None:
        paths.append(Path(next(variables["image_path_iterator"])))
        figure.savefig(paths[-1], dpi=120)
    if film is not None:
        paths.append(Path(next(variables["image_path_iterator"])).with_suffix(film.suffix))
        shutil.move(film, paths[-1])
    return str(figure_rst([str(path) for path in paths], gallery["src_dir"])) if paths else ""
