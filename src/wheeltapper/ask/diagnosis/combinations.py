"""What a record cannot show, however good the sensor, and what it shows best: products of powers of the fields.

force scale         m, P, k, c, C, M, K, C_d times s leave the deck's motion as it is
displacement scale  h times s, with R, m, k, c over s and C over s^1.5 at the same N0, leave the force as it is; only
                    the deck's own motion, small where it is heavy, shows s
load and weight     act by their sum N0 = P + m·g alone, which stands for the load here
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.diagnosis.information import Information, errors
from wheeltapper.ground.arguments import as_count, as_quantity
from wheeltapper.ground.errors import InputError, shown

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

    exponents: by path; deviation: standard deviation of its logarithm; reason: a law, where one is behind it.
    """

    exponents: dict[str, float]
    deviation: float
    reason: str = ""

    def __str__(self) -> str:
        product = " · ".join(
            name if power == 1.0 else f"{name}^{_written(power)}" for name, power in self.exponents.items()
        )
        reason = f" ({self.reason})" if self.reason else ""
        return f"{product}: {100.0 * self.deviation:.2g} %{reason}"


@dataclass(frozen=True)
class Combinations:
    """What one passage cannot show, and what it shows best.

    Attributes
    ----------
    unknown
        Ways in which the fields can change together, each with s to the power of its exponent, and the record hardly
        does: with the standard deviation of ln s by the record alone.
    known
        Products of powers that are known far better than their fields, by the record and what is known beforehand.
    """

    unknown: tuple[Combination, ...]
    known: tuple[Combination, ...]

    def __str__(self) -> str:
        parts = [f"not known: {one}" for one in self.unknown] + [f"known: {one}" for one in self.known]
        return "\n".join(parts)


def combinations(found: Information, passage: int = 0, limit: float = LIMIT) -> Combinations:
    """Return what one of the passages cannot show, and what it shows best.

    Parameters
    ----------
    found
        Of fields among which the combinations are looked for: those that are asked for and the uncertain ones.
    passage
        Which of its speeds.
    limit
        A direction in which ln s has a larger standard deviation by the record alone is listed as unknown.
    """
    if not isinstance(found, Information):
        raise InputError("", "found", shown(found), "what `information` returned")
    passage = as_count(passage, "passage", 0, len(found.speeds) - 1)
    limit = as_quantity(limit, "limit", "number")
    names, turned = _coordinates(found)
    laws = _laws(names)
    return Combinations(
        tuple(_unknown(found.factors[passage] @ turned, names, laws, limit)),
        tuple(_known(found.rows(passage) @ turned, names, laws)),
    )


def _coordinates(found: Information) -> tuple[tuple[str, ...], FloatArray]:
    """Return the coordinates' names with N0 in the load's place, and what rows are multiplied by to be in them."""
    paths, vehicle = found.paths, found.site.passage.vehicle
    turned = np.eye(len(paths))
    if "vehicle.load" in paths:
        load = paths.index("vehicle.load")
        turned[load, load] = vehicle.weight / vehicle.load
        for path in {"vehicle.mass", "vehicle.gravity"} & set(paths):
            turned[load, paths.index(path)] = -vehicle.mass * vehicle.gravity / vehicle.load
    return tuple(STATIC_LOAD if path == "vehicle.load" else path for path in paths), turned


