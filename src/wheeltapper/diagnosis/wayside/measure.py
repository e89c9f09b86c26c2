"""Trains in the recordings of a site's sensors: one table for each, with the forces of every wheel."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from wheeltapper.describe.site import Site, as_any_site
from wheeltapper.diagnosis.alarms import PEAKS, compared
from wheeltapper.diagnosis.train import TrainFinding
from wheeltapper.diagnosis.wayside.axles import passages_of
from wheeltapper.diagnosis.wayside.channels import Channel, FloatArray, channels_of, read_channels, unused_sensors
from wheeltapper.diagnosis.wayside.deck import DIAGNOSED, Diagnosed, deck_recording, with_deck
from wheeltapper.diagnosis.wayside.doubts import (
    check_train,
    displaced,
    doubtful_gains,
    ends_within,
    exchanged_sides,
    gaps_in,
    lost_axles,
    misfits,
    odd_gains,
    sound_channels,
)
from wheeltapper.diagnosis.wayside.measured import Measured
from wheeltapper.diagnosis.wayside.passage import Passage, axles_text, occupied_by, with_known_distances
from wheeltapper.diagnosis.wayside.pulses import Pulses, pulses_of
from wheeltapper.diagnosis.wayside.seen import blind_shares
from wheeltapper.diagnosis.wayside.sizes import with_sizes
from wheeltapper.diagnosis.wayside.vehicles import Vehicle, vehicles_of
from wheeltapper.diagnosis.wayside.wheels import Side, imbalance, seats_of, sides_of, turn_between
from wheeltapper.ground.arguments import as_count, as_list, as_quantity, check_choice, check_text
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower.plausible import site_notes
from wheeltapper.record.limits.rule import Rule, Rules, as_rules
from wheeltapper.record.recordings.recording import Recording

STRIKES, NO_STRIKES, NO_FORCE = "strikes", "no strikes", "no force"
"""Verdicts on a wheel without a model."""
KINDS = {"bogies": "bogies", "shared bogies": "shared bogies", "axles": "single axles", "alone": "not told"}


def measure_trains(
    recordings: Mapping[str, Recording] | Iterable[str | Path] | str | Path,
    site: Site | str | Path,
    *,
    distances: Sequence[float | str] | None = None,
    rules: Rules = None,
    countries: Sequence[str] | None = None,
    name: str = "",
    date: str = "",
    diagnosed: Diagnosed = "none",
    workers: int | None = 1,
) -> tuple[TrainFinding, ...]:
    """Measure the trains in recordings of a track's sensors, without a model.

    Axles are found in each channel, and all channels together tell which pulses belong to one axle. Speed and direction
    follow from the channels' places, or from known distances of axles. Bogies and vehicles follow from the axles'
    distances. Forces are measured while a wheel is on the sensors of its rail. Strikes elsewhere are not measured.

    Parameters
    ----------
    recordings
        Paths of files with the channels (`read_channels`), or recordings by the names of the site's sensors.
    site
        The site with its sensors, or the path of its TOML file.
    distances
        Distances of neighbouring axles of a vehicle that is in each train, m. The speed follows from them if all
        sensors are at one place.
    rules, countries
        Alarm rules, or the path of their file, by default those of the package; and the countries whose rules are
        taken, by default all.
    name, date
        Name of the recording and date of the passage; both are only repeated in the results.
    diagnosed
        What is also diagnosed with a model: "none", "suspicious" or "all". At a site with a deck these are axles, by
        the acceleration of the deck's sensor, whose name is that of a column; an axle is suspicious if it has strikes,
        an alarm, or no force. At a site with a `track` these are wheels: a model of wheel and track is fitted to the
        recording, and gives the length of a flat; a wheel is suspicious if it strikes, or if a wheel without a flaw
        does not explain its readings. Each takes seconds.
    workers
        Number of processes that diagnose; None: one per core. Wheels that feel each other's flats are fitted by the
        same process.

    Returns
    -------
    tuple of TrainFinding
        One for each train, in the order of time; empty if no axle is found.

    Raises
    ------
    InputError
        If a file or a channel is missing or wrong, or the site has no sensors along the track.
    """
    site, chosen = as_any_site(site), as_rules(rules, countries)
    check_text(name, "name")
    check_text(date, "date")
    check_choice(diagnosed, "diagnosed", DIAGNOSED)
    workers = None if workers is None else as_count(workers, "workers")
    given = recordings if isinstance(recordings, Mapping) else read_channels(recordings, site)
    found = trains_in(channels_of(given, site), site, chosen, distances, name, date)
    return tuple(one.finding for one in with_models(found, given, site, diagnosed, workers))


def trains_in(
    channels: Sequence[Channel], site: Site, rules: tuple[Rule, ...], distances: Sequence[float | str] | None,
    name: str, date: str,
) -> list[Measured]:  # fmt: skip
    """Return the trains in a site's channels, in the order of time."""
    known = known_distances(distances)
    there = {channel.sensor.name for channel in channels}
    lost = [one.name for one in site.sensors if one.quantity == "force" and one.name not in there]
    absent = [f"not in the recording: the channels {', '.join(map(repr, lost))}"] if lost else []
    sound, notes = sound_channels(channels)
    several, passages = _pulses_and_passages(sound)
    wrong, beside = displaced(passages, several)
    if wrong:
        several = [one for number, one in enumerate(several) if number not in wrong]
        passages = passages_of(several)
    check_train(passages, several)
    uncounted, more = doubtful_gains(several)
    notes += [*beside, *gaps_in(sound)]
    cutoffs = {rule.low_pass for rule in rules if isfinite(rule.low_pass) and not rule.sliding_mean}
    trains = []
    for passage in passages:
        found = passage if known is None else with_known_distances(passage, known)
        sides = sides_of(found, several, site.wheel_radius, uncounted, cutoffs)
        (odd, said), (exchanged, crossed) = odd_gains(sides), exchanged_sides(sides)
        if odd | exchanged:
            others = {n for n, one in enumerate(several) if one.channel.sensor.name in odd | exchanged}
            sides = sides_of(found, several, site.wheel_radius, uncounted | others, cutoffs)
        early, late, cut = ends_within(found, several)
        of_axles = () if found.turns else (*cut, *misfits(found, several), *lost_axles(found, several))
        told = (*absent, *notes, *more, *said, *crossed, *of_axles, *found.notes)
        found = replace(found, notes=told, cut=(bool(early.any()), bool(late.any())))
        trains.append(Measured(_train(found, several, sides, site, rules, name, date), found, several, sides))
    return trains


