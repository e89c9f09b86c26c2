"""The common part of Hertzian contacts: the contact constant, given or from radii and elastic constants."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field, model_validator

from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.noun import HertzConstant, PositiveLength, Pressure
from wheeltapper.ground.errors import InputError


class ElasticContact(Contact, abstract=True):
    """A contact whose elastic part is Hertz's: N = C·δ^1.5.

    C is given, or computed exactly from radii and elastic constants (Hertz 1882; docs/theory/contact.rst, section
    3.1).

    Parameters
    ----------
    constant
        C per wheelset, N/m^1.5.
    constant_per_wheel
        C of one wheel, N/m^1.5. C of a wheelset is the sum over its wheels, at the same indentation.
    rail_radius
        Transverse radius of the rail's crown, m.
    youngs_modulus
        E of both bodies, Pa.
    poisson
        ν of both bodies.
    """

    example: ClassVar[dict[str, Any]] = {"constant": 1.405e11}
    constant: HertzConstant | None = None
    constant_per_wheel: HertzConstant | None = None
    rail_radius: PositiveLength = 0.3
    youngs_modulus: Pressure = 210e9
    poisson: float = Field(default=0.3, ge=0, lt=0.5)

    @model_validator(mode="after")
    def _one_constant(self) -> ElasticContact:
        if self.constant is not None and self.constant_per_wheel is not None:
            raise InputError("", "", "both constant and constant_per_wheel", "one of them, or neither to compute it")
        return self

    @property
    def given(self) -> float | None:
        """The given constant, per wheelset or per wheel; None if it is computed."""
        return self.constant if self.constant is not None else self.constant_per_wheel

    @property
    def altered(self) -> list[str]:
        """Names of the elastic fields that differ from their defaults."""
        fields = ElasticContact.model_fields
        names = ("rail_radius", "youngs_modulus", "poisson")
        return [name for name in names if getattr(self, name) != fields[name].default]

    @property
    def modulus(self) -> float:
        """E* = E/(2·(1 - ν²)) of two bodies of the same material, Pa."""
        return float(self.youngs_modulus / (2.0 * (1.0 - self.poisson**2)))
