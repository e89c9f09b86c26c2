"""Contacts whose force is a formula: a table of it marches in its place."""

from __future__ import annotations

from inspect import Parameter, signature
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.noun import PositiveLength
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import HYSTERESIS, OWN_LAW, Need

if TYPE_CHECKING:
    from collections.abc import Callable

FloatArray = NDArray[np.float64]
ARGUMENTS = (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD)


class ForceLaw(Contact, abstract=True):
    """A contact that only pushes, whose force a method gives: N(δ), or N(δ, δ').

    The force is sampled once, and the run uses a table of it (docs/theory/track.rst, section 13.9); a note of the
    record says how far the two differ. Where the force, or the table, is negative, there is no force. A law of this
    kind is a class with a method ``force``. It can be used with every vehicle and track.

    Parameters
    ----------
    exponent
        Exponent e with which the force grows near zero, as δ^e; 1 to 3.
    largest
        Largest indentation in the table, m. A note of the record says if a run went beyond it.
    """

    takes: ClassVar[str] = (
        "a method from arrays of indentations in m, or of indentations and rates in m/s, to forces in N"
    )
    """What its force has to be, in the words of error messages."""
    exponent: float = Field(default=1.5, ge=1.0, le=3.0)
    largest: PositiveLength = 1e-3
    if TYPE_CHECKING:
        force: Callable[..., Any]
        """From the indentation δ > 0 in m, perhaps also its rate δ' in m/s, to the force of the wheelset in N."""

    @classmethod
    def _wrong_force(cls, found: str) -> InputError:
        return InputError("", "force", found, cls.takes)

    @model_validator(mode="after")
    def _callable_with_arrays(self) -> Self:
        deltas = self.largest * np.array([0.25, 0.5, 1.0])
        values = self.values(deltas, np.zeros(3))
        if values[-1] <= 0.0:
            raise self._wrong_force(f"a function that is {values[-1]:g} at an indentation of {self.largest:g} m")
        return self

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: a law of one's own, perhaps with hysteresis."""
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
        """Return the forces at some indentations and rates, N; refuse results that are not forces."""
        try:
            found = np.asarray(self.force(delta, rate) if self.takes_rate else self.force(delta))
        except InputError:
            raise
        except Exception as error:
            raise self._wrong_force(f"a function that raises {type(error).__name__}: {error}") from error
        if found.shape != delta.shape or found.dtype.kind not in "biuf":
            raise self._wrong_force(f"a function that returns {found.dtype} of shape {found.shape} for {delta.shape}")
        lost = np.flatnonzero(~np.isfinite(found.ravel()))
        if len(lost):
            raise self._wrong_force(f"a function that is {found.ravel()[lost[0]]:g} at {delta.ravel()[lost[0]]:g} m")
        return found.astype(float)
