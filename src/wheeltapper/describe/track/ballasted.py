"""A ballasted track: rail, pads, sleepers, ballast."""

from __future__ import annotations

from typing import Any, ClassVar

from wheeltapper.describe.noun import Damping, Mass, PositiveStiffness
from wheeltapper.describe.track.published import published_track, track_names
from wheeltapper.describe.track.rail import Rail
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.errors import InputError, value_text, with_suggestion


class Ballasted(SupportedRail):
    """A rail on pads, sleepers and ballast; all numbers are per rail and seat.

    Each seat is a pad k_p-c_p between the rail and half a sleeper m_s, which lies on a spring and a damper k_b-c_b to
    rigid ground. The ballast has no mass, and there is no subgrade.

    Parameters
    ----------
    sleeper_mass
        Half of a sleeper, kg.
    ballast_stiffness, ballast_damping
        Under half of a sleeper: N/m and N·s/m.
    """

    example: ClassVar[dict[str, Any]] = {
        "rail": "UIC60", "spacing": 0.6, "pad_stiffness": 180e6, "pad_damping": 18e3, "sleeper_mass": 150.0,
        "ballast_stiffness": 105e6, "ballast_damping": 48e3,
    }  # fmt: skip
    sleeper_mass: Mass
    ballast_stiffness: PositiveStiffness
    ballast_damping: Damping

    @property
    def under_pads(self) -> tuple[float, ...]:
        """Mass, stiffness and damping under each pad, kg, N/m and N·s/m."""
        return self.sleeper_mass, self.ballast_stiffness, self.ballast_damping

    @classmethod
    def named(cls, name: str) -> Ballasted:
        """Return a published track; its field `source` says where the numbers come from.

        What a publication lacks of its rail is taken from the first track. Mass of the ballast and subgrade, where a
        publication has them, are ignored.

        Parameters
        ----------
        name
            "rolland_UIC60_example", "rolland_Nordborg", "Zhai2004" or "railFE_default".

        Raises
        ------
        InputError
            If there is none of that name.
        """
        if not isinstance(name, str) or name not in track_names():
            raise InputError("", "name", value_text(name), with_suggestion(str(name), track_names()))
        return cls(rail=Rail.named(name), **published_track(name))
