"""Dry friction between bodies: forces of what slides, of springs that stick, and of what sticks without one.

A slider acts against its deflection d, with the rate v. It slides forth or back with the force ±F, or it sticks. With a
spring, d is that spring's, and p inside it what has slid: k·d while it sticks, p' = v while it slides. A rigid one that
sticks has a force by which v stays zero. These forces f follow together from the accelerations b without them,

    b = Y·f,  f = Y⁺·b,

where Y is how they yield to each other. Where Y is singular, Y⁺ shares forces as equally stiff springs would. One whose
share comes to its limit while the others can hold still sticks: its force is that limit until all are decided again
(resting.py). Scratch memory holds Y⁺ of those that stick, and the rows HELD (whether each does, in Y⁺), RIGID_PULLS
(f), UNHELD (b), USES (the largest share of its limit that each has had since `forget_uses`).
"""

from __future__ import annotations

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import LANES, PLACES, TO_RATE
from wheeltapper.march.wagon.resting import TIE, inverse_of_some

HELD, RIGID_PULLS, UNHELD, USES = range(asm.HOLD_ROWS)
SLACK = 1e-11
"""Share of its limit by which a force has to exceed it: rounding does not let a slider slide."""
RESTING_RATE = 1e-12
"""Rate below which a slider rests, in static indentations per radian of phase."""


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
def side_of(piece: float) -> float:
    """Return to which side a slider slides, -1 or 1, or 0: it sticks, or is not decided."""
    return piece - asm.STICKS if piece <= asm.FORTH else 0.0


@kernel
def slow_rate(data: FloatArray) -> float:
    """Return the rate below which a slider rests, m/s."""
    return RESTING_RATE * data[asm.STATIC_INDENTATION] / data[asm.PULSE]


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
def slider_number(element: int, column: int, data: FloatArray, plan: IntArray) -> float:
    """Return a number of a slider."""
    return data[plan[asm.AT_SLIDERS] + (element - plan[asm.LAWS]) * asm.SLIDER_COLUMNS + column]


@kernel
def hold_row(row: int, pieces: FloatArray, plan: IntArray) -> int:
    """Return where a row of the scratch memory of rigid sliders begins."""
    count = pieces.shape[0] - plan[asm.RIGID_FROM]
    return plan[asm.AT_HOLDS] + (count + row) * count


@kernel
def add_slider_forces(
    data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray, Q: FloatArray, out: FloatArray
) -> None:
    """Add the forces of all sliders but of rigid ones that stick, and the rates inside them."""
    for element in range(plan[asm.LAWS], pieces.shape[0]):
        piece = pieces[element]
        side = side_of(piece)
        within = plan[plan[asm.AT_INSIDE] + element]
        pull = side * slider_number(element, asm.SLIDER_FORCE, data, plan)
        if within >= 0 and side == 0.0:
            pull = slider_number(element, asm.SLIDER_STIFFNESS, data, plan) * deflection(element, data, plan, w)
        elif within >= 0:
            out[within] = rate_between_ends(element, data, plan, w)
        elif piece == asm.FULL_BACK or piece == asm.FULL_FORTH:
            full = (1.0 - TIE) * slider_number(element, asm.SLIDER_LIMIT, data, plan)
            pull = full if piece == asm.FULL_FORTH else -full
        elif side == 0.0:
            continue
        spans = plan[asm.AT_ELEMENT_SPANS] + element
        for j in range(plan[spans], plan[spans + 1]):
            place = plan[plan[asm.AT_ELEMENT_INDEX] + j]
            if place != within:
                Q[(place // PLACES) * LANES + place % LANES] -= data[plan[asm.AT_WEIGHTS] + j] * pull


@kernel
def hold_rigid(data: FloatArray, plan: IntArray, pieces: FloatArray, out: FloatArray) -> None:
    """Correct the rates of the state by the forces of rigid sliders that stick."""
    first = plan[asm.RIGID_FROM]
    count = pieces.shape[0] - first
    pulls, free, uses = (
        hold_row(RIGID_PULLS, pieces, plan),
        hold_row(UNHELD, pieces, plan),
        hold_row(USES, pieces, plan),
    )
    for i in range(count):
        data[free + i] = rate_between_ends(first + i, data, plan, out)
    for i in range(count):
        if pieces[first + i] != asm.STICKS:
            continue
        pull = 0.0
        for j in range(count):
            pull += data[plan[asm.AT_HOLDS] + i * count + j] * data[free + j]
        data[pulls + i] = pull
        data[uses + i] = max(data[uses + i], abs(pull) / slider_number(first + i, asm.SLIDER_LIMIT, data, plan))
        thrust = plan[asm.AT_THRUSTS] + i * plan[asm.BODIES] * LANES
        for body in range(plan[asm.BODIES]):
            for k in range(LANES):
                out[body * PLACES + TO_RATE + k] -= data[thrust + body * LANES + k] * pull


@kernel
def forget_uses(data: FloatArray, plan: IntArray, pieces: FloatArray) -> None:
    """Forget how much of their limits rigid sliders have used."""
    uses = hold_row(USES, pieces, plan)
    for i in range(pieces.shape[0] - plan[asm.RIGID_FROM]):
        data[uses + i] = 0.0


@kernel
def yields_between(count: int, data: FloatArray, plan: IntArray) -> FloatArray:
    """Return Y of all rigid sliders."""
    return data[plan[asm.AT_YIELDS] : plan[asm.AT_YIELDS] + count * count].reshape(count, count)


@kernel
def enter_holds(data: FloatArray, plan: IntArray, pieces: FloatArray) -> None:
    """Write Y⁺ of the rigid sliders that stick, if others did before."""
    first = plan[asm.RIGID_FROM]
    count = pieces.shape[0] - first
    held = hold_row(HELD, pieces, plan)
    changed = False
    for i in range(count):
        sticks = 1.0 if pieces[first + i] == asm.STICKS else 0.0
        changed = changed or data[held + i] != sticks  # which is nothing at first
        data[held + i] = sticks
    if changed:
        inverse = inverse_of_some(data[held : held + count], yields_between(count, data, plan))
        for i in range(count):
            for j in range(count):
                data[plan[asm.AT_HOLDS] + i * count + j] = inverse[i, j]


@kernel
def slider_gap(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return how far a slider is from its change: a share of its limit while it sticks, a rate while it slides.

    Of a rigid one that sticks, for the state whose rates were computed last.
    """
    side = side_of(pieces[element])
    if side != 0.0:
        return side * rate_between_ends(element, data, plan, w) + slow_rate(data)
    return (
        1.0
        + SLACK
        - abs(sticking_pull(element, data, plan, w, pieces)) / slider_number(element, asm.SLIDER_LIMIT, data, plan)
    )


@kernel
def sticking_pull(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return the force of a slider that sticks; of a rigid one that which was computed last."""
    if element >= plan[asm.RIGID_FROM]:
        return data[hold_row(RIGID_PULLS, pieces, plan) + element - plan[asm.RIGID_FROM]]
    return slider_number(element, asm.SLIDER_STIFFNESS, data, plan) * deflection(element, data, plan, w)
