"""Comparisons with published figures."""

from __future__ import annotations

import numpy as np

from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import s1002
from wheeltapper.faces.validation.comparison import compared, table_of
from wheeltapper.lower.laws.ellipse import axis_ratio_squared
from wheeltapper.lower.laws.geometry import contact_geometry, radius_difference
from wheeltapper.lower.laws.kalker import coefficients


@compared(
    "Semi-axes of the contact ellipse", "published figures",
    "H. Hertz's coefficients; K. L. Johnson, Contact Mechanics, 1985, chapter 4", {"ratio of the axes": 1e-5},
)  # fmt: skip
def ellipse() -> tuple[float]:
    """Return the largest difference of the ratio of both axes, of which six digits are given."""
    found = []
    for row in table_of("hertz_theta.csv"):
        cosine = np.cos(np.radians(float(row["theta_deg"])))
        if cosine > 1e-9:
            ratio = float(np.sqrt(axis_ratio_squared((1.0 + cosine) / (1.0 - cosine))[0]))
            found.append(ratio / (float(row["n"]) / float(row["m"])) - 1.0)
    return (float(np.abs(found).max()),)


@compared(
    "Creepage coefficients", "published figures",
    "J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, table E3; CONTACT on 45 x 45 elements",
    {"entries of the table": 1e-12, "CONTACT": 0.035},
)  # fmt: skip
def kalker() -> tuple[float, float]:
    """Return the largest differences from the entries of the table, and from the full theory."""
    printed, full = [], []
    for row in table_of("kalker_table_e3.csv"):
        axes = (float(row["g"]), 1.0) if row["ratio"] == "a/b" else (1.0, float(row["g"]))
        found = coefficients(*axes, float(row["nu"]))
        for value, name in zip(found, ("C11", "C22", "C23", "C33"), strict=True):
            printed.append(value / float(row[name]) - 1.0)
            if row.get(f"{name}_contact"):
                full.append(value / float(row[f"{name}_contact"]) - 1.0)
    return float(np.abs(printed).max()), float(np.abs(full).max())


@compared(
    "Difference of rolling radii, S1002 on 60E1 1:40", "published figures",
    "Manchester contact benchmark, case A-2.2 (P. Shackleton and S. Iwnicki, Vehicle System Dynamics 46 (2008) "
    "129-149), computed by CONTACT; and a search of the rigid contact point",
    {"CONTACT": 0.01, "rigid search": 0.007},
)  # fmt: skip
def rolling_radii() -> tuple[float, float]:
    """Return the largest differences from the elastic and from the rigid contact, where the latter does not jump."""
    smooth = contact_geometry(s1002, rail_60e1)
    elastic = {0.5: 0.397, 1.0: 0.604, 2.0: 0.797, 3.0: 0.989, 4.0: 1.230}  # mm over mm
    apart = [1e3 * radius_difference(smooth, 1e-3 * shift) / value - 1.0 for shift, value in elastic.items()]
    rigid = contact_geometry(s1002, rail_60e1, smoothing=2e-7, shifts=np.linspace(-5e-3, 5e-3, 401))
    rows = [row for row in table_of("rolling_radii_s1002_60e1.csv") if 0.5 <= float(row["dy_mm"]) <= 4.0]
    far = [1e3 * radius_difference(rigid, 1e-3 * float(row["dy_mm"])) / float(row["delta_r_mm"]) - 1.0 for row in rows]
    return float(np.abs(apart).max()), float(np.abs(far).max())
