"""The marcher for a damper with an end of its own: as single.py, with steps that also end where a stop is met or left.

play   the end z stays within the half-gap g of the wheel, |y - z| <= g; held at its upper stop, y - z = g, it moves
       with the wheel as long as this moves outwards, v > 0 (the lower stop is the mirror image); free, it rests
bush   e is its deflection: the end moves with e·B/G of the bush's force on the damper; a stop holds while e > 0

for each step: the series of the mode that holds -> does the end meet or leave a stop right here? then of the other mode
               -> its length; cut where y - z = ±g (free), v = 0 (held, rigid) or e = 0 (held by a bush)
               -> what else ends it, force maxima, the step's row, the state at its end: as in single.py
An event is only ever taken at the start of the step behind it, from the state and where its series head: so it makes no
difference whether it coincides with a loss, an impact or a breakpoint, or begins a run.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march import telling
from wheeltapper.march.damper_hold import changes_at, changes_hold, sharpened, stretch
from wheeltapper.march.damper_series import contact_with_end, flight_reach_with_end, flight_with_end, held
from wheeltapper.march.events import (
    AT_BREAK,
    GRAZE,
    LIFT,
    cross_break,
    follow_on,
    follow_to_break,
    free_acceleration,
    log_step,
)
from wheeltapper.march.kernel import is_compiled, kernel
from wheeltapper.march.layout import (
    BUSH,
    CLEAR,
    COUNT,
    ENDED_SCRATCH,
    EVENTS,
    FLIGHT_ORDER,
    IDLE,
    MARK,
    OPENED,
    PEAKS,
    STATE,
    STOPS,
    WHEEL_V,
    WHEEL_Y,
    N,
    T,
    U,
    W,
    Y,
    Z,
)
from wheeltapper.march.program import (
    CONTACT,
    DAMPER_PLAY,
    DAMPER_START,
    DECK_V,
    DECK_Y,
    DONE,
    END_DEFLECTION,
    END_MODE,
    END_PLACE,
    ENDED_COLUMNS,
    FLIGHT,
    FREE,
    FULL,
    LINKED,
    NOT_FINITE,
    ON_DECK,
    PHASE,
    PIECE,
    RELEASED,
    RUNNING,
    SHIFT,
    STALLED,
    STOP_COLUMNS,
    TIME,
    TOO_MANY_EVENTS,
    A,
    B,
    FloatArray,
    Program,
)
from wheeltapper.march.roots import NONE, evaluate
from wheeltapper.march.series import localise, path_at
from wheeltapper.march.single import March, arrive, conclude, grown, next_break, start_kernel, tabled, tables
from wheeltapper.march.step import (
    BREAK,
    NOTHING,
    OPENS,
    contact_end,
    contact_reach,
    flight_end,
    is_bad,
    trend_series,
)
from wheeltapper.march.steplength import steplength

MOST_SWITCHES = 2
"""Changes of what holds the end at the start of one step: a gap within rounding has both stops at one place."""
FORGIVEN = 2.0
"""Binary logarithm of how much larger than by a steady decay earlier terms may be before they shorten a step."""


@kernel
def _reach(numbers: FloatArray, damper: FloatArray, S: FloatArray) -> float:
    """Return the step in s at which the last terms of the series, of the bush's too, reach the tolerance.

    A step that leaves a stop begins where the wheel turns. On a stiff rail all is then symmetric in s, the last two
    terms of u and w are one number, and where that passes zero it says nothing; so two more have a say.
    """
    order = int(numbers[contract.ORDER])
    goal = np.log2(numbers[contract.TOLERANCE])
    G, soft, rate = held(S[STATE + END_MODE], damper)
    length = contact_reach(numbers, numbers[contract.STIFFNESS] + G + soft + rate, S)
    u, w = U + order - 2, W + order - 2
    earlier = goal * (order - 3) / (order - 1) + FORGIVEN
    length = min(length, steplength(order - 2, abs(S[u - 1]), abs(S[w - 1]), abs(S[u]), abs(S[w]), earlier))
    if soft == 0.0:
        return length
    gain = max(1.0, soft)
    before, last = gain * abs(S[BUSH + order - 1]), gain * abs(S[BUSH + order])
    return min(length, steplength(order, before, 0.0, last, 0.0, goal))


@kernel
def _turns(order: int, length: float, w: float, S: FloatArray) -> bool:
    """Return False where the indentation's rate, `w` at the step's end, keeps its sign for sure."""
    sway = 0.0
    for k in range(order, 0, -1):
        sway = (sway + k * abs(S[W + k])) * length
    return not (S[W] * w > 0.0 and abs(S[W]) + abs(w) > sway)


@kernel
def _contact_step(
    numbers: FloatArray, damper: FloatArray, until: float, steps: FloatArray, events: FloatArray, peaks: FloatArray,
    stops: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Make one step in contact; return what ended it."""
    order = int(numbers[contract.ORDER])
    tolerance = numbers[contract.TOLERANCE]
    length = 0.0
    for switched in range(MOST_SWITCHES + 1):
        contact_with_end(numbers, order, damper, S[STATE : STATE + ENDED_COLUMNS], S)
        length = _reach(numbers, damper, S)
        if switched == MOST_SWITCHES or not changes_hold(damper, WHEEL_Y, order, length, tolerance, stops, S):
            break
    root = changes_at(damper, WHEEL_Y, WHEEL_V, order, length, S)
    if root != NONE:
        length = sharpened(damper, order, root, length, S)
    after = evaluate(S, T, order, length)
    u = evaluate(S, U, order, length)
    w = evaluate(S, W, order, length)
    turns = _turns(order, length, w, S)
    length, what, after, u, w = contact_end(numbers, order, until - S[STATE + TIME], length, after, u, w, turns, S)
    trend, degree = trend_series(numbers, order, S)
    follow_on(max(S[N], 0.0), peaks, S)
    conclude(numbers, until, length, after, u, w, what, trend, degree, turns, steps, events, peaks, S)
    stretch(damper, order, length, S)
    if what == NOTHING and root != NONE and numbers[contract.HYSTERESIS] != 0.0:
        S[MARK + AT_BREAK] = 1.0  # the force's own rate may jump with the damper's force
    return what


