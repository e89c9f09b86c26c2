"""A rule for integrals over time with the force of a contact, from the logs of a march."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.general import layout
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.march import Found
from wheeltapper.march.general.replay import _rows_until
from wheeltapper.march.program import FloatArray


class Pressing(NamedTuple):
    """Rising times, s, forces, N, and weights, s: Σ weights·force·f(times) is the integral of force·f.

    The nodes are those at which the march has solved for the force, so that its singularities at losses and impacts do
    no harm.
    """

    times: FloatArray
    force: FloatArray
    weights: FloatArray


def pressing(found: Found, contact: int, end: float) -> Pressing:
    """Return the rule for a contact from the start up to a time, s."""
    rows, seconds = _rows_until(found, contact, end), found.prepared.grid.seconds
    counts = rows.rows[:, layout.ROW_NODES].astype(int)
    parts = [np.empty((3, 0))]
    for count in np.unique(counts[counts > 1]).tolist():
        some = counts == count
        times = (rows.rows[some][:, [layout.ROW_STEP]] + rows.theta[some, :count]) * seconds
        weights = gauss_nodes(count).weights * rows.pace[some, :count] * seconds
        force = rows.force[some, :count] * found.prepared.units.force
        parts.append(np.stack([times.ravel(), force.ravel(), weights.ravel()]))
    times, force, weights = np.concatenate(parts, axis=1)
    order = np.argsort(times, kind="stable")
    return Pressing(times[order], force[order], weights[order])
