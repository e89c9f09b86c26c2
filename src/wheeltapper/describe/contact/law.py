"""A contact law of one's own: any Python function of the indentation, perhaps also of its rate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from pydantic import field_serializer, model_validator

from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.ground.errors import value_text


def _example_force(delta: Any) -> Any:
    return 1.405e11 * delta**1.5 * (1.0 + 200.0 * delta)


class Law(ForceLaw):
    """A contact that only pushes, with a force of one's own: N(δ), or N(δ, δ').

    The function is sampled once, and the run uses a table of it (docs/theory/track.rst, section 13.9); a note of the
    record says how far the two differ. Where the function, or the table, is negative, there is no force. A file cannot
    hold a Python function.

    Parameters
    ----------
    force
        Function that returns the force of the wheelset in N for the indentation δ > 0 in m; with two arguments, for δ
        and its rate δ' in m/s. It takes arrays.
    """

    takes: ClassVar[str] = (
        "a Python function, which a file cannot hold, from arrays of indentations in m, or of indentations and rates "
        "in m/s, to forces in N"
    )
    example: ClassVar[dict[str, Any]] = {"force": _example_force}
    _leading: ClassVar[tuple[str, ...]] = ("force",)
    force: Callable[..., Any]

    @field_serializer("force")
    def _refuse_text(self, value: Any) -> str:
        raise ValueError("a Law holds a Python function and cannot be written to a file")

    @model_validator(mode="before")
    @classmethod
    def _a_function(cls, data: Any) -> Any:
        known = isinstance(data, dict) and set(data) <= {"type", *cls.model_fields}
        if known and not callable(data.get("force")):
            found = value_text(data["force"]) if "force" in data else "nothing"
            raise cls._wrong_force(found)
        return data
