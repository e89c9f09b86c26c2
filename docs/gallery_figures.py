"""How the gallery finds the pictures of an example, and what it shows of each in small.

`wt.plot` returns pictures without telling pyplot, and films are files. A whole picture cannot be read at the size of a
thumbnail: there one of its panels is drawn anew, as large as fits.
"""

import shutil
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from sphinx_gallery.scrapers import figure_rst

SIZE, DOTS = (3.2, 2.24), 200
"""Of a thumbnail, inches, and its dots per inch: a page shows it with half of them."""
SHOWN = """<style>
div.sphx-glr-thumbnails { grid-template-columns: repeat(auto-fill, minmax(min(340px, 100%), 1fr)); }
div.sphx-glr-thumbnails .sphx-glr-thumbcontainer img { max-width: min(320px, 100%); max-height: 224px; }
</style>
"""


class Small(NamedTuple):
    """What a thumbnail shows: a picture of the example by its number, one of its panels, and perhaps the lines' names.

    The names stand above in so many columns; 0: among the lines; None: they are left out.
    """

    picture: int
    panel: int = 0
    names: int | None = None


THUMBNAILS = {
    "bouncing_for_ever": Small(2, names=0),
    "bump": Small(1, 1),
    "compare_bilateral": Small(2, 1),
    "flat_across_the_tread": Small(1, names=2),
    "flats_on_tracks": Small(1, names=0),
    "freight_wagon": Small(3, names=3),
    "joint_over_speed": Small(1, names=0),
    "measured_flat": Small(1, 1),
    "own_contact_law": Small(1, names=3),
    "recorded_train": Small(1),
    "rough_rail": Small(1),
    "week_of_traffic": Small(1, names=4),
    "contact_resonance": Small(1),
    "hertz_impact": Small(2, 1),
    "hunting": Small(1, 1),
    "joint_at_two_speeds": Small(1, names=1),
    "pinned_pinned": Small(1, 1),
}
"""By the names of the examples."""


def drawn_figures(block: Any, variables: dict[str, Any], gallery: dict[str, Any]) -> str:
    """Save what a block of an example has put into `figure`, and take the file that it has put into `film`."""
    held = variables["example_globals"]
    figure, film = held.pop("figure", None), held.pop("film", None)
    paths = []
    if figure is not None:
        paths.append(Path(next(variables["image_path_iterator"])))
        figure.savefig(paths[-1], dpi=120)
        small = THUMBNAILS[Path(variables["src_file"]).stem]
        if len(variables["image_path_iterator"]) == small.picture:
            path = paths[-1].with_name(f"{paths[-1].stem}_small.png")
            make_small(figure, small).savefig(path, dpi=DOTS)
            variables["file_conf"]["thumbnail_path"] = str(path)
    if film is not None:
        paths.append(Path(next(variables["image_path_iterator"])).with_suffix(film.suffix))
        shutil.move(film, paths[-1])
    return str(figure_rst([str(path) for path in paths], gallery["src_dir"])) if paths else ""


def make_small(figure: Figure, small: Small) -> Figure:
    """Return a picture with only the panel of its thumbnail, at the thumbnail's size."""
    axis = figure.axes[small.panel]
    below = next((one.get_xlabel() for one in figure.axes[small.panel :] if one.get_xlabel()), "")  # x may be shared
    for other in [*figure.axes]:
        if other is not axis:
            other.remove()
    for words in [*figure.texts, *figure.legends]:
        words.remove()
    figure.suptitle("")
    figure.set_layout_engine("constrained")
    figure.set_size_inches(*SIZE)
    axis.set_subplotspec(GridSpec(1, 1, figure=figure)[0])
    axis.set_title("")
    axis.set_title("", loc="left")
    axis.set_xlabel(below, fontsize=9)
    axis.yaxis.label.set_size(9)
    axis.tick_params(labelsize=8, which="both", labelbottom=True, labelleft=True)
    if axis.get_legend() is not None:
        axis.get_legend().remove()
    spaces = {"fontsize": 7.5, "frameon": False, "handlelength": 1.5, "labelspacing": 0.3, "columnspacing": 1.0}
    if small.names:
        figure.legend(*axis.get_legend_handles_labels(), loc="outside upper right", ncols=small.names, **spaces)
    elif small.names == 0:
        axis.legend(**spaces)
    return figure


def large_thumbnails(app: Any, page: str, template: str, context: dict[str, Any], tree: Any) -> None:
    """Show thumbnails as large as they can be read."""
    if page.startswith("gallery/"):
        context["metatags"] = context.get("metatags", "") + SHOWN
