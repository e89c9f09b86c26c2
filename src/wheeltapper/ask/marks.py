"""The marks that one pass leaves on rail and wheel, as irregularities that can be rolled over again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.measured import Measured
from wheeltapper.describe.irregularity.out_of_round import OutOfRound
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import ALONE
from wheeltapper.ground.shown import Shown
from wheeltapper.lower.laws.plastic import PlasticLaw
from wheeltapper.lower.marks.marks import SAMPLES, SEMI_AXIS, Surface
from wheeltapper.lower.marks.wagon_marks import SIDES
from wheeltapper.march import run
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

FINER = 4
"""Number of positions of the wheel's centre per sample at which the indentation is computed. More than one is needed
because the point of contact may move faster than the centre."""
WRAPPED = 4
"""Length, in half semi-axes, over which the samples are repeated at both ends of the circumference, so that averages
are periodic."""


@dataclass(frozen=True)
class Marks(Shown):
    """The marks of one pass.

    Attributes
    ----------
    rails
        The rail's part of the marks, to be added to a scenario's irregularities; for a wagon that of the left rail and
        that of the right rail, for the places "left" and "right".
    wheels
        The wheels' part of the marks, over the circumference, for each wheelset; for a wagon for each wheelset's left
        wheel, then for its right one. In a run with these, the point of the wheel that was at x = 0 is there again.
    table
        Over `position`, for a wagon also over `side`: permanent indentation of both bodies together, and the heights of
        the rail's part.
    notes
        What the user should know.
    """

    rails: tuple[Measured, ...]
    wheels: tuple[OutOfRound, ...]
    table: xr.Dataset
    notes: tuple[str, ...]

    @property
    def rail(self) -> Measured:
        """The part of the marks on the first rail."""
        return self.rails[0]

    @property
    def wheel(self) -> OutOfRound:
        """The part of the marks on the first wheelset's wheels."""
        return self.wheels[0]


class _Rolled(NamedTuple):
    """A wheelset that has rolled over a rail.

    Attributes
    ----------
    radius, position
        Of its wheels, and x at time zero, m.
    law
        The plastic law.
    depth
        Indentation of the virgin surface, m, over places along the rail, m; zero where nothing touched it, and where a
        surface that wheels had pressed before did not yield.
    """

    radius: float
    position: float
    law: PlasticLaw
    depth: Callable[[FloatArray], FloatArray]


def marks(record: Record) -> Marks:
    """Return the marks that a simulated pass leaves on rail and wheels.

    The permanent indentation at a place follows from its largest indentation by the contact law. It is averaged over
    the contact patch. The rail takes the share `rail_share` of it.

    Parameters
    ----------
    record
        Record of wheels that roll with an elastic-plastic contact.

    Raises
    ------
    InputError
        If the contact leaves no marks, or the wheels do not roll.
    """
    if not isinstance(record, Record):
        raise InputError("", "record", f"a {type(record).__name__}", "a Record")
    import xarray as xr

    scenario, contacts = record.scenario, record._contacts
    run.choose(run.MARKS, scenario.needs)
    share, way = scenario.contact.share_of_rail, float(scenario.speed * record.end)
    semi_axis = record._lowered.semi_axis
    wheels = [_rolled(record, one, way, semi_axis / SEMI_AXIS / SAMPLES) for one in range(len(contacts.position))]
    start = float(contacts.position.min())
    if scenario.rolling == "point" and ALONE not in scenario.needs:
        surfaces = record._lowered.surfaces_left(record._march, way)
        inside = surfaces[0].sample_positions <= float(np.ptp(contacts.position)) + way
        found = [(one.sample_positions[inside] + start, one.settled_indentation()[inside]) for one in surfaces]
    else:
        sides = [wheels[side :: contacts.sides] for side in range(contacts.sides)]
        found = [_left_on_virgin_rail(one, way, start, semi_axis) for one in sides]
    tables = [_table(x, both, share) for x, both in found]
    return Marks(
        tuple(_rail_part(x, both, share) for x, both in found),
        tuple(_wheel_part(one, way, semi_axis, 1.0 - share) for one in wheels),
        xr.concat(tables, xr.Variable("side", [*SIDES])) if contacts.has_sides else tables[0],
        _notes(semi_axis),
    )


def _notes(semi_axis: float) -> tuple[str, ...]:
    return (f"averaged over the contact patch, {2e3 * semi_axis:.2f} mm long: shorter marks are not resolved",)


def _rail_part(x: FloatArray, both: FloatArray, share: float) -> Measured:
    return Measured(positions=tuple(x.tolist()), heights=tuple((-share * both).tolist()), beyond="flat")


