"""A ballasted track: rail, pads, sleepers, ballast."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import model_validator

from wheeltapper.describe.noun import (
    AngularDamping,
    Damping,
    Inertia,
    Mass,
    PositiveAngularStiffness,
    PositiveLength,
    PositiveStiffness,
)
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
        Mass of half a sleeper, kg.
    ballast_stiffness, ballast_damping
        Stiffness and damping under half of a sleeper, N/m and N·s/m.
    sleeper_roll_inertia
        Moment of inertia of a whole sleeper about an axis through its middle along the track, kg·m²; None: each rail
        has half-sleepers of its own, which move independently. It acts where the two rails are loaded differently:
        below a `Wagon`. A rigid sleeper of even mass and length L has m·L²/12, with its whole mass m = 2·sleeper_mass.
    ballast_roll_stiffness, ballast_roll_damping
        Of the ballast under a whole sleeper, N·m/rad and N·m·s/rad; None: those of ballast that is even over the length
        of a sleeper with that inertia. Their ratio to the inertia is then that of ballast_stiffness and ballast_damping
        to sleeper_mass.
    seat_distance
        Distance between the two seats of a sleeper, m.
    """

    example: ClassVar[dict[str, Any]] = {
        "rail": "UIC60", "spacing": 0.6, "pad_stiffness": 180e6, "pad_damping": 18e3, "sleeper_mass": 150.0,
        "ballast_stiffness": 105e6, "ballast_damping": 48e3,
    }  # fmt: skip
    sleeper_mass: Mass
    ballast_stiffness: PositiveStiffness
    ballast_damping: Damping
    sleeper_roll_inertia: Inertia | None = None
    ballast_roll_stiffness: PositiveAngularStiffness | None = None
    ballast_roll_damping: AngularDamping | None = None
    seat_distance: PositiveLength = 1.5

    @model_validator(mode="after")
    def _check_roll(self) -> Ballasted:
        for field in ("ballast_roll_stiffness", "ballast_roll_damping"):
            if self.sleeper_roll_inertia is None and getattr(self, field) is not None:
                raise InputError("", field, "one without sleeper_roll_inertia", "both, or none")
        return self

    @property
    def under_pads(self) -> tuple[float, ...]:
        """Mass, stiffness and damping under each pad, kg, N/m and N·s/m."""
        return self.sleeper_mass, self.ballast_stiffness, self.ballast_damping

    @property
    def under_rolling_pads(self) -> tuple[float, ...]:
        """As `under_pads`, where the two rails move against each other, so that sleepers roll.

        A seat is half of the distance d from the middle, and moves by φ·d/2 with a roll φ. Half of a sleeper then acts
        as a mass 2·J/d², and its ballast likewise (docs/theory/track.rst, section 13.12).
        """
        if self.sleeper_roll_inertia is None:
            return self.under_pads
        by_inertia = 2.0 / self.seat_distance**2
        mass = by_inertia * self.sleeper_roll_inertia
        share = mass / self.sleeper_mass
        stiffness, damping = self.ballast_roll_stiffness, self.ballast_roll_damping
        return (
            mass,
            share * self.ballast_stiffness if stiffness is None else by_inertia * stiffness,
            share * self.ballast_damping if damping is None else by_inertia * damping,
        )

    @classmethod
    def named(cls, name: str, **fields: Any) -> Ballasted:
        """Return a published track; its field `source` says where the numbers come from.

        In a file, write `name` beside `type` for the same: fields beside the name overrule those of the track.

        Values of the rail that a publication lacks are taken from the first track. Mass of the ballast and subgrade are
        ignored, if a publication has them.

        Parameters
        ----------
        name
            "rolland_UIC60_example", "rolland_Nordborg", "Zhai2004" or "railFE_default".
        fields
            Fields that differ from the published ones; `source` names them as well, unless it is given.

        Raises
        ------
        InputError
            If there is no track of that name.
        """
        if not isinstance(name, str) or name not in track_names():
            raise InputError("", "name", value_text(name), with_suggestion(str(name), track_names()))
        held = {"rail": Rail.named(name)} | published_track(name)
        other = [field.replace("_", " ") for field in fields if field in held]
        if other:
            held["source"] += f"; {' and '.join(other)} given instead"
        return cls(**held | fields)

    @classmethod
    def published_names(cls) -> list[str]:
        """Return the names that `named` takes."""
        return track_names()
