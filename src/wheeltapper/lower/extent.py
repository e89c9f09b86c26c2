"""Memory of a record: a run that cannot fit is refused before the march, or the march is ended."""

from __future__ import annotations

from collections.abc import Callable

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground import memory, progress
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.numbers import units_of
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.march.common import program as contract

LONGEST_STEP = 2.0
"""Length of a step of a wheel at rest, in units of time of the program. All other steps in contact are shorter, so that
it gives the smallest possible number of steps of a run."""
ROW_BYTES = 8.0 * contract.ENDED_COLUMNS
"""Memory of one row of steps, bytes."""
TABLES = 4.0
"""Memory that a run needs over that of its rows. Tables double when they are full, and results take as much again."""


def check_time(scenario: Scenario) -> None:
    """Refuse a duration of a wheelset's run whose steps cannot fit in memory, before it is lowered."""
    steps = scenario.duration / float(units_of(Fields(scenario)).time) / LONGEST_STEP
    check_duration(scenario, steps, ROW_BYTES)


def check_pieces(scenario: Scenario, table: PathTable) -> None:
    """Refuse a duration in which a wheelset passes more pieces of a repeating path than fit in memory."""
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


def progress_function(unit: float, end: float, chunk: int, row_bytes: float) -> Callable[[float], bool]:
    """Return a function for the progress of a march (in `unit` s, of `end` s); it ends the march before memory ends.

    It is called after each `chunk` of steps.
    """
    most = memory.available_bytes() / (TABLES * row_bytes)
    steps = 0

    def report_time(reached: float) -> bool:
        nonlocal steps
        steps += chunk
        progress.report("marching", min(float(reached) * unit, end), end)
        return steps > most

    return report_time
