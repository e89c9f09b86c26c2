"""Laws of one's own: what files keep of their functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.law import Law
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.laws.own_law import FASTEST

FloatArray = NDArray[np.float64]
DEPTHS, RATES = np.linspace(0.0, 1.0, 257)[1:] ** 2, np.linspace(-1.0, 1.0, 9)
"""Places, over the largest ones, at which a file keeps what a law's function returns."""
SAME = 1e-12
"""Difference of a function from what a file keeps of it, over its largest value, up to which it is the same one: other
processors round in other ways."""


def _sampled(law: Law) -> FloatArray:
    depths, rates = np.meshgrid(law.largest * DEPTHS, FASTEST * RATES if law.takes_rate else np.zeros(1))
    return law.values(depths.ravel(), rates.ravel())


def stored_law(law: Law) -> dict[str, Any]:
    """Return what a file keeps of a law: the name of its function, and what this returns at some places."""
    name = f"{getattr(law.force, '__module__', '')}.{getattr(law.force, '__qualname__', type(law.force).__name__)}"
    numbers = {"exponent": law.exponent, "largest": law.largest}
    return {"type": "Law", "force": name, **numbers, "returns": _sampled(law).tolist()}


def law_again(stored: dict[str, Any], function: Any) -> Law:
    """Return the law that a file keeps, with its function, which is given.

    Raises
    ------
    InputError
        If there is none, or another one.
    """
    name = stored.get("force")
    allowed = f"load(..., law=...) with the function that the record was made with, {name}: a file does not hold it"
    if function is None:
        raise InputError("", "contact.force", f"the name of a Python function, {name!r}", allowed)
    law = Law(force=function, **{field: stored.get(field) for field in ("exponent", "largest")})
    found, kept = _sampled(law), np.asarray(stored.get("returns"), dtype=float)
    if found.shape != kept.shape or not np.all(np.abs(found - kept) <= SAME * np.abs(kept).max(initial=0.0)):
        raise InputError("", "law", "a function that returns other forces than that of the record", allowed)
    return law
