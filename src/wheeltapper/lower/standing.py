"""The steady run of a vehicle on level rails: the state without accelerations, by Newton's method."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.wagon import TREADS_APART
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.laws.plastic import virgin_pieces
from wheeltapper.lower.paths.table import blank_rows
from wheeltapper.march.common.law_columns import PLASTIC_ONSET
from wheeltapper.march.common.program import PIECE_COLUMNS, STOP
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import HALF, LANES, PLACES, TO_RATE, Assembly
from wheeltapper.march.wagon.multibody import start_rates
from wheeltapper.march.wagon.wheel_rows import NORMAL, ROW_PATH

if TYPE_CHECKING:
    from wheeltapper.lower.lowered.wagon import StateLayout

FloatArray = NDArray[np.float64]
STANDING = 1e-3
"""Largest vertical acceleration of a wheelset that stands, m/s²; one that hangs in the air falls."""
_ENDLESS = np.where(np.arange(PIECE_COLUMNS) == STOP, np.inf, 0.0)


def jacobian(assembly: Assembly, state: FloatArray, unknown: NDArray[np.int64], steps: FloatArray) -> FloatArray:
    """Return the derivatives of all rates with respect to some states, (states, unknown), by central differences."""
    moved = np.repeat(state[None], 2 * len(unknown), axis=0)
    for i, (place, step) in enumerate(zip(unknown, steps, strict=True)):
        moved[2 * i, place] += step
        moved[2 * i + 1, place] -= step
    found, _ = start_rates(assembly, moved)
    return np.asarray(((found[0::2] - found[1::2]) / (2.0 * steps[:, None])).T)


def unknown_states(
    layout: StateLayout, assembly: Assembly, free: FloatArray
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the unknown states of a steady run, and the rates that have to be zero."""
    places = layout.displacement_places
    moving = np.any(free != 0.0, axis=1)
    spins = np.array([motion == "pitch" and body.startswith("wheelset ") for body, motion in layout.motions])
    chosen = np.where(spins, places + TO_RATE, places)
    inside = np.arange(layout.state_count, len(assembly.start))
    used = inside[: int((assembly.element_inside >= 0).sum())]
    return np.concatenate([chosen[moving], used]), np.concatenate([places[moving] + TO_RATE, used])


def level_assembly(assembly: Assembly, layout: StateLayout) -> Assembly:
    """Return the assembly on level rails and off the deck, with a start state."""
    lanes = assembly.lanes.copy()
    lanes[:, [asm.FIRST_PIECE, asm.LAST_PIECE]] = 0.0
    lanes[:, asm.PATH_LOOP] = 1.0
    lanes[:, [asm.WHEEL_DECK_FROM, asm.WHEEL_DECK_TO]] = np.inf
    start = np.zeros_like(assembly.start)
    upright = np.array([motion == "z" and body != "deck" for body, motion in layout.motions])
    start[layout.displacement_places[upright]] = -assembly.numbers[asm.STATIC_INDENTATION]
    level = blank_rows(1) + _ENDLESS
    if assembly.numbers[asm.CONTACT_LAW] == asm.PLASTIC_TREADS:
        level = virgin_pieces(level, float(assembly.numbers[asm.YIELD_LAW + PLASTIC_ONSET]))
    return assembly._replace(lanes=lanes, pieces=level, start=start)


def normal_forces(assembly: Assembly, state: FloatArray, wheelsets: int) -> FloatArray:
    """Return the normal forces of the treads in a state at time zero, N, (wheelsets, 2): left, right."""
    return _of_treads(assembly, state, NORMAL, wheelsets)


def _of_treads(assembly: Assembly, state: FloatArray, row: int, wheelsets: int) -> FloatArray:
    """Return a row of the treads' contacts in a state at time zero, (wheelsets, 2): left, right."""
    _, wheels = start_rates(assembly, state[None])
    octets = int(assembly.numbers[asm.TREADS])
    lanes = wheels[:octets, row : row + LANES].reshape(octets, 2, HALF)
    return np.asarray(np.swapaxes(lanes, 1, 2).reshape(-1, 2)[:wheelsets])


