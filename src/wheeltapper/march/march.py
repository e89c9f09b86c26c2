"""What every march offers to those who read its results."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common.program import FloatArray, IntArray


class March(Protocol):
    """A march, in the units of its program."""

    @property
    def status(self) -> int:
        """Why it ended (`common.program` and its like)."""
        ...

    @property
    def end(self) -> float:
        """Time at the end."""
        ...

    @property
    def events(self) -> FloatArray:
        """Losses, impacts and onsets of yield (events, EVENT_COLUMNS) in the columns of `common.program`."""
        ...

    @property
    def peaks(self) -> FloatArray:
        """Maxima of the contacts' forces (peaks, PEAK_COLUMNS) in the columns of `common.program`."""
        ...

    @property
    def spans(self) -> FloatArray:
        """Time and length of each step, (steps, 2)."""
        ...

    def without_force(self, contacts: IntArray) -> NDArray[np.bool_]:
        """Return where some contacts have no force, (steps, contacts)."""
        ...

    def log(self, program: Any) -> dict[str, FloatArray]:
        """Return what brings it back by `run.restored` where its program is known: arrays by name."""
        ...

    def happened(self) -> list[FloatArray]:
        """Return what happened, as rows that are the same where the same happened in the same order."""
        ...
