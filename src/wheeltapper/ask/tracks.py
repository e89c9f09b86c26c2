"""What can be asked of a track alone: receptance, static deflection, decay of its waves, pinned-pinned frequency.

All of it is of the infinite track, exactly: by transfer matrices, without modes (docs/theory/track.rst, sections 13.2
and 13.10); decay and pinned-pinned frequency are those of its regular seats.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.arguments import as_list
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import to_si
from wheeltapper.lower.track import responses, waves
from wheeltapper.lower.track.anomalies import linear_extras
from wheeltapper.lower.track.section import Section, section_of
from wheeltapper.record.labels import DECAY_TITLE, PINNED_TITLE, RECEPTANCE_TITLE, STATIC_TITLE

if TYPE_CHECKING:
    import xarray as xr

Quantities = float | str | Sequence[Any] | NDArray[Any]
FloatArray = NDArray[np.float64]


def receptance(
    track: SupportedRail, frequencies: Quantities, where: Quantities, at: Quantities | None = None
) -> xr.DataArray:
    """Return the receptance of the infinite track: the harmonic deflection of the rail over the force on it.

    Force and deflection have the same direction and the factor e^{+iωt}. The imaginary part is therefore negative where
    the force does work.

    Parameters
    ----------
    track
        `Ballasted` or `Slab`, also with missing pads or sleepers without ballast.
    frequencies
        Hz, 0 or more; one, or several.
    where
        Places of the force, m from a seat; one, or several.
    at
        Places of the deflection, m from the same seat; one, or as many as places of the force. None: at the force.

    Returns
    -------
    xarray.DataArray
        Complex, m/N, over "frequency" and "place"; where one number is given, there is no such dimension. `where` and
        `at` are coordinates.

    Raises
    ------
    InputError
        If the track has no flexible rail, or an argument is wrong.
    """
    section = _section(track)
    extras = linear_extras(track, section)
    f, (x, y) = _frequencies(frequencies, section), _places(where, at)
    omega = 2.0 * np.pi * f.reshape(f.shape + (1,) * x.ndim)
    found = responses.response(section, extras, omega, x, y)[..., 0]
    over = {"where": (x, "place of the force, from a seat"), "at": (y, "place of the deflection, from a seat")}
    return _labelled(found, f, over, (RECEPTANCE_TITLE, "m/N", "receptance"), section)


def static_deflection(track: SupportedRail, where: Quantities) -> xr.DataArray:
    """Return the static deflection of the rail under a unit force at the same place.

    Parameters
    ----------
    track
        `Ballasted` or `Slab`, also with missing pads or sleepers without ballast.
    where
        Places, m from the seat 0; one, or several.

    Returns
    -------
    xarray.DataArray
        m/N over "place", or one number for one place; `where` is a coordinate.

    Raises
    ------
    InputError
        If the track has no flexible rail, or a place is no length.
    """
    section, (x, _) = _section(track), _places(where, None)
    found = responses.response(section, linear_extras(track, section), 0.0, x, x)[..., 0].real
    over = {"where": (x, "place of the force, from a seat")}
    return _labelled(found, None, over, (STATIC_TITLE, "m/N", "static deflection over force"), section)


def decay_rate(track: SupportedRail, frequencies: Quantities) -> xr.DataArray:
    """Return how fast the slowest of the rail's waves decays along the infinite track.

    Parameters
    ----------
    track
        `Ballasted` or `Slab`.
    frequencies
        Hz, 0 or more; one, or several.

    Returns
    -------
    xarray.DataArray
        dB/m over "frequency", or one number for one frequency: -20·log10|μ|/a with Bloch's factor μ over the spacing a.

    Raises
    ------
    InputError
        If the track has no flexible rail, or a frequency is wrong.
    """
    section = _section(track)
    f = _frequencies(frequencies, section)
    found = waves.decay(section, 2.0 * np.pi * f)
    return _labelled(found, f, {}, (DECAY_TITLE, "dB/m", "decay rate of the slowest wave"), section)


def pinned_pinned(track: SupportedRail) -> xr.DataArray:
    """Return the pinned-pinned frequency: the first at which the rail can vibrate between immovable seats.

    Parameters
    ----------
    track
        `Ballasted` or `Slab`.

    Returns
    -------
    xarray.DataArray
        One number, Hz.

    Raises
    ------
    InputError
        If the track has no flexible rail.
    """
    section = _section(track)
    labels = PINNED_TITLE, "Hz", "pinned-pinned frequency"
    return _labelled(np.asarray(waves.pinned(section) / (2.0 * np.pi)), None, {}, labels, section)


def _section(track: Any) -> Section:
    if not isinstance(track, SupportedRail):
        allowed = " or ".join(kind.__name__ for kind in makeable_nouns(SupportedRail))
        raise InputError("", "track", value_text(track), f"a track with a flexible rail: {allowed}")
    return section_of(track)


def _read(given: Any, field: str, dimension: str) -> FloatArray:
    """Return one quantity, or several in a row, in SI units."""
    alone = isinstance(given, str) or np.ndim(given) == 0
    listed = [given] if alone else as_list(given, field, f"a {dimension}, or a list of them")
    if not listed:
        raise InputError("", field, "none", f"a {dimension}, or a list of them")
    numbers = [to_si(one, dimension, field) for one in listed]
    wrong = next((one for one, number in zip(listed, numbers, strict=True) if not isfinite(number)), None)
    if wrong is not None:
        raise InputError("", field, value_text(wrong), f"a finite {dimension}")
    return np.asarray(numbers[0] if alone else numbers, dtype=float)


def _frequencies(given: Any, section: Section) -> FloatArray:
    found = _read(given, "frequencies", "frequency")
    if np.any(found < 0.0):
        raise InputError("", "frequencies", f"{float(found.min()):g} Hz", "0 Hz or more")
    lost = ~(waves.growth(section, 2.0 * np.pi * found) < waves.MOST_GROWTH)
    if np.any(lost):
        words = f"{float(found[lost].min()):g} Hz, at which the rail's near field ends far before the next seat"
        raise InputError("", "frequencies", words, "lower ones, or a track with less spacing or a stiffer rail")
    return found


def _places(where: Any, at: Any) -> tuple[FloatArray, FloatArray]:
    x = _read(where, "where", "length")
    y = x if at is None else _read(at, "at", "length")
    if x.ndim and y.ndim and len(x) != len(y):
        raise InputError("", "at", f"{len(y)} places", f"one, or {len(x)}, as many as in `where`")
    return np.broadcast_arrays(x, y)[0].copy(), np.broadcast_arrays(x, y)[1].copy()


def _labelled(
    values: Any, frequencies: FloatArray | None, places: dict[str, tuple[FloatArray, str]],
    labels: tuple[str, str, str], section: Section,
) -> xr.DataArray:  # fmt: skip
    """Return an array with its coordinates; `labels` are title, unit and meaning."""
    import xarray as xr

    title, unit, meaning = labels
    dimensions: list[str] = []
    coordinates: dict[str, Any] = {}
    if frequencies is not None:
        along = ["frequency"][: frequencies.ndim]
        dimensions += along
        coordinates["frequency"] = (along, frequencies, {"units": "Hz", "long_name": "frequency"})
    for name, (x, words) in places.items():
        along = ["place"][: x.ndim]
        coordinates[name] = (along, x, {"units": "m", "long_name": words})
    dimensions += ["place"] if any(x.ndim for x, _ in places.values()) else []
    attributes = {
        "title": title, "units": unit, "long_name": meaning, "spacing": section.spacing,
        "pinned_pinned": waves.pinned(section) / (2.0 * np.pi),
    }  # fmt: skip
    return xr.DataArray(values, coordinates, dimensions, meaning.replace(" ", "_"), attributes)
