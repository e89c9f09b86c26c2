"""Steps of a contact that may yield: which piece of the plastic law holds, and where in the step it ends.

The force of the contact follows one of two laws. The phase says which:

phase CONTACT       The contact is elastic: N = factor·u³, where u² is the indentation of the surface as it is. Beside
                    the ends of every contact step, the step ends where the surface begins to yield. A virgin surface
                    yields where the plastic law begins; any other one at the largest indentation that it has borne.
phase YIELDING + k  The contact yields: N = law(u² + r) by piece k of the plastic law. The law is one of the
                    indentation of the virgin surface: u² of the surface as it is, and the residual indentation r that
                    earlier contacts have left.

What happens in unloading depends on `numbers[MEMORY]`:

0, a rolling wheel       Every contact is at another place of the rail. In unloading the force goes back along the same
                         curve (the paper, section 2).
1, a wheel on one spot   All contacts are at the same place. Where the indentation is largest, a new piece of the path
                         begins. It has the residual indentation, and the larger radius, that the last loading has
                         left. Its surface lies deeper by that residual indentation.

`law` has the pieces of the plastic law as rows (LAW_COLUMNS of program.py). The other arrays are those of single.py.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import PHASE, PIECE, TIME, A, B, FloatArray
from wheeltapper.march.steps import layout
from wheeltapper.march.steps.layout import COUNT, MARK, STATE, T, U, W
from wheeltapper.march.steps.series import NO_PIECE, borne_at, enter_law, law_at, residual_at
from wheeltapper.march.wheel.events import follow_force, log_event
from wheeltapper.march.wheel.roots import NONE, evaluate, evaluate_derivative, first_root
from wheeltapper.march.wheel.step import NOTHING, begin_to_yield, contact_advance

YIELDS, GOES_ON, UNLOADS = 6, 7, 8
"""What else ends a step: the contact begins to yield, goes over to another piece of the law, or unloads."""
SAME_DEPTH = 1e-12
"""Indentations that differ by less than this part are the same."""
HARDLY_YIELDS = 0.3
"""A spot that reaches what it has borne at a rate below this times the root of the tolerance would go beyond it by less
than the march is exact: it does not yield."""


@uncounted_kernel
def _is_same_line(a: int, b: int, law: FloatArray) -> bool:
    """Return True where the forces of two neighbouring pieces of the law are one straight line."""
    force = contract.LAW_FORCE
    if law[a, force + 2] != 0.0 or law[b, force + 2] != 0.0:
        return False
    slope = law[a, force + 1] / law[a, contract.LAW_SCALE]
    return bool(abs(law[b, force + 1] / law[b, contract.LAW_SCALE] - slope) <= SAME_DEPTH * slope)


@uncounted_kernel
def _stretch_of(piece: int, law: FloatArray) -> tuple[int, int]:
    """Return the first and the last of the pieces of the law over which the force of one holds."""
    first = last = piece
    while first > 0 and _is_same_line(first - 1, first, law):
        first -= 1
    while last + 1 < law.shape[0] and _is_same_line(last, last + 1, law):
        last += 1
    return first, last


@uncounted_kernel
def piece_of(depth: float, law: FloatArray) -> int:
    """Return the piece of the law at an indentation of the virgin surface."""
    piece = 0
    while piece + 1 < law.shape[0] and law[piece + 1, contract.LAW_START] <= depth:
        piece += 1
    return piece


@uncounted_kernel
def choose_law(numbers: FloatArray, law: FloatArray, events: FloatArray, S: FloatArray) -> None:
    """Choose phase and law for a step in contact, by the state at its start; at a border the present ones stay."""
    square = S[STATE + A] * S[STATE + A]
    near = SAME_DEPTH * square
    depth = square + residual_at(0.0, S)
    beyond = square - borne_at(0.0, S)
    piece = int(S[STATE + PHASE]) - contract.YIELDING
    if piece >= 0:
        first, last = _stretch_of(piece, law)
        ends = law[last + 1, contract.LAW_START] if last + 1 < law.shape[0] else np.inf
        if not law[first, contract.LAW_START] - near <= depth <= ends + near:
            piece = piece_of(depth, law)
        if beyond < -near:
            piece = NO_PIECE
    elif beyond > (numbers[contract.TOLERANCE] * square if numbers[contract.MEMORY] != 0.0 else near):
        piece = piece_of(depth, law)
        log_event(S[STATE + TIME], contract.YIELD, S[STATE + B], 0.0, events, S[COUNT:])
    piece = max(piece, NO_PIECE)
    enter_law(piece, law, S)
    S[STATE + PHASE] = contract.YIELDING + piece if piece >= 0 else contract.CONTACT


@uncounted_kernel
def _first_directed_root(order: int, length: float, direction: float, size: float, S: FloatArray) -> float:
    """Return the first root of row TREND in the step in that direction; a step that begins at one does not count.

    `size` is that of what TREND is the difference of.
    """
    if abs(S[layout.TREND]) < SAME_DEPTH * size:
        S[layout.TREND] = 0.0
    root, _ = first_root(S, layout.TREND, order, 0.0, length, direction, SAME_DEPTH * size)
    return root


@uncounted_kernel
def _indentation_crossing(square: float, order: int, length: float, direction: float, S: FloatArray) -> float:
    """Return where in the step u² goes through a constant; NONE where it does not."""
    if square <= 0.0:
        return NONE
    for k in range(order + 1):
        S[layout.TREND + k] = S[U + k]
    S[layout.TREND] -= sqrt(square)
    return _first_directed_root(order, length, direction, S[U], S)


@uncounted_kernel
def _meets_yield(
    pieces: FloatArray, numbers: FloatArray, length: float, direction: float, S: FloatArray
) -> float:  # fmt: skip
    """Return where in the step the surface begins to yield (direction 1) or to unload (-1); NONE where it does not."""
    order = int(numbers[contract.ORDER])
    if S[layout.HERE_BEARS_DEGREE] == 0.0:
        return _indentation_crossing(S[layout.HERE_BEARS], order, length, direction, S)
    begin_to_yield(pieces, numbers, S)
    root = _first_directed_root(order - 1, length, direction, S[U] * S[U], S)
    if root == NONE:
        return NONE
    slope = evaluate_derivative(S, layout.TREND, order - 1, root)
    for _ in range(3 if slope != 0.0 else 0):  # u and t are known to one order more than u²
        square = evaluate(S, U, order, root) ** 2
        root = min(max(root - (square - borne_at(evaluate(S, T, order, root), S)) / slope, 0.0), length)
    return root


@uncounted_kernel
def _meets_border(depth: float, order: int, length: float, direction: float, S: FloatArray) -> float:
    """Return where in a yielding step the virgin surface's indentation goes through a value; NONE where it does not."""
    if S[layout.HERE_RESIDUAL_DEGREE] == 0.0:
        return _indentation_crossing(depth - S[layout.HERE_RESIDUAL], order, length, direction, S)
    for k in range(order):
        S[layout.TREND + k] = S[layout.DEPTH + k]
    S[layout.TREND] -= depth
    return _first_directed_root(order - 1, length, direction, depth, S)


