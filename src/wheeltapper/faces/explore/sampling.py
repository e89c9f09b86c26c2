"""What a page draws of a record: histories, losses and impacts, phase portrait, spectrum, and the motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.faces.explore.frames import Frame
from wheeltapper.faces.panels import in_unit
from wheeltapper.lower.lowered.base import Variables
from wheeltapper.record.labels import attributes_of
from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
POINTS = 2000
"""Uniform times of a history; events and force maxima are added."""
MOST_ADDED = 3000
"""Most events and maxima that are added to the times; of more maxima the largest are kept."""
SPECTRUM = 4096
"""Samples of a spectrum."""
MOST_LINES = 8
"""Most lines of one panel."""
FORCE = "normal_force"
SURFACE = 8000
"""Points of a drawn surface."""
NO_CHANNEL = ("time", "static_force")


class Part(NamedTuple):
    """Some of the times at which a record was sampled: a history, a window of it, the samples of a spectrum.

    Its variables bear no labels: a dataset takes longer than a short run, and the first one a second.
    """

    data: Variables
    rows: slice = slice(None)

    @property
    def time(self) -> FloatArray:
        """Times, s."""
        return np.asarray(self.data["time"][1][self.rows])

    def of(self, name: str, at: dict[str, Any]) -> FloatArray:
        """Return a variable over time, for one wheel or body."""
        dimensions, values = self.data[name]
        where = tuple(self.axis(along).index(at[along]) for along in dimensions[1:])
        return np.asarray(values[(self.rows, *where)], dtype=float)

    def axis(self, along: str) -> list[Any]:
        """Return the names along an axis: wheelsets, sides, bodies."""
        names: list[Any] = np.asarray(self.data[along][1]).tolist()
        return names


class Channel(NamedTuple):
    """One line that a panel can show: a variable, and of which wheel or body it is."""

    key: str
    variable: str
    words: str
    unit: str
    meaning: str
    at: dict[str, Any]

    def of(self, part: Part) -> FloatArray:
        """Return its values over time."""
        return part.of(self.variable, self.at)


def channels_of(history: Part, several: bool) -> list[Channel]:
    """Return all lines of a history: for each variable one, or one for each wheel, body and direction.

    `several`: whether every wheel has contacts of its own.
    """
    found = []
    for name, (dimensions, _) in history.data.items():
        if dimensions[:1] != ("time",) or name in NO_CHANNEL:
            continue
        said = attributes_of(name, several)
        for chosen in product(*(history.axis(along) for along in dimensions[1:])):
            at = dict(zip(dimensions[1:], chosen, strict=True))
            words = ", ".join(str(v) if isinstance(v, str) else f"{along} {v}" for along, v in at.items())
            key = "|".join([name, *(f"{along}={value}" for along, value in at.items())])
            found.append(Channel(key, name, words, _unit_of(said["units"], at), said["long_name"], at))
    return found


def _unit_of(units: str, at: dict[str, Any]) -> str:
    """Return the unit of a body's motion: along an axis the first of two, about it the second."""
    first, _, second = units.partition(" or ")
    return second if second and len(str(at.get("motion", "z"))) > 1 else first


def times_of(record: Record, first: float = 0.0, last: float | None = None) -> FloatArray:
    """Return about 2000 times with every event and maximum between them."""
    last = record.end if last is None else min(last, record.end)
    peaks, forces = record._peaks["time"], record._peaks["normal_force"]
    if len(peaks) > MOST_ADDED:
        peaks = peaks[np.argsort(forces)[-MOST_ADDED:]]
    added = np.concatenate([record._events["time"][:MOST_ADDED], peaks])
    uniform = np.linspace(first, last, POINTS)
    return np.unique(np.concatenate([uniform, added[(added >= first) & (added <= last)]]))


@dataclass(frozen=True)
class Shown:
    """What the page has chosen to see: keys of channels, "" for the usual one; and between which times, s."""

    below: str = ""
    phase: str = ""
    spectrum: str = ""
    first: float = 0.0
    last: float | None = None


