"""A site calibrated by its own traffic: gains and places of gauges, the track, and the roughness on it.

Theory: docs/theory/gauges.rst, section 16.10.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.paths import value_at
from wheeltapper.describe.sensor.along import BetweenPlaces
from wheeltapper.describe.site import Site, as_any_site
from wheeltapper.diagnosis.calibration import Calibration, Learned
from wheeltapper.diagnosis.gauges.calibration import Estimate, Pooled, estimated, pooled
from wheeltapper.diagnosis.gauges.known import CONTACT, OF_SITE, Known, known_of
from wheeltapper.diagnosis.gauges.passing import BEYOND, OWN, Passing
from wheeltapper.diagnosis.gauges.traffic import LEVEL, Alike, Traffic
from wheeltapper.diagnosis.wayside.channels import channels_of
from wheeltapper.diagnosis.wayside.measure import calibrated, trains_in
from wheeltapper.diagnosis.wayside.measured import Measured
from wheeltapper.diagnosis.wayside.sizes import SUREST, Wheels, at_places, is_unsteady, rails_of
from wheeltapper.diagnosis.wayside.sources import sources_in, time_in
from wheeltapper.ground.arguments import as_quantity, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.march.common.blocks import algebra_on_one_thread
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]
Loads = Mapping[str, Mapping[int, float | str | Sequence[float | str]]]
Period = Literal["none", "year", "quarter", "month"]
PERIODS = ("none", "year", "quarter", "month")
TO_SITE = {there: here for here, there in OF_SITE.items()}
"""Paths of a site of those in its scene, where they differ."""
UNITS = {"stiffness": "N/m", "damping": "N s/m", "mass": "kg"}
"""Of values, by the last word of their paths."""
DECIBEL = 10.0 / float(np.log(10.0))
"""dB of a power whose logarithm is one."""
SPEEDS, LOADS = 0.03, 0.5
"""Wheels whose speeds and static forces differ by no more than about these parts are taken together. The force changes
the slope of the contact's law only, with its cube root."""
BESIDE, EDGE = 0.35, 0.02
"""What a pair reads counts from so far before its first gauge to so far behind its second one, m, but not where a wheel
is nearer to a gauge than `OWN` and the latter."""
KINDS = 6
"""So many kinds of wheels, of like speed and load, are compared at most: those with the most wheels."""
GAIN, PLACE = 0.002, 4e-4
"""What all wheels have in common besides gains and places, since they roll over the same rail: standard deviations of
logarithms, and m."""
UNSTATED = 1.0
"""Standard deviation of a gain's logarithm, and of a place, m, of which nothing is stated."""


def calibrate_site(
    site: Site | str | Path,
    recordings: Mapping[str, Mapping[str, Recording] | Iterable[str | Path] | str | Path] | str | Path,
    *,
    loads: Loads | None = None,
    places: float | str = 0.003,
    period: Period = "none",
) -> Calibration:
    """Calibrate a site by the traffic that its sensors recorded.

    Wheels that pass all sensors of a rail show the gains relative to one another, and the places of gauges except for a
    common shift and stretch. The scale of all gains follows from a vehicle of known loads. The uncertain values of a
    site with a `track` follow from what healthy wheels show of the seats and of roughness: no strike is needed.

    Parameters
    ----------
    site
        The site as it is stated, or the path of its TOML file.
    recordings
        Recordings by their names, each as `measure_trains` takes it; or a folder of files, or of folders of files.
    loads
        Known loads, by the name of the recording and then as `calibrated` takes them. The recording has one train.
    places
        Standard deviation of the stated places of gauges, m.
    period
        "year", "quarter" or "month": the recordings of each are also evaluated by themselves, by the times in their
        names.

    Returns
    -------
    Calibration
        Each value before and after, the values that stay unknown, the stated values that the traffic contradicts, how
        values drift, and the site with the new values.

    Raises
    ------
    InputError
        If there is no train in the recordings, or an argument is wrong.
    """
    site = as_any_site(site)
    check_choice(period, "period", PERIODS)
    deviation = as_quantity(places, "places", "length")
    given, notes = _recordings_of(recordings)
    for name in loads or {}:
        if name not in given:
            raise InputError("", "loads", repr(name), "names of recordings")
    gathered: dict[str, _Gathered] = {}
    for name, one in given.items():
        try:
            gathered[name] = _gathered(one, site, name, None if loads is None else loads.get(name))
        except InputError as error:
            if len(given) == 1 or (loads and name in loads):
                raise error.at(name) from None
            notes.append(f"{name}: not read: {error}")
    with algebra_on_one_thread():
        whole = _calibration([*gathered.values()], site, deviation, notes)
        periods = {
            label: _calibration([gathered[name] for name in names], site, deviation, [], whole, [*gathered.values()])
            for label, names in _periods(gathered, period).items()
        }
    return replace(whole, periods=periods)