@uncounted_kernel
def _may_yield(order: int, length: float, S: FloatArray) -> bool:
    """Return False where an elastic step stays below yield for sure."""
    largest = 0.0
    for k in range(order, 0, -1):
        largest = (largest + abs(S[U + k])) * length
    after = evaluate(S, T, order, length)
    change = 0.0
    for k in range(int(S[layout.HERE_BEARS_DEGREE]), 0, -1):
        change = (change + abs(S[layout.HERE_BEARS + k])) * after
    return bool((S[U] + largest) ** 2 > S[layout.HERE_BEARS] - change)


@uncounted_kernel
def _yielding_end(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, length: float, S: FloatArray
) -> tuple[float, int, int]:
    """Return where the piece of the law that holds ends in a step, what ends it, and which piece follows."""
    piece, order = int(S[STATE + PHASE]) - contract.YIELDING, int(numbers[contract.ORDER])
    first, last = _stretch_of(piece, law)
    end, what, follows = length, NOTHING, piece
    if last + 1 < law.shape[0]:
        root = _meets_border(law[last + 1, contract.LAW_START], order, end, 1.0, S)
        if root != NONE:
            end, what, follows = root, GOES_ON, last + 1
    if numbers[contract.MEMORY] != 0.0:
        if S[W] < 0.0 or (S[W] == 0.0 and S[W + 1] <= 0.0):
            return 0.0, UNLOADS, piece
        root, _ = first_root(S, W, order, 0.0, end, -1.0, 0.0)
        if root != NONE:
            end, what = root, UNLOADS
        return end, what, follows
    if first > 0:
        root = _meets_border(law[first, contract.LAW_START], order, end, -1.0, S)
        if root != NONE:
            end, what, follows = root, GOES_ON, first - 1
    root = _meets_yield(pieces, numbers, end, -1.0, S)
    if root != NONE:
        end, what, follows = root, GOES_ON, NO_PIECE
    return end, what, follows


