"""What every track is."""

from __future__ import annotations

from typing import Any, ClassVar

from wheeltapper.describe.noun import Noun


class Track(Noun, abstract=True):
    """What carries the rail."""

    example: ClassVar[dict[str, Any]] = {}
    """Fields of an example, which the conformance tests make."""