def run_frame(record: Record, shown: Shown, seq: int) -> Frame:
    """Return everything that a page draws of a run but the surfaces, which seldom change."""
    whole = times_of(record)
    zoomed = shown.first > 0.0 or shown.last is not None
    near = times_of(record, shown.first, shown.last) if zoomed else whole[:0]
    even = np.arange(SPECTRUM) * (record.end / SPECTRUM)
    data = record._variables_at(np.concatenate([whole, near, even]))
    history = Part(data, slice(0, len(whole)))
    window = Part(data, slice(len(whole), len(whole) + len(near))) if zoomed else history
    channels = {channel.key: channel for channel in channels_of(history, record._contacts.has_sides)}
    frame = Frame(
        "run", seq=seq, summary=str(record), outcome=record.outcome.name, notes=[str(note) for note in record.notes],
        end=record.end, speed=record.scenario.speed, numbers=numbers_of(record),
        channels=[[one.key, _name(one), one.unit] for one in channels.values()],
    )  # fmt: skip
    frame.head["time"] = frame.array(window.time)
    forces = [one for one in channels.values() if one.variable == FORCE]
    frame.head["force"] = _force_panel(frame, record, window, forces)
    frame.head["below"] = _below_panel(frame, window, channels, shown.below)
    frame.head["phase"] = _phase_panel(frame, history, channels, shown.phase)
    frame.head["spectrum"] = _spectrum_panel(
        frame, record.end, Part(data, slice(-SPECTRUM, None)), channels, shown.spectrum
    )
    frame.head["events"] = [
        _marks(frame, record, contact) | {"name": name} for contact, name in enumerate(_contact_names(record))
    ]
    frame.head["motion"] = _motion(frame, record, history)
    return frame


def numbers_of(record: Record) -> dict[str, float | int | None]:
    """Return the numbers by which runs are compared, in SI units."""
    impacts, ratio = record._impacts_and_ratio()
    peaks = record._peaks["normal_force"]
    return {
        "largest force over static": ratio,
        "largest force [kN]": float(peaks.max()) / 1e3 if len(peaks) else None,
        "impacts": impacts,
        "time in the air [ms]": 1e3 * record.time_in_air,
    }


def _name(channel: Channel) -> str:
    words = channel.variable.replace("_", " ")
    return f"{words}, {channel.words}" if channel.words else words


def _several(channels: dict[str, Channel], key: str, usual: tuple[str, ...]) -> list[Channel]:
    """Return the lines that a panel shows for a chosen one: that of every wheel, or that of one body."""
    chosen = channels.get(key) or _usual(channels, usual) or next(iter(channels.values()))
    if "body" in chosen.at or "motion" in chosen.at:
        return [chosen]
    return [one for one in channels.values() if one.variable == chosen.variable][:MOST_LINES]


def _usual(channels: dict[str, Channel], names: tuple[str, ...]) -> Channel | None:
    """Return the first line of one of some variables; of a body's motions the vertical one."""
    known = [one for name in names for one in channels.values() if one.variable == name]
    return next((one for one in known if one.at.get("motion", "z") == "z"), None)


def _panel(frame: Frame, lines: list[tuple[str, FloatArray]], unit: str, title: str) -> dict[str, Any]:
    """Return a panel: its title, the unit in which its lines are drawn, and the lines."""
    tops = [float(np.nanmax(np.abs(values))) if len(values) else 0.0 for _, values in lines]
    factor, shown = in_unit([max(tops, default=0.0) / 4.0], unit)
    drawn = [{"label": label, "values": frame.array(factor * values)} for label, values in lines]
    return {"title": title, "unit": shown, "factor": factor, "lines": drawn}


