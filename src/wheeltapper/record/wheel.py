"""What a record must know of a wheelset's march."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import YIELDING
from wheeltapper.lower.build import Lowered, lower
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.march.common import program as contract
from wheeltapper.march.common import telling
from wheeltapper.march.common.program import Program
from wheeltapper.record import balanced, extent
from wheeltapper.record.contacts import Contacts
from wheeltapper.record.energies import balance as energy
from wheeltapper.record.files import stored
from wheeltapper.record.files.stored import UNDAMAGED, check, check_whole, table
from wheeltapper.record.kinds import Kind, Variables

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.wheel.march import Marched as MarchedWheel

FloatArray = NDArray[np.float64]
KEPT = contract.DAMPER_DAMPING
"""Of a program's numbers those of a damper with an end are a table of their own in files, where there is one."""
LATER = {contract.START_SHIFT: 0.0, contract.LAST_IMPACT: -1.0, contract.LAST_LOSS: -1.0, contract.MEMORY: 0.0}
"""Numbers of a program that older files lack, and the values that they have for such files."""


def _lower(scenario: Scenario, method: str) -> Lowered:
    extent.check_time(scenario)
    lowered = lower(scenario, method)
    extent.check_pieces(scenario, lowered)
    return lowered


def _sample(scenario: Scenario, lowered: Lowered, march: MarchedWheel, times: FloatArray) -> Variables:
    """Return all variables: those that every wheel has, then those of a law, a deck and a damper's own end."""
    from wheeltapper.march.wheel import dense

    rows = march.at(times / lowered.time)
    length, force = lowered.length, lowered.force
    speed, acceleration = length / lowered.time, length / lowered.time**2
    along, touching = ("time",), ("time", "contact")
    out: Variables = {
        "wheel_displacement": (along, rows[:, dense.OUT_WHEEL_Y] * length),
        "wheel_velocity": (along, rows[:, dense.OUT_WHEEL_V] * speed),
        "wheel_acceleration": (along, rows[:, dense.OUT_WHEEL_A] * acceleration),
        "normal_force": (touching, rows[:, [dense.OUT_FORCE]] * force),
        "indentation": (touching, rows[:, [dense.OUT_DELTA]] * length),
        "constraint": (touching, rows[:, [dense.OUT_PATH_Y]] * length),
    }
    for law in lowered.plastic_laws:
        left = law.left_over(rows[:, [dense.OUT_DELTA]] * length, rows[:, [dense.OUT_RESIDUAL]] * length)
        out["permanent_indentation"] = touching, left
    if lowered.program.numbers[contract.DECK_MASS] > 0.0:
        out["deck_displacement"] = along, rows[:, dense.OUT_DECK_Y] * length
        out["deck_velocity"] = along, rows[:, dense.OUT_DECK_V] * speed
        out["deck_acceleration"] = along, rows[:, dense.OUT_DECK_A] * acceleration
    if lowered.program.damper_ends:
        out["damper_end_displacement"] = along, rows[:, dense.OUT_END_Y] * length
        out["damper_force"] = along, rows[:, dense.OUT_DAMPER_FORCE] * force
    return out


def _integrate(
    scenario: Scenario, lowered: Lowered, march: MarchedWheel
) -> tuple[FloatArray, Callable[[], xr.Dataset]]:
    found = energy.integrate(lowered, march)
    return found.impulse[:, None] * lowered.force * lowered.time, lambda: energy.balance(lowered, found)


def _tables(lowered: Lowered, march: MarchedWheel) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the tables and attributes of a file that contain the program."""
    program = lowered.program
    units = [lowered.length, lowered.time, lowered.force, lowered.static_force, lowered.contact_constant]
    out = {
        "program_pieces": (("piece", "piece_column"), march.pieces),
        "program_numbers": (("number",), program.numbers[:KEPT]),
        "units": (("unit",), np.array(units)),
    }
    if len(program.law):
        out["program_law"] = (("law_piece", "law_column"), program.law)
    if program.damper_ends:
        out["program_damper"] = (("damper_entry",), program.numbers[KEPT:])
        out["march_stops"] = (("damper_event", "stop_column"), march.stops)
    return out, {"loop": [lowered.table.loop, lowered.table.loop_join]}


def _read(scenario: Scenario, data: xr.Dataset) -> tuple[Lowered, MarchedWheel]:
    """Return the program and the march from a file's contents; refuse contents that no march can have written."""
    program, loop, join = _program_of(data)
    if len(program.law) and YIELDING not in scenario.needs:
        raise InputError("", "program_law", f"a law beside {type(scenario.contact).__name__}", UNDAMAGED)
    units = table(data, "units", 5)
    check("units", units, (units > 1e-30) & (units < 1e30), "positive numbers of any use")
    length, time, force, static, constant = units.tolist()
    lowered = Lowered(
        program, PathTable(program.pieces, loop, join), length, time, force, static, constant, stored.notes(data)
    )
    return lowered, _march_of(data, program)


