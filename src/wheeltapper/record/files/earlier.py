"""Records of formats 1 and 2, which held their programs: the only module that knows those, and it only reads.

Nothing is lowered here, since the files that such a scenario names need not exist any more.
"""

from __future__ import annotations

from collections.abc import Callable
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import FLEXIBLE_TRACK, YIELDING
from wheeltapper.lower.lowered.plane import LoweredPlane
from wheeltapper.lower.lowered.wagon import LoweredWagon
from wheeltapper.lower.lowered.wheel import Lowered
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.lower.plane import plane_of, stops_of
from wheeltapper.lower.structure import structure_of
from wheeltapper.lower.track.anomalies import NONE, Void, anomalies_of, voids_of
from wheeltapper.lower.track.irregular import IrregularModes
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import section_of
from wheeltapper.lower.wagon import layout_of
from wheeltapper.lower.wagon_on_rails import late_rates
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kept import UNDAMAGED, check, check_pieces, check_whole, refuse, table
from wheeltapper.march.general import contract as general
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import Units
from wheeltapper.march.general.task import EVEN
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import LANES, Assembly
from wheeltapper.march.wagon.rail_motion import rails_array
from wheeltapper.march.wagon.rails.march import OnRails
from wheeltapper.march.wagon.rails.modes import Track
from wheeltapper.record.files.stored import notes, status_of, stored_attribute, version_of

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
Parts = dict[str, Any]
"""Arrays of a program by name."""
LATER = {contract.START_SHIFT: 0.0, contract.LAST_IMPACT: -1.0, contract.LAST_LOSS: -1.0, contract.MEMORY: 0.0}
"""Numbers of a wheel's program that were added later, and their values before."""
OLD_EVENT_COLUMNS, OLD_PEAK_COLUMNS = [0, 1, 3, 2], [0, 2, 3, 1]
"""Where time, kind, rate and contact of a wagon's event, and time, force, corner and contact of a maximum stood."""
HERTZIAN_NUMBERS = 20
"""Numbers of an assembly in versions that knew Hertz's contact only."""
CONTACT = ("position", "start", "loop", "join")
LOGGED = ("rows", "gaps", "moments", "bodies", "modes")
WAYS = ("together", "against")
"""Prefixes of the ways in which the rails move; one that is like the first has no ring in the file."""


def read(scenario: Scenario, data: xr.Dataset) -> tuple[Any, Any]:
    """Return the lowered scenario of a file, and the march; refuse what no march can have written."""
    readers: dict[str, Callable[[Scenario, xr.Dataset], tuple[Any, Parts]]] = {
        "program_numbers": _of_wheel, "assembly_parts": _of_wagon, "task_parts": _in_plane,
    }  # fmt: skip
    name = next((one for one in readers if one in data or one in data.attrs), None)
    if name is None:
        refuse("program_numbers", "nothing")
    try:
        lowered, held = readers[name](scenario, data)
    except KeyError as error:
        refuse(name, f"nothing of {error.args[0]}")
    known = [own for own in ("march_steps", "march_events", "march_peaks", "march_state") if own in data]
    kept = {own: np.asarray(data[own]) for own in known} | held
    return lowered, run.restored(lowered.program, status_of(data), kept)


def _parts_of(data: xr.Dataset, name: str) -> Parts:
    """Return the arrays that one variable holds, one behind the other."""
    held = table(data, name, None, ends=True)
    at, parts = 0, Parts()
    for entry in stored_attribute(data, f"{name}_parts", list):
        try:
            part, shape, kind = entry
            size = prod(shape) * (2 if kind == "c" else 1)
            fits = part not in parts and min(shape, default=0) >= 0 and at + size <= len(held) and kind in "fibc"
        except (TypeError, ValueError):
            fits = False
        if not fits:
            refuse(f"{name}_parts", repr(entry)[:80])
        values = held[at : at + size].copy()
        if kind == "i":
            check_whole(f"{name}, {part}", values, -(2**31), 2**31)
            values = values.astype(np.int64)
        parts[part], at = (values.view(complex) if kind == "c" else values).reshape(shape), at + size
    if at != len(held):
        refuse(f"{name}_parts", f"{at} numbers instead of {len(held)}")
    return parts


# -- one wheel --------------------------------------------------------------------------------------------------------


