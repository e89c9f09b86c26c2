"""The speeds of many recordings in one table: a column of files, and a column of speeds."""

from __future__ import annotations

import csv
from pathlib import Path

from wheeltapper.describe.table.content import decoded_text, file_content
from wheeltapper.describe.table.units import name_and_unit, plain_unit
from wheeltapper.ground.arguments import as_path, as_quantity
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import UNITS

FILES, SPEEDS = ("file", "files", "recording", "name"), ("speed", "v")
"""Names of the two columns."""
HEADER = 'a first line with a column "file" and a column "speed", as "speed [km/h]"'


def read_speeds(path: str | Path) -> dict[str, float]:
    """Read a table of files and speeds.

    Parameters
    ----------
    path
        Text with a header; columns are separated by commas, semicolons or tabs. A unit in the header, as in
        "speed [km/h]", holds for numbers without one; without it they are in m/s.

    Returns
    -------
    dict
        Speeds, m/s, by the names of the files, without their folders.

    Raises
    ------
    InputError
        If it cannot be read, has no such columns, names a file twice, or a speed is no positive speed.
    """
    path = as_path(path, "speeds", "the path of a table of files and speeds")
    try:
        return _speeds_in(decoded_text(file_content(path)))
    except InputError as error:
        raise error.at(str(path)) from None


def table_rows(text: str) -> tuple[list[list[str]], str]:
    """Return the rows of a table in text, each a list of cells, and what separates them: commas, semicolons or tabs."""
    lines = text.splitlines()
    mark = max(";\t,", key=(lines[0] if lines else "").count)
    return [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)], mark


def _speeds_in(text: str) -> dict[str, float]:
    rows, mark = table_rows(text)
    titles = [name_and_unit(title, ("speed",)) for title in (rows[0] if rows else [])]
    names = [name.strip().lower() for name, _ in titles]
    places = [next((i for i, name in enumerate(names) if name in known), None) for known in (FILES, SPEEDS)]
    if None in places:
        raise InputError("", "line 1", value_text(mark.join(rows[0]) if rows else ""), HEADER)
    file, speed = (int(place) for place in places if place is not None)
    unit, out = plain_unit(titles[speed][1]), {}
    if unit not in ("", *UNITS["speed"]):
        raise InputError("", "line 1", f"speeds in {unit!r}", f"a unit of a speed: {', '.join(UNITS['speed'])}")
    for number, row in enumerate(rows[1:], start=2):
        if not any(row):
            continue
        if len(row) <= max(file, speed) or not row[file]:
            raise InputError("", f"line {number}", value_text(mark.join(row)), "a file and its speed")
        name, given = Path(row[file].replace("\\", "/")).name, row[speed]
        given = given.replace(",", ".") if mark != "," else given
        if name in out:
            raise InputError("", f"line {number}", f"a second speed of {name}", "one for each file")
        bare = given.replace(".", "", 1).replace("-", "", 1).isdigit()
        out[name] = as_quantity(f"{given} {unit}" if bare and unit else given, f"line {number}, speed", "speed")
    return out