def _force_panel(frame: Frame, record: Record, window: Part, forces: list[Channel]) -> dict[str, Any]:
    several = len(forces) > 1
    of = "each wheel" if record._contacts.has_sides else "each wheelset" if several else "the wheelset"
    lines = [(one.words or "normal force", one.of(window)) for one in forces[:MOST_LINES]]
    cut = f", the first {MOST_LINES} of {len(forces)}" if len(forces) > MOST_LINES else ""
    panel = _panel(frame, lines, "N", f"Normal force on {of}{cut}")
    static = record._contacts.static_force[: len(lines)]
    return panel | {"key": FORCE, "static": [panel["factor"] * float(value) for value in static]}


def _below_panel(frame: Frame, window: Part, channels: dict[str, Channel], key: str) -> dict[str, Any]:
    chosen = _several(channels, key, ("wheel_displacement", "displacement"))
    first = chosen[0]
    lines = [(one.words or one.variable.replace("_", " "), one.of(window)) for one in chosen]
    title = first.meaning[0].upper() + first.meaning[1:]
    if first.variable == "wheel_displacement":
        paths = [one for one in channels.values() if one.variable == "constraint"][: 1 if len(chosen) == 1 else 0]
        lines += [("path of the rigid wheel", one.of(window)) for one in paths]
        title += ", and the path of a rigid wheel" if paths else ""
    elif first.words and len(chosen) == 1:
        title += f": {first.words}"
    return _panel(frame, lines, first.unit, title) | {"key": first.key, "axis": first.variable.replace("_", " ")}


def _phase_panel(frame: Frame, history: Part, channels: dict[str, Channel], key: str) -> dict[str, Any]:
    """Return displacement and velocity of one thing; the last third of the run is marked by the page."""
    pairs = {one.key: other for one in channels.values() if (other := _velocity(one, channels)) is not None}
    if not pairs:
        return {"title": "Phase portrait: nothing with a velocity", "choices": []}
    usual = _usual({k: channels[k] for k in pairs}, ("wheel_displacement", "displacement"))
    key = key if key in pairs else next(iter(pairs)) if usual is None else usual.key
    place, rate = channels[key], pairs[key]
    x, y = place.of(history), rate.of(history)
    x_factor, x_unit = in_unit([float(np.nanmax(np.abs(x))) / 4.0], place.unit)
    y_factor, y_unit = in_unit([float(np.nanmax(np.abs(y))) / 4.0], rate.unit)
    words = f", {place.words}" if place.words else ""
    return {
        "title": f"Phase portrait: {place.variable.replace('_', ' ')} and its rate{words}", "key": key,
        "x": frame.array(x_factor * x), "y": frame.array(y_factor * y), "x_label": f"displacement [{x_unit}]",
        "y_label": f"velocity [{y_unit}]", "choices": [[k, _name(channels[k])] for k in pairs],
    }  # fmt: skip


def _velocity(channel: Channel, channels: dict[str, Channel]) -> Channel | None:
    """Return the line that is the rate of another one."""
    name, _, rest = channel.key.partition("|")
    if name.endswith(("velocity", "acceleration")):
        return None
    candidates = [f"{name}_velocity"] + ([name.replace("displacement", "velocity")] if "displacement" in name else [])
    return next((channels[k] for one in candidates if (k := f"{one}|{rest}" if rest else one) in channels), None)


