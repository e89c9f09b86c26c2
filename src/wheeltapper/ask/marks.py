"""The marks that one pass leaves on rail and wheel, as irregularities that can be rolled over again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.measured import Measured
from wheeltapper.describe.irregularity.out_of_round import OutOfRound
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.marks import Surface
from wheeltapper.lower.plastic import patch_semi_axis
from wheeltapper.march import program as contract
from wheeltapper.march import run
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

SAMPLES = 4
"""Number of samples of the mark per half semi-axis of the contact patch."""
FINER = 4
"""Number of positions of the wheel's centre per sample at which the indentation is computed. More than one is needed
because the point of contact may move faster than the centre."""
WRAPPED = 4
"""Length, in half semi-axes, over which the samples are repeated at both ends of the circumference, so that averages
are periodic."""


@dataclass(frozen=True)
class Marks:
    """The marks of one pass.

    Attributes
    ----------
    rail
        The rail's part, to be added to a scenario's irregularities.
    wheel
        The wheel's part, over its circumference. The point of the wheel that was at x = 0 is there again.
    table
        Over `position`: permanent indentation of both bodies together, and the heights of the rail's part.
    notes
        What the user should know.
    """

    rail: Measured
    wheel: OutOfRound
    table: xr.Dataset
    notes: tuple[str, ...]


def marks(record: Record) -> Marks:
    """Return the marks that a simulated pass leaves on rail and wheel.

    The permanent indentation at a place follows from its largest indentation by the contact law. It is averaged over
    the contact patch. The rail takes the share `rail_share` of it.

    Parameters
    ----------
    record
        Record of a wheelset that rolls with an elastic-plastic contact.

    Raises
    ------
    InputError
        If the contact leaves no marks, or the wheel does not roll.
    """
    if not isinstance(record, Record):
        raise InputError("", "record", f"a {type(record).__name__}", "a Record")
    scenario = record.scenario
    run.choose(run.MARKS, scenario.needs)
    contact, lowered = scenario.contact, record._lowered
    law, unit = lowered.program.law, lowered.length
    semi_axis = patch_semi_axis(contact, scenario.vehicle, record.static_force)
    onset = float(law[0, contract.LAW_START] * unit)
    length, turn = float(scenario.speed * record.end), 2.0 * pi * float(scenario.vehicle.radius)
    virgin = Surface.virgin_surface(length, semi_axis, onset, SAMPLES)
    depth = _depth_function(record, virgin.sample_spacing)

    def left_marks(borne: FloatArray, interval: float) -> FloatArray:
        surface = Surface(np.full_like(borne, onset), np.zeros_like(borne), interval, onset, SAMPLES)
        return surface.after_yielding(0, borne, law, unit, 1.0).settled_indentation()

    x = virgin.sample_positions[virgin.sample_positions <= length]
    both = left_marks(np.maximum(depth(virgin.sample_positions), onset), virgin.interval)[: len(x)]
    intervals = round(turn / virgin.interval)
    interval = turn / intervals
    arc = (np.arange(intervals * SAMPLES) + 0.5) * interval / SAMPLES
    around = np.full_like(arc, onset)
    for revolution in range(int(length // turn) + 1):
        around = np.maximum(around, depth(arc + revolution * turn))
    wrapped = WRAPPED * SAMPLES
    ring = left_marks(np.concatenate([around[-wrapped:], around, around[:wrapped]]), interval)[wrapped:-wrapped]
    share = contact.share_of_rail
    return Marks(
        Measured(positions=tuple(x.tolist()), heights=tuple((-share * both).tolist()), beyond="flat"),
        OutOfRound(places=tuple(arc.tolist()), deviations=tuple((-(1.0 - share) * ring).tolist())),
        _table(x, both, share),
        (f"averaged over the contact patch, {2e3 * semi_axis:.2f} mm long: shorter marks are not resolved",),
    )


def _depth_function(record: Record, spacing: float) -> Callable[[FloatArray], FloatArray]:
    """Return the indentation of the virgin surface, m, over places along the rail, m; zero where nothing touched it."""
    scenario = record.scenario
    speed, end = float(scenario.speed), float(scenario.speed * record.end)

    def depth_at(places: FloatArray) -> FloatArray:
        inside = (places >= 0.0) & (places <= end)
        out = np.zeros_like(places)
        out[inside] = record.at(np.minimum(places[inside] / speed, record.end)).indentation.values
        return out

    if scenario.rolling == "point":
        return depth_at
    centres = np.linspace(0.0, end, int(np.ceil(end / spacing * FINER)) + 1)
    depths, slope = depth_at(centres), record._lowered.table.slope_at(centres)
    touched = centres + float(scenario.vehicle.radius) * slope / np.hypot(1.0, slope)

    def depth_below(places: FloatArray) -> FloatArray:
        after = np.clip(np.searchsorted(touched, places), 1, len(touched) - 1)
        is_bridged = touched[after] - touched[after - 1] > spacing
        return np.where(is_bridged, 0.0, np.interp(places, touched, depths, left=0.0, right=0.0))

    return depth_below


def _table(x: FloatArray, both: FloatArray, share: float) -> xr.Dataset:
    import xarray as xr

    variables = {
        "permanent_indentation": ("position", both, {"units": "m", "long_name": "left on rail and wheel together"}),
        "rail": ("position", -share * both, {"units": "m", "long_name": "height of the rail's part"}),
    }
    place = {"units": "m", "long_name": "position along the rail"}
    return xr.Dataset(variables, {"position": ("position", x, place)})
