"""Wheels that pass one after the other over one rail. Each pass starts with the surface that the last one left.

for each pass: speed, load and start, drawn where they scatter -> paths over the surface as it is -> march
               -> indentation at every sample -> how far each yields -> the surface after the pass
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wheeltapper.lower.lines.base import Drawn, Line
from wheeltapper.lower.marks.marks import Surface
from wheeltapper.march import run
from wheeltapper.march.common import program as contract

SHAKEDOWN = (4.7 / 2.8) ** 3
"""Force at the shakedown limit over that at first yield.

Largest pressures over the yield stress in shear: 2.8 at first yield, 4.7 at shakedown of a frictionless point contact.
Source: A. R. S. Ponter, A. D. Hearle and K. L. Johnson, Application of the kinematical shakedown theorem to rolling and
sliding point contacts, Journal of the Mechanics and Physics of Solids 33 (1985).
"""
LEAST_FACTOR = 0.05
"""Smallest ratio of a scattered speed or load to its mean. It keeps rare draws of a wide distribution positive."""


@dataclass(frozen=True)
class Scatter:
    """Scatter of the passes, and hardening of the surface.

    Attributes
    ----------
    hardening
        1: a place yields again only beyond its largest indentation so far. 0: it yields as early as a virgin one.
    speed, load
        Standard deviations over the mean.
    start
        Length, m, over which the starting places of the wheels, at rest, are spread evenly.
    seed
        Seed of the random numbers. The draws of pass n do not depend on the number of passes.
    """

    hardening: float = 1.0
    speed: float = 0.0
    load: float = 0.0
    start: float = 0.0
    seed: int = 0


class PassResult(NamedTuple):
    """Results of one pass."""

    status: int
    speed: float  # m/s
    applied_load: float  # N, without the wheelset's weight
    start: float  # m
    largest_force: float  # N
    impacts: int
    length: float  # m
    plastic_work: float  # J
    elastic: float  # shares of the length
    shakedown: float
    ratcheting: float


def drawn_pass(held: Scatter, number: int) -> Drawn:
    """Return a pass as it is drawn."""
    if not (held.speed or held.load or held.start):
        return Drawn(1.0, 1.0, 0.0)
    normal = np.random.default_rng([held.seed, number])
    speed, load = np.maximum(1.0 + normal.standard_normal(2) * (held.speed, held.load), LEAST_FACTOR).tolist()
    return Drawn(speed, load, float(held.start * normal.random()))


def after_pass(line: Line, scatter: Scatter, surface: Surface, number: int) -> tuple[Surface, PassResult]:
    """Return the surface after pass `number`, and the results of that pass."""
    drawn = drawn_pass(scatter, number)
    one = line.passing_over(surface, number, drawn, scatter.hardening)
    march = run.march(one.program)
    marks = one.pressed(march)
    pressures = np.concatenate([part for rail in marks for part in rail.pressures])
    elastic, beyond = float(np.mean(pressures <= 1.0)), float(np.mean(pressures > SHAKEDOWN))
    told = PassResult(
        march.status, one.speed, one.load, drawn.start,
        max(one.largest_force(march), float(pressures.max()) * one.yield_force),
        int((march.events[:, contract.EVENT_KIND] == contract.IMPACT).sum()), one.length,
        float(sum(rail.work for rail in marks)), elastic, 1.0 - elastic - beyond, beyond,
    )  # fmt: skip
    return line.joined([rail.left() for rail in marks]), told
