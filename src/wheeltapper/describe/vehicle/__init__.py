"""Vehicles, and the parts of a wagon that a user describes."""

from wheeltapper.describe.vehicle.body import Axle, Body
from wheeltapper.describe.vehicle.element import Damper, Link, Spring, Stop
from wheeltapper.describe.vehicle.wagon import ErriB176, Wagon
from wheeltapper.describe.vehicle.wheelset import Wheelset

__all__ = ["Axle", "Body", "Damper", "ErriB176", "Link", "Spring", "Stop", "Wagon", "Wheelset"]
