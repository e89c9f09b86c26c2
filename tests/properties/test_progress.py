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


def test_a_verb_that_counts_is_heard_only_with_what_it_counts():
    told = []
    with progress.progress_shown(lambda *one: told.append(one), "passes"):
        progress.report("fitting", 0, 0)
        progress.report("passes", 1, 3)
        with progress.progress_shown(True, "passes"):  # a verb that works for it
            progress.report("passes", 5, 9)
        with progress.progress_shown(False):
            progress.report("passes", 6, 9)
    assert told == [("passes", 1, 3)]


def test_parts_of_a_count_are_counted_in_the_whole():
    told = []
    with progress.reporting(lambda *one: told.append(one)):
        for begin in (0, 4):
            with progress.counted_from(begin, 8):
                add = progress.progress_counter("cells", 4)
                add(1)
                add(3)
    assert told == [("cells", done, 8) for done in (1, 4, 5, 8)]
    with progress.counted_from(0, 8):
        progress.progress_counter("cells", 4)(1)  # nobody listens
