"""The march from section to section of a periodic path: states after each wave, and how they change with the first one.

A cell of `Cells` ends after one wave, the period of its path. Its numbers hold no start: the state (STATE_SIZE,) at a
section is given, in scaled units: displacement and velocity of the wheel, then of the deck. The path under the next
wave is the same, so that its march begins at time zero again.

from section to section   states -> states, losses and largest force of each wave
with tangents             the derivatives of the state after some waves by the first one: a product of matrices
until captured            wave after wave, in lanes, until the state lies within a trap: a neighbourhood of an orbit
growth                    a small change of the state is carried along, and scaled to length one after every wave
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import in_blocks
from wheeltapper.march.common.kernel import kernel, uncounted_kernel
from wheeltapper.march.common.program import DECK_V, DECK_Y, LENGTH, PIECE, SHIFT, TIME, A, B, FloatArray, IntArray
from wheeltapper.march.steps import layout
from wheeltapper.march.steps.layout import COUNT, MARK, SCRATCH, STATE, TURNED_ROWS, T, U, W, Y, Z
from wheeltapper.march.steps.series import localise
from wheeltapper.march.steps.tangent_path import LANES, OF_DECK_HEIGHT, OF_DECK_VELOCITY, OF_HEIGHT, OF_VELOCITY
from wheeltapper.march.steps.written import scratch_of_cells
from wheeltapper.march.wheel import events as event
from wheeltapper.march.wheel.ensemble import Cells, end_motions
from wheeltapper.march.wheel.pool import pool_of
from wheeltapper.march.wheel.roots import evaluate
from wheeltapper.march.wheel.single import march_kernel, start_from
from wheeltapper.march.wheel.step import fastest_rate, repeat_step
from wheeltapper.march.wheel.tangent import Changes, Made, Rates, repeat_kernel
from wheeltapper.march.wheel.tangent_lanes import Links, links_of
from wheeltapper.march.wheel.tangent_samples import QUANTITIES, SAMPLED

STATE_SIZE = 4
"""Entries of a state at a section: OF_HEIGHT to OF_DECK_VELOCITY. Those of the deck are zero where there is none."""
LOSSES, LARGEST_FORCE = range(2)
"""What is told of a wave: losses of contact, and the largest contact force in it (scaled)."""
TOLD = 2
# Columns of a trap: the number of its orbit, its centre, the square of its radius, and the matrix of its norm.
TRAP_ORBIT, TRAP_CENTRE = 0, 1
TRAP_REACH = TRAP_CENTRE + STATE_SIZE
TRAP_NORM = TRAP_REACH + 1
TRAP_COLUMNS = TRAP_NORM + STATE_SIZE * STATE_SIZE
UNCAUGHT = -1
"""The orbit of a cell that no trap has caught."""
MOST_LOSSES = 1e6
"""Largest number of losses of contact in one wave."""
MOST_ROWS = 2**18
"""Room for the steps of one wave with tangents beyond which a march is given up: only wild guesses are so long."""
CHANGE = 0
"""The lane of the tangents that carries the only change of a state."""
SMALL = 1e-7
"""Length of the change of a state that is marched itself where the motion grazes and has no tangent."""
BLOCK, FEW = 64, 16
"""Cells that one thread marches at a time, and number of them below which lanes would march mostly empty."""
WIDE_BLOCK = 1024
"""Cells that one thread marches until they are caught: many, because lanes run dry when few of them are free."""
FINE = 1.0 / 20.0
"""Part of the order of a series: the largest angle, in radians of the fastest vibration that a wheel or a deck can
make, over which one step carries tangents. The next term of a sine is then below 3e-13 with the default order, and
below 1e-19 with the strict one; those of the tangents may be some hundred times larger."""


@uncounted_kernel
def begin_kernel(pieces: FloatArray, numbers: FloatArray, state: FloatArray, events: FloatArray, S: FloatArray) -> None:
    """Begin a wave at a given state."""
    deck_y, deck_v = state[OF_DECK_HEIGHT], state[OF_DECK_VELOCITY]
    start_from(pieces, numbers, state[OF_HEIGHT], state[OF_VELOCITY], deck_y, deck_v, events, S)


@uncounted_kernel
def finish_kernel(pieces: FloatArray, numbers: FloatArray, S: FloatArray, state: FloatArray) -> None:
    """Write the state at which a march has stopped."""
    state[OF_HEIGHT], state[OF_VELOCITY] = event.wheel_motion(pieces, numbers, S[STATE:], S)
    state[OF_DECK_HEIGHT] = S[STATE + DECK_Y]
    state[OF_DECK_VELOCITY] = S[STATE + DECK_V]


@uncounted_kernel
def tell_kernel(events: FloatArray, peaks: FloatArray, S: FloatArray, told: FloatArray) -> None:
    """Add the losses and the largest force that are in the tables to those of a wave."""
    for i in range(int(S[COUNT + layout.EVENTS])):
        if events[i, contract.EVENT_KIND] == contract.LOSS:
            told[LOSSES] += 1.0
    for i in range(int(S[COUNT + layout.PEAKS])):
        told[LARGEST_FORCE] = max(told[LARGEST_FORCE], peaks[i, contract.PEAK_FORCE])
    if S[MARK + event.WAITS] != 0.0:
        told[LARGEST_FORCE] = max(told[LARGEST_FORCE], S[MARK + event.TOP_FORCE])


@uncounted_kernel
def wave_kernel(
    pieces: FloatArray, numbers: FloatArray, state: FloatArray, told: FloatArray, steps: FloatArray,
    events: FloatArray, peaks: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """March one wave; `state` becomes that at its end. Return why the march stopped."""
    told[:] = 0.0
    begin_kernel(pieces, numbers, state, events, S)
    why = contract.FULL
    while why == contract.FULL:
        why = march_kernel(pieces, numbers, None, steps, events, peaks, steps[:0], S)
        tell_kernel(events, peaks, S, told)
        S[COUNT] = 0.0
        S[COUNT + layout.EVENTS] = 0.0
        S[COUNT + layout.PEAKS] = 0.0
        if told[LOSSES] > MOST_LOSSES:
            why = contract.TOO_MANY_EVENTS
    finish_kernel(pieces, numbers, S, state)
    return why


@kernel
def section_kernel(
    cells: Cells, states: FloatArray, skip: int, chained: bool, kept: FloatArray, told: FloatArray, status: IntArray,
    steps: FloatArray, events: FloatArray, peaks: FloatArray, S: FloatArray,
) -> None:  # fmt: skip
    """March each cell over `skip` waves, and over as many more as `kept` has room for; keep the states after these.

    Where the cells are chained, each begins at the state at which the one before it has ended.
    """
    one = np.zeros(TOLD)
    for cell in range(len(cells.first)):
        pieces = cells.pieces[cells.first[cell] : cells.first[cell] + cells.many[cell]]
        if chained and cell > 0:
            states[cell] = states[cell - 1]
        status[cell] = contract.DONE
        for wave in range(skip + kept.shape[1]):
            if status[cell] == contract.DONE:
                status[cell] = wave_kernel(pieces, cells.numbers[cell], states[cell], one, steps, events, peaks, S)
            if status[cell] != contract.DONE:
                states[cell] = np.nan
                one[:] = np.nan
            if wave >= skip:
                kept[cell, wave - skip] = states[cell]
                told[cell, wave - skip] = one


@kernel
def capture_kernel(
    cells: Cells, states: FloatArray, most: int, traps: FloatArray, trap_first: IntArray, trap_end: IntArray,
    caught: IntArray, waves: IntArray, status: IntArray, steps: FloatArray, events: FloatArray, peaks: FloatArray,
    S: FloatArray,
) -> None:  # fmt: skip
    """March each cell until it is in one of its traps, the rows from `trap_first` to `trap_end`; at most `most` waves.

    Written are the orbit of the trap, and the number of waves.
    """
    one = np.zeros(TOLD)
    for cell in range(len(cells.first)):
        pieces = cells.pieces[cells.first[cell] : cells.first[cell] + cells.many[cell]]
        status[cell] = contract.DONE
        waves[cell] = 0
        caught[cell] = trap_of(states[cell], traps[trap_first[cell] : trap_end[cell]])
        while caught[cell] == UNCAUGHT and waves[cell] < most and status[cell] == contract.DONE:
            status[cell] = wave_kernel(pieces, cells.numbers[cell], states[cell], one, steps, events, peaks, S)
            waves[cell] += 1
            caught[cell] = trap_of(states[cell], traps[trap_first[cell] : trap_end[cell]])


@uncounted_kernel
def trap_kernel(
    states: FloatArray, traps: FloatArray, first: IntArray, end: IntArray, free: IntArray, caught: IntArray
) -> None:
    """Write, for each of the free cells, the orbit in one of whose traps it lies."""
    for cell in free:
        caught[cell] = trap_of(states[cell], traps[first[cell] : end[cell]])


@uncounted_kernel
def trap_of(state: FloatArray, traps: FloatArray) -> int:
    """Return the orbit in whose trap a state lies, or UNCAUGHT."""
    for row in range(len(traps)):
        trap = traps[row]
        size = 0.0
        for i in range(STATE_SIZE):
            part = 0.0
            for j in range(STATE_SIZE):
                part += trap[TRAP_NORM + STATE_SIZE * i + j] * (state[j] - trap[TRAP_CENTRE + j])
            size += part * part
        if size <= trap[TRAP_REACH]:
            return int(trap[TRAP_ORBIT])
    return UNCAUGHT


class TangentTables(NamedTuple):
    """What one wave with tangents writes to: steps, and shorter ones into which the long ones are divided."""

    steps: FloatArray
    parts: FloatArray
    events: FloatArray
    peaks: FloatArray
    of_events: FloatArray
    of_peaks: FloatArray
    S: FloatArray
    D: FloatArray
    links: Links | None = None  # of the program's steps in contact; there is always one while it marches


@kernel
def divide_kernel(pieces: FloatArray, numbers: FloatArray, steps: FloatArray, parts: FloatArray, S: FloatArray) -> int:
    """Divide steps in contact that are too long for tangents; return the number of parts, or -1 if there is no room.

    A calm motion makes long steps, because a vibration that has died out is in no term of its series. Beside it the
    vibration is alive. Other steps of the default order are halved: their length suits the motion only, whose series
    converge faster than those of the tangents, and near a loss of contact tangents grow large in between.
    """
    order = int(numbers[contract.ORDER])
    suspension = numbers[contract.STIFFNESS] + numbers[contract.DAMPING]
    used = 0
    for i in range(len(steps)):
        step = steps[i]
        many = 1
        if step[contract.PHASE] == contract.CONTACT:
            many = 1 if order == contract.STRICT_ORDER else 2
            u = max(step[A], step[A] + 0.5 * step[LENGTH] * step[B])
            S[U], S[STATE + contract.ON_DECK] = u, step[contract.ON_DECK]
            stiffness = u * u * (numbers[contract.QUADRATIC] + 1.5 * numbers[contract.CUBIC] * u)
            rate = max(np.sqrt(stiffness), fastest_rate(numbers, suspension, S))
            many = max(many, int(np.ceil(rate * step[LENGTH] / (FINE * order))))
        if used + many > len(parts):
            return -1
        parts[used] = step
        used += 1
        for _ in range(1, many):
            last = parts[used - 1]
            last[LENGTH] = step[LENGTH] / many
            localise(pieces, numbers, int(last[PIECE]), last[SHIFT], last[TIME], S)
            repeat_step(pieces, numbers, last, S)
            parts[used] = last
            parts[used, TIME] += evaluate(S, T, order, last[LENGTH])
            parts[used, A] = evaluate(S, U, order, last[LENGTH])
            parts[used, B] = evaluate(S, W, order, last[LENGTH])
            if numbers[contract.DECK_MASS] > 0.0:
                parts[used, DECK_Y] = evaluate(S, Y, order, last[LENGTH])
                parts[used, DECK_V] = evaluate(S, Z, order, last[LENGTH])
            used += 1
    return used


@kernel
def tangent_wave_kernel(
    pieces: FloatArray, numbers: FloatArray, state: FloatArray, told: FloatArray, along: FloatArray,
    tables: TangentTables,
) -> tuple[int, float]:  # fmt: skip
    """March one wave; `state` becomes that at its end, `along` (STATE_SIZE, LANES) its derivatives along given changes.

    `along` holds, at first, the changes of the state at the wave's start. Return why the march stopped, and how near it
    came to grazing.
    """
    S = tables.S
    told[:] = 0.0
    begin_kernel(pieces, numbers, state, tables.events, S)
    why = march_kernel(pieces, numbers, None, tables.steps, tables.events, tables.peaks, tables.steps[:0], S)
    if why != contract.DONE:
        return why, 0.0
    tell_kernel(tables.events, tables.peaks, S, told)
    rows = int(S[COUNT])
    events = int(S[COUNT + layout.EVENTS])
    peaks = int(S[COUNT + layout.PEAKS])
    last = S[STATE : STATE + LENGTH].copy()
    parts = divide_kernel(pieces, numbers, tables.steps[:rows], tables.parts, S)
    if parts < 0:
        return contract.FULL, 0.0
    S[STATE : STATE + LENGTH] = last
    finish_kernel(pieces, numbers, S, state)
    change = along.copy()
    made = Made(pieces, numbers, tables.parts[:parts], last, tables.events[:events], tables.peaks[:peaks])
    still = np.zeros((contract.NUMBERS, LANES))
    changes = Changes(still, change, np.zeros((0, 0, 0)), 0, np.full(LANES, -1))
    of_events, of_peaks = tables.of_events[:events], tables.of_peaks[:peaks]
    rates = Rates(of_events, of_peaks, along, np.zeros(LANES), np.zeros((0, LANES)))
    no_times, no_samples = np.zeros(0), np.zeros((0, QUANTITIES, SAMPLED))
    near = repeat_kernel(made, changes, rates, 0.0, no_times, no_samples, S, tables.D, None, 0, tables.links)
    return why, near


@kernel
def orbit_kernel(
    pieces: FloatArray, numbers: FloatArray, state: FloatArray, trail: FloatArray, told: FloatArray,
    along: FloatArray, tables: TangentTables,
) -> tuple[int, float]:  # fmt: skip
    """March as many waves as `trail` has rows, with tangents; write the state after each, and what is told of it."""
    nearest = np.inf
    for wave in range(len(trail)):
        why, near = tangent_wave_kernel(pieces, numbers, state, told[wave], along, tables)
        if why != contract.DONE:
            return why, 0.0
        trail[wave] = state
        nearest = min(nearest, near)
    return contract.DONE, nearest


@kernel
def growth_kernel(
    pieces: FloatArray, numbers: FloatArray, state: FloatArray, change: FloatArray, growths: FloatArray, first: int,
    tables: TangentTables,
) -> tuple[int, int]:  # fmt: skip
    """Carry a small change of the state along; write the logarithm of its growth in each wave from `first` on.

    Return why the march stopped, and the wave in which it did.
    """
    told = np.zeros(TOLD)
    along = np.zeros((STATE_SIZE, LANES))
    for wave in range(first, len(growths)):
        before = state.copy()
        along[:, CHANGE] = change
        why, _ = tangent_wave_kernel(pieces, numbers, state, told, along, tables)
        if why != contract.DONE:
            state[:] = before
            return why, wave
        if np.isfinite(along[:, CHANGE].sum()):
            change[:] = along[:, CHANGE]
        else:  # it grazes: the motion beside it is marched
            beside = before + SMALL * change
            wave_kernel(pieces, numbers, beside, told, tables.steps, tables.events, tables.peaks, tables.S)
            change[:] = (beside - state) / SMALL
        size = np.sqrt((change * change).sum())
        growths[wave] = np.log(size)
        change /= size
    return contract.DONE, len(growths)


# -- room, blocks and threads -------------------------------------------------------------------------------------


def _tables(rows: int = 256) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return tables of steps, events and force maxima that are emptied whenever they are full."""
    columns = contract.STEP_COLUMNS, contract.EVENT_COLUMNS, contract.PEAK_COLUMNS
    steps, events, peaks = (np.empty((rows, many)) for many in columns)
    return steps, events, peaks