@kernel
def _flight_step(
    numbers: FloatArray, damper: FloatArray, until: float, landed: bool, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, stops: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Make one step in flight or released; return what ended it. `landed`: this flight begins at δ = 0."""
    time = S[STATE + TIME]
    released = S[STATE + PHASE] == RELEASED
    tolerance = numbers[contract.TOLERANCE]
    reach = 0.0
    for switched in range(MOST_SWITCHES + 1):
        flight_with_end(numbers, damper, S[STATE : STATE + ENDED_COLUMNS], S)
        reach = min(until - time, flight_reach_with_end(numbers, damper, S[STATE : STATE + ENDED_COLUMNS]))
        if switched == MOST_SWITCHES or not changes_hold(damper, U, FLIGHT_ORDER, reach, tolerance, stops, S):
            break
    if landed:
        S[CLEAR] = 0.0
    root = changes_at(damper, U, W, FLIGHT_ORDER, reach, S)
    if root != NONE:
        reach = root
    length, what = flight_end(numbers, released, reach, S)
    if what == BREAK and reach < until - time:
        what = NOTHING
    follow_on(0.0, peaks, S)
    if what == BREAK:
        follow_to_break(until, 0.0, peaks, S)
    log_step(length, steps, S)
    stretch(damper, FLIGHT_ORDER, length, S)
    S[STATE + TIME] = until if what == BREAK else time + length
    S[STATE + A] = evaluate(S, U, FLIGHT_ORDER, length)
    S[STATE + B] = evaluate(S, W, FLIGHT_ORDER, length)
    if numbers[contract.DECK_MASS] > 0.0:
        S[STATE + DECK_Y] = evaluate(S, Y, FLIGHT_ORDER, length)
        S[STATE + DECK_V] = evaluate(S, Z, FLIGHT_ORDER, length)
    if what != NOTHING and what != BREAK:
        arrive(numbers, what, length, events, S)
    return what


@kernel
def _rest(numbers: FloatArray, damper: FloatArray, S: FloatArray) -> None:
    """Go on from a contact without indentation and without rate, along the motion that it starts."""
    y, v, _ = path_at(0.0, S)
    if S[STATE + ON_DECK] != 0.0:
        y += S[STATE + DECK_Y]
        v += S[STATE + DECK_V]
    v -= S[STATE + B]
    G, soft, _ = held(S[STATE + END_MODE], damper)
    a = free_acceleration(numbers, y, v, S) + G * v + soft * S[STATE + END_DEFLECTION]
    if a > 0.0:
        S[STATE + A] = LIFT
        S[STATE + B] = LIFT * sqrt(2.0 * a)
        S[STATE + TIME] += LIFT * sqrt(2.0 / a)
        S[COUNT + OPENED] = 0.0
    else:
        S[STATE + PHASE] = FLIGHT
        S[STATE + A] = y
        S[STATE + B] = v
        S[COUNT + OPENED] = 1.0


@kernel
def advance_kernel(
    pieces: FloatArray, numbers: FloatArray, damper: FloatArray, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, stops: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Make the next step, over a breakpoint at its end; return RUNNING, or why the march stops."""
    if (
        S[COUNT] + 1 > steps.shape[0]
        or S[COUNT + EVENTS] + 4 > events.shape[0]
        or S[COUNT + PEAKS] + 8 > peaks.shape[0]
        or S[STOPS] + 4 > stops.shape[0]
    ):
        return FULL
    if S[COUNT + EVENTS] + S[STOPS] >= numbers[contract.EVENT_LIMIT]:
        return TOO_MANY_EVENTS
    time = S[STATE + TIME]
    until = next_break(pieces, numbers, S)
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
    if S[STATE + PHASE] == CONTACT and S[STATE + A] == 0.0 and abs(S[STATE + B]) < GRAZE:
        _rest(numbers, damper, S)
        return RUNNING
    if S[STATE + PHASE] == CONTACT:
        what = _contact_step(numbers, damper, until, steps, events, peaks, stops, S)
    else:
        what = _flight_step(numbers, damper, until, S[COUNT + OPENED] != 0.0, steps, events, peaks, stops, S)
    S[COUNT + OPENED] = 1.0 if what == OPENS else 0.0
    state = S[STATE + TIME] + S[STATE + A] + S[STATE + B] + S[STATE + DECK_Y] + S[STATE + DECK_V]
    if is_bad(state + S[STATE + END_DEFLECTION]):
        return NOT_FINITE
    S[COUNT + IDLE] = S[COUNT + IDLE] + 1.0 if S[STATE + TIME] <= time else 0.0
    if S[COUNT + IDLE] > 1000:
        return STALLED
    if what == BREAK:
        if S[STATE + TIME] >= numbers[contract.END]:
            return DONE
        localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], S[STATE + TIME], S)
        return cross_break(pieces, numbers, events, S)
    return RUNNING


