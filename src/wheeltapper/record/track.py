"""What rail, pads, sleepers and ballast do in a run: readings at places of the track (docs/theory/track.rst, 13.6)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensor.along import FARTHEST_SEAT
from wheeltapper.ground.arguments import as_list, as_quantity
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.warned import warn_caller
from wheeltapper.lower import extent
from wheeltapper.lower.lowered.rails_below import RailsBelow
from wheeltapper.lower.track.anomalies import Anomalies
from wheeltapper.lower.track.irregular import IrregularModes
from wheeltapper.lower.track.readouts import (
    Rest,
    place_of,
    rail_rows,
    rest_beside,
    rest_of_place,
    rest_of_seat,
    seat_rest_around,
    seat_rows,
    section_at,
)
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import Section
from wheeltapper.march import run
from wheeltapper.record.arrays import as_array
from wheeltapper.record.labels import dataset

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.general.replay import Modes
    from wheeltapper.march.general.structure import Ring
    from wheeltapper.march.wagon.rails.replay import RailAt
    from wheeltapper.record.record import Record

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
RAIL = ("rail_displacement", "rail_acceleration", "rail_strain", "rail_shear")
SEAT = ("sleeper_displacement", "sleeper_acceleration", "pad_force", "ballast_force")
ACCELERATION = 1
"""Column of the accelerations in both."""
PLACES = 'positions in m, or as "600 mm"'
SAME_PLACE = 12
"""Places in a bay that agree to so many digits, m, have one table of what the modes miss."""
CHUNK = 2048
"""Times that are read at once."""


class _Place(NamedTuple):
    """A place that reads its displacement and two more quantities.

    Attributes
    ----------
    x
        m from the seat from which the march counts.
    bay
        Its number.
    rows, rate_rows
        What amplitudes, and what their rates give, (3, modes) each.
    rests
        What the modes miss of the static field of unit forces, to be summed.
    lags
        What the rates of these add to them, s.
    void
        Number of the contact below the void there, among those of seats; None where there is none.
    pad
        Stiffness of the pad of a seat, N/m.
    """

    x: float
    bay: int
    rows: ComplexArray
    rate_rows: ComplexArray
    rests: list[Rest]
    lags: FloatArray
    void: int | None = None
    pad: float = 0.0


def track(
    record: Record, rate: float | str | None = None, rail: Sequence[float | str] = (), seat: Sequence[int] = (),
    accelerations: bool = True,
) -> xr.Dataset:  # fmt: skip
    """Return what the track does at places of the rail (m), and at seats, over time; see `Record.track`.

    Without `accelerations`, which cost as much again, there are none.
    """
    run.choose(run.TRACK, record.scenario.needs)
    x, seats = np.atleast_1d(as_array(rail, "rail", PLACES, "length")).tolist(), _as_seats(seat)
    if not x and not seats:
        raise InputError("", "rail", "no place and no seat", "positions in m, or seats by their numbers")
    rate = 20_000 / record.end if rate is None else as_quantity(rate, "rate", "frequency")
    extent.check_samples("rate", f"{rate:g} per second", record.end * rate + 1.0, 8 * (len(x) + len(seats)))
    times = np.arange(int(np.floor(record.end * rate * (1 + 1e-12))) + 1) / rate
    ridden = record._lowered.rails_below(record._march, record.method)
    places = [_places(record, ridden, way, x, seats) for way in range(len(ridden.ways))]
    called = [*(f"rail {one:g} m" for one in x), *(f"seat {one}" for one in seats)]
    _warn_of_far_places(ridden, called, places[0], float(record.scenario.speed) * record.end)
    read = np.empty((len(times), len(ridden.ways), len(places[0]), 4))
    for first in range(0, len(times), CHUNK):
        chunk = slice(first, first + CHUNK)
        for way, shown in enumerate(ridden.at(times[chunk], accelerations)):
            read[chunk, way] = _readings(record, ridden, way, shown, places[way], times[chunk])
    if ridden.sides:
        together, against = read[:, 0].copy(), read[:, 1].copy()
        read[:, 0], read[:, 1] = together + against, together - against
    variables: dict[str, Any] = {"time": (("time",), times)}
    if ridden.sides:
        variables["side"] = ("side",), list(ridden.sides)
    both = ("rail", RAIL, x, slice(len(x))), ("seat", SEAT, seats, slice(len(x), None))
    for axis, names, where, columns in both:
        if where:
            variables[axis] = ((axis,), list(where))
            for column, name in enumerate(names):
                if column == ACCELERATION and not accelerations:
                    continue
                values = read[:, :, columns, column]
                variables[name] = (("time", "side", axis), values) if ridden.sides else (("time", axis), values[:, 0])
    if not record.scenario.track.under_pads:
        for name in ("sleeper_displacement", "sleeper_acceleration", "ballast_force"):
            variables.pop(name, None)
    return dataset(variables)


def _warn_of_far_places(ridden: RailsBelow, names: list[str], places: list[_Place], way: float) -> None:
    """Warn of places that no wheel comes near on its way (m), so that there is no reading of them at any time."""
    ring = ridden.ways[0][1].ring
    half, first, last = 0.5 * ring.bays * ring.spacing, min(ridden.wheels), max(ridden.wheels) + way
    far = [name for name, one in zip(names, places, strict=True) if not first - half <= one.x <= last + half]
    if far:
        several = f" and {len(far) - 3} more" if len(far) > 3 else ""
        warn_caller(
            f"no readings at {', '.join(far[:3])}{several} (NaN): the track is computed up to {half:.4g} m from the "
            f"wheels only, which pass x = {first + ridden.seat:.6g} to {last + ridden.seat:.6g} m"
        )


def _places(record: Record, ridden: RailsBelow, way: int, x: list[float], seats: list[int]) -> list[_Place]:
    """Return the places of the rail, m, and the seats, as they read one way of the rails to move."""
    (section, modes), foot = ridden.ways[way], float(record.scenario.track.rail.foot_distance)
    places = [_rail_place(section, foot, modes, ridden.anomalies[way], one - ridden.seat) for one in x]
    return places + [_seat_place(section, modes, ridden.anomalies[way], number) for number in seats]


def _as_seats(given: Any) -> list[int]:
    seats = as_list(given, "seat", "numbers of seats")
    for i, number in enumerate(seats):
        if isinstance(number, bool) or not isinstance(number, int | np.integer):
            raise InputError("", f"seat.{i}", value_text(number), "a whole number: the seat at first_sleeper is 0")
        if abs(int(number)) > FARTHEST_SEAT:
            raise InputError("", f"seat.{i}", value_text(number), f"at most {FARTHEST_SEAT} to either side")
    return [int(number) for number in seats]


def _rail_place(
    section: Section, foot: float, modes: TrackModes | IrregularModes, anomalies: Anomalies, x: float
) -> _Place:
    at_rest, moving = (np.stack(rail_rows(one, foot, modes, x)) for one in (_undamped(section), section))
    bay = int(np.floor(x / section.spacing))
    bays = modes.ring.bays * modes.ring.seats
    inside = round(x - bay * section.spacing, SAME_PLACE)
    rests = [rest_of_place(section, foot, bays, modes.cutoff, inside).moved(x - inside)]
    if isinstance(modes, IrregularModes):
        rests.append(rest_beside(section, foot, modes, anomalies.extras, x))
    return _Place(
        x, place_of(modes.ring, x).bay, at_rest, (moving - at_rest) / modes.ring.rates, rests,
        np.array([0.0, 0.0, section.loss]),
    )  # fmt: skip


def _seat_place(section: Section, modes: TrackModes | IrregularModes, anomalies: Anomalies, number: int) -> _Place:
    own, void = section, None
    if isinstance(modes, IrregularModes):
        seat = number % modes.ring.seats
        own = section_at(section, anomalies.extras, seat)
        rest = seat_rest_around(section, modes, anomalies.extras, seat)
        void = next((i for i, one in enumerate(anomalies.voids) if (one.seat - seat) % modes.ring.seats == 0), None)
    else:
        rest = rest_of_seat(section, modes.ring.bays, modes.cutoff).moved(number * section.spacing)
    at_rest, moving = (np.stack(seat_rows(one, modes, number)) for one in (_undamped(own), own))
    return _Place(
        number * section.spacing, number, at_rest, (moving - at_rest) / modes.ring.rates, [rest],
        np.array([0.0, section.pad_damping / section.pad, section.ballast_damping / max(section.ballast, 1e-300)]),
        void, own.pad,
    )  # fmt: skip


def _undamped(section: Section) -> Section:
    """Return a section whose dampers are gone: the rows of readings are then those of the amplitudes alone."""
    return section._replace(loss=0.0, pad_damping=0.0, ballast_damping=0.0)


def _readings(
    record: Record, ridden: RailsBelow, way: int, shown: RailAt, places: list[_Place], times: FloatArray
) -> FloatArray:
    """Return displacement, acceleration and two more readings, (times, places, 4); NaN beyond half the ring.

    Accelerations are NaN where the forces and modes have no second derivatives.
    """
    ring, speed = ridden.ways[way][1].ring, float(record.scenario.speed)
    wheels = np.add.outer(speed * times, ridden.wheels)
    out = _shown_by_modes(ring, shown.modes, places)
    for i, place in enumerate(places):
        accelerated, read = out[:, i, 0].copy(), out[:, i, 1:].copy()
        for wheel in range(wheels.shape[1]):
            force = shown.force[:, wheel], shown.force_rate[:, wheel], shown.force_bend[:, wheel]
            missed, missed_rate, missed_bend = _missed(place, wheels[:, wheel], speed, force)
            if shown.moved is not None:
                faster = _missed_faster(place, wheels[:, wheel], speed, times, [one[:, wheel] for one in shown.moved])
                missed, missed_rate, missed_bend = missed + faster[0], missed_rate + faster[1], missed_bend + faster[2]
            read += missed + place.lags * missed_rate
            accelerated += missed_bend
        out[:, i, 0] = -read[:, 0]
        out[:, i, 1] = -accelerated
        out[:, i, 2:] = read[:, 1:]
        if place.void is not None:
            arm, pressed = ridden.arms[way][place.void], shown.force[:, wheels.shape[1] + place.void]
            below, lifted = arm * pressed, ridden.residuals[way][place.void] / arm * pressed
            out[:, i, 0] += lifted
            out[:, i, 2] += place.pad * lifted
            out[:, i, 3] = below
        out[(np.abs(wheels - place.x) > 0.5 * ring.bays * ring.spacing).any(axis=1), i] = np.nan
    return out


def _shown_by_modes(ring: Ring, found: Modes, places: list[_Place]) -> FloatArray:
    """Return the second derivative of the displacement, it, and two more readings, (times, places, 4)."""
    rows, rate_rows = (np.stack(one) for one in zip(*((place.rows, place.rate_rows) for place in places), strict=True))
    slow = ring.rates * rows[:, :1]
    of_held = np.concatenate([ring.rates * slow, rows + ring.rates * rate_rows], axis=1)
    of_forced, of_forced_rate = np.concatenate([slow, rate_rows], axis=1), rows[:, :1]
    out, bays = np.empty((len(found.bay), len(places), 4)), np.array([place.bay for place in places])
    for bay in np.unique(found.bay):
        some, turn = found.bay == bay, (ring.weights * ring.turns ** (bays - bay)[:, None])[:, None]
        out[some] = _times(found.amplitudes[some], turn * of_held) + _times(found.forced[some], turn * of_forced)
        if found.has_bends:
            out[some, :, :1] += _times(found.forced_rate[some], turn * of_forced_rate)
    return out


def _times(values: ComplexArray, rows: ComplexArray) -> FloatArray:
    """Return the real parts of values, (times, modes), times rows, (places, readings, modes)."""
    flat = np.ascontiguousarray(rows.conj()).view(float).reshape(-1, 2 * values.shape[1])
    return np.asarray((values.view(float) @ flat.T).reshape(len(values), *rows.shape[:2]))


def _missed(
    place: _Place, wheel: FloatArray, speed: float, force: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what the modes miss under a wheel on its way, its rate, (times, 3) both, and its displacement's bend.

    `force` is the wheel's, with its two derivatives.
    """
    here, slope, bend, _ = np.sum([rest.at(wheel) for rest in place.rests], axis=0)
    N, rate = (one[:, None] for one in force[:2])
    accelerated = speed**2 * bend[:, 0] * force[0] + 2.0 * speed * slope[:, 0] * force[1] + here[:, 0] * force[2]
    return here * N, speed * slope * N + here * rate, accelerated


def _missed_faster(
    place: _Place, wheel: FloatArray, speed: float, times: FloatArray, force: list[FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the derivatives of what `_missed` returns by the speed, which moves the wheel by its time; forces stay."""
    _, slope, bend, twist = np.sum([rest.at(wheel) for rest in place.rests], axis=0)
    N, rate, curve, t = *(one[:, None] for one in force), times[:, None]
    accelerated = (2.0 * speed * bend + speed**2 * t * twist) * N + 2.0 * (slope + speed * t * bend) * rate
    return t * slope * N, (slope + speed * t * bend) * N + t * slope * rate, (accelerated + t * slope * curve)[:, 0]
