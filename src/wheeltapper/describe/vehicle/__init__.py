"""Vehicles, and the parts that a wagon of one's own is made of."""

from wheeltapper.describe.vehicle.body import Axle, Body
from wheeltapper.describe.vehicle.element import Damper, Link, Spring, Stop
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.describe.vehicle.wheelset import Wheelset

__all__ = ["Axle", "Body", "Damper", "Link", "Spring", "Stop", "Wagon", "Wheelset"]
