"""The general march: macro steps of all contacts and of the structure.

Events never touch the modes. In each macro step

1. every contact reads its free motion from the modes and bodies, as polynomials;
2. every contact solves its own problem, smooth or from event to event; what others' forces do to it in this macro step
   comes from their last solution, at first from their forces continued. Contacts are solved again until what they feel
   of each other does not change any more;
3. the structure takes the moments of all forces.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.common.rows import Row
from wheeltapper.march.general import layout
from wheeltapper.march.general.algebra import copy
from wheeltapper.march.general.careful import EVENTS_NOW, ROWS_NOW
from wheeltapper.march.general.eventful import eventful
from wheeltapper.march.general.layout import BEGIN, IM, RE
from wheeltapper.march.general.maxima import follow_row
from wheeltapper.march.general.modal import add_turned_back, read_modes, turn, turned, write_modes
from wheeltapper.march.general.records import Data, Logs, Motion, Room, Site, Stage, Tables
from wheeltapper.march.general.smooth import CONTINUED, FROM_GAP, ONCE_MORE, may_be_smooth, smooth

MOST_SWEEPS = 12


MODES_EVERY = 64
"""Macro steps between two logged states of the modes."""


@inlined_uncounted_kernel
def tell_time(step: int, tables: Tables, now: Row) -> None:
    """Write when a macro step begins, and how long it lasts, and its neighbours."""
    phases = len(tables.which)
    now["begins"] = (step // phases) * tables.clock[phases] + tables.clock[step % phases]
    now["lasts"] = tables.seconds[tables.which[step % phases]]
    now["last_lasted"] = tables.seconds[tables.which[(step - 1) % phases]]
    now["next_lasts"] = tables.seconds[tables.which[(step + 1) % phases]]


@inlined_uncounted_kernel
def _read(step: int, i: int, tables: Tables, motion: Motion, stage: Stage) -> None:
    """Write the free motion of a contact's gap."""
    c = stage.free[i]
    phases = tables.reads.shape[1]
    length = tables.which[step % phases]
    for m in range(len(c)):
        total = 0.0
        for s in range(len(motion.bodies)):
            total += tables.bodies_read[length, i, m, s] * motion.bodies[s]
        c[m] = total
    if motion.modes.shape[1] == 0:
        return
    wheels = len(tables.sets)
    if i >= wheels:
        read_modes(tables.fixed_reads[i - wheels, length], tables.first, motion.modes[RE], motion.modes[IM], c)
        return
    rows = tables.reads[tables.sets[i], (tables.phase[i] + step) % phases]
    if i == 0:
        read_modes(rows, tables.first, motion.modes[RE], motion.modes[IM], c)
    else:
        ahead = tables.turns[bays_ahead(step, i, tables)]
        turned(ahead, motion.modes[RE], motion.modes[IM], stage.modes[RE], stage.modes[IM])
        read_modes(rows, tables.first, stage.modes[RE], stage.modes[IM], c)


@inlined_uncounted_kernel
def bays_ahead(step: int, i: int, tables: Tables) -> int:
    """Return how many bays a contact is ahead of the first one."""
    phases = tables.reads.shape[1]
    own = tables.bay[i] + (tables.phase[i] + step) // phases
    first = tables.bay[BEGIN] + (tables.phase[BEGIN] + step) // phases
    return (own - first) % tables.turns.shape[0]


