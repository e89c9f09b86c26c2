"""Channels of forces along a track: read from files, with their places, missing samples and zero lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensor.along import AlongTrack
from wheeltapper.describe.site import Site, as_any_site
from wheeltapper.describe.table.content import LARGEST
from wheeltapper.diagnosis.alarms import PEAKS
from wheeltapper.ground.arguments import as_list, as_path
from wheeltapper.ground.errors import InputError, with_suggestion
from wheeltapper.record.assessment.filtering import low_passed
from wheeltapper.record.recordings.read import Channel as Wanted
from wheeltapper.record.recordings.read import read_channels_of
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]
BLOCKS, SHORTEST_BLOCK = 16, 4.0
"""Number of blocks of which each gives one point of the first zero line, and their least length, s."""
MOST = 5
"""Names that a message lists."""
FOOT = 0.3
"""Share of the samples below the first zero line: wheels stand on a sensor for less than half of the time."""


@dataclass(frozen=True, eq=False)
class Channel:
    """A channel of forces: its sensor, what it reads, N, and its notes.

    Attributes
    ----------
    place, length
        Middle, m, and length, m, of the part of the rail that it weighs; the length is NaN at a seat.
    forces
        Readings over the gain, N; missing ones are interpolated.
    missing
        Where there were none, or they are clipped.
    """

    sensor: AlongTrack
    place: float
    length: float
    rate: float
    start: float
    forces: FloatArray
    missing: NDArray[np.bool_]
    notes: tuple[str, ...]

    @property
    def times(self) -> FloatArray:
        """Time of each sample, s."""
        return self.start + np.arange(len(self.forces)) / self.rate

    @property
    def end(self) -> float:
        """Time of the last sample, s."""
        return self.start + (len(self.forces) - 1) / self.rate

    def covers(self, begins: FloatArray, ends: FloatArray) -> NDArray[np.bool_]:
        """Return whether it was recorded, without missing samples, from and until these times, s."""
        first, last = (np.rint((at - self.start) * self.rate).astype(np.int64) for at in (begins, ends))
        inside = (first >= 0) & (last < len(self.forces))
        lost = np.flatnonzero(self.missing)
        return np.asarray(inside & (np.searchsorted(lost, first) == np.searchsorted(lost, last + 1)))

    def smooth(self, cutoff: float) -> FloatArray:
        """Return the forces after a low-pass without phase; as they are, where the rate is too low for it."""
        return low_passed(self.forces, self.rate, cutoff) if 2.5 * cutoff < self.rate else self.forces


def read_channels(
    files: Any, site: Site | str | Path, *, apart: bool = False, largest: float = LARGEST
) -> dict[str, Recording]:
    """Read the channels of a site's sensors from one file or several.

    Parameters
    ----------
    files
        A path, or several: one for each rail, one for each channel, or one for all channels. A column belongs to the
        sensor with its name, or with its number in the file; the column of a file with one column to the sensor with
        the file's name. If no column has a sensor's name, the sensor's `column` counts.
    site
        The site, or the path of its TOML file.
    apart, largest
        As for `read_recording`.

    Returns
    -------
    dict
        The recording of each sensor, by its name; also that of a deck's sensor, if it has a name and is there. Files
        share one clock: the times in the files count; without times, all files begin together.

    Raises
    ------
    InputError
        If a file cannot be read, two files hold the same channel, or more than half of the channels are in none.
    """
    site, what = as_any_site(site), "paths of recordings"
    paths = [
        as_path(one, "files", what) for one in as_list([files] if isinstance(files, Path) else files, "files", what)
    ]
    wanted = {
        one.name: Wanted(
            one.quantity, one.unit, one.rate if "rate" in one.model_fields_set else None, one.bridge, one.column
        )
        for one in _sensors_of(site)
    }
    deck = site.sensor.name if site.passage is not None else ""
    if deck:
        wanted[deck] = Wanted(site.sensor.quantity, None, site.sensor.rate, column=site.sensor.column)
    found: dict[str, Recording] = {}
    columns = []
    for path in paths:
        here, named = read_channels_of(path, wanted, apart=apart, largest=largest)
        columns.append(named)
        twice = next((name for name in here if name in found), None)
        if twice is not None:
            raise InputError(str(path), twice, f"a channel that is also in {found[twice].source}", "one file for each")
        found |= here
    source = str(paths[0]) if len(paths) == 1 else ""
    weighing = [one for one in site.sensors if one.quantity == "force"] or [*site.sensors]
    _check_enough(weighing, found, source, f"; there are {'; '.join(columns[:MOST])}")
    return found


def _check_enough(sensors: Sequence[AlongTrack], found: Mapping[str, Any], source: str = "", columns: str = "") -> None:
    """Refuse recordings of less than half of the sensors: a single one that is lost costs its channel alone."""
    lost = [one.name for one in sensors if one.name not in found]
    if 2 * len(lost) > len(sensors):
        listed = ", ".join(map(repr, lost[:MOST])) + (" …" if len(lost) > MOST else "")
        what = f"no column for {len(lost)} of {len(sensors)} sensors ({listed})"
        raise InputError(source, "sensor.name", what, f"a column or a file for each sensor{columns}")


def _sensors_of(site: Site) -> tuple[AlongTrack, ...]:
    if not site.sensors:
        raise InputError("", "sensor", "none along the track", "sensors of forces, each a [[sensor]] of the site")
    return site.sensors


def channels_of(recordings: Mapping[str, Recording] | Iterable[str | Path] | str | Path, site: Site) -> list[Channel]:
    """Return a site's channels of forces, ordered by their places; read them if files are given."""
    sensors = {one.name: one for one in _sensors_of(site)}
    forces = {name: one for name, one in sensors.items() if one.quantity == "force"}
    if not forces:
        raise InputError("", "sensor", "none of a force", "sensors of forces, each a [[sensor]] of the site")
    found = dict(recordings if isinstance(recordings, Mapping) else read_channels(recordings, site))
    found.pop(site.sensor.name if site.passage is not None else "", None)
    for name, one in found.items():
        if name not in sensors:
            raise InputError("", "recordings", f"{name!r}", with_suggestion(str(name), sensors))
        if not isinstance(one, Recording) or one.quantity != sensors[name].quantity:
            raise InputError("", f"recordings.{name}", f"{one!r}"[:80], f"a Recording of a {sensors[name].quantity}")
    _check_enough([*forces.values()], found)
    there = (_channel(one, found[name], site) for name, one in forces.items() if name in found)
    return sorted(there, key=lambda one: one.place)


