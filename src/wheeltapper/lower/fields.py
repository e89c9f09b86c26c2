"""The numbers of a scenario by their paths. Some of them may be arrays with one entry per cell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.placement import Placement
from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]


class Fields:
    """A scenario in which some fields have one number per cell; the imaginary parts of complex ones are derivatives."""

    def __init__(self, scenario: Scenario, changed: Mapping[str, NDArray[Any]] | None = None) -> None:
        self.scenario = scenario
        self.changed = dict(changed or {})
        self.cells = max((len(values) for values in self.changed.values()), default=1)

    def __call__(self, path: str) -> Any:
        """Return the number (or array) at a path such as "vehicle.mass"."""
        if path in self.changed:
            return self.changed[path]
        value: Any = self.scenario
        for part in path.split("."):
            if isinstance(value, Placement):
                value = value[part]
            else:
                value = value[int(part)] if part.isdigit() else getattr(value, part)
        return value
