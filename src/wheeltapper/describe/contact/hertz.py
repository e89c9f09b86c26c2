"""Hertz contact, with material damping after Hunt and Crossley."""

from __future__ import annotations

from pydantic import Field, model_validator

from wheeltapper.describe.contact.elastic import ElasticContact
from wheeltapper.describe.contact.restitution import hysteresis_from_restitution
from wheeltapper.describe.noun import Speed, TimePerLength
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import HYSTERESIS, NOTHING, Need


class Hertz(ElasticContact):
    """A contact that can only push: N = C·δ^1.5·(1 + χ·δ'), never below zero.

    C is given, or computed exactly from radii and elastic constants (Hertz 1882; docs/theory/contact.rst, section
    3.1). With `curvature` it follows the local longitudinal curvature of the irregularity: the paper's
    parametric excitation. χ is Hunt and Crossley's (1975) material damping.

    Parameters
    ----------
    curvature
        Whether C follows the local longitudinal curvature; by default a given constant does not, a computed one does.
    restitution, impact_speed
        Coefficient of restitution e (0 < e ≤ 1) of a free impact, and its speed, m/s; χ = h(e)/speed exactly.
    hysteresis
        χ itself, s/m.
    """

    curvature: bool | None = None
    restitution: float | None = Field(default=None, gt=0, le=1)
    impact_speed: Speed | None = None
    hysteresis: TimePerLength | None = None

    @model_validator(mode="after")
    def _no_contradiction(self) -> Hertz:
        if self.constant is not None and self.idle:
            raise self.idle
        if self.hysteresis is not None and self.restitution is not None:
            raise InputError("", "", "both hysteresis and restitution", "one of them")
        if (self.restitution is None) != (self.impact_speed is None):
            raise InputError(
                "", "", "one of restitution and impact_speed", "both (the speed at which it holds), or neither"
            )
        if self.impact_speed is not None and self.impact_speed <= 0:
            raise InputError("", "", f"impact_speed {self.impact_speed:g} m/s", "more than 0 m/s")
        return self

    @property
    def idle(self) -> InputError | None:
        """The error to raise if a given constant leaves elastic fields without effect; None if it does not.

        On a wagon these fields always have an effect, because creep depends on the contact ellipse.
        """
        if self.given is None or not self.altered or self.curvature:
            return None
        return InputError(
            "", "", f"a given constant together with {', '.join(self.altered)}",
            "one or the other (both only with curvature = true, where the radii shape its variation)",
        )  # fmt: skip

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: hysteresis, where there is any."""
        return frozenset({HYSTERESIS}) if self.hysteresis_factor else NOTHING

    @property
    def follows_curvature(self) -> bool:
        """Whether the constant follows the local longitudinal curvature."""
        return self.given is None if self.curvature is None else self.curvature

    @property
    def hysteresis_factor(self) -> float:
        """χ in s/m."""
        if self.restitution is not None and self.impact_speed is not None:
            return hysteresis_from_restitution(self.restitution) / float(self.impact_speed)
        return float(self.hysteresis or 0.0)
