"""Where a vehicle runs steadily on level rails: the state in which nothing accelerates, by Newton's method."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError
from wheeltapper.march import assembly as contract
from wheeltapper.march.assembly import PLACES, RATE, Assembly
from wheeltapper.march.multibody import probe

if TYPE_CHECKING:
    from wheeltapper.lower.wagon import Layout

FloatArray = NDArray[np.float64]


def jacobian(assembly: Assembly, state: FloatArray, unknown: NDArray[np.int64], steps: FloatArray) -> FloatArray:
    """Return the derivatives of all rates by some states, (states, unknown), by central differences."""
    moved = np.repeat(state[None], 2 * len(unknown), axis=0)
    for i, (place, step) in enumerate(zip(unknown, steps, strict=True)):
        moved[2 * i, place] += step
        moved[2 * i + 1, place] -= step
    found = probe(assembly, moved)
    return np.asarray(((found[0::2] - found[1::2]) / (2.0 * steps[:, None])).T)


def unknowns(layout: Layout, assembly: Assembly, free: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the states that a steady run may choose, and the rates that are then zero."""
    places = layout.places
    moving = np.any(free != 0.0, axis=1)
    spins = np.array([motion == "pitch" and body.startswith("wheelset ") for body, motion in layout.motions])
    chosen = np.where(spins, places + RATE, places)
    inside = np.arange(layout.states, len(assembly.start))
    used = inside[: int((assembly.element_inside[:, 0] >= 0).sum())]
    return np.concatenate([chosen[moving], used]), np.concatenate([places[moving] + RATE, used])


def standing(assembly: Assembly, layout: Layout, mobility: FloatArray, tolerance: float = 1e-11) -> FloatArray:
    """Return the state of a steady run.

    Raises
    ------
    InputError
        If none is found: the vehicle does not stand on its wheels.
    """
    indentation = assembly.numbers[contract.LENGTH]
    chosen, zero = unknowns(layout, assembly, mobility)
    moving = np.any(mobility != 0.0, axis=1)
    # what the ties allow: the range of the mobility
    values, vectors = np.linalg.eigh(mobility[np.ix_(moving, moving)])
    allowed = vectors[:, values > 1e-9 * values.max()]
    count = len(chosen) - int(moving.sum())
    basis = np.block([[allowed, np.zeros((len(allowed), count))], [np.zeros((count, allowed.shape[1])), np.eye(count)]])
    state = assembly.start.copy()
    upright = np.array([motion == "z" and body != "deck" for body, motion in layout.motions])
    state[layout.places[upright]] = -indentation
    steps = np.full(len(chosen), 1e-5 * indentation)
    steps[chosen % PLACES >= RATE] = 1e-6
    for _ in range(60):
        rate = probe(assembly, state[None])[0, zero]
        change = basis @ np.linalg.lstsq(jacobian(assembly, state, chosen, steps)[zero] @ basis, -rate, rcond=1e-14)[0]
        largest = np.abs(change).max()
        change *= min(1.0, 1e-3 / max(largest, 1e-300))
        state[chosen] += change
        if largest < tolerance * indentation:
            break
    else:
        raise InputError(
            "", "vehicle", "no state in which it stands on its wheels", "a vehicle that its elements support"
        )
    return state
