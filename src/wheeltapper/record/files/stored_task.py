"""A general march in a file: its task and its track as one array of numbers, and its logs."""

from __future__ import annotations

import json
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import FLEXIBLE_TRACK
from wheeltapper.lower.on_rails import LoweredOnRails, plane_of, stops_of
from wheeltapper.lower.track.anomalies import NONE, anomalies_of
from wheeltapper.lower.track.irregular import IrregularModes
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common import program as contract
from wheeltapper.march.general import contract as general
from wheeltapper.march.general import layout
from wheeltapper.march.general.march import Found, prepare
from wheeltapper.march.general.records import Logs
from wheeltapper.march.general.stepping import MODES_EVERY
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.task import Marched, marched_of
from wheeltapper.record.files import stored
from wheeltapper.record.files.stored import UNDAMAGED, check, check_whole, table

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
LOGS = {"rows": 2, "gaps": 3, "moments": 3, "bodies": 2, "modes": 3}
"""Logs that a file holds, and the number of their axes."""
PATH_COLUMNS = contract.PIECE_COLUMNS, contract.MARKED_COLUMNS
STEPS_END_AT_SEATS = "steps_end_at_seats"
"""Attribute of files whose macro steps end where any wheel passes a seat; in older ones all steps are equal."""
CONTACT = ("position", "start", "loop", "join")
"""Numbers of a contact beside its pieces and its law."""


def tables(lowered: LoweredOnRails, march: Marched) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the tables and attributes of a file that contain the task and the logs."""
    parts = _parts_of(lowered, march.system)
    out: dict[str, Any] = {"task": (("task_entry",), np.concatenate([flat_part(part) for part in parts.values()]))}
    logs = march.found.logs
    for name, axes in LOGS.items():
        values = getattr(logs, name)
        out[f"logged_{name}"] = (tuple(f"{name}_{axis}" for axis in range(axes)), values)
    numbers = [lowered.seat, lowered.contact_constant, lowered.force]
    out["units"] = (("unit",), np.array(numbers))
    if march.system.ports:
        out["seat_events"] = ("seat_event", "event_column"), march.seat_events
    attributes = {
        "task_parts": json.dumps([[name, np.shape(part), np.asarray(part).dtype.kind] for name, part in parts.items()]),
        "steps_made": march.found.steps,
        STEPS_END_AT_SEATS: 1,
    }
    return out, attributes


def flat_part(part: Any) -> FloatArray:
    """Return an array as real numbers, one behind the other."""
    values = np.asarray(part)
    return np.ravel(values).view(float) if values.dtype.kind == "c" else np.ravel(values).astype(float)


def _parts_of(lowered: LoweredOnRails, system: general.System) -> dict[str, Any]:
    """Return the arrays of a task and its track by name; the system is on the paths as they were in the end."""
    task, out = lowered.program, dict[str, Any]()
    out |= {f"bodies.{name}": value for name, value in system.bodies._asdict().items()}
    for number, contact in enumerate(system.contacts):
        head = f"contacts.{number}."
        out[head + "pieces"] = contact.pieces
        out[head + "law"] = np.append(float(contact.law.kind), contact.law.numbers)
        out[head + "table"] = contact.law.table
        out[head + "numbers"] = np.array([float(getattr(contact, name)) for name in CONTACT])
        if contact.port is not None:
            out |= {f"{head}port.{name}": value for name, value in contact.port._asdict().items()}
    if system.changes:
        for name, values in zip(general.Change._fields, zip(*system.changes, strict=True), strict=True):
            out[f"changes.{name}"] = np.array(values)
    out["method"] = np.array(task.method, dtype=float)
    out["run"] = np.array([system.speed, task.duration])
    if lowered.modes is not None:
        out |= {f"ring.{name}": value for name, value in lowered.modes.ring._asdict().items()}
        out |= {f"track.{name}": value for name, value in lowered.modes._asdict().items() if name != "ring"}
    return out


def read(scenario: Scenario, data: xr.Dataset) -> tuple[LoweredOnRails, Marched]:
    """Return the task and the march from a file's contents; refuse contents that no march can have written."""
    parts = stored_parts(data)
    plane, anomalies = plane_of(scenario), NONE
    try:
        task, modes = _task_of(parts, len(plane.positions))
    except KeyError as error:
        raise InputError("", "task_parts", f"nothing of {error.args[0]}", UNDAMAGED) from None
    if (modes is None) == (FLEXIBLE_TRACK in scenario.needs):
        raise InputError("", "task_parts", "another track than the scenario's", UNDAMAGED)
    if isinstance(scenario.track, SupportedRail) and modes is not None:
        ring = modes.ring
        anomalies = anomalies_of(scenario.track, section_of(scenario.track), ring.bays * ring.seats)
    stops = stops_of(plane)
    seats = len(anomalies.voids) + len(stops) + len(plane.elements), bool(anomalies.extras)
    if seats != (len(task.system.ports), isinstance(modes, IrregularModes)):
        raise InputError("", "task_parts", "other anomalies or dampers than the scenario's", UNDAMAGED)
    units = table(data, "units", 3)
    check("units", units[1:], units[1:] > 0.0, "positive numbers")
    lowered = LoweredOnRails(
        task, plane, modes, float(units[0]), units[2] * task.system.bodies.load[: len(plane.wheelsets)],
        float(units[1]), stored.notes(data), float(units[2]), stops, anomalies,
    )  # fmt: skip
    return lowered, _march_of(data, task)