def _recordings_of(given: Any) -> tuple[dict[str, Any], list[str]]:
    """Return recordings by their names, and what else is in their folder."""
    if isinstance(given, Mapping) and given and not any(isinstance(one, Recording) for one in given.values()):
        return dict(given), []
    if not isinstance(given, str | Path):
        raise InputError("", "recordings", value_text(given), "recordings by their names, or a folder of them")
    sources, others = sources_in(Path(given))
    if not sources:
        raise InputError(str(given), "recordings", "none", "a folder with recordings")
    return {one.name: one.files for one in sources}, [f"{name}: no recording" for name in others]


def _periods(names: Iterable[str], period: Period) -> dict[str, list[str]]:
    out: dict[str, list[str]] = {}
    for name in names if period != "none" else ():
        when = time_in(name)
        if when is None:
            raise InputError("", "period", f"{period!r}, and no time in the name {name!r}", "2026-11-23T08-12 in each")
        label = {"year": f"{when:%Y}", "quarter": f"{when:%Y}-Q{(when.month + 2) // 3}", "month": f"{when:%Y-%m}"}
        out.setdefault(label[period], []).append(name)
    return dict(sorted(out.items()))


class _Wheel(NamedTuple):
    """What was recorded of a healthy wheel, and whether it runs towards smaller x."""

    passing: Passing
    back: bool


@dataclass
class _Gathered:
    """What recordings hold: by side, what wheels show of gains and places; wheels; and sites with known gains."""

    trains: int = 0
    gains: dict[str | None, list[FloatArray]] = field(default_factory=dict)
    places: dict[str | None, list[FloatArray]] = field(default_factory=dict)
    wheels: list[_Wheel] = field(default_factory=list)
    known: Site | None = None


def _gathered(recordings: Any, site: Site, name: str, loads: Any) -> _Gathered:
    """Return what a recording holds of its trains."""
    out = _Gathered()
    trains = trains_in(channels_of(recordings, site), site, (), None, name, "")
    if loads is not None:
        if len(trains) != 1:
            raise InputError("", f"loads.{name}", f"{len(trains)} trains in the recording", "one")
        out.known = calibrated(site, trains[0].finding, loads)
    for one in trains:
        if is_unsteady(one.passage):
            continue
        out.trains += 1
        for side in one.sides:
            sound = np.array([not strikes for strikes in side.strikes]) & ~side.clipped
            seen = _of_sensors(one, side, site)
            out.gains.setdefault(side.side, []).append(seen[0][sound])
            out.places.setdefault(side.side, []).append(seen[1][sound])
        if site.track is None:
            continue
        sides = {side.side: side for side in one.sides}
        for rail in rails_of(one.passage, one.pulses, one.sides, known_of(site)):
            own = sides[rail.side]
            if np.isfinite(own.mean).any():
                wheels = Wheels(rail, one.passage, own.mean)
                axles = [axle for axle in range(len(own.mean)) if wheels.is_whole(axle) and not own.strikes[axle]]
                out.wheels += [_Wheel(wheels.passing(axle), wheels.direction < 0) for axle in axles]
    return out


def _pairs(site: Site, side: str | None) -> list[BetweenPlaces]:
    return [one for one in site.sensors if isinstance(one, BetweenPlaces) and one.side == side]


def _of_sensors(train: Measured, side: Any, site: Site) -> tuple[FloatArray, FloatArray]:
    """Return logarithms of what sensors read of each wheel, and where it met their ends, less the stated places, m."""
    pairs = _pairs(site, side.side)
    gains, places = np.full((len(side.mean), len(pairs)), np.nan), np.full((len(side.mean), 2 * len(pairs)), np.nan)
    numbers = {pulses.channel.sensor.name: number for number, pulses in enumerate(train.pulses)}
    axles = np.arange(len(side.mean))
    for k, pair in enumerate(pairs):
        if pair.name not in side.names:
            continue
        with np.errstate(invalid="ignore", divide="ignore"):
            gains[:, k] = np.log(side.of_channels[:, side.names.index(pair.name)])
        pulses, own = train.pulses[numbers[pair.name]], train.passage.pulses[:, numbers[pair.name]]
        there, which = axles[own >= 0], own[own >= 0]
        half = 0.5 * pulses.durations[which]
        ends = [train.passage.x_of(there, pulses.times[which] + by * half) for by in (-1.0, 1.0)]
        places[there, 2 * k], places[there, 2 * k + 1] = np.minimum(*ends) - pair.x1, np.maximum(*ends) - pair.x2
    return gains, places


