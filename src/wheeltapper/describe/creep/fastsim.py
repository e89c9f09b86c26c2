"""FASTSIM: Kalker's simplified theory, cell by cell over the ellipse of contact."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from wheeltapper.describe.creep.base import CreepLaw


class Fastsim(CreepLaw):
    """FASTSIM: the traction grows against the slip from the leading edge on, and is limited by friction.

    Source: J. J. Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11
    (1982). The errors of the theory are some 5 % with the parabolic bound and up to 15 % with spin.

    Parameters
    ----------
    friction, wheel_spin
        As for all creep laws.
    cells, strips
        Number of cells along a strip, and number of strips across the contact ellipse.
    bound
        Bound of the traction over the ellipse: "parabolic" (Kalker's), or "elliptic" like Hertz's pressure.
    """

    cells: int = Field(default=10, ge=2, le=200)
    strips: int = Field(default=10, ge=2, le=200)
    bound: Literal["parabolic", "elliptic"] = "parabolic"