def stored_parts(data: xr.Dataset) -> dict[str, Any]:
    """Return the arrays of a task by name."""
    held = table(data, "task", None, ends=True)
    at, parts = 0, dict[str, Any]()
    for entry in stored.stored_attribute(data, "task_parts", list):
        try:
            name, shape, kind = entry
            size = prod(shape) * (2 if kind == "c" else 1)
            fits = name not in parts and min(shape, default=0) >= 0 and at + size <= len(held) and kind in "fibc"
        except (TypeError, ValueError):
            fits = False
        if not fits:
            raise InputError("", "task_parts", repr(entry)[:80], UNDAMAGED)
        values = held[at : at + size].copy()
        parts[name], at = (values.view(complex) if kind == "c" else values).reshape(shape), at + size
    if at != len(held):
        raise InputError("", "task_parts", f"{at} numbers instead of {len(held)}", UNDAMAGED)
    return parts


def _task_of(parts: dict[str, Any], wheels: int) -> tuple[general.Task, TrackModes | IrregularModes | None]:
    """Return a task and its track from their arrays."""
    made, number = [], 0
    while number < wheels or f"contacts.{number}.port.gap" in parts:
        head = f"contacts.{number}."
        number += 1
        pieces, law = parts[head + "pieces"], parts[head + "law"]
        if pieces.ndim != 2 or pieces.shape[1] not in PATH_COLUMNS or not len(pieces) or law.ndim != 1:
            raise InputError("", "task", f"a path of shape {pieces.shape}", UNDAMAGED)
        stored.check_pieces("task, pieces", pieces)
        position, start, loop, join = parts[head + "numbers"].tolist()
        check_whole("task, loop", np.array([loop]), 0, len(pieces))
        held = general.Law(int(law[0]), law[1:], parts[head + "table"])
        port = None
        if f"{head}port.gap" in parts:
            deflection, drive, gap, residual = (parts[f"{head}port.{name}"] for name in general.Port._fields)
            port = general.Port(deflection, drive, float(gap), float(residual))
        made.append(general.Contact(pieces, held, position, start, int(loop), int(join), port))
    if "bodies.shapes" in parts:  # older files have no guides
        parts.setdefault("bodies.guides", np.empty(0))
    bodies = general.Bodies(*(parts[f"bodies.{name}"] for name in general.Bodies._fields))
    modes: TrackModes | IrregularModes | None = None
    if "ring.rates" in parts:
        arrays = {name: parts[f"ring.{name}"] for name in Ring._fields}
        ring = Ring(**arrays)._replace(
            spacing=float(arrays["spacing"]), bays=int(arrays["bays"]), seats=int(arrays["seats"])
        )
        kind: Any = IrregularModes if "track.vectors" in parts else TrackModes
        held_modes = {name: parts[f"track.{name}"] for name in kind._fields if name != "ring"}
        modes = kind(ring=ring, **held_modes | {"cutoff": float(parts["track.cutoff"])})
    speed, duration = parts["run"].tolist()
    system = general.System(bodies, tuple(made), speed, None if modes is None else modes.ring, _changes_of(parts))
    return general.Task(system, method_of(parts["method"]), duration), modes


def _changes_of(parts: dict[str, Any]) -> tuple[general.Change, ...]:
    """Return what changes of the bodies."""
    if "changes.time" not in parts:
        return ()
    times, shapes, load = (parts[f"changes.{name}"] for name in general.Change._fields)
    bodies = parts["bodies.shapes"].shape, parts["bodies.load"].shape
    if (shapes.shape, load.shape) != tuple((*times.shape, *shape) for shape in bodies) or times.ndim != 1:
        raise InputError("", "task", f"changes of shape {shapes.shape}", UNDAMAGED)
    check("task, changes", times, np.isfinite(times) & (np.diff(times, prepend=0.0) > 0.0), "rising times")
    return tuple(general.Change(*one) for one in zip(times.tolist(), shapes, load, strict=True))