def _laws(names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return the exponents of each law, by what it is called."""
    heights = [name for name in names if name.rpartition(".")[2] in HEIGHTS]
    tables = {
        "force scale": dict.fromkeys(FORCES, 1.0),
        "displacement scale": LENGTHS | dict.fromkeys(heights, 1.0),
        "load and weight": {"vehicle.gravity": 1.0},
    }
    return {law: np.array([table.get(name, 0.0) for name in names]) for law, table in tables.items()}


def _unknown(
    rows: FloatArray, names: tuple[str, ...], laws: Mapping[str, FloatArray], limit: float
) -> Iterator[Combination]:
    """Find the directions that the record hardly shows: those of laws first, then what is left of them."""
    _, singular, directions = np.linalg.svd(rows)
    weak = directions[singular * limit < 1.0]
    told = np.empty((0, len(names)))
    for law, exponents in laws.items():
        new = exponents - told.T @ (told @ exponents)
        along = weak.T @ (weak @ new)
        size = float(np.linalg.norm(along))
        if size > LIKE * float(np.linalg.norm(new)) > 0.0:
            yield Combination(_named(exponents, names), _deviation(rows, along), law)
            told = np.vstack([told, along / size])
            weak = _less(weak, along / size)
    for direction in weak:
        scaled = direction / direction[np.argmax(np.abs(direction))]
        yield Combination(_named(np.array([_rounded(x) for x in scaled]), names), _deviation(rows, scaled))


def _deviation(rows: FloatArray, along: FloatArray) -> float:
    """Return the standard deviation of a step along a direction; infinite where it leaves no trace in numbers."""
    trace = float(np.linalg.norm(rows @ along))
    return 1.0 / trace if trace > 1e-10 * float(np.linalg.norm(rows) * np.linalg.norm(along)) else float("inf")


def _less(weak: FloatArray, unit: FloatArray) -> FloatArray:
    """Return what a space of directions (rows) has at right angles to one of them."""
    _, singular, rows = np.linalg.svd(weak - np.outer(weak @ unit, unit), full_matrices=False)
    return np.asarray(rows[singular > 0.5])


def _known(rows: FloatArray, names: tuple[str, ...], laws: Mapping[str, FloatArray]) -> Iterator[Combination]:
    """Find the products of two fields' powers that are far better known than either, best first, none that follows."""
    linked = list(range(len(names)))
    for deviation, i, j, exponents in sorted(_pairs(rows), key=lambda pair: pair[0]):
        if linked[i] != linked[j]:
            linked = [linked[i] if group == linked[j] else group for group in linked]
            kept = [law for law, along in laws.items() if along.any() and abs(float(along @ exponents)) < 1e-9]
            yield Combination(_named(exponents, names), deviation, f"unchanged by {', '.join(kept)}" if kept else "")


def _pairs(rows: FloatArray) -> Iterator[tuple[float, int, int, FloatArray]]:
    """Return the deviation of two fields' products, which they are, and their exponents, where it is small."""
    unit = np.eye(rows.shape[1])
    scatter = np.array([errors(rows, one) for one in unit])
    single = np.linalg.norm(scatter, axis=1)
    for i, j in np.ndindex(rows.shape[1], rows.shape[1]):
        power = _simplest(-float(scatter[i] @ scatter[j]) / single[j] ** 2)
        if i == j or power == 0.0 or (abs(power) == 1.0 and i < j):
            continue
        exponents = (1.0 if power > 0.0 or i > j else -1.0) * (unit[i] + power * unit[j])
        deviation = float(np.linalg.norm(errors(rows, exponents)))
        if deviation < LIMIT and GAIN * deviation < min(single[i], abs(power) * single[j]):
            yield deviation, i, j, exponents


def _simplest(power: float) -> float:
    """Return the nearest of ±1/3, ±1/2, ±2/3, ±1 and 0; zero beyond ±1, where the other field has the larger power."""
    nearest = min({Fraction(n, d) for d in DENOMINATORS for n in range(-d, d + 1)}, key=lambda f: abs(f - power))
    return float(nearest) if abs(power) < 1.2 else 0.0


def _rounded(power: float) -> float:
    nearest = Fraction(power).limit_denominator(DENOMINATORS[-1])
    return float(nearest) if abs(float(nearest) - power) < NEAR else round(power, 2)


def _written(power: float) -> str:
    nearest = Fraction(power).limit_denominator(DENOMINATORS[-1])
    return str(nearest) if abs(float(nearest) - power) < 1e-9 else f"{power:g}"


def _named(exponents: FloatArray, names: tuple[str, ...]) -> dict[str, float]:
    return {name: float(power) for name, power in zip(names, exponents, strict=True) if power != 0.0}
