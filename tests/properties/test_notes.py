"""Notes are data: they say themselves what they are about, how bad it is, and whether a result means what it seems."""

import pickle

import pytest

import wheeltapper as wt
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.record.simulate import ModelWarning, warn_of

HOLLOW = wt.CosineBump(height="-0.4 mm", length="20 mm", start="30 mm")


def scene(**changes):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, damping=5e4),
        contact=changes.pop("contact", wt.Hertz(constant=1.405e11)),
        irregularity=HOLLOW,
        rolling="point",
        speed=9.0,
        duration=0.01,
    ).replaced(changes)


def test_a_note_warns_by_what_it_is_and_not_by_its_words():
    warn_of([Note("a wheel cannot follow, the law holds up to nothing, and this is implausible")])
    with pytest.warns(ModelWarning, match="all is well"):
        warn_of([Note("all is well", doubtful=True)])


def test_other_words_and_another_process_leave_a_note_what_it_is():
    note = Note("too deep", "depth", 3.0, doubtful=True)
    for other in (note.reworded("much too deep"), pickle.loads(pickle.dumps(note)), Shared(note, 4).sentence_of(9)):
        assert (other.cause, other.severity, other.doubtful) == ("depth", 3.0, True)
    assert shared_notes([Shared(Note("deep", "depth", 1.0), 2), Shared(note, 4)]) == (Shared(note, 6),)


@pytest.mark.parametrize(
    "call",
    [
        lambda: wt.simulate(scene()),
        lambda: wt.sweep(scene(), {"speed": [9.0, 9.1]}, "largest_force"),
        lambda: wt.gradient(scene(), "largest_force", ["speed"]),
        lambda: wt.wear_in(scene(contact=wt.contact.Thornton(constant=1.405e11)), 1),
    ],
    ids=["simulate", "sweep", "gradient", "wear_in"],
)
def test_warnings_blame_the_line_that_called_the_package(call):
    with pytest.warns(ModelWarning, match="a wheel cannot follow it") as caught:
        call()
    assert {one.filename for one in caught} == {__file__}


def test_files_keep_the_words(tmp_path):
    with pytest.warns(ModelWarning):
        record = wt.simulate(scene())
    assert [note.cause for note in record.notes] == ["sharp dip"]
    record.save(tmp_path / "record.nc")
    again = wt.load(tmp_path / "record.nc").notes
    assert again == record.notes
    assert all(isinstance(note, Note) for note in again)
