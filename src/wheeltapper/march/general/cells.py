"""Cells of one track and one speed, in step: their modes together as a matrix, their contacts one after the other.

In each macro step of all cells

1. every contact of every cell reads its free motion: the table of its place times the matrix of modes and cells;
2. every cell solves its contacts as if it were alone;
3. the modes of all cells take the moments of all forces: the transposed product.

Tables are read once for all cells. Four cells are multiplied at a time, always four, so that what comes of a cell does
not depend on the others.
"""

from __future__ import annotations

from typing import NamedTuple

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Rows
from wheeltapper.march.general import layout
from wheeltapper.march.general.layout import BEGIN, IM, RE
from wheeltapper.march.general.modal import read_lanes, seen_from_first, turn, write_lanes
from wheeltapper.march.general.records import Data, Logs, Motion, Room, Stage, Tables
from wheeltapper.march.general.stepping import bays_ahead, commit, solve_contacts, step_bodies, tell_time

MET_IMPACTS, MET_ENDED = 0, 1
"""Columns of `Lanes.met`: impacts of a contact, and 1 once it has come as far as was asked."""
OF_LENGTH, OF_FORCE = 0, 1
"""Columns of `Lanes.scales`."""


class Lanes(NamedTuple):
    """Cells that march in step; the number of lanes is a multiple of TOGETHER.

    Attributes
    ----------
    modes
        (lanes, 2, modes).
    bodies, contacts, guess, forces, trend
        As in `Motion`, of each lane.
    ends, laws, starts, settings
        As in `Data`, of each lane.
    sinking
        Of the bodies at each contact from first touch to rest, (lanes, contacts), in the lane's units.
    kind
        Which of `Kinds` the lane has, (lanes,).
    scales
        The lane's units over those of the track's tables, (lanes, 2): of length and force.
    steps, status, met
        Macro steps to make; why the lane ended, or RUNNING; and (lanes, contacts, 2).
    seen, moments
        Scratch of the products: (contacts, lanes, q) both.
    """

    modes: FloatArray
    bodies: FloatArray
    contacts: Rows
    guess: FloatArray
    forces: FloatArray
    trend: Rows
    ends: Rows
    laws: FloatArray
    starts: FloatArray
    settings: Rows
    sinking: FloatArray
    kind: IntArray
    scales: FloatArray
    steps: IntArray
    status: IntArray
    met: IntArray
    seen: FloatArray
    moments: FloatArray


class Kinds(NamedTuple):
    """Tables of the different bodies under which cells differ: as in `Tables`, for each kind and length of a step."""

    read: FloatArray
    write: FloatArray
    step: FloatArray
    kernels: FloatArray
    matrices: FloatArray
    cross: FloatArray
    coupled: IntArray


class Own(NamedTuple):
    """Scratch: tables of one cell at one place in the bay, and of a contact's modes as the first contact sees them."""

    kernels: FloatArray
    matrices: FloatArray
    cross: FloatArray
    residual: FloatArray
    residual_nodes: FloatArray
    rows: FloatArray


@inlined_uncounted_kernel
def _read_all(step: int, track: Tables, lanes: Lanes, own: Own) -> None:
    """Write what the modes show to all contacts of all lanes."""
    phases = track.reads.shape[1]
    for i in range(len(lanes.seen)):
        rows = track.reads[track.sets[i], (track.phase[i] + step) % phases]
        if i == 0:
            read_lanes(rows, track.first, lanes.modes, lanes.seen[i])
        else:
            seen_from_first(rows, track.turns[bays_ahead(step, i, track)], own.rows)
            read_lanes(own.rows, track.first, lanes.modes, lanes.seen[i])


@inlined_uncounted_kernel
def _write_all(step: int, track: Tables, lanes: Lanes, own: Own) -> None:
    """Move the modes of all lanes over the macro step."""
    phases = track.reads.shape[1]
    for w in range(len(lanes.modes)):
        turn(track.decay[track.which[step % phases]], lanes.modes[w, RE], lanes.modes[w, IM])
    for i in range(len(lanes.moments)):
        rows = track.writes[track.sets[i], (track.phase[i] + step) % phases]
        if i == 0:
            write_lanes(rows, track.first, lanes.moments[i], lanes.modes)
        else:
            seen_from_first(rows, track.turns[bays_ahead(step, i, track)], own.rows)
            write_lanes(own.rows, track.first, lanes.moments[i], lanes.modes)
    if (track.phase[BEGIN] + step + 1) % phases == 0:
        for w in range(len(lanes.modes)):
            turn(track.turns[1 % track.turns.shape[0]], lanes.modes[w, RE], lanes.modes[w, IM])


