"""Flats of a train's wheels: a model of wheel and track is fitted to what gauges recorded of each wheel.

Each wheel is cut out of the channels of its rail. What the other wheels' loads do there is taken away, and once a flat
is known also what that does to its neighbours. Wheels of like speed and load are looked through together.

Theory: docs/theory/gauges.rst, section 16.6.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from wheeltapper.describe.sensor.base import ANTI_ALIAS
from wheeltapper.describe.sensor.rail_shear_force import RailShearForce
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.gauges.finding import WheelFinding
from wheeltapper.diagnosis.gauges.free_shape import FreeShape
from wheeltapper.diagnosis.gauges.known import Known, known_of
from wheeltapper.diagnosis.gauges.passing import (
    BEYOND,
    LENGTH,
    SPEED,
    Passing,
    Runs,
    beside_gauges,
    passing_without_readings,
)
from wheeltapper.diagnosis.gauges.scan import FOUND_FROM, SCREENED, Scan, Seen
from wheeltapper.diagnosis.gauges.sizing import (
    FIRST_NOISE,
    Sized,
    read_of_flaw,
    scan_of,
    size_of,
    sized_flat,
    values_of,
)
from wheeltapper.diagnosis.processes import Lost, in_processes
from wheeltapper.diagnosis.train import TrainFinding
from wheeltapper.diagnosis.wayside.channels import Channel
from wheeltapper.diagnosis.wayside.deck import Diagnosed
from wheeltapper.diagnosis.wayside.measured import Measured
from wheeltapper.diagnosis.wayside.passage import Passage, axles_text
from wheeltapper.diagnosis.wayside.pulses import Pulses
from wheeltapper.diagnosis.wayside.wheels import Side
from wheeltapper.ground.errors import InputError
from wheeltapper.record.assessment.filtering import RECORDER_ORDER, low_passed

FloatArray = NDArray[np.float64]
T = TypeVar("T")
UNFILTERED = (
    "recorded without an anti-aliasing filter: strikes appear in the samples at wrong, lower frequencies, while the "
    "model expects filtered ones; sizes are uncertain"
)
REACH = 9.0
"""Other wheels are felt from so far beyond where a wheel is fitted, m."""
OTHERS = 0.15
"""What a gauge reads is left out while another wheel is between the pair's gauges or so near to them, m."""
UNWEIGHED, FELT = 0.5, 1.0
"""Error of the load of a wheel that was not weighed, over the usual one of the train; and how near to a pair it may be,
m: what the pair reads nearer to it is left out."""
TRAVELLED = 0.15
"""Error of what flats of other wheels do to a pair, over that: it comes through some metres of track."""
SHADOWED = 0.15
"""A flaw must lower χ² by this part of what a neighbour's flat does, which errs by as much: a wheel without a flaw was
given a flat that lowered it by 0.13 of that."""
OFF = 0.05
"""Error of what other wheels' loads do to a pair, over that: of the track, of gains, and of what is rough."""
RATE, LOWEST = 5000.0, 1200.0
"""Channels are taken at about this rate, Hz; none of less than the other is fitted."""
PASSES, CHANGED, BETTER = 4, 5e-4, 0.2
"""Wheels are fitted at most so often: again if a flat that they feel has changed by so much, m, or the reduced χ² of
its fit by this part."""
RINGING, QUIET = (200.0, 500.0), (0.28, 0.44)
"""Bands in which channels show their noise, Hz, and over their rate: between them rails on seats ring, near 1 kHz."""
LOST, REFUSED = "no model is fitted, since its processes died", "no model is fitted: what was recorded resembles no run"
"""Why a wheel was not fitted; those of the first kind are worth another time."""
SHADOWED_BY = "no flat is told: the best one explains no more than errors in what a neighbour's flat does here could"
SUREST = 1e-4
"""Least standard deviation of a gain."""
AROUND = 0.3
"""How long before the first and behind the last axle a train counts as passing, s."""
SPEEDS, LOADS = 0.01, 0.25
"""Wheels whose speeds and static forces differ by no more than about these parts are looked through together."""


