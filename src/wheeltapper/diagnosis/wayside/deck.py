"""The deck's model for axles of a train: its acceleration is cut by the times at which the axles are on the deck."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.diagnose import diagnose
from wheeltapper.diagnosis.processes import in_processes
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


def with_deck(
    train: TrainFinding, deck: Recording, site: Site, which: Diagnosed, workers: int | None
) -> TrainFinding:  # fmt: skip
    """Return a train whose axles have the finding of the deck's model, as `model`; notes say which could have none.

    A recording is that of one wheelset from its arrival at x = 0 to the next one's.
    """
    entries = [dict(axle) for axle in train.axles]
    order = np.argsort([axle["time"] for axle in entries], kind="stable").tolist()
    ends = [*(entries[i]["time"] for i in order[1:]), np.inf]
    said: dict[int, str] = {}
    parts: dict[int, Recording] = {}
    for i, end in zip(order, ends, strict=True):
        entry = entries[i]
        if which == "suspicious" and entry["verdict"] == QUIET and not train.alarms_at(i + 1):
            continue
        part = _cut(deck, entry["time"], min(end, entry["time"] + float(site.passage.duration)), entry["speed"])
        if part is None:
            said[i] = "too little of the deck's recording is of it alone; no model is compared"
        else:
            parts[i] = part
    cut = [*parts]
    with closing(in_processes(_told_or_why_not, site, [parts[i] for i in cut], workers)) as done:
        for number, told in done:
            i = cut[number]
            if isinstance(told, dict):
                entries[i]["model"] = told
            else:
                said[i] = f"the deck's model is not compared: {told}"
    notes = [f"axle {i + 1}: {said[i]}" for i in order if i in said]
    if any("model" in entry for entry in entries):
        notes.append("model: of the deck under one wheelset; what the axles before it left in the deck is not in it")
    return replace(train, axles=tuple(entries), notes=(*train.notes, *notes))


def _told_or_why_not(site: Site, part: Recording) -> dict[str, Any] | InputError:
    try:
        return diagnose(part, site, progress=False).to_dict()
    except InputError as error:
        return error


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
