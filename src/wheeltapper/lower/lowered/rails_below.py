"""Rails that bend below a vehicle, as readings of the track need them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from wheeltapper.lower.track.anomalies import Anomalies
    from wheeltapper.lower.track.irregular import IrregularModes
    from wheeltapper.lower.track.ring import TrackModes
    from wheeltapper.lower.track.section import Section
    from wheeltapper.march.wagon.rails.replay import RailAt

FloatArray = NDArray[np.float64]


class RailsBelow(NamedTuple):
    """Rails below a vehicle.

    Attributes
    ----------
    ways
        Section and modes of each way to move: one, or both rails together and against one another.
    anomalies
        In each way.
    seat
        Position of the seat from which the march counts, m.
    wheels
        Positions of the wheelsets at time zero, m from there.
    residuals
        Local compliance below each void in each way, m/N; their forces follow those of the wheels.
    arms
        How far out these forces are, in distances of the rail from the middle.
    at
        From rising times to each way; with or without second derivatives.
    sides
        Names of the rails; none where one stands for all.
    """

    ways: tuple[tuple[Section, TrackModes | IrregularModes], ...]
    anomalies: tuple[Anomalies, ...]
    seat: float
    wheels: list[float]
    residuals: list[FloatArray]
    arms: list[FloatArray]
    at: Callable[[FloatArray, bool], list[RailAt]]
    sides: tuple[str, ...] = ()
