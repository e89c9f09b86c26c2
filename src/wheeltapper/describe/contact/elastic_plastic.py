"""The common part of elastic-plastic contact laws: onset of yield, unloading, and residual indentation.

Let D = δ/δ_Y be the indentation over that at first yield. A law gives the loading force N/N_Y and the residual
indentation δ_r/δ_Y after unloading from D. Unloading and reloading are elastic, with the radius of the flattened spot:
N = N_m·((δ - δ_r)/(δ_m - δ_r))^1.5, up to the largest indentation δ_m of the spot so far.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from wheeltapper.describe.contact.elastic import ElasticContact
from wheeltapper.describe.noun import PositiveForce, Pressure
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import YIELDING, Need

FloatArray = NDArray[np.float64]

PLASTIC_CONSTRAINT = 2.8
"""Ratio of hardness to yield strength: the mean pressure of a fully plastic contact over Y."""


def blended(d: FloatArray, start: float, end: float, before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the first function before `start`, the second one after `end`, and between them a smooth mixture."""
    share = np.clip((d - start) / (end - start), 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    return np.asarray(before + share * (after - before))


class ElasticPlastic(ElasticContact, abstract=True):
    """An elastic-plastic contact that can only push.

    A rolling wheel always meets new surface. The force therefore follows the loading curve in both directions (the
    paper, section 2). At speed 0 every impact meets the same spot, and the force also depends on the spot's largest
    indentation so far.

    Parameters
    ----------
    yield_force
        Normal force at which yield begins, N per wheelset. By default, without a strength or hardness, twice the
        static contact force.
    yield_strength
        Y of the softer body, Pa; yield begins where the contact's pressure reaches what the law states.
    hardness
        H of the softer body, Pa, instead of its strength; Y = H/2.8.
    rail_hardness, wheel_hardness
        H of both bodies, Pa. They determine how the bodies share the marks. The softer one yields, unless
        `yield_force`, `yield_strength` or `hardness` is given.
    rail_share
        Share of a permanent indentation in the rail, 0 to 1; the rest is in the wheel. By default one half, or with
        both hardnesses H_wheel/(H_wheel + H_rail).
    """

    example: ClassVar[dict[str, Any]] = {"constant": 1.405e11, "yield_force": 1e5}
    yield_force: PositiveForce | None = None
    yield_strength: Pressure | None = None
    hardness: Pressure | None = None
    rail_hardness: Pressure | None = None
    wheel_hardness: Pressure | None = None
    rail_share: float | None = Field(default=None, ge=0, le=1)

    borders: ClassVar[tuple[float, ...]] = ()
    """D > 1 at which the law's formula changes."""
    limit: ClassVar[float] = 300.0
    """Largest D of the published law, or of its form here."""
    warning: ClassVar[str] = ""
    """A note for impacts on one spot."""

    @model_validator(mode="after")
    def _one_yield(self) -> ElasticPlastic:
        names = [n for n in ("yield_force", "yield_strength", "hardness") if getattr(self, n) is not None]
        if len(names) > 1:
            raise InputError("", "", " and ".join(names), "one of them, or none")
        both = (self.rail_hardness, self.wheel_hardness)
        if (both[0] is None) != (both[1] is None):
            raise InputError("", "", "one of rail_hardness and wheel_hardness", "both, or neither")
        if both[0] is not None and self.rail_share is not None:
            raise InputError("", "", "rail_share together with two hardnesses", "one or the other")
        needs = self.yield_strength is not None or self.softest is not None
        if self.given is not None and self.altered and not needs:
            raise InputError(
                "", "", f"a given constant together with {', '.join(self.altered)}",
                "one or the other (both where a yield strength or a hardness needs them)",
            )  # fmt: skip
        return self

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: a contact that yields."""
        return frozenset({YIELDING})

    @property
    def softest(self) -> float | None:
        """Hardness of the body that yields, Pa; None if yield is given otherwise."""
        if self.yield_force is not None or self.yield_strength is not None:
            return None
        if self.hardness is None and self.rail_hardness is not None and self.wheel_hardness is not None:
            return float(min(self.rail_hardness, self.wheel_hardness))
        return self.hardness

    @property
    def share_of_rail(self) -> float:
        """Share of a permanent indentation in the rail."""
        if self.rail_hardness is not None and self.wheel_hardness is not None:
            return float(self.wheel_hardness / (self.wheel_hardness + self.rail_hardness))
        return 0.5 if self.rail_share is None else float(self.rail_share)

    def pressure(self) -> float:
        """Return the largest contact pressure at first yield, Pa, for a given strength or hardness."""
        raise NotImplementedError

    def _yield_strength(self) -> float:
        return float(self.yield_strength or (self.softest or 0.0) / PLASTIC_CONSTRAINT)

    def yield_indentation(self, constant: float, wheels: int, static_force: float) -> float:
        """Return the indentation δ_Y at first yield, m.

        Parameters
        ----------
        constant
            C of the wheelset, N/m^1.5.
        wheels
            Number of equal contacts. The pressure is that of a sphere with the constant of one contact.
        static_force
            N0 of the wheelset, N.
        """
        if self.yield_strength is None and self.softest is None:
            force = 2.0 * static_force if self.yield_force is None else self.yield_force
            return float((force / constant) ** (2.0 / 3.0))
        radius = (0.75 * constant / wheels / self.modulus) ** 2
        return float((0.5 * np.pi * self.pressure() / self.modulus) ** 2 * radius)

    def loading(self, indentation: ArrayLike) -> FloatArray:
        """Return N/N_Y, the loading force over that at first yield, at the indentations D = δ/δ_Y ≥ 1."""
        raise NotImplementedError

    def residual(self, indentation: ArrayLike) -> FloatArray:
        """Return δ_r/δ_Y, the residual indentation after unloading from D = δ/δ_Y ≥ 1 over that at first yield."""
        raise NotImplementedError
