"""Irregularities of rail and wheel."""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.describe.irregularity.base import Irregularity as Irregularity
    from wheeltapper.describe.irregularity.bump import CosineBump as CosineBump
    from wheeltapper.describe.irregularity.combination import Repeated as Repeated
    from wheeltapper.describe.irregularity.corrugation import Corrugation as Corrugation
    from wheeltapper.describe.irregularity.course import Chord as Chord
    from wheeltapper.describe.irregularity.course import Course as Course
    from wheeltapper.describe.irregularity.course import Harmonic as Harmonic
    from wheeltapper.describe.irregularity.course import Stretch as Stretch
    from wheeltapper.describe.irregularity.course import chord as chord
    from wheeltapper.describe.irregularity.course import harmonic as harmonic
    from wheeltapper.describe.irregularity.course import level as level
    from wheeltapper.describe.irregularity.density import third_octave_levels as third_octave_levels
    from wheeltapper.describe.irregularity.flat import WheelFlat as WheelFlat
    from wheeltapper.describe.irregularity.joint import DippedJoint as DippedJoint
    from wheeltapper.describe.irregularity.measured import Measured as Measured
    from wheeltapper.describe.irregularity.out_of_round import OutOfRound as OutOfRound
    from wheeltapper.describe.irregularity.profile import Profile as Profile
    from wheeltapper.describe.irregularity.spectrum import Spectrum as Spectrum
    from wheeltapper.describe.irregularity.step import Step as Step
    from wheeltapper.describe.irregularity.weld import Weld as Weld
else:
    __getattr__, __dir__ = room(__name__)
