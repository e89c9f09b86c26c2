"""The pictures of the paper's claims can be read."""

import re

import matplotlib.style
import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.looks import flaws
from wheeltapper.faces.paper.claims import CLAIMS
from wheeltapper.faces.paper.figures import DRAW
from wheeltapper.faces.plot import STYLE

LONGEST = {"deck", "fig4"}
LONG = {*LONGEST, "orbits", "law", "missed", "fig6", "fig2b", "fig2c", "plastic", "fig4coach"}
pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")


def marks_of(name):
    return [pytest.mark.slow] * (name in LONG) + [pytest.mark.whole] * (name in LONGEST)


def drawn(name):
    with matplotlib.style.context(STYLE):
        figure = Figure()
        DRAW[name](figure)
        return figure, flaws(figure)


@pytest.mark.slow
@pytest.mark.few(10)
@pytest.mark.parametrize("name", [pytest.param(name, marks=marks_of(name)) for name in sorted(DRAW)])
def test_a_picture_can_be_read_and_names_its_claims(name):
    figure, found = drawn(name)
    assert found == []
    own = {int(claim.number[1:3]) for claim in CLAIMS.values() if claim.figure == name}
    named = set()
    for first, last in re.findall(r"C(\d\d)(?: to C(\d\d))?", figure.get_suptitle()):
        named |= set(range(int(first), int(last or first) + 1))
    assert own <= named


@pytest.mark.slow
def test_fig_8_shows_which_part_of_the_bogie_swings():
    figure, _ = drawn("fig8")
    causes, drawn_in_paper, *_ = figure.axes
    highest = {line.get_label(): float(np.abs(line.get_ydata()).max()) for line in causes.get_lines()}
    assert (
        highest["front wheelset"] > highest["frame above the front wheelset"] > highest["frame above the rear wheelset"]
    )
    assert "frame above the rear wheelset" in {line.get_label() for line in drawn_in_paper.get_lines()}
    assert all("meets it" in " ".join(str(line.get_label()) for line in axis.get_lines()) for axis in figure.axes)


@pytest.mark.slow
def test_fig_7_counts_displacements_from_rest_in_both_models():
    for name in ("fig7", "fig7coach"):
        figure, _ = drawn(name)
        for axis in figure.axes[1:3]:
            moved = axis.get_lines()[1]
            assert "from rest" in str(moved.get_label())
            assert abs(float(moved.get_ydata()[0])) < 1e-3
