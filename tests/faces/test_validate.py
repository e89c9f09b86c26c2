"""The validation report: what this installation computes beside figures of others."""

import json

import numpy as np
import pytest

from wheeltapper.faces.cli import main
from wheeltapper.faces.validation import report
from wheeltapper.faces.validation.comparison import COMPARISONS, DATA, Comparison, measured


@pytest.fixture(scope="module")
def found():
    return list(report.measured_all())


def test_every_comparison_agrees_and_says_with_whom(found):
    assert len({one.comparison.subject for one in found}) == len(COMPARISONS) >= 15
    assert {one.comparison.kind for one in found} == set(report.TITLES)
    for one in found:
        assert one.agrees, (one.comparison.subject, one.quantity, one.difference)
        assert one.comparison.source


def test_the_page_has_every_quantity_with_version_and_source(found):
    page = report.page_of(found)
    assert "wheeltapper" in page
    for one in found:
        assert f"{one.comparison.subject}: {one.quantity}" in page
        assert one.comparison.source in page


def test_figures_of_others_name_where_they_come_from():
    said = (DATA / "README.md").read_text(encoding="utf-8")
    for file in DATA.iterdir():
        assert file.name == "README.md" or f"`{file.name}`" in said


@pytest.mark.parametrize("difference", [2e-3, -2e-3, np.nan, np.inf])
def test_what_differs_is_said_and_the_exit_code_is_1(monkeypatch, tmp_path, capsys, difference):
    wrong = Comparison("A force", "closed form", "a book", {"force": 1e-3}, lambda: (difference,))
    monkeypatch.setattr(report, "COMPARISONS", [wrong])
    page = tmp_path / "report.rst"
    assert main(["validate", "--page", str(page)]) == 1
    assert "DIFFERS" in capsys.readouterr().out
    assert "differs**" in page.read_text(encoding="utf-8")
    assert not measured(wrong)[0].agrees


def test_the_command_prints_json(monkeypatch, capsys):
    right = Comparison("A force", "closed form", "a book", {"force": 1e-3}, lambda: (1e-4,))
    monkeypatch.setattr(report, "COMPARISONS", [right])
    assert main(["validate", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["comparisons"]
    assert row["agrees"] is True
    assert row["source"] == "a book"


def test_a_page_that_cannot_be_written_is_refused_before_anything_is_compared(capsys):
    assert main(["validate", "--page", "nowhere/report.rst"]) == 2
    assert "--page" in capsys.readouterr().err
