"""Profiles of wheels and rails, and how they lie on each other."""

from wheeltapper.describe.profile.wheel_rail import Cones, WheelRail

__all__ = ["Cones", "WheelRail"]
