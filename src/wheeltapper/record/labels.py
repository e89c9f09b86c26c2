"""Names, units and meanings of all variables of a record; they are written only here."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

CHART_TITLE = "wheeltapper chart"
"""Title of what `sweep` returns and the command of that name writes."""
DATASET_TITLE = "wheeltapper data set"
"""Title of what the command `dataset` writes."""
WEAR_TITLE = "wheeltapper wear"
"""Title of the datasets of `wear_in`."""
RECEPTANCE_TITLE, STATIC_TITLE = "wheeltapper receptance", "wheeltapper static deflection"
DECAY_TITLE, PINNED_TITLE = "wheeltapper decay rate", "wheeltapper pinned-pinned frequency"
"""Titles of what is asked of a track alone."""
CONICITY_TITLE = "wheeltapper conicity"
CONICITIES = {"rigid": "equivalent_conicity", "elastic": "elastic_conicity"}
"""Title of what is asked of profiles over the amplitude of a lateral motion, and its figure by the kind of contact."""
LIMIT_CYCLES_TITLE = "wheeltapper limit cycles"
"""Title of what is asked of a wagon that hunts."""
JOINT_TITLE = "wheeltapper joint"
"""Title of what is asked of a joint over speed."""
BRANCH_TITLE = "wheeltapper branch"
"""Title of the datasets of `orbits.follow`."""
EVENT_KINDS = ("loss", "impact", "yield", "void opens", "void closes")
"""Names of the kinds of events, in the order of their numbers."""
VOID_OPENS = EVENT_KINDS.index("void opens")
NO_SEAT = -1
"""The seat of a wheel's event, and the contact of an event at a seat."""

LABELS = {
    "time": ("s", "time since the wheel was at x = 0"),
    "wheelset": ("", "number of the wheelset, from the leading one"),
    "side": ("", "left or right, facing forward"),
    "surface": ("", "part of the wheel that touches: tread or flange"),
    "contact": ("", "number of the contact"),
    "body": ("", "body"),
    "motion": ("", "x forward, y left, z up, and the rotations about them"),
    "wheel_displacement": ("m", "displacement of the wheel's centre, upwards"),
    "wheel_velocity": ("m/s", "velocity of the wheel's centre, upwards"),
    "wheel_acceleration": ("m/s^2", "acceleration of the wheel's centre, upwards"),
    "static_force": ("N", "static normal force, per wheelset"),
    "normal_force": ("N", "normal contact force, per wheelset"),
    "longitudinal_force": ("N", "creep force on the wheel forwards, per wheel"),
    "lateral_force": ("N", "lateral force on the wheel, leftwards, of normal and creep forces together, per wheel"),
    "lateral_creep_force": ("N", "creep force on the tread leftwards, per wheel"),
    "flange_force": ("N", "normal contact force on the flange, per wheel"),
    "vertical_force": ("N", "force of the rail on the wheel upwards, of tread and flange together, per wheel"),
    "spin_moment": ("N m", "creep moment on the tread about z, per wheel"),
    "longitudinal_creepage": ("", "slip of the tread forwards over speed"),
    "lateral_creepage": ("", "slip of the tread leftwards over speed"),
    "spin_creepage": ("1/m", "slip of the tread about the normal over speed"),
    "t_gamma": ("N", "creep forces and spin moment times creepages, of tread and flange together, per wheel"),
    "flange_t_gamma": ("N", "creep forces and spin moment times creepages, of the flange, per wheel"),
    "spin_t_gamma": ("N", "share of the spin moments in t_gamma, per wheel"),
    "friction_use": ("", "creep force over the limit of friction, on the tread"),
    "indentation": ("m", "indentation, negative in flight"),
    "constraint": ("m", "path of the rigid wheel's centre over the irregularity"),
    "rail_displacement": ("m", "displacement of the rail, upwards; in histories under the wheel"),
    "rail": ("m", "position along the rail"),
    "rail_acceleration": ("m/s^2", "acceleration of the rail, upwards"),
    "rail_strain": ("", "longitudinal strain of the rail's foot in bending, positive in tension"),
    "rail_shear": ("N", "shear force in the rail, positive behind a wheel and negative ahead of it"),
    "seat": ("", "number of the seat, from that at first_sleeper"),
    "sleeper_displacement": ("m", "displacement of the sleeper, upwards"),
    "sleeper_acceleration": ("m/s^2", "acceleration of the sleeper, upwards"),
    "pad_force": ("N", "force in the rail pad, positive in compression"),
    "ballast_force": ("N", "force under the half sleeper, positive in compression"),
    "frame": ("m", "displacement of the frame's centre from its static position, upwards"),
    "frame_velocity": ("m/s", "velocity of the frame's centre, upwards"),
    "frame_acceleration": ("m/s^2", "acceleration of the frame's centre, upwards"),
    "frame_pitch": ("rad", "pitch of the frame, upwards in front"),
    "frame_pitch_velocity": ("rad/s", "rate of the frame's pitch"),
    "frame_pitch_acceleration": ("rad/s^2", "acceleration of the frame's pitch"),
    "lateral_shift": ("m", "shift of the wheel from its middle position, outwards"),
    "permanent_indentation": ("m", "indentation that is left if the contact unloads now, of both bodies together"),
    "displacement": (
        "m or rad",
        "displacement of a body's centre of gravity, or rotation, from where wheels first touch the rails; the springs "
        "between bodies already carry their load there",
    ),
    "velocity": ("m/s or rad/s", "velocity of a body"),
    "acceleration": ("m/s^2 or rad/s^2", "acceleration of a body"),
    "deck_displacement": ("m", "displacement of the deck from its static position, upwards"),
    "deck_velocity": ("m/s", "velocity of the deck, upwards"),
    "deck_acceleration": ("m/s^2", "acceleration of the deck, upwards"),
    "damper_end_displacement": ("m", "displacement of the damper's own end, upwards"),
    "damper_force": ("N", "force of the damper on the wheel, upwards"),
    "element": ("", "what is not linear in a suspension"),
    "element_force": ("N", "force of an element that pushes the ends of its suspension apart"),
    "element_compression": ("m", "by how much the ends of an element have come together since the static state"),
    "element_slip": ("m", "how far dry friction has slipped, in compression; zero of other elements"),
    "kind": ("", "loss, impact, yield, void opens or void closes"),
    "position": ("m", "position of the wheel's centre along the rail"),
    "indentation_rate": ("m/s", "rate of the indentation at the event"),
    "corner": ("", "true where a kink of the input makes the maximum"),
    "closing_speed": ("m/s", "indentation rate at the impact"),
    "peak_force": ("N", "largest normal force between this impact and the next, per wheelset"),
    "duration": ("s", "time until the next loss of contact"),
    "impulse": ("N s", "impulse of the normal force until the next loss of contact, per wheelset"),
    "interval": ("s", "time from this onset of contact to the next"),
    "force_ratio": ("", "this impact's largest force over the next one's"),
}
"""Unit and meaning of all variables."""
OF_WHEELS = {
    "time": "time since the leading wheelset was at x = 0",
    "normal_force": "normal contact force, per wheel; in histories that on the tread (its vertical component)",
    "indentation": "indentation of the tread, negative in flight",
    "constraint": "path of the rigid wheel's centre over the irregularity, and the deck's displacement",
}
"""Meanings that differ where every wheel has contacts of its own."""


