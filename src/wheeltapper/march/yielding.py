"""The marcher for elastic-plastic contacts: as single.py, with steps in which the contact yields.

phase CONTACT      elastic: N = factor·u³, u² the indentation of the surface as it is; ends also where the surface
                   yields, at the largest indentation that it has borne, or of a virgin one where the law begins
phase YIELDING + k piece k of the plastic law: N = law(u² + r), r the residual indentation that the surface has

rolling   every contact is at another place: the same curve is gone back in unloading (the paper, section 2)
memory    all contacts are at one spot: where the indentation is largest, a new piece begins, with the residual
          indentation and the larger radius of what was loaded last; its surface lies deeper by that residual
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march import telling
from wheeltapper.march.events import GRAZE, cross_break, follow, follow_on, log_event
from wheeltapper.march.kernel import is_compiled, kernel
from wheeltapper.march.layout import (
    BEARS,
    BEARS_DEGREE,
    COUNT,
    DEPTH,
    EVENTS,
    FACTOR_DEGREE,
    HERE,
    HORNER_BEARS,
    IDLE,
    LAW_CENTRE,
    LAW_SCALE,
    LAW_TERMS,
    MARK,
    OPENED,
    PEAKS,
    PIECES,
    RESIDUAL,
    RESIDUAL_DEGREE,
    STATE,
    TREND,
    N,
    Q,
    T,
    U,
    W,
)
from wheeltapper.march.program import (
    CONTACT,
    DECK_V,
    DECK_Y,
    DONE,
    FULL,
    NOT_FINITE,
    ON_DECK,
    PHASE,
    PIECE,
    RUNNING,
    SHIFT,
    STALLED,
    TIME,
    TOO_MANY_EVENTS,
    YIELD,
    YIELDING,
    A,
    B,
    FloatArray,
    Program,
)
from wheeltapper.march.roots import NONE, evaluate, evaluate_derivative, first_root
from wheeltapper.march.series import (
    borne_at,
    borne_series,
    contact_series,
    enter_law,
    law_at,
    localise,
    localise_marks,
    residual_at,
)
from wheeltapper.march.single import March, conclude, flight_step, grown, next_break, rest, start_kernel, tabled, tables
from wheeltapper.march.step import BREAK, NOTHING, OPENS, contact_end, contact_reach, is_bad

YIELDS, GOES_ON, UNLOADS = 6, 7, 8
"""What else ends a step: the contact begins to yield, goes over to another piece of the law, or unloads."""
NEAR = 1e-12
"""Indentations that differ by less than this part are the same."""
HARDLY = 0.3
"""A spot that reaches what it has borne at a rate below this times the root of the tolerance would go beyond it by less
than the march is exact: it does not yield."""


@kernel
def piece_of(depth: float, law: FloatArray) -> int:
    """Return the piece of the law at an indentation of the virgin surface."""
    piece = 0
    while piece + 1 < law.shape[0] and law[piece + 1, contract.LAW_START] <= depth:
        piece += 1
    return piece


@kernel
def _choose_law(numbers: FloatArray, law: FloatArray, events: FloatArray, S: FloatArray) -> None:
    """Choose phase and law for a step in contact, by the state at its start; at a border the present ones stay."""
    square = S[STATE + A] * S[STATE + A]
    near = NEAR * square
    depth = square + residual_at(0.0, S)
    beyond = square - borne_at(0.0, S)
    piece = int(S[STATE + PHASE]) - YIELDING
    if piece >= 0:
        ends = law[piece + 1, contract.LAW_START] if piece + 1 < law.shape[0] else np.inf
        if not law[piece, contract.LAW_START] - near <= depth <= ends + near:
            piece = piece_of(depth, law)
        if beyond < -near:
            piece = -1
    elif beyond > (numbers[contract.TOLERANCE] * square if numbers[contract.MEMORY] != 0.0 else near):
        piece = piece_of(depth, law)
        log_event(S[STATE + TIME], YIELD, S[STATE + B], 0.0, events, S[COUNT:])
    piece = max(piece, -1)
    enter_law(piece, law, S)
    S[STATE + PHASE] = YIELDING + piece if piece >= 0 else CONTACT


@kernel
def _root(order: int, length: float, direction: float, size: float, S: FloatArray) -> float:
    """Return the first root of row TREND in the step in that direction; a step that begins at one does not count.

    `size` is that of what TREND is the difference of.
    """
    if abs(S[TREND]) < NEAR * size:
        S[TREND] = 0.0
    root, _ = first_root(S, TREND, order, 0.0, length, direction, NEAR * size)
    return root


@kernel
def _reaches(square: float, order: int, length: float, direction: float, S: FloatArray) -> float:
    """Return where in the step u² goes through a constant; NONE where it does not."""
    if square <= 0.0:
        return NONE
    for k in range(order + 1):
        S[TREND + k] = S[U + k]
    S[TREND] -= sqrt(square)
    return _root(order, length, direction, S[U], S)


@kernel
def _meets_yield(order: int, length: float, direction: float, S: FloatArray) -> float:
    """Return where in the step the surface begins to yield (direction 1) or to unload (-1); NONE where it does not."""
    if S[HERE + BEARS_DEGREE] == 0.0:
        return _reaches(S[HERE + BEARS], order, length, direction, S)
    borne_series(order, S)
    for k in range(order):
        S[TREND + k] = S[Q + k] - S[HORNER_BEARS + k]
    root = _root(order - 1, length, direction, S[Q], S)
    if root == NONE:
        return NONE
    slope = evaluate_derivative(S, TREND, order - 1, root)
    for _ in range(3 if slope != 0.0 else 0):  # u and t are known to one order more than u²
        square = evaluate(S, U, order, root) ** 2
        root = min(max(root - (square - borne_at(evaluate(S, T, order, root), S)) / slope, 0.0), length)
    return root


@kernel
def _meets_border(depth: float, order: int, length: float, direction: float, S: FloatArray) -> float:
    """Return where in a yielding step the virgin surface's indentation goes through a value; NONE where it does not."""
    if S[HERE + RESIDUAL_DEGREE] == 0.0:
        return _reaches(depth - S[HERE + RESIDUAL], order, length, direction, S)
    for k in range(order):
        S[TREND + k] = S[DEPTH + k]
    S[TREND] -= (depth - S[HERE + LAW_CENTRE]) / S[HERE + LAW_SCALE]
    return _root(order - 1, length, direction, depth / S[HERE + LAW_SCALE], S)


