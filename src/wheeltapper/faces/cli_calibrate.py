"""The command that calibrates a site by its own traffic."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE, check_target
from wheeltapper.ground.errors import InputError


def calibrate(
    folder: Path,
    *,
    site: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    loads: Path | None = None,
    places: str = "3 mm",
    period: Literal["none", "year", "quarter", "month"] = "none",
    values: Path | None = None,
) -> int:
    """Calibrate a site by the traffic that it recorded: gains, places of gauges, and the track below them.

    Parameters
    ----------
    folder
        Folder with the recordings: files, or a folder for each passage.
    site
        The site in TOML, as it is stated.
    output
        Write the site with the new values and their uncertainties here (.toml).
    loads
        Known loads in TOML: a table for each recording with such a vehicle, as ["2026-05-03T10-00.csv"] with
        1 = "220 kN" for its first axle, or with the loads of both wheels in a list.
    places
        Standard deviation of the stated places of gauges.
    period
        Also print the values of each year, quarter or month, and which of them drift.
    values
        Write all numbers here (.json).
    """
    check_target("--output", output, (".toml",))
    if values is not None:
        check_target("--values", values, (".json",))
    from wheeltapper.diagnosis.wayside.calibrate import calibrate_site

    known = None if loads is None else _loads_in(loads)
    found = calibrate_site(site, folder, loads=known, places=places, period=period)
    print(found)
    found.site.to_toml(output)
    print(f"site: {output}")
    if values is not None:
        values.write_text(json.dumps(found.to_dict(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
        print(f"values: {values}")
    return DONE


def _loads_in(path: Path) -> dict[str, dict[int, Any]]:
    """Return the known loads that a file states, by recording and axle."""
    from wheeltapper.describe.scenario import toml_table

    out: dict[str, dict[int, Any]] = {}
    for name, axles in toml_table(path, "known loads").items():
        if not isinstance(axles, dict) or not all(axle.isdigit() for axle in axles):
            raise InputError(str(path), name, repr(axles)[:60], "a table of loads by the numbers of axles")
        out[name] = {int(axle): load for axle, load in axles.items()}
    return out
