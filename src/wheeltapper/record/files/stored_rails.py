"""The rails below a wagon in a file: their modes as one array of numbers, and what they showed in each macro step."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import FLEXIBLE_TRACK
from wheeltapper.lower.track.anomalies import Void
from wheeltapper.lower.wagon_on_rails import late_rates, over_voids, voids_of
from wheeltapper.march.general.contract import Port
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import Units
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import HALF, Assembly
from wheeltapper.march.wagon.multibody import RIGID, RailLog
from wheeltapper.march.wagon.rail_motion import rails_array
from wheeltapper.march.wagon.rails.march import OnRails
from wheeltapper.march.wagon.rails.modes import AGAINST, ALIKE, Track, tables_of
from wheeltapper.record.files import stored
from wheeltapper.record.files.stored import UNDAMAGED, check, table
from wheeltapper.record.files.stored_task import flat_part, method_of, stored_parts

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
WAYS = ("together", "against")
"""Prefixes of the ways in which the rails move; one that is like the first has no ring in the file."""
LATER = asm.RAIL_FORCE, asm.RAIL_AT_ONCE
"""Numbers of the rails that earlier versions did not have."""


def tables(below: OnRails, log: RailLog) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the tables and attributes of a file that contain the rails."""
    track = below.track
    parts: dict[str, Any] = {
        "method": np.array(track.method, dtype=float), "places": track.places, "units": np.array(track.units),
        "sinking": below.sinking,
    }  # fmt: skip
    for way, ring, modes, sleepers in zip(WAYS, track.rings, below.modes, track.sleepers, strict=True):
        parts[f"{way}.modes"] = modes
        if ring is not track.rings[ALIKE] or way == WAYS[ALIKE]:
            parts |= {f"{way}.{name}": value for name, value in ring._asdict().items()}
            for name, values in zip(Port._fields, zip(*sleepers, strict=True), strict=False):
                parts[f"{way}.sleepers.{name}"] = np.array(values)
    out = {
        "task": (("task_entry",), np.concatenate([flat_part(part) for part in parts.values()])),
        "rails_free": (("macro_step", "coefficient"), log.free),
    }
    shapes = [[name, np.shape(part), np.asarray(part).dtype.kind] for name, part in parts.items()]
    return out, {"task_parts": json.dumps(shapes)}


def read(data: xr.Dataset, assembly: Assembly, scenario: Scenario) -> tuple[OnRails | None, RailLog]:
    """Return the rails from a file's contents; refuse contents that no march can have written."""
    if FLEXIBLE_TRACK not in scenario.needs:
        check("assembly, rails", np.array([float(assembly.rails.size)]), assembly.rails.size == 0, "none")
        return None, RIGID
    parts = stored_parts(data)
    try:
        below = _below(parts, assembly, scenario)
    except KeyError as error:
        raise InputError("", "task_parts", f"nothing of {error.args[0]}", UNDAMAGED) from None
    nodes, fours = below.track.method.nodes, below.track.fours
    coefficients = 2 * fours * HALF * nodes
    moments = len(assembly.start) - late_rates(assembly) - coefficients
    force = below.track.units.force
    marched = rails_array(nodes, fours, moments, below.track.rolls, force, False, below.track.over_voids > 0)
    rails = assembly.rails
    if len(rails) == len(marched) - len(LATER):  # earlier versions marched every macro step
        rails = np.insert(rails, LATER[0], [force, 0.0])
    if len(rails) == len(marched):
        marched[asm.RAIL_AT_ONCE] = rails[asm.RAIL_AT_ONCE] == 1.0
    if not np.array_equal(rails, marched):
        raise InputError("", "assembly, rails", "those of another track", UNDAMAGED)
    try:
        made = tables_of(below.track, float(scenario.duration))
    except (ValueError, IndexError, np.linalg.LinAlgError) as error:
        raise InputError("", "task", f"numbers of no track ({error})"[:120], UNDAMAGED) from error
    below = below._replace(assembly=assembly._replace(rails=rails))
    free = table(data, "rails_free", None, coefficients)
    end = stored.stored_attribute(data, "end", float)
    enough = float(made.grid.times(np.array(len(free)))) >= end * (1.0 - 1e-9)
    check("rails_free", np.array([float(len(free))]), enough, "a row for each macro step")
    return below, RailLog(made.grid.ends, free, made.local, made.answers)


def _below(parts: dict[str, Any], assembly: Assembly, scenario: Scenario) -> OnRails:
    """Return the rails from their arrays."""
    together = _ring(parts, WAYS[ALIKE])
    rolls = f"{WAYS[AGAINST]}.rates" in parts
    rings = together, _ring(parts, WAYS[AGAINST]) if rolls else together
    wheelsets = len(scenario.vehicle.axles)
    shapes = {"places": (wheelsets,), "units": (2,), "sinking": (2, wheelsets)}
    shapes |= {f"{way}.modes": ring.rates.shape for way, ring in zip(WAYS, rings, strict=True)}
    for name, shape in shapes.items():
        if parts[name].shape != shape:
            raise InputError("", f"task, {name}", f"the shape {parts[name].shape}", f"{shape}; {UNDAMAGED}")
    length, force = parts["units"].tolist()
    check("task, units", parts["units"], parts["units"] > 0.0, "positive numbers")
    own = _sleepers(parts, WAYS[ALIKE])
    sleepers = own, _sleepers(parts, WAYS[AGAINST]) if rolls else own
    units = Units(length, force)
    track = Track(rings, method_of(parts["method"]), parts["places"], float(scenario.speed), units, sleepers)
    modes = parts[f"{WAYS[ALIKE]}.modes"], parts[f"{WAYS[AGAINST]}.modes"]
    return OnRails(assembly, track, modes, parts["sinking"])


def _sleepers(parts: dict[str, Any], way: str) -> tuple[Port, ...]:
    """Return the sleepers over voids as they move in one way."""
    if f"{way}.sleepers.gap" not in parts:
        return ()
    deflection, drive, gap, residual = (parts[f"{way}.sleepers.{name}"] for name in Port._fields)
    modes, shape = len(parts[f"{way}.rates"]), gap.shape
    for name, held, wanted in (
        ("deflection", deflection, (*shape, modes)), ("drive", drive, (*shape, modes)), ("residual", residual, shape),
    ):  # fmt: skip
        if held.shape != wanted or len(shape) != 1:
            raise InputError("", f"task, {way}.sleepers.{name}", f"the shape {held.shape}", f"{wanted}; {UNDAMAGED}")
    return tuple(Port(deflection[i], drive[i], float(gap[i]), float(residual[i])) for i in range(len(gap)))


def checked_voids(below: OnRails, scenario: Scenario) -> tuple[Void, ...]:
    """Return the voids of a scenario; refuse rails that have others."""
    ring = below.track.rings[ALIKE]
    voids = voids_of(scenario, ring.bays * ring.seats)
    held = over_voids(below.assembly._replace(kinds=below.assembly.kinds[: below.assembly.wheel_octets]), voids).voids
    if below.track.over_voids != len(voids) or not np.array_equal(held, below.assembly.voids):
        raise InputError("", "task_parts", "other voids than the scenario's", UNDAMAGED)
    return voids


def _ring(parts: dict[str, Any], way: str) -> Ring:
    """Return the ring of one way to move."""
    arrays = {name: parts[f"{way}.{name}"] for name in Ring._fields}
    return Ring(**arrays)._replace(
        spacing=float(arrays["spacing"]), bays=int(arrays["bays"]), seats=int(arrays["seats"])
    )  # fmt: skip
