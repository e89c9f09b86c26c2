"""Anomalies of a track as numbers: what seats of its ring have beyond the others, and voids under sleepers."""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.track.responses import BALLAST, PAD, Extra
from wheeltapper.lower.track.section import Section, section_of

FloatArray = NDArray[np.float64]
BESIDE = 5
"""Seats before and behind the wheels' way at which an anomaly may still be."""


class Void(NamedTuple):
    """Ballast below a gap: number of the seat, gap in m, stiffness in N/m, damping in N·s/m."""

    seat: int
    gap: float
    stiffness: float
    damping: float


class Anomalies(NamedTuple):
    """What is not regular on a ring; seats count from 0 to its bays - 1, at voids as the user counts them."""

    extras: tuple[Extra, ...]
    voids: tuple[Void, ...]


NONE = Anomalies((), ())


def anomalies_of(track: SupportedRail, section: Section, bays: int) -> Anomalies:
    """Return the anomalies of a track on a ring of some bays.

    Raises
    ------
    InputError
        If a seat has neither pad nor ballast, or two that are named are one on the ring.
    """
    pads, ballasts, gaps = [1.0] * bays, [1.0] * bays, dict[int, float]()
    numbers = dict[int, int]()
    for i, item in enumerate(track.anomalies):
        named = item.places
        seats = range(min(named), max(named) + 1) if named else range(-(bays // 4), bays - bays // 4)
        for change in item.changes(seats):
            place = change.seat % bays
            if named and numbers.setdefault(place, change.seat) != change.seat:
                found = f"{change.seat}, which is seat {numbers[place]} again on a ring of {bays} bays"
                raise InputError("", f"track.anomalies.{i}.seat", found, "another seat, or more bays")
            pads[place] *= change.pad
            ballasts[place] *= change.ballast
            if change.void is not None:
                gaps[place] = change.void
    extras, voids = list[Extra](), list[Void]()
    for place, (pad, ballast) in enumerate(zip(pads, ballasts, strict=True)):
        carried = 0.0 if place in gaps else ballast
        if section.sleeper > 0.0 and pad == carried == 0.0:
            found = f"neither pad nor ballast at seat {numbers[place]}"
            raise InputError("", "track.anomalies", found, "a sleeper that something holds")
        if place in gaps:
            stiffness, damping = ballast * section.ballast, ballast * section.ballast_damping
            voids.append(Void(numbers[place], gaps[place], stiffness, damping))
        for kind, factor, stiffness, damping in (
            (PAD, pad, section.pad, section.pad_damping), (BALLAST, carried, section.ballast, section.ballast_damping)
        ):  # fmt: skip
            if factor != 1.0:
                extras.append(Extra(place, kind, (factor - 1.0) * stiffness, (factor - 1.0) * damping))
    return Anomalies(tuple(extras), tuple(voids))


def linear_extras(track: SupportedRail, section: Section) -> tuple[Extra, ...]:
    """Return what single seats of the infinite track have beyond the others.

    Raises
    ------
    InputError
        If that is not all: where seats scatter all along, or a void makes the track nonlinear.
    """
    for i, item in enumerate(track.anomalies):
        name, field = type(item).__name__, f"track.anomalies.{i}"
        allowed = "a missing pad, or a sleeper without ballast: others are asked by a run"
        if not item.places:
            raise InputError("", field, f"a {name} of all seats of a track without end", allowed)
        if any(change.void is not None for change in item.changes(range(item.places[0], item.places[-1] + 1))):
            raise InputError("", field, f"a {name} over a void, which is not linear", allowed)
    if not track.anomalies:
        return ()
    seats = [seat for item in track.anomalies for seat in item.places]
    first, bays = min(seats), max(seats) - min(seats) + 1
    found = anomalies_of(track, section, bays).extras
    return tuple(extra._replace(seat=first + (extra.seat - first) % bays) for extra in found)


def check_seats(track: SupportedRail, bays: int, first: float, last: float) -> tuple[Note, ...]:
    """Return notes on how anomalies recur; wheels go over the places from `first` to `last`, m from seat 0.

    Raises
    ------
    InputError
        If no wheel comes near an anomaly.
    """
    if not track.anomalies:
        return ()
    before, behind = round(first / track.spacing) - BESIDE, round(last / track.spacing) + BESIDE
    again = last - first > bays * track.spacing
    for i, item in enumerate(track.anomalies):
        for seat in item.places:
            if not before <= seat <= behind:
                found = f"{seat}, at x = {seat * track.spacing + track.first_sleeper:.4g} m"
                raise InputError(
                    "", f"track.anomalies.{i}.seat", found, f"{before} to {behind}, near the way of the wheels"
                )
            images = [number for number in range(before, behind + 1) if (number - seat) % bays == 0]
            again = again or len(images) > 1
    length = bays * track.spacing
    text = f"the track is computed as a closed ring of {bays} bays: its anomalies come again every {length:.4g} m"
    if again:
        needed = ceil((last - first) / track.spacing) + 2 * BESIDE + 1
        text += f", and wheels meet some of them again on their way of {last - first:.4g} m; set track.bays = {needed}"
    return (Note(text, "anomalies", (last - first) / length, doubtful=again),)


def voids_of(track: SupportedRail, bays: int, rolling: bool = False) -> tuple[Void, ...]:
    """Return the voids below the sleepers, as one rail's half of each feels them; `rolling`: where sleepers roll."""
    return anomalies_of(track, section_of(track, rolling=rolling and track.rolls), bays).voids


def arms_of(track: SupportedRail, bays: int) -> FloatArray:
    """Return how far out the ballast below each void is where sleepers roll, in distances of the rails."""
    bounce, roll = (np.array([void.stiffness for void in voids_of(track, bays, rolling)]) for rolling in (False, True))
    return np.asarray(np.sqrt(roll / bounce))
