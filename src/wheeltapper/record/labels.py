"""Names, units and meanings of all variables of a record; they are written only here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

CHART_TITLE = "wheeltapper chart"
"""Title of what `sweep` returns and the command of that name writes."""
WEAR_TITLE = "wheeltapper wear"
"""Title of the datasets of `wear_in`."""
EVENT_KINDS = ("loss", "impact", "yield")
"""Names of the kinds of events, in the order of their numbers."""

HISTORY = {
    "wheel_displacement": ("m", "displacement of the wheel's centre, upwards"),
    "wheel_velocity": ("m/s", "velocity of the wheel's centre, upwards"),
    "wheel_acceleration": ("m/s^2", "acceleration of the wheel's centre, upwards"),
    "normal_force": ("N", "normal contact force, per wheelset"),
    "indentation": ("m", "indentation, negative in flight"),
    "constraint": ("m", "path of the rigid wheel's centre over the irregularity"),
    "permanent_indentation": ("m", "indentation that is left if the contact unloads now, of both bodies together"),
    "deck_displacement": ("m", "displacement of the deck from its static position, upwards"),
    "deck_velocity": ("m/s", "velocity of the deck, upwards"),
    "deck_acceleration": ("m/s^2", "acceleration of the deck, upwards"),
    "damper_end_displacement": ("m", "displacement of the damper's own end, upwards"),
    "damper_force": ("N", "force of the damper on the wheel, upwards"),
}
"""Unit and meaning of the variables of a wheelset."""
WAGON = {
    "time": ("s", "time since the leading wheelset was at x = 0"),
    "wheelset": ("", "number of the wheelset, from the leading one"),
    "side": ("", "left or right, facing forward"),
    "body": ("", "body"),
    "motion": ("", "x forward, y left, z up, and the rotations about them"),
    "normal_force": ("N", "normal contact force on the tread (its vertical component), per wheel"),
    "longitudinal_force": ("N", "creep force on the wheel forwards, per wheel"),
    "lateral_force": ("N", "lateral force on the wheel, leftwards, of normal and creep forces together, per wheel"),
    "lateral_creep_force": ("N", "creep force on the tread leftwards, per wheel"),
    "flange_force": ("N", "normal contact force on the flange, per wheel"),
    "spin_moment": ("N m", "creep moment on the tread about z, per wheel"),
    "longitudinal_creepage": ("", "slip of the tread forwards over speed"),
    "lateral_creepage": ("", "slip of the tread leftwards over speed"),
    "spin_creepage": ("1/m", "slip of the tread about the normal over speed"),
    "friction_use": ("", "creep force over the limit of friction, on the tread"),
    "indentation": ("m", "indentation of the tread, negative in flight"),
    "constraint": ("m", "path of the rigid wheel's centre over the irregularity, and the deck's displacement"),
    "lateral_shift": ("m", "shift of the wheel from its middle position, outwards"),
    "displacement": ("m or rad", "displacement of a body's centre of gravity from unstretched springs, or rotation"),
    "velocity": ("m/s or rad/s", "velocity of a body"),
    "acceleration": ("m/s^2 or rad/s^2", "acceleration of a body"),
    "deck_displacement": ("m", "displacement of the deck from its static position, upwards"),
    "deck_velocity": ("m/s", "velocity of the deck, upwards"),
    "deck_acceleration": ("m/s^2", "acceleration of the deck, upwards"),
}
"""Unit and meaning of the variables of a wagon."""
LABELS = HISTORY | {
    "wheelset": ("", "number of the wheelset, from the leading one"),
    "side": ("", "left or right, facing forward"),
    "surface": ("", "part of the wheel that touches: tread or flange"),
    "time": ("s", "time since the wheel was at x = 0"),
    "kind": ("", "loss, impact or yield"),
    "contact": ("", "number of the contact"),
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


def dataset(dimension: str, **columns: Any) -> xr.Dataset:
    """Return a labelled dataset of columns over one dimension; a column named like the dimension is its coordinate."""
    import xarray as xr

    variables = {}
    for name, values in columns.items():
        unit, meaning = LABELS[name]
        variables[name] = (dimension, values, {"units": unit, "long_name": meaning})
    coordinates = {dimension: variables.pop(dimension)} if dimension in variables else {}
    return xr.Dataset(variables, coords=coordinates)
