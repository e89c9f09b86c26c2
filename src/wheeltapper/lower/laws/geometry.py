"""The place and the curvature of the contact of wheel and rail as smooth functions of the lateral shift.

Lengths in m; positions s and shifts u of one side count outwards from the track's middle. The gap between the two
profiles is G(s; u). A rigid wheel touches at the smallest gap; as it shifts, this place jumps. An elastic wheel touches
everywhere within a few micrometres, and its place of contact does not jump. Therefore places are weighted with
exp(-G/ε),

    h = ε·ln ∫exp(-G/ε) ds    s = ⟨s⟩    r = R + ⟨wheel's profile⟩    curvature B = ε/(2·variance of s)

with a smoothing length ε of the order of the indentation; 5 µm reproduces the results of an elastic program at 10 kN. h
is the height by which the shift lifts the wheel, zero at u = 0.

A wheel may touch with its tread and with its flange. The flange begins where the wheel's profile is steeper than 45
degrees. Each of the two surfaces has separate tables.

See docs/theory/wagon.rst, section 7.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.named import Shape
from wheeltapper.describe.profile.s1002 import BACK, FLANGE_BACK, FRONT
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]
GAUGE_DEPTH = 0.014
"""Depth below the running surface at which the gauge is measured, m."""
FINENESS = 1e-5
"""Spacing of the lateral positions over which the gap is integrated, m."""
FAR = 1.0
"""Height, m, that stands for "no profile here": a gap that never closes."""
ROUNDING = 1e-9
"""Distance, m, by which a shift may lie beyond the tables and still counts as within them."""
SHARPEST = 1e4
"""Largest curvature of a contact, 1/m. Beyond it the wheel touches an edge of its profile and not a smooth part of
it."""


@dataclass(frozen=True)
class Geometry:
    """Tables of one side over the lateral shift u.

    Attributes
    ----------
    shift
        u: displacement of the wheel outwards from its central position, m.
    lift
        h, m.
    place
        s, m from the track's middle.
    radius
        r: rolling radius of the wheel at the contact, m.
    curvature
        B: curvature of the gap across the rail, 1/m; the gap opens as B·(s' - s)².
    """

    shift: FloatArray
    lift: FloatArray
    place: FloatArray
    radius: FloatArray
    curvature: FloatArray

    def table_at(self, name: str, shift: float) -> float:
        """Return one of the tables, interpolated between its nodes.

        Raises
        ------
        InputError
            If the shift lies beyond the nodes.
        """
        from scipy.interpolate import make_interp_spline

        first, last = self.shift[0], self.shift[-1]
        if not first - ROUNDING <= shift <= last + ROUNDING:
            found = f"{1e3 * shift:.4g} mm, where a flange has climbed its rail"
            raise InputError("", "shift", found, f"{1e3 * first:g} to {1e3 * last:g} mm, for which there are tables")
        return float(make_interp_spline(self.shift, getattr(self, name), k=5)(shift))


def laid_rail(shape: Shape, inclination: float, gauge: float) -> tuple[FloatArray, FloatArray]:
    """Return places and heights of one laid rail: inclined towards the track's middle, its crown at height zero."""
    y = np.linspace(-0.04, 0.04, 80_001)
    z = 1e-3 * shape(1e3 * y)
    y, z = y[np.isfinite(z)], z[np.isfinite(z)]
    angle = np.arctan(inclination)
    place, height = y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)
    crown = int(np.argmax(height))
    height = height - height[crown]
    inner = np.interp(-GAUGE_DEPTH, height[: crown + 1], place[: crown + 1])
    return place - inner + 0.5 * gauge, height


