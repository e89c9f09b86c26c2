"""Recordings in text files: the columns, and the facts in the lines beside the numbers."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from wheeltapper.describe.table.dialect import Rows
from wheeltapper.describe.table.text import read_text_table
from wheeltapper.describe.table.units import plain_unit
from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.quantities import to_si
from wheeltapper.record.recordings.table import INTERVALS, RATES, Column, RecordingTable, rate_fact
from wheeltapper.record.recordings.units import DIMENSIONS, name_and_unit

TEXTS = ("unit", "quantity")
"""Facts in a file whose value is a text."""
JSON = ("truth", "notes")
"""Facts in a file whose value is JSON."""
_FACT = re.compile(r"\s*([^:=;,\t]+?)\s*[:=;,\t]+\s*(.+?)[\s;,]*")


def read_text(path: Path, largest: float) -> RecordingTable:
    """Return the columns of a text file, which may be gzipped.

    Comments and lines above the numbers may state rate, unit, quantity or speed ("# rate: 20 kHz").
    """
    found = read_text_table(
        path, DIMENSIONS, largest=largest, states=lambda text: _parsed_fact(text) is not None, may_be_cut=True
    )
    columns = tuple(Column(c.name, c.values, c.unit, loose=True, fault=c.fault) for c in found.columns)
    return RecordingTable(columns, _stated_facts(found.beside), found.lines, blank=found.blank, cut=found.cut)


def _parsed_fact(text: str) -> tuple[str, str] | None:
    """Return the key and the value of a line such as "sample rate [Hz] = 20000"; None if its key is not known."""
    match = _FACT.fullmatch(text)
    if match is None:
        return None
    name, unit = name_and_unit(match[1])
    key = name.strip().lower().replace(" ", "_").replace("-", "_")
    if key not in (*RATES, *INTERVALS, *TEXTS, *JSON, "speed", "start"):
        return None
    return key, f"{match[2]} {plain_unit(unit)}" if unit else match[2]


def _stated_facts(lines: Rows) -> dict[str, Any]:
    """Return what comments and the lines above the numbers state."""
    facts: dict[str, Any] = {}
    for number, text in lines:
        found = _parsed_fact(text)
        if found is None:
            continue
        name, value = _fact_in_si(*found)
        if name == "words":
            facts.setdefault("words", []).append(text[:80])
            continue
        if name in facts and facts[name] != value:
            raise InputError("", f"line {number}, {name}", f"{found[1]} after another one", f"one {name}")
        facts[name] = value
    return facts


def _fact_in_si(key: str, value: str) -> tuple[str, Any]:
    """Return the name and the value in SI units of a fact in a file, or "words" if it is not understood."""
    try:
        rate = rate_fact(key, value.strip('"'))
        if rate is not None:
            return "rate", rate
        if key in TEXTS:
            return key, value
        if key == "speed":
            return key, as_quantity(value, key, "speed")
        return key, json.loads(value) if key in JSON else to_si(value, "time")
    except ValueError:
        return "words", value
