"""Derivatives of a march with respect to parameters: its steps are repeated, with their tangents.

LANES directions at a time; in each, the numbers of the program, the pieces of the path and the start change at given
rates. Between events the regularised system is differentiated (every product by its rule, every series analytic):

contact row   tangents at fixed s of t, u, w, Y, Z            flight row   tangents at fixed time of y, v, Y, Z
for each row: series, tangents of the series -> force maxima inside it -> its end
at the end of a contact, and at every breakpoint: to fixed time, where y, v, Y, Z are continuous
    (but where the force itself jumps: v_p += (a_before - a_after)·dt_b/dp)
at a landing: t_p = -g_p/g', u_p = 0, all else the total derivative along the event

See docs/theory/maps.rst, section 9.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, kernel, uncounted_kernel
from wheeltapper.march.common.program import LENGTH, ON_DECK, PHASE, PIECE, SHIFT, TIME, A, B, FloatArray
from wheeltapper.march.steps import layout, tangent_path, variants
from wheeltapper.march.steps.calling import call_turned
from wheeltapper.march.steps.layout import N, T, U, W, Y, Z
from wheeltapper.march.steps.series import localise
from wheeltapper.march.steps.tangent_path import DA, DB, DBREAK, DT, DY, DZ, LANES
from wheeltapper.march.wheel import tangent_events, tangent_samples
from wheeltapper.march.wheel.dense import OUT_COLUMNS, OUT_FORCE, fill_motion
from wheeltapper.march.wheel.events import is_free
from wheeltapper.march.wheel.roots import evaluate
from wheeltapper.march.wheel.step import repeat_step
from wheeltapper.march.wheel.tangent_events import AFTER, FIRST, FOURTH, SECOND, THIRD
from wheeltapper.march.wheel.tangent_lanes import LINK_ROWS, Links, follow_link, link_steps
from wheeltapper.march.wheel.tangent_peaks import is_inside, peaks_inside
from wheeltapper.march.wheel.tangent_samples import sample_point, sample_tangents

NEAR_GRAZING = 0.1
"""Distance from u = w = 0 (scaled) below which a contact step is examined."""


@uncounted_kernel
def _differentiate(
    pieces: FloatArray, numbers: FloatArray, lossy: bool, step: FloatArray, S: FloatArray, D: FloatArray
) -> None:
    """Put the series of a step in S, and their changes at fixed s, or in flight at fixed time, in D."""
    repeat_step(pieces, numbers, step, S)
    if step[PHASE] == contract.CONTACT:
        number = variants.variant_of(numbers, pieces[int(step[PIECE])], False)
        if lossy and not variants.is_lossy(number):  # what is differentiated counts as there
            number += variants.OF_LOSSY
    else:
        number = variants.free_variant_of(numbers) - variants.FLIES + variants.OF_ENDED
    if S[layout.DERIVATIVES + number] == 0.0:
        D[: layout.HERE] = np.nan  # nobody has written it
        return
    call_turned(S[layout.DERIVATIVES + number], numbers, S, D)


@uncounted_kernel
def _step_tangents(
    pieces: FloatArray, numbers: FloatArray, lossy: bool, step: FloatArray, carried: FloatArray, end: FloatArray,
    S: FloatArray, D: FloatArray,
) -> None:  # fmt: skip
    """Carry the tangents over a localised step, in contact at fixed s; write the motion at its end."""
    contact, deck, x = step[PHASE] == contract.CONTACT, numbers[contract.DECK_MASS] > 0.0, step[LENGTH]
    order = int(numbers[contract.ORDER]) if contact else int(layout.FLIGHT_ORDER)
    _differentiate(pieces, numbers, lossy, step, S, D)
    if contact:
        tangent_path.sums_at(D, T, order, x, carried[DT])
    tangent_path.sums_at(D, U, order, x, carried[DA])
    tangent_path.sums_at(D, W, order, x, carried[DB])
    if deck:
        tangent_path.sums_at(D, Y, order, x, carried[DY])
        tangent_path.sums_at(D, Z, order, x, carried[DZ])
    end[AFTER] = evaluate(S, T, order, x) if contact else x
    end[FIRST] = evaluate(S, U, order, x)
    end[SECOND] = evaluate(S, W, order, x)
    end[THIRD] = evaluate(S, Y, order, x) if deck else 0.0
    end[FOURTH] = evaluate(S, Z, order, x) if deck else 0.0


@uncounted_kernel
def _add_impulse(numbers: FloatArray, length: float, impulse: FloatArray, S: FloatArray, D: FloatArray) -> None:
    """Add the derivatives, at fixed s, of a contact step's impulse."""
    call_turned(S[layout.DERIVATIVES + variants.TURN_PUSH], numbers, S, D)
    power = 1.0
    for n in range(int(numbers[contract.ORDER])):
        power *= length
        for lane in range(LANES):
            impulse[lane] += power / (n + 1) * D[layout.PUSH + n, lane]