def _calibration(
    gathered: Sequence[_Gathered], site: Site, deviation: float, notes: list[str], whole: Calibration | None = None,
    every: Sequence[_Gathered] = (),
) -> Calibration:  # fmt: skip
    """Return what recordings say; of a part of them, by what the `whole` says of the track and of the gains' scale."""
    trains = sum(one.trains for one in gathered)
    if not trains:
        raise InputError("", "recordings", "no train that keeps its speed", "recordings of trains")
    found, learned = site, list[Learned]()
    for side in dict.fromkeys(one.side for one in site.sensors):
        found, more = _with_sensors(gathered, found, side, deviation, every)
        learned += more
    wheels = [wheel for one in gathered for wheel in one.wheels]
    kinds, count = _kinds(wheels), 0
    if kinds:
        found, more, count = _with_track(kinds, found, None if whole is None else whole.site)
        learned += more
    elif site.track is not None:
        notes = [*notes, "no healthy wheel was recorded as a whole: nothing is said of the track"]
    return Calibration(found, site, tuple(learned), count, trains, tuple(notes))


def _with_sensors(
    gathered: Sequence[_Gathered], site: Site, side: str | None, deviation: float, every: Sequence[_Gathered]
) -> tuple[Site, list[Learned]]:
    """Return the site with gains and places of one rail's pairs, and what was learned of them."""
    pairs = _pairs(site, side)
    if not pairs:
        return site, []
    known = _known_gains(every or gathered, site, pairs)
    known = _scale_alone(known) if every and known is not None else known
    ends = np.array([x for one in pairs for x in (one.x1, one.x2)])
    affine = np.stack([np.ones_like(ends), ends - ends.mean()], axis=1)
    spread = np.array([max(one.gain_uncertainty, SUREST) for one in pairs])
    places, free_places = _pooled(
        [one.places.get(side, []) for one in gathered], affine, 0.0 * ends + deviation, PLACE, None
    )
    longer = np.log1p(np.diff(places.changes)[::2] / np.diff(ends)[::2])  # means are areas over the stated lengths
    means = [[seen - longer for seen in one.gains.get(side, [])] for one in gathered]
    known = None if known is None else (known[0] - longer, known[1])
    gains, free_gains = _pooled(means, np.ones((len(pairs), 1)), spread, GAIN, known)
    learned, changed = [], {}
    for k, one in enumerate(pairs):
        gain, after = one.gain * float(np.exp(gains.changes[k])), float(np.sqrt(gains.covariance[k, k]))
        alone, error = free_gains[k]
        own, path = one.gain, f"sensors.{one.name}."
        learned.append(Learned(
            f"{path}gain", own, gain, own * float(spread[k]), gain * after, own * float(np.exp(alone)), own * error,
            gain * float(gains.scatter[k]),
        ))  # fmt: skip
        for j, name in ((2 * k, "x1"), (2 * k + 1, "x2")):
            x, (alone, error) = float(ends[j]), free_places[j]
            learned.append(Learned(
                path + name, x, x + float(places.changes[j]), deviation, float(np.sqrt(places.covariance[j, j])),
                x + alone, error, float(places.scatter[j]), "m",
            ))  # fmt: skip
        x1, x2 = (float(x) for x in ends[2 * k : 2 * k + 2] + places.changes[2 * k : 2 * k + 2])
        changed[one.name] = {"gain": gain, "gain_uncertainty": after, "x1": x1, "x2": x2}
    sensors = [one.model_copy(update=changed.get(one.name, {})) for one in site.sensors]
    return site.model_copy(update={"sensors": tuple(sensors)}), learned


def _pooled(
    seen: Sequence[Sequence[FloatArray]], free: FloatArray, before: FloatArray, floor: float,
    known: tuple[FloatArray, FloatArray] | None,
) -> tuple[Pooled, list[tuple[float, float]]]:  # fmt: skip
    """Return what wheels say of quantities, and of each without what was stated of it, with its standard deviation."""
    every = np.concatenate([np.zeros((0, len(before))), *[one for several in seen for one in several]])
    alone = []
    for k in range(len(before)):
        found = pooled(every, free, np.where(np.arange(len(before)) == k, UNSTATED, before), floor, known)
        alone.append((float(found.changes[k]), float(np.sqrt(found.covariance[k, k]))))
    return pooled(every, free, before, floor, known), alone


def _known_gains(
    gathered: Sequence[_Gathered], site: Site, pairs: Sequence[BetweenPlaces]
) -> tuple[FloatArray, FloatArray] | None:
    """Return changes of gains by vehicles of known loads, and the inverse of their covariance."""
    precision, sums = np.zeros(len(pairs)), np.zeros(len(pairs))
    for one in gathered:
        if one.known is None:
            continue
        new = {sensor.name: sensor for sensor in one.known.sensors}
        for k, pair in enumerate(pairs):
            weight = 1.0 / (new[pair.name].gain_uncertainty ** 2 + GAIN**2)
            precision[k] += weight
            sums[k] += weight * np.log(new[pair.name].gain / pair.gain)
    return (sums / precision, np.diag(precision)) if precision.any() else None


