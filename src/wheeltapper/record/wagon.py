"""What a record must know of a wagon's march."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.creep import Fastsim
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import FLEXIBLE_TRACK, YIELDING
from wheeltapper.lower.marks.wagon_marks import plastic_law
from wheeltapper.lower.structure import structure_of
from wheeltapper.lower.track.anomalies import Void
from wheeltapper.lower.wagon import (
    DECK,
    LONGEST,
    LoweredWagon,
    StateLayout,
    law_numbers,
    layout_of,
    lower_wagon,
    started,
)
from wheeltapper.march.common import program, telling
from wheeltapper.march.common.law_columns import (
    PIECE_STRETCH,
    PLASTIC_CONSTANT,
    PLASTIC_FIRST,
    PLASTIC_ONSET,
    PLASTIC_PIECES,
    YIELD_COLUMNS,
)
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows
from wheeltapper.march.wagon.assembly import HALF, LANES, PLACES, TO_RATE, Assembly
from wheeltapper.march.wagon.march import Marched as MarchedWagon
from wheeltapper.record import balanced, extent
from wheeltapper.record.contacts import SIDES, Contacts
from wheeltapper.record.elements import suspension
from wheeltapper.record.elements.voids import events_of_voids
from wheeltapper.record.energies import wagon_energy
from wheeltapper.record.files import stored, stored_rails
from wheeltapper.record.files.stored import UNDAMAGED, check, check_whole, table
from wheeltapper.record.kinds import Kind, Variables

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
TOGETHER = 4
"""The columns of a body are stored in groups of this size."""
LARGEST = 1e3
"""Largest plausible displacement (m, rad) or velocity (m/s, rad/s) in a file; a larger one is damage."""
TURNS = 1e7
"""Largest number of times that a closed path may be repeated in a run."""
HERTZIAN_NUMBERS = 20
"""Numbers of an assembly in files of versions that knew Hertz's contact only."""
ROWS_LIKE_A_WHEELS = "rows_like_a_wheels"
"""Attribute of files in which events and peaks have the columns that those of one wheel have."""
OLD_EVENT_COLUMNS, OLD_PEAK_COLUMNS = [0, 1, 3, 2], [0, 2, 3, 1]
"""Where time, kind, rate and contact of an event, and time, force, corner and contact of a maximum stood before."""
ROWS = {
    "normal": wheel_rows.NORMAL, "fx": wheel_rows.FX, "fy": wheel_rows.FY, "mz": wheel_rows.MZ, "g": wheel_rows.ROW_G,
    "slip_x": wheel_rows.SLIP_X, "slip_y": wheel_rows.SLIP_Y, "slip_turn": wheel_rows.SLIP_TURN,
    "delta": wheel_rows.ROW_DELTA, "path": wheel_rows.ROW_PATH, "u": wheel_rows.ROW_U, "rail": wheel_rows.ROW_RAIL,
    "left": wheel_rows.ROW_LEFT,
}  # fmt: skip
"""Quantities of a contact that a record reads, and their rows in the kernels' scratch memory."""


def _row_bytes(scenario: Scenario) -> float:
    return 8.0 * (PLACES * (len(scenario.vehicle.names) + 1) + asm.STEP_ELEMENTS)


def _lower(scenario: Scenario, method: str) -> LoweredWagon:
    extent.check_duration(scenario, scenario.duration / LONGEST, _row_bytes(scenario))
    if FLEXIBLE_TRACK not in scenario.needs:
        return started(lower_wagon(scenario, method), scenario)
    from wheeltapper.lower.wagon_on_rails import lower_wagon_on_rails

    return started(lower_wagon_on_rails(scenario, method), scenario)


def _contacts(scenario: Scenario, lowered: LoweredWagon) -> Contacts:
    axles = scenario.vehicle.axles
    wheelset, side = np.divmod(np.arange(2 * len(axles)), 2)
    treads = wheelset // HALF * LANES + side * HALF + wheelset % HALF
    octets = range(0, lowered.assembly.wheel_octets, int(lowered.assembly.numbers[asm.TREADS]))
    return Contacts(
        lowered.static_force.ravel(), np.repeat([axle.position for axle in axles], 2),
        np.repeat([axle.radius for axle in axles], 2),
        np.concatenate([treads + first * LANES for first in octets]), sides=2,
    )  # fmt: skip


