"""The wheel profile S1002 (EN 13715, UIC 510-2): polynomials and arcs in eight zones.

Lateral position y from the tread datum (70 mm from the flange's back), positive to the field side; z away from the
axle, so that the radius at y is r0 + z(y): the flange's tip is at z = 28 mm.

Source: EN 13715; the joints close to 1.2e-4 mm, and all points of the Manchester contact benchmark's profile with
|y| ≤ 60 mm lie on it to 1.6e-6 mm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# From, to (mm, falling), and coefficients of powers of y.
POLYNOMIALS = (
    (60.0, 32.15796, (1.364323640, -0.066666667)),
    (
        32.15796, -26.0,
        (0.0, -3.358537058e-02, 1.565681624e-03, -2.810427944e-05, 5.844240864e-08, -1.562379023e-08, 5.309217349e-15,
         -5.957839843e-12, 2.646656573e-13),
    ),
    (
        -26.0, -35.0,
        (-4.320221063e03, -1.038384026e03, -1.065501873e02, -6.051367875, -2.054332446e-01, -4.169739389e-03,
         -4.687195829e-05, -2.252755540e-07),
    ),
    (-38.426669071, -39.764473993, (-93.576667419, -2.747477419)),  # the flank, 70°
)  # fmt: skip
# From, to, centre (y, z), radius, and on which side of the centre the arc is.
ARCS = (
    (-35.0, -38.426669071, -26.210665, 16.446, 13.0, -1.0),
    (-39.764473993, -49.662510381, -58.558326413, 8.834924130, 20.0, 1.0),
    (-49.662510381, -62.764705882, -55.0, 16.0, 12.0, 1.0),
    (-62.764705882, -70.0, -49.5, 9.519259302, 20.5, 1.0),
)
BACK, FRONT = -70.0, 60.0
FLANGE_BACK = 70.0
"""Distance from the flange's back to the tread datum, mm."""


def s1002(y: FloatArray) -> FloatArray:
    """Return z in mm at lateral positions in mm; NaN beyond the profile's ends."""
    y = np.asarray(y, dtype=float)
    z = np.full(y.shape, np.nan)
    for begin, end, coefficients in POLYNOMIALS:
        here = (y <= begin) & (y >= end)
        z[here] = np.polynomial.polynomial.polyval(y[here], coefficients)
    for begin, end, centre_y, centre_z, radius, side in ARCS:
        here = (y <= begin) & (y >= end)
        z[here] = centre_z + side * np.sqrt(radius**2 - (y[here] - centre_y) ** 2)
    return z
