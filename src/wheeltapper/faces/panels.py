"""What pictures share: legends beside the data, units that read well, and fields in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from wheeltapper.describe.paths import value_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Wheels = Literal["one", "all"]
"""Of what each wheel has: the wheel in which it is largest, or all of them."""
BLUE, RED, GREEN = "#1f4e79", "#c0392b", "#2e7d32"
"""The first colours of the style sheet; "C0" would be another colour once the sheet is no longer in use."""
COLOURS = (BLUE, RED, GREEN, "#7f7f7f", "#d68910", "#6c3483", "#17a2b8", "#000000")
"""Colours of lines over one another."""
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
PREFIXED = ("N", "s", "m", "J", "Pa", "N/m", "N s/m")
"""Units that take a prefix. Masses stay in kg, speeds in m/s."""


def legend_above(axis: Axes, columns: int = 3) -> None:
    """Put the legend above the right half of an axis, beside the title, where there is no data."""
    axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, fontsize=8, borderaxespad=0.1)


def in_unit(values: Any, unit: str) -> tuple[float, str]:
    """Return the factor and the unit, with its prefix, in which the middle of the values is 1 to 1000."""
    sizes = np.abs(np.asarray(values, dtype=float))
    sizes = sizes[np.isfinite(sizes) & (sizes > 0.0)]
    if unit not in PREFIXED or not len(sizes):
        return 1.0, unit
    middle = float(np.median(sizes))
    size, prefix = next(((size, prefix) for size, prefix in PREFIXES if middle >= 0.999 * size), PREFIXES[-1])
    return 1.0 / size, prefix + unit


ONE_OF = {
    "anomalies": "anomaly", "axles": "axle", "bodies": "body", "elements": "element", "irregularity": "irregularity",
    "sensors": "sensor", "wheelsets": "wheelset",
}  # fmt: skip
"""What one of a list is called."""


def words(path: str, scenario: Any = None) -> str:
    """Return a field's path in words: "irregularity.0.height" is the height of irregularity 1.

    What has a name in the scenario is called by it: "vehicle.bodies.0.mass" is the mass of the car body.
    """
    *holders, field = path.split(".")
    numbers = ""
    while field.isdigit() and holders:
        field, numbers = holders.pop(), f" {int(field) + 1}{numbers}"
    holder = kind = ""
    for place, part in enumerate(holders):
        if part in ONE_OF:
            kind = ONE_OF[part]
        elif part.isdigit():
            own = None if scenario is None else value_at(scenario, ".".join(holders[: place + 1]))
            side = "" if holders[place - 1] in ONE_OF else f" {holders[place - 1]}"  # irregularity.right.0
            holder = getattr(own, "name", "") or f"{kind} {int(part) + 1}{side}"
        elif part != "of":  # what is repeated
            holder = part.replace("_", " ")
    article = "" if any(letter.isdigit() for letter in holder) else "the "
    return field.replace("_", " ") + numbers + (f" of {article}{holder}" if holder else "")


def number_text(value: float, digits: int = 4) -> str:
    """Return a number with some digits, written out, with spaces between thousands."""
    short = f"{value:.{digits}g}"
    if value == 0.0 or 1e-4 <= abs(value) < 1e9:
        return f"{float(short):,.10g}".replace(",", "\u202f")
    return short


def with_unit(name: str, unit: str) -> str:
    """Return a label: the name, and its unit in brackets if it has one."""
    return f"{name} [{unit}]" if unit else name


def panels(rows: int = 1, height: float = 4.5, width: float = 8.0, **options: Any) -> tuple[Figure, Any]:
    """Return a figure that pyplot does not know, and its panels above each other, (rows,); sizes are in inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(rows, 1, squeeze=False, **options)[:, 0]


def spaced(name: str) -> str:
    """Return the name of a kind of noun in words: "FloatingDeck" is a floating deck."""
    words_of = "".join(f" {letter}" if letter.isupper() else letter for letter in name).split()
    known = sum(len(word) == 1 for word in words_of) > 1  # "S1002", "ERRI" and the like stay as they are
    return name if known else " ".join(words_of).lower()