@kernel
def _may_yield(order: int, length: float, S: FloatArray) -> bool:
    """Return False where an elastic step stays below yield for sure."""
    largest = 0.0
    for k in range(order, 0, -1):
        largest = (largest + abs(S[U + k])) * length
    after = evaluate(S, T, order, length)
    change = 0.0
    for k in range(int(S[HERE + BEARS_DEGREE]), 0, -1):
        change = (change + abs(S[HERE + BEARS + k])) * after
    return bool((S[U] + largest) ** 2 > S[HERE + BEARS] - change)


@kernel
def _yielding_end(law: FloatArray, order: int, length: float, memory: bool, S: FloatArray) -> tuple[float, int, int]:
    """Return where the piece of the law that holds ends in a step, what ends it, and which piece follows."""
    piece = int(S[STATE + PHASE]) - YIELDING
    end, what, follows = length, NOTHING, piece
    if piece + 1 < law.shape[0]:
        root = _meets_border(law[piece + 1, contract.LAW_START], order, end, 1.0, S)
        if root != NONE:
            end, what, follows = root, GOES_ON, piece + 1
    if memory:
        if S[W] < 0.0 or (S[W] == 0.0 and S[W + 1] <= 0.0):
            return 0.0, UNLOADS, piece
        root, _ = first_root(S, W, order, 0.0, end, -1.0, 0.0)
        if root != NONE:
            end, what = root, UNLOADS
        return end, what, follows
    if piece > 0:
        root = _meets_border(law[piece, contract.LAW_START], order, end, -1.0, S)
        if root != NONE:
            end, what, follows = root, GOES_ON, piece - 1
    root = _meets_yield(order, end, -1.0, S)
    if root != NONE:
        end, what, follows = root, GOES_ON, -1
    return end, what, follows


