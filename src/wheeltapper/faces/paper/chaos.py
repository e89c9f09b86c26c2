"""Bouncing at the resonance is chaotic: what ten runs of a stated spread do is counted, and no single run is pinned."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import cycle
from typing import NamedTuple, TypeVar

import numpy as np

from wheeltapper.faces.paper.claims import Case, Measure, said

RUNS = 10
SPREAD = (8.9, 9.1)
"""Speeds, m/s, from which those of the runs are drawn evenly; the rail rises first in every other run."""
WAVES = 100
"""Length of a run, waves."""
AMPLITUDE = 50e-6
RATE = 5e3
"""Samples per second from which heights are read; a bounce of 1 mm is missed by less than 1 µm."""
HIGH = 1e-3
"""The height of 1 mm that the paper tells."""
DRAWN = f"of {RUNS} runs at {SPREAD[0]:g} to {SPREAD[1]:g} m/s, {WAVES} waves each"


Done = TypeVar("Done")


class Run(NamedTuple):
    """What one run does."""

    leaves: float
    """Waves from the start of the corrugation to the first loss of contact."""
    largest: float
    """Largest normal force over the static one."""
    is_high: bool
    """Whether the wheel comes 1 mm above its rest."""
    rises_first: bool


def drawn_runs(
    run: Callable[[float, float], Done], seed: int = 0, spread: tuple[float, float] = SPREAD
) -> list[Done]:  # fmt: skip
    """Return what runs of drawn speeds do; `run` takes speed and amplitude, negative if the rail falls first."""
    speeds = np.random.default_rng(seed).uniform(*spread, RUNS).tolist()
    return [run(speed, amplitude) for speed, amplitude in zip(speeds, cycle((AMPLITUDE, -AMPLITUDE)), strict=False)]


def count_forces(runs: list[Run], case: Case, refutes: bool = False) -> Measure:
    """Return the measure of how many runs have several times the static force."""
    share = np.mean([one.largest >= 3.0 for one in runs])
    where = "section 5, Fig. 7: several times the static load"
    return said("in most cases", where, f"share above 3 N0 {DRAWN}", float(share), refutes, case)


def count_heights(runs: list[Run], case: Case, refutes: bool = False) -> Measure:
    """Return the measure of how many runs reach 1 mm."""
    share = np.mean([one.is_high for one in runs])
    where = "section 5, Fig. 7: as high as 1 mm and even more"
    return said("in most cases", where, f"share above 1 mm {DRAWN}", float(share), refutes, case)


RISES = Case("the rail rises first")
FALLS = Case("the rail falls first, as printed")


def count_leaving(runs: list[Run]) -> Iterator[Measure]:
    """Yield the measures of how many runs leave the rail within half a period, by the sign of the first wave."""
    for case in (RISES, FALLS):
        ones = [one.leaves <= 0.5 for one in runs if one.rises_first == (case is RISES)]
        words, where = f"share that leaves within half a period {DRAWN}", "section 5, Fig. 7: within half of the period"
        yield said("in most cases", where, words, float(np.mean(ones)), case is FALLS, case)
