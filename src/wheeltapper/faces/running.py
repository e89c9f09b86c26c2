"""The command `run`: a scenario is simulated, and the results are printed as lines or one JSON object."""

from __future__ import annotations

import json
import sys
import time
import warnings
from dataclasses import dataclass
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any

from wheeltapper.describe.scenario import FORMAT, Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import SEVERAL_BODIES
from wheeltapper.record.arguments import check_method
from wheeltapper.record.record import Record
from wheeltapper.record.simulate import simulate


@dataclass(frozen=True)
class RunResult:
    """A record, its file, and the warnings of its simulation."""

    file: Path
    record: Record
    method: str
    warnings: tuple[str, ...]
    seconds: float


def simulated_file(file: Path, method: str) -> RunResult:
    """Simulate the scenario in a file; warnings go to stderr."""
    check_method(method)
    scenario = Scenario.from_toml(file)
    begin = time.perf_counter()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            record = simulate(scenario, method)  # type: ignore[call-overload]
        except InputError as error:
            raise error.at(str(file)) from error
    said = tuple(dict.fromkeys(str(warning.message) for warning in caught))
    for line in said:
        print(f"warning: {line}", file=sys.stderr)
    return RunResult(file, record, method, said, time.perf_counter() - begin)


def told_as_lines(run: RunResult) -> str:
    """Return the record's line and its notes."""
    return "\n".join([str(run.record), *(f"note: {note}" for note in run.record.notes)])


def told_as_json(run: RunResult, written: dict[str, Path | None]) -> str:
    """Return the results and the written files as one JSON object in SI units; null: no such value."""
    record = run.record
    kinds = record.events.kind.values
    forces = record.peaks.normal_force.values
    largest = float(forces.max()) if len(forces) else None
    numbers = {
        "largest_force_over_static": None if largest is None else largest / record.static_force,
        "largest_force": largest,
        "static_force": record.static_force,
        "time_in_air": record.time_in_air,
        "end": record.end,
        "seconds": run.seconds,
    }
    found: dict[str, Any] = {
        "file": str(run.file),
        "method": run.method,
        "outcome": record.outcome.name,
        "impacts": int((kinds == "impact").sum()),
        "losses": int((kinds == "loss").sum()),
        "void_closings": int((kinds == "void closes").sum()),
        **{name: value if value is not None and isfinite(value) else None for name, value in numbers.items()},
        "per": "wheel" if SEVERAL_BODIES in record.scenario.needs else "wheelset",
        "notes": list(record.notes),
        "warnings": list(run.warnings),
        **{what: None if path is None else str(path) for what, path in written.items()},
        "versions": {name: version(name) for name in ("wheeltapper", "numpy", "numba")} | {"format": FORMAT},
    }
    return json.dumps(found, indent=2, ensure_ascii=False)