def known_distances(distances: Sequence[float | str] | None) -> list[float] | None:
    """Return distances of neighbouring axles in m, as they were given."""
    if distances is None:
        return None
    what = "distances of neighbouring axles, m"
    return [as_quantity(one, "distances", "length") for one in as_list(distances, "distances", what)]


def _pulses_and_passages(channels: Sequence[Channel]) -> tuple[list[Pulses], list[Passage]]:
    """Return the pulses of channels and the trains in them; with zero lines beside the wheels of trains that stop."""
    several = [pulses_of(channel) for channel in channels]
    passages = passages_of(several)
    if any(one.stands for one in passages):
        several = [
            pulses_of(one, occupied_by(passages, one)) if isfinite(one.length) else pulses_of(one) for one in channels
        ]
        passages = passages_of(several)
    return several, passages


def with_models(
    found: Sequence[Measured], recordings: Mapping[str, Recording], site: Site, diagnosed: Diagnosed,
    workers: int | None,
) -> list[Measured]:  # fmt: skip
    """Return trains whose axles are diagnosed by the deck's recording, or whose wheels by the gauges' on a track."""
    if diagnosed == "none":
        return list(found)
    if site.track is not None:
        return [with_sizes(one, site, diagnosed, workers) for one in found]
    deck = deck_recording(recordings, site)
    if deck is None or site.passage is None:
        found_there = f"{diagnosed!r}, without a recording of a deck"
        raise InputError("", "diagnosed", found_there, "'none', or a site with a deck or a `track`")
    return [one._replace(finding=with_deck(one.finding, deck, site, diagnosed, workers)) for one in found]


