"""Geometry, stiffness and creep of the contact of wheel and rail, as smooth tables over the lateral shift."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.contact.elastic import ElasticContact
from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.profile.file import ProfileFile
from wheeltapper.describe.profile.files import rail_profile, wheel_profile
from wheeltapper.describe.profile.wheel_rail import Cones, WheelRail
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.laws.ellipse import contact_constant, semi_axes
from wheeltapper.lower.laws.geometry import Geometry, contact_geometry
from wheeltapper.lower.laws.kalker import coefficients
from wheeltapper.march.wagon import assembly as asm

FloatArray = NDArray[np.float64]
WIDTH = 11e-3
"""Largest lateral shift in the tables, m, to both sides. A wheel that has shifted farther has climbed its rail."""
NODES = 441
"""Number of lateral shifts at which the contact geometry is computed."""
Surface = Literal["tread", "flange"]


def elastic_of(contact: Contact) -> ElasticContact:
    """Return the contact from whose elasticity a patch follows; where none is known it is steel on the usual rail."""
    return contact if isinstance(contact, ElasticContact) else Hertz()


def geometry_of(profiles: WheelRail | Cones, radius: float, crown: float, surface: Surface = "tread") -> Geometry:
    """Return the contact geometry of wheels with this nominal radius (m).

    `crown` is the transverse radius of rails that cones roll on, m; others have a profile instead.
    """
    crown = crown if isinstance(profiles, Cones) else 0.0
    return _cached_geometry(profiles, profiles.files, radius, crown, surface)


@lru_cache(maxsize=16)
def _cached_geometry(
    profiles: WheelRail | Cones, files: tuple[str | ProfileFile, ...], radius: float, crown: float, surface: Surface
) -> Geometry:
    u = np.linspace(-WIDTH, WIDTH, NODES)
    if isinstance(profiles, Cones):
        slope = profiles.conicity
        place = profiles.arm + (u if profiles.moving_with == "wheel" else 0.0 * u)
        moved = 0.0 if profiles.moving_with == "wheel" else 1.0
        return Geometry(u, slope * moved * u, place, radius + slope * moved * u, np.full_like(u, 0.5 / crown))
    return contact_geometry(
        wheel_profile(files[0]), rail_profile(files[1]), inclination=profiles.inclination,
        gauge=profiles.gauge, flange_backs=profiles.flange_backs, radius=radius, smoothing=profiles.smoothing,
        shifts=u, surface=surface,
    )  # fmt: skip


def flange_from(profiles: WheelRail, radius: float) -> float:
    """Return the smallest shift, m, at which a flange may be nearer than 1 mm to its rail.

    Raises
    ------
    InputError
        If the flanges touch their rails while the wheelset is in the middle.
    """
    tread, flange = (geometry_of(profiles, radius, 0.0, surface) for surface in ("tread", "flange"))
    if flange.table_at("lift", 0.0) >= tread.table_at("lift", 0.0):
        found = f"{profiles.gauge:g} m with flanges {profiles.flange_backs:g} m apart, too narrow"
        raise InputError("", "profiles.gauge", found, "a gauge in which the flanges have room between the rails")
    near = np.flatnonzero(flange.lift > tread.lift - 1e-3)
    return float(tread.shift[near[0]]) if len(near) else WIDTH


def patch_tables(
    profiles: WheelRail | Cones, contact: Contact, radius: float, surface: Surface = "tread"
) -> FloatArray:
    """Return the tables of `march.assembly` at their nodes, (TABLES, nodes).

    On a flange, which is steep, indentations and forces are components along z. The ellipse and the force of Hertz
    refer to the inclined plane of contact.
    """
    return _patch_tables(profiles, profiles.files, contact, radius, surface)


@lru_cache(maxsize=16)
def _patch_tables(
    profiles: WheelRail | Cones, files: tuple[str | ProfileFile, ...], contact: Contact, radius: float, surface: Surface
) -> FloatArray:
    elastic = elastic_of(contact)
    geometry = _cached_geometry(profiles, files, radius, elastic.rail_radius, surface)
    young, poisson = elastic.youngs_modulus, elastic.poisson
    cosine = np.ones_like(geometry.shift)
    if surface == "flange":
        cosine = 1.0 / np.hypot(1.0, np.gradient(geometry.lift, geometry.shift))
    along, across = 0.5 * cosine / geometry.radius, geometry.curvature * cosine**3
    a, b = semi_axes(along, across, young, poisson)
    kalker = np.array([coefficients(x, y, poisson) for x, y in zip(a, b, strict=True)])
    shear = 0.5 * young / (1.0 + poisson)
    given, power = elastic.constant_per_wheel, 2.5
    if isinstance(contact, Linear):
        given, power = 0.5 * contact.stiffness, 2.0
    elif isinstance(contact, ForceLaw):  # its force stands in a table of its own, and here but the inclination
        given = 1.0
    constant = np.full_like(along, given) if given is not None else contact_constant(
        0.5 / along, 0.5 / across, young, poisson
    )  # fmt: skip
    normal = np.cbrt(1.0 / cosine)  # ratio of the cube root of the normal force to that of its component along z
    tables = np.empty((asm.TABLES, len(geometry.shift)))
    tables[asm.TABLE_LIFT] = geometry.lift
    tables[asm.TABLE_PLACE] = geometry.place
    tables[asm.TABLE_RADIUS] = geometry.radius - radius
    tables[asm.ROOT_CONSTANT] = np.cbrt(constant * cosine**power)
    tables[asm.ALONG] = shear * a * b * kalker[:, 0] * normal**2
    tables[asm.ACROSS] = shear * a * b * kalker[:, 1] * normal**2
    tables[asm.SPIN] = shear * (a * b) ** 1.5 * kalker[:, 2] * normal**3
    tables[asm.SPIN_MOMENT] = shear * (a * b) ** 2 * kalker[:, 3] * normal**4
    tables[asm.SLENDER] = b / a
    return tables


def cells_of(shifts: FloatArray, tables: FloatArray) -> FloatArray:
    """Return the splines of degree 5 through tables at equidistant nodes, cell by cell, (cells, TABLES, TERMS)."""
    from math import factorial

    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(shifts, tables, k=asm.TABLE_DEGREE, axis=1)
    width = shifts[1] - shifts[0]
    middle = 0.5 * (shifts[:-1] + shifts[1:])
    # each cell's polynomial, moved from its middle to its start
    derivatives = [spline.derivative(k)(middle) if k else spline(middle) for k in range(asm.TABLE_TERMS)]
    out = np.zeros((len(middle), asm.TABLES, asm.TABLE_TERMS))
    for k in range(asm.TABLE_TERMS):
        for more in range(k, asm.TABLE_TERMS):
            falling = (-0.5 * width) ** (more - k) / factorial(more - k)
            out[:, :, k] += derivatives[more].T * falling * width**k / factorial(k)
    return out


def saturation_cells(creep: object) -> FloatArray:
    """Return a creep law's saturation·(1 + q) over q/(1 + q) as polynomials through Chebyshev's nodes."""
    count, terms = asm.SATURATION_CELLS, asm.TABLE_TERMS
    nodes = 0.5 * (1.0 - np.cos(np.pi * (np.arange(terms) + 0.5) / terms))
    inverse = np.linalg.inv(np.vander(nodes, terms, increasing=True))
    m = (np.arange(count)[:, None] + nodes) / count
    q = m / (1.0 - m)
    return np.asarray((creep.saturation(q) * (1.0 + q)) @ inverse.T)  # type: ignore[attr-defined]
