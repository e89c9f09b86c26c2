"""The record of the march that is chosen for a scenario."""

from __future__ import annotations

from wheeltapper.describe.scenario import Scenario
from wheeltapper.march import run
from wheeltapper.record.kinds import Kind


def kind_of(scenario: Scenario) -> Kind:
    """Return what is known of the march that simulates a scenario."""
    marcher = run.choose(run.SIMULATE, scenario.needs)
    if marcher.is_of_wagons:
        from wheeltapper.record.wagon import WAGON

        return WAGON
    if marcher is run.GENERAL:
        from wheeltapper.record.on_rails import ON_RAILS

        return ON_RAILS
    from wheeltapper.record.wheel import WHEEL

    return WHEEL
