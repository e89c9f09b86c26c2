"""The example of a week: its recordings, and what `wheeltapper report` finds in them, are those that are kept."""

import gzip
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from wheeltapper.faces.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"
LENGTHS = [25.0, 27.5, 30.0, 35.0, 37.5, 40.0]
"""Of the flat, mm, in the script."""


def wheels_of(path):
    """Return what a database has of wheels: time, axle, side, verdict, and length of the flat, m."""
    held = sqlite3.connect(path)
    rows = held.execute(
        "SELECT passed, axle, side, model, size FROM wheels JOIN trains USING (train) "
        "JOIN recordings USING (recording) ORDER BY passed, axle, side"
    ).fetchall()
    held.close()
    return rows


def test_the_last_recording_is_that_of_the_script():
    """The script prints the largest reading of each day (`tests/house/test_examples.py`)."""
    text = gzip.decompress(sorted((EXAMPLES / "data" / "week").glob("*.gz"))[-1].read_bytes()).decode()
    table = np.loadtxt(text.splitlines(), delimiter=",")
    assert table.shape[1] == 8
    assert table.max() == pytest.approx(145.7, abs=0.05)


def test_only_the_wheel_with_a_flat_has_one_and_it_has_its_length():
    kept = wheels_of(EXAMPLES / "data" / "week.db")
    assert len(kept) == 6 * 4
    flats = [row for row in kept if row[3] != "healthy"]
    assert {row[1:4] for row in flats} == {(2, "left", "wheel flat")}
    assert [1e3 * row[4] for row in flats] == pytest.approx(LENGTHS, abs=1.5)


@pytest.mark.slow
@pytest.mark.whole
def test_the_report_finds_what_is_kept(tmp_path):
    own = ["--site", str(EXAMPLES / "week.toml"), "--output", str(tmp_path), "--workers", "1"]
    assert main(["report", str(EXAMPLES / "data" / "week"), *own, "--diagnosed", "suspicious"]) == 0
    found, kept = wheels_of(tmp_path / "findings.db"), wheels_of(EXAMPLES / "data" / "week.db")
    assert [row[:4] for row in found] == [row[:4] for row in kept]
    for (*_, size), (*_, before) in zip(found, kept, strict=True):
        assert size == (before if before is None else pytest.approx(before, abs=3e-4))
    assert "Flats over their passages" in (tmp_path / "index.html").read_text()