class Rail(NamedTuple):
    """The pairs of gauges of one rail while a train passes; places grow the way it runs.

    Attributes
    ----------
    side
        "left", "right" or None.
    sensors
        The pairs.
    known
        Of track and wheels.
    rate, start
        Of the samples, Hz, and when the first one is, s.
    forces
        Over the gains and above the zero lines, N, (samples, sensors).
    missing
        Where there are none.
    noise
        Standard deviation of a sample, N.
    gain_spread
        Of each sensor.
    """

    side: str | None
    sensors: tuple[RailShearForce, ...]
    known: Known
    rate: float
    start: float
    forces: FloatArray
    missing: NDArray[np.bool_]
    noise: float
    gain_spread: FloatArray

    @property
    def ends(self) -> tuple[float, float]:
        """Places of the first and of the last gauge, m."""
        return min(one.x1 for one in self.sensors), max(one.x2 for one in self.sensors)


def rails_of(passage: Passage, several: Sequence[Pulses], sides: Sequence[Side], known: Known) -> list[Rail]:
    """Return the rails of a train that have pairs of gauges of one recorder that is fast enough."""
    out = []
    for side in sides:
        channels = [
            one.channel for one in several
            if isinstance(one.channel.sensor, RailShearForce) and one.channel.sensor.side == side.side
            and one.channel.sensor.name in side.counted
        ]  # fmt: skip
        recorders = {(one.rate, one.start, len(one.forces), one.sensor.cutoff(one.rate)) for one in channels}
        kept = min((cutoff or np.inf for *_, cutoff in recorders), default=0.0)
        if len(recorders) == 1 and channels[0].rate >= LOWEST and kept >= ANTI_ALIAS * LOWEST:
            zeros = [one.zero for one in several if one.channel in channels]
            out.append(_rail(side.side, passage, channels, np.stack(zeros, axis=1), known))
    return out


def _rail(side: str | None, passage: Passage, channels: Sequence[Channel], zeros: FloatArray, known: Known) -> Rail:
    start, every = channels[0].start, max(1, int(channels[0].rate / RATE))
    rate = channels[0].rate / every
    above = np.stack([one.forces for one in channels], axis=1) - zeros
    forces = (above if every == 1 else low_passed(above, channels[0].rate, ANTI_ALIAS * rate, RECORDER_ORDER))[::every]
    missing = np.stack([one.missing for one in channels], axis=1)
    lost = np.add.reduceat(missing, np.arange(0, len(missing), every), axis=0) > 0
    sensors = [one.sensor for one in channels if isinstance(one.sensor, RailShearForce)]
    backwards = bool(passage.speeds[0] < 0.0)
    turned = [one.model_copy(update={"x1": -one.x2, "x2": -one.x1}) if backwards else one for one in sensors]
    ends = (np.array([passage.times.min() - AROUND, passage.times.max() + AROUND]) - start) * rate
    noise = _noise(forces[max(0, int(ends[0])) : int(ends[1])], rate)
    spread = np.array([max(one.gain_uncertainty, SUREST) for one in sensors])
    return Rail(side, tuple(turned), known.mirrored if backwards else known, rate, start, forces, lost, noise, spread)


def _noise(forces: FloatArray, rate: float) -> float:
    """Return the standard deviation of a sample's noise while a train passes, N, with what wheels far away do.

    It is the larger one of what two bands show, of which each is said to be white. Most samples are of such wheels.
    """
    found = []
    for low, high in (RINGING, (QUIET[0] * rate, QUIET[1] * rate)):
        band = butter(4, (low, high), "bandpass", fs=rate, output="sos")
        through = np.sqrt(2.0 * (high - low) / rate)  # what the band leaves of white noise
        found.append(1.4826 * np.median(np.abs(sosfiltfilt(band, forces, axis=0)), axis=0) / through)
    return float(np.sqrt(np.mean(np.square(np.max(found, axis=0)))))


