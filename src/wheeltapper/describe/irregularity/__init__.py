"""Irregularities of rail and wheel, one law in each file. All of them are also names of `wheeltapper`."""

from wheeltapper.describe.irregularity.bump import CosineBump
from wheeltapper.describe.irregularity.combination import Repeated
from wheeltapper.describe.irregularity.corrugation import Corrugation
from wheeltapper.describe.irregularity.flat import WheelFlat
from wheeltapper.describe.irregularity.measured import Measured
from wheeltapper.describe.irregularity.out_of_round import OutOfRound
from wheeltapper.describe.irregularity.profile import Profile
from wheeltapper.describe.irregularity.step import Step

__all__ = ["Corrugation", "CosineBump", "Measured", "OutOfRound", "Profile", "Repeated", "Step", "WheelFlat"]