class Made(NamedTuple):
    """A march of one cell; `last` is the state at its end."""

    pieces: FloatArray
    numbers: FloatArray
    steps: FloatArray
    last: FloatArray
    events: FloatArray
    peaks: FloatArray


class Changes(NamedTuple):
    """How a cell changes along directions.

    Attributes
    ----------
    numbers
        (NUMBERS, LANES).
    start
        Of the start's displacement and velocity beside those of the numbers, (2, LANES), perhaps also of the deck's,
        (4, LANES).
    bends, base, table
        Derivatives of all pieces of tables that bend, the first of this cell's, and which of the tables each lane has.
    """

    numbers: FloatArray
    start: FloatArray
    bends: FloatArray
    base: int
    table: contract.IntArray


class Rates(NamedTuple):
    """Derivatives that are written.

    Attributes
    ----------
    events, peaks
        Of time and rate, and of time and force, (rows, 2, LANES).
    end
        Of y, v, Y, Z at the march's end, at fixed time, (4, LANES).
    highest, impulses
        Of the wheel's highest position (LANES,), and of the impulses (rows, LANES), where a tally is kept.
    """

    events: FloatArray
    peaks: FloatArray
    end: FloatArray
    highest: FloatArray
    impulses: FloatArray


@kernel
def repeat_kernel(
    made: Made, along: Changes, rates: Rates, highest_time: float, times: FloatArray, samples: FloatArray,
    S: FloatArray, D: FloatArray, tallied: bool | None, cell: int, links: Links | None,
) -> float:  # fmt: skip
    """Do what `tangent_kernel` says; contact steps of `cell` may go from link to link (tangent_lanes.py)."""
    pieces, numbers, steps, last, events, peaks = made
    turns, start, bends, base, table = along
    of_events, of_peaks, of_end, of_highest, of_impulses = rates
    carried = D[layout.CARRIED : layout.TURNED_ROWS]
    here = np.zeros(OUT_COLUMNS)
    there = np.zeros(OUT_COLUMNS)
    point = np.zeros((tangent_samples.QUANTITIES, tangent_samples.SAMPLED))
    end = np.zeros(5)
    event = 0
    peak = 0
    gentlest = np.inf
    begun = False
    level = False
    leapt = -1  # the maximum to which the force has just jumped up
    piece = -1.0
    lossy = False
    sample = 0
    flew = False
    opened = False
    contacts = 0
    highest = False
    for lane in range(LANES):
        for k in range(contract.NUMBERS):
            D[layout.OF_NUMBERS + k, lane] = turns[k, lane]
        for k in range(len(carried)):
            carried[k, lane] = 0.0
        lossy = lossy or turns[contract.HYSTERESIS, lane] != 0.0
        carried[DA, lane] = turns[contract.START_HEIGHT, lane] + start[tangent_path.OF_HEIGHT, lane]
        carried[DB, lane] = turns[contract.START_VELOCITY, lane] + start[tangent_path.OF_VELOCITY, lane]
        carried[tangent_path.DSHIFT, lane] = turns[contract.START_SHIFT, lane]
        if len(start) > tangent_path.OF_DECK_VELOCITY:
            carried[DY, lane] = start[tangent_path.OF_DECK_HEIGHT, lane]
            carried[DZ, lane] = start[tangent_path.OF_DECK_VELOCITY, lane]
    for i in range(len(steps)):
        step = steps[i]
        after = steps[i + 1] if i + 1 < len(steps) else last
        contact = step[PHASE] == contract.CONTACT
        on_deck = step[ON_DECK] != 0.0
        linked = False
        if links is not None:
            if i % LINK_ROWS == 0:
                link_steps(cell, i, steps, turns, bends, table, carried, links)
            linked = links.known[i % LINK_ROWS] != 0
            if (
                begun
                and linked
                and leapt < 0
                and _goes_on_smoothly(pieces, numbers, steps, i, events, event, peaks, peak)
            ):
                follow_link(i % LINK_ROWS, numbers[contract.DECK_MASS] > 0.0, carried, end, links)
                if _turns_near(step, end):
                    localise(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
                    piece = -1.0
                    gentlest = min(gentlest, _approach(pieces, numbers, step, end, S))
                if abs(step[TIME] + end[AFTER] - after[TIME]) > 1e-9 * (1.0 + abs(after[TIME])):
                    gentlest = 0.0
                    carried[:] = np.nan
                if after[PIECE] != step[PIECE] or after[SHIFT] != step[SHIFT]:
                    tangent_events.cross_in_contact(
                        pieces, bends, base, table, numbers, turns, step, after, end, carried, S, D
                    )
                continue
            if i > 0 and leapt < 0 and _flies_on(steps, i, events, event, peaks, peak):
                # whatever piece stands in S: the path does not matter in flight
                _step_tangents(pieces, numbers, lossy, step, carried, end, S, D)
                tangent_events.break_moves(bends, base, table, numbers, turns, step, after, carried)
                begun = False
                continue
        if i == 0 and step[TIME] > 0.0:
            gentlest = 0.0  # it began at u = w = 0, and left that by a small leap
            carried[:] = np.nan
        if not (level and step[PIECE] == piece):  # a level piece looks the same from everywhere
            localise(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
            tangent_path.show_piece(pieces, bends, base, table, step, step[TIME], S, D)
            call_turned(S[layout.DERIVATIVES + variants.TURN_PIECE], numbers, S, D)
            level = S[layout.HERE_DEGREE] == 0.0 and S[layout.HERE_FACTOR_DEGREE] < 0.0 and S[layout.HERE_OMEGA] == 0.0
            piece = step[PIECE]
        if contact and not begun and not tangent_events.enter_contact(step, carried, S, D):
            gentlest = 0.0
        if i == 0 and contact:
            gentlest = min(gentlest, max(step[A], abs(step[B])))
        restarted = contact and not begun
        if leapt >= 0:
            tangent_events.leapt_force(numbers, turns, step, carried, S, D, of_peaks[leapt], here)
            leapt = -1
        begun = contact
        if tallied is not None:
            if is_free(step[PHASE]):
                opened = False
            elif flew:
                opened = True
                of_impulses[contacts] = 0.0
                contacts += 1
            flew = is_free(step[PHASE])
        if not contact:
            _step_tangents(pieces, numbers, lossy, step, carried, end, S, D)
            peak = peaks_inside(numbers, step, after[TIME], peaks, peak, of_peaks, S, D)
        elif linked:
            if is_inside(peaks, peak, after[TIME]):
                _differentiate(pieces, numbers, lossy, step, S, D)
                peak = peaks_inside(numbers, step, after[TIME], peaks, peak, of_peaks, S, D)
            if links is not None:
                follow_link(i % LINK_ROWS, numbers[contract.DECK_MASS] > 0.0, carried, end, links)
            if _turns_near(step, end):
                gentlest = min(gentlest, _approach(pieces, numbers, step, end, S))
        else:
            _step_tangents(pieces, numbers, lossy, step, carried, end, S, D)
            if _turns_near(step, end):
                near = tangent_events.closest_approach(step, int(numbers[contract.ORDER]), end[FIRST], end[SECOND], S)
                gentlest = min(gentlest, near)
            peak = peaks_inside(numbers, step, after[TIME], peaks, peak, of_peaks, S, D)
        until = after[TIME] if i + 1 < len(steps) else np.inf
        sample = sample_tangents(numbers, turns, step, until, sample, times, samples, here, S, D)
        if tallied is not None:
            if opened and contact:
                if restarted:  # the part before a moving breakpoint was counted up to it, with the force there
                    of_impulses[contacts - 1] -= S[N] * carried[DBREAK]
                _add_impulse(numbers, step[LENGTH], of_impulses[contacts - 1], S, D)
            if not highest and highest_time <= after[TIME]:
                highest = True
                sample_point(numbers, turns, step, highest_time, point, here, S, D)
                at_end = i + 1 == len(steps) and highest_time == after[TIME]
                height = point[tangent_samples.SAMPLED_WHEEL_Y]
                for lane in range(LANES):
                    moved = turns[contract.END, lane] if at_end else 0.0
                    of_highest[lane] = height[tangent_samples.FIRST_LANE + lane] + height[tangent_samples.RATE] * moved
        if abs(step[TIME] + end[AFTER] - after[TIME]) > 1e-9 * (1.0 + abs(after[TIME])):
            gentlest = 0.0  # the march left a grazing contact by a small leap, which has no tangent
            carried[:] = np.nan
        if (
            contact
            and after[PHASE] == contract.CONTACT
            and after[PIECE] == step[PIECE]
            and after[SHIFT] == step[SHIFT]
            and after[ON_DECK] == step[ON_DECK]
            and i + 1 < len(steps)
        ):
            continue
        begun = False
        fill_motion(numbers, step, end[AFTER], end[FIRST], end[SECOND], end[THIRD], end[FOURTH], S, here)
        tangent_events.break_moves(bends, base, table, numbers, turns, step, after, carried)
        if contact:
            tangent_events.leave_contact(here, end, on_deck, carried, S, D)
            if tallied is not None and opened:
                of_impulses[contacts - 1] += here[OUT_FORCE] * (carried[DBREAK] - carried[DT])
        while peak < len(peaks) and peaks[peak, contract.PEAK_TIME] <= after[TIME]:
            for lane in range(LANES):  # a maximum at a breakpoint: its force along the moving breakpoint
                of_peaks[peak, tangent_path.OF_TIME, lane] = carried[DBREAK, lane]
                size = tangent_events.corner_force(numbers, turns, step, end, here, carried, lane, S, D)
                of_peaks[peak, tangent_path.OF_SIZE, lane] = size
            if (contact or is_free(step[PHASE])) and peaks[peak, contract.PEAK_FORCE] > here[OUT_FORCE] * (1.0 + 1e-9):
                leapt = peak
            peak += 1
        for lane in range(LANES):
            of_end[tangent_path.OF_HEIGHT, lane] = carried[DA, lane]
            of_end[tangent_path.OF_VELOCITY, lane] = carried[DB, lane]
            of_end[tangent_path.OF_DECK_HEIGHT, lane] = carried[DY, lane]
            of_end[tangent_path.OF_DECK_VELOCITY, lane] = carried[DZ, lane]
        landed = False
        while event < len(events) and events[event, contract.EVENT_TIME] <= after[TIME]:
            broke = events[event, contract.EVENT_CAUSE] != 0.0
            if not broke and (step[PHASE] == contract.RELEASED or after[PHASE] == contract.RELEASED):
                bend = tangent_events.force_turns_on_or_off(
                    numbers, turns, here, carried, on_deck, end[AFTER], of_events[event], S, D
                )
                gentlest = min(gentlest, bend)
                event += 1
                continue
            gentlest = min(gentlest, abs(events[event, contract.EVENT_RATE]))
            landed = not broke and events[event, contract.EVENT_KIND] == contract.IMPACT
            if landed:
                tangent_events.land_tangents(here, carried, on_deck, end[AFTER], S, D)
                begun = True
            for lane in range(LANES):
                of_events[event, tangent_path.OF_TIME, lane] = carried[DBREAK, lane] if broke else carried[DT, lane]
                if broke or not (landed or contact):
                    of_events[event, tangent_path.OF_SIZE, lane] = np.nan
                else:
                    of_events[event, tangent_path.OF_SIZE, lane] = (
                        carried[DB, lane] if landed else carried[tangent_path.DW, lane]
                    )
            event += 1
        if after[PIECE] == step[PIECE] and after[ON_DECK] == step[ON_DECK]:
            continue
        level = False
        if not landed and i + 1 < len(steps):
            tangent_events.force_jump(pieces, numbers, after, here, carried, S, there)
    return gentlest


@kernel
def tangent_kernel(
    made: Made, along: Changes, rates: Rates, highest_time: float, times: FloatArray, samples: FloatArray,
    S: FloatArray, D: FloatArray, tallied: bool | None,
) -> float:  # fmt: skip
    """Carry the tangents along all steps; return how near the motion comes to grazing, that is to u = w = 0.

    `tallied` is True or None: True writes the derivatives of the wheel's position at `highest_time`, and of the
    impulses, too. Also written are the motion and its derivatives at rising `times`, (times, QUANTITIES, SAMPLED).
    """
    return repeat_kernel(made, along, rates, highest_time, times, samples, S, D, tallied, 0, None)


@inlined_uncounted_kernel
def _turns_near(step: FloatArray, end: FloatArray) -> bool:
    """Return True where u may come near zero inside a contact step: it lies above its tangents at both ends."""
    half = 0.5 * step[LENGTH]
    return bool(
        step[B] < 0.0 < end[SECOND] and max(step[A] + half * step[B], end[FIRST] - half * end[SECOND]) < NEAR_GRAZING
    )


@uncounted_kernel
def _approach(pieces: FloatArray, numbers: FloatArray, step: FloatArray, end: FloatArray, S: FloatArray) -> float:
    """Return how near a localised contact step comes to grazing."""
    order = int(numbers[contract.ORDER])
    repeat_step(pieces, numbers, step, S)
    return tangent_events.closest_approach(step, order, end[FIRST], end[SECOND], S)


@inlined_uncounted_kernel
def _holds_none(
    until: float, events: FloatArray, event: int, peaks: FloatArray, peak: int
) -> bool:  # fmt: skip
    """Return True where the next event and the next force maximum come after a time."""
    none = event >= len(events) or events[event, contract.EVENT_TIME] > until
    return bool(none and (peak >= len(peaks) or peaks[peak, contract.PEAK_TIME] > until))


@inlined_uncounted_kernel
def _goes_on_smoothly(
    pieces: FloatArray, numbers: FloatArray, steps: FloatArray, i: int, events: FloatArray, event: int,
    peaks: FloatArray, peak: int,
) -> bool:  # fmt: skip
    """Return True where a contact step ends in contact, in its piece or behind a smooth joint, and holds nothing."""
    if i + 1 >= len(steps):
        return False
    step, after = steps[i], steps[i + 1]
    if after[PHASE] != contract.CONTACT or after[ON_DECK] != step[ON_DECK]:
        return False
    if not _holds_none(after[TIME], events, event, peaks, peak):
        return False
    if after[PIECE] != step[PIECE] and after[A] < NEAR_GRAZING:
        return False
    if after[SHIFT] != step[SHIFT]:
        looped = step[PIECE] == len(pieces) - 1.0 and after[PIECE] == numbers[contract.LOOP]
        return bool(looped and numbers[contract.LOOP_JOIN] == contract.SOFT)
    if after[PIECE] == step[PIECE]:
        return True
    return bool(after[PIECE] == step[PIECE] + 1.0 and pieces[int(after[PIECE]), contract.JOIN] == contract.SOFT)


@inlined_uncounted_kernel
def _flies_on(
    steps: FloatArray, i: int, events: FloatArray, event: int, peaks: FloatArray, peak: int
) -> bool:  # fmt: skip
    """Return True where a step in flight ends in flight, and holds nothing."""
    if i + 1 >= len(steps):
        return False
    step, after = steps[i], steps[i + 1]
    flies = step[PHASE] == contract.FLIGHT and after[PHASE] == contract.FLIGHT and after[ON_DECK] == step[ON_DECK]
    return bool(flies and _holds_none(after[TIME], events, event, peaks, peak))