def _tangent_room(rows: int = 1024) -> TangentTables:
    """Return tables for a whole wave; the scratch memory S is not yet that of a program."""
    steps, events, peaks = _tables(rows)
    of_events, of_peaks = np.zeros((rows, 2, LANES)), np.zeros((rows, 2, LANES))
    parts, D = np.empty_like(steps), np.zeros((TURNED_ROWS, LANES))
    return TangentTables(steps, parts, events, peaks, of_events, of_peaks, np.zeros(SCRATCH), D)


def _prepared(room: TangentTables, program: contract.Program) -> TangentTables:
    """Return tables for a program's march with tangents, with what differentiates eight steps in contact at a time."""
    one, pieces = np.zeros(1, dtype=np.int64), program.pieces
    numbers = program.numbers[None]
    links = links_of(pool_of(pieces, one, one + len(pieces), numbers), one[:0], False)
    return room._replace(S=scratch_of_cells(numbers, pieces, turned=True), links=links)


class Returned(NamedTuple):
    """States at sections, (cells, waves, STATE_SIZE), what is told of the waves before, and why each cell stopped."""

    kept: FloatArray
    told: FloatArray
    status: IntArray


def sections(
    cells: Cells, states: FloatArray, skip: int, keep: int, threads: int = 1, chained: bool = False,
    count: Callable[[int], None] | None = None,
) -> Returned:  # fmt: skip
    """March many cells over `skip` + `keep` waves; `states` (cells, STATE_SIZE) become those at the end.

    Waves that are skipped are marched in lanes, unless the cells are fewer than FEW. Chained cells are marched one by
    one, each from where the one before it has ended.
    """
    total = len(cells.first)
    found = Returned(
        np.empty((total, keep, STATE_SIZE)), np.empty((total, keep, TOLD)), np.zeros(total, dtype=np.int64)
    )

    def march_block(block: slice) -> None:
        kept, told, status = found.kept[block], found.told[block], found.status[block]
        own, here, left = cells.part(block), states[block], skip
        if skip > 1 and not chained and len(here) >= FEW:
            far = own.numbers.copy()
            far[:, contract.END] *= skip
            here[:], why = end_motions(own._replace(numbers=far), 1, here)
            here[why != contract.DONE] = np.nan
            left = 0
        section_kernel(
            own, here, left, chained, kept, told, status, *_tables(), scratch_of_cells(cells.numbers, cells.pieces)
        )
        if count is not None:
            count(block.stop - block.start)

    in_blocks(total, total if chained else BLOCK, threads, march_block)
    return found