def _of_wheel(scenario: Scenario, data: xr.Dataset) -> tuple[Lowered, Parts]:
    kept = contract.DAMPER_DAMPING  # the numbers behind are those of a damper's end, in a table of their own
    pieces = table(data, "program_pieces", None, (contract.PIECE_COLUMNS, contract.MARKED_COLUMNS), ends=True)
    check_pieces("program_pieces", pieces)
    law = contract.ELASTIC
    if "program_law" in data and YIELDING in scenario.needs:
        law = table(data, "program_law", None, contract.LAW_COLUMNS)
    numbers = table(data, "program_numbers", range(contract.START_SHIFT, kept + 1), ends=True)
    numbers = np.append(numbers, [LATER[k] for k in range(len(numbers), kept)])
    if numbers[contract.ORDER] not in (contract.DEFAULT_ORDER, contract.STRICT_ORDER):
        refuse("program_numbers", f"the order {numbers[contract.ORDER]:g}")
    more = contract.NUMBERS - kept
    damper = table(data, "program_damper", more) if "program_damper" in data else np.zeros(more)
    try:
        loop, join = (float(value) for value in data.attrs["loop"])
    except (KeyError, TypeError, ValueError):
        raise InputError("", "loop", repr(data.attrs.get("loop", "nothing"))[:80], UNDAMAGED) from None
    check_whole("loop", np.array([loop]), 0, len(pieces))
    units = table(data, "units", 5)
    check("units", units, (units > 1e-30) & (units < 1e30), "positive numbers of any use")
    length, time, force, static, constant = units.tolist()
    paths = PathTable(pieces, int(loop), int(join))
    program = contract.Program(pieces, np.append(numbers, damper), law)
    lowered = Lowered(scenario, program, paths, length, time, force, static, constant, notes(data))
    peaks = table(data, "march_peaks", None, (contract.PEAK_COLUMNS - 1, contract.PEAK_COLUMNS))
    if peaks.shape[1] < contract.PEAK_COLUMNS:
        events = table(data, "march_events", None, contract.EVENT_COLUMNS)
        impacts = events[events[:, contract.EVENT_KIND] == contract.IMPACT, contract.EVENT_TIME]
        peaks = np.column_stack([peaks, np.searchsorted(impacts, peaks[:, contract.PEAK_TIME], side="right")])
    stops = {"march_stops": np.asarray(data["march_stops"])} if "march_stops" in data else {}
    return lowered, {"march_peaks": peaks} | stops


# -- wheelsets, bogies, and what is on rails that bend -----------------------------------------------------------------


def _in_plane(scenario: Scenario, data: xr.Dataset) -> tuple[LoweredPlane, Parts]:
    parts, plane, anomalies = _parts_of(data, "task"), plane_of(scenario), NONE
    modes = _modes_of(parts) if "ring.rates" in parts else None
    if (modes is None) == (FLEXIBLE_TRACK in scenario.needs):
        refuse("task_parts", "another track than the scenario's")
    task = _task_of(parts, len(plane.positions), None if modes is None else modes.ring)
    if isinstance(scenario.track, SupportedRail) and modes is not None:
        seats = modes.ring.bays * modes.ring.seats
        anomalies = anomalies_of(scenario.track, section_of(scenario.track), seats)
    stops = stops_of(plane)
    if len(anomalies.voids) + len(stops) + len(plane.elements) != len(task.system.ports):
        refuse("task_parts", "other anomalies or dampers than the scenario's")
    seat, constant, force = table(data, "units", 3).tolist()
    static = force * task.system.bodies.load[: len(plane.wheelsets)]
    lowered = LoweredPlane(scenario, task, plane, modes, seat, static, constant, notes(data), force, stops, anomalies)
    held = {f"march_{name}": np.asarray(data[f"logged_{name}"]) for name in LOGGED}
    held["march_steps_made"] = np.array([float(stored_attribute(data, "steps_made", int))])
    if "seat_events" in data:
        held["march_seat_events"] = np.asarray(data["seat_events"])
    if "steps_end_at_seats" not in data.attrs:
        held[EVEN] = np.ones(1)
    return lowered, held


