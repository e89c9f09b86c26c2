"""Profiles of wheels and rails, and what can be asked of a pair of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import front

if TYPE_CHECKING:
    from wheeltapper.ask.conicity import conicity as conicity
    from wheeltapper.describe.profile import Cones as Cones
    from wheeltapper.describe.profile import ProfileFile as ProfileFile
    from wheeltapper.describe.profile import Profiles as Profiles
    from wheeltapper.describe.profile import WheelRail as WheelRail
else:
    __getattr__, __dir__ = front(
        __name__, "wheeltapper.describe.profile", {"conicity": "wheeltapper.ask.conicity"}
    )  # fmt: skip
