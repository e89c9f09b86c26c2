"""The figures in `tests/data` and in the validation report, and the reference cases as scenarios."""

import csv
from functools import cache
from pathlib import Path

import numpy as np

from wheeltapper.faces.validation.comparison import table_of
from wheeltapper.faces.validation.programs import MOTIONS, motion

DATA = Path(__file__).resolve().parent / "data"
NAMES, scenario = [*MOTIONS], motion


@cache
def reference():
    """Return the motions and static figures that were computed with 30 digits."""
    return table_of("core_cases.json")


@cache
def orbit_cases():
    """Return orbits, special points and limits that another program has checked."""
    return table_of("orbits.json")["cases"]


def rows(name):
    """Return the rows of a table."""
    if not (DATA / name).exists():
        return table_of(name)
    with (DATA / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def numbers(rows, key):
    return np.array([float(row[key]) for row in rows])
