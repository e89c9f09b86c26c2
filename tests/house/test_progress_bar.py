"""Long work shows a bar where someone watches, from two seconds on; short work and output to a file show none."""

import os
import pty
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress

import pytest

from wheeltapper.faces import progress as bars
from wheeltapper.ground import progress
from wheeltapper.ground.progress import patiently, progress_shown, report, say


@pytest.fixture
def terminal(capsys, monkeypatch):
    monkeypatch.setattr(type(sys.stderr), "isatty", lambda self: True, raising=False)
    monkeypatch.setattr(bars, "PATIENCE", 0.05)


def work(seconds, **asked):
    with progress_shown(asked.get("progress", True)):
        for part in range(4):
            report("marching", part, 4.0)
            time.sleep(seconds / 4)


def test_two_seconds_pass_without_a_bar():
    assert bars.PATIENCE == 2.0


@pytest.mark.slow
def test_long_work_shows_what_is_done_and_how_much_of_it(terminal, capsys):
    work(1.0)
    said = capsys.readouterr()
    assert said.out == ""
    for part in ("marching", "25%", "75%", "so far"):
        assert part in said.err


def test_what_is_left_is_told_where_it_is_known_and_never_as_what_has_passed():
    assert bars.time_text(35.7, None) == "0:00:35 so far"
    assert bars.time_text(35.7, 90.2) == "0:00:35 so far, 0:01:30 left"


def test_short_work_shows_nothing(terminal, monkeypatch, capsys):
    monkeypatch.setattr(bars, "PATIENCE", 2.0)
    work(0.2)
    assert capsys.readouterr().err == ""


def test_a_file_gets_no_bar_even_where_colours_are_forced(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setattr(bars, "PATIENCE", 0.05)
    work(0.5)
    assert capsys.readouterr().err == ""


def test_who_wants_no_bar_gets_none(terminal, capsys):
    work(0.5, progress=False)
    assert capsys.readouterr().err == ""


def test_work_that_reports_nothing_shows_that_it_goes_on(terminal, capsys):
    with progress_shown(True):
        time.sleep(0.4)
    assert "working" in capsys.readouterr().err


def test_counted_work_shows_its_count_and_lines_beside_the_bar_are_as_they_were_said(terminal, capsys):
    with progress_shown(True):
        for done in range(5):
            report("passes", done, 4)
            with progress_shown(True):
                report("marching", 1.0, 2.0)  # inner work does not take the bar over
            time.sleep(0.1)
        say("compiling [x] its kernels")
    said = capsys.readouterr().err
    assert "passes" in said
    assert "4/4" in said
    assert "marching" not in said
    assert "wheeltapper: compiling [x] its kernels" in said


def test_a_notebook_shows_a_bar(monkeypatch):
    stream = type("OutStream", (), {"__module__": "ipykernel.iostream", "isatty": lambda self: False})
    monkeypatch.setattr(sys, "stderr", stream())
    shown = []
    monkeypatch.setattr(progress, "bar", noting(shown))
    work(0.0)
    assert shown == ["bar"]


def noting(shown):
    @contextmanager
    def bar():
        shown.append("bar")
        yield

    return bar


def test_threads_show_no_bar(terminal, monkeypatch):
    shown = []
    monkeypatch.setattr(progress, "bar", noting(shown))
    thread = threading.Thread(target=work, args=(0.0,))
    thread.start()
    thread.join()
    assert shown == []
    work(0.0)
    assert shown == ["bar"]


def test_a_call_that_nothing_can_stop_tells_how_far_it_is_and_an_interruption_does_not_wait_for_it():
    """The interruption comes from the listener, as from Ctrl-C: linear algebra knows of neither."""
    told, ends = [], threading.Event()

    def stops(what, done, total):
        told.append((what, done, total))
        if len(told) == 3:
            raise KeyboardInterrupt

    with progress_shown(stops), pytest.raises(KeyboardInterrupt):
        patiently(lambda: ends.wait(20.0), "modes", 10.0)
    ends.set()
    assert [(what, total) for what, _, total in told] == [("modes", 10.0)] * 3
    assert [done for _, done, _ in told] == pytest.approx([0.1, 0.2, 0.3], abs=0.09)


def test_what_such_a_call_returns_or_raises_comes_back():
    assert patiently(lambda: 3, "modes", 10.0) == 3
    with pytest.raises(ZeroDivisionError):
        patiently(lambda: 1 / 0, "modes", 10.0)


SCRIPT = """
import time
from multiprocessing import get_context
from wheeltapper.faces import progress as bars
from wheeltapper.ground.progress import progress_shown
from test_progress_bar import work

bars.PATIENCE = 0.05
if __name__ == "__main__":
    process = get_context("spawn").Process(target=work, args=(0.6,))
    process.start()
    process.join()
    assert process.exitcode == 0
    with progress_shown(True):
        time.sleep(0.6)
        print("below")
"""


@pytest.mark.slow
def test_on_a_terminal_workers_show_no_bar_and_what_is_printed_to_a_pipe_below_a_bar_stays_in_it(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    leader, follower = pty.openpty()
    environment = os.environ | {"PYTHONPATH": os.path.dirname(__file__), "TERM": "xterm", "COLUMNS": "100"}
    done = subprocess.run(
        [sys.executable, script], stdout=subprocess.PIPE, stderr=follower, env=environment, check=True
    )
    os.close(follower)
    seen = b""
    with suppress(OSError):  # on Linux reading fails where the other end is closed
        while more := os.read(leader, 65536):
            seen += more
    os.close(leader)
    assert b"working" in seen
    assert b"marching" not in seen  # what the worker reports
    assert done.stdout == b"below\n"