class Captured(NamedTuple):
    """The orbit of each cell (UNCAUGHT: none yet), the waves marched, and why it stopped; each (cells,)."""

    orbit: IntArray
    waves: IntArray
    status: IntArray


def capture(
    cells: Cells, states: FloatArray, most: int, traps: FloatArray, first: IntArray, end: IntArray, threads: int = 1
) -> Captured:
    """March many cells until they are caught; `states` become those at the end.

    Parameters
    ----------
    cells, states
        The cells, and their states (cells, STATE_SIZE).
    most
        Largest number of waves.
    traps
        (traps, TRAP_COLUMNS).
    first, end
        (cells,) which of the traps are for each cell.
    threads
        Number of threads; the result does not depend on it.
    """
    total = len(cells.first)
    found = Captured(*(np.zeros(total, dtype=np.int64) for _ in range(3)))

    def march_block(block: slice) -> None:
        orbit, waves, status = found.orbit[block], found.waves[block], found.status[block]
        own = cells.part(block), states[block], most, traps, first[block], end[block]
        if total < FEW:
            capture_kernel(*own, orbit, waves, status, *_tables(), scratch_of_cells(cells.numbers, cells.pieces))
        else:
            _capture_in_lanes(*own, orbit, waves, status)

    in_blocks(total, WIDE_BLOCK, threads, march_block)
    return found


