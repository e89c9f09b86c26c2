"""What a record must know of the general march: contacts on rails that give way, the plane motions of the vehicle."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.plane import end_name
from wheeltapper.ground.needs import YIELDING
from wheeltapper.lower.on_rails import DECK, LoweredOnRails, lower_on_rails
from wheeltapper.march.common import program as contract
from wheeltapper.march.common import telling
from wheeltapper.march.general.layout import ROW_COLUMNS
from wheeltapper.march.general.tables import longest_step
from wheeltapper.march.general.task import Marched
from wheeltapper.record import extent
from wheeltapper.record.contacts import Contacts
from wheeltapper.record.elements.dampers_on_rails import damper_motion, has_ends, stops_met
from wheeltapper.record.elements.elements_on_rails import element_events, element_motion
from wheeltapper.record.elements.voids import events_of_voids
from wheeltapper.record.kinds import Kind, Variables

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
WHEELSET = ("wheel_displacement", "wheel_velocity", "wheel_acceleration")
"""Variables of the motion of a wheelset's centre; other freedoms have variables of their own names."""
MOTIONS = ("", "_velocity", "_acceleration")
"""What follows a freedom's name: its displacement or rotation, and the two derivatives."""
DECK_MOTIONS = "_displacement", "_velocity", "_acceleration"


def _row_bytes(scenario: Scenario) -> float:
    return 8.0 * ROW_COLUMNS * len(scenario.vehicle.plane.positions)


def _lower(scenario: Scenario, method: str) -> LoweredOnRails:
    lowered = lower_on_rails(scenario, method)
    task = lowered.program
    extent.check_duration(
        scenario, task.duration / longest_step(task.system.ring, task.method, task.system.bodies), _row_bytes(scenario)
    )
    return lowered


def _contacts(scenario: Scenario, lowered: LoweredOnRails) -> Contacts:
    positions = np.array(lowered.plane.positions)
    radius = np.array([wheelset.radius for wheelset in lowered.plane.wheelsets], dtype=float)
    return Contacts(lowered.static_force, positions, radius, np.arange(len(positions)), sides=1)


def _seat_events(scenario: Scenario, lowered: LoweredOnRails, march: Marched) -> dict[str, NDArray[Any]] | None:
    """Return where voids below sleepers close and open; a rate is that of the sleeper, downwards."""
    if not lowered.anomalies.voids:
        return None
    voids = march.seat_events[:, contract.EVENT_CONTACT] < len(lowered.anomalies.voids)
    rows = march.seat_events[voids]
    seats = np.array([void.seat for void in lowered.anomalies.voids])
    return events_of_voids(scenario, rows, seats[rows[:, contract.EVENT_CONTACT].astype(int)])


def _sample(scenario: Scenario, lowered: LoweredOnRails, march: Marched, times: FloatArray) -> Variables:
    found = march.at(times)
    wheels = len(lowered.plane.wheelsets)
    along, touching = ("time",), ("time", "contact")
    sinking = march.sinking[:wheels]  # below the height of first touch
    motions = (-found.displacement, -found.velocity, -found.acceleration)
    out: Variables = {
        name: (touching, values[:, :wheels] - (sinking if name == WHEELSET[0] else 0.0))
        for name, values in zip(WHEELSET, motions, strict=True)
    }
    out |= {
        "normal_force": (touching, found.force[:, :wheels] * lowered.force),
        "indentation": (touching, found.indentation[:, :wheels]),
        "constraint": (touching, found.path[:, :wheels]),
    }
    if YIELDING in scenario.needs:
        left = [
            law.left_over(found.indentation[:, wheel], march.left_before(wheel, times))
            for wheel, law in enumerate(lowered.plastic_laws)
        ]
        out["permanent_indentation"] = touching, np.stack(left, axis=1)
    if lowered.modes is not None:
        out["rail_displacement"] = touching, -found.rail[:, :wheels]
    if has_ends(lowered):
        place, force = damper_motion(lowered, march, times, found)
        out |= {"damper_end_displacement": (touching, place), "damper_force": (touching, force)}
    out |= element_motion(lowered, found)
    ends = [end_name(i) for i in range(wheels)]
    for freedom in range(wheels, len(lowered.plane.freedoms)):
        if lowered.plane.freedoms[freedom] in ends:
            continue
        name = lowered.plane.freedoms[freedom].replace(" ", "_")
        for after, values in zip(DECK_MOTIONS if name == DECK else MOTIONS, motions, strict=True):
            out[name + after] = along, values[:, freedom]
    return out


def _integrate(
    scenario: Scenario, lowered: LoweredOnRails, march: Marched
) -> tuple[FloatArray, Callable[[], xr.Dataset]]:
    from wheeltapper.record.energies.energy_on_rails import balance

    return march.impulses() * lowered.force, lambda: balance(scenario, lowered, march)


def _missing_part(scenario: Scenario, lowered: LoweredOnRails, march: Marched) -> float:
    """Return zero of a run in numbers: no part is accepted unsolved, and the balance takes longer than the run."""
    return 0.0 if march.is_solved else np.nan


ON_RAILS = Kind(
    lower=_lower,
    chunk=telling.GENERAL_CHUNK,
    row_bytes=_row_bytes,
    missing_part=_missing_part,
    contacts=_contacts,
    sample=_sample,
    seat_events=_seat_events,
    integrate=_integrate,
    stops=stops_met,
    element_events=element_events,
    balance_is_dear=True,
)
"""Contacts per wheelset, SI units, the motions of the vehicle in the vertical plane."""