@inlined_uncounted_kernel
def _tables_at(p: int, k: int, lasts: int, length: float, force: float, track: Tables, kinds: Kinds, own: Own) -> None:
    """Write the tables of one cell at a place in the bay: those of the track in its units, and those of its bodies.

    `lasts` tells which length the macro step has.
    """
    contacts, q = own.residual.shape[0], own.residual.shape[2]
    scale = force / length
    for i in range(contacts):
        for m in range(q):
            own.residual[i, BEGIN, m] = scale * track.residual[i, p, m]
            own.residual_nodes[i, BEGIN, m] = scale * track.residual_nodes[i, p, m]
            for j in range(q):
                own.kernels[i, BEGIN, m, j] = scale * track.kernels[i, p, m, j] + kinds.kernels[k, i, lasts, m, j]
                own.matrices[i, BEGIN, m, j] = scale * track.matrices[i, p, m, j] + kinds.matrices[k, i, lasts, m, j]
        for other in range(contacts):
            if kinds.coupled[k, i, other] != 0:
                for m in range(q):
                    for j in range(q):
                        own.cross[i, other, BEGIN, m, j] = (
                            scale * track.cross[i, other, p, m, j] + kinds.cross[k, i, other, lasts, m, j]
                        )


@inlined_uncounted_kernel
def _count(first: int, last: int, contacts: int, impact: int, loss: int, events: Rows, met: IntArray) -> bool:
    """Count a cell's new events; return True once all of its contacts have come as far as was asked."""
    for row in range(first, last):
        i = int(events[row]["contact"]) % contacts
        if events[row]["kind"] == contract.IMPACT:
            met[i, MET_IMPACTS] += 1
            if met[i, MET_IMPACTS] == impact:
                met[i, MET_ENDED] = 1
        elif events[row]["kind"] == contract.LOSS and met[i, MET_IMPACTS] == loss:
            met[i, MET_ENDED] = 1
    ended = 0
    for i in range(contacts):
        ended += met[i, MET_ENDED]
    return ended == contacts


@uncounted_kernel
def cells_kernel(step: int, last: int, impact: int, loss: int, track: Tables, kinds: Kinds, lanes: Lanes, data: Data, stage: Stage, logs: Logs, room: Room, own: Own) -> int:  # fmt: skip  # noqa: E501
    """March all lanes from a macro step on, to another or until all have ended or a log is full; return how far.

    A lane ends after its macro steps, or at impact number `impact` of each of its contacts, or at the first loss after
    impact number `loss`. Contacts in the logs are counted over all lanes.
    """
    contacts, q = lanes.forces.shape[1], lanes.forces.shape[2]
    phases = track.reads.shape[1]
    used = logs.used
    states = lanes.bodies.shape[1]
    margin = len(lanes.modes) * contacts * (layout.MOST_PARTS + 2)
    while True:
        if used["events"] + margin > len(logs.events) or used["peaks"] + margin > len(logs.peaks):
            return step
        running = False
        for w in range(len(lanes.steps)):
            if lanes.status[w] == contract.RUNNING and step >= lanes.steps[w]:
                lanes.status[w] = contract.DONE
            running = running or lanes.status[w] == contract.RUNNING
        if not running:
            return step
        p = step % phases
        lasts = track.which[p]
        tell_time(step, track, stage.now)
        _read_all(step, track, lanes, own)
        for w in range(len(lanes.steps)):
            lanes.moments[:, w] = 0.0
            if lanes.status[w] != contract.RUNNING:
                continue
            k = lanes.kind[w]
            length, force = lanes.scales[w, OF_LENGTH], lanes.scales[w, OF_FORCE]
            bodies = lanes.bodies[w]
            _tables_at(p, k, lasts, length, force, track, kinds, own)
            for i in range(contacts):
                for m in range(q):
                    total = lanes.seen[i, w, m] / length
                    for s in range(states):
                        total += kinds.read[k, lasts, i, m, s] * bodies[s]
                    stage.free[i, m] = total
                stage.free[i, BEGIN] += lanes.sinking[w, i]
            tables = Tables(
                track.reads, track.writes, track.first, track.decay, track.turns, track.sets, track.phase, track.bay,
                kinds.read[k], kinds.write[k], kinds.step[k], own.kernels, own.matrices, own.cross, kinds.coupled[k],
                own.residual, own.residual_nodes, track.fixed_reads, track.fixed_writes, track.which, track.seconds,
                track.clock,
            )  # fmt: skip
            here = Data(
                data.macro, data.part, data.places, data.matrix, data.pieces, lanes.ends[w], lanes.laws[w], data.table,
                lanes.starts[w], lanes.settings[w],
            )  # fmt: skip
            motion = Motion(
                lanes.modes[w], bodies, lanes.contacts[w], lanes.guess[w], lanes.forces[w], lanes.trend[w]
            )  # fmt: skip
            status = solve_contacts(step, BEGIN, tables, here, motion, stage, room)
            if status != contract.RUNNING:
                lanes.status[w] = status
                continue
            used["rows"] = 0
            events, peaks = used["events"], used["peaks"]
            for i in range(contacts):
                commit(step, i, here, motion, stage, logs, room)
            for row in range(events, used["events"]):
                logs.events[row]["contact"] += w * contacts
            for row in range(peaks, used["peaks"]):
                logs.peaks[row]["contact"] += w * contacts
            step_bodies(kinds.step[k, lasts], kinds.write[k, lasts], stage.moments, bodies, room.spare)
            for i in range(contacts):
                for m in range(q):
                    lanes.moments[i, w, m] = force * stage.moments[i, m]
            if _count(events, used["events"], contacts, impact, loss, logs.events, lanes.met[w]):
                lanes.status[w] = contract.ENOUGH
        _write_all(step, track, lanes, own)
        step += 1
