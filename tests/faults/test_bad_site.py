"""Wrong sites, recordings and options: one clear line and exit code 2, on the command line as in Python."""

import json
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ask.diagnosis.public import write_recording
from wheeltapper.faces.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"
SITE, RECORDING = EXAMPLES / "site.toml", EXAMPLES / "data" / "deck_flat.csv.gz"


def refused(capsys, *arguments):
    assert main([str(argument) for argument in arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("wheeltapper: ")
    assert "Traceback" not in error
    return error


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('rate = "20 kHz"', 'rate = "20 kg"', "sensor.rate"),
        ("bits = 16", "bitz = 16", "bits"),
        ('"vehicle.load" = 0.1', '"vehicle.lode" = 0.1', "vehicle.lode"),
        ("speed = 0.1", "speed = -0.1", "uncertainty"),
        ('type = "FloatingDeck"', 'type = "StiffTrack"', "track"),
        ("[passage] ", "[passages] ", "passage"),
    ],
)
def test_a_wrong_site_is_refused(old, new, said, tmp_path, capsys):
    text = SITE.read_text(encoding="utf-8")
    assert old in text
    wrong = tmp_path / "site.toml"
    wrong.write_text(text.replace(old, new, 1), encoding="utf-8")
    error = refused(capsys, "diagnose", RECORDING, "--site", wrong)
    assert said in error
    assert "site.toml" in error
    if "passages" not in new:
        with pytest.raises(wt.InputError):
            wt.load(wrong)


def test_recordings_that_are_not_there_are_refused(tmp_path, capsys):
    assert "folder without recordings" in refused(capsys, "diagnose", tmp_path, "--site", SITE)
    assert "nowhere.csv" in refused(capsys, "diagnose", tmp_path / "nowhere.csv", "--site", SITE)
    assert "files or folders" in refused(capsys, "diagnose", "--site", SITE)
    assert "nosite.toml" in refused(capsys, "diagnose", RECORDING, "--site", tmp_path / "nosite.toml")
    empty = tmp_path / "empty.csv"
    empty.write_text("")
    assert "empty.csv" in refused(capsys, "diagnose", empty, "--site", SITE)
    twice = [tmp_path / "a" / "1.csv", tmp_path / "b" / "1.csv"]
    for path in twice:
        path.parent.mkdir()
        path.write_text("")
    assert "1.csv" in refused(capsys, "diagnose", *twice, "--site", SITE, "-o", tmp_path / "found")


def test_a_recording_of_another_rate_is_refused(tmp_path, capsys):
    recording = wt.diagnosis.Recording(np.random.default_rng(1).standard_normal(2000), 10e3, source="slow")
    write_recording(recording, tmp_path / "slow.csv")
    error = refused(capsys, "diagnose", tmp_path / "slow.csv", "--site", SITE)
    assert "10000 Hz" in error
    assert "20000 Hz" in error


def test_what_is_asked_of_assess_is_checked_first(tmp_path, capsys):
    assert "broken spring" in refused(capsys, "assess", SITE, "--faults", "rusty spring")
    assert "NAME=SIZE" in refused(capsys, "assess", SITE, "--faults", "wheel flat=big")
    assert "passages" in refused(capsys, "assess", SITE, "--count", "1")
    assert ".json" in refused(capsys, "assess", SITE, "--output", tmp_path / "out.txt")


def test_the_schema_of_sites(capsys):
    assert main(["schema", "site"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema["required"] == ["passage"]
    assert set(schema["properties"]) >= {"passage", "sensor", "uncertainty", "name", "format"}
