"""The energy of the wheels' contacts in a general march: what they store, and what their material takes."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.plastic_law import stretch_of
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general.integrals import solved_parts
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.march import Found, law_row, table_of
from wheeltapper.march.general.replay import factors_along, replay, surface_along
from wheeltapper.march.general.tables import Units

NODES, PARTS = 16, 4
"""Of Gauss's rule for the work of pressing a contact, in parts between kinks of its law."""


def contact_energies(found: Found, end: float) -> tuple[FloatArray, float]:
    """Return the elastic energy of all contacts at the start and at an end, and what their material took, J.

    The elastic energy is the work of pressing the contact slowly as deep as it is. Of what a force does beyond its
    elastic part the material takes all, and all elastic energy where an indentation recovers without a force.
    """
    stored, taken, speed = np.zeros(2), 0.0, found.prepared.system.speed
    for i, wheel in enumerate(found.prepared.system.wheels):
        row, table = law_row(wheel, Units(1.0, 1.0), 0), table_of(wheel)
        stored += (own := _energy_at(np.array([0.0, end]), found, i, row, table))
        if not row[switch.LAW_RATED]:
            continue
        for part in solved_parts(found, i, end):
            factor = factors_along(wheel, wheel.start + speed * part.times.ravel())
            elastic = _forces(part.delta.ravel(), row, table, factor).reshape(part.force.shape)
            taken += float((part.weights * (part.force - elastic) * part.slope).sum())
        events = found.events[
            (found.events[:, contract.EVENT_CONTACT] == i) & (found.events[:, contract.EVENT_TIME] < end)
        ]
        freed = np.where(events[:, contract.EVENT_KIND] == contract.LOSS, 1.0, -1.0)
        taken += float(freed @ _energy_at(events[:, contract.EVENT_TIME], found, i, row, table)) if len(freed) else 0.0
        taken -= float(own[1]) if len(freed) and freed[-1] > 0.0 else 0.0
    return stored, taken


def _energy_at(times: FloatArray, found: Found, i: int, row: FloatArray, table: FloatArray) -> FloatArray:
    """Return the elastic energy of a contact at some times."""
    wheel, delta = found.prepared.system.contacts[i], replay(found, times).indentation[:, i]
    x = wheel.start + found.prepared.system.speed * times
    surface = np.zeros(len(x)), np.full(len(x), np.inf)
    if row[switch.LAW_KIND] == switch.PLASTIC:
        surface = surface_along(wheel, x)
    return _pressing_work(delta, row, table, factors_along(wheel, x), *surface)


def _pressing_work(
    delta: FloatArray, row: FloatArray, table: FloatArray, factor: FloatArray, left: FloatArray, bears: FloatArray
) -> FloatArray:
    """Return the work of pressing a contact to some indentations; in √δ its forces are smooth at touch."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    parts = (np.arange(PARTS)[:, None] + 0.5 * (nodes + 1.0)).ravel() / PARTS
    weights = np.tile(weights, PARTS) / PARTS  # times 2·√share, of the derivative
    out = np.zeros(len(delta))
    for i, (depth, most) in enumerate(zip(delta, bears, strict=True)):
        for begin, until in ((0.0, min(depth, most)), (most, depth)):
            if until > begin or begin == 0.0:
                at = begin + (until - begin) * parts**2
                force = _forces(at, row, table, np.full(at.shape, factor[i]), left[i], most)
                out[i] += (until - begin) * (weights * parts) @ force
    return out


def _forces(
    delta: FloatArray, row: FloatArray, table: FloatArray, factor: FloatArray, left: float = 0.0, bears: float = np.inf
) -> FloatArray:
    """Return the forces of indentations at rest, N."""
    out, stretch = np.zeros(len(delta)), np.zeros(len(delta))
    if row[switch.LAW_KIND] == switch.PLASTIC:
        stretch = np.array([stretch_of(one, left, bears, row, table) for one in delta])
    for one in np.unique(stretch):
        some = np.flatnonzero(stretch == one)
        rate, N, slope, viscous = np.zeros((4, len(some)))
        share, residual = factor[some] if one == 0.0 else np.ones(len(some)), np.full(len(some), left)
        switch.forces(row, table, one, len(some), delta[some], rate, residual, share, N, slope, viscous)
        out[some] = N
    return out
