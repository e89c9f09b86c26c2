"""What rails that give way answer to forces within a macro step: numbers in the data and their sums."""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_kernel, kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import HALF, LANES

ROW_A, ROW_B, ROW_C, ROW_D = range(4)
ROWS_AT_ONCE = 4
"""Moments whose answers are added in one go."""


@inlined_kernel
def places_of(data: FloatArray, plan: IntArray) -> tuple[int, int, int, int, int, int, int, int, int]:
    """Return the nodes, the size of one way's coefficients, and where all begins in the data.

    That is d, r, B, P, P', the deflections' coefficients and the moments' rates.
    """
    at = plan[asm.AT_RAILS]
    nodes = int(data[at + asm.RAIL_NODES])
    one = int(data[at + asm.RAIL_FOURS]) * nodes * HALF
    free = at + asm.RAIL_NUMBERS
    local = free + 2 * one
    answers = local + one
    values = answers + one * one + int(data[at + asm.RAIL_AGAINST])
    present = values + 2 * nodes
    return nodes, one, free, local, answers, values, values + nodes, present, present + 2 * one


@uncounted_kernel
def _add_four(A: FloatArray, x: FloatArray, y: FloatArray, factor: float, out: FloatArray) -> None:
    """Add four rows of A, one behind the other, times the entries of x/2 + factor·y."""
    one = len(out)
    first, second, third, fourth = A[:one], A[one : 2 * one], A[2 * one : 3 * one], A[3 * one :]
    a, b = 0.5 * x[ROW_A] + factor * y[ROW_A], 0.5 * x[ROW_B] + factor * y[ROW_B]
    c, d = 0.5 * x[ROW_C] + factor * y[ROW_C], 0.5 * x[ROW_D] + factor * y[ROW_D]
    for k in range(one):
        out[k] += a * first[k] + b * second[k] + c * third[k] + d * fourth[k]


@uncounted_kernel
def add_answers(one: int, at: int, answers: int, against: int, to: int, w: FloatArray, data: FloatArray) -> None:
    """Add what both ways answer to moments of the rails, w from `at` on, to their coefficients, data from `to` on.

    `one` is the size of one of them, `against` the distance between the answers of both ways.
    """
    together, apart = data[to : to + one], data[to + one : to + 2 * one]
    left, right = w[at : at + one], w[at + one : at + 2 * one]
    for j in range(0, one, ROWS_AT_ONCE):
        rows = slice(j, j + ROWS_AT_ONCE)
        begin, length = answers + j * one, ROWS_AT_ONCE * one
        _add_four(data[begin : begin + length], left[rows], right[rows], 0.5, together)
        _add_four(data[begin + against : begin + against + length], left[rows], right[rows], -0.5, apart)


@kernel
def answer_at_once(data: FloatArray, plan: IntArray) -> None:
    """Write what the rails' coefficients gain, over the moments' growth, in place of these coefficients."""
    at = plan[asm.AT_RAILS]
    _, one, _, _, answers, _, _, present, growing = places_of(data, plan)
    for k in range(2 * one):
        data[present + k] = 0.0
    add_answers(one, growing, answers, int(data[at + asm.RAIL_AGAINST]), present, data, data)


@inlined_kernel
def write_growth(four: int, row: int, factors: int, data: FloatArray, plan: IntArray, L: FloatArray) -> None:
    """Write how the moments of a four grow by the forces in a row: these times factors, P or P'."""
    nodes, one, _, _, _, _, _, _, growing = places_of(data, plan)
    for m in range(nodes):
        factor = data[factors + m]
        at = growing + (four * nodes + m) * HALF
        for i in range(HALF):
            data[at + i] = factor * L[row + i]
            data[at + one + i] = factor * L[row + HALF + i]


@inlined_kernel
def sum_lanes(first: int, values: int, nodes: int, row: int, data: FloatArray, L: FloatArray) -> None:
    """Write Σ_m P_m·(coefficients) of eight lanes, the same for both rails."""
    for i in range(LANES):
        L[row + i] = 0.0
    for m in range(nodes):
        value = data[values + m]
        at = first + m * HALF
        for i in range(HALF):
            L[row + i] += value * data[at + i]
            L[row + HALF + i] += value * data[at + i]


@inlined_kernel
def sum_ways(first: int, one: int, values: int, nodes: int, row: int, data: FloatArray, L: FloatArray) -> None:
    """Write Σ_m P_m·(coefficients) of eight lanes: for the left rail the sum of both ways, else the difference.

    Coefficients of the rails together begin at `first`, those of the rails against one another `one` later.
    """
    for i in range(LANES):
        L[row + i] = 0.0
    for m in range(nodes):
        value = data[values + m]
        at = first + m * HALF
        for i in range(HALF):
            L[row + i] += value * (data[at + i] + data[at + one + i])
            L[row + HALF + i] += value * (data[at + i] - data[at + one + i])