def standing_on(
    assembly: Assembly, layout: StateLayout, mobility: FloatArray, positions: tuple[float, ...]
) -> FloatArray:  # fmt: skip
    """Return the state of a steady run on the rails under the wheels at time zero; wheelsets begin at `positions`, m.

    Raises
    ------
    InputError
        If none is found, although there is one on level rails: an irregularity under a wheel prevents it.
    """
    heights = _of_treads(assembly, assembly.start, ROW_PATH, len(positions))
    found = _steady_if_any(assembly, layout, mobility)
    if found is None and heights.any():  # above a dip nothing tells a wheel of it: its spring is the contact
        found = _steady_if_any(_beside(assembly, layout, heights), layout, mobility)
    if found is not None:
        return found
    wheelset, side = (int(i) for i in np.unravel_index(np.argmax(np.abs(heights)), heights.shape))
    if heights[wheelset, side] == 0.0:
        return steady_state(assembly, layout, mobility)  # which says that there is none
    where = f"under wheelset {wheelset + 1} {('left', 'right')[side]}, at x = {positions[wheelset]:g} m"
    raise InputError(
        "", "irregularity", f"{1e3 * heights[wheelset, side]:.4g} mm {where}, on which the vehicle cannot stand",
        "irregularities that begin ahead of the wheels",
    )  # fmt: skip


def _steady_if_any(assembly: Assembly, layout: StateLayout, mobility: FloatArray) -> FloatArray | None:
    """Return the state of a steady run in which no wheelset falls; None if none is found from the present start."""
    try:
        found = steady_state(assembly, layout, mobility)
    except InputError:
        return None
    return None if _falls(assembly, layout, mobility, found) else found


def _falls(assembly: Assembly, layout: StateLayout, mobility: FloatArray, state: FloatArray) -> bool:
    """Return whether any wheelset accelerates vertically in a state, as in none that is steady."""
    rate = start_rates(assembly, state[None])[0][0]
    moving = np.any(mobility != 0.0, axis=1) & _of_wheelsets(layout, "z")
    return bool((np.abs(rate[layout.displacement_places[moving] + TO_RATE]) > STANDING).any())


def _of_wheelsets(layout: StateLayout, along: str) -> NDArray[np.bool_]:
    """Return which motions are those of wheelsets along an axis, wheelset by wheelset."""
    return np.array([motion == along and body.startswith("wheelset ") for body, motion in layout.motions])


def _beside(assembly: Assembly, layout: StateLayout, heights: FloatArray) -> Assembly:
    """Return the assembly with a start state in which the wheelsets follow the paths' heights, (wheelsets, 2), m."""
    start = assembly.start.copy()
    rolls = (heights[:, 0] - heights[:, 1]) / TREADS_APART
    for along, moved in (("z", heights.mean(axis=1)), ("roll", rolls)):
        start[layout.displacement_places[_of_wheelsets(layout, along)]] += moved
    return assembly._replace(start=start)


def steady_state(assembly: Assembly, layout: StateLayout, mobility: FloatArray, tolerance: float = 1e-11) -> FloatArray:
    """Return the state of a steady run.

    Raises
    ------
    InputError
        If none is found: the vehicle does not stand on its wheels.
    """
    indentation = assembly.numbers[asm.STATIC_INDENTATION]
    chosen, zero = unknown_states(layout, assembly, mobility)
    moving = np.any(mobility != 0.0, axis=1)
    # accelerations that the ties allow: the range of the mobility
    values, vectors = np.linalg.eigh(mobility[np.ix_(moving, moving)])
    allowed = vectors[:, values > 1e-9 * values.max()]
    count = len(chosen) - int(moving.sum())
    basis = np.block([[allowed, np.zeros((len(allowed), count))], [np.zeros((count, allowed.shape[1])), np.eye(count)]])
    state = assembly.start.copy()
    steps = np.full(len(chosen), 1e-3 * indentation)
    steps[chosen % PLACES >= TO_RATE] = 1e-4
    for _ in range(60):
        rate = start_rates(assembly, state[None])[0][0, zero]
        change = basis @ np.linalg.lstsq(jacobian(assembly, state, chosen, steps)[zero] @ basis, -rate, rcond=1e-9)[0]
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