def _seat_events(scenario: Scenario, lowered: LoweredWagon, march: MarchedWagon) -> dict[str, NDArray[Any]] | None:
    """Return where voids below the halves of sleepers close and open."""
    A = lowered.assembly
    if not len(A.voids):
        return None
    octet, lane = np.divmod(march.seat_events[:, program.EVENT_CONTACT].astype(int), LANES)
    side, place = np.divmod(lane, HALF)
    seats = np.array([void.seat for void in lowered.voids])
    found = events_of_voids(scenario, march.seat_events, seats[(octet - A.wheel_octets) * HALF + place])
    return found | {"side": np.array(SIDES)[side]}


def _sample(scenario: Scenario, lowered: LoweredWagon, march: MarchedWagon, times: FloatArray) -> Variables:
    rows = np.array(list(ROWS.values()), dtype=np.int64)
    states, rates, found = march.at(times, rows)
    found = np.moveaxis(found[:, :, _contacts(scenario, lowered).lanes], 1, 0)
    rows_of = dict(zip(ROWS, found, strict=True))
    touching = _wheel_variables(scenario, rows_of)
    wheels = 2 * len(scenario.vehicle.axles)
    for law in lowered.plastic_laws[:1]:  # all have the same
        left = law.left_over(rows_of["delta"][:, :wheels], rows_of["left"][:, :wheels])
        touching["permanent_indentation"] = left
    if lowered.below is not None:
        touching["rail_displacement"] = -rows_of["rail"][:, :wheels] - lowered.below.sinking.T.ravel()
    out: Variables = {name: (("time", "contact"), values) for name, values in touching.items()}
    shape = (len(times), len(lowered.layout.bodies), PLACES)
    held, changing = (values[:, : lowered.layout.state_count].reshape(shape) for values in (states, rates))
    motions = {
        "displacement": held[:, :, : len(MOTIONS)],
        "velocity": held[:, :, TO_RATE : TO_RATE + len(MOTIONS)],
        "acceleration": changing[:, :, TO_RATE : TO_RATE + len(MOTIONS)],
    }
    bodies = [name for name in lowered.layout.bodies if name != DECK]
    out |= {"body": (("body",), bodies), "motion": (("motion",), list(MOTIONS))}
    out |= {name: (("time", "body", "motion"), values[:, : len(bodies)]) for name, values in motions.items()}
    if DECK in lowered.layout.bodies:
        out |= {f"deck_{name}": (("time",), values[:, -1, asm.MOTION_Z]) for name, values in motions.items()}
    return out


