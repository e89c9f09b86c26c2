"""The deck's model for axles of a train: its acceleration is cut by the times at which the axles are on the deck."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.diagnose import diagnose
from wheeltapper.diagnosis.train import TrainFinding
from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.recording import Recording

Diagnosed = Literal["none", "suspicious", "all"]
DIAGNOSED: tuple[Diagnosed, ...] = ("none", "suspicious", "all")
"""Axles that are diagnosed with the deck's model; suspicious: those with strikes, an alarm, or without a force."""
BEFORE = 0.02
"""How much of the recording before an axle's arrival is kept, s."""
SHORTEST = 0.05
"""The next axle must be at least so far away, s, that one wheelset's model may hold."""
QUIET = "no strikes"


def with_deck(train: TrainFinding, deck: Recording, site: Site, which: Diagnosed) -> TrainFinding:
    """Return a train whose axles have the finding of the deck's model, as `model`; notes say which could have none.

    A recording is that of one wheelset from its arrival at x = 0 to the next one's.
    """
    entries, notes = [dict(axle) for axle in train.axles], []
    order = np.argsort([axle["time"] for axle in entries], kind="stable")
    times = np.array([entries[i]["time"] for i in order])
    for place, i in enumerate(order):
        number, entry = int(i) + 1, entries[i]
        if which == "suspicious" and entry["verdict"] == QUIET and not train.alarms_at(number):
            continue
        ends = times[place + 1] if place + 1 < len(times) else np.inf
        part = _cut(deck, times[place], min(ends, times[place] + float(site.passage.duration)), entry["speed"])
        if part is None:
            notes.append(f"axle {number}: too little of the deck's recording is of it alone; no model is compared")
            continue
        try:
            entry["model"] = diagnose(part, site, progress=False).to_dict()
        except InputError as error:
            notes.append(f"axle {number}: the deck's model is not compared: {error}")
    if any("model" in entry for entry in entries):
        notes.append("model: of the deck under one wheelset; what the axles before it left in the deck is not in it")
    return replace(train, axles=tuple(entries), notes=(*train.notes, *notes))


def _cut(deck: Recording, begins: float, ends: float, speed: float) -> Recording | None:
    """Return the recording of an axle, with its arrival as time zero; None if it is too short."""
    first, last = (int(np.ceil((time - deck.start) * deck.rate)) for time in (begins - BEFORE, ends))
    first, last = max(first, 0), min(last, len(deck.samples))
    if last - first < (BEFORE + SHORTEST) * deck.rate:
        return None
    return replace(
        deck, samples=deck.samples[first:last], clipped=deck.clipped[first:last], speed=speed,
        start=deck.start + first / deck.rate - begins,
    )  # fmt: skip


def deck_recording(recordings: Mapping[str, Any], site: Site) -> Recording | None:
    """Return the recording of the deck's sensor, if there is one."""
    found = recordings.get(site.sensor.name) if site.sensor.name else None
    if found is not None and (not isinstance(found, Recording) or found.quantity != site.sensor.kind):
        allowed = f"a Recording of the {site.sensor.kind}"
        raise InputError("", f"recordings.{site.sensor.name}", f"{found!r}"[:80], allowed)
    return found
