"""Whether forces stayed within the range of an elastic-plastic law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.plastic import PlasticLaw


def beyond_law(contact: Any, laws: Sequence[PlasticLaw], reached: Sequence[float]) -> tuple[Note, ...]:
    """Return what the user should know of contacts that go beyond what their laws were stated for, of the worst one.

    `reached` are their largest forces, N, each that of a whole wheelset.
    """
    stated = [law.force_at(contact.limit) for law in laws]
    worst = max(zip(reached, stated, strict=True), key=lambda one: one[0] / one[1], default=(0.0, 0.0))
    force, allowed = worst
    if force <= allowed:
        return ()
    text = (
        f"the contact force reaches {force / 1e3:.4g} kN, but {type(contact).__name__} holds up to "
        f"{contact.limit:g} times the indentation at yield, {allowed / 1e3:.4g} kN"
    )
    return (Note(text, "beyond the law", force / allowed, doubtful=True),)
