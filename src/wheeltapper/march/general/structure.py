"""A periodic track as the march sees it: complex modes, their shapes over one bay, and a local compliance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common.program import FloatArray

ComplexArray = NDArray[np.complex128]


class Ring(NamedTuple):
    """A ring of equal bays in complex modes (docs/theory/track.rst).

    Under forces N, positive downwards, the amplitudes a and the rail's deflection w, positive downwards, follow

        a_n' = rates_n a_n + Ψ_n(x) N,    w(x) = Σ_n weights_n Re[Φ_n(x) a_n] + r(x) N.

    Amplitudes refer to the bay in which x lies; seen from the bay `j` further on they are `turns**j` times as large.
    Shapes are polynomials in ζ in [-1, 1], from one end of their element to the other, by rising powers.

    Attributes
    ----------
    rates
        λ_n, (modes,), 1/s.
    turns
        exp(i·k_n·a), (modes,): the factor on the amplitudes when a port enters the next bay.
    weights
        (modes,): 2, or 1 where λ is real and the mode is its own conjugate.
    edges
        Of the elements of one bay, (elements + 1,), m from 0 to the spacing; a bay begins at a seat.
    deflection
        Φ_n, (elements, degree + 1, modes).
    drive
        Ψ_n, (elements, degree + 1, modes), 1/(N s) times the unit of the amplitudes.
    residual
        r, (elements, 15), m/N.
    spacing
        a, m.
    bays
        Number of bays of the ring.
    seats
        Equal parts of a bay, at whose ends its shapes have kinks; macro steps end there.
    """

    rates: ComplexArray
    turns: ComplexArray
    weights: FloatArray
    edges: FloatArray
    deflection: ComplexArray
    drive: ComplexArray
    residual: FloatArray
    spacing: float
    bays: int
    seats: int = 1