def _notes_of_channels(several: Sequence[Pulses]) -> list[str]:
    """Return the notes of channels, each once with the channels that it is about."""
    about: dict[str, list[str]] = {}
    for pulses in several:
        for note in pulses.channel.notes:
            about.setdefault(note, []).append(pulses.channel.sensor.name)
    said = []
    for note, names in about.items():
        which = f"channel {names[0]!r}" if len(names) == 1 else f"channels {', '.join(map(repr, names))}"
        said.append(f"{'all channels' if len(names) == len(several) > 1 else which}: {note}")
    return said


def _train(
    passage: Passage, several: Sequence[Pulses], sides: Sequence[Side], site: Site, rules: tuple[Rule, ...], name: str,
    date: str,
) -> TrainFinding:  # fmt: skip
    vehicles = vehicles_of(passage.places.tolist())
    seats = [seats_of(passage, several, side.side) for side in sides]
    entries = []
    for number, vehicle in enumerate(vehicles, 1):
        for bogie, axles in enumerate(vehicle.bogies, 1):
            for axle in axles:
                entry = _entry(axle, passage, sides, seats, site)
                entries.append(entry | {"vehicle": number, "bogie": bogie})
    notes = [*site_notes(site), *unused_sensors(site), *_notes_of_channels(several)]
    alone = _alone(vehicles, passage)
    if alone and len(vehicles) > 1 and not passage.turns:
        notes.append(f"{axles_text(alone)}: by the distances in no vehicle; perhaps an axle beside them was lost")
    notes += [*passage.notes, *_lost_forces(sides), *_what_forces_are(several), *_blind(site, passage)]
    told = tuple(_vehicle(number, one, entries) for number, one in enumerate(vehicles, 1))
    alarms, untested = compared(entries, rules, site, told)
    return TrainFinding(
        tuple(entries), site, rules, alarms, name, date, notes=tuple(dict.fromkeys(notes)), vehicles=told,
        untested=untested,
    )  # fmt: skip


def _alone(vehicles: Sequence[Vehicle], passage: Passage) -> list[int]:
    """Return the axles, from 1, that are in no vehicle, without those at an end at which the recording is cut off."""
    alone = [one.kind == "alone" for one in vehicles]
    first = alone.index(False) if passage.cut[0] and False in alone else 0
    last = alone[::-1].index(False) if passage.cut[1] and False in alone else 0
    inner = zip(vehicles[first : len(vehicles) - last], alone[first:], strict=False)
    return [one.axles[0] + 1 for one, single in inner if single]


def _entry(
    axle: int, passage: Passage, sides: Sequence[Side], seats: Sequence[tuple[list[dict[str, float]], FloatArray]],
    site: Site,
) -> dict[str, Any]:  # fmt: skip
    """Return what is known of an axle, in SI units."""
    wheels = [_wheel(axle, side, site) for side in sides]
    for wheel, (at_seats, loads) in zip(wheels, seats, strict=True):
        if at_seats[axle]:
            wheel |= {"seats": at_seats[axle], "relative_load": float(loads[axle])}
    forces = {wheel["side"]: wheel["static_force"] for wheel in wheels}
    whole = [forces.get("left"), forces.get("right")]
    verdicts = [wheel["verdict"] for wheel in wheels]
    verdict = next((one for one in (STRIKES, NO_STRIKES) if one in verdicts), NO_FORCE)
    return {
        "verdict": verdict,
        "forces_from": "recording",
        "speed": abs(float(passage.speeds[axle])),
        "direction": 1 if passage.speeds[axle] > 0.0 else -1,
        "time": float(passage.times[axle]),
        "place": float(passage.places[axle]),
        "channels_lost": int((passage.pulses[axle] < 0).sum()),
        "static_force": None if None in whole else sum(whole),  # type: ignore[arg-type]
        "left_right": imbalance(*whole),
        "wheels": wheels,
    }