@kernel
def _remember(pieces: FloatArray, numbers: FloatArray, law: FloatArray, ends_at_rest: bool, S: FloatArray) -> None:
    """Begin a piece for the spot as it is left by what it carries now; its surface is what is left of it."""
    here, row = int(S[STATE + PIECE]), int(S[COUNT + PIECES])
    before = residual_at(0.0, S)
    depth = S[STATE + A] * S[STATE + A] + before
    x = (depth - S[HERE + LAW_CENTRE]) / S[HERE + LAW_SCALE]
    residual = 0.0
    for k in range(contract.TERMS - 1, -1, -1):
        residual = residual * x + law[int(S[STATE + PHASE]) - YIELDING, contract.LAW_RESIDUAL + k]
    square = depth - residual
    for column in range(pieces.shape[1]):
        pieces[row, column] = pieces[here, column]
    pieces[row, contract.COEFFICIENT] -= (residual - before) / numbers[contract.LIFT]
    pieces[row, contract.RESIDUAL] = residual / numbers[contract.LIFT]
    pieces[row, contract.BEARS] = square / numbers[contract.LIFT]
    pieces[row, contract.FACTOR_DEGREE] = 0.0
    pieces[row, contract.FACTOR] = law_at(depth, S) / square**1.5
    S[COUNT + PIECES] += 1.0
    S[STATE + PIECE] = row
    S[STATE + PHASE] = CONTACT
    S[STATE + A] = sqrt(square)
    if ends_at_rest:
        S[STATE + B] = 0.0


@kernel
def _trend(order: int, S: FloatArray) -> tuple[int, int]:
    """Return the row and degree of a polynomial with the sign of the contact force's rate."""
    changes = S[HERE + RESIDUAL_DEGREE] if S[HERE + LAW_TERMS] != 0.0 else S[HERE + FACTOR_DEGREE]
    if changes <= 0.0:
        return W, order
    for k in range(order - 1):
        S[TREND + k] = (k + 1) * S[N + k + 1]
    return TREND, order - 2


