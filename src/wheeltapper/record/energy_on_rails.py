"""The energy balance of a vehicle on rails that give way, and of the track."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.on_rails import LoweredOnRails
from wheeltapper.lower.track.section import section_of
from wheeltapper.march import run
from wheeltapper.record.balanced import AT_REST
from wheeltapper.record.dampers_on_rails import first_stop
from wheeltapper.record.elements_on_rails import element_energies, first_element
from wheeltapper.record.energy_of_track import track_works

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.general.task import Marched

MEANINGS = {
    "kinetic": "change of kinetic energy of the vehicle, and of a deck",
    "elastic": "change of elastic energy of the vehicle's springs, and of a deck's",
    "dissipated": "energy dissipated in the vehicle's dampers and by its dry friction, and in a deck's dampers",
    "dissipated_friction": "of that, by dry friction",
    "into_contact": "energy that the contacts took: that of their elastic compression, and what they dissipated",
    "into_track": "energy that the contact forces gave to the track",
    "track_stored": "change of kinetic and elastic energy of the track, the residual's included",
    "track_dissipated": "energy dissipated in rail, pads and ballast",
    "into_anomalies": "energy that went into what differs at anomalous seats, and into the ballast below voids",
    "work_of_load": "work of load and weight, and of a deck's prestress",
    "work_of_irregularity": "work of the irregularity",
    "work_of_traction": "work of what keeps the wheels' speed along the slope of the bent rail",
    "imbalance": "what is left of the balance",
}


def balance(scenario: Scenario, lowered: LoweredOnRails, march: Marched) -> xr.Dataset:
    """Return the energy balance of vehicle and track over the whole run, in J.

    The vehicle has exchanged energy with loads and contacts; what the contacts took of it, beside the work of the
    irregularity, is in them or has gone to the track. Of the track the modes that are kept take their own part of the
    forces' power, which they store or lose (docs/theory/track.rst, section 13.7). `relative_imbalance` is what is left
    of both balances over the energy exchanged, the magnitudes of all works, and that of the contacts at rest, as in
    `wheeltapper.record.balanced`; `truncation` is the share of the energy exchanged by which the forces' power on the
    kept modes differs from force times velocity of the rail.
    """
    import xarray as xr

    found, rails = run.works_on_rails(march), lowered.force
    kinetic, elastic = found.ends[1] - found.ends[0]
    wheels = len(lowered.program.system.wheels)
    taken, path, contact = (float(one[:wheels].sum()) for one in (found.bodies, found.path, found.contact))
    of_stops = found.bodies[first_stop(lowered) : first_element(lowered)]
    damped = np.array([len(stop.sides) > 1 for stop in lowered.stops], dtype=bool)  # a rigid end; others are springs
    elastic, lost = elastic + float(of_stops[~damped].sum()), found.dissipated + float(of_stops[damped].sum())
    springs, dampers, friction = element_energies(lowered, march, found.bodies)
    elastic, lost = elastic + springs, lost + dampers + friction
    values = {
        "kinetic": kinetic, "elastic": elastic, "dissipated": lost, "into_contact": contact,
        "into_track": taken + path - contact, "work_of_load": found.load, "work_of_irregularity": path,
        "imbalance": kinetic + elastic + lost + taken - found.load,
    }  # fmt: skip
    if any(element.slider[0] for element in lowered.plane.elements):
        values["dissipated_friction"] = friction
    exchanged = found.dissipated + float(np.abs(found.bodies).sum() + np.abs(found.path).sum()) + abs(found.load)
    shares = dict[str, tuple[float, str]]()
    if lowered.modes is not None:
        of_track = track_works(section_of(scenario.track), lowered, march)
        values["into_contact"] -= of_track.sudden
        values["into_track"] += of_track.sudden
        values |= {
            "track_stored": of_track.stored, "track_dissipated": of_track.lost, "work_of_traction": -of_track.slope,
        }  # fmt: skip
        if lowered.anomalies.extras:
            values["into_anomalies"] = -of_track.anomalies
            exchanged += abs(of_track.anomalies)
        values["imbalance"] += of_track.stored + of_track.lost + of_track.missed - of_track.given - of_track.anomalies
        exchanged += of_track.lost + abs(of_track.slope)
        shares["truncation"] = (
            of_track.missed,
            "force times velocity of the rail, less what the track stores and dissipates, over energy exchanged",
        )
    shares["relative_imbalance"] = values["imbalance"], "imbalance over energy exchanged and that of contacts at rest"
    variables = {
        name: ((), values[name] * rails, {"units": "J", "long_name": meaning})
        for name, meaning in MEANINGS.items()
        if name in values
    }
    scale = {"relative_imbalance": exchanged + _energy_at_rest(lowered, march)}  # at rest nothing is exchanged
    variables |= {
        name: ((), value / max(scale.get(name, exchanged), 1e-300), {"units": "", "long_name": meaning})
        for name, (value, meaning) in shares.items()
    }
    return xr.Dataset(variables)


def _energy_at_rest(lowered: LoweredOnRails, march: Marched) -> float:
    """Return the elastic energy of the contacts at rest, as Hertz's law has it, J, of one rail."""
    indentation = run.replay_rails(march, np.zeros(1)).indentation[0, : len(lowered.static_force)]
    return float(AT_REST * (lowered.static_force / lowered.force) @ indentation)
