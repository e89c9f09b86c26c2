"""A computation that cannot finish says so, keeps what it has, and ends with exit code 3."""

from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.faces.cli import main
from wheeltapper.lower import build
from wheeltapper.lower import numbers as numbers_module
from wheeltapper.march.common import program as contract
from wheeltapper.march.wheel.single import march

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "wheel_flat.toml"


def test_too_many_events_stop_the_run_and_what_was_found_is_kept(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(numbers_module, "EVENT_LIMIT", 6)
    output = tmp_path / "part.nc"
    assert main(["run", str(EXAMPLE), "--output", str(output)]) == 3
    said = capsys.readouterr()
    assert "limit" in said.err
    assert str(output) in said.out
    record = wt.load(output)
    assert record.outcome.name == "EVENT_LIMIT"
    assert len(record.events.time) >= 6
    assert record.end < 0.5
    assert float(record.at(record.end).normal_force[0]) >= 0.0


@pytest.mark.parametrize(
    ("entry", "value", "status"),
    [(contract.DAMPING, np.nan, contract.NOT_FINITE), (contract.STIFFNESS, np.inf, contract.NOT_FINITE)],
)
def test_numbers_that_are_none_end_the_march_with_a_status(entry, value, status):
    pieces, numbers, *_ = build.lower(wt.Scenario.from_toml(EXAMPLE)).program
    spoilt = numbers.copy()
    spoilt[entry] = value
    assert march(contract.Program(pieces, spoilt)).status == status


def test_a_path_that_ends_before_the_run_is_an_outcome():
    pieces, numbers, *_ = build.lower(wt.Scenario.from_toml(EXAMPLE)).program
    short = pieces[:2].copy()
    short[-1, contract.STOP] = short[-1, contract.START] + 0.01
    ended = numbers.copy()
    ended[contract.LOOP] = 2
    assert march(contract.Program(short, ended)).status == contract.END_OF_PATH
