"""Features: single numbers that are computed from an impact train, for records and for maps.

Each is a small object. It also says how far a run has to be computed before the number is known.
"""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.record.features.base import Feature as Feature
    from wheeltapper.record.features.base import Train as Train
    from wheeltapper.record.features.base import custom as custom
    from wheeltapper.record.features.base import feature as feature
    from wheeltapper.record.features.base import named as named
    from wheeltapper.record.features.energy import missing_energy as missing_energy
    from wheeltapper.record.features.forces import decay_rate as decay_rate
    from wheeltapper.record.features.forces import force_ratio as force_ratio
    from wheeltapper.record.features.forces import impulse as impulse
    from wheeltapper.record.features.forces import largest_force as largest_force
    from wheeltapper.record.features.growth import growth_exponent as growth_exponent
    from wheeltapper.record.features.joint import P1 as P1
    from wheeltapper.record.features.joint import P2 as P2
    from wheeltapper.record.features.joint import filtered_force as filtered_force
    from wheeltapper.record.features.joint import wheel_unloading as wheel_unloading
    from wheeltapper.record.features.motion import largest_displacement as largest_displacement
    from wheeltapper.record.features.times import contact_frequency as contact_frequency
    from wheeltapper.record.features.times import first_loss as first_loss
    from wheeltapper.record.features.times import impact_interval as impact_interval
    from wheeltapper.record.features.times import last_loss as last_loss
    from wheeltapper.record.features.times import number_of_impacts as number_of_impacts
    from wheeltapper.record.features.times import time_in_air as time_in_air
else:
    __getattr__, __dir__ = room(__name__)