@kernel
def _contact_step(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, until: float, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Step in contact until something ends a step; return what."""
    order = int(numbers[contract.ORDER])
    yields = S[HERE + LAW_TERMS] != 0.0
    memory = numbers[contract.MEMORY] != 0.0
    contact_series(
        numbers, order, S[STATE + A], S[STATE + B], S[STATE + DECK_Y], S[STATE + DECK_V], S[STATE + ON_DECK] != 0.0, S
    )
    length = contact_reach(numbers, numbers[contract.STIFFNESS] + numbers[contract.DAMPING], S)
    ends, follows = NOTHING, -1
    if yields:
        length, ends, follows = _yielding_end(law, order, length, memory, S)
    elif _may_yield(order, length, S):
        root = _meets_yield(order, length, 1.0, S)
        slow = HARDLY * sqrt(numbers[contract.TOLERANCE])
        if root != NONE and not (memory and evaluate(S, W, order, root) < slow):
            length, ends = root, YIELDS
    turns = not (yields and memory)
    after = evaluate(S, T, order, length)
    u = evaluate(S, U, order, length)
    w = evaluate(S, W, order, length)
    length, what, after, u, w = contact_end(numbers, order, until - S[STATE + TIME], length, after, u, w, turns, S)
    trend, degree = _trend(order, S)
    follow_on(max(S[N], 0.0), peaks, S)
    conclude(numbers, until, length, after, u, w, what, trend, degree, turns, steps, events, peaks, S)
    if what != NOTHING or ends == NOTHING:
        return what
    if ends == UNLOADS:
        if length > 0.0:
            follow(S[STATE + TIME], law_at(u * u + residual_at(after, S), S), 0.0, peaks, S[MARK:], S[COUNT:])
        _remember(pieces, numbers, law, length > 0.0, S)
        return ends
    if ends == YIELDS:
        log_event(S[STATE + TIME], YIELD, w, 0.0, events, S[COUNT:])
        follows = piece_of(u * u + residual_at(after, S), law)
    S[STATE + PHASE] = YIELDING + follows if follows >= 0 else CONTACT
    return ends


@kernel
def advance_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Make the next step, over a breakpoint at its end; return RUNNING, or why the march stops."""
    if (
        S[COUNT] + 1 > steps.shape[0]
        or S[COUNT + EVENTS] + 4 > events.shape[0]
        or S[COUNT + PEAKS] + 8 > peaks.shape[0]
        or S[COUNT + PIECES] + 1 > pieces.shape[0]
    ):
        return FULL
    if S[COUNT + EVENTS] >= numbers[contract.EVENT_LIMIT]:
        return TOO_MANY_EVENTS
    time = S[STATE + TIME]
    until = next_break(pieces, numbers, S)
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
    localise_marks(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
    in_contact = S[STATE + PHASE] == CONTACT or S[STATE + PHASE] >= YIELDING
    if in_contact and S[STATE + A] == 0.0 and abs(S[STATE + B]) < GRAZE:
        rest(numbers, S)
        return RUNNING
    if in_contact:
        _choose_law(numbers, law, events, S)
        what = _contact_step(pieces, numbers, law, until, steps, events, peaks, S)
    else:
        enter_law(-1, law, S)
        what = flight_step(numbers, until, S[COUNT + OPENED] != 0.0, steps, events, peaks, S)
    S[COUNT + OPENED] = 1.0 if what == OPENS else 0.0
    if is_bad(S[STATE + TIME] + S[STATE + A] + S[STATE + B] + S[STATE + DECK_Y] + S[STATE + DECK_V]):
        return NOT_FINITE
    S[COUNT + IDLE] = S[COUNT + IDLE] + 1.0 if S[STATE + TIME] <= time else 0.0
    if S[COUNT + IDLE] > 1000:
        return STALLED
    if what == BREAK:
        if S[STATE + TIME] >= numbers[contract.END]:
            return DONE
        localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], S[STATE + TIME], S)
        phase = S[STATE + PHASE]
        if phase >= YIELDING:
            S[STATE + PHASE] = CONTACT
        status = cross_break(pieces, numbers, events, S)
        if phase >= YIELDING and S[STATE + PHASE] == CONTACT:
            S[STATE + PHASE] = phase
        return status
    return RUNNING


@kernel
def yielding_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """March from the state in S until the end, or until a table is full; return why it stopped. May be called again."""
    status = RUNNING
    while status == RUNNING:
        status = advance_kernel(pieces, numbers, law, steps, events, peaks, S)
    return status


def _arguments(program: Program) -> tuple[Any, ...]:
    """Return the arguments of the kernel at the start of a march; a spot that remembers needs room for its pieces."""
    spare = 64 if program.numbers[contract.MEMORY] != 0.0 else 0
    pieces = np.vstack([program.pieces, np.zeros((spare, program.pieces.shape[1]))])
    return pieces, program.numbers, program.law, *tables()


def is_ready(program: Program) -> bool:
    """Return False where marching this program begins with compiling its kernel."""
    return is_compiled(yielding_kernel, _arguments(program))


def march(program: Program, tell: telling.Tell = telling.untold) -> tuple[March, FloatArray]:
    """March a program whose contact yields; return also its pieces, with those that its spot has left behind."""
    pieces, numbers, law, steps, events, peaks, work = _arguments(program)
    start_kernel(pieces[: len(program.pieces)], numbers, events, work)
    if numbers[contract.MEMORY] != 0.0:
        work[COUNT + PIECES] = len(program.pieces)
    while True:
        room = steps[: int(work[COUNT]) + telling.CHUNK]
        status = yielding_kernel(pieces, numbers, law, room, events, peaks, work)
        used = work[COUNT : COUNT + 3].astype(int)
        last = max(int(work[COUNT + PIECES]), len(program.pieces))
        if status != FULL or tell(work[STATE + TIME]):
            return tabled(status, steps, events, peaks, work), pieces[:last]
        steps, events, peaks = grown(steps, used[0]), grown(events, used[1]), grown(peaks, used[2])
        if numbers[contract.MEMORY] != 0.0:
            pieces = grown(pieces, last)