def _program_of(data: xr.Dataset) -> tuple[Program, int, int]:
    """Return the checked program of one wheel, with the piece with which its path continues, and the joint."""
    pieces = table(data, "program_pieces", None, (contract.PIECE_COLUMNS, contract.MARKED_COLUMNS), ends=True)
    law = contract.ELASTIC
    if "program_law" in data.variables:
        law = table(data, "program_law", None, contract.LAW_COLUMNS)
        starts = law[:, contract.LAW_START]
        check("program_law", starts, np.diff(starts, prepend=-np.inf) > 0.0, "rising starts")
        check("program_law", law[:, contract.LAW_SCALE], law[:, contract.LAW_SCALE] > 0.0, "positive scales")
        table(data, "program_pieces", None, contract.MARKED_COLUMNS, ends=True)
    numbers = table(data, "program_numbers", range(contract.START_SHIFT, KEPT + 1), ends=True)
    numbers = np.append(numbers, [LATER[k] for k in range(len(numbers), KEPT)])
    open_ended = np.isin(np.arange(KEPT), (contract.DECK_FROM, contract.DECK_TO))
    check("program_numbers", numbers, np.isfinite(numbers) | open_ended, "finite numbers")
    if numbers[contract.ORDER] not in (contract.DEFAULT_ORDER, contract.STRICT_ORDER):
        raise InputError("", "program_numbers", f"the order {numbers[contract.ORDER]:g}", UNDAMAGED)
    loop, join = _loop(data, len(pieces))
    check_whole("program_numbers", numbers[[contract.LOOP]], loop, loop)
    stored.check_pieces("program_pieces", pieces)
    damper = np.zeros(contract.NUMBERS - KEPT)
    if "program_damper" in data.variables:
        damper = table(data, "program_damper", len(damper))
        start = contract.DAMPER_START - KEPT
        check("program_damper", damper, (damper >= 0.0) | (np.arange(len(damper)) == start), "positive")
    return Program(pieces, np.append(numbers, damper), law), loop, join


def _loop(data: xr.Dataset, count: int) -> tuple[int, int]:
    if count == 0:
        raise InputError("", "program_pieces", "no pieces of a path", UNDAMAGED)
    try:
        loop, join = (float(value) for value in data.attrs["loop"])
    except (KeyError, TypeError, ValueError):
        raise InputError("", "loop", repr(data.attrs.get("loop", "nothing"))[:80], UNDAMAGED) from None
    check_whole("loop", np.array([loop]), 0, count)
    check_whole("loop", np.array([join]), contract.SOFT, contract.JUMP)
    return int(loop), int(join)


def _march_of(data: xr.Dataset, program: Program) -> MarchedWheel:
    from wheeltapper.march.wheel.march import Marched as MarchedWheel

    status = stored.status_of(data)
    width = contract.ENDED_COLUMNS if program.damper_ends else contract.STEP_COLUMNS
    state = table(data, "march_state", range(contract.LENGTH, width + 1), anything=status == contract.NOT_FINITE)
    end = float(state[contract.TIME])
    check("march_state", state[[contract.TIME]], 0.0 < end < np.inf, "a positive time")
    steps = stored.steps_of(data, width, contract.TIME, end)
    check("march_steps", steps[:, contract.LENGTH], steps[:, contract.LENGTH] >= 0.0, "lengths of 0 or more")
    for rows in (steps, state[None]):
        check_whole("march_steps", rows[:, contract.PHASE], 0, contract.YIELDING + len(program.law) - 1)
        check_whole("march_steps", rows[:, contract.PIECE], 0, len(program.pieces) - 1)
        check_whole("march_steps", rows[:, contract.ON_DECK], 0, 1)
    stops = contract.NO_STOPS
    if program.damper_ends:
        check_whole("march_steps", steps[:, contract.END_MODE], contract.LOWER, contract.LINKED)
        stops = table(data, "march_stops", None, contract.STOP_COLUMNS)
        stored.rising("march_stops", stops[:, contract.STOP_TIME], end)
        check_whole("march_stops", stops[:, contract.STOP_KIND], contract.REACHED, contract.LEFT)
    events = table(data, "march_events", None, contract.EVENT_COLUMNS)
    stored.rising("march_events", events[:, contract.EVENT_TIME], end)
    check_whole("march_events", events[:, contract.EVENT_KIND], contract.LOSS, contract.YIELD)
    peaks = table(data, "march_peaks", None, (contract.PEAK_COLUMNS - 1, contract.PEAK_COLUMNS))
    stored.rising("march_peaks", peaks[:, contract.PEAK_TIME], end)
    return MarchedWheel(status, steps, events, peaks, state, stops, program.pieces, program)


WHEEL = Kind(
    lower=_lower,
    chunk=telling.CHUNK,
    row_bytes=lambda scenario: extent.ROW_BYTES,
    missing_part=lambda scenario, lowered, march: balanced.missing_part(march),
    contacts=lambda scenario, lowered: Contacts(
        np.array([lowered.static_force]),
        np.zeros(1),
        np.array([float(scenario.vehicle.radius)]),
        np.zeros(1, dtype=np.int64),
        sides=1,
    ),
    sample=_sample,
    integrate=_integrate,
    stops=lambda lowered, march: (march.stops, np.zeros(len(march.stops), dtype=np.int64)),
    tables=_tables,
    read=_read,
)
"""One contact for both wheels of a wheelset, scaled rows, the motion of the wheel's centre."""
