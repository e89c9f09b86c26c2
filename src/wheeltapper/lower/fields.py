"""The numbers of a scenario by their paths. Some of them may be arrays with one entry per cell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.paths import value_at
from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Fields:
    """A scenario in which some fields have one number per cell; the imaginary parts of complex ones are derivatives."""

    def __init__(self, scenario: Scenario, changed: Mapping[str, NDArray[Any]] | None = None) -> None:
        self.scenario = scenario
        self.changed = dict(changed or {})
        self.cells = max((len(values) for values in self.changed.values()), default=1)

    def variants(self, paths: Sequence[str]) -> tuple[list[dict[str, float]], IntArray]:
        """Return the values that some changed fields have together, each once, and which of them each cell has."""
        if not paths:
            return [{}], np.zeros(self.cells, dtype=np.int64)
        columns = np.column_stack([self.changed[path] for path in paths])
        found, owner = np.unique(columns, axis=0, return_inverse=True)
        return [dict(zip(paths, row, strict=True)) for row in found.tolist()], owner.ravel()

    def __call__(self, path: str) -> Any:
        """Return the number (or array) at a path such as "vehicle.mass"."""
        if path in self.changed:
            return self.changed[path]
        return value_at(self.scenario, path)