class Flat(NamedTuple):
    """What the neighbours of a wheel feel of its flat, or of its tread of free shape.

    Attributes
    ----------
    length, reduced
        Of the flat, m, and χ² of a reading that its fit leaves.
    window, added
        Samples of the channels, and what it does to them there, N, (samples, sensors).
    doubt
        Standard deviation of that.
    """

    length: float
    reduced: float
    window: slice
    added: FloatArray
    doubt: FloatArray

    def has_changed(self, before: Flat) -> bool:
        """Return whether it has become another one, or is explained better or worse."""
        return abs(self.length - before.length) > CHANGED or abs(self.reduced / before.reduced - 1.0) > BETTER


class Fitted(NamedTuple):
    """What was found of a wheel, its flat if it has one, and the flats of neighbours that it felt then, by axle."""

    finding: WheelFinding
    flat: Flat | None
    felt: dict[int, Flat]

    def has_changed(self, felt: Mapping[int, Flat]) -> bool:
        """Return whether flats that it feels are others."""
        return felt.keys() != self.felt.keys() or any(one.has_changed(self.felt[axle]) for axle, one in felt.items())


@dataclass(eq=False)
class Wheels:
    """The wheels of one rail of a train.

    Attributes
    ----------
    rail, passage
        What was recorded, and the axles.
    forces
        Static force of each wheel, N; NaN where it is unknown.
    seen, fitted, unfitted
        What the readings of wheels show, what was found of those that were fitted, and why others were not, by axle.
    """

    rail: Rail
    passage: Passage
    forces: FloatArray
    seen: dict[int, Seen] = field(default_factory=dict, repr=False)
    fitted: dict[int, Fitted] = field(default_factory=dict, repr=False)
    unfitted: dict[int, str] = field(default_factory=dict, repr=False)
    _scans: dict[tuple[int, int], Scan] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        speed, force = float(np.median(self.speeds)), float(np.nanmedian(self.forces))
        wide = self._like(speed, force, REACH + BEYOND)
        level = Runs(wide, self.rail.known.scene).readings(values_of(wide, self.rail.known), "fresh")
        if len(level) != len(wide.x):
            found = f"one on which a wheel of {force:.4g} N without a flaw does not run to the end"
            raise InputError("", "track", found, "stiffnesses, dampings and masses of a track, with their units")
        self._level = wide.x, level / force

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_scans": {}}  # large, and soon made again

    @property
    def speeds(self) -> FloatArray:
        """Of the axles, m/s, as positive numbers."""
        return np.abs(self.passage.speeds)

    def passing(self, axle: int) -> Passing:
        """Return what was recorded of a wheel, without what other wheels do."""
        rail, (window, times) = self.rail, self._window(axle, BEYOND)
        readings, used = rail.forces[window].copy(), ~rail.missing[window]
        x, doubt = self._x(axle, times), np.zeros_like(readings)
        for other in self.neighbours(axle):
            there, is_weighed = self._x(other, times), bool(np.isfinite(self.forces[other]))
            load = (self.forces[other] if is_weighed else np.nanmedian(self.forces)) * self._level_at(there)
            readings -= load
            doubt = np.hypot(doubt, (OFF if is_weighed else UNWEIGHED) * load)
            near = OTHERS if is_weighed else FELT
            used &= ~np.stack([(there > one.x1 - near) & (there < one.x2 + near) for one in rail.sensors], axis=1)
        for flat in self.felt(axle).values():
            own = flat.window
            both = slice(max(own.start, window.start), min(own.stop, window.stop))
            if both.stop > both.start:
                here = slice(both.start - window.start, both.stop - window.start)
                of_it = slice(both.start - own.start, both.stop - own.start)
                readings[here] -= flat.added[of_it]
                doubt[here] = np.hypot(doubt[here], flat.doubt[of_it])
        used &= beside_gauges(rail.sensors, x)
        others = tuple(float(self._x(other, times[:1])[0] - x[0]) for other in self.neighbours(axle))
        return replace(self._passing(axle, x, readings, used), doubt=doubt, others=others)

    def look(self, passing: Passing) -> Seen:
        """Return what a wheel's readings show, by a scan of wheels alike."""
        speed, force = passing.speed, passing.static_force
        key = round(np.log(speed) / SPEEDS), round(np.log(force) / LOADS)
        if key not in self._scans:
            like = self._like(float(np.exp(key[0] * SPEEDS)), float(np.exp(key[1] * LOADS)), BEYOND)
            self._scans[key] = scan_of(like, self.rail.known)
        scan = self._scans[key]
        share = force / scan.band.passing.static_force
        return scan.seen(*at_places(passing, scan.band.passing.x), share)

    def settle(self, asked: Iterable[int]) -> None:
        """Fit a model to wheels, the most conspicuous ones first; again where flats that they feel have changed."""
        for _ in range(PASSES):
            for axle in sorted(asked, key=lambda axle: -self.seen[axle].gain):
                felt, before = self.felt(axle), self.fitted.get(axle)
                if axle not in self.unfitted and (before is None or before.has_changed(felt)):
                    try:
                        fitted = self._fit(axle, felt, before)
                        reason = SHADOWED_BY if fitted.finding.sized.is_doubtful else ""
                    except InputError as error:  # a wheel that no run of the model resembles
                        reason = f"{REFUSED}: {error}"
                    if reason:
                        self.unfitted[axle] = reason
                        self.fitted.pop(axle, None)
                    else:
                        self.fitted[axle] = fitted

    def _fit(self, axle: int, felt: dict[int, Flat], before: Fitted | None) -> Fitted:
        passing, rail = self.passing(axle), self.rail
        if felt:
            self.seen[axle] = self.look(passing)
        found = None if before is None else before.finding.sized
        least = SHADOWED * max((self.fitted[other].finding.sized.gain for other in felt), default=0.0)
        sized = sized_flat(passing, rail.known, rail.gain_spread, self.seen[axle], found, least)
        return Fitted(WheelFinding(sized, passing, rail.known, self.direction), self._flat(axle, sized), felt)

    def _flat(self, axle: int, sized: Sized) -> Flat | None:
        """Return what neighbours feel of a wheel's flat, or of its tread."""
        flaw = sized.flaw
        if flaw is None:
            return None
        (window, _), (own, times) = self._window(axle, BEYOND + REACH), self._window(axle, BEYOND)
        earlier = flaw.values[SPEED] * (own.start - window.start) / self.rail.rate
        x = self._x(axle, times[:1]) - earlier
        wide = self._passing(axle, x, self.rail.forces[window], ~self.rail.missing[window])
        runs, rate = Runs(wide, self.rail.known.scene), self.rail.rate
        added = read_of_flaw(runs, flaw)
        doubt = TRAVELLED * size_of(added, rate)
        for other in [] if isinstance(flaw, FreeShape) else sized.not_excluded:
            doubt = np.hypot(doubt, size_of(read_of_flaw(runs, other) - added, rate))
        length = flaw.parts[0].length if isinstance(flaw, FreeShape) else flaw.values[LENGTH]
        return Flat(length, flaw.chi / flaw.readings, window, added, doubt)

    def apart(self, asked: Iterable[int]) -> list[list[int]]:
        """Return groups of wheels that may have flats, the large ones first; none feels a wheel of another group."""
        left, out = {axle for axle in asked if self.seen[axle].gain >= SCREENED}, list[list[int]]()
        while left:
            group = [left.pop()]
            for axle in group:  # it grows meanwhile
                near = left.intersection(self.neighbours(axle))
                left -= near
                group += near
            out.append(sorted(group))
        return sorted(out, key=lambda group: (-len(group), group))

    def is_whole(self, axle: int) -> bool:
        """Return whether a wheel was recorded from before the first gauge to behind the last, and weighed."""
        _, times = self._window(axle, 0.0)
        first, last = self.rail.ends
        apart = (last - first) / float(self.speeds[axle]) * self.rail.rate
        return bool(np.isfinite(self.forces[axle])) and len(times) >= apart - 1.0

    def felt(self, axle: int) -> dict[int, Flat]:
        """Return the flats that a wheel feels, by axle."""
        there = {one: self.fitted[one].flat for one in self.neighbours(axle) if one in self.fitted}
        return {one: flat for one, flat in there.items() if flat is not None}

    def neighbours(self, axle: int) -> list[int]:
        """Return the axles that are near enough to feel each other's flats."""
        first, last = self.rail.ends
        reach = BEYOND + REACH + last - first
        apart = np.abs(self.passage.places - self.passage.places[axle])
        return [one for one in np.flatnonzero(apart < reach).tolist() if one != axle]

    def _window(self, axle: int, beyond: float) -> tuple[slice, FloatArray]:
        """Return the samples while a wheel is so near to the gauges, m, and their times, s."""
        first, last = self.rail.ends
        ends = [float(self.passage.when_at(axle, self.direction * at)) for at in (first - beyond, last + beyond)]
        numbers = np.ceil((np.array(ends) - self.rail.start) * self.rail.rate)
        begin, end = np.clip(numbers, 0, len(self.rail.forces)).astype(int).tolist()
        return slice(begin, end), self.rail.start + np.arange(begin, end) / self.rail.rate

    def _passing(self, axle: int, x: FloatArray, readings: FloatArray, used: NDArray[np.bool_]) -> Passing:
        speed, force = float(self.speeds[axle]), float(self.forces[axle])
        return Passing(self.rail.sensors, self.rail.rate, readings, used, float(x[0]), speed, force, self.rail.noise)

    @property
    def direction(self) -> int:
        """1 of a train towards growing x, -1 of others."""
        return -1 if self.passage.speeds[0] < 0.0 else 1

    def _x(self, axle: int, times: FloatArray) -> FloatArray:
        """Return where a wheel is at times, the way the train runs, m."""
        return self.direction * self.passage.x_of(axle, times)

    def _level_at(self, x: FloatArray) -> FloatArray:
        """Return what a wheel of 1 N without a flaw does to the sensors from places, (places, sensors)."""
        places, level = self._level
        return np.stack([np.interp(x, places, one, left=0.0, right=0.0) for one in level.T], axis=1)

    def _like(self, speed: float, force: float, beyond: float) -> Passing:
        """Return a wheel without readings."""
        rail = self.rail
        return passing_without_readings(rail.sensors, rail.rate, rail.noise, speed, force, beyond)


