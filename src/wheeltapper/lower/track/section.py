"""The numbers of a track of equal bays, without names and units: all that its waves and its modes depend on."""

from __future__ import annotations

from typing import NamedTuple

from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.errors import InputError

LONGEST_SPACING = 10.0
"""Longest distance of two seats, m. On longer ones the rail's near field is lost in rounding from seat to seat."""


class Section(NamedTuple):
    """One bay of one rail, in SI units; hashable, so that what is computed of it is kept by its content.

    Attributes
    ----------
    bending, shear
        EI, N·m², and κGA, N.
    mass, rotary
        m, kg/m, and ρI, kg·m.
    loss
        β of the rail's Kelvin-Voigt damping, s.
    spacing
        a, m.
    pad, pad_damping
        N/m and N·s/m.
    sleeper
        Half a sleeper, kg; 0: the pads lie on rigid ground.
    ballast, ballast_damping
        N/m and N·s/m.
    """

    bending: float
    shear: float
    mass: float
    rotary: float
    loss: float
    spacing: float
    pad: float
    pad_damping: float
    sleeper: float = 0.0
    ballast: float = 0.0
    ballast_damping: float = 0.0

    @property
    def seat(self) -> float:
        """Stiffness of a seat, pad and ballast one after the other, N/m."""
        return self.pad * self.ballast / (self.pad + self.ballast) if self.sleeper > 0.0 else self.pad


def section_of(track: SupportedRail, rolling: bool = False) -> Section:
    """Return the numbers of a track; `rolling`: where its rails move against one another, so that sleepers roll."""
    rail = track.rail
    if track.spacing > LONGEST_SPACING:
        raise InputError("", "track.spacing", f"{track.spacing:g} m", f"at most {LONGEST_SPACING:g} m; usual are 0.6 m")
    return Section(
        rail.bending_stiffness, rail.shear_stiffness, rail.mass_per_length, rail.inertia, rail.damping, track.spacing,
        track.pad_stiffness, track.pad_damping, *(track.under_rolling_pads if rolling else track.under_pads),
    )  # fmt: skip
