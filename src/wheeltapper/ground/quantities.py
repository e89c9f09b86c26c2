"""Quantities: "0.1 mm" to SI. Common units are in a table here; pint serves the rest, since it loads slowly."""

from __future__ import annotations

import re
from decimal import Decimal
from functools import cache
from numbers import Real
from typing import Any

from wheeltapper.ground.errors import InputError, value_text

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity, m/s²; the unit g."""

PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6, "G": 1e9}


def _prefixed_units(unit: str, prefixes: str, suffix: str = "") -> dict[str, float]:
    return {f"{p}{unit}{suffix}": PREFIXES[p] for p in prefixes} | {f"{unit}{suffix}": 1.0}


_PER_LENGTH = {
    f"{force}/{length}": a / b
    for force, a in _prefixed_units("N", "kMG").items()
    for length, b in (("m", 1.0), ("mm", 1e-3))
}
_DAMPING = {
    f"{force}{join}s/{length}": a / b
    for force, a in _prefixed_units("N", "kM").items()
    for join in (" ", "*", "·", "")
    for length, b in (("m", 1.0), ("mm", 1e-3))
}

UNITS: dict[str, dict[str, float]] = {
    "length": _prefixed_units("m", "nuµμmck") | {"inch": 0.0254, "in": 0.0254},
    "mass": {"kg": 1.0, "t": 1e3, "g": 1e-3, "lb": 0.45359237},
    "force": _prefixed_units("N", "kM") | {"kip": 4448.2216152605, "lbf": 4.4482216152605},
    "stiffness": _PER_LENGTH,
    "damping": _DAMPING,
    "speed": {"m/s": 1.0, "km/h": 1 / 3.6, "mm/s": 1e-3, "mph": 0.44704, "kmh": 1 / 3.6, "kph": 1 / 3.6},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0},
    "pressure": _prefixed_units("Pa", "kMG") | {"N/mm^2": 1e6, "N/m^2": 1.0},
    "Hertz constant": {"N/m^1.5": 1.0, "N/mm^1.5": 10**4.5, "kN/mm^1.5": 10**7.5, "N/m^(3/2)": 1.0},
    "acceleration": {"m/s^2": 1.0, "m/s2": 1.0, "g": STANDARD_GRAVITY},
    "angle": {"rad": 1.0, "deg": 0.017453292519943295, "°": 0.017453292519943295, "mrad": 1e-3},
    "curvature": {"1/m": 1.0, "1/mm": 1e3, "1/km": 1e-3},
    "time per length": {"s/m": 1.0, "s/mm": 1e3},
    "moment of inertia": {"kg m^2": 1.0, "kg m2": 1.0, "t m^2": 1e3},
    "angular stiffness": _prefixed_units("N", "kM", " m/rad") | _prefixed_units("N", "kM", "m/rad"),
    "angular damping": _prefixed_units("N", "kM", " m s/rad") | _prefixed_units("N", "kM", " m s"),
    "bending stiffness": _prefixed_units("N", "kM", " m^2") | _prefixed_units("N", "kM", "m^2"),
    "mass per length": {"kg/m": 1.0, "t/m": 1e3, "lb/yd": 0.45359237 / 0.9144},
    "inertia per length": {"kg m": 1.0},
    "number": {"": 1.0, "%": 0.01},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6},
    "voltage": {"V": 1.0, "mV": 1e-3, "kV": 1e3},
    "strain": {f"{small}/m": size for small, size in _prefixed_units("m", "uµμm").items()}
    | dict.fromkeys(("microstrain", "ustrain", "µstrain", "μstrain", "ue", "µe", "μe", "µε", "με"), 1e-6),
    "acceleration noise density": {"m/s^2/sqrt(Hz)": 1.0, "ug/sqrt(Hz)": 9.80665e-6, "µg/√Hz": 9.80665e-6},
}
"""For each dimension, units that are known without pint, and their size in SI."""
PINT = {
    "length": "m", "mass": "kg", "force": "N", "stiffness": "N/m", "damping": "N*s/m", "speed": "m/s", "time": "s",
    "pressure": "Pa", "Hertz constant": "N/m**1.5", "acceleration": "m/s**2", "angle": "rad", "curvature": "1/m",
    "time per length": "s/m", "moment of inertia": "kg*m**2", "angular stiffness": "N*m/rad", "number": "",
    "angular damping": "N*m*s/rad", "bending stiffness": "N*m**2", "mass per length": "kg/m",
    "inertia per length": "kg*m", "frequency": "Hz", "voltage": "V", "acceleration noise density": "m/s**2/Hz**0.5",
    "strain": "m/m",
}  # fmt: skip
"""The SI unit of each dimension, as pint spells it."""
_TON = re.compile(r"(?<![a-z_])tons?(?![a-z_])", re.IGNORECASE)
_TEXT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")


def to_si(value: object, dimension: str, field: str = "") -> float:
    """Return a number in SI units.

    Parameters
    ----------
    value
        A number (in SI units), a string with a unit such as "0.1 mm", or a quantity of a package such as pint: any
        object with a `magnitude` and a method `to`.
    dimension
        A key of `UNITS`.
    field
        What the quantity is, for the message.

    Raises
    ------
    InputError
        If it is no quantity of that dimension.
    """
    if isinstance(value, str):
        return _from_text(value, dimension, field)
    given = value
    if has_unit(value):
        value = in_si(value, dimension, field)
    if getattr(value, "ndim", None) == 0 and hasattr(value, "item"):  # a number of NumPy or xarray
        value = value.item()
    try:
        if isinstance(value, Real) and not isinstance(value, bool):
            return float(value)
    except OverflowError:  # an integer beyond the range of floats
        pass
    raise InputError("", field, value_text(str(given) if has_unit(given) else given), _allowed_units(dimension))


def _from_text(text: str, dimension: str, field: str) -> float:
    match = _TEXT.fullmatch(text)
    if match is None:
        raise InputError("", field, value_text(text), _allowed_units(dimension))
    unit = match[2]
    if unit == "":
        return float(match[1])
    if unit in UNITS[dimension]:
        return float(Decimal(match[1]) * Decimal(repr(UNITS[dimension][unit])))  # "9 mm" is 0.009 to the last digit
    if dimension == "force" and unit in UNITS["mass"]:
        weight = float(match[1]) * UNITS["mass"][unit] * STANDARD_GRAVITY
        raise InputError(
            "", field, f"{value_text(text)}, a mass where a force is needed",
            f"N, kN, kip …: {text.strip()} weigh {weight / 1e3:.6g} kN (times {STANDARD_GRAVITY} m/s²)",
        )  # fmt: skip
    if _TON.search(unit):
        raise InputError(
            "", field, f"{value_text(text)}, where a ton may be 907, 1000 or 1016 kg",
            "t of 1000 kg, short_ton or long_ton",
        )  # fmt: skip
    if any(unit in table for table in UNITS.values()):
        raise InputError(
            "", field, f"{value_text(text)}, which is not {_with_article(dimension)}", _allowed_units(dimension)
        )
    try:
        quantity = _registry().Quantity(float(match[1]), unit)
    except Exception as error:  # errors of pint, of Python's tokenizer, and others that an odd text causes
        raise InputError(
            "", field, f"{value_text(text)}, whose unit is not one of {dimension}", _allowed_units(dimension)
        ) from error
    return float(in_si(quantity, dimension, field, text))


@cache
def _registry() -> Any:
    """Return pint's units, which take half a second to load."""
    import pint

    return pint.UnitRegistry()


