"""Kinds of sensors: what each reads, where, in which unit, and what it would show of a run."""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.describe.sensor.along import AlongTrack as AlongTrack
    from wheeltapper.describe.sensor.along import AtPlace as AtPlace
    from wheeltapper.describe.sensor.along import AtSeat as AtSeat
    from wheeltapper.describe.sensor.along import BetweenPlaces as BetweenPlaces
    from wheeltapper.describe.sensor.axle_box_acceleration import AxleBoxAcceleration as AxleBoxAcceleration
    from wheeltapper.describe.sensor.base import FilteredSensor as FilteredSensor
    from wheeltapper.describe.sensor.base import Sensor as Sensor
    from wheeltapper.describe.sensor.contact_force import ContactForce as ContactForce
    from wheeltapper.describe.sensor.deck_acceleration import DeckAcceleration as DeckAcceleration
    from wheeltapper.describe.sensor.pad_force import PadForce as PadForce
    from wheeltapper.describe.sensor.rail_acceleration import RailAcceleration as RailAcceleration
    from wheeltapper.describe.sensor.rail_shear_force import RailShearForce as RailShearForce
    from wheeltapper.describe.sensor.rail_strain import RailStrain as RailStrain
    from wheeltapper.describe.sensor.sleeper_acceleration import SleeperAcceleration as SleeperAcceleration
    from wheeltapper.describe.sensor.sleeper_displacement import SleeperDisplacement as SleeperDisplacement
    from wheeltapper.describe.sensor.sleeper_force import SleeperForce as SleeperForce
else:
    __getattr__, __dir__ = room(__name__)