@uncounted_kernel
def _append_memory_piece(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, ends_at_rest: bool, S: FloatArray
) -> None:
    """Begin a piece for the spot as it is left by what it carries now; its surface is what is left of it."""
    here, row = int(S[STATE + PIECE]), int(S[COUNT + layout.PIECES])
    before = residual_at(0.0, S)
    depth = S[STATE + A] * S[STATE + A] + before
    piece = piece_of(depth, law)
    x = (depth - law[piece, contract.LAW_CENTRE]) / law[piece, contract.LAW_SCALE]
    residual = 0.0
    for k in range(contract.TERMS - 1, -1, -1):
        residual = residual * x + law[piece, contract.LAW_RESIDUAL + k]
    square = depth - residual
    for column in range(pieces.shape[1]):
        pieces[row, column] = pieces[here, column]
    pieces[row, contract.COEFFICIENT] -= (residual - before) / numbers[contract.LIFT]
    pieces[row, contract.RESIDUAL] = residual / numbers[contract.LIFT]
    pieces[row, contract.BEARS] = square / numbers[contract.LIFT]
    pieces[row, contract.FACTOR_DEGREE] = 0.0
    pieces[row, contract.FACTOR] = law_at(depth, S) / square**1.5
    S[COUNT + layout.PIECES] += 1.0
    S[STATE + PIECE] = row
    S[STATE + PHASE] = contract.CONTACT
    S[STATE + A] = sqrt(square)
    if ends_at_rest:
        S[STATE + B] = 0.0


@uncounted_kernel
def _bound_law(law: FloatArray, S: FloatArray) -> None:
    """Say between which values of u the law that holds goes on; none where what earlier contacts left varies."""
    piece = int(S[STATE + PHASE]) - contract.YIELDING
    S[layout.U_FLOOR], S[layout.U_CEILING] = 0.0, 0.0
    if S[layout.HERE_BEARS_DEGREE] > 0.0 or S[layout.HERE_RESIDUAL_DEGREE] > 0.0:
        return
    left, bears = S[layout.HERE_RESIDUAL], S[layout.HERE_BEARS]
    S[layout.U_CEILING] = sqrt(max(bears, 0.0))
    if piece >= 0:
        first, last = _stretch_of(piece, law)
        S[layout.U_FLOOR] = sqrt(max(law[first, contract.LAW_START] - left, bears, 0.0))
        S[layout.U_CEILING] = np.inf
        if last + 1 < law.shape[0]:
            S[layout.U_CEILING] = sqrt(max(law[last + 1, contract.LAW_START] - left, 0.0))


@uncounted_kernel
def yielding_reach(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, until: float, steps: FloatArray, S: FloatArray
) -> tuple[float, float, float, float, float, bool, int, int]:
    """Put the series of a contact step in S; the steps before it hold nothing.

    Return its length, that up to where the law ends it, t, u and w at its end, whether the force may have an extreme
    within it, what of the law ends it, and the piece that follows.
    """
    order = int(numbers[contract.ORDER])
    memory = numbers[contract.MEMORY] != 0.0
    _bound_law(law, S)
    reach, t, u, w, turns = contact_advance(pieces, numbers, until, steps.shape[0] - 1, steps, S)
    length, what, follows = reach, NOTHING, NO_PIECE
    if S[layout.HERE_LAW_TERMS] != 0.0:
        length, what, follows = _yielding_end(pieces, numbers, law, reach, S)
    elif _may_yield(order, reach, S):
        root = _meets_yield(pieces, numbers, reach, 1.0, S)
        slow = HARDLY_YIELDS * sqrt(numbers[contract.TOLERANCE])
        if root != NONE and not (memory and evaluate(S, W, order, root) < slow):
            length, what = root, YIELDS
    return reach, length, t, u, w, turns, what, follows


@uncounted_kernel
def change_law(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, ends: int, follows: int, length: float, after: float,
    events: FloatArray, peaks: FloatArray, S: FloatArray,
) -> None:  # fmt: skip
    """Go over to the next piece of the law, or leave it, behind a step that `ends` has ended `after` its start."""
    depth = S[STATE + A] * S[STATE + A] + residual_at(after, S)
    if ends == UNLOADS:
        if length > 0.0:
            follow_force(S[STATE + TIME], law_at(depth, S), 0.0, peaks, S[MARK:], S[COUNT:])
        _append_memory_piece(pieces, numbers, law, length > 0.0, S)
        return
    if ends == YIELDS:
        log_event(S[STATE + TIME], contract.YIELD, S[STATE + B], 0.0, events, S[COUNT:])
        follows = piece_of(depth, law)
    S[STATE + PHASE] = contract.YIELDING + follows if follows >= 0 else contract.CONTACT
