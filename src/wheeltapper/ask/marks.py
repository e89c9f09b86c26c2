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
from wheeltapper.ground.shown import Shown
from wheeltapper.lower.laws.plastic import patch_semi_axis
from wheeltapper.lower.marks.marks import SAMPLES, SEMI_AXIS, Surface
from wheeltapper.lower.marks.wagon_marks import (
    SIDES,
    lane_of,
    onset_of,
    path_of,
    read_contacts,
    semi_axis_of,
    wagon_rails,
)
from wheeltapper.lower.on_rails import memory_of, on_wheels, virgin_rail
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.law_columns import PLASTIC_ONSET
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
        The rail's part, to be added to a scenario's irregularities; of a wagon that of the left rail and of the right
        one, for the places "left" and "right".
    wheels
        The part of each wheelset's wheels, over their circumference; of a wagon each wheelset's left wheel, then its
        right one. The point of the wheel that was at x = 0 is there again.
    table
        Over `position`, of a wagon also over `side`: permanent indentation of both bodies together, and the heights of
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
        """The part of the first rail."""
        return self.rails[0]

    @property
    def wheel(self) -> OutOfRound:
        """The part of the first wheelset's wheels."""
        return self.wheels[0]


class _Rolled(NamedTuple):
    """A wheelset that has rolled over a rail.

    Attributes
    ----------
    radius, position
        Of its wheels, and x at time zero, m.
    law, unit, onset
        The plastic law, its unit of length, m, and the indentation at which a virgin surface yields, m.
    depth
        Indentation of the virgin surface, m, over places along the rail, m; zero where nothing touched it, and where a
        surface that wheels had pressed before did not yield.
    """

    radius: float
    position: float
    law: FloatArray
    unit: float
    onset: float
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
    scenario = record.scenario
    marcher = run.choose(run.MARKS, scenario.needs)
    if marcher.is_of_wagons:
        return _marks_of_wagon(record)
    on_rails = marcher is run.GENERAL
    share, way = scenario.contact.share_of_rail, float(scenario.speed * record.end)
    first = scenario.vehicle.plane.wheelsets[0] if on_rails else scenario.vehicle
    semi_axis = patch_semi_axis(scenario.contact, first, float(np.ravel(record.static_force)[0]))
    spacing = semi_axis / SEMI_AXIS / SAMPLES
    rolled = _rolled_on_rails(record, way, spacing) if on_rails else [_rolled_alone(record, way, spacing)]
    start = min(one.position for one in rolled)
    if on_rails and scenario.rolling == "point":
        x, both = _left_behind(record, way)
    else:
        x, both = _left_on_virgin_rail(rolled, way, start, semi_axis)
    return Marks(
        (_rail_part(x, both, share),),
        tuple(_wheel_part(one, way, semi_axis, 1.0 - share) for one in rolled),
        _table(x, both, share),
        _notes(semi_axis),
    )


def _notes(semi_axis: float) -> tuple[str, ...]:
    return (f"averaged over the contact patch, {2e3 * semi_axis:.2f} mm long: shorter marks are not resolved",)


def _rail_part(x: FloatArray, both: FloatArray, share: float) -> Measured:
    return Measured(positions=tuple(x.tolist()), heights=tuple((-share * both).tolist()), beyond="flat")


def _marks_of_wagon(record: Record) -> Marks:
    """Return the marks on both rails, and on all wheels of a wagon."""
    import xarray as xr

    scenario, lowered, march = record.scenario, record._lowered, record._march
    assembly, share = march.paved(lowered.assembly), scenario.contact.share_of_rail
    way, semi_axis = float(scenario.speed * record.end), semi_axis_of(scenario, float(lowered.static_force[0].mean()))
    rolled = [_rolled_of_wagon(record, side, way, semi_axis / SEMI_AXIS / SAMPLES) for side in range(len(SIDES))]
    start = min(one.position for one in rolled[0])
    if scenario.rolling == "point":
        marking = wagon_rails(scenario, assembly, (), semi_axis).begin()
        marking.press(assembly, march)
        surfaces = [rail.left() for rail in marking.sides]
        inside = surfaces[0].sample_positions <= max(one.position for one in rolled[0]) - start + way
        found = [(one.sample_positions[inside] + start, one.settled_indentation()[inside]) for one in surfaces]
    else:
        found = [_left_on_virgin_rail(of_side, way, start, semi_axis) for of_side in rolled]
    return Marks(
        tuple(_rail_part(x, both, share) for x, both in found),
        tuple(_wheel_part(one, way, semi_axis, 1.0 - share) for pair in zip(*rolled, strict=True) for one in pair),
        xr.concat([_table(x, both, share) for x, both in found], xr.Variable("side", [*SIDES])),
        _notes(semi_axis),
    )