def trapped(states: FloatArray, traps: FloatArray) -> IntArray:
    """Return the orbit in one of whose traps (traps, TRAP_COLUMNS) each state lies, or UNCAUGHT."""
    every, none = np.arange(len(states)), np.zeros(len(states), dtype=np.int64)
    caught = np.empty_like(none)
    trap_kernel(states, traps, none, none + len(traps), every, caught)
    return caught


def _capture_in_lanes(
    cells: Cells, states: FloatArray, most: int, traps: FloatArray, first: IntArray, end: IntArray,
    orbit: IntArray, waves: IntArray, status: IntArray,
) -> None:  # fmt: skip
    """Do as `capture_kernel` does; in each wave those cells that are still free march in lanes."""
    orbit[:], waves[:], status[:] = UNCAUGHT, 0, contract.DONE
    free, own = np.arange(len(states)), cells
    for wave in range(most + 1):
        trap_kernel(states, traps, first, end, free, orbit)
        goes_on = (orbit[free] == UNCAUGHT) & (status[free] == contract.DONE)
        if not goes_on.all():
            free = free[goes_on]
            own = Cells(cells.pieces, cells.first[free], cells.many[free], cells.numbers[free])
        if wave == most or not len(free):
            return
        states[free], status[free] = end_motions(own, 1, states[free])
        waves[free] += 1