def contact_geometry(
    wheel: Shape, rail: Shape, *, inclination: float = 1 / 40, gauge: float = 1.435, flange_backs: float = 1.360,
    radius: float = 0.46, smoothing: float = 5e-6, shifts: FloatArray | None = None,
    surface: Literal["tread", "flange"] = "tread",
) -> Geometry:  # fmt: skip
    """Return the tables of a wheel on a rail.

    Parameters
    ----------
    wheel, rail
        Profiles: of the wheel, downwards from its tread datum; of the upright rail, upwards from its crown.
    inclination
        Inclination of the rail.
    gauge, flange_backs
        Distances between the rails, and between the backs of the flanges, m.
    radius
        Nominal radius of the wheel, m.
    smoothing
        ε, m.
    shifts
        Nodes of the tables, m; by default -6 mm to 6 mm every 0.1 mm.
    surface
        Part of the wheel: tread or flange. Heights of both are relative to the contact of the tread at u = 0.
    """
    shifts = np.linspace(-6e-3, 6e-3, 121) if shifts is None else shifts
    datum = 0.5 * flange_backs + 1e-3 * FLANGE_BACK
    place, height = laid_rail(rail, inclination, gauge)
    s = np.arange(place[0], place[-1], FINENESS)
    below = np.interp(s, place, height)
    border = flange_border(wheel)
    tread, flange = (border, FRONT), (BACK, border)
    part = tread if surface == "tread" else flange
    rows = [_contact_of_part(wheel, part, s, below, datum + u, radius, smoothing) for u in shifts]
    centre = _contact_of_part(wheel, tread, s, below, datum, radius, smoothing)[0]
    found = np.array(rows).T
    lift, where, rolling, curvature = found if surface == "tread" else _extended_beside(np.asarray(shifts), found)
    return Geometry(np.asarray(shifts, dtype=float), lift - centre, where, rolling, np.minimum(curvature, SHARPEST))


def _extended_beside(shifts: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the rows, completed for shifts at which this part of the wheel is beside the rail and cannot touch.

    There the height continues with the slope at the first shift at which it can touch.
    """
    sharp = (rows[0] < -0.5 * FAR) | (rows[3] > SHARPEST)
    if not sharp.any():
        return rows
    first = int(np.flatnonzero(sharp)[-1]) + 1
    if first + 1 >= len(shifts):
        found = f"a flange that is beside the rail, or meets it with an edge alone, at {1e3 * shifts[first - 1]:g} mm"
        raise InputError("", "profiles", found, "wheel and rail whose flange and side touch as the wheel shifts")
    out = rows.copy()
    out[:, :first] = rows[:, first : first + 1]
    out[0, :first] += (shifts[:first] - shifts[first]) * (rows[0, first + 1] - rows[0, first]) / (shifts[1] - shifts[0])
    return out


def flange_border(wheel: Shape) -> float:
    """Return the lateral position, mm, at which the wheel's flange begins."""
    y = np.arange(BACK, 0.0, 0.01)
    z = wheel(y)
    steep = np.flatnonzero(-np.diff(z) > 0.01)
    return float(y[steep[-1] + 1]) if len(steep) else BACK


def _contact_of_part(
    wheel: Shape, part: tuple[float, float], s: FloatArray, below: FloatArray, datum: float, radius: float,
    smoothing: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return h, s, r and B of a part of a wheel, for one lateral position of its tread datum."""
    across = np.clip(1e3 * (s - datum), *part)
    profile = np.where(across == 1e3 * (s - datum), np.nan_to_num(1e-3 * wheel(across), nan=-FAR), -FAR)
    gap = -profile - below
    smallest = gap.min()
    weight = np.exp(-(gap - smallest) / smoothing)
    total = weight.sum()
    weight = weight / total
    mean = float(weight @ s)
    variance = float(weight @ (s - mean) ** 2)
    lift = smoothing * np.log(total * FINENESS) - smallest
    curvature = smoothing / (2.0 * variance) if variance > 0.0 else inf  # a single place: an edge
    return float(lift), mean, radius + float(weight @ profile), curvature


def resting_roll(geometry: Geometry, shift: float, radius: float) -> float:
    """Return the roll at which both wheels of a shifted wheelset rest, rad: left wheel at u = y + R·φ, right at -u."""
    roll = 0.0
    for _ in range(50):
        left = shift + radius * roll
        arms = geometry.table_at("place", left) + geometry.table_at("place", -left)
        new = (geometry.table_at("lift", left) - geometry.table_at("lift", -left)) / arms
        if abs(new - roll) < 1e-12:
            break
        roll = new
    return roll


def radius_difference(geometry: Geometry, shift: float, radius: float = 0.46) -> float:
    """Return the rolling radius of the left wheel less that of the right, of a wheelset shifted to the left, m.

    Raises
    ------
    InputError
        If the shift lies beyond the tables of the geometry.
    """
    left = shift + radius * resting_roll(geometry, shift, radius)
    return geometry.table_at("radius", left) - geometry.table_at("radius", -left)
