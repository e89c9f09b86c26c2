"""How large a record will be: what cannot fit in memory is refused before it is marched, or ends the march."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground import memory, progress
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.build import Lowered
from wheeltapper.march import program as contract

LONGEST_STEP = 2.0
"""Units of time that a step of a wheel at rest takes; all others are shorter, but for those in the air."""
TABLES = 4.0
"""Times the rows' own memory: tables double, and what is asked of them is as large again."""


def fewest_steps(lowered: Lowered) -> float:
    """Return how many steps a wheelset's march will take at least: those of time, and those over pieces that repeat."""
    numbers, table = lowered.program.numbers, lowered.table
    over = 0.0
    if table.period:
        distance = numbers[contract.END] * numbers[contract.PACE]
        over = distance / table.period * (len(table.rows) - table.loop)
    return float(numbers[contract.END] / LONGEST_STEP + over)


def check_duration(scenario: Scenario, steps: float, row_bytes: float) -> None:
    """Refuse a duration whose record cannot fit in memory."""
    there, needed = memory.available(), steps * row_bytes
    if needed > there:
        fits = scenario.duration * there / needed
        raise InputError(
            "", "duration", f"{scenario.duration:g} s ({steps:.2g} steps or more, {memory.size(needed)})",
            f"up to about {fits:.2g} s here, where {memory.size(there)} of memory are free",
        )  # fmt: skip


def check_samples(field: str, found: str, count: float, columns: int) -> None:
    """Refuse more samples than fit in memory."""
    there, needed = memory.available(), 8.0 * count * columns
    if needed > there:
        raise InputError(
            "", field, f"{found} ({count:.2g} samples, {memory.size(needed)})",
            f"up to about {count * there / needed:.2g} samples here, where {memory.size(there)} of memory are free",
        )  # fmt: skip


def teller(what: str, unit: float, end: float, chunk: int, row_bytes: float) -> Callable[[float], bool]:
    """Return what a march tells how far it is (in units of `unit` s, of `end` s): it ends it where memory does."""
    most = memory.available() / (TABLES * row_bytes)
    steps = 0

    def tell(reached: float) -> bool:
        nonlocal steps
        steps += chunk
        progress.report(what, min(float(reached) * unit, end), end)
        return steps > most

    return tell


def row_bytes(lowered: Lowered) -> float:
    """Return the bytes of a row of steps."""
    columns = contract.ENDED_COLUMNS if len(lowered.program.damper) else contract.STEP_COLUMNS
    return float(np.dtype(float).itemsize * columns)