class Turn(NamedTuple):
    """One round of an orbit, in scaled units.

    Attributes
    ----------
    status
        Why the march stopped.
    trail
        (waves, STATE_SIZE) the states after each wave.
    told
        (waves, TOLD) what is told of each wave.
    slopes
        (STATE_SIZE, STATE_SIZE) derivatives of the last state by the first; NaN where the motion grazes.
    near
        How near it comes to grazing.
    """

    status: int
    trail: FloatArray
    told: FloatArray
    slopes: FloatArray
    near: float


class Tangents:
    """Marches of a program with tangents, with room that grows where a wave needs more."""

    def __init__(self) -> None:
        self._room = _tangent_room()

    def turn(self, program: contract.Program, state: FloatArray, waves: int) -> Turn:
        """March some waves from a state."""
        while True:
            tables, along = _prepared(self._room, program), np.zeros((STATE_SIZE, LANES))
            along[:, :STATE_SIZE] = np.eye(STATE_SIZE)
            trail, told = np.empty((waves, STATE_SIZE)), np.empty((waves, TOLD))
            status, near = orbit_kernel(program.pieces, program.numbers, state.copy(), trail, told, along, tables)
            if status != contract.FULL or len(tables.steps) >= MOST_ROWS:
                return Turn(status, trail, told, along[:, :STATE_SIZE].copy(), near)
            self._room = _tangent_room(2 * len(tables.steps))


def growths(program: contract.Program, state: FloatArray, change: FloatArray, waves: int) -> FloatArray:
    """Return the logarithm of the growth of a small change in each of some waves; state and change go along.

    NaN behind a wave that could not be marched.
    """
    out, room, wave = np.full(waves, np.nan), _tangent_room(), 0
    while True:
        tables = _prepared(room, program)
        why, wave = growth_kernel(program.pieces, program.numbers, state, change, out, wave, tables)
        if why != contract.FULL or len(room.steps) >= MOST_ROWS:
            return out
        room = _tangent_room(2 * len(room.steps))
