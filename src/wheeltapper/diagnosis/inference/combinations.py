"""Products of powers of the fields that no recording can determine, and those that it determines best.

force scale         If m, P, k, c, C, M, K and C_d are multiplied by s, the motion of the deck stays the same.
displacement scale  If h is multiplied by s, R, m, k and c are divided by s, C by s^1.5, and N0 is kept, the contact
                    force stays the same. Only the motion of the deck, which is small if it is heavy, depends on s.
load and weight     They act only through their sum N0 = P + m·g, which replaces the load here.

See docs/theory/diagnosis.rst, section 8.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.inference.information import Information, error_vector
from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.shown import Shown

FloatArray = NDArray[np.float64]

STATIC_LOAD = "static load"
"""Name of the static force N0 = P + m·g, which replaces the load P as a coordinate."""
DENOMINATORS = (1, 2, 3)
"""Exponents of products are fractions with these denominators."""
NEAR = 0.04
"""An exponent is replaced by a simple fraction if it differs from it by at most this; otherwise it is rounded to two
decimals."""
LIKE = 0.95
"""A direction that the recording does not determine is named after a law if the cosine of the angle between the two is
at least this."""
GAIN = 3.0
"""A product of powers is listed as known if its standard deviation is at least this many times smaller than that of
each factor."""
LIMIT = 0.1
"""Standard deviation of a logarithm, 10 % of the value. A direction with a larger one counts as unknown, and a product
of powers with a smaller one as known."""
CONSTANTS = ("contact.constant", "contact.constant_per_wheel")
"""Fields that hold a contact constant C."""
HEIGHTS = ("height", "depth", "amplitude")
"""Last names of the fields that hold a height of an irregularity."""
FORCES = (
    STATIC_LOAD, "vehicle.mass", "vehicle.stiffness", "vehicle.damping", *CONSTANTS, "contact.stiffness",
    "contact.youngs_modulus", "track.mass", "track.stiffness", "track.damping",
)  # fmt: skip
"""Fields that the force scale multiplies by s."""
LENGTHS = {
    "vehicle.mass": -1.0, "vehicle.stiffness": -1.0, "vehicle.damping": -1.0, "vehicle.radius": -1.0,
    "contact.stiffness": -1.0, **dict.fromkeys(CONSTANTS, -1.5),
}  # fmt: skip
"""Exponents of s with which the displacement scale changes the fields; heights have the exponent one."""


class Combination(NamedTuple):
    """A product of powers of fields, or a way in which they change together.

    exponents: by path. deviation: standard deviation of its logarithm. reason: the law that explains it, if there is
    one.
    """

    exponents: dict[str, float]
    deviation: float
    reason: str = ""

    def __str__(self) -> str:
        product = " · ".join(
            name if power == 1.0 else f"{name}^{_power_text(power)}" for name, power in self.exponents.items()
        )
        reason = f" ({self.reason})" if self.reason else ""
        return f"{product}: {100.0 * self.deviation:.2g} %{reason}"


@dataclass(frozen=True)
class Combinations(Shown):
    """What one passage cannot determine, and what it determines best.

    Attributes
    ----------
    unknown
        Common changes of the fields, each by s to the power of its exponent, that hardly change the recording; with the
        standard deviation of ln s from the recording alone.
    known
        Products of powers that are known far better than their factors, from the recording and the priors.
    """

    unknown: tuple[Combination, ...]
    known: tuple[Combination, ...]

    def __str__(self) -> str:
        parts = [f"not known: {one}" for one in self.unknown] + [f"known: {one}" for one in self.known]
        return "\n".join(parts)


def combinations(found: Information, passage: int = 0, limit: float = LIMIT) -> Combinations:
    """Return what one of the passages cannot determine, and what it determines best.

    Parameters
    ----------
    found
        Information on the fields among which combinations are searched: the named and the uncertain ones.
    passage
        Number of the passage.
    limit
        Standard deviation of ln s from the recording alone. Directions with a larger one are listed as unknown.
    """
    if not isinstance(found, Information):
        raise InputError("", "found", value_text(found), "what `information` returned")
    rows = found.rows(passage)
    limit = as_quantity(limit, "limit", "number")
    names, turned = _named_coordinates(found)
    laws = _law_exponents(names)
    return Combinations(
        tuple(_unknown_directions(found.factors[passage] @ turned, names, laws, limit)),
        tuple(_known_products(rows @ turned, names, laws)),
    )


def _named_coordinates(found: Information) -> tuple[tuple[str, ...], FloatArray]:
    """Return the names of the coordinates, with N0 for the load, and the matrix that transforms rows to them."""
    paths, vehicle = found.paths, found.site.passage.vehicle
    turned = np.eye(len(paths))
    if "vehicle.load" in paths:
        load = paths.index("vehicle.load")
        turned[load, load] = vehicle.weight / vehicle.load
        for path in {"vehicle.mass", "vehicle.gravity"} & set(paths):
            turned[load, paths.index(path)] = -vehicle.mass * vehicle.gravity / vehicle.load
    return tuple(STATIC_LOAD if path == "vehicle.load" else path for path in paths), turned


def _law_exponents(names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return the exponents of each law, by the name of the law."""
    heights = [name for name in names if name.rpartition(".")[2] in HEIGHTS]
    tables = {
        "force scale": dict.fromkeys(FORCES, 1.0),
        "displacement scale": LENGTHS | dict.fromkeys(heights, 1.0),
        "load and weight": {"vehicle.gravity": 1.0},
    }
    return {law: np.array([table.get(name, 0.0) for name in names]) for law, table in tables.items()}


