"""An imbalance of a coach between left and right; it is in no catalogue, because a wheelset's model has no sides."""

from __future__ import annotations

from wheeltapper.describe.scenario import Scenario
from wheeltapper.march import run


def imbalance(passage: Scenario, aside: float) -> Scenario:
    """Return a coach's passage with its car body's centre of gravity moved to the left by `aside`, m."""
    run.choose(run.IMBALANCE, passage.needs)
    x, y, z = passage.vehicle.bodies[0].position
    return passage.replaced({"vehicle.bodies.0.position": (x, y + aside, z)})