@kernel
def damper_kernel(
    pieces: FloatArray, numbers: FloatArray, damper: FloatArray, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, stops: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """March from the state in S until the end, or until a table is full; return why it stopped. May be called again."""
    status = RUNNING
    while status == RUNNING:
        status = advance_kernel(pieces, numbers, damper, steps, events, peaks, stops, S)
    return status


def _start(program: Program, events: FloatArray, work: FloatArray) -> None:
    """Set the state at time zero; the end is where in the gap it is said to be, about the wheel."""
    start_kernel(program.pieces, program.numbers, events, work)
    play, share = program.damper[DAMPER_PLAY], program.damper[DAMPER_START]
    work[STATE + END_MODE] = FREE if play > 0.0 else LINKED
    work[STATE + END_PLACE] = program.numbers[contract.START_HEIGHT] + share * play


def _arguments(program: Program) -> tuple[Any, ...]:
    """Return the arguments of the kernel at the start of a march."""
    _, events, peaks, _ = tables()
    room = np.empty((8192, ENDED_COLUMNS)), events, peaks, np.empty((256, STOP_COLUMNS))
    return program.pieces, program.numbers, program.damper, *room, np.zeros(ENDED_SCRATCH)


def is_ready(program: Program) -> bool:
    """Return False where marching this program begins with compiling its kernel."""
    return is_compiled(damper_kernel, _arguments(program))


def march(program: Program, tell: telling.Tell = telling.untold) -> tuple[March, FloatArray]:
    """March a program whose damper has an end of its own; return also the events of the end, (events, STOP_COLUMNS)."""
    pieces, numbers, damper, steps, events, peaks, stops, work = _arguments(program)
    _start(program, events, work)
    while True:
        room = steps[: int(work[COUNT]) + telling.CHUNK]
        status = damper_kernel(pieces, numbers, damper, room, events, peaks, stops, work)
        if status != FULL or tell(work[STATE + TIME]):
            return tabled(status, steps, events, peaks, work), stops[: int(work[STOPS])]
        used = work[COUNT : COUNT + 3].astype(int)
        steps, events, peaks = grown(steps, used[0]), grown(events, used[1]), grown(peaks, used[2])
        stops = grown(stops, work[STOPS])
