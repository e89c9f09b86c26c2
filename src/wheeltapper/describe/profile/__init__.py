"""Profiles of wheels and rails, and how they lie on each other."""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.describe.profile.file import ProfileFile as ProfileFile
    from wheeltapper.describe.profile.wheel_rail import Cones as Cones
    from wheeltapper.describe.profile.wheel_rail import Profiles as Profiles
    from wheeltapper.describe.profile.wheel_rail import WheelRail as WheelRail
else:
    __getattr__, __dir__ = room(__name__)