def has_unit(value: object) -> bool:
    """Return True for a quantity of a package for units such as pint."""
    return hasattr(value, "magnitude") and hasattr(value, "to")


def in_si(quantity: Any, dimension: str, field: str, text: str = "") -> Any:
    """Return the number, or the array, that such a quantity is in SI units; `text` is what it was made of."""
    try:
        return quantity.to(PINT[dimension] or "dimensionless").magnitude
    except (AttributeError, TypeError, ValueError) as error:  # the base of pint's errors, without importing pint
        found = value_text(text or str(quantity))
        raise InputError(
            "", field, f"{found}, whose unit is not one of {dimension}", _allowed_units(dimension)
        ) from error


def si_unit(dimension: str) -> str:
    """Return the SI unit of a dimension as text, "" for a plain number or an unknown dimension."""
    return PINT.get(dimension, "").replace("**", "^").replace("*", " ")


def unit_factor(unit: str, dimension: str) -> float:
    """Return the SI value of one unit."""
    return to_si(f"1 {unit}", dimension)


def _allowed_units(dimension: str) -> str:
    units = [unit for unit in UNITS[dimension] if unit][:6]
    return f"{_with_article(dimension)} as a number in SI units or with a unit such as {', '.join(units)}"


def _with_article(dimension: str) -> str:
    return f"{'an' if dimension.startswith('a') else 'a'} {dimension}"
