"""Long work shows a bar on a terminal from two seconds on; short work, and work whose words go to a file, none."""

import time

import pytest

from wheeltapper.faces import progress
from wheeltapper.ground.progress import report, say


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich then takes any file for a terminal


def work(seconds):
    with progress.work_bar():
        for part in range(4):
            report("marching", part, 4.0)
            time.sleep(seconds / 4)


def test_two_seconds_pass_without_a_bar():
    assert progress.PATIENCE == 2.0


def test_long_work_shows_what_is_done_and_how_much_of_it(terminal, monkeypatch, capsys):
    monkeypatch.setattr(progress, "PATIENCE", 0.05)
    work(1.0)
    said = capsys.readouterr()
    assert said.out == ""
    for part in ("marching", "25%", "75%"):
        assert part in said.err


def test_short_work_shows_nothing(terminal, capsys):
    work(0.2)
    assert capsys.readouterr().err == ""


def test_a_file_gets_no_bar(monkeypatch, capsys):
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(progress, "PATIENCE", 0.05)
    work(0.5)
    assert capsys.readouterr().err == ""


def test_work_that_reports_nothing_shows_that_it_goes_on(terminal, monkeypatch, capsys):
    monkeypatch.setattr(progress, "PATIENCE", 0.05)
    with progress.work_bar():
        time.sleep(0.4)
    assert "working" in capsys.readouterr().err


def test_counted_work_shows_its_count_and_lines_beside_the_bar_are_as_they_were_said(terminal, monkeypatch, capsys):
    monkeypatch.setattr(progress, "PATIENCE", 0.05)
    with progress.progress_bar("passes") as (told, _):
        for done in range(5):
            told(done, 4)
            report("marching", 1.0, 2.0)  # inner work does not take the bar over
            time.sleep(0.1)
        say("compiling [x] its kernels")
    said = capsys.readouterr().err
    assert "passes" in said
    assert "marching" not in said
    assert "wheeltapper: compiling [x] its kernels" in said
