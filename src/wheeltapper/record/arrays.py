"""Arrays that users give: of numbers in SI units, or of quantities with a unit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import has_unit, in_si, to_si


def as_array(
    given: Any, field: str, allowed: str, dimension: str = "number", kind: type[np.generic] = np.float64
) -> NDArray[Any]:
    """Return an array in SI units.

    Parameters
    ----------
    given
        Numbers in SI units in any shape, texts and quantities with a unit, or an array that has one, as of pint.
    field, allowed
        What the array is, and what it may be, for the message.
    dimension
        A key of `wheeltapper.ground.quantities.UNITS`.
    kind
        Of the numbers.

    Raises
    ------
    InputError
        If it is no array of real numbers.
    """
    if has_unit(given):  # NumPy would take its numbers and leave its unit
        given = in_si(given, dimension, field)
    elif isinstance(given, str):
        given = to_si(given, dimension, field)
    elif isinstance(given, list | tuple) and any(isinstance(one, str) or has_unit(one) for one in given):
        given = [to_si(one, dimension, field) for one in given]
    try:
        values = np.asarray(given)
        if given is not None and values.dtype.kind in "fiubO":  # None alone would be NaN
            return np.asarray(values, dtype=kind)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError("", field, value_text(given), allowed)
