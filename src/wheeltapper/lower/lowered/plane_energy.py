"""The energy balance of a vehicle in the plane, and of the track."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.lower.lowered.base import DECK, Terms
from wheeltapper.lower.lowered.plane_elements import element_energies
from wheeltapper.lower.lowered.track_works import track_works
from wheeltapper.lower.track.section import section_of

if TYPE_CHECKING:
    from wheeltapper.lower.lowered.plane import LoweredPlane
    from wheeltapper.march.general.task import Marched


def balance(lowered: LoweredPlane, march: Marched) -> Terms:
    """Return the energy balance of vehicle and track over the whole run.

    The vehicle has exchanged energy with loads and contacts; what the contacts took of it, beside the work of the
    irregularity, is in them or has gone to the track. Of the track the modes that are kept take their own part of the
    forces' power, which they store or lose (docs/theory/track.rst, section 13.7); `truncation` is the share of the
    energy exchanged by which the forces' power on the kept modes differs from force times velocity of the rail.
    """
    found, rails = march.works(), lowered.force
    kinetic, elastic = found.ends[1] - found.ends[0]
    stored, material = march.contact_energies()
    in_contacts = float(stored[1] - stored[0])
    wheels = len(lowered.program.system.wheels)
    taken, path, contact = (float(one[:wheels].sum()) for one in (found.bodies, found.path, found.contact))
    of_stops = found.bodies[lowered.first_stop : lowered.first_element]
    damped = np.array([len(stop.sides) > 1 for stop in lowered.stops], dtype=bool)  # a rigid end; others are springs
    springs, dampers, friction = element_energies(lowered, march, found.bodies)
    of_deck = float(found.dissipated[-1]) if lowered.plane.freedoms[-1] == DECK else 0.0
    lost = float(found.dissipated.sum() + of_stops[damped].sum()) + dampers
    guided = _held_by_guides(lowered, march)
    terms = {
        "kinetic": kinetic, "elastic": elastic + float(of_stops[~damped].sum()) + springs + guided + in_contacts,
        "elastic_contact": in_contacts, "dissipated_suspension": lost - of_deck, "dissipated_friction": friction,
        "dissipated_deck": of_deck, "dissipated_contact": material, "work_of_load": found.load + guided,
        "work_of_irregularity": path + in_contacts + material - contact, "into_track": taken + path - contact,
    }  # fmt: skip
    exchanged = float(found.dissipated.sum() + np.abs(found.bodies).sum() + np.abs(found.path).sum())
    exchanged, more = exchanged + abs(found.load) + float(stored[0]), 0.0
    if lowered.modes is not None:
        of_track = track_works(section_of(lowered.scenario.track), lowered, march)
        terms |= {
            "track_stored": of_track.stored, "track_dissipated": of_track.lost, "truncation": of_track.missed,
            "into_anomalies": -of_track.anomalies, "work_of_traction": -of_track.slope,
        }  # fmt: skip
        terms["work_of_irregularity"] += of_track.sudden
        terms["into_track"] += of_track.sudden
        exchanged += abs(of_track.anomalies) + of_track.lost + abs(of_track.slope)
        more = of_track.stored + of_track.lost + of_track.missed - of_track.given - of_track.anomalies
    return Terms(terms, exchanged, rails, more)


def _held_by_guides(lowered: LoweredPlane, march: Marched) -> float:
    """Return the work on springs against a fixed guide of the forces that they have at rest, J, of one rail.

    Displacements count from the static state; of springs that are stretched there the march leaves these forces out,
    as it does of the loads that they bear.
    """
    moved = np.diff(march.at(np.array([0.0, march.end])).displacement, axis=0)[0]
    weights = [wheelset.weight for wheelset in lowered.plane.wheelsets]
    return float((np.array(weights) - lowered.static_force) @ moved[: len(weights)] / lowered.force)
