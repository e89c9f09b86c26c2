"""Sites of detectors with a track, and their recordings, as users get them wrong."""

from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.diagnosis import measure_trains, read_channels
from wheeltapper.faces.cli import main
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.plausible import site_notes

EXAMPLES = Path(__file__).parents[2] / "examples"
SITE = EXAMPLES / "week.toml"
RECORDING = sorted((EXAMPLES / "data" / "week").glob("*.csv.gz"))[0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"track.pad_stiffness": 2e5}, "track.pad_stiffness = 200000 N/m is implausible"),
        ({"unsprung_mass": 1200.0}, "half of a wheelset's"),
        ({"contact": wt.Hertz(constant_per_wheel=1e9)}, "contact.constant_per_wheel"),
        ({"track.sleeper_mass": 300.0}, "half of a sleeper is asked"),
        ({"track.first_sleeper": 0.3}, "a seat lies between the gauges of 'left 1'"),
    ],
)
def test_a_site_with_a_track_is_judged(changes, said):
    place = wt.load(SITE)
    assert not site_notes(place)
    assert [note for note in site_notes(place.replaced(changes)) if said in str(note)]


def test_a_length_from_seat_to_seat_is_astride_none():
    place = wt.load(SITE)
    whole = [
        one.model_copy(update={"x1": 0.6 * number, "x2": 0.6 * (number + 1)})
        for number, one in enumerate(place.sensors)
    ]
    assert not site_notes(place.replaced({"sensors": whole}))


def written(path, change):
    """Write a recording of the week with other rows of numbers."""
    found = read_channels(RECORDING, wt.load(SITE))
    names = list(found)
    rows = np.column_stack([found[name].samples for name in names])
    change(rows)
    rate = next(iter(found.values())).rate
    header = f"# rate: {rate:g} Hz\n" + ",".join(f"{name} [N]" for name in names) + "\n"
    lines = (",".join("nan" if np.isnan(value) else f"{value:.6g}" for value in row) for row in rows)
    path.write_text(header + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_recording_may_begin_without_values(tmp_path):
    def begin(rows):
        rows[:40] = np.nan

    (train,) = measure_trains(written(tmp_path / "begin.csv", begin), SITE)
    assert len(train.axles) == 2


@pytest.mark.parametrize("dead", [np.nan, np.inf])
def test_a_channel_without_values_is_lost_alone_and_named(tmp_path, dead):
    def lose(rows):
        rows[:, 0] = dead

    (train,) = measure_trains(written(tmp_path / "dead.csv", lose), SITE)
    assert len(train.axles) == 2
    assert any("without values in dead.csv: 'left 1'" in note for note in train.notes)


def test_files_whose_findings_would_have_one_name_are_refused(tmp_path, capsys):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "p.csv").write_bytes(b"")
    files = [str(tmp_path / folder / "p.csv") for folder in ("a", "b")]
    assert main(["diagnose", *files, "--site", str(SITE), "--output", str(tmp_path / "found")]) == 2
    assert "whose findings would have one name" in capsys.readouterr().err


def test_wrong_distances_are_refused_before_anything_is_read(tmp_path, capsys):
    (tmp_path / "in").mkdir()
    asked = ["--site", str(SITE), "--output", str(tmp_path / "out"), "--distances", "1.8", "x"]
    assert main(["report", str(tmp_path / "in"), *asked]) == 2
    assert "distances: found 'x'" in capsys.readouterr().err


def test_pages_do_not_go_into_the_folder_of_the_recordings(tmp_path, capsys):
    assert main(["report", str(tmp_path), "--site", str(SITE), "--output", str(tmp_path)]) == 2
    assert "the folder of the recordings; allowed: another folder" in capsys.readouterr().err
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("workers", [0, -1, 1.5])
def test_a_number_of_processes_is_judged_whatever_is_diagnosed(workers):
    with pytest.raises(InputError, match="workers: found"):
        measure_trains(RECORDING, SITE, workers=workers)


def test_an_axle_box_that_rests_or_flies_is_refused():
    place = wt.load(SITE).replaced({"sensors": (), "static_force": 7e4})
    still = wt.diagnosis.Recording(np.zeros(20_000), 2000.0, "vertical acceleration", speed=20.0)
    with pytest.raises(InputError, match="samples: found a constant signal"):
        wt.diagnosis.diagnose_axle_box(still, place)
    with pytest.raises(InputError, match="speed: found 500 m/s; allowed: at most 200 m/s"):
        wt.diagnosis.diagnose_axle_box(still, place, speed=500.0)
