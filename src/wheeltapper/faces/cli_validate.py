"""The command that compares this installation with figures of others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from wheeltapper.faces.exits import CLAIM_FAILED, DONE, check_target, write_whole
from wheeltapper.ground.progress import progress_shown


def validate(
    *, page: Path | None = None, as_json: Annotated[bool, Parameter(name="--json", negative="")] = False
) -> int:
    """Compare this installation with closed forms, other programs and published figures.

    The exit code is 1 if a difference is larger than allowed.

    Parameters
    ----------
    page
        Write the report here (.rst).
    as_json
        Print one JSON object instead of lines.
    """
    if page is not None:
        check_target("--page", page, (".rst",))
    from wheeltapper.faces.validation.report import lines_of, measured_all, origin, page_of

    with progress_shown(True, "comparisons"):
        found = list(measured_all())
    if as_json:
        rows = [
            {
                "subject": one.comparison.subject, "quantity": one.quantity, "kind": one.comparison.kind,
                "source": one.comparison.source, "difference": one.difference, "allowed": one.allowed,
                "agrees": one.agrees,
            }
            for one in found
        ]  # fmt: skip
        print(json.dumps({"format": 1, "origin": origin(), "comparisons": rows}))
    else:
        print(origin(), *lines_of(found), sep="\n")
    if page is not None:
        write_whole(page, f"Validation report\n=================\n\n{page_of(found)}")
    return DONE if all(one.agrees for one in found) else CLAIM_FAILED