def attributes_of(name: str, several: bool = False) -> dict[str, str]:
    """Return unit and meaning as attributes; `several`: where every wheel has contacts of its own."""
    unit, meaning = LABELS[name] if name in LABELS else _of_freedom(name)
    return {"units": unit, "long_name": of_wheels(OF_WHEELS.get(name, meaning)) if several else meaning}


def _of_freedom(name: str) -> tuple[str, str]:
    """Return unit and meaning of the motion of a freedom that a vehicle of one's own names."""
    orders = {"_velocity": ("/s", "velocity of the "), "_acceleration": ("/s^2", "acceleration of the "), "": ("", "")}
    order = next(end for end in orders if name.endswith(end))
    freedom, (per, of) = name.removesuffix(order), orders[order]
    body, turns = freedom.removesuffix("_pitch").replace("_", " "), freedom.endswith("pitch")
    motion = f"pitch of the {body}, upwards in front" if turns else f"displacement of the {body}, upwards"
    return ("rad" if turns else "m") + per, of + motion


def of_wheels(meaning: str) -> str:
    """Return a meaning where every wheel has contacts of its own."""
    return meaning.replace("per wheelset", "per wheel")


def dataset(
    variables: dict[str, tuple[Any, Any]], coordinates: Iterable[str] = (), several: bool = False
) -> xr.Dataset:
    """Return a labelled dataset of variables with their dimensions; some of them are coordinates."""
    import xarray as xr

    labelled = {name: (*held, attributes_of(name, several)) for name, held in variables.items()}
    return xr.Dataset(labelled).set_coords(coordinates)


def flag_attributes(meanings: tuple[str, ...]) -> dict[str, Any]:
    """Return the attributes of a variable whose values are positions in a list of words (CF conventions)."""
    words = " ".join(meaning.replace(" ", "_") for meaning in meanings)
    return {"flag_values": np.arange(len(meanings), dtype=np.int8), "flag_meanings": words}


def flag_variable(dimension: str, values: Any, names: tuple[str, ...]) -> tuple[str, Any, dict[str, Any]]:
    """Return names as files hold them: numbers, and what each stands for."""
    numbers = np.array([names.index(value) for value in values], dtype=np.int8)
    return dimension, numbers, flag_attributes(names)
