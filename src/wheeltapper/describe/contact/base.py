"""What every contact law is."""

from __future__ import annotations

from typing import Any, ClassVar

from wheeltapper.describe.noun import Noun


class Contact(Noun, abstract=True):
    """The normal force between wheel and rail."""

    example: ClassVar[dict[str, Any]]
    """Fields of an example, which the conformance tests make."""
