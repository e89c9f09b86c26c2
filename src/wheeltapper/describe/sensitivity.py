"""What the numbers of a recording mean: a quantity in a unit, or what a sensor puts out for it.

A transducer puts out volts ("250 kN/V", "100 mV/g"); a bridge of strain gauges a share of its excitation ("12
kN/(mV/V)"), or what its amplifier makes of that, a strain ("0.8 kN/(um/m)"). Of a strain ε a bridge puts out the share
k·B·ε/4 of its excitation, with the gauge factor k and the bridge factor B: the number of arms that feel the strain (K.
Hoffmann, An Introduction to Measurements using Strain Gages, HBM 1989).

A strain is therefore an output, where a force is measured by it, or itself what is measured. It is the latter only
where a strain is asked for; then it is never taken as an output.
"""

from __future__ import annotations

import re
from typing import Literal, NamedTuple

from wheeltapper.describe.table.units import plain_unit
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import UNITS, unit_factor

Quantity = Literal["deck acceleration", "force", "displacement", "strain", "vertical acceleration"]
QUANTITIES: dict[Quantity, str] = {
    "deck acceleration": "acceleration", "force": "force", "displacement": "length", "strain": "strain",
    "vertical acceleration": "acceleration",
}  # fmt: skip
"""What a recording can be of, and its dimension. A vertical acceleration is that of anything but a deck, upwards."""
TOLD_BY_UNIT: tuple[Quantity, ...] = ("deck acceleration", "force")
"""Those that follow from a unit alone. The others are read only where they are asked for: a length may be anything, an
acceleration is that of a deck, and a strain is what a bridge puts out."""
WRITTEN: dict[Quantity, str] = {
    "deck acceleration": '"g", "10 g", "100 mV/g"', "force": '"kN", "1.3 kN", "250 kN/V"',
    "displacement": '"mm", "0.1 mm", "5 mm/V"', "strain": '"um/m", "microstrain", "500 (um/m)/V"',
    "vertical acceleration": '"g", "10 g", "100 mV/g"',
}  # fmt: skip
"""Units of each, for messages."""
ALLOWED = "m/s^2, g (acceleration), N, kN, kip, lbf (force), or one of these per V, mV, mV/V, um/m"
"""Units that a recording may have, for messages."""
OWN_UNITS: dict[Quantity, str] = {
    "displacement": "m, mm, um, in (length), or one of these per V, mV, mV/V, um/m",
    "strain": "m/m, mm/m, um/m, microstrain (strain), or one of these per V, mV, mV/V",
    "vertical acceleration": "m/s^2, g (acceleration), or one of these per V, mV, mV/V, um/m",
}
"""The same of those that are read only where they are asked for."""
Output = Literal["voltage", "ratio", "strain"]
OUTPUTS: dict[Output, dict[str, float]] = {
    "voltage": {"V": 1.0, "mV": 1e-3, "uV": 1e-6},
    "ratio": {"V/V": 1.0, "mV/V": 1e-3, "uV/V": 1e-6},
    "strain": UNITS["strain"],
}
"""What sensors put out: volts, shares of the excitation, strains; and the units of each."""
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


class Bridge(NamedTuple):
    """A sensor's excitation, V, and its gauges' and its bridge's factor; None where nobody states them."""

    excitation: float | None = None
    gauge_factor: float | None = None
    bridge_factor: float | None = None

    def ratio(self, output: Output) -> float:
        """Return the share of the excitation that a 1 of an output is.

        Raises
        ------
        InputError
            If a factor is missing.
        """
        if output == "voltage":
            return 1.0 / self._stated("excitation", "the voltage of the bridge's excitation, to compare V with mV/V")
        if output == "strain":
            k = self._stated("gauge_factor", "that of the strain gauges, as 2.05, to compare um/m with mV/V")
            return 0.25 * k * self._stated("bridge_factor", "the number of arms that feel the strain, as 4")
        return 1.0

    def _stated(self, name: str, allowed: str) -> float:
        value = getattr(self, name)
        if value is None:
            raise InputError("", name, "none", allowed)
        return float(value)