def _spectrum_panel(frame: Frame, end: float, even: Part, channels: dict[str, Channel], key: str) -> dict[str, Any]:
    """Return the amplitudes of a line's harmonics, by a Hann window over the whole run."""
    chosen = channels.get(key) or next((one for one in channels.values() if one.variable == FORCE), None)
    chosen = chosen or next(iter(channels.values()))
    values = chosen.of(even)
    window = np.hanning(SPECTRUM + 1)[:-1]
    with np.errstate(invalid="ignore", over="ignore"):
        amplitudes = 2.0 * np.abs(np.fft.rfft((values - values.mean()) * window)) / window.sum()
    frequency = np.arange(len(amplitudes)) / end
    kept = slice(1, SPECTRUM // 4)  # above a quarter of the rate, corners of a force fold back
    factor, unit = in_unit([float(np.nanmax(amplitudes[kept], initial=0.0)) / 4.0], chosen.unit)
    words = f", {chosen.words}" if chosen.words else ""
    return {
        "title": f"Spectrum of the {chosen.variable.replace('_', ' ')}{words} (Hann window, {end:.4g} s)",
        "key": chosen.key, "x": frame.array(frequency[kept]), "y": frame.array(factor * amplitudes[kept]),
        "unit": unit,
    }  # fmt: skip


def _contact_names(record: Record) -> list[str]:
    """Return a short name of each wheel, or wheelset: "1 left"."""
    labels, count = record._contacts.public_labels, len(record._contacts.static_force)
    parts = [labels[name][:count].tolist() for name in ("wheelset", "side") if name in labels]
    return [" ".join(map(str, one)) for one in zip(*parts, strict=True)] if parts else ["wheelset"]


def _marks(frame: Frame, record: Record, contact: int) -> dict[str, Any]:
    """Return between which times a wheel has no contact, and when it hits the rail again."""
    from wheeltapper.march.common import program as contract

    events = record._events
    here = events["contact"] == contact
    time, kind = events["time"][here], events["kind"][here]
    losses, impacts = time[kind == contract.LOSS], time[kind == contract.IMPACT]
    if len(impacts) and (not len(losses) or impacts[0] < losses[0]):
        losses = np.append(0.0, losses)  # a wheel that begins in the air
    ends = np.append(impacts, record.end)[np.searchsorted(impacts, losses)]
    return {"from": frame.array(losses), "to": frame.array(ends), "impacts": frame.array(impacts)}


# -- the motion -------------------------------------------------------------------------------------------------------


def _motion(frame: Frame, record: Record, history: Part) -> dict[str, Any]:
    """Return what is drawn in motion: the wheels of one side, bodies, deck and rail, over the history's times."""
    contacts, scenario = record._contacts, record.scenario
    side = _shown_side(record)
    wheels = []
    for number in range(contacts.wheelsets):
        at: dict[str, Any] = {"wheelset": number + 1} if contacts.has_several else {}
        at |= {"side": side} if contacts.has_sides else {}
        row = number * contacts.sides + (side == "right")
        wheels.append(
            {
                "x": float(contacts.position[row]), "static": float(contacts.static_force[row]),
                "y": frame.array(_wheel_height(history, at, number)), "force": frame.array(history.of(FORCE, at)),
                "rail": _optional(frame, history, "rail_displacement", at), "radius": _radius(scenario, number),
                "contact": row,
            }
        )  # fmt: skip
    return {
        "time": frame.array(history.time), "wheels": wheels, "bodies": list(_bodies(frame, record, history)),
        "deck": _optional(frame, history, "deck_displacement", {}), "track": _track(scenario),
        "side": side if contacts.has_sides else "",
    }  # fmt: skip


def _shown_side(record: Record) -> str:
    """Return the side whose wheels are drawn: the left one, unless only the right one meets an irregularity."""
    wheelsets = range(1, record._contacts.wheelsets + 1)
    met = {side: any(record.scenario.irregularities_on(one, side) for one in wheelsets) for side in ("left", "right")}
    return "right" if record._contacts.has_sides and met["right"] and not met["left"] else "left"


def _optional(frame: Frame, history: Part, name: str, at: dict[str, Any]) -> int | None:
    return frame.array(history.of(name, at)) if name in history.data else None


def _wheel_height(history: Part, at: dict[str, Any], number: int) -> FloatArray:
    """Return the height of a wheel's centre over that of the first touch, m."""
    if "wheel_displacement" in history.data:
        return history.of("wheel_displacement", at)
    below = history.of("indentation", at)
    height = history.of("constraint", at) - below  # of a wagon: a wheel is where its contact is
    if "rail_displacement" in history.data:
        height = height + np.nan_to_num(history.of("rail_displacement", at))
    return height


def _radius(scenario: Scenario, number: int) -> float:
    vehicle: Any = scenario.vehicle
    each = getattr(vehicle, "wheelsets", None) or getattr(vehicle, "axles", None)
    holder = each[number] if each is not None and len(each) > number else vehicle
    found: Any = getattr(holder, "radius", None) or getattr(vehicle, "radius", 0.46)
    return float(found)


def _bodies(frame: Frame, record: Record, history: Part) -> Iterator[dict[str, Any]]:
    """Return the bodies above the wheels: boxes of a wagon, the frame of a bogie."""
    vehicle: Any = record.scenario.vehicle
    if "frame" in history.data:
        x = record._contacts.position
        pitch = _optional(frame, history, "frame_pitch", {})
        size = {"x": float(x.mean()), "z": 0.65, "length": float(np.ptp(x)) + 0.9, "height": 0.18}
        yield size | {"name": "frame", "y": frame.array(history.of("frame", {})), "pitch": pitch}
    elif "body" in history.data:
        boxes = vehicle.boxes
        for name in history.axis("body"):
            if name not in boxes or name.startswith("wheelset"):
                continue
            (x, _, z), (length, _, height) = boxes[name]
            place = history.of("displacement", {"body": name, "motion": "z"})
            yield {
                "name": name, "x": float(x), "z": float(z), "length": float(length), "height": float(height),
                "y": frame.array(place - place[0]), "pitch": None,
            }  # fmt: skip


def _track(scenario: Scenario) -> dict[str, Any]:
    """Return what carries the rail: sleepers at their places, a deck with its ends, or rigid ground."""
    track: Any = scenario.track
    spacing = getattr(track, "spacing", None)
    if spacing is not None:
        ballast = bool(getattr(track, "under_pads", ()))
        return {"kind": "sleepers" if ballast else "slab", "spacing": spacing, "first": float(track.first_sleeper)}
    if hasattr(track, "bearing") or "mass" in type(track).model_fields:
        start, length = getattr(track, "start", None), getattr(track, "length", None)
        return {"kind": "deck", "start": start, "length": length}
    return {"kind": "stiff"}


def surface_key(record: Record) -> tuple[Any, ...]:
    """Return what the surfaces depend on: while it stays the same, they need not be sent again."""
    scenario, contacts = record.scenario, record._contacts
    radii = tuple(_radius(scenario, number) for number in range(contacts.wheelsets))
    return scenario.irregularity, scenario.speed, record.end, radii, contacts.position.tolist()


def surface_frame(record: Record) -> Frame:
    """Return the heights of the rail along the run, and the deviation of each wheel around its tread, m."""
    frame, scenario, contacts = Frame("surface"), record.scenario, record._contacts
    run, side = float(scenario.speed) * record.end, _shown_side(record)
    x = np.linspace(float(contacts.position.min()) - 1.0, run + 1.0, SURFACE)
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    rail, met, treads = np.zeros(len(x)), [], []
    for number in range(contacts.wheelsets):
        radius, tread = _radius(scenario, number), np.zeros(len(turn))
        for item in scenario.irregularities_on(number + 1, side):
            if item.borne == "wheel":
                tread += item.course(radius).value(radius * turn)
            elif item not in met:  # what one wheelset alone meets is drawn, too
                met.append(item)
                x, rail = _raised(x, rail, item.course(radius))
        treads.append(tread)
    frame.head |= {
        "x": frame.array(x), "rail": frame.array(rail), "turn": frame.array(turn),
        "wheels": [frame.array(tread) for tread in treads],
    }  # fmt: skip
    return frame


def _raised(x: FloatArray, rail: FloatArray, course: Any) -> tuple[FloatArray, FloatArray]:
    """Return places and heights with an irregularity more; places about its corners are added."""
    inner = [stretch.start for stretch in course.stretches if x[0] < stretch.start < x[-1]]
    extra = np.array([place for start in inner for place in (np.nextafter(start, -np.inf), start)])
    if len(extra) and len(extra) < SURFACE:
        joined = np.union1d(x, extra)
        x, rail = joined, np.interp(joined, x, rail)
    return x, rail + course.value(x)