def unused_sensors(site: Site) -> list[str]:
    """Return a note on the sensors that say nothing of forces."""
    others = [repr(one.name) for one in site.sensors if one.quantity != "force"]
    return [f"no sensors of forces: not used, whether recorded or not: {', '.join(others)}"] if others else []


def _channel(sensor: AlongTrack, recording: Recording, site: Site) -> Channel:
    begins, ends = sensor.extent(site.spacing)
    length = np.nan if sensor.ends is None else ends - begins
    forces, lost = recording.samples / sensor.gain, np.isnan(recording.samples)
    if lost.any():
        there = np.flatnonzero(~lost)
        forces = np.interp(np.arange(len(forces)), there, forces[there])
    return Channel(
        sensor,
        0.5 * (begins + ends),
        length,
        recording.rate,
        recording.start,
        forces,
        lost | recording.clipped,
        recording.notes,
    )


def foot_points(few: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Return the points of a first zero line, samples and N: a foot of each block; a wheel that stands is no foot."""
    count = int(np.clip(len(few) / (SHORTEST_BLOCK * rate), 1, BLOCKS))
    edges = np.linspace(0, len(few), count + 1).astype(int)
    apart = max(int(rate / (2.0 * PEAKS)), 1)  # what lies between such samples says nothing more
    feet = np.array([np.quantile(few[a:b:apart], FOOT) for a, b in zip(edges[:-1], edges[1:], strict=True)])
    middle = float(np.median(feet))
    high = feet > middle + 0.25 * (float(few.max()) - middle)
    feet[high] = np.interp(np.flatnonzero(high), np.flatnonzero(~high), feet[~high])
    return 0.5 * (edges[:-1] + edges[1:]), feet
