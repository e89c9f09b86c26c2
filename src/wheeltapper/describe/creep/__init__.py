"""Creep laws, one file each: how the tangential force of a rolling contact saturates by friction.

All start from Kalker's linear resultant F of creepages and spin, and give T = F·saturation(F/(μ·N)).
"""

from wheeltapper.describe.creep.fastsim import Fastsim
from wheeltapper.describe.creep.kalker import KalkerLinear
from wheeltapper.describe.creep.polach import Polach
from wheeltapper.describe.creep.shen_hedrick_elkins import ShenHedrickElkins

__all__ = ["Fastsim", "KalkerLinear", "Polach", "ShenHedrickElkins"]
