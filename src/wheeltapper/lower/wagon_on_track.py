"""From a scenario with a wagon on any track to its lowered form; rails that bend are imported where there are some."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.needs import FLEXIBLE_TRACK
from wheeltapper.lower.lowered.wagon import LoweredWagon
from wheeltapper.lower.wagon import lower_wagon, started

if TYPE_CHECKING:
    from wheeltapper.lower.marks.wagon_marks import WornRails


def wagon_on_its_track(scenario: Scenario, method: str, worn: WornRails | None = None) -> LoweredWagon:
    """Lower a scenario with a wagon, its wheelsets where they start; `worn`: rails with marks of others."""
    if FLEXIBLE_TRACK not in scenario.needs:
        return started(lower_wagon(scenario, method, worn), scenario)
    from wheeltapper.lower.wagon_on_rails import lower_wagon_on_rails

    return started(lower_wagon_on_rails(scenario, method, worn), scenario)