def _wheel(axle: int, side: Side, site: Site) -> dict[str, Any]:
    strikes = side.strikes[axle]
    seen = isfinite(side.mean[axle])
    means = {name: float(one) for name, one in zip(side.names, side.of_channels[axle], strict=True) if isfinite(one)}
    gains = [one.gain_uncertainty for one in site.sensors if one.name in means and one.name in side.counted]
    turn = turn_between(strikes, site.wheel_radius)
    return {
        "side": side.side,
        "verdict": NO_FORCE if not seen else STRIKES if strikes else NO_STRIKES,
        "static_force": float(side.mean[axle]) if seen else None,
        "static_uncertainty": float(np.sqrt(np.sum(np.square(gains))) / len(gains)) if gains else None,
        "largest_force": float(side.below[PEAKS][0][axle]) if seen else None,
        "largest_below": [
            {"frequency": cutoff, "force": float(force[axle]), "turn_seen": _or_none(share[axle])}
            for cutoff, (force, share) in sorted(side.below.items())
            if isfinite(force[axle])
        ],
        "strikes": [one._asdict() for one in strikes],
        "repeats_after": turn,
        "channels": means,
    }


def _vehicle(number: int, vehicle: Vehicle, entries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what is known of a vehicle: its loads and how they are out of balance."""
    first, last = vehicle.axles[0], vehicle.axles[-1]
    loads = [[_loads(entries, bogie, side) for side in ("left", "right")] for bogie in vehicle.bogies]
    (fl, fr), (rl, rr) = loads[0], loads[-1]
    every = [load for bogie in loads for load in bogie]
    crossed = None if len(loads) < 2 or None in (fl, fr, rl, rr) else imbalance(fl + rr, fr + rl)  # type: ignore[operator]
    return {
        "vehicle": number,
        "kind": KINDS[vehicle.kind],
        "first_axle": first + 1,
        "last_axle": last + 1,
        "axles": len(vehicle.axles),
        "wheelbases": [round(float(entries[b[-1]]["place"] - entries[b[0]]["place"]), 3) for b in vehicle.bogies],
        "distance": float(entries[last]["place"] - entries[first]["place"]),
        "load": None if None in every else sum(every),  # type: ignore[arg-type]
        "left_right": imbalance(_loads(entries, vehicle.axles, "left"), _loads(entries, vehicle.axles, "right")),
        "front_rear": imbalance(_sum(loads[0]), _sum(loads[-1])) if len(loads) > 1 else None,
        "diagonal": crossed,
    }


def _loads(entries: Sequence[Mapping[str, Any]], axles: Iterable[int], side: str) -> float | None:
    """Return the static force of one side of axles, N, or None."""
    return _sum([next((w["static_force"] for w in entries[a]["wheels"] if w["side"] == side), None) for a in axles])


def _or_none(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def _sum(values: Sequence[float | None]) -> float | None:
    return None if None in values else sum(values)  # type: ignore[arg-type]


def _lost_forces(sides: Sequence[Side]) -> list[str]:
    said: dict[str, list[str]] = {}
    for side in sides:
        lost = ~np.isfinite(side.mean)
        for axles, what in (
            (lost & bool(side.names), "no channel shows the whole passage; they have no force"),
            (side.clipped & ~lost, "clipped or missing samples in a channel, which does not count for them"),
        ):
            if axles.any():
                which = axles_text((np.flatnonzero(axles) + 1).tolist())
                said.setdefault(f"{which}{{}}: {what}", []).append(f" {side.side}" if side.side else "")
    return [note.format("" if len(where) > 1 else where[0]) for note, where in said.items()]


def _what_forces_are(several: Sequence[Pulses]) -> list[str]:
    sensors = [pulses.channel.sensor for pulses in several]
    gains = [one.gain_uncertainty for one in sensors]
    out = [
        f"forces are from the recording: static is the mean over the sensors, peak the largest below {PEAKS:g} Hz "
        "while a wheel is between gauges and 1 ms from either; what strikes elsewhere is not measured"
    ]
    if max(gains) > 0.0:
        out.append(f"gains of single channels are known to {100 * max(gains):.3g} %")
    if any(not isfinite(pulses.channel.length) for pulses in several):
        out.append(
            "sensors at seats count for axles and speeds, and compare wheels of this train; a seat's share of a "
            "wheel's force depends on the track, so that no force of a wheel is taken from them"
        )
    if {one.side for one in sensors} in ({"left"}, {"right"}, {None}):
        out.append("sensors of one rail: no axle loads and no imbalance")
    return out


def _blind(site: Site, passage: Passage) -> list[str]:
    """Return which share of a wheel's turn the sensors do not see."""
    if all(one.ends is None for one in site.sensors):
        return []
    if site.wheel_radius is None:
        return ["the site states no radius of the wheels: on which share of a turn a strike meets no sensor is unknown"]
    shares = blind_shares(site, abs(float(np.median(passage.speeds))))
    told = ", ".join(f"{100 * one.strikes:.0f} %{f' ({one.side})' if one.side else ''}" for one in shares)
    return [f"a strike is not seen on {told} of a wheel's turn, where it meets the rail beside the sensors"]


def calibrated(
    site: Site | str | Path, train: TrainFinding, loads: Mapping[int, float | str | Sequence[float | str]]
) -> Site:
    """Return the site with gains that follow from a train of known loads.

    Parameters
    ----------
    site
        The site with which the train was measured, or the path of its TOML file.
    train
        The result of `measure_trains` for that passage, which has to be slow, so that forces are static.
    loads
        Known loads, N, by the numbers of the axles, from 1: the load of the axle, half of it on each rail; or those of
        the left and the right wheel.

    Returns
    -------
    Site
        Each sensor's `gain` is its reading divided by the true load, in the mean of all these wheels. Its
        `gain_uncertainty` is the standard error of that mean. A `ModelWarning` names gains that no gauge has, for
        example because the loads have another unit.

    Raises
    ------
    InputError
        If an axle does not exist, or a sensor saw fewer than two known wheels.
    """
    site = as_any_site(site)
    ratios: dict[str, list[float]] = {one.name: [] for one in site.sensors if one.ends is not None}
    if not isinstance(loads, Mapping) or not loads:
        raise InputError("", "loads", value_text(loads), "loads by the numbers of axles, as {1: 220e3, 2: 221e3}")
    for axle, given in loads.items():
        if not isinstance(axle, int) or not 1 <= axle <= len(train.axles):
            raise InputError("", "loads", f"axle {value_text(axle)}", f"1 to {len(train.axles)}")
        several = isinstance(given, Sequence) and not isinstance(given, str)
        values = [as_quantity(one, f"loads.{axle}", "force") for one in (given if several else (given, given))]  # type: ignore[union-attr]
        if len(values) != 2:
            raise InputError("", f"loads.{axle}", value_text(given), "a load, or those of the left and the right wheel")
        known = dict(zip(("left", "right"), values if several else [0.5 * one for one in values], strict=True))
        for wheel in train.axles[axle - 1].get("wheels", ()):
            truth = known.get(wheel["side"], known["left"])
            for name, mean in wheel["channels"].items():
                if name in ratios:
                    ratios[name].append(mean / truth)
    sensors = []
    for one in site.sensors:
        seen = ratios.get(one.name)
        if seen is None:
            sensors.append(one)
            continue
        if len(seen) < 2:
            raise InputError("", "loads", f"{len(seen)} known wheels on the sensor {one.name!r}", "2 or more")
        error = float(np.std(seen, ddof=1) / np.sqrt(len(seen)) / np.mean(seen))
        sensors.append(one.model_copy(update={"gain": one.gain * float(np.mean(seen)), "gain_uncertainty": error}))
    found = site.model_copy(update={"sensors": tuple(sensors)})
    warn_of(site_notes(found))
    return found