def _rolled_of_wagon(record: Record, side: int, way: float, spacing: float) -> list[_Rolled]:
    """Return the wheels of one side of a wagon."""
    scenario, speed, out = record.scenario, float(record.scenario.speed), list[_Rolled]()
    assembly = record._march.paved(record._lowered.assembly)
    onset = onset_of(assembly)
    for number, axle in enumerate(scenario.vehicle.axles):
        position, lane = float(axle.position), lane_of(number, side)

        def depth_at(places: FloatArray, position: float = position, lane: int = lane) -> FloatArray:
            times = np.clip((places - position) / speed, 0.0, record.end)
            delta, left, _, stretch = read_contacts(assembly, record._march, times)[:, :, lane].T
            return np.where((stretch > 0.0) | (left == 0.0), np.maximum(delta, 0.0) + left, 0.0)

        def slope_at(places: FloatArray, position: float = position, lane: int = lane) -> FloatArray:
            return path_of(assembly, lane).slope_at(places - position)

        depth = _depth_function(scenario.rolling, position, way, float(axle.radius), spacing, depth_at, slope_at)
        out.append(_Rolled(float(axle.radius), position, assembly.law, onset, onset, depth))
    return out


def _settled(one: _Rolled, reached: FloatArray, interval: float) -> FloatArray:
    """Return the permanent indentation of samples of a virgin surface that were pressed so deep, averaged."""
    surface = Surface(np.full_like(reached, one.onset), np.zeros_like(reached), interval, one.onset, SAMPLES)
    pressed = np.maximum(reached, one.onset)
    return surface.after_yielding(0, pressed, one.law, one.unit, 1.0).settled_indentation()


def _left_on_virgin_rail(
    rolled: list[_Rolled], way: float, start: float, semi_axis: float
) -> tuple[FloatArray, FloatArray]:
    """Return places, m, and what wheels leave there that each met virgin rail: the most that any of them leaves."""
    extent = max(one.position for one in rolled) - start
    virgin = Surface.virgin_surface(extent + way, semi_axis, rolled[0].onset, SAMPLES)
    x = virgin.sample_positions + start
    left = [_settled(one, one.depth(x), virgin.interval) for one in rolled]
    inside = x <= start + extent + way
    return x[inside], np.max(left, axis=0)[inside]


def _left_behind(record: Record, way: float) -> tuple[FloatArray, FloatArray]:
    """Return places, m, and what wheels leave there of which each met the marks of those before it."""
    vehicle = on_wheels(record.scenario)
    memory = memory_of(vehicle, (), virgin_rail(vehicle, way), way)
    marking, start = memory.begin(), min(vehicle.plane.positions)
    record._march.lay(marking)
    places = memory.before.sample_positions
    inside = places <= max(memory.offsets) + way
    return places[inside] + start, marking.left().settled_indentation()[inside]


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


def _rolled_alone(record: Record, way: float, spacing: float) -> _Rolled:
    """Return a wheelset of the yielding contact's march."""
    law, unit, speed = record._lowered.program.law, record._lowered.length, float(record.scenario.speed)

    def depth_at(places: FloatArray) -> FloatArray:
        return np.asarray(record.at(np.minimum(places / speed, record.end)).indentation.values)

    radius = float(record.scenario.vehicle.radius)
    depth = _depth_function(
        record.scenario.rolling, 0.0, way, radius, spacing, depth_at, record._lowered.table.slope_at
    )
    return _Rolled(radius, 0.0, law, unit, float(law[0, contract.LAW_START] * unit), depth)


def _rolled_on_rails(record: Record, way: float, spacing: float) -> list[_Rolled]:
    """Return the wheelsets of a general march."""
    plane, out = record.scenario.vehicle.plane, list[_Rolled]()
    found = record._march
    wheels = found.system.wheels
    for number, (wheelset, position, wheel) in enumerate(zip(plane.wheelsets, plane.positions, wheels, strict=True)):
        to_table = wheel.start - position

        def depth_at(places: FloatArray, number: int = number, by: float = to_table) -> FloatArray:
            indented, left, bears = found.pressed(number, places + by)
            return np.where((indented > bears) | (left == 0.0), indented + left, 0.0)

        def slope_at(places: FloatArray, number: int = number, by: float = to_table) -> FloatArray:
            return np.asarray(found.path_slopes(number, places + by))

        onset, radius = float(wheel.law.numbers[PLASTIC_ONSET - 1]), float(wheelset.radius)
        depth = _depth_function(record.scenario.rolling, float(position), way, radius, spacing, depth_at, slope_at)
        out.append(_Rolled(radius, float(position), wheel.law.table, onset, onset, depth))
    return out


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