UNKNOWN = Bridge()
"""A bridge of which nothing is stated."""


class Meaning(NamedTuple):
    """What a 1 in a file is: this much of a quantity, in SI units, for a 1 of an output, if it is one of a sensor."""

    quantity: Quantity
    factor: float
    output: Output | None = None


def quantity_of(unit: str, asked: Quantity | None = None) -> tuple[Quantity, float] | None:
    """Return the quantity and the SI value of a unit such as "g", "10 g" or "-0.5 kN"; None for any other text.

    `asked` is the quantity that is looked for.
    """
    match = _NUMBER.fullmatch(unit.strip())
    number, text = (float(match[1]), plain_unit(match[2])) if match else (1.0, plain_unit(unit))
    if text == "mg":  # in files of accelerometers never milligrams
        kind: Quantity = "vertical acceleration" if asked == "vertical acceleration" else "deck acceleration"
        return kind, number * 1e-3 * unit_factor("g", "acceleration")
    if not text or text == "-":
        return None
    if (put_out := output_of(text)) is not None:
        return (asked, number * put_out[1]) if asked == "strain" and put_out[0] == "strain" else None
    meant = [] if asked is None or asked == "strain" else [asked]  # other strains have no dimension, as anything may
    of_dimension: dict[str, Quantity] = {}
    for quantity in (*meant, *TOLD_BY_UNIT):
        of_dimension.setdefault(QUANTITIES[quantity], quantity)
    for dimension, quantity in of_dimension.items():
        try:
            return quantity, number * unit_factor(text, dimension)
        except ValueError:
            continue
    return None


def output_of(unit: str) -> tuple[Output, float] | None:
    """Return what a sensor puts out in such a unit, and the SI value of its 1; None for any other text."""
    text = re.sub(r"\s", "", plain_unit(unit).replace("µ", "u").replace("μ", "u").replace("ε", "e"))
    return next(((output, units[text]) for output, units in OUTPUTS.items() if text in units), None)


def meaning_of(unit: object, asked: Quantity | None = None) -> Meaning:
    """Return what a unit says of the numbers in a file: "kN", "1.3 kN", "250 kN/V", "100 mV/g".

    Raises
    ------
    InputError
        If it says nothing of that kind.
    """
    found = _meaning(unit, asked) if isinstance(unit, str) else None
    if found is None or not 0.0 < abs(found.factor) < float("inf"):
        allowed = f'{ALLOWED}; as "kN", "1.3 kN", "250 kN/V", "100 mV/g"'
        if asked in OWN_UNITS:
            allowed = f"{OWN_UNITS[asked]}; as {WRITTEN[asked]}"
        raise InputError("", "unit", value_text(unit), allowed)
    return found


def _meaning(unit: str, asked: Quantity | None) -> Meaning | None:
    for slash in (match.start() for match in re.finditer("/", unit)):
        left, right = unit[:slash].strip(), unit[slash + 1 :].strip()
        measured, output = quantity_of(left, asked), output_of(right)
        if measured is not None and output is not None and measured[0] != output[0]:
            return Meaning(measured[0], measured[1] / output[1], output[0])
        match = _NUMBER.fullmatch(left)
        output, measured = output_of(match[2]) if match else output_of(left), quantity_of(right, asked)
        number = float(match[1]) if match else 1.0
        if measured is not None and output is not None and measured[0] != output[0] and number:
            return Meaning(measured[0], measured[1] / (number * output[1]), output[0])
    own = quantity_of(unit, asked)
    return None if own is None else Meaning(*own)


def has_number(unit: str) -> bool:
    """Return whether a unit has a number, as in "10 g"."""
    return _NUMBER.fullmatch(unit.strip()) is not None
