"""From any scenario to its lowered form, that of the march which simulates it, and to the rail that it wears."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower import extent
from wheeltapper.march import run

if TYPE_CHECKING:
    from wheeltapper.lower.lines.base import Line
    from wheeltapper.lower.lowered.base import LoweredScenario


def lowered_scenario(scenario: Scenario, method: str = "default") -> LoweredScenario:
    """Lower a scenario for the march that simulates it; a record that cannot fit in memory is refused.

    Raises
    ------
    InputError
        If it cannot be simulated.
    """
    lowered = {run.GENERAL: _lowered_in_plane, run.WAGON: _lowered_wagon, run.WAGON_ON_RAILS: _lowered_wagon}
    return lowered.get(run.choose(run.SIMULATE, scenario.needs), _lowered_wheel)(scenario, method)


def _lowered_wheel(scenario: Scenario, method: str) -> LoweredScenario:
    from wheeltapper.lower.build import lower

    extent.check_time(scenario)
    lowered = lower(scenario, method)
    extent.check_pieces(scenario, lowered.table)
    return lowered


def _lowered_in_plane(scenario: Scenario, method: str) -> LoweredScenario:
    from wheeltapper.lower.plane import lower_plane

    lowered = lower_plane(scenario, method)
    lowered.check_room()
    return lowered


def _lowered_wagon(scenario: Scenario, method: str) -> LoweredScenario:
    from wheeltapper.lower.lowered.wagon import row_bytes
    from wheeltapper.lower.wagon import LONGEST
    from wheeltapper.lower.wagon_on_track import wagon_on_its_track

    extent.check_duration(scenario, scenario.duration / LONGEST, row_bytes(len(scenario.vehicle.names)))
    return wagon_on_its_track(scenario, method)


def line_of(
    scenario: Scenario, start: float, per_interval: int, method: str, vehicles: Sequence[Any] = ()
) -> Line:  # fmt: skip
    """Return the rail over which a scenario, or vehicles in turn, pass; `per_interval`: samples in half a semi-axis."""
    marcher = run.choose(run.WEAR_IN, scenario.needs)
    if marcher in (run.WAGON, run.WAGON_ON_RAILS):
        from wheeltapper.lower.lines.wagon import WagonLine

        return WagonLine(scenario, start, per_interval, method, vehicles)
    if marcher is run.GENERAL or vehicles:
        from wheeltapper.lower.lines.plane import PlaneLine

        return PlaneLine(scenario, start, per_interval, method, vehicles)
    from wheeltapper.lower.lines.wheel import WheelLine

    return WheelLine(scenario, start, per_interval, method)
