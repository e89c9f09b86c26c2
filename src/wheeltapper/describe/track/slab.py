"""A slab track: rail and pads on rigid ground."""

from __future__ import annotations

from typing import Any, ClassVar

from wheeltapper.describe.track.supported import SupportedRail


class Slab(SupportedRail):
    """A rail on pads that lie on a rigid slab; all numbers are per rail and seat."""

    example: ClassVar[dict[str, Any]] = {"rail": "UIC60", "spacing": 0.65, "pad_stiffness": 40e6, "pad_damping": 12e3}
