"""Draw the pictures of the page on the paper, where they are not there yet; an empty folder has all drawn anew."""

from pathlib import Path

from wheeltapper.faces.paper.figures import DRAW, draw_in
from wheeltapper.faces.paper.run import each_task

FOLDER = Path(__file__).parent / "paper"


def draw_missing() -> None:
    """Draw them on all cores."""
    FOLDER.mkdir(exist_ok=True)
    missing = [name for name in sorted(DRAW) if not (FOLDER / f"{name}.png").exists()]
    for _ in each_task(draw_in, (FOLDER, {}), missing):
        pass
