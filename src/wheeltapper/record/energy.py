"""The terms of an energy balance: one list of names, whatever the vehicle and the track, and one sum of them."""

from __future__ import annotations

import xarray as xr

from wheeltapper.lower.lowered.base import Terms

TERMS = {
    "kinetic": "change of kinetic energy of the vehicle, and of a deck",
    "elastic": "change of elastic energy of springs and contacts, and of a deck's bearing",
    "elastic_contact": "of that, in the contacts",
    "dissipated": "energy dissipated in suspensions, contacts and a deck's bearing",
    "dissipated_suspension": "of that, by dampers of the suspensions",
    "dissipated_friction": "of that, by dry friction of the suspensions",
    "dissipated_deck": "of that, in the deck's bearing",
    "dissipated_contact": "of that, by the material of the contacts, plastic work of impacts included",
    "dissipated_creep": "of that, by creep of the contacts",
    "work_of_load": "work of load, weight and a deck's prestress",
    "work_of_irregularity": "work of the irregularity, where no wheel shifts also that of the rail's curvature",
    "work_of_shape": "work of the contacts' changing shape, where wheels shift",
    "work_of_drive": "work of what keeps the speed",
    "into_track": "energy that the contact forces gave to rails that bend",
}
"""Terms of every balance, in J. All energies are changes over the run."""
OF_RAILS = {
    "track_stored": "change of kinetic and elastic energy of the track, the residual's included",
    "track_dissipated": "energy dissipated in rail, pads and ballast",
    "into_anomalies": "energy that went into what differs at anomalous seats, and into the ballast below voids",
    "work_of_traction": "work on the track of what keeps the wheels' speed along the slope of the bent rail",
}
"""Terms that only rails which give way have; what a track takes is followed further for vehicles in the plane."""
MEANINGS = {
    **TERMS,
    **OF_RAILS,
    "imbalance": "what is left of the balance",
    "exchanged": "energy exchanged: the magnitudes of all works on the way, the scale of what is left",
    "truncation": "force times velocity of the rail, less what the track stores and dissipates, over energy exchanged",
    "relative_imbalance": "magnitude of the imbalance over the energy exchanged",
}
LOSSES = tuple(name for name in TERMS if name.startswith("dissipated_"))


def energies(balance: Terms) -> xr.Dataset:
    """Return an energy balance in J; terms that are not there are zero, and `dissipated` is the sum of its parts."""
    terms, exchanged, joule, more = balance
    values = {name: terms.get(name, 0.0) for name in TERMS} | {name: terms[name] for name in OF_RAILS if name in terms}
    values["dissipated"] = sum(values[name] for name in LOSSES)
    works = sum(values[name] for name in TERMS if name.startswith("work"))
    taken = values["kinetic"] + values["elastic"] + values["dissipated"] + values["into_track"]
    values["imbalance"] = taken - works + more
    values["exchanged"] = exchanged
    shares = {name: terms[name] / exchanged for name in ("truncation",) if name in terms}
    shares["relative_imbalance"] = abs(values["imbalance"]) / exchanged
    variables = {name: ((), value * joule + 0.0, {"units": "J"}) for name, value in values.items()}
    variables |= {name: ((), value, {"units": ""}) for name, value in shares.items()}
    for name, (_, _, attributes) in variables.items():
        attributes["long_name"] = MEANINGS[name]
    return xr.Dataset(variables)
