"""How large a record will be: what cannot fit in memory is refused before it is marched, or ends the march."""

from __future__ import annotations

from collections.abc import Callable

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground import memory, progress
from wheeltapper.lower.build import Lowered
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.numbers import units_of
from wheeltapper.march import program as contract

LONGEST_STEP = 2.0
"""Length of a step of a wheel at rest, in units of time of the program. All other steps in contact are shorter, so that
it gives the smallest possible number of steps of a run."""
ROW_BYTES = 8.0 * contract.ENDED_COLUMNS
"""Memory of one row of steps, bytes."""
TABLES = 4.0
"""Memory that a run needs over that of its rows. Tables double when they are full, and results take as much again."""


def check_time(scenario: Scenario) -> None:
    """Refuse a duration of a wheelset's run whose steps alone cannot fit, before its irregularities are looked at."""
    steps = scenario.duration / float(units_of(Fields(scenario)).time) / LONGEST_STEP
    check_duration(scenario, steps, ROW_BYTES)


def check_pieces(scenario: Scenario, lowered: Lowered) -> None:
    """Refuse a duration in which a wheelset passes more pieces of a path that repeats than fit."""
    table = lowered.table
    if table.period:
        rounds = scenario.duration * scenario.speed / table.period
        check_duration(scenario, rounds * (len(table.rows) - table.loop), ROW_BYTES)


def check_duration(scenario: Scenario, steps: float, row_bytes: float) -> None:
    """Refuse a duration whose record cannot fit in memory."""
    memory.check_room(
        "duration", f"{scenario.duration:g} s, {steps:.2g} steps or more", steps * row_bytes,
        lambda share: f"up to about {scenario.duration * share:.2g} s",
    )  # fmt: skip


def check_samples(field: str, found: str, count: float, columns: int) -> None:
    """Refuse more samples than fit in memory."""
    memory.check_room(
        field, f"{found}, {count:.2g} samples", 8.0 * count * columns,
        lambda share: f"up to about {count * share:.2g} samples",
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