def _rolled(record: Record, contact: int, way: float, spacing: float) -> _Rolled:
    """Return what a contact's wheel has rolled over."""
    lowered, march, speed = record._lowered, record._march, float(record.scenario.speed)
    position, radius = (float(values[contact]) for values in (record._contacts.position, record._contacts.radius))

    def depth_at(places: FloatArray) -> FloatArray:
        times = np.clip((places - position) / speed, 0.0, record.end)
        indentation, left, yields = lowered.pressed(march, contact, times)
        return np.where(yields | (left == 0.0), indentation + left, 0.0)

    def slope_at(places: FloatArray) -> FloatArray:
        return np.asarray(lowered.slopes_below(march, contact, places - position))

    depth = _depth_function(record.scenario.rolling, position, way, radius, spacing, depth_at, slope_at)
    return _Rolled(radius, position, lowered.plastic_laws[contact // record._contacts.sides], depth)


def _settled(one: _Rolled, reached: FloatArray, interval: float) -> FloatArray:
    """Return the permanent indentation of samples of a virgin surface that were pressed so deep, averaged."""
    onset = one.law.onset
    surface = Surface(np.full_like(reached, onset), np.zeros_like(reached), interval, onset, SAMPLES)
    return surface.after_yielding(0, np.maximum(reached, onset), one.law, 1.0).settled_indentation()


def _left_on_virgin_rail(
    rolled: list[_Rolled], way: float, start: float, semi_axis: float
) -> tuple[FloatArray, FloatArray]:
    """Return places, m, and what wheels leave there that each met virgin rail: the most that any of them leaves."""
    extent = max(one.position for one in rolled) - start
    virgin = Surface.virgin_surface(extent + way, semi_axis, rolled[0].law.onset, SAMPLES)
    x = virgin.sample_positions + start
    left = [_settled(one, one.depth(x), virgin.interval) for one in rolled]
    inside = x <= start + extent + way
    return x[inside], np.max(left, axis=0)[inside]


def _wheel_part(one: _Rolled, way: float, semi_axis: float, share: float) -> OutOfRound:
    """Return a wheel's share of what it leaves, over its circumference."""
    turn = 2.0 * pi * one.radius
    intervals = round(turn / (semi_axis / SEMI_AXIS))
    interval = turn / intervals
    arc = (np.arange(intervals * SAMPLES) + 0.5) * interval / SAMPLES
    around = np.zeros_like(arc)
    for revolution in range(int(one.position // turn), int((one.position + way) // turn) + 1):
        around = np.maximum(around, one.depth(arc + revolution * turn))
    wrapped = WRAPPED * SAMPLES
    ring = _settled(one, np.concatenate([around[-wrapped:], around, around[:wrapped]]), interval)[wrapped:-wrapped]
    return OutOfRound(places=tuple(arc.tolist()), deviations=tuple((-share * ring).tolist()))


def _depth_function(
    rolling: str, position: float, way: float, radius: float, spacing: float,
    depth_below: Callable[[FloatArray], FloatArray], slope_at: Callable[[FloatArray], FloatArray],
) -> Callable[[FloatArray], FloatArray]:  # fmt: skip
    """Return the indentation over places along the rail, m, from that below the wheel's centre.

    `spacing` is that of the samples, m.
    """

    def depth_at(places: FloatArray) -> FloatArray:
        inside = (places >= position) & (places <= position + way)
        out = np.zeros_like(places)
        out[inside] = depth_below(places[inside])
        return out

    if rolling == "point":
        return depth_at
    centres = np.linspace(position, position + way, int(np.ceil(way / spacing * FINER)) + 1)
    depths, slope = depth_at(centres), slope_at(centres)
    touched = centres + radius * slope / np.hypot(1.0, slope)

    def depth_touched(places: FloatArray) -> FloatArray:
        after = np.clip(np.searchsorted(touched, places), 1, len(touched) - 1)
        is_bridged = touched[after] - touched[after - 1] > spacing
        return np.where(is_bridged, 0.0, np.interp(places, touched, depths, left=0.0, right=0.0))

    return depth_touched


def _table(x: FloatArray, both: FloatArray, share: float) -> xr.Dataset:
    import xarray as xr

    variables = {
        "permanent_indentation": ("position", both, {"units": "m", "long_name": "left on rail and wheel together"}),
        "rail": ("position", -share * both, {"units": "m", "long_name": "height of the rail's part"}),
    }
    place = {"units": "m", "long_name": "position along the rail"}
    return xr.Dataset(variables, {"position": ("position", x, place)})
