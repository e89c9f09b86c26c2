"""Who has passed: wheels that are known again at their next passage, by a tag in the file's name or by a table."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from wheeltapper.describe.table.content import decoded_text, file_content
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.record.recordings.speeds import FILES, table_rows

TAG = re.compile(r"id=([^_,;=\s]+?)(?=[_,;\s]|\.\w+(?:\.gz)?$|$)")
"""The identity of a train in the name of a file: 2026-11-23T08-12_id=4711.npz."""
IDENTITIES, VEHICLES, TURNED = ("identity", "id", "tag"), ("vehicle",), ("turned",)
"""Names of the columns of a table of identities; those of files are those of tables of speeds."""
ANSWERS = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False, "": False}
HEADER = 'a first line with the columns "file" and "identity", and perhaps "vehicle" and "turned"'


class Identity(NamedTuple):
    """Who passed: a train, or the vehicle with this number in it; `turned` if its ends have changed places."""

    name: str
    vehicle: int | None = None
    turned: bool = False


def read_identities(path: Path) -> dict[str, list[Identity]]:
    """Read a table of identities, by the names of the files.

    Its columns are "file", "identity", and perhaps "vehicle" (number of the vehicle in the train; without it the train
    has the identity) and "turned" (yes or no).

    Raises
    ------
    InputError
        If it cannot be read, has no such columns, or an entry is wrong.
    """
    try:
        return _identities_in(decoded_text(file_content(path)))
    except InputError as error:
        raise error.at(str(path)) from None


def _identities_in(text: str) -> dict[str, list[Identity]]:
    rows, mark = table_rows(text)
    titles = [title.lower() for title in (rows[0] if rows else [])]
    file, name, vehicle, turned = (
        next((i for i, title in enumerate(titles) if title in known), None)
        for known in (FILES, IDENTITIES, VEHICLES, TURNED)
    )
    known_titles = {i for i in (file, name, vehicle, turned) if i is not None}
    if file is None or name is None or len(known_titles) < len(titles):
        raise InputError("", "line 1", value_text(mark.join(rows[0]) if rows else ""), HEADER)
    out: dict[str, list[Identity]] = {}
    for line, row in enumerate(rows[1:], start=2):
        if not any(row):
            continue
        cells = row + [""] * (len(titles) - len(row))
        if not cells[file] or not cells[name]:
            raise InputError("", f"line {line}", value_text(mark.join(row)), "a file and an identity")
        number = cells[vehicle] if vehicle is not None else ""
        if number and not (number.isdecimal() and int(number) > 0):
            raise InputError("", f"line {line}, vehicle", value_text(number), "a number from 1, or nothing")
        answer = (cells[turned] if turned is not None else "").lower()
        if answer not in ANSWERS:
            raise InputError("", f"line {line}, turned", value_text(answer), "yes or no")
        one = Identity(cells[name], int(number) if number else None, ANSWERS[answer])
        own = out.setdefault(Path(cells[file].replace("\\", "/")).name, [])
        if any(other.vehicle == one.vehicle for other in own):
            raise InputError("", f"line {line}", f"a second identity of {cells[file]}", "one for each vehicle or train")
        own.append(one)
    return out


def tagged(name: str) -> list[Identity]:
    """Return the identity that the name of a file states, as "id=4711"."""
    found = TAG.search(name)
    return [] if found is None else [Identity(found[1])]


def named_wheels(
    axles: Sequence[Mapping[str, Any]], identities: Sequence[Identity]
) -> tuple[dict[tuple[int, str | None], str], list[str]]:
    """Return the names of a train's wheels by axle, from 1, and side; and notes on identities of no vehicle.

    Wheelsets are numbered from the end that lies at larger x, so that they keep their numbers where a train goes back
    without being turned; if it is turned, from the other end, and its sides have changed places.
    """
    names: dict[tuple[int, str | None], str] = {}
    notes = []
    for identity in identities:
        own = [n for n, axle in enumerate(axles, 1) if identity.vehicle in (None, axle["vehicle"])]
        if not own:
            notes.append(f"identity {identity.name}: there is no vehicle {identity.vehicle}")
        backwards = bool(own) and (axles[own[0] - 1]["direction"] < 0) != identity.turned
        for wheelset, axle in enumerate(reversed(own) if backwards else own, 1):
            for side, side_then in _sides(axles[axle - 1], identity.turned):
                names[axle, side] = f"{identity.name} wheelset {wheelset} {side_then or ''}".strip()
    return names, notes


def _sides(axle: Mapping[str, Any], turned: bool) -> Iterator[tuple[str | None, str | None]]:
    """Return the sides of an axle's wheels, each with the side that it has where the vehicle is not turned."""
    other = {"left": "right", "right": "left"}
    for wheel in axle["wheels"]:
        side = wheel["side"]
        yield side, other.get(side, side) if turned else side