def _unknown_directions(
    rows: FloatArray, names: tuple[str, ...], laws: Mapping[str, FloatArray], limit: float
) -> Iterator[Combination]:
    """Find the directions that the recording hardly determines: those of the laws first, then the remaining ones."""
    _, singular, directions = np.linalg.svd(rows)
    weak = directions[singular * limit < 1.0]
    told = np.empty((0, len(names)))
    for law, exponents in laws.items():
        new = exponents - told.T @ (told @ exponents)
        along = weak.T @ (weak @ new)
        size = float(np.linalg.norm(along))
        if size > LIKE * float(np.linalg.norm(new)) > 0.0:
            yield Combination(_exponents_by_name(exponents, names), _direction_deviation(rows, along), law)
            told = np.vstack([told, along / size])
            weak = _orthogonal_part(weak, along / size)
    for direction in weak:
        scaled = direction / direction[np.argmax(np.abs(direction))]
        yield Combination(
            _exponents_by_name(np.array([_rounded_power(x) for x in scaled]), names), _direction_deviation(rows, scaled)
        )


def _direction_deviation(rows: FloatArray, along: FloatArray) -> float:
    """Return the standard deviation of a step along a direction; infinite if its effect is below rounding."""
    trace = float(np.linalg.norm(rows @ along))
    return 1.0 / trace if trace > 1e-10 * float(np.linalg.norm(rows) * np.linalg.norm(along)) else float("inf")


def _orthogonal_part(weak: FloatArray, unit: FloatArray) -> FloatArray:
    """Return the part of a space of directions (rows) that is orthogonal to one of them."""
    _, singular, rows = np.linalg.svd(weak - np.outer(weak @ unit, unit), full_matrices=False)
    return np.asarray(rows[singular > 0.5])


def _known_products(rows: FloatArray, names: tuple[str, ...], laws: Mapping[str, FloatArray]) -> Iterator[Combination]:
    """Find independent products of powers of two fields that are far better known than either, best first."""
    linked = list(range(len(names)))
    for deviation, i, j, exponents in sorted(_pair_products(rows), key=lambda pair: pair[0]):
        if linked[i] != linked[j]:
            linked = [linked[i] if group == linked[j] else group for group in linked]
            kept = [law for law, along in laws.items() if along.any() and abs(float(along @ exponents)) < 1e-9]
            yield Combination(
                _exponents_by_name(exponents, names), deviation, f"unchanged by {', '.join(kept)}" if kept else ""
            )


def _pair_products(rows: FloatArray) -> Iterator[tuple[float, int, int, FloatArray]]:
    """Return the small standard deviations of products of two fields, the two fields, and the exponents."""
    unit = np.eye(rows.shape[1])
    scatter = np.array([error_vector(rows, one) for one in unit])
    single = np.linalg.norm(scatter, axis=1)
    for i, j in np.ndindex(rows.shape[1], rows.shape[1]):
        power = _simple_power(-float(scatter[i] @ scatter[j]) / single[j] ** 2)
        if i == j or power == 0.0 or (abs(power) == 1.0 and i < j):
            continue
        exponents = (1.0 if power > 0.0 or i > j else -1.0) * (unit[i] + power * unit[j])
        deviation = float(np.linalg.norm(error_vector(rows, exponents)))
        if deviation < LIMIT and GAIN * deviation < min(single[i], abs(power) * single[j]):
            yield deviation, i, j, exponents


def _simple_power(power: float) -> float:
    """Return the nearest of ±1/3, ±1/2, ±2/3, ±1 and 0; zero beyond ±1: the other field then has the larger power."""
    nearest = min({Fraction(n, d) for d in DENOMINATORS for n in range(-d, d + 1)}, key=lambda f: abs(f - power))
    return float(nearest) if abs(power) < 1.2 else 0.0


def _rounded_power(power: float) -> float:
    nearest = Fraction(power).limit_denominator(DENOMINATORS[-1])
    return float(nearest) if abs(float(nearest) - power) < NEAR else round(power, 2)


def _power_text(power: float) -> str:
    nearest = Fraction(power).limit_denominator(DENOMINATORS[-1])
    return str(nearest) if abs(float(nearest) - power) < 1e-9 else f"{power:g}"


def _exponents_by_name(exponents: FloatArray, names: tuple[str, ...]) -> dict[str, float]:
    return {name: float(power) for name, power in zip(names, exponents, strict=True) if power != 0.0}
