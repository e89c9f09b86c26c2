"""Units in recordings, and the quantity that follows from them."""

from __future__ import annotations

import re

from wheeltapper.describe.sensitivity import (
    ALLOWED,
    OWN_UNITS,
    QUANTITIES,
    UNKNOWN,
    WRITTEN,
    Bridge,
    Meaning,
    Quantity,
    meaning_of,
    output_of,
    quantity_of,
)
from wheeltapper.describe.table import units
from wheeltapper.describe.table.units import plain_unit
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.quantities import si_unit

SI: dict[Quantity, str] = {quantity: si_unit(dimension) for quantity, dimension in QUANTITIES.items()}
"""The SI unit of each quantity."""

DIMENSIONS = ("time", "acceleration", "force", "speed")
"""Dimensions that a column of a recording may have."""

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
            "that of the deck; if it is, say so: quantity='deck acceleration', or a line '# quantity: ...' in the file;"
            " of anything else: quantity='vertical acceleration'"
        )
        raise InputError("", "quantity", found, allowed)


def name_and_unit(header: str) -> tuple[str, str]:
    """Split a header into name and unit; "" if there is no unit."""
    return units.name_and_unit(header, DIMENSIONS)


def column_meaning(
    in_file: str, unit: str | None, quantity: Quantity | None, bridge: Bridge = UNKNOWN
) -> tuple[Quantity, float, tuple[str, ...]]:
    """Return the quantity of a column, the SI value of its 1, and notes.

    Parameters
    ----------
    in_file
        The column's unit in the file, "" if it has none.
    unit
        What a 1 in the file is according to the caller, "g" or "10 g"; or a sensor's sensitivity, "250 kN/V".
    quantity
        The quantity according to the caller.
    bridge
        What is known of the sensor's bridge, to compare volts, shares of the excitation and strains.

    Raises
    ------
    InputError
        No unit at all, an unknown one, or two that contradict each other or the quantity.
    """
    stated = meaning_of(unit, quantity) if unit is not None else None
    own = quantity_of(in_file, quantity) if in_file else None
    put_out = output_of(in_file) if own is None else None  # a strain that is asked for is not what a sensor puts out
    if stated is None and own is None:
        found = f"the unit {in_file!r}" if in_file else "no unit, in the file or as argument"
        if quantity in OWN_UNITS:
            raise InputError("", "unit", found, f"{OWN_UNITS[quantity]}; or unit = one of {WRITTEN[quantity]}")
        if in_file and quantity_of(in_file, "displacement"):
            raise InputError("", "unit", found, f"{ALLOWED}; quantity='displacement' reads a length")
        if put_out is not None:
            found += ", of what a sensor puts out"
            raise InputError("", "unit", found, f'{ALLOWED}: its sensitivity, as unit="250 kN/V" or "100 mV/g"')
        raise InputError("", "unit", found, f'{ALLOWED}; unit="10 g" says that a 1 in the file is 10 g')
    sensitivity = stated is not None and stated.output is not None
    if stated is not None and stated.output is not None:
        if put_out is None:
            found = f"{unit!r}, where the file {f'says {in_file!r}' if in_file else 'has no unit'}"
            raise InputError(
                "", "unit", found, 'a file in V, mV, mV/V or um/m; or what a 1 in the file is, as "250 kN"'
            )
        kind, factor = put_out
        share = 1.0 if kind == stated.output else bridge.ratio(kind) / bridge.ratio(stated.output)
        stated = Meaning(stated.quantity, stated.factor * factor * share)
    elif stated is not None and own is not None and not _is_same_unit(stated, own):
        raise InputError("", "unit", f"{unit!r}, where the file says {in_file!r}", "the file's unit, or no argument")
    found_quantity, size = (stated.quantity, stated.factor) if stated is not None else own or ("force", 1.0)
    if quantity not in (None, found_quantity):
        raise InputError(
            "", "quantity", f"{quantity!r}, where the unit {unit or in_file!r} is one of {found_quantity}",
            f"{found_quantity!r}, or a column of {quantity}",
        )  # fmt: skip
    foreign = not sensitivity and stated is not None and own is None and plain_unit(in_file) not in ("", "-")
    return found_quantity, size, ((f"1 {in_file} in the file is taken as {unit}",) if foreign else ())


def _is_same_unit(a: Meaning, b: tuple[Quantity, float]) -> bool:
    return a.quantity == b[0] and abs(a.factor - b[1]) <= 1e-9 * abs(b[1])
