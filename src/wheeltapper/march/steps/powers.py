"""The source of functions for energy and power of wheel and deck, at eight ends of steps at a time.

By Hermite's rule what an end of a step adds to an integral over that step is a polynomial in its length, whose
coefficients are those of the integrand's series there. The rows of `L` are those of energies in lane_rows.py.
"""

from __future__ import annotations

from math import factorial

from wheeltapper.march.steps.derive import coefficients, needed
from wheeltapper.march.steps.equations import BENT, Free, Terms, powers
from wheeltapper.march.steps.lanes import at, function, given, given_in_time, horner, read

KINDS: tuple[Terms | Free, ...] = (
    Free(bonded=True, deck=True, end=True),
    Terms(BENT, hysteresis=True, deck=True, end=True),
    Terms(BENT, deck=True, yields=True, end=True),
)
"""In time, in an elastic contact, and in one that yields; each has all terms, for so few coefficients cost little."""
MANY = 8, 4, 4
"""How many coefficients: in contact steps are short."""


def hermite_weights(many: int) -> list[float]:
    """Return the weights of a series' coefficients at a step's start, by Hermite's rule; at its end signs alternate."""
    k = many - 1
    return [
        factorial(k + 1) / factorial(2 * k + 2) * factorial(2 * k + 1 - j) / factorial(k - j) / (j + 1)
        for j in range(many)
    ]


def _part(of: list[str], length: str, signed: str) -> str:
    """Return what one end of a step adds to an integral over it, from a series there."""
    weighted = [f"{weight!r} * {term}" for weight, term in zip(hermite_weights(len(of)), of, strict=True)]
    return f"{length} * {horner(weighted, signed)}"


def source(kind: int) -> str:
    """Return the function for one of the kinds of steps."""
    terms, many = KINDS[kind], MANY[kind]
    lines = [*read({"mass": "LANE_MASS", "before": "LANE_BEFORE", "after": "LANE_AFTER"})]
    lines += [*(given(terms) if isinstance(terms, Terms) else given_in_time(terms)), "bearing = mass * deck_drag"]
    lines += [line for line in coefficients(powers(terms), many - 1) if not line.startswith("w0 = ")]
    if isinstance(terms, Terms):
        place, losses = "x0", ["lost0 * u0"]  # their amount need not be exact
    else:
        place, losses = "y0", [f"lost{n}" for n in range(many)]
        lines += ["u0 = 1.0", "w0 = path1 + on * Z0 - v0"]
    gains = [f"power{n}" for n in range(many)]
    deck = "mass * (0.5 * (Z0 * Z0 + deck_stiff * Y0 * Y0) - prestress * Y0)"
    lines += ["pushed = N0 * u0", "back = -before"]
    found = {
        "energy": f"0.5 * (v0 * v0 + K * {place} * {place}) + {place} + {deck}", "kinetic": "0.5 * v0 * v0",
        "gain_after": _part(gains, "after", "after"), "gain_before": _part(gains, "before", "back"),
        "lost_after": _part(losses, "after", "after"), "lost_before": _part(losses, "before", "back"),
        "worked": "pushed * (v0 + w0 - on * Z0)", "gained": "pushed * w0",
    }  # fmt: skip
    body = needed([*lines, *(f"{name} = {code}" for name, code in found.items())], found)
    body += [f"{at(f'LANE_{name.upper()}')} = {name}" for name in found]
    return function(f"powers_{terms.name}", "Find the energy, and what these ends of steps add to its integrals.", body)
