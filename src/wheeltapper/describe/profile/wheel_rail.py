"""The rolling surfaces: profiles of wheel and rail with their positions, or plain cones."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

from pydantic import Field, model_validator

from wheeltapper.describe.noun import Length, Noun, PositiveLength
from wheeltapper.describe.profile.file import ProfileFile, read_profile
from wheeltapper.ground.errors import InputError


class Profiles(Noun, abstract=True):
    """The surfaces of wheels and rails."""

    @property
    def files(self) -> tuple[str | ProfileFile, ...]:
        """The profiles, with the contents of their files; empty for surfaces that are a formula."""
        return ()


class WheelRail(Profiles):
    """Profiles of wheels and rails, the same on both sides.

    Parameters
    ----------
    wheel
        "S1002", "EN 13715 1:40", "EN 13715 EPS" (with a flange of 28.5 to 32 mm: "EN 13715 EPS e30"), "APTA 320" (also
        120, 140, 140M, 220, 240, 340), a reference profile as "EN 15302 A" (also B, C, H, I), or a file with the
        profile: two columns in mm (.txt, .dat, .csv), MiniProf (.whl) or SIMPACK (.prw).
        It is read when it is first needed; a new object reads it again. Or a `ProfileFile` with its contents.
    rail
        "60E1" (as in points that are in use; that of the standard's joints is "EN 13674 60E1"), any other rail of EN
        13674 as "54E1", "EN 15302 A" (with inclination 0 and a gauge of 1.435164 m), or a file with the profile: two
        columns in mm, MiniProf (.ban) or SIMPACK (.prr).
    inclination
        Inclination of the rails towards the track's middle.
    gauge
        Distance between the rails, 14 mm below their tops, m.
    flange_backs
        Distance between the backs of the two wheels' flanges, m.
    smoothing
        Smoothing length ε, m, of the order of the indentation. Places are weighted with exp(-gap/ε). This smooths the
        jumps of the contact between rigid profiles. The guide on wagons describes its effect on rolling radii.
    """

    wheel: str | ProfileFile = "S1002"
    rail: str | ProfileFile = "60E1"
    inclination: float = Field(default=0.025, ge=0, le=0.2)
    gauge: PositiveLength = 1.435
    flange_backs: PositiveLength = 1.360
    smoothing: PositiveLength = 15e-6

    @model_validator(mode="after")
    def _check_dimensions(self) -> WheelRail:
        if not 0.02 <= self.gauge - self.flange_backs <= 0.12:
            found = f"{self.gauge:g} m with flanges {self.flange_backs:g} m apart"
            raise InputError("", "gauge", found, "20 mm to 120 mm more than between the flanges' backs")
        if not 1e-7 <= self.smoothing <= 1e-3:
            raise InputError("", "smoothing", f"{self.smoothing:g} m", "0.1 µm to 1 mm")
        return self

    @cached_property
    def files(self) -> tuple[str | ProfileFile, ...]:
        """Profile of the wheel and of the rail, files with their contents."""
        return read_profile(self.wheel, "wheel"), read_profile(self.rail, "rail")

    def _with_data(self) -> WheelRail:
        """Return the same with the contents of the files."""
        wheel, rail = self.files
        return self if self.files == (self.wheel, self.rail) else self.model_copy(update={"wheel": wheel, "rail": rail})


class Cones(Profiles):
    """Conical wheels on rails that touch them at one place.

    Parameters
    ----------
    conicity
        Slope of the cones, whose radius grows towards the flange.
    arm
        Half the distance between the two contacts, m.
    moving_with
        "rail": the contacts keep their places on the rails as the wheelset shifts. "wheel": they move with it.
    """

    conicity: float = Field(default=0.0, ge=0, lt=1)
    arm: Length = Field(default=0.75, gt=0)
    moving_with: Literal["rail", "wheel"] = "rail"
