"""A primary damper that does next to nothing."""

from __future__ import annotations

from wheeltapper.diagnosis.faults.base import DAMPING
from wheeltapper.diagnosis.faults.scaled import Scaled


class LostDamper(Scaled):
    """A primary damper that does next to nothing."""

    name, part, rank = "lost damper", "damper", 20.0
    meaning = "a primary damper does next to nothing"
    size, usual, path = "damping over the healthy one's", 0.2, DAMPING
    centre, deviation = 0.15, 0.6
    assessed, far = True, True
