"""What a record must know of a wagon's march."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.lower.wagon import DECK, LONGEST, LoweredWagon, lower_wagon
from wheeltapper.march import assembly as asm
from wheeltapper.march import run, telling, wheel_rows
from wheeltapper.march.assembly import HALF, LANES, PLACES, TO_RATE
from wheeltapper.march.multibody import MultibodyMarch
from wheeltapper.record import creep_range, extent, wagon_energy, wagon_store
from wheeltapper.record.contacts import Contacts
from wheeltapper.record.kinds import Kind, Variables

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
ROWS = {
    "normal": wheel_rows.NORMAL, "fx": wheel_rows.FX, "fy": wheel_rows.FY, "mz": wheel_rows.MZ, "g": wheel_rows.ROW_G,
    "slip_x": wheel_rows.SLIP_X, "slip_y": wheel_rows.SLIP_Y, "slip_turn": wheel_rows.SLIP_TURN,
    "delta": wheel_rows.ROW_DELTA, "path": wheel_rows.ROW_PATH, "u": wheel_rows.ROW_U,
}  # fmt: skip
"""Quantities of a contact that a record reads, and their rows in the kernels' scratch memory."""


def _row_bytes(scenario: Scenario) -> float:
    return 8.0 * (PLACES * (len(scenario.vehicle.names) + 1) + asm.STEP_ELEMENTS)


def _lower(scenario: Scenario, method: str) -> LoweredWagon:
    extent.check_duration(scenario, scenario.duration / LONGEST, _row_bytes(scenario))
    return lower_wagon(scenario, method)


def _teller(scenario: Scenario, lowered: LoweredWagon) -> Callable[[float], bool]:
    return extent.teller("marching", lowered.time, scenario.duration, telling.WAGON_CHUNK, _row_bytes(scenario))


def _contacts(scenario: Scenario, lowered: LoweredWagon) -> Contacts:
    axles = scenario.vehicle.axles
    wheelset, side = np.divmod(np.arange(2 * len(axles)), 2)
    treads = wheelset // HALF * LANES + side * HALF + wheelset % HALF
    octets = range(0, len(lowered.assembly.kinds), int(lowered.assembly.numbers[asm.TREADS]))
    return Contacts(
        lowered.static_force.ravel(), np.repeat([axle.position for axle in axles], 2),
        np.concatenate([treads + first * LANES for first in octets]), sides=2,
    )  # fmt: skip


def _free(contacts: Contacts, march: MultibodyMarch) -> NDArray[np.bool_]:
    closed = march.steps[:, [asm.STEP_CLOSED]]
    return np.asarray(np.floor(closed / 2.0**contacts.lanes) % 2.0 == 0.0)


def _sample(scenario: Scenario, lowered: LoweredWagon, march: MultibodyMarch, times: FloatArray) -> Variables:
    rows = np.array(list(ROWS.values()), dtype=np.int64)
    states, rates, found = run.replay(lowered.assembly, march, times, rows)
    found = np.moveaxis(found[:, :, _contacts(scenario, lowered).lanes], 1, 0)
    touching = _forces(scenario, dict(zip(ROWS, found, strict=True)))
    out: Variables = {name: (("time", "contact"), values) for name, values in touching.items()}
    shape = (len(times), len(lowered.layout.bodies), PLACES)
    held, changing = (values[:, : lowered.layout.states].reshape(shape) for values in (states, rates))
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


def _forces(scenario: Scenario, rows: dict[str, FloatArray]) -> dict[str, FloatArray]:
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
    sideways = flange_across / steep - sides * flange["g"] * flange["normal"]
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = normal * (1.0 if law is None else law.friction)
        used = np.where(normal > 0.0, np.hypot(along, across) / limit, 0.0)
    return {
        "normal_force": normal,
        "longitudinal_force": along + flange_along,
        "lateral_force": across - sides * tread["g"] * normal + sideways,
        "lateral_creep_force": across,
        "flange_force": flange["normal"] * steep,
        "spin_moment": tread["mz"] * (normal > 0.0) * rolls,
        "longitudinal_creepage": tread["slip_x"] * rolls / speed,
        "lateral_creepage": tread["slip_y"] * rolls / speed,
        "spin_creepage": tread["slip_turn"] * rolls / speed,
        "friction_use": used,
        "indentation": tread["delta"],
        "constraint": tread["path"],
        "lateral_shift": tread["u"],
    }


def _integrate(scenario: Scenario, lowered: LoweredWagon, march: MultibodyMarch) -> tuple[FloatArray, xr.Dataset]:
    works = wagon_energy.works(lowered, march, scenario)
    impulses = works[1][:, _contacts(scenario, lowered).lanes]
    return impulses, wagon_energy.balance(lowered, march, works, scenario)


WAGON = Kind(
    begin=asm.STEP_TIME,
    length=asm.STEP_LENGTH,
    lower=_lower,
    teller=_teller,
    beyond=creep_range.beyond_spin,
    missing_part=lambda scenario, lowered, march: wagon_energy.missing_part(lowered, march, scenario),
    contacts=_contacts,
    end=lambda lowered, march: march.end,
    free=_free,
    sample=_sample,
    integrate=_integrate,
    tables=wagon_store.tables,
    read=wagon_store.read,
)
"""Contacts of the treads of all wheels, and of the flanges if they can touch; SI units; the motions of all bodies."""