@inlined_uncounted_kernel
def step_bodies(through: FloatArray, write: FloatArray, moments: FloatArray, bodies: FloatArray, spare: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Move the bodies over a macro step, by their matrix and what they take of each contact's moments."""
    states = len(bodies)
    for s in range(states):
        total = 0.0
        for j in range(states):
            total += through[s, j] * bodies[j]
        spare[s] = total
    for i in range(len(moments)):
        for m in range(moments.shape[1]):
            for s in range(states):
                spare[s] += moments[i, m] * write[i, m, s]
    copy(spare[:states], bodies)


@inlined_uncounted_kernel
def write_step(step: int, tables: Tables, motion: Motion, stage: Stage, spare: FloatArray) -> None:
    """Move modes and bodies over the macro step."""
    contacts = len(motion.contacts)
    phases = tables.reads.shape[1]
    length = tables.which[step % phases]
    step_bodies(tables.bodies_step[length], tables.bodies_write[length], stage.moments, motion.bodies, spare)
    if motion.modes.shape[1] == 0:
        return
    re, im = motion.modes[RE], motion.modes[IM]
    turn(tables.decay[length], re, im)
    wheels = len(tables.sets)
    for i in range(wheels, contacts):
        write_modes(tables.fixed_writes[i - wheels, length], tables.first, stage.moments[i], re, im)
    for i in range(wheels):
        rows = tables.writes[tables.sets[i], (tables.phase[i] + step) % phases]
        if i == 0:
            write_modes(rows, tables.first, stage.moments[i], re, im)
        else:
            stage.modes[:] = 0.0
            write_modes(rows, tables.first, stage.moments[i], stage.modes[RE], stage.modes[IM])
            add_turned_back(tables.turns[bays_ahead(step, i, tables)], stage.modes[RE], stage.modes[IM], re, im)
    if (tables.phase[BEGIN] + step + 1) % phases == 0:
        turn(tables.turns[1 % tables.turns.shape[0]], re, im)


@inlined_uncounted_kernel
def _expect(i: int, data: Data, motion: Motion, stage: Stage) -> None:
    """Write what the others will feel of a contact whose force goes on as it went."""
    q = len(data.macro.places)
    for m in range(q):
        force = 0.0
        for j in range(q):
            force += data.macro.ahead[m, j] * motion.forces[i, j]
        for k in range(q):
            stage.shares[i, k, m] = data.macro.integrals[k, m] * force


@inlined_uncounted_kernel
def _feel(i: int, p: int, tables: Tables, stage: Stage) -> float:
    """Write what a contact feels of the others, and its c; return the largest change."""
    q = stage.felt.shape[1]
    change = 0.0
    for k in range(q):
        total = 0.0
        for j in range(len(stage.felt)):
            if tables.coupled[i, j] != 0:
                for m in range(q):
                    total += tables.cross[i, j, p, k, m] * stage.shares[j, k, m]
        change = max(change, abs(total - stage.felt[i, k]))
        stage.felt[i, k] = total
    return change


@inlined_uncounted_kernel
def _solve(step: int, i: int, p: int, begin: int, shared: bool, tables: Tables, data: Data, motion: Motion, stage: Stage, room: Room) -> int:  # fmt: skip  # noqa: E501
    """Solve one contact over the macro step, from its state at the step's start; return a status."""
    q = len(data.macro.places)
    place = motion.contacts[i]
    motion.contacts[i] = stage.before[i]
    counts = stage.counts[i]
    counts[:] = 0
    c = stage.c[i]
    for m in range(q):
        total = stage.free[i, m]
        if shared:
            for k in range(q):
                total -= data.macro.transform[m, k] * stage.felt[i, k]
        c[m] = total
    speed, seconds = data.settings["speed"], stage.now["lasts"]
    site = Site(
        c, tables.kernels[i, p], tables.residual[i, p], data.pieces, place, data.ends[i], data.laws[i], data.table,
        data.starts[i] + speed * stage.now["begins"], speed * seconds,
        1.0 / data.settings["length_unit"], seconds,
    )  # fmt: skip
    place["smooth"] = 0.0
    if may_be_smooth(site) and smooth(
        step, i, data.macro, tables.matrices[i, p], tables.residual_nodes[i, p], begin, motion.guess[i], data.settings,
        site, room, stage.rows[i], counts,
    ):  # fmt: skip
        place["smooth"] = 1.0
        for k in range(q):
            motion.forces[i, k] = room.N[k]
        if shared:
            for k in range(q):
                for m in range(q):
                    stage.shares[i, k, m] = data.macro.integrals[k, m] * room.N[m]
    else:
        status = eventful(
            step, i, data.part, data.macro, shared, data.places, data.matrix, data.settings, site, room,
            stage.rows[i], stage.events[i], counts, stage.sums,
        )  # fmt: skip
        if status != contract.RUNNING:
            return status
        for k in range(q):
            motion.forces[i, k] = room.moments[BEGIN]
        if shared:
            for k in range(q):
                for m in range(q):
                    total = 0.0
                    for j in range(q):
                        total += stage.sums[k, j] * data.macro.transform[j, m]
                    stage.shares[i, k, m] = total
    for m in range(q):
        stage.moments[i, m] = room.moments[m]
    return contract.RUNNING


@inlined_uncounted_kernel
def solve_contacts(step: int, p: int, tables: Tables, data: Data, motion: Motion, stage: Stage, room: Room) -> int:
    """Solve all contacts over a macro step from their free motions in `stage.free`; return a status."""
    contacts = len(motion.contacts)
    shared = contacts > 1
    alike = stage.now["last_lasted"] == stage.now["lasts"]
    for i in range(contacts):
        stage.before[i] = motion.contacts[i]
    if shared:
        for i in range(contacts):
            stage.felt[i] = 0.0
            _expect(i, data, motion, stage)
    for sweep in range(MOST_SWEEPS):
        changed = False
        for i in range(contacts):
            change = np.inf
            if shared:
                change = _feel(i, p, tables, stage)
            if sweep > 0 and change <= data.settings["sweep_limit"]:
                continue
            changed = True
            begin = FROM_GAP
            if sweep > 0 and motion.contacts[i]["smooth"] != 0.0:
                begin = ONCE_MORE
            elif sweep == 0 and alike and stage.before[i]["smooth"] != 0.0:
                begin = CONTINUED
            status = _solve(step, i, p, begin, shared, tables, data, motion, stage, room)
            if status != contract.RUNNING:
                return status
        if not changed or not shared:
            return contract.RUNNING
    return layout.UNSOLVED


@inlined_uncounted_kernel
def commit(step: int, i: int, data: Data, motion: Motion, stage: Stage, logs: Logs, room: Room) -> None:
    """Log a contact's macro step, and go on to the next one."""
    used = logs.used
    counts = stage.counts[i]
    for row in range(counts[ROWS_NOW]):
        logs.rows[used["rows"]] = stage.rows[i, row]
        used["rows"] += 1
        nodes = data.macro
        if stage.rows[i, row]["nodes"] != len(data.macro.places):
            nodes = data.part
        used["peaks"] = follow_row(
            stage.rows[i, row], nodes, data.settings["prominent"], motion.trend[i], logs.peaks,
            used["peaks"], room,
        )  # fmt: skip
    for row in range(counts[EVENTS_NOW]):
        logs.events[used["events"]] = stage.events[i, row]
        used["events"] += 1
    ratio = stage.now["lasts"] / stage.now["next_lasts"]
    motion.contacts[i]["impact"] = (motion.contacts[i]["impact"] - 1.0) * ratio
    motion.contacts[i]["loss"] = (motion.contacts[i]["loss"] - 1.0) * ratio


@uncounted_kernel
def march_kernel(first: int, last: int, tables: Tables, data: Data, motion: Motion, stage: Stage, logs: Logs, room: Room) -> int:  # fmt: skip  # noqa: E501
    """March some macro steps; return a status, FULL where a log is full. `logs.used` tells how far it came."""
    contacts = len(motion.contacts)
    phases = tables.matrices.shape[1]
    used = logs.used
    used["steps"] = first
    q = len(data.macro.places)
    for step in range(first, last):
        margin = contacts * (layout.MOST_PARTS + 2)
        if (
            used["rows"] + margin > len(logs.rows)
            or used["events"] + margin > len(logs.events)
            or used["peaks"] + 3 * margin > len(logs.peaks)
        ):
            return contract.FULL
        p = step % phases
        begun = step - first
        if step % MODES_EVERY == 0:
            copy(motion.modes, logs.modes[step // MODES_EVERY - (first + MODES_EVERY - 1) // MODES_EVERY])
        copy(motion.bodies, logs.bodies[begun])
        tell_time(step, tables, stage.now)
        for i in range(contacts):
            _read(step, i, tables, motion, stage)
        status = solve_contacts(step, p, tables, data, motion, stage, room)
        if status != contract.RUNNING:
            return status
        for i in range(contacts):
            for m in range(q):
                logs.gaps[begun, i, m] = stage.c[i, m]
                logs.moments[begun, i, m] = stage.moments[i, m]
            commit(step, i, data, motion, stage, logs, room)
        write_step(step, tables, motion, stage, room.spare)
        used["steps"] = step + 1
    return contract.RUNNING