def _modes_of(parts: Parts) -> TrackModes | IrregularModes:
    kind: Any = IrregularModes if "track.vectors" in parts else TrackModes
    held = {name: parts[f"track.{name}"] for name in kind._fields if name != "ring"}
    modes: TrackModes | IrregularModes = kind(
        ring=_ring_of(parts, "ring"), **held | {"cutoff": float(parts["track.cutoff"])}
    )
    return modes


def _ring_of(parts: Parts, head: str) -> Ring:
    arrays = {name: parts[f"{head}.{name}"] for name in Ring._fields}
    spacing, bays, seats = float(arrays["spacing"]), int(arrays["bays"]), int(arrays["seats"])
    return Ring(**arrays)._replace(spacing=spacing, bays=bays, seats=seats)


def _task_of(parts: Parts, wheels: int, ring: Ring | None) -> general.Task:
    contacts, number = [], 0
    while number < wheels or f"contacts.{number}.port.gap" in parts:
        head = f"contacts.{number}."
        number += 1
        pieces, law = parts[head + "pieces"], parts[head + "law"]
        check_pieces("task, pieces", pieces)
        position, start, loop, join = parts[head + "numbers"].tolist()
        check_whole("task, loop", np.array([loop]), 0, len(pieces))
        port = None
        if f"{head}port.gap" in parts:
            deflection, drive, gap, residual = (parts[f"{head}port.{name}"] for name in general.Port._fields)
            port = general.Port(deflection, drive, float(gap), float(residual))
        held = general.Law(int(law[0]), law[1:], parts[head + "table"])
        contacts.append(general.Contact(pieces, held, position, start, int(loop), int(join), port))
    parts.setdefault("bodies.guides", np.empty(0))  # older files have none
    bodies = general.Bodies(*(parts[f"bodies.{name}"] for name in general.Bodies._fields))
    changes: tuple[general.Change, ...] = ()
    if "changes.time" in parts:
        times, shapes, load = (parts[f"changes.{name}"] for name in general.Change._fields)
        changes = tuple(general.Change(*one) for one in zip(times.tolist(), shapes, load, strict=True))
    speed, duration = parts["run"].tolist()
    system = general.System(bodies, tuple(contacts), speed, ring, changes)
    return general.Task(system, _method_of(parts["method"]), duration)


def _method_of(numbers: FloatArray) -> general.Method:
    """Return a method from its numbers, of the types that it was made with."""
    values: Any = (type(own)(value) for own, value in zip(general.DEFAULT, numbers.tolist(), strict=True))
    return general.Method(*values)


# -- wagons -----------------------------------------------------------------------------------------------------------


def _of_wagon(scenario: Scenario, data: xr.Dataset) -> tuple[LoweredWagon, Parts]:
    structure = structure_of(scenario.vehicle)
    A, axles = _assembly_of(_parts_of(data, "assembly")), len(scenario.vehicle.axles)
    shape = (axles, 2) if version_of(data) == 1 else ((2 * axles, 4 * axles),)  # later with those of flanges
    static = table(data, "static_force", *shape).ravel()[: 2 * axles].reshape(axles, 2)
    held: Parts = {
        "march_states": np.asarray(data["march_states"]),
        "march_end": np.array([stored_attribute(data, "end", float)]),
        "march_evaluations": np.array([float(stored_attribute(data, "evaluations", int))]),
    }
    if "rows_like_a_wheels" not in data.attrs:
        events, peaks = (table(data, f"march_{name}", None, 4) for name in ("events", "peaks"))
        held |= {"march_events": events[:, OLD_EVENT_COLUMNS], "march_peaks": peaks[:, OLD_PEAK_COLUMNS]}
    below = None
    voids: tuple[Void, ...] = ()
    if FLEXIBLE_TRACK in scenario.needs:
        below = _rails_below(_parts_of(data, "task"), A, float(scenario.speed))
        A, ring = below.assembly, below.track.rings[0]
        voids = voids_of(scenario.track, ring.bays * ring.seats)
        held["march_rails_free"] = np.asarray(data["rails_free"])
        if "seat_events" in data:
            held["march_seat_events"] = np.asarray(data["seat_events"])
    constant = stored_attribute(data, "contact_constant", float)
    lowered = LoweredWagon(
        scenario, A, layout_of(scenario, structure), structure, static, constant, notes(data), below=below, voids=voids
    )  # fmt: skip
    return lowered, held


