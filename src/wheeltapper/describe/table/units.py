"""Units in the headers of measured files, in all their spellings."""

from __future__ import annotations

import re

from wheeltapper.ground.quantities import UNITS

_SPELT = {
    "m/s^2": ("m/s/s", "m/(s^2)", "m/sec^2", "ms^-2", "m s^-2", "m*s^-2", "ms-2", "m_s^2", "m_s2", "ms2", "mps2"),
    "g": ("G", "gn", "g0", "g_n", "gee"),
    "N": ("Newton", "newton", "newtons", "Newtons"),
    "kip": ("kips", "klbf"),
    "s": ("sec", "secs", "second", "seconds", "Sekunden", "S"),
    "ms": ("msec", "millisecond", "milliseconds"),
    "us": ("usec", "μs", "microsecond", "microseconds"),
    "m": ("metre", "metres", "meter", "meters", "Meter"),
    "mm": ("millimetre", "millimetres", "millimeter", "millimeters", "Millimeter"),
    "um": ("micron", "microns", "micrometre", "micrometres", "micrometer", "micrometers", "Mikrometer"),
    "deg": ("degree", "degrees", "Grad"),
}
"""Units as the package writes them, and other spellings of each."""
_PLAIN = {spelt: unit for unit, ways in _SPELT.items() for spelt in ways}
"""The unit of each spelling."""
_UNIT_IN_NAME = re.compile(r"^(.*?)\s*(?:\[\s*(.+?)\s*\]|\(\s*(.+?)\s*\)|\s/\s+\(?(.+?)\)?)$")
_IN_WORDS = re.compile(r"^(.+?)(?:\s+in\s+(\S+)|[\s,:]+(\S{2,}))$")


def plain_unit(unit: str) -> str:
    """Return a unit in the spelling of this package: "m/s²" and "m s⁻²" become m/s^2; an unknown one stays."""
    text = unit.strip().strip("[]").strip()
    if text.startswith("(") and text.endswith(")"):
        text = text[1:-1].strip()
    text = text.replace("⁻²", "^-2").replace("²", "^2").replace("**", "^").replace("·", "*")
    return _PLAIN.get(text, text)


def is_time(unit: str) -> bool:
    """Return whether a unit is a unit of time."""
    return plain_unit(unit) in UNITS["time"]


def is_unit(unit: str) -> bool:
    """Return whether a unit is known here; "" and "-" are units of a number."""
    text = plain_unit(unit)
    return text in ("", "-") or any(text in table for table in UNITS.values())


def name_and_unit(header: str, dimensions: tuple[str, ...]) -> tuple[str, str]:
    """Split "a [g]", "acc (m/s^2)", "F / kN", "t_s" or "Weg in mm" into name and unit; "" if there is no unit.

    Without brackets, a unit must be one of the dimensions that the columns may have.
    """
    text = header.strip().strip('"').strip()
    match = _UNIT_IN_NAME.fullmatch(text)
    if match:
        return match[1], match[2] or match[3] or match[4]
    for mark in re.finditer("_", text):  # "acc_m_s2": the longest ending that is a unit
        name, unit = text[: mark.start()], text[mark.end() :]
        if name and _known_unit(unit, dimensions):
            return name, unit
    match = _IN_WORDS.fullmatch(text)  # a single letter may be part of a name: "sensor N", "axle g"
    unit = (match[2] or match[3]) if match else ""
    return (match[1], unit) if match and _known_unit(unit, dimensions) else (text, "")


def _known_unit(unit: str, dimensions: tuple[str, ...]) -> bool:
    return any(plain_unit(unit) in UNITS[dimension] for dimension in dimensions)
