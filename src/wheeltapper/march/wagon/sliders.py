"""Dry friction between bodies: forces of what slides, of springs that stick, and of what sticks without one.

A slider acts against its deflection d, with the rate v. It slides forth or back with the force F, against its motion,
or it sticks. With a spring, d is that spring's, and p inside it what has slid: k·d while it sticks, p' = v while it
slides. A rigid one that sticks has a force by which v stays zero. These forces f follow together from the accelerations
b without them,

    b = Y·f,  f = Y⁺·b,

where Y is how they yield to each other. Where Y is singular, Y⁺ shares forces as equally stiff springs would. One whose
share comes to its limit while the others can hold still sticks: its force is that limit until all are decided again
(resting.py). Scratch memory holds Y⁺ of those that stick, and the rows HELD (whether each does, in Y⁺), RIGID_PULLS
(f), UNHELD (b), USES (the largest share of its limit that each has had since `forget_uses`).

What presses a slider may be a force N of the state: that of a spring. Its bounds are then factors times N, to each side
one. With a spring in series its force is the bound while it slides, so that p' = v ∓ F'/k; it sticks where that comes
to zero. Where N ends it is open: without a force, and p follows d, until N begins again.
"""

from __future__ import annotations

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import LANES, PLACES, TO_RATE
from wheeltapper.march.wagon.elements import deflection, last_piece, pull_of, rate_between_ends, steepness
from wheeltapper.march.wagon.resting import TIE, inverse_of_some

HELD, RIGID_PULLS, UNHELD, USES = range(asm.HOLD_ROWS)
SLACK = 1e-11
"""Share of its limit by which a force has to exceed it: rounding does not let a slider slide, or open."""
RESTING_RATE = 1e-12
"""Rate below which a slider rests, in static indentations per radian of phase."""


@kernel
def side_of(piece: float) -> float:
    """Return to which side a slider slides, -1 or 1, or 0: it sticks, is open, or is not decided."""
    return piece - asm.STICKS if piece <= asm.FORTH else 0.0


@kernel
def slow_rate(data: FloatArray) -> float:
    """Return the rate below which a slider rests, m/s."""
    return RESTING_RATE * data[asm.STATIC_INDENTATION] / data[asm.PULSE]


@kernel
def slider_number(element: int, column: int, data: FloatArray, plan: IntArray) -> float:
    """Return a number of a slider."""
    return data[plan[asm.AT_SLIDERS] + (element - plan[asm.LAWS]) * asm.SLIDER_COLUMNS + column]


@kernel
def pressed_number(element: int, column: int, data: FloatArray, plan: IntArray) -> float:
    """Return a number of what presses a slider."""
    return data[plan[asm.AT_PRESSED] + (element - plan[asm.LAWS]) * asm.PRESSED_COLUMNS + column]


@kernel
def is_pressed(element: int, data: FloatArray, plan: IntArray) -> bool:
    """Return True for a slider whose bounds follow a pressing force."""
    return pressed_number(element, asm.BEGINS_FORTH, data, plan) > 0.0


@kernel
def _by_spring(element: int, rated: bool, data: FloatArray, plan: IntArray, x: FloatArray) -> float:
    """Return what the linear part of a pressing force grows by in a state, or, `rated`, with its velocities."""
    spans = plan[asm.AT_PRESS_SPANS] + element - plan[asm.LAWS]
    total = 0.0
    for j in range(plan[spans], plan[spans + 1]):
        place = plan[plan[asm.AT_PRESS_INDEX] + j]
        total += data[plan[asm.AT_PRESS_WEIGHTS] + j] * x[place + TO_RATE if rated else place]
    return total


@kernel
def _pressing_piece(other: int, plan: IntArray, pieces: FloatArray) -> int:
    """Return the piece of a spring that presses; where it is free, that from which it has parted."""
    return min(int(pieces[other]), last_piece(other, plan) - 1)


