"""The command `limits`: a run against dated limits."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from wheeltapper.faces.exits import CLAIM_FAILED, DONE, NOT_FINISHED, PICTURES, check_target
from wheeltapper.ground.errors import InputError


def limits(
    file: Path,
    *,
    rules: Path | None = None,
    countries: Annotated[tuple[str, ...], Parameter(consume_multiple=True, negative="")] = (),
    plot: Path | None = None,
    method: str | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> int:
    """Compare a run with dated limits: forces of wheels, Y/Q, flats.

    Exit code 1: a limit is exceeded; 3: no limit is exceeded, but the run never meets a part of the scenario, or no
    limit can be compared.

    Parameters
    ----------
    file
        A scenario in TOML, which is simulated, or a record (.nc) that `run` has written.
    rules
        Limits in TOML instead of those of the package.
    countries
        Take only limits of these countries, such as SE EU.
    plot
        Write a picture here (.png, .pdf, .svg).
    method
        default or strict, for the simulation of a scenario; a record has its own.
    as_json
        Print one JSON object instead of a table; warnings go to stderr.
    """
    if plot is not None:
        check_target("--plot", plot, PICTURES)
    from wheeltapper.ground.outcome import Outcome
    from wheeltapper.record.limits.comparison import check
    from wheeltapper.record.limits.rule import read_rules

    chosen = read_rules(rules, countries or None)
    record = _record_of(file, method)
    found = check(record, chosen)
    print(json.dumps({"file": str(file), **found.to_dict()}, indent=2, ensure_ascii=False) if as_json else found)
    if plot is not None:
        from wheeltapper.faces.plot import plot as draw

        draw(found, plot)
        if not as_json:
            print(f"picture: {plot}")
    if record.outcome is not Outcome.COMPLETED:
        print(f"wheeltapper: {record.outcome.sentence}; {record.outcome.remedy}", file=sys.stderr)
        return NOT_FINISHED
    if found.unmet and not found.exceeded:
        many = f"{len(found.unmet)} limits are" if len(found.unmet) > 1 else "1 limit is"
        print(f"wheeltapper: {many} not met by this run: see the notes", file=sys.stderr)
        return NOT_FINISHED
    if not found.rows:
        print("wheeltapper: no limit can be compared with this run: see what is not compared", file=sys.stderr)
        return NOT_FINISHED
    return CLAIM_FAILED if found.exceeded else DONE


def _record_of(file: Path, method: str | None) -> Any:
    """Return the record in a file, or that of the scenario in it."""
    if file.suffix == ".nc":
        if method is not None:
            raise InputError("", "--method", f"{method!r} with a record, which is not simulated", "no --method")
        from wheeltapper.record.record import Record
        from wheeltapper.record.store import load

        record = load(file)
        if not isinstance(record, Record):
            raise InputError(str(file), "", "no record", "a record that `wheeltapper run` has written")
        return record
    from wheeltapper.faces.running import simulated_file

    return simulated_file(file, method or "default").record