def _scale_alone(known: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return what is known of gains' mean alone: single ones may have drifted since the loads were known."""
    count = len(known[0])
    variance = float((1.0 / np.diag(known[1])).sum()) / count**2
    return np.full(count, known[0].mean()), np.full((count, count), 1.0 / (variance * count**2))


def _kinds(wheels: Sequence[_Wheel]) -> list[tuple[Alike, bool]]:
    """Return wheels by speed and load, rail and direction, and whether they run towards smaller x."""
    kinds: dict[tuple[Any, ...], list[_Wheel]] = {}
    for one in wheels:
        speed, force = round(np.log(one.passing.speed) / SPEEDS), round(np.log(one.passing.static_force) / LOADS)
        kinds.setdefault((speed, force, one.passing.sensors, one.passing.rate, one.back), []).append(one)
    most = sorted(kinds.items(), key=lambda kind: -len(kind[1]))[:KINDS]
    out = []
    for (speed, force, *_), several in most:
        alike = _alike(several, float(np.exp(speed * SPEEDS)), float(np.exp(force * LOADS)))
        if alike is not None:
            out.append((alike, several[0].back))
    return out


def _alike(several: Sequence[_Wheel], speed: float, force: float) -> Alike | None:
    """Return wheels with readings at the same places; None if those of none are whole."""
    first = several[0].passing
    ends = np.array([(one.x1, one.x2) for one in first.sensors]).T
    begin, way = float(ends.min()) - BEYOND, float(ends.max() - ends.min()) + 2.0 * BEYOND
    nothing = np.zeros((int(np.ceil(way / speed * first.rate)), len(first.sensors)))
    noise = float(np.sqrt(np.mean([one.passing.noise**2 for one in several])))
    like = Passing(first.sensors, first.rate, nothing, nothing > 0.0, begin, speed, force, noise)
    x = like.x[:, None]
    near = np.minimum(np.abs(x - ends[0]), np.abs(x - ends[1])) > OWN + EDGE
    used = near & (x > ends[0] - BESIDE) & (x < ends[1] + BESIDE)
    read = [(at_places(one.passing, like.x), one.passing.static_force) for one in several]
    whole = [(readings, own) for (readings, there), own in read if there[used].all()]
    if not whole:
        return None
    readings, forces = zip(*whole, strict=True)
    return Alike(replace(like, used=used), np.stack(readings, axis=2), np.array(forces))


def _with_track(
    kinds: Sequence[tuple[Alike, bool]], site: Site, around: Site | None
) -> tuple[Site, list[Learned], int]:
    """Return the site with values of the track, what was learned of them, and by how many wheels."""
    known = known_of(site if around is None else around)._replace(spread=known_of(site).spread)
    several = [Traffic(alike, (known.mirrored if back else known).scene) for alike, back in kinds]
    best = estimated(several, known)
    free = best if around is not None else estimated(several, known, best)
    learned = [_learned(name, best, free, known) for name in best.names if name == LEVEL or name in known.spread]
    if any(one.contradicted for one in learned):
        best = free
        learned = [one._replace(value=one.alone, after=one.alone_deviation) for one in learned]
    count = sum(one.wheels for one in several)
    return _changed(site, known, best), learned, count


def _learned(name: str, best: Estimate, free: Estimate, known: Known) -> Learned:
    """Return a value of the track or the level of roughness before and after."""
    before = float(best.before[best.names.index(name)])
    if name == LEVEL:
        value, after = DECIBEL * best.values[name], DECIBEL * best.deviation(name)
        return Learned(
            name, 0.0, value, DECIBEL * before, after, value, after, DECIBEL * best.scatter(name), "dB to ISO 3095"
        )
    stated, value, alone = float(value_at(known.scene, name)), best.values[name], free.values[name]
    return Learned(
        TO_SITE.get(name, name), stated, value, stated * before, value * best.deviation(name), alone,
        alone * free.deviation(name), value * best.scatter(name), UNITS.get(name.replace(".", "_").split("_")[-1], ""),
    )  # fmt: skip


def _changed(site: Site, known: Known, found: Estimate) -> Site:
    """Return a site with values that were found, and their uncertainties."""
    names = [name for name in found.names if name in known.spread]
    uncertainty = {TO_SITE.get(name, name): found.deviation(name) for name in names}
    changes = {TO_SITE.get(name, name): found.values[name] for name in names if name != CONTACT}
    if CONTACT in names:
        changes["contact"] = known.scene.replaced({CONTACT: found.values[CONTACT]}).contact
    return site.replaced({**changes, "uncertainty": {**site.uncertainty, **uncertainty}})
