"""Another unsprung mass than the stated one."""

from __future__ import annotations

from wheeltapper.diagnosis.faults.base import MASS
from wheeltapper.diagnosis.faults.scaled import Scaled


class MassDeviation(Scaled):
    """Another unsprung mass than the stated one."""

    name, part, rank = "mass deviation", "suspension", 40.0
    meaning = "the unsprung mass is not the stated one"
    size, usual, path = "mass over the healthy one", 1.1, MASS
    deviation = 0.12
    assessed = True
