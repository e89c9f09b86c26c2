"""Units in recordings, and the quantity that follows from them."""

from __future__ import annotations

import re

from wheeltapper.describe.table import units
from wheeltapper.describe.table.units import plain_unit
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import unit_factor
from wheeltapper.record.recording import QUANTITIES, Quantity

SI: dict[Quantity, str] = {"deck acceleration": "m/s^2", "force": "N"}
"""The SI unit of each quantity."""
ALLOWED = "m/s^2, g (acceleration), N, kN, kip, lbf (force)"
"""Units that a recording may have, for messages."""

DIMENSIONS = ("time", "acceleration", "force", "speed")
"""Dimensions that a column of a recording may have."""
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


_ELSEWHERE = re.compile(
    r"axle[\s_-]*box|axlebox|journal|bogie|car[\s_-]*body|carbody|achslager|radsatzlager|drehgestell|wagenkasten",
    re.IGNORECASE,
)
"""Words for what accelerates besides a deck."""


def check_place(text: str, quantity: str) -> None:
    """Refuse an acceleration whose name says that it is none of a deck.

    Raises
    ------
    InputError
        If the name of the column or of its quantity has such a word.
    """
    word = _ELSEWHERE.search(text)
    if quantity == "deck acceleration" and word is not None:
        found = f"{text!r}, an acceleration of something else than a deck ({word[0]})"
        allowed = (
            "that of the deck; if it is, say so: quantity='deck acceleration', or a line '# quantity: ...' in the file"
        )
        raise InputError("", "quantity", found, allowed)


def name_and_unit(header: str) -> tuple[str, str]:
    """Split a header into name and unit; "" if there is no unit."""
    return units.name_and_unit(header, DIMENSIONS)


def has_number(unit: str) -> bool:
    """Return whether a unit has a number, as in "10 g"."""
    return _NUMBER.fullmatch(unit.strip()) is not None


def quantity_of(unit: str) -> tuple[Quantity, float] | None:
    """Return the quantity and the SI value of a unit such as "g", "10 g" or "-0.5 kN"; None for any other text."""
    match = _NUMBER.fullmatch(unit.strip())
    number, text = (float(match[1]), plain_unit(match[2])) if match else (1.0, plain_unit(unit))
    if text == "mg":  # in files of accelerometers never milligrams
        return "deck acceleration", number * 1e-3 * unit_factor("g", "acceleration")
    if not text or text == "-":
        return None
    for quantity, dimension in QUANTITIES.items():
        try:
            return quantity, number * unit_factor(text, dimension)
        except ValueError:
            continue
    return None


def column_meaning(
    in_file: str, unit: str | None, quantity: Quantity | None
) -> tuple[Quantity, float, tuple[str, ...]]:
    """Return the quantity of a column, the SI value of its 1, and notes.

    Parameters
    ----------
    in_file
        The column's unit in the file, "" if it has none.
    unit
        What a 1 in the file is according to the caller: "g", "10 g".
    quantity
        The quantity according to the caller.

    Raises
    ------
    InputError
        No unit at all, an unknown one, or two that contradict each other or the quantity.
    """
    stated = _stated_unit(unit) if unit is not None else None
    own = quantity_of(in_file) if in_file else None
    if stated is None and own is None:
        found = f"the unit {in_file!r}" if in_file else "no unit, in the file or as argument"
        raise InputError("", "unit", found, f'{ALLOWED}; unit="10 g" says that a 1 in the file is 10 g')
    if stated and own and not _is_same_unit(stated, own):
        raise InputError("", "unit", f"{unit!r}, where the file says {in_file!r}", "the file's unit, or no argument")
    found_quantity, factor = stated or own or ("force", 1.0)
    if quantity not in (None, found_quantity):
        raise InputError(
            "", "quantity", f"{quantity!r}, where the unit {unit or in_file!r} is one of {found_quantity}",
            f"{found_quantity!r}, or a column of {quantity}",
        )  # fmt: skip
    foreign = stated is not None and own is None and plain_unit(in_file) not in ("", "-")
    return found_quantity, factor, ((f"1 {in_file} in the file is taken as {unit}",) if foreign else ())


def _stated_unit(unit: str) -> tuple[Quantity, float]:
    found = quantity_of(unit) if isinstance(unit, str) else None
    if found is None or not 0.0 < abs(found[1]) < float("inf"):
        raise InputError("", "unit", value_text(unit), ALLOWED)
    return found


def _is_same_unit(a: tuple[Quantity, float], b: tuple[Quantity, float]) -> bool:
    return a[0] == b[0] and abs(a[1] - b[1]) <= 1e-9 * abs(b[1])