def _assembly_of(parts: Parts) -> Assembly:
    """Return an assembly of any version, whose indices are within its arrays.

    Earlier ones had dampings where corners now have rates, no dry friction, no contact but Hertz's, and no treads that
    yield.
    """
    needed = [name for name in Assembly._fields if name not in Assembly._field_defaults]
    if list(parts) != list(Assembly._fields)[: len(parts)] or len(parts) < len(needed):
        refuse("assembly_parts", f"{len(parts)} parts")
    A = Assembly(**parts)
    if len(A.numbers) == HERTZIAN_NUMBERS:
        A = A._replace(numbers=np.append(A.numbers, [asm.HERTZIAN, 0.0]))
    if len(A.numbers) == asm.YIELD_LAW:
        A = A._replace(numbers=np.append(A.numbers, np.zeros(asm.AT_LAW - asm.YIELD_LAW)))
    if A.element_inside.ndim == 2:
        inside, damping = A.element_inside.T
        rates = A.corners[:, 1] * np.repeat((inside >= 0.0) / damping, np.diff(A.element_corners))
        thrusts, corners = np.zeros((0, len(A.mobility))), np.column_stack([A.corners, rates])
        A = A._replace(element_inside=inside.astype(np.int64), corners=corners, thrusts=thrusts)
    check_pieces("assembly, pieces", A.pieces)
    states, bodies = len(A.start) - 1, len(A.mobility) // LANES
    indices = {"sources": states, "force_sources": len(A.mobility) - 1, "element_index": states}
    for name, last in indices.items():
        check_whole(f"assembly, {name}", getattr(A, name), 0, last)
    spans = {"spans": A.sources, "force_spans": A.force_sources, "element_spans": A.element_index}
    for name, values in spans.items():
        span = getattr(A, name)
        check(f"assembly, {name}", span, (np.diff(span, append=len(values)) >= 0) & (span >= 0), "rising numbers")
    check_whole("assembly, lanes", A.lanes[:, asm.BODY], 0, bodies - 1)
    check_whole("assembly, lanes", A.lanes[:, [asm.FIRST_PIECE, asm.LAST_PIECE]], 0, len(A.pieces) - 1)
    return A


def _rails_below(parts: Parts, A: Assembly, speed: float) -> OnRails:
    rolls = f"{WAYS[1]}.rates" in parts
    together = _ring_of(parts, WAYS[0])
    rings = together, _ring_of(parts, WAYS[1]) if rolls else together
    own = _sleepers_of(parts, WAYS[0])
    sleepers = own, _sleepers_of(parts, WAYS[1]) if rolls else own
    units = Units(*parts["units"].tolist())
    track = Track(rings, _method_of(parts["method"]), parts["places"], speed, units, sleepers)
    return OnRails(
        A._replace(rails=_rails_of(A, track)),
        track,
        (parts[f"{WAYS[0]}.modes"], parts[f"{WAYS[1]}.modes"]),
        parts["sinking"],
    )


def _rails_of(A: Assembly, track: Track) -> FloatArray:
    """Return the rails' part of an assembly; refuse that of another track."""
    nodes, fours, voids = track.method.nodes, track.fours, track.over_voids > 0
    moments = len(A.start) - late_rates(A) - 2 * fours * asm.HALF * nodes
    marched = rails_array(nodes, fours, moments, track.rolls, track.units.force, False, voids)
    rails = A.rails
    if len(rails) == len(marched) - 2:  # of versions that marched every macro step
        rails = np.insert(rails, asm.RAIL_FORCE, [track.units.force, 0.0])
    if len(rails) == len(marched):
        marched[asm.RAIL_AT_ONCE] = rails[asm.RAIL_AT_ONCE] == 1.0
    if not np.array_equal(rails, marched):
        refuse("assembly, rails", "those of another track")
    return rails


def _sleepers_of(parts: Parts, way: str) -> tuple[general.Port, ...]:
    """Return the sleepers over voids as they move in one way."""
    if f"{way}.sleepers.gap" not in parts:
        return ()
    fields = zip(*(parts[f"{way}.sleepers.{name}"] for name in general.Port._fields), strict=True)
    return tuple(general.Port(deflection, drive, float(gap), float(left)) for deflection, drive, gap, left in fields)
