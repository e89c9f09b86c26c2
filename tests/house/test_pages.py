"""What notebooks show: small, escaped, readable on any ground, and without any march."""

import re
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.march import run

from .test_charts import BUMP

VOID = {"br", "hr", "path", "rect", "polyline"}


class Balanced(HTMLParser):
    """A reader that keeps the text and finds tags that are not closed."""

    def __init__(self):
        super().__init__()
        self.open, self.text = [], []

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def text_of(page):
    found = Balanced()
    found.feed(page)
    found.close()
    assert found.open == []
    return " ".join(found.text).replace("\u00a0", " ")


@pytest.fixture(scope="module")
def shown():
    site = wt.load("examples/site.toml")
    (recording,) = wt.synthesise(site, fault="broken spring", seed=2)
    record = wt.simulate(BUMP)
    return {
        "scenario": BUMP, "record": record, "coach": wt.Wagon.erri_b176(), "site": site, "recording": recording,
        "track": wt.tracks.Ballasted.named("Zhai2004"), "bump": BUMP.irregularity[0],
        "law": wt.contact.Law(lambda d: 1e11 * d**1.5), "roc": wt.diagnosis.roc([1, 2, 3], [2, 3, 4]),
        "limits": wt.limits.check(record), "detector": wt.load("examples/detector.toml"),
        "force": wt.diagnosis.reconstructed(recording, site), "rule": wt.diagnosis.read_rules()[-1],
        "prior": wt.diagnosis.Prior(0.04, 0.7, "lognormal"), "fault": wt.diagnosis.CATALOGUE["wheel flat"],
        "neighbour": wt.diagnosis.Neighbour(spacing=2.5, fault="wheel flat"),
    }  # fmt: skip


def test_pages_are_small_and_whole_and_run_nothing(shown, monkeypatch):
    for name in ("march", "sample", "choose"):
        monkeypatch.setattr(run, name, None, raising=False)
    for name, what in shown.items():
        page = what._repr_html_()
        assert len(page) < 20_000, name
        assert text_of(page)


def test_a_record_tells_its_outcome_and_a_noun_its_fields_with_units(shown):
    record = text_of(shown["record"]._repr_html_())
    assert "11 impacts, largest force 5.566 of static" in record
    assert str(shown["record"]) in record  # whole, however long
    assert "105.82 kN" in record
    scenario = text_of(shown["scenario"]._repr_html_())
    for said in ("91.307 kN", "2.44 MN/m", "V, m/s", "CosineBump", "200 µm"):
        assert said in scenario
    assert "44.48 t" in text_of(shown["coach"]._repr_html_())


def test_text_from_outside_is_escaped():
    evil = wt.diagnosis.Recording(np.zeros(100), 1e3, source="<script>alert(1)</script>")
    page = evil._repr_html_()
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    rail = wt.tracks.Slab(**wt.tracks.Slab.example, source='"><img src=x onerror=alert(1)>')
    assert "<img" not in rail._repr_html_()


def test_no_ground_and_no_ink_is_fixed(shown):
    for what in shown.values():
        page = what._repr_html_()
        assert not re.search(r"(?<!-)color\s*:", page)
        assert not re.search(r"background\s*:\s*(?!none)", page)
        for colour in re.findall(r"#[0-9a-fA-F]{6}", page):
            red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
            assert 0.2 < 0.2126 * red + 0.7152 * green + 0.0722 * blue < 0.8  # seen on white and on black


def test_long_values_and_many_rows_are_cut():
    values = tuple(float(i) for i in range(500))
    rough = wt.Measured(positions=values, heights=tuple(1e-6 * (i % 3) for i in range(500)))
    assert len(rough._repr_html_()) < 20_000


@pytest.mark.parametrize("own", [None, "svg"])
def test_a_notebook_shows_a_figure_though_pyplot_is_not_used(shown, monkeypatch, own):
    import IPython
    from IPython.core.formatters import DisplayFormatter
    from IPython.core.pylabtools import select_figure_formats

    shell = SimpleNamespace(display_formatter=DisplayFormatter())
    shell.display_formatter.active_types = list(shell.display_formatter.formatters)
    if own is not None:
        select_figure_formats(shell, {own})
    monkeypatch.setattr(IPython, "get_ipython", lambda: shell)
    data, _ = shell.display_formatter.format(shown["record"].plot())
    assert [kind for kind in data if kind.startswith("image")] == ["image/png" if own is None else "image/svg+xml"]
