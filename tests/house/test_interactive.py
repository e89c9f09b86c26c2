"""Interactive pictures are the same pictures."""

import importlib.util
import re

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.faces import interactive

from .test_charts import BUMP, OVER, PAIR

plotly = pytest.importorskip("plotly", reason="plotly comes with the extra `interactive`")


def test_an_interactive_record_has_the_same_lines_and_words(tmp_path):
    record = wt.simulate(BUMP)
    drawn, found = wt.plot(record), wt.plot(record, tmp_path / "record.html", interactive=True)
    names = [trace.name for trace in found.data]
    assert {"wheel's centre", "impact", "out of contact", "static"} <= set(names)
    wheel = found.data[names.index("wheel's centre")]
    np.testing.assert_allclose(wheel.y, drawn.axes[0].get_lines()[1].get_ydata())
    static = found.data[names.index("static")]
    np.testing.assert_allclose(static.y, record.static_force / 1e3)  # a line across the whole axis, in its units
    assert found.layout.yaxis2.title.text == "normal force [kN]"
    assert found.layout.title.text == drawn.get_suptitle()
    page = (tmp_path / "record.html").read_text(encoding="utf-8")
    assert "plotly" in page
    assert not re.search(r"<(script|link|img|iframe)\b[^>]*\b(src|href)=", page)  # nothing is loaded
    for kept in ("prefers-color-scheme: dark", 'name="viewport"', f"<title>{drawn.get_suptitle()}</title>"):
        assert kept in page
    stems, *_ = wt.plot(record.impacts, interactive=True).data  # the last has no next one, whose interval it could have
    forces = record.impacts.peak_force.values / 1e3
    np.testing.assert_allclose(np.sort(stems.y[1::3]), np.sort(forces[np.isfinite(forces)]))


@pytest.mark.slow
def test_maps_tracks_and_vehicles_become_interactive():
    chart = wt.plot(wt.sweep(BUMP, OVER, PAIR, gradient=True), interactive=True)
    assert len(chart.data) > 10  # level curves and arrows
    track = wt.plot(wt.tracks.Ballasted.named("Zhai2004"), interactive=True)
    assert track.layout.xaxis2.type == "log"
    assert track.layout.yaxis.ticktext == ("rail", "sleeper", "ballast")
    coach = wt.plot(wt.Wagon.erri_b176(), interactive=True)
    below = [note.text for note in coach.layout.annotations if note.yshift]
    assert below
    assert "1  " in below[0]


def test_without_plotly_one_line_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setattr(interactive, "find_spec", lambda name: None)
    with pytest.raises(
        wt.InputError, match=r"plotly, which is not installed.*pip install 'wheeltapper\[interactive\]'"
    ):
        wt.plot(BUMP, interactive=True)
    monkeypatch.setattr(interactive, "find_spec", importlib.util.find_spec)
    with pytest.raises(wt.InputError, match="html"):
        wt.plot(BUMP, tmp_path / "bump.png", interactive=True)
