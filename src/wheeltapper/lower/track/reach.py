"""How many modes stand for an infinite track: cut-off and length of the ring, from the accuracy and from its waves.

A ring of M bays is an infinite track under equal trains M·a apart. What a wheel feels of its images is what the slowest
wave still is after M·a. Its mean square over the frequencies up to `HEARD`, and its value at rest, set the length
(docs/theory/track.rst, section 13.5).
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil
from typing import NamedTuple

import numpy as np

from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.notes import Note
from wheeltapper.lower.track import bay, waves
from wheeltapper.lower.track.anomalies import anomalies_of
from wheeltapper.lower.track.irregular import IrregularModes, irregular_ring
from wheeltapper.lower.track.ring import TrackModes, ring_of
from wheeltapper.lower.track.section import Section, section_of


class Accuracy(NamedTuple):
    """What is asked of a ring.

    Attributes
    ----------
    cutoff
        Hz.
    fewest
        Bays.
    image
        Largest share that returns from the image; see `image_level`.
    """

    cutoff: float
    fewest: int
    image: float


ACCURACIES = {"default": Accuracy(5000.0, 80, 3e-3), "strict": Accuracy(8000.0, 100, 1e-3)}
HEARD = 2000.0
"""Hz; faster waves decay within a few bays, or carry little."""
MOST_BAYS = 400
"""That a ring is given without being asked for; the time of a march rises with them."""
MOST_UNKNOWNS = 2000
"""Of a ring with anomalies that is given without being asked for; the time of its eigenvectors rises with their cube.
"""
SECONDS = 2e-9
"""Time that a ring with anomalies takes over the cube of its unknowns, s."""
LONGEST = 300.0
"""Time that a ring with anomalies may take, s."""
BYTES = 300.0
"""Memory of a ring with anomalies over the square of its unknowns: its eigenvectors, and its shapes in each element."""
SAMPLE = 20
"""Bays whose modes are counted for those of more."""
HEADROOM = 2.0
"""Modes are needed up to so many times the highest frequency of an excitation."""


class Reach(NamedTuple):
    """Cut-off and length of a ring.

    Attributes
    ----------
    cutoff
        Hz.
    bays
        Number of bays.
    image
        What returns from the image, relative to what leaves the wheel; see `image_level`.
    notes
        What the user should know of them.
    """

    cutoff: float
    bays: int
    image: float
    notes: tuple[Note, ...]


def image_level(section: Section, length: float) -> float:
    """Return what the slowest wave still is after a length, m.

    It is the root of its mean square over the frequencies up to `HEARD`, or its value at rest, if that is larger.
    """
    left = 10.0 ** (-0.05 * length * _decays(section)[1])
    return float(max(np.sqrt(np.mean(left[1:] ** 2)), left[0]))


@lru_cache(maxsize=64)
def _decays(section: Section) -> tuple[waves.FloatArray, waves.FloatArray]:
    """Return frequencies from 0, Hz, and the decay at them, dB/m; without those at which it is lost in rounding."""
    frequencies = np.linspace(0.0, HEARD, 401)
    known = waves.growth(section, 2.0 * np.pi * frequencies) < waves.MOST_GROWTH
    known[0] = True
    return frequencies[known], np.maximum(waves.decay(section, 2.0 * np.pi * frequencies[known]), 0.0)


def reach_of(track: SupportedRail, accuracy: str = "default", extent: float = 0.0) -> Reach:
    """Return cut-off and bays for a track: those that it names itself, else what the accuracy asks for.

    Parameters
    ----------
    track
        The track.
    accuracy
        "default" or "strict".
    extent
        Distance from the first to the last wheel, m, by which the ring is longer.

    Raises
    ------
    InputError
        If a ring of so many bays does not fit into memory, or is shorter than the vehicle.
    """
    asked, section = ACCURACIES[accuracy], section_of(track)
    cutoff = asked.cutoff if track.cutoff is None else track.cutoff
    if track.bays is not None:
        bays = track.bays
        check_bays(section, bays, cutoff)
        if bays * track.spacing <= 2.0 * extent:
            found = f"{bays} bays, a ring of {bays * track.spacing:.4g} m, under wheels up to {extent:.4g} m apart"
            raise InputError("", "track.bays", found, f"more than {2.0 * extent / track.spacing:.0f}, or none")
    else:
        most = int(MOST_UNKNOWNS / unknowns_per_bay(section, cutoff)) if track.anomalies else MOST_BAYS
        bays = ceil(extent / track.spacing) + _bays_for(section, asked, most)
    if track.anomalies:
        _check_time(section, bays, cutoff)
    length = bays * track.spacing - extent
    image = image_level(section, length)
    notes = () if image <= asked.image else (_image_note(section, asked, length, image, extent),)
    return Reach(cutoff, bays, image, notes)


def modes_of(
    track: SupportedRail, accuracy: str = "default", extent: float = 0.0
) -> tuple[TrackModes | IrregularModes, Reach]:
    """Return the ring that stands for a track, with its anomalies, and how it was chosen."""
    reach = reach_of(track, accuracy, extent)
    return _modes(track, section_of(track), reach), reach


def rolling_modes_of(track: SupportedRail, reach: Reach) -> TrackModes | IrregularModes:
    """Return the ring of such a reach that stands for a track whose rails move against one another."""
    return _modes(track, section_of(track, rolling=True), reach)


def _modes(track: SupportedRail, section: Section, reach: Reach) -> TrackModes | IrregularModes:
    extras = anomalies_of(track, section, reach.bays).extras
    if not extras:
        return ring_of(section, reach.bays, reach.cutoff)
    return irregular_ring(section, reach.bays, reach.cutoff, extras)


def _bays_for(section: Section, asked: Accuracy, most: int) -> int:
    """Return the fewest bays whose image is quiet enough; the most that are given where none is."""
    few, many = asked.fewest, max(most, asked.fewest)
    if image_level(section, few * section.spacing) <= asked.image:
        return few
    while many - few > 1:  # the level falls with the length
        middle = (few + many) // 2
        quiet = image_level(section, middle * section.spacing) <= asked.image
        few, many = (few, middle) if quiet else (middle, many)
    return many


def check_bays(section: Section, bays: int, cutoff: float) -> None:
    """Refuse more bays than memory."""
    unknowns = 2 * bay.DEGREE * bay.element_count(section, cutoff) + 1
    needed = (bays // 2 + 1) * 200.0 * unknowns**2  # bytes: the eigenproblem and its vectors, two by two and complex
    check_room("track.bays", f"a ring of {bays} bays", needed, lambda share: f"at most {int(share * bays)} bays")


@lru_cache(maxsize=64)
def unknowns_per_bay(section: Section, cutoff: float) -> float:
    """Return how many real unknowns a bay adds to a ring with anomalies."""
    return 2.0 * len(ring_of(section, SAMPLE, cutoff).ring.rates) / SAMPLE


def _check_time(section: Section, bays: int, cutoff: float) -> None:
    """Refuse a ring with anomalies that takes very long, or more than memory."""
    each = unknowns_per_bay(section, cutoff)
    seconds, most = SECONDS * (each * bays) ** 3, (LONGEST / SECONDS) ** (1.0 / 3.0) / each
    found = f"a ring of {bays} bays with anomalies and modes up to {cutoff:.4g} Hz"
    if seconds > LONGEST:
        allowed = f"at most {int(most)} bays, {LONGEST / 60.0:.0f} minutes, or a lower cutoff"
        raise InputError("", "track.bays", f"{found}, some {seconds / 60.0:.0f} minutes of computing", allowed)
    needed = BYTES * (each * bays) ** 2
    check_room("track.bays", found, needed, lambda share: f"at most {int(share**0.5 * bays)} bays, or a lower cutoff")


def _image_note(section: Section, asked: Accuracy, length: float, image: float, extent: float) -> Note:
    frequencies, decays = _decays(section)
    slowest, frequency = float(decays.min()), float(frequencies[decays.argmin()])
    needed = length
    while image_level(section, needed) > asked.image and needed < 1e5:
        needed *= 1.2
    bays = f"set track.bays = {ceil((needed + extent) / section.spacing)}" if needed < 1e5 else "no ring is long enough"
    return Note(
        f"the track is computed as a closed ring of {length + extent:.4g} m, too short for waves of {frequency:.4g} "
        f"Hz, which decay by {slowest:.3g} dB/m only: {100 * image:.2g} % of them come round it to the wheels again, "
        f"as from a second train ({100 * asked.image:.2g} % are allowed); {bays}",
        "length of the ring", image, doubtful=image > 0.1,
    )  # fmt: skip


def critical_speed(section: Section) -> float:
    """Return the speed at which waves of the rail on an even foundation travel along with the load, m/s.

    (4·k·EI/m²)^¼ of Euler's beam on Winkler's foundation, k the stiffness of a seat over the spacing.
    """
    return float((4.0 * section.seat / section.spacing * section.bending / section.mass**2) ** 0.25)


def cutoff_note(reach: Reach, frequency: float) -> Note | None:
    """Return a note where an excitation, up to a frequency in Hz, asks for more modes than are kept; else None."""
    if HEADROOM * frequency <= reach.cutoff:
        return None
    return Note(
        f"the irregularity excites the track up to {frequency:.4g} Hz, but its modes are computed only up to "
        f"{reach.cutoff:.4g} Hz: faster motion is missing; set track.cutoff = {HEADROOM * frequency:.4g} Hz",
        "cut-off of the track", frequency / reach.cutoff, doubtful=frequency > reach.cutoff,
    )  # fmt: skip