@kernel
def pressing_force(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return the force that presses a slider, N; negative where what presses has parted from it."""
    force = pressed_number(element, asm.PRESSED_LOAD, data, plan) + _by_spring(element, False, data, plan, w)
    other = int(pressed_number(element, asm.PRESSED_BY, data, plan))
    if other >= 0:
        force -= pull_of(other, _pressing_piece(other, plan, pieces), data, plan, w)
    return force


@kernel
def pressing_rate(element: int, data: FloatArray, plan: IntArray, x: FloatArray, pieces: FloatArray) -> float:
    """Return how fast the pressing force grows in a state, N/s, or its second derivative from a state's rates."""
    rate = _by_spring(element, True, data, plan, x)
    other = int(pressed_number(element, asm.PRESSED_BY, data, plan))
    if other >= 0:
        slope = steepness(other, _pressing_piece(other, plan, pieces), data, plan)
        rate -= slope * rate_between_ends(other, data, plan, x)
    return rate


@kernel
def _factor(element: int, side: float, begins: bool, data: FloatArray, plan: IntArray) -> float:
    """Return the bound of a pressed slider to a side over the pressing force; `begins`: where it begins to slide."""
    column = asm.PRESSED_FORTH if side > 0.0 else asm.PRESSED_BACK
    return pressed_number(element, column + (asm.BEGINS_FORTH - asm.PRESSED_FORTH if begins else 0), data, plan)


@kernel
def bound_of(
    element: int, side: float, begins: bool, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray
) -> float:
    """Return the force with which a slider slides to a side, or, `begins`, begins to; below zero if it is open."""
    if is_pressed(element, data, plan):
        return _factor(element, side, begins, data, plan) * pressing_force(element, data, plan, w, pieces)
    return slider_number(element, asm.SLIDER_LIMIT if begins else asm.SLIDER_FORCE, data, plan)


@kernel
def bound_rate(
    element: int, side: float, begins: bool, data: FloatArray, plan: IntArray, x: FloatArray, pieces: FloatArray
) -> float:
    """Return how fast that force grows, N/s."""
    if is_pressed(element, data, plan):
        return _factor(element, side, begins, data, plan) * pressing_rate(element, data, plan, x, pieces)
    return 0.0


@kernel
def slip_rate(element: int, side: float, data: FloatArray, plan: IntArray, x: FloatArray, pieces: FloatArray) -> float:
    """Return how fast a slider slides to a side, from a state, m/s, or how that grows, from a state's rates."""
    rate = side * rate_between_ends(element, data, plan, x)
    if plan[plan[asm.AT_INSIDE] + element] >= 0:
        stiffness = slider_number(element, asm.SLIDER_STIFFNESS, data, plan)
        rate -= bound_rate(element, side, False, data, plan, x, pieces) / stiffness
    return rate


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
        if piece == asm.PARTED:
            if within >= 0:
                out[within] = rate_between_ends(element, data, plan, w)
            continue
        pull = 0.0
        if side != 0.0:
            pull = side * max(bound_of(element, side, False, data, plan, w, pieces), 0.0)
        if within >= 0 and side == 0.0:
            pull = slider_number(element, asm.SLIDER_STIFFNESS, data, plan) * deflection(element, data, plan, w)
        elif within >= 0:
            out[within] = side * slip_rate(element, side, data, plan, w, pieces)
        elif piece == asm.FULL_BACK or piece == asm.FULL_FORTH:
            side = 1.0 if piece == asm.FULL_FORTH else -1.0
            pull = side * (1.0 - TIE) * max(bound_of(element, side, True, data, plan, w, pieces), 0.0)
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
    pulls, free = hold_row(RIGID_PULLS, pieces, plan), hold_row(UNHELD, pieces, plan)
    for i in range(count):
        data[free + i] = rate_between_ends(first + i, data, plan, out)
    for i in range(count):
        if pieces[first + i] != asm.STICKS:
            continue
        pull = 0.0
        for j in range(count):
            pull += data[plan[asm.AT_HOLDS] + i * count + j] * data[free + j]
        data[pulls + i] = pull
        thrust = plan[asm.AT_THRUSTS] + i * plan[asm.BODIES] * LANES
        for body in range(plan[asm.BODIES]):
            for k in range(LANES):
                out[body * PLACES + TO_RATE + k] -= data[thrust + body * LANES + k] * pull


@kernel
def use_limits(data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> None:
    """Note how much of its limit each rigid slider that sticks has used, in a state whose forces were computed last."""
    first = plan[asm.RIGID_FROM]
    pulls, uses = hold_row(RIGID_PULLS, pieces, plan), hold_row(USES, pieces, plan)
    for i in range(pieces.shape[0] - first):
        if pieces[first + i] == asm.STICKS:
            pull = data[pulls + i]
            limit = bound_of(first + i, pull, True, data, plan, w, pieces)
            data[uses + i] = max(data[uses + i], abs(pull) / limit if limit > 0.0 else 2.0)


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
    """Write Y⁺ of the rigid sliders that stick, if others did before, and the mobility that they leave."""
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
        motions = plan[asm.BODIES] * LANES
        for k in range(motions):
            less = 0.0
            for i in range(count):
                for j in range(count):
                    others = inverse[i, j] * data[plan[asm.AT_THRUSTS] + j * motions + k]
                    less += data[plan[asm.AT_THRUSTS] + i * motions + k] * others
            data[plan[asm.AT_OWN_MOBILITY] + k] = data[plan[asm.AT_MOBILITY] + k] - less


@kernel
def pressed_share(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return the force that presses a slider, over what it is at rest, or near it."""
    factor = max(_factor(element, -1.0, True, data, plan), _factor(element, 1.0, True, data, plan))
    reference = slider_number(element, asm.SLIDER_LIMIT, data, plan)
    return factor * pressing_force(element, data, plan, w, pieces) / reference


@kernel
def slider_gap(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return how far a slider is from its change: a share of its limit while it sticks, a rate while it slides.

    Of a rigid one that sticks, for the state whose rates were computed last. While it is open, a share of its load.
    """
    if pieces[element] == asm.PARTED:
        return SLACK - pressed_share(element, data, plan, w, pieces)
    side = side_of(pieces[element])
    if side != 0.0:
        return slip_rate(element, side, data, plan, w, pieces) + slow_rate(data)
    pull = sticking_pull(element, data, plan, w, pieces)
    limit = bound_of(element, pull, True, data, plan, w, pieces)
    return SLACK + (limit - abs(pull)) / slider_number(element, asm.SLIDER_LIMIT, data, plan)


@kernel
def load_gap(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return how far a slider that slides is from being open, as a share of its load."""
    return SLACK + pressed_share(element, data, plan, w, pieces)


@kernel
def sticking_pull(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return the force of a slider that sticks; of a rigid one that which was computed last."""
    if element >= plan[asm.RIGID_FROM]:
        return data[hold_row(RIGID_PULLS, pieces, plan) + element - plan[asm.RIGID_FROM]]
    return slider_number(element, asm.SLIDER_STIFFNESS, data, plan) * deflection(element, data, plan, w)


@kernel
def left_to_limit_rate(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return how fast what is left to the limit of a slider with a spring, which sticks, grows, N/s."""
    side = 1.0 if deflection(element, data, plan, w) > 0.0 else -1.0
    grows = side * slider_number(element, asm.SLIDER_STIFFNESS, data, plan) * rate_between_ends(element, data, plan, w)
    return bound_rate(element, side, True, data, plan, w, pieces) - grows
