"""A contact law of one's own: any Python function of the indentation, perhaps also of its rate."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, signature
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_serializer, model_validator

from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.noun import PositiveLength
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import HYSTERESIS, OWN_LAW, Need

FloatArray = NDArray[np.float64]
ARGUMENTS = (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD)


def _law_error(found: str) -> InputError:
    allowed = (
        "a Python function, which a file cannot hold, from arrays of indentations in m, or of indentations and rates "
        "in m/s, to forces in N"
    )
    return InputError("", "force", found, allowed)


def _example_force(delta: Any) -> Any:
    return 1.405e11 * delta**1.5 * (1.0 + 200.0 * delta)


class Law(Contact):
    """A contact that only pushes, with a force of one's own: N(δ), or N(δ, δ').

    The function is sampled once, and a table marches in its place (docs/theory/track.rst, section 13.9); a note of the
    record tells how far the two differ. Where the function, or the table, is negative, there is no force. A Python
    function cannot stand in a file.

    Parameters
    ----------
    force
        From the indentation δ > 0 in m to the force of the wheelset in N; with two arguments, from δ and its rate δ' in
        m/s. It takes arrays.
    exponent
        e, where N grows as δ^e near zero; 1 to 3.
    largest
        Largest indentation that the table knows, m. A note of the record tells when a run went beyond it.
    """

    example: ClassVar[dict[str, Any]] = {"force": _example_force}
    _leading: ClassVar[tuple[str, ...]] = ("force",)
    force: Callable[..., Any]
    exponent: float = Field(default=1.5, ge=1.0, le=3.0)
    largest: PositiveLength = 1e-3

    @field_serializer("force")
    def _refuse_text(self, value: Any) -> str:
        raise ValueError("a Law holds a Python function and cannot be written to a file")

    @model_validator(mode="before")
    @classmethod
    def _a_function(cls, data: Any) -> Any:
        known = isinstance(data, dict) and set(data) <= {"type", *cls.model_fields}
        if known and not callable(data.get("force")):
            found = value_text(data["force"]) if "force" in data else "nothing"
            raise _law_error(found)
        return data

    @model_validator(mode="after")
    def _callable_with_arrays(self) -> Law:
        deltas = self.largest * np.array([0.25, 0.5, 1.0])
        values = self.values(deltas, np.zeros(3))
        if values[-1] <= 0.0:
            raise _law_error(f"a function that is {values[-1]:g} at an indentation of {self.largest:g} m")
        return self

    @property
    def needs(self) -> frozenset[Need]:
        """A law of one's own, perhaps with hysteresis."""
        return frozenset({OWN_LAW, HYSTERESIS}) if self.takes_rate else frozenset({OWN_LAW})

    @property
    def takes_rate(self) -> bool:
        """Whether the force depends on the rate of the indentation."""
        try:
            found = signature(self.force).parameters.values()
        except (TypeError, ValueError):  # some built-in functions state none
            return False
        needed = [one for one in found if one.kind in ARGUMENTS and one.default is Parameter.empty]
        return len(needed) > 1

    def values(self, delta: FloatArray, rate: FloatArray) -> FloatArray:
        """Return the forces at some indentations and rates, N; refuse what is no force."""
        try:
            found = np.asarray(self.force(delta, rate) if self.takes_rate else self.force(delta))
        except InputError:
            raise
        except Exception as error:
            raise _law_error(f"a function that raises {type(error).__name__}: {error}") from error
        if found.shape != delta.shape or found.dtype.kind not in "biuf":
            raise _law_error(f"a function that returns {found.dtype} of shape {found.shape} for {delta.shape}")
        lost = np.flatnonzero(~np.isfinite(found.ravel()))
        if len(lost):
            raise _law_error(f"a function that is {found.ravel()[lost[0]]:g} at {delta.ravel()[lost[0]]:g} m")
        return found.astype(float)
