"""A primary damper that does less than it should."""

from __future__ import annotations

from wheeltapper.diagnosis.faults.base import DAMPING
from wheeltapper.diagnosis.faults.scaled import Scaled


class WeakDamper(Scaled):
    """A primary damper that does less than it should."""

    name, part, rank = "weak damper", "damper", 30.0
    meaning = "a primary damper does less than it should"
    size, usual, path = "damping over the healthy one's", 0.7, DAMPING
    centre, deviation = 0.65, 0.25
    assessed = True