def _wheel_variables(scenario: Scenario, rows: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the variables of each wheel (times, wheels) from the rows of all contacts (times, contacts)."""
    wheels = 2 * len(scenario.vehicle.axles)
    tread = {name: values[:, :wheels] for name, values in rows.items()}
    flange = {
        name: values[:, wheels:] if values.shape[1] > wheels else np.zeros_like(values) for name, values in rows.items()
    }
    speed = max(float(scenario.speed), 1e-300)
    sides = np.tile([1.0, -1.0], wheels // 2)
    law = scenario.creep
    rolls = float(law is not None)
    normal, steep = tread["normal"], np.hypot(1.0, flange["g"])
    along, across = (tread[name] * (normal > 0.0) * rolls for name in ("fx", "fy"))
    on_flange = flange["normal"] > 0.0
    flange_along, flange_across = (flange[name] * on_flange * rolls for name in ("fx", "fy"))
    climb = sides * flange["g"]
    sideways = flange_across / steep - climb * flange["normal"]
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = normal * (1.0 if law is None else law.friction)
        used = np.where(normal > 0.0, np.hypot(along, across) / limit, 0.0)
    losses, spins = zip(*(_t_gamma(on, rolls / speed) for on in (tread, flange)), strict=True)
    return {
        "normal_force": normal,
        "longitudinal_force": along + flange_along,
        "lateral_force": across - sides * tread["g"] * normal + sideways,
        "lateral_creep_force": across,
        "flange_force": flange["normal"] * steep,
        "vertical_force": normal + flange["normal"] + climb * flange_across / steep,
        "spin_moment": tread["mz"] * (normal > 0.0) * rolls,
        "longitudinal_creepage": tread["slip_x"] * rolls / speed,
        "lateral_creepage": tread["slip_y"] * rolls / speed,
        "spin_creepage": tread["slip_turn"] * rolls / speed,
        "friction_use": used,
        "t_gamma": losses[0] + losses[1],
        "flange_t_gamma": losses[1],
        "spin_t_gamma": spins[0] + spins[1],
        "indentation": tread["delta"],
        "constraint": tread["path"],
        "lateral_shift": tread["u"],
    }


def _t_gamma(on: dict[str, FloatArray], over_speed: float) -> tuple[FloatArray, FloatArray]:
    """Return what a contact's slips dissipate over a metre of way, N, and the share of its spin in it."""
    touches = (on["normal"] > 0.0) * over_speed
    spin = -touches * on["mz"] * on["slip_turn"]
    return spin - touches * (on["fx"] * on["slip_x"] + on["fy"] * on["slip_y"]), spin


def _element_events(scenario: Scenario, lowered: LoweredWagon, march: MarchedWagon) -> xr.Dataset:
    """Return where dry friction sticks and slides; extension is where its first end goes forth on its direction."""
    sliders = lowered.structure.sliders
    if not sliders:
        return suspension.no_events()
    end = asm.STEP_ELEMENTS + len(lowered.assembly.element_inside)
    pieces = np.vstack([np.full(len(sliders), asm.STICKS), march.steps[:, end - len(sliders) : end]])
    pieces[pieces > asm.FORTH] = asm.STICKS
    step, which = np.nonzero(pieces[1:] != pieces[:-1])
    places = lowered.layout.displacement_places[: len(lowered.structure.motions)] + TO_RATE
    names, rows = np.array([item.name for item in sliders]), np.array([item.row for item in sliders])
    sticks = pieces[step + 1, which] == asm.STICKS
    slides = np.where(sticks, pieces[step, which], pieces[step + 1, which])
    return suspension.table_of(
        march.steps[step, asm.STEP_TIME], names[which], (~sticks).astype(np.int64),
        (slides == asm.BACK).astype(np.int64), -(march.states[:, places][step] * rows[which]).sum(axis=1),
    )  # fmt: skip


def _integrate(
    scenario: Scenario, lowered: LoweredWagon, march: MarchedWagon
) -> tuple[FloatArray, Callable[[], xr.Dataset]]:
    works = wagon_energy.works(lowered, march, scenario)
    impulses = works[1][:, _contacts(scenario, lowered).lanes]
    return impulses, lambda: wagon_energy.balance(lowered, march, works, scenario)


def _tables(lowered: LoweredWagon, march: MarchedWagon) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the tables and attributes of a file that contain the assembly and the states."""
    parts = march.assembly._asdict()
    out = {
        "assembly": (("assembly_entry",), np.concatenate([np.ravel(part).astype(float) for part in parts.values()])),
        "march_states": (("step", "state"), march.states),
    }
    attributes = {
        "assembly_parts": json.dumps([[name, part.shape, part.dtype.kind] for name, part in parts.items()]),
        "contact_constant": lowered.contact_constant,
        "end": march.end,
        ROWS_LIKE_A_WHEELS: 1,
        "evaluations": march.evaluations,
    }
    if lowered.below is not None:
        more, of_rails = stored_rails.tables(lowered.below, march.rails)
        out |= more
        if len(lowered.assembly.voids):
            out["seat_events"] = ("seat_event", "event_column"), march.seat_events
        attributes |= of_rails
    return out, attributes


def _read(scenario: Scenario, data: xr.Dataset) -> tuple[LoweredWagon, MarchedWagon]:
    """Return the assembly and the march from a file's contents; refuse contents that no march can have written."""
    structure = structure_of(scenario.vehicle)
    layout = layout_of(scenario, structure)
    assembly = _assembly(data)
    _check_assembly(assembly, scenario, layout)
    count = len(structure.sliders)
    check("assembly, sliders", np.array([len(assembly.sliders)]), len(assembly.sliders) == count, f"{count} of them")
    axles = len(scenario.vehicle.axles)
    shape = (axles, 2) if stored.version_of(data) == 1 else ((2 * axles, 4 * axles),)  # later with those of flanges
    static = table(data, "static_force", *shape).ravel()[: 2 * axles].reshape(axles, 2)
    check("static_force", static, static > 0.0, "positive forces")
    constant = stored.stored_attribute(data, "contact_constant", float)
    below, log = stored_rails.read(data, assembly, scenario)
    voids = () if below is None else stored_rails.checked_voids(below, scenario)
    assembly = assembly if below is None else below.assembly
    lowered = LoweredWagon(assembly, layout, structure, static, constant, stored.notes(data), below=below, voids=voids)
    return lowered, _march_of(data, assembly, scenario, voids)._replace(rails=log)


def _assembly(data: xr.Dataset) -> Assembly:
    """Return the assembly from the array that holds all of its parts."""
    held = table(data, "assembly", None, ends=True)
    at, parts = 0, dict[str, Any]()
    for entry in stored.stored_attribute(data, "assembly_parts", list):
        try:
            name, shape, kind = entry
            size = prod(shape)
            fits = name not in parts and min(shape, default=0) >= 0 and at + size <= len(held) and kind in "fi"
        except (TypeError, ValueError):
            fits = False
        if not fits:
            raise InputError("", "assembly_parts", repr(entry)[:80], UNDAMAGED)
        part = held[at : at + size].reshape(shape)
        if kind == "i":
            check_whole(f"assembly, {name}", part, -(2**31), 2**31)
            part = part.astype(np.int64)
        parts[name], at = np.ascontiguousarray(part), at + size
    needed = [name for name in Assembly._fields if name not in Assembly._field_defaults]  # older files know no others
    if list(parts) != list(Assembly._fields)[: len(parts)] or len(parts) < len(needed) or at != len(held):
        raise InputError("", "assembly_parts", f"{len(parts)} parts with {at} numbers", UNDAMAGED)
    return _of_this_version(Assembly(**parts))


def _of_this_version(A: Assembly) -> Assembly:
    """Return an assembly of any version.

    Earlier ones had dampings where corners now have rates, no dry friction, and no contact but Hertz's.
    """
    if len(A.numbers) == HERTZIAN_NUMBERS:
        A = A._replace(numbers=np.append(A.numbers, [asm.HERTZIAN, 0.0]))
    if len(A.numbers) == asm.YIELD_LAW:  # of versions in which no tread yielded
        A = A._replace(numbers=np.append(A.numbers, np.zeros(asm.AT_LAW - asm.YIELD_LAW)))
    if A.element_inside.shape != (len(A.element_inside), 2) or A.corners.shape != (len(A.corners), 2):
        return A
    _check_spans("element_corners", A.element_corners, len(A.element_inside), len(A.corners))
    inside, damping = A.element_inside.T
    rates = A.corners[:, 1] * np.repeat((inside >= 0.0) / damping, np.diff(A.element_corners))
    thrusts, corners = np.zeros((0, len(A.mobility))), np.column_stack([A.corners, rates])
    return A._replace(element_inside=inside.astype(np.int64), corners=corners, thrusts=thrusts)


def _check_assembly(A: Assembly, scenario: Scenario, layout: StateLayout) -> None:
    """Refuse an assembly that does not belong to this scenario, or has an index out of range."""
    treads = -(-len(scenario.vehicle.axles) // HALF)
    octets, bodies, states, elements = A.wheel_octets, len(layout.bodies), len(A.start), len(A.element_inside)
    rigid, sliders = len(A.yields), len(A.sliders)
    plastic = YIELDING in scenario.needs
    columns, law = program.MARKED_COLUMNS if plastic else program.PIECE_COLUMNS, len(A.law) if plastic else 0
    shapes = {
        "numbers": (asm.ASSEMBLY_NUMBERS,), "scales": (states,), "lanes": (len(A.kinds), asm.LANE_COLUMNS, LANES),
        "voids": (len(A.voids), asm.VOID_COLUMNS, LANES),
        "cells": (octets // treads, A.cells.shape[1] if A.cells.ndim == 4 else 0, asm.TABLES, asm.TABLE_TERMS),
        "saturation": (asm.SATURATION_CELLS, asm.TABLE_TERMS), "pieces": (len(A.pieces), columns),
        "law": (law, YIELD_COLUMNS),
        "columns": (LANES * len(A.sources),), "force_columns": (LANES * len(A.force_sources),),
        "mobility": (bodies * LANES,), "loads": (bodies * LANES,), "element_weight": (len(A.element_index),),
        "corners": (len(A.corners), asm.CORNER_COLUMNS), "element_inside": (elements,),
        "sliders": (sliders, asm.SLIDER_COLUMNS), "yields": (rigid, rigid), "thrusts": (rigid, bodies * LANES),
    }  # fmt: skip
    for name, shape in shapes.items():
        held: NDArray[np.float64] = getattr(A, name)
        if held.shape != shape or (0 in held.shape[:1] and name in ("cells", "pieces")):
            raise InputError("", f"assembly, {name}", f"the shape {held.shape}", f"{shape}; {UNDAMAGED}")
        if name not in ("lanes", "pieces"):
            check(f"assembly, {name}", held, np.isfinite(held), "finite numbers")
    inside = states - layout.state_count
    if inside < 0 or inside % LANES or octets not in (treads, 2 * treads) or A.cells.shape[1] == 0:
        raise InputError("", "assembly", f"{states} states and {octets} octets of contacts", UNDAMAGED)
    kinds = np.repeat([asm.TREAD, asm.FLANGE], treads)[:octets]
    kinds = np.append(kinds, np.full(len(A.voids), asm.BELOW_SLEEPERS))
    check("assembly, kinds", A.kinds, A.kinds == kinds, "treads, then flanges, then voids")
    check("assembly, start", A.start, np.abs(A.start) < LARGEST, f"states below {LARGEST:g}")
    _check_numbers(A, scenario, layout, treads)
    _check_law(A, scenario)
    stored.check_pieces("assembly, pieces", A.pieces)
    _check_lanes(A, scenario, bodies, treads)
    _check_spans("spans", A.spans, bodies, len(A.sources), TOGETHER)
    _check_spans("force_spans", A.force_spans, bodies, len(A.force_sources), TOGETHER)
    check_whole("assembly, sources", A.sources, 0, states - 1)
    check_whole("assembly, force_sources", A.force_sources, 0, bodies * LANES - 1)
    _check_elements(A, layout.state_count)


def _check_numbers(A: Assembly, scenario: Scenario, layout: StateLayout, treads: int) -> None:
    """Refuse counts and choices that differ from those of the scenario."""
    creep = scenario.creep
    chosen = asm.NO_CREEP if creep is None else asm.CURVE
    cells, strips = 0, 0
    law, loss = law_numbers(scenario)
    if isinstance(creep, Fastsim):
        chosen, cells, strips = asm.STRIPS, creep.cells, creep.strips
    expected = {
        asm.SPEED: scenario.speed, asm.RUN_END: scenario.duration, asm.TREADS: treads,
        asm.DECK: len(layout.bodies) - 1 if layout.bodies[-1] not in scenario.vehicle.names else -1,
        asm.CREEP: chosen, asm.STRIP_CELLS: cells, asm.STRIP_COUNT: strips, asm.CONTACT_LAW: law,
        asm.MATERIAL_LOSS: loss,
    }  # fmt: skip
    for place, value in expected.items():
        check("assembly, numbers", A.numbers[[place]], A.numbers[place] == value, f"{value:g}, as in the scenario")
    check_whole("assembly, numbers", A.numbers[[asm.STRIP_BOUND, asm.QUASI_STATIC]], 0, 1)
    positive = A.numbers[[asm.CELLS_PER_M, asm.STATIC_INDENTATION, asm.PULSE]]
    check("assembly, numbers", positive, positive > 0.0, "positive numbers")


def _check_law(A: Assembly, scenario: Scenario) -> None:
    """Refuse a law that yields otherwise than that of the scenario."""
    if YIELDING not in scenario.needs:
        return
    law, numbers = plastic_law(scenario.contact), A.numbers[asm.YIELD_LAW : asm.AT_LAW]
    check("assembly, law", np.array([len(A.law)]), len(A.law) == len(law), f"{len(law)} pieces")
    check("assembly, law", A.law, np.abs(A.law - law) <= 1e-9 * np.abs(law).max(), "the scenario's law")
    expected = {PLASTIC_CONSTANT: 1.0, PLASTIC_FIRST: 0.0, PLASTIC_PIECES: float(len(law))}
    for place, value in expected.items():
        check("assembly, numbers", numbers[[place]], numbers[place] == value, f"{value:g}")
    onset = numbers[[PLASTIC_ONSET]]
    check("assembly, numbers", onset, onset > 0.0, "a positive indentation at yield")


def _check_lanes(A: Assembly, scenario: Scenario, bodies: int, treads: int) -> None:
    """Refuse lanes without a wheel, or with a body or path that does not exist."""
    names = "assembly, lanes"
    wheels = np.zeros((treads, 2, HALF))
    for k in range(len(scenario.vehicle.axles)):
        wheels[k // HALF, :, k % HALF] = 1.0, -1.0
    sides = A.lanes[:, asm.SIDE]
    check(names, A.lanes[A.wheel_octets :], A.lanes[A.wheel_octets :] == 0.0, "nothing of voids")
    there = np.tile(wheels.reshape(treads, LANES), (A.wheel_octets // treads, 1))
    check(names, sides, sides == np.vstack([there, np.zeros((len(A.voids), LANES))]), "wheels")
    check_whole(names, A.lanes[:, asm.BODY], 0, bodies - 1)
    last = len(A.pieces) - 1
    check_whole(names, A.lanes[:, [asm.FIRST_PIECE, asm.LAST_PIECE]], 0, last)
    check_whole(names, A.lanes[:, asm.PATH_LOOP], 0, last + 1)
    check_whole(names, A.lanes[:, asm.PATH_LOOP_JOIN], program.SOFT, program.JUMP)
    check(names, A.lanes, ~np.isnan(A.lanes), "no NaN")
    check(names, A.lanes[:, asm.NOMINAL], np.isfinite(A.lanes[:, asm.NOMINAL]), "finite radii")
    there = A.lanes[:, :, :].transpose(0, 2, 1)[sides != 0.0]
    loop = there[:, asm.PATH_LOOP].astype(int)
    stop = A.pieces[there[:, asm.LAST_PIECE].astype(int), program.STOP]
    again = loop <= there[:, asm.LAST_PIECE]
    back = A.pieces[np.minimum(loop, last), program.START]
    reach = scenario.speed * scenario.duration
    goes_on = np.where(again, TURNS * (stop - back) >= reach, stop >= reach * (1.0 - 1e-9))
    check(names, loop.astype(float), goes_on, "paths that go on to the end of the run")


def _check_spans(name: str, spans: IntArray, count: int, total: int, step: int = 1) -> None:
    """Refuse spans that do not divide the whole array."""
    good = len(spans) == count + 1 and spans[0] == 0 and spans[-1] == total
    if not good or (np.diff(spans) < 0).any() or (spans % step).any():
        raise InputError("", f"assembly, {name}", f"{spans.tolist()}"[:80], f"rising from 0 to {total}; {UNDAMAGED}")


def _check_elements(A: Assembly, own: int) -> None:
    """Refuse nonlinear elements that act on no motion, or whose characteristic does not rise through zero."""
    elements, laws = len(A.element_inside), len(A.element_inside) - len(A.sliders)
    _check_spans("element_spans", A.element_spans, elements, len(A.element_index))
    _check_spans("element_corners", A.element_corners, laws, len(A.corners))
    check_whole("assembly, element_index", A.element_index, 0, len(A.start) - 1)
    check_whole("assembly, element_inside", A.element_inside, -1, len(A.start) - 1)
    inside = A.element_inside[laws:] >= 0
    springs_first = inside == (np.arange(len(inside)) < len(inside) - len(A.yields))
    check("assembly, element_inside", A.element_inside[laws:], springs_first, "springs, then rigid friction")
    forces, limits, springs = A.sliders[:, : asm.SLIDER_MARK].T
    good = (forces > 0.0) & (limits >= forces) & ((springs > 0.0) == inside)
    check("assembly, sliders", limits, good, "limits of at least the positive forces")
    within = np.repeat(A.element_inside, np.diff(A.element_spans))
    has_motion = (A.element_index < own) | (A.element_index == within)
    check("assembly, element_index", A.element_index, has_motion, "displacements or velocities")
    for first, end in zip(A.element_corners, A.element_corners[1:], strict=False):
        places = A.corners[first:end, 0]
        far = len(places) > 1 and (np.diff(places) > 0.0).all() and places[0] < -LARGEST and places[-1] > LARGEST
        check("assembly, corners", places, bool(far), f"rising corners from below -{LARGEST:g} to above {LARGEST:g}")


def _march_of(data: xr.Dataset, A: Assembly, scenario: Scenario, voids: tuple[Void, ...]) -> MarchedWagon:
    """Return the march."""
    status = stored.status_of(data)
    end = stored.stored_attribute(data, "end", float)
    check("end", np.array([end]), 0.0 < end <= scenario.duration * (1.0 + 1e-9), "a time within the run")
    elements, octets = len(A.element_inside), len(A.kinds)
    behind = asm.STEP_ELEMENTS + elements
    steps = stored.steps_of(data, behind + A.stretch_columns, asm.STEP_TIME, end)
    begins, lengths = steps[:, asm.STEP_TIME], steps[:, asm.STEP_LENGTH]
    follows = np.abs(begins + lengths - np.append(begins[1:], end)) <= 1e-9 * end
    check("march_steps", lengths, follows & (lengths > 0.0), "steps that follow each other")
    at_once = bool(A.rails.size and A.rails[asm.RAIL_AT_ONCE])
    check_whole("march_steps", steps[:, asm.STEP_CLOSED], 0, 2.0 ** (octets * LANES + at_once) - 1)
    pieces = [np.diff(A.element_corners) - 2, np.full(len(A.sliders), asm.FORTH)]
    most = np.concatenate(pieces)
    most[elements - len(A.yields) :] = asm.FULL_FORTH  # of rigid friction
    for element in range(elements):
        check_whole("march_steps", steps[:, asm.STEP_ELEMENTS + element], 0, most[element])
    if A.stretch_columns:
        check_whole("march_steps", steps[:, behind:], 0, float(A.law[:, PIECE_STRETCH].max()))
    moments = np.arange(len(A.start)) >= (A.rails[asm.RAIL_STATES] if A.rails.size else np.inf)
    broken = moments | (status in (program.NOT_FINITE, balanced.UNBALANCED))  # such states are no damage of the file
    states = table(data, "march_states", len(steps), len(A.start))
    state = table(data, "march_state", len(A.start), anything=status == program.NOT_FINITE)
    check("march_states", states, broken | (np.abs(states) < LARGEST), f"states below {LARGEST:g}")
    check("march_state", state, broken | (np.abs(state) < LARGEST), f"states below {LARGEST:g}")
    events, peaks = (table(data, f"march_{name}", None, 4) for name in ("events", "peaks"))
    if ROWS_LIKE_A_WHEELS not in data.attrs:  # earlier versions had the columns in another order
        events, peaks = events[:, OLD_EVENT_COLUMNS], peaks[:, OLD_PEAK_COLUMNS]
    wheels = np.flatnonzero(A.lanes[:, asm.SIDE].ravel())
    seated = np.zeros((0, program.EVENT_COLUMNS))
    if voids:
        seated = table(data, "seat_events", None, program.EVENT_COLUMNS)
        stored.rising("seat_events", seated[:, program.EVENT_TIME], end)
        octet, lane = np.divmod(seated[:, program.EVENT_CONTACT] - LANES * A.wheel_octets, LANES)
        number = octet * HALF + lane % HALF
        check("seat_events", number, (number >= 0.0) & (number < len(voids)) & (number % 1.0 == 0.0), "voids")
        check_whole("seat_events", seated[:, program.EVENT_KIND], program.LOSS, program.IMPACT)
    for name, rows in (("march_events", events), ("march_peaks", peaks)):
        contact = rows[:, program.EVENT_CONTACT]
        check(name, contact, np.isin(contact, wheels), "contacts of wheels")
        for wheel in wheels:  # within a step, the maxima are sorted by wheel
            stored.rising(name, rows[contact == wheel, program.EVENT_TIME], end)
    latest = program.YIELD if A.stretch_columns else program.IMPACT
    check_whole("march_events", events[:, program.EVENT_KIND], program.LOSS, latest)
    evaluations = stored.stored_attribute(data, "evaluations", int)
    return MarchedWagon(A, status, steps, states, events, peaks, end, state, evaluations, seat_events=seated)


WAGON = Kind(
    lower=_lower,
    chunk=telling.WAGON_CHUNK,
    row_bytes=_row_bytes,
    missing_part=lambda scenario, lowered, march: wagon_energy.missing_part(lowered, march, scenario),
    contacts=_contacts,
    sample=_sample,
    integrate=_integrate,
    tables=_tables,
    read=_read,
    element_events=_element_events,
    seat_events=_seat_events,
)
"""Contacts of the treads of all wheels, and of the flanges if they can touch; SI units; the motions of all bodies."""
