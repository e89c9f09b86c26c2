"""Vehicles, and the parts of a wagon that a user describes."""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.describe.vehicle.base import Vehicle as Vehicle
    from wheeltapper.describe.vehicle.body import Axle as Axle
    from wheeltapper.describe.vehicle.body import Body as Body
    from wheeltapper.describe.vehicle.bogie import Bogie as Bogie
    from wheeltapper.describe.vehicle.element import Damper as Damper
    from wheeltapper.describe.vehicle.element import Element as Element
    from wheeltapper.describe.vehicle.element import Friction as Friction
    from wheeltapper.describe.vehicle.element import Link as Link
    from wheeltapper.describe.vehicle.element import Sliding as Sliding
    from wheeltapper.describe.vehicle.element import Spring as Spring
    from wheeltapper.describe.vehicle.element import Stop as Stop
    from wheeltapper.describe.vehicle.freight import CentreBowl as CentreBowl
    from wheeltapper.describe.vehicle.freight import CompressionSpring as CompressionSpring
    from wheeltapper.describe.vehicle.freight import FrictionWedge as FrictionWedge
    from wheeltapper.describe.vehicle.freight import LenoirLink as LenoirLink
    from wheeltapper.describe.vehicle.freight import LoadFriction as LoadFriction
    from wheeltapper.describe.vehicle.passenger_cars import CooperriderCar as CooperriderCar
    from wheeltapper.describe.vehicle.passenger_cars import Gz18 as Gz18
    from wheeltapper.describe.vehicle.three_piece import ThreePieceWagon as ThreePieceWagon
    from wheeltapper.describe.vehicle.wagon import ErriB176 as ErriB176
    from wheeltapper.describe.vehicle.wagon import Published as Published
    from wheeltapper.describe.vehicle.wagon import Wagon as Wagon
    from wheeltapper.describe.vehicle.wheelset import Wheelset as Wheelset
    from wheeltapper.describe.vehicle.wheelsets import Wheelsets as Wheelsets
else:
    __getattr__, __dir__ = room(__name__)
