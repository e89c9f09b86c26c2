"""Elements between bodies that are not linear: how far they are deflected, how fast, and the forces of their pieces."""

from __future__ import annotations

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import PLACES, TO_RATE


@kernel
def deflection(element: int, data: FloatArray, plan: IntArray, w: FloatArray) -> float:
    """Return the deflection of a nonlinear element, or its rate if its force depends on that."""
    spans = plan[asm.AT_ELEMENT_SPANS] + element
    index = plan[asm.AT_ELEMENT_INDEX]
    weights = plan[asm.AT_WEIGHTS]
    total = 0.0
    for j in range(plan[spans], plan[spans + 1]):
        total += data[weights + j] * w[plan[index + j]]
    return total


@kernel
def rate_between_ends(element: int, data: FloatArray, plan: IntArray, x: FloatArray) -> float:
    """Return the rate v of an element from a state, or its acceleration from a state's rates."""
    spans = plan[asm.AT_ELEMENT_SPANS] + element
    within = plan[plan[asm.AT_INSIDE] + element]
    total = 0.0
    for j in range(plan[spans], plan[spans + 1]):
        place = plan[plan[asm.AT_ELEMENT_INDEX] + j]
        if place != within:
            rate = place if place % PLACES >= TO_RATE else place + TO_RATE
            total += data[plan[asm.AT_WEIGHTS] + j] * x[rate]
    return total


@kernel
def depends_on_rate(element: int, plan: IntArray) -> bool:
    """Return True for an element whose force depends on its rate."""
    first = plan[plan[asm.AT_ELEMENT_SPANS] + element]
    return bool(plan[plan[asm.AT_ELEMENT_INDEX] + first] % PLACES >= TO_RATE)


@kernel
def corner_at(element: int, corner: int, plan: IntArray) -> int:
    """Return the position of the deflection of a corner in the data."""
    return plan[asm.AT_CORNERS] + asm.CORNER_COLUMNS * (plan[plan[asm.AT_ELEMENT_CORNERS] + element] + corner)


@kernel
def last_piece(element: int, plan: IntArray) -> int:
    """Return the last piece of an element's characteristic."""
    corners = plan[asm.AT_ELEMENT_CORNERS] + element
    return plan[corners + 1] - plan[corners] - 2


@kernel
def steepness(element: int, piece: int, data: FloatArray, plan: IntArray) -> float:
    """Return how the force of an element rises with its deflection on a piece of its characteristic."""
    at, after = corner_at(element, piece, plan), corner_at(element, piece + 1, plan)
    return (data[after + asm.CORNER_FORCE] - data[at + asm.CORNER_FORCE]) / (data[after] - data[at])


@kernel
def pull_of(element: int, piece: int, data: FloatArray, plan: IntArray, w: FloatArray) -> float:
    """Return the force of an element on a piece of its characteristic, or on this piece continued."""
    at = corner_at(element, piece, plan)
    beyond = deflection(element, data, plan, w) - data[at]
    return data[at + asm.CORNER_FORCE] + steepness(element, piece, data, plan) * beyond
