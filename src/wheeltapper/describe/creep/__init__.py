"""Creep laws: how friction limits the tangential force of a rolling contact.

All but Fastsim start from Kalker's linear resultant F of creepages and spin, and give T = F·saturation(F/(μ·N)).
"""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.describe.creep.base import CreepLaw as CreepLaw
    from wheeltapper.describe.creep.fastsim import Fastsim as Fastsim
    from wheeltapper.describe.creep.kalker import KalkerLinear as KalkerLinear
    from wheeltapper.describe.creep.polach import Polach as Polach
    from wheeltapper.describe.creep.shen_hedrick_elkins import ShenHedrickElkins as ShenHedrickElkins
else:
    __getattr__, __dir__ = room(__name__)
