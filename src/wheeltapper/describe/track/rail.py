"""A rail as a beam."""

from __future__ import annotations

from typing import Any

from wheeltapper.describe.noun import (
    BendingStiffness,
    InertiaPerLength,
    MassPerLength,
    MaterialDamping,
    Noun,
    PositiveForce,
    PositiveLength,
)
from wheeltapper.describe.track.published import published_rail, rail_names
from wheeltapper.ground.errors import InputError, value_text, with_suggestion

STEEL_DENSITY, STEEL_MODULUS = 7850.0, 210e9
"""kg/m³ and N/m²; they give the rotary inertia of a rail from its bending stiffness."""


class Rail(Noun):
    """One rail as a Timoshenko beam, with Kelvin-Voigt damping.

    Bending moment and shear force are M = EI·(1 + β∂/∂t)·θ' and Q = κGA·(1 + β∂/∂t)·(w' - θ), with the deflection w and
    the rotation θ of the cross-section (docs/theory/track.rst, section 13.1). Wherever a rail is needed, a name that
    `Rail.named` takes can be given instead.

    Parameters
    ----------
    bending_stiffness
        EI, N·m².
    shear_stiffness
        κGA, N.
    mass_per_length
        kg/m.
    rotary_inertia
        ρI, kg·m; None: that of steel, 7850 kg/m³·EI/210 GPa.
    damping
        β, s, at most 2e-5; the loss factor at the frequency f is 2π·f·β, such as 0.0126 at 1 kHz with 2e-6 s.
    foot_distance
        Distance from the neutral axis to the underside of the foot, where strain is computed, m.
    """

    _needs_type = False

    bending_stiffness: BendingStiffness
    shear_stiffness: PositiveForce
    mass_per_length: MassPerLength
    rotary_inertia: InertiaPerLength | None = None
    damping: MaterialDamping = 2e-6
    foot_distance: PositiveLength = 0.0809

    @property
    def inertia(self) -> float:
        """Rotary inertia ρI, given or that of steel, kg·m."""
        if self.rotary_inertia is None:
            return float(STEEL_DENSITY * self.bending_stiffness / STEEL_MODULUS)
        return float(self.rotary_inertia)

    @classmethod
    def named(cls, name: str, **fields: Any) -> Rail:
        """Return a rail by the name of a published track ("Zhai2004", …), or "UIC60" or "60E1".

        Parameters
        ----------
        name
            The rail's name; in a file its field `name`.
        fields
            Fields that differ from the published ones.

        Raises
        ------
        InputError
            If there is no rail of that name.
        """
        if not isinstance(name, str) or name not in rail_names():
            raise InputError("", "", value_text(name), with_suggestion(str(name), rail_names()))
        return cls(**published_rail(name) | fields)

    @classmethod
    def published_names(cls) -> list[str]:
        """Return the names that `named` takes."""
        return rail_names()


def as_rail(given: Any) -> Any:
    """Return the rail that a name stands for; what is no text is left as it is."""
    return Rail.named(given) if isinstance(given, str) else given
