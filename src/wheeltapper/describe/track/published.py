"""Published parameters of tracks, from `ballasted.csv`; its columns `source` and `confidence` say where they come from.

The first row also gives what the others lack of their rails. Confidence A: from the publication itself; B: from the
program or the text that quotes it.
"""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from typing import Any

UIC60 = ("UIC60", "60E1")
"""Names of the first row's rail."""
IGNORED = {"subgrade_k": "subgrade", "subgrade_c": "subgrade", "ballast_mass": "ballast mass"}
"""What the table holds and no track has, by its columns."""
RAIL = {
    "rail_EI_Nm2": "bending_stiffness", "rail_kGA_N": "shear_stiffness", "rail_m_kg_m": "mass_per_length",
}  # fmt: skip
SUPPORT = {
    "spacing_m": "spacing", "pad_k_N_m": "pad_stiffness", "pad_c_Ns_m": "pad_damping",
    "half_sleeper_kg": "sleeper_mass", "ballast_k_N_m": "ballast_stiffness", "ballast_c_Ns_m": "ballast_damping",
}  # fmt: skip
"""Fields by column."""


@cache
def _rows() -> dict[str, dict[str, str]]:
    text = (files(__package__) / "ballasted.csv").read_text(encoding="utf-8")
    return {row["set"]: row for row in csv.DictReader(text.splitlines())}


def track_names() -> list[str]:
    """Return the names of the tracks."""
    return list(_rows())


def rail_names() -> list[str]:
    """Return the names of the rails: those of the tracks, and of the first row's rail."""
    return [*UIC60, *_rows()]


def published_rail(name: str) -> dict[str, float]:
    """Return the fields of a rail; what its row lacks is the first row's."""
    first = next(iter(_rows().values()))
    row = first if name in UIC60 else _rows()[name]
    return {field: float(row[column] or first[column]) for column, field in RAIL.items()}


def published_track(name: str) -> dict[str, Any]:
    """Return the fields of a ballasted track."""
    row = _rows()[name]
    return {field: float(row[column]) for column, field in SUPPORT.items()} | {"source": _source(name, row)}


def _source(name: str, row: dict[str, str]) -> str:
    """Return where the numbers come from, and what of them is replaced or left out."""
    first = next(iter(_rows()))
    missing = [field.replace("_", " ") for column, field in RAIL.items() if not row[column]]
    ignored = sorted({words for column, words in IGNORED.items() if row[column]})
    parts = [f"{name}: {row['source']}", f"confidence {row['confidence']}"]
    parts += [f"{' and '.join(missing)} of the rail from {first}"] if missing else []
    parts += [f"{' and '.join(ignored)} ignored"] if ignored else []
    return "; ".join(parts)
