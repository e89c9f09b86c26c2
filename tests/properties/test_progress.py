"""Long work says how far it is, to whoever listens."""

import pytest

from wheeltapper.ground import progress


def test_a_listener_hears_what_is_reported_inside_its_context_and_the_innermost_listens():
    outer, inner = [], []
    progress.report("work", 0, 3)
    with progress.reporting(lambda *told: outer.append(told)):
        progress.report("work", 1, 3)
        with progress.reporting(lambda *told: inner.append(told)):
            progress.report("work", 2, 3)
        progress.report("work", 3, 3)
    progress.report("work", 4, 3)
    assert outer == [("work", 1, 3), ("work", 3, 3)]
    assert inner == [("work", 2, 3)]


def test_lines_go_to_the_listener_and_without_one_to_stderr(capsys):
    heard = []
    with progress.reporting(lambda *_: None, heard.append):
        progress.say("compiling")
    assert heard == ["compiling"]
    assert capsys.readouterr().err == ""
    progress.say("compiling")
    assert capsys.readouterr().err == "wheeltapper: compiling\n"


def test_what_a_listener_raises_ends_the_work_and_the_context():
    def stop(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), progress.reporting(stop):
        progress.report("work", 1, 3)
    progress.report("work", 2, 3)