def method_of(numbers: FloatArray) -> general.Method:
    """Return a method from its numbers, of the types that it was made with."""
    kinds = [type(value) for value in general.DEFAULT]
    if numbers.shape != (len(kinds),):
        raise InputError("", "task, method", f"{numbers.shape} numbers", UNDAMAGED)
    values: Any = (kind(value) for kind, value in zip(kinds, numbers.tolist(), strict=True))
    return general.Method(*values)


def _march_of(data: xr.Dataset, task: general.Task) -> Marched:
    """Return the march from its logs."""
    steps = stored.stored_attribute(data, "steps_made", int)
    try:
        even = STEPS_END_AT_SEATS not in data.attrs
        prepared = prepare(task.system, task.method, duration=task.duration, even=even)
    except (ValueError, IndexError, np.linalg.LinAlgError) as error:
        raise InputError("", "task", f"numbers of no vehicle on a track ({error})"[:120], UNDAMAGED) from error
    contacts, q, states = len(task.system.contacts), task.method.nodes, prepared.tables.bodies_step.shape[1]
    kept = len(range(0, steps, MODES_EVERY))
    logs = Logs(
        table(data, "logged_rows", None, layout.ROW_COLUMNS), np.empty((0, 0)), np.empty((0, 0)),
        table(data, "logged_gaps", steps, contacts, q), table(data, "logged_moments", steps, contacts, q),
        table(data, "logged_bodies", steps, states),
        table(data, "logged_modes", kept, 2, prepared.tables.decay.shape[2]), np.zeros(4, np.int64),
    )  # fmt: skip
    _check_rows(logs.rows, steps, contacts, {1, q, task.method.careful_nodes})
    events = table(data, "march_events", None, contract.EVENT_COLUMNS)
    peaks = table(data, "march_peaks", None, contract.PEAK_COLUMNS)
    for name, rows in (("march_events", events), ("march_peaks", peaks)):
        stored.rising(name, rows[:, contract.EVENT_TIME], task.duration)
        check_whole(name, rows[:, contract.EVENT_CONTACT], 0, len(task.system.wheels) - 1)
    check_whole("march_events", events[:, contract.EVENT_KIND], contract.LOSS, contract.YIELD)
    if task.system.ports:
        seated = table(data, "seat_events", None, contract.EVENT_COLUMNS)
        stored.rising("seat_events", seated[:, contract.EVENT_TIME], task.duration)
        check_whole("seat_events", seated[:, contract.EVENT_CONTACT], 0, len(task.system.ports) - 1)
        check_whole("seat_events", seated[:, contract.EVENT_KIND], contract.LOSS, contract.IMPACT)
    else:
        seated = np.empty((0, contract.EVENT_COLUMNS))
    found = Found(prepared, stored.status_of(data), steps, events, np.empty((0, 4)), logs)
    return marched_of(task, found)._replace(peaks=peaks, seat_events=seated)


def _check_rows(rows: FloatArray, steps: int, contacts: int, counts: set[int]) -> None:
    """Refuse logged parts that do not follow each other, or whose nodes do not exist."""
    check_whole("logged_rows", rows[:, layout.ROW_STEP], 0, steps - 1)
    check_whole("logged_rows", rows[:, layout.ROW_CONTACT], 0, contacts - 1)
    check_whole("logged_rows", rows[:, layout.ROW_MAP], layout.EVENLY, layout.IMPACT_TO_LOSS)
    nodes = rows[:, layout.ROW_NODES]
    check("logged_rows", nodes, np.isin(nodes, list(counts)), f"nodes among {sorted(counts)}")
    for contact in range(contacts):
        own = rows[rows[:, layout.ROW_CONTACT] == contact]
        begins = own[:, layout.ROW_STEP] + own[:, layout.ROW_FROM]
        ends = own[:, layout.ROW_STEP] + own[:, layout.ROW_TO]
        follows = np.abs(np.append(begins[1:], float(steps)) - ends) <= 1e-9 * steps + 1e-9
        check("logged_rows", ends, follows & (ends > begins), "parts that follow each other")
        check("logged_rows", begins[:1], begins[:1] == 0.0, "a first part at zero")
        if not len(own):
            raise InputError("", "logged_rows", f"nothing of contact {contact}", UNDAMAGED)