def at_places(passing: Passing, x: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the readings of a wheel at places, m, and which count, (places, sensors)."""
    place = (x - passing.place) / passing.speed * passing.rate
    inside = (place >= 0.0) & (place <= len(passing.readings) - 1.0)
    near = np.clip(np.rint(place), 0, len(passing.readings) - 1).astype(int)
    spline = CubicSpline(np.arange(len(passing.readings)), passing.readings)
    used = passing.used[near] & inside[:, None]
    if passing.doubt is not None:
        used &= passing.doubt[near] < FIRST_NOISE
    return spline(np.clip(place, 0.0, len(passing.readings) - 1.0)), used


def with_sizes(found: Measured, site: Site, which: Diagnosed, workers: int | None) -> Measured:
    """Return a train whose wheels have the `finding` of a fitted model; notes say which could have none."""
    rails = {} if is_unsteady(found.passage) else {
        rail.side: rail for rail in rails_of(found.passage, found.pulses, found.sides, known_of(site))
    }  # fmt: skip
    entries = [{**axle, "wheels": [dict(wheel) for wheel in axle["wheels"]]} for axle in found.finding.axles]
    notes, shown = [*_unfitted(found, rails)], dict[tuple[int, str | None], WheelFinding]()
    sides = {
        number: Wheels(rails[side.side], found.passage, side.mean)
        for number, side in enumerate(found.sides) if side.side in rails and np.isfinite(side.mean).any()
    }  # fmt: skip
    asked = {}
    for number, side in enumerate(found.sides):
        wheels = sides.get(number)
        whole = [] if wheels is None else [axle for axle in range(len(side.mean)) if wheels.is_whole(axle)]
        cut = sorted({*range(len(side.mean))}.difference(whole))
        if cut and side.side in rails:
            notes.append(f"{_which(cut, side)}: not weighed, or cut off by an end of the recording; no model is fitted")
        if wheels is None:
            continue
        if any(one.anti_alias is False for one in wheels.rail.sensors):
            notes.append(f"{side.side or 'both rails'}: {UNFILTERED}")
        wheels.seen = {axle: wheels.look(wheels.passing(axle)) for axle in whole}
        asked[number] = [
            axle for axle in whole if which == "all" or side.strikes[axle] or wheels.seen[axle].gain >= SCREENED
        ]
    _settle_apart(sides, asked, workers)
    for number, wheels in sides.items():
        for reason in dict.fromkeys(wheels.unfitted.values()):
            those = [axle for axle in sorted(wheels.unfitted) if wheels.unfitted[axle] == reason]
            notes.append(f"{_which(those, found.sides[number])}: {reason}")
        for axle, seen in wheels.seen.items():
            entry = entries[axle]["wheels"][number]
            if axle in wheels.fitted:
                finding = wheels.fitted[axle].finding
                shown[axle + 1, wheels.rail.side] = finding
                entry["finding"] = finding.to_dict()
            elif axle not in wheels.unfitted:
                entry[FOUND_FROM] = seen.found_from
    told = replace(found.finding, axles=tuple(entries), notes=(*found.finding.notes, *notes), wheels=shown)
    return found._replace(finding=told)


def is_lost(train: TrainFinding) -> bool:
    """Return whether a wheel of a train has no model since processes died."""
    return any(LOST in note for note in train.notes)


def _which(axles: Sequence[int], side: Side) -> str:
    return f"{axles_text([axle + 1 for axle in axles])} {side.side or ''}".rstrip()


def _settle_apart(sides: Mapping[int, Wheels], asked: Mapping[int, list[int]], workers: int | None) -> None:
    """Fit a model to the wheels that are asked for, by side."""
    tasks = [(number, group) for number, wheels in sides.items() for group in wheels.apart(asked[number])]
    with closing(in_processes(_settled, sides, tasks, workers)) as done:
        for place, result in done:
            number, group = tasks[place]
            wheels = sides[number]
            if isinstance(result, Lost):
                wheels.unfitted |= dict.fromkeys(group, f"{LOST} ({result})")
            else:
                seen, fitted, unfitted = result
                wheels.seen |= seen
                wheels.fitted |= fitted
                wheels.unfitted |= unfitted
    for number, wheels in sides.items():
        quiet = [axle for axle in asked[number] if axle not in wheels.fitted]
        wheels.settle(quiet)
        if any(axle in wheels.fitted and wheels.fitted[axle].flat for axle in quiet):
            wheels.settle(asked[number])


def _settled(
    sides: Mapping[int, Wheels], task: tuple[int, list[int]]
) -> tuple[dict[int, Seen], dict[int, Fitted], dict[int, str]]:  # fmt: skip
    number, group = task
    wheels = sides[number]
    wheels.settle(group)
    return _of(group, wheels.seen), _of(group, wheels.fitted), _of(group, wheels.unfitted)


def _of(group: Iterable[int], held: Mapping[int, T]) -> dict[int, T]:
    return {axle: held[axle] for axle in group if axle in held}


def is_unsteady(passage: Passage) -> bool:
    """Return whether a train does not keep its speed."""
    return passage.course is not None or passage.turns


def _unfitted(found: Measured, rails: Mapping[str | None, Rail]) -> list[str]:
    """Return why wheels have no finding."""
    if is_unsteady(found.passage):
        return [
            "the train does not keep its speed by what was recorded: no model of a wheel at a steady speed is fitted"
        ]
    lost = [side.side or "both rails" for side in found.sides if side.side not in rails]
    words = "no model is fitted: no pairs of rail shear gauges of one clock and filter, "
    words += f"with {LOWEST:g} Hz or more and {ANTI_ALIAS * LOWEST:g} Hz behind the filter"
    return [f"{', '.join(lost)}: {words}"] if lost else []
