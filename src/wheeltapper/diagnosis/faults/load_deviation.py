"""Another load than the stated one."""

from __future__ import annotations

from wheeltapper.diagnosis.faults.base import LOAD
from wheeltapper.diagnosis.faults.scaled import Scaled


class LoadDeviation(Scaled):
    """Another load than the stated one."""

    name, part, rank = "load deviation", "load", 50.0
    meaning = "the wheelset carries another load than stated"
    size, usual, path = "load over the stated one", 1.5, LOAD
    deviation = 0.5
