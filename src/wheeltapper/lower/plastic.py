"""Elastic-plastic laws for the kernels: polynomial pieces over the indentation, and the static indentation."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.lower.ellipse import semi_axes
from wheeltapper.lower.numbers import Units
from wheeltapper.march import program as contract
from wheeltapper.march.general.at_rest import Bearing, indentation_at_rest
from wheeltapper.march.program import Program

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LARGEST = 300.0
"""Indentation over that at first yield, D, up to which a law is written as pieces. Its last piece continues beyond."""
TOLERANCE = 1e-12
"""Largest relative error of the pieces, in force and residual indentation."""
STRAIGHT = 1e-13
"""A piece that deviates less from a straight line, relative to its largest value, is one, but for rounding."""
NODES = np.cos(np.pi * (np.arange(contract.TERMS) + 0.5) / contract.TERMS)
"""Places, on [-1, 1], at which a piece equals the law."""
CHECKS = np.cos(np.pi * np.arange(2 * contract.TERMS + 1) / (2 * contract.TERMS))
"""Places, on [-1, 1], at which the error of a piece is measured."""
TO_POWERS = np.linalg.inv(np.vander(NODES, increasing=True))


def law_rows(contact: ElasticPlastic, yield_indentation: float) -> FloatArray:
    """Return the pieces of a law, in units in which the force of an elastic contact is δ^1.5.

    Parameters
    ----------
    contact
        The law.
    yield_indentation
        δ_Y in those units.
    """
    force = yield_indentation**1.5
    inside = [b for b in contact.borders if b < LARGEST]
    pieces = list(zip([1.0, *inside], [*inside, LARGEST], strict=True))[::-1]
    rows = []
    while pieces:
        start, end = pieces.pop()
        centre, scale = 0.5 * (start + end), 0.5 * (end - start)
        at, checked = centre + scale * NODES, np.clip(centre + scale * CHECKS, start * (1 + 1e-15), end)
        row = np.zeros(contract.LAW_COLUMNS)
        row[contract.LAW_START] = start * yield_indentation
        row[contract.LAW_CENTRE], row[contract.LAW_SCALE] = centre * yield_indentation, scale * yield_indentation
        is_exact = True
        for function, unit, column, size in (
            (contact.loading, force, contract.LAW_FORCE, contact.loading(end)),
            (contact.residual, yield_indentation, contract.LAW_RESIDUAL, end),
        ):
            inner = np.clip(at, np.nextafter(start, end), np.nextafter(end, start))
            terms = TO_POWERS @ function(inner)
            wrong = np.abs(np.polynomial.polynomial.polyval((checked - centre) / scale, terms) - function(checked))
            is_exact = is_exact and bool(wrong.max() <= TOLERANCE * float(size) or end - start < 1e-3 * start)
            terms[np.abs(terms) < 1e-16 * float(size)] = 0.0
            if np.abs(terms[2:]).sum() < STRAIGHT * float(size):
                terms[2:] = 0.0
            row[column : column + contract.TERMS] = terms * unit
        if is_exact:
            rows.append(row)
        else:
            middle = np.sqrt(start * end)
            pieces += [(middle, end), (start, middle)]
    return np.array(rows)


@lru_cache(maxsize=16)
def stretched_rows(contact: ElasticPlastic) -> FloatArray:
    """Return the pieces of a law with the number of its borders up to each, for the general march.

    Lengths are over δ_Y, and forces over N_Y.
    """
    rows = law_rows(contact, 1.0)
    borders = np.array([b for b in contact.borders if b < LARGEST])
    stretch = 1.0 + np.searchsorted(borders * (1.0 - 1e-12), rows[:, contract.LAW_START], side="right")
    out = np.column_stack([rows, stretch])
    out.setflags(write=False)  # it is kept
    return out


def virgin_pieces(pieces: FloatArray, onset: float) -> FloatArray:
    """Return the pieces of a path over a surface that yields at an indentation, m, and that no wheel has pressed."""
    out = np.zeros((len(pieces), contract.MARKED_COLUMNS))
    out[:, : contract.PIECE_COLUMNS] = pieces
    out[:, contract.BEARS] = onset
    return out


def loading_force(law: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the loading force of a virgin surface at indentations ≥ 0, in the law's units."""
    depth = np.asarray(depth, dtype=float)
    elastic = np.maximum(depth, 0.0) ** 1.5
    return np.where(depth <= law[0, contract.LAW_START], elastic, _evaluated_columns(law, depth, contract.LAW_FORCE))


def left_after(law: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the residual indentation after unloading from indentations, in the law's units."""
    depth = np.asarray(depth, dtype=float)
    out, beyond = np.zeros_like(depth), depth > law[0, contract.LAW_START]  # most of a rail has not yielded
    out[beyond] = _evaluated_columns(law, depth[beyond], contract.LAW_RESIDUAL)
    return out


def stored_below(law: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the work of loading a virgin surface up to indentations ≥ 0."""
    depth = np.asarray(depth, dtype=float)
    starts, scale = law[:, contract.LAW_START], law[:, contract.LAW_SCALE]
    powers = np.arange(1, contract.TERMS + 1)
    terms = law[:, contract.LAW_FORCE : contract.LAW_FORCE + contract.TERMS] / powers

    def force_integral(rows: IntArray, x: FloatArray) -> FloatArray:
        share = (x - law[rows, contract.LAW_CENTRE]) / scale[rows]
        return np.asarray(scale[rows] * (terms[rows] * share[..., None] ** powers).sum(axis=-1))

    each = np.arange(len(law))
    whole = force_integral(each[:-1], starts[1:]) - force_integral(each[:-1], starts[:-1])
    below = 0.4 * starts[0] ** 2.5 + np.append(0.0, np.cumsum(whole))
    rows = np.clip(np.searchsorted(starts, depth, side="right") - 1, 0, len(law) - 1)
    yielding = below[rows] + force_integral(rows, depth) - force_integral(rows, starts[rows])
    return np.where(depth <= starts[0], 0.4 * np.maximum(depth, 0.0) ** 2.5, yielding)


def _loaded_pieces(rows: FloatArray, law: FloatArray, depth: float, length: float) -> None:
    """Convert the pieces of a virgin spot to those of one that was indented before (scaled; `length` is the unit)."""
    residual = float(left_after(law, np.asarray(depth)))
    rows[:, contract.COEFFICIENT] -= residual * length
    rows[:, contract.RESIDUAL] = residual * length
    rows[:, contract.BEARS] = (depth - residual) * length
    rows[:, contract.FACTOR_DEGREE] = 0.0
    rows[:, contract.FACTOR] = float(loading_force(law, np.asarray(depth))) / (depth - residual) ** 1.5


def _evaluated_columns(law: FloatArray, depth: FloatArray, column: int) -> FloatArray:
    """Return the polynomials that begin at a column, each evaluated in its piece."""
    starts = law[:, contract.LAW_START]
    rows = law[np.clip(np.searchsorted(starts, depth, side="right") - 1, 0, len(law) - 1)]
    x = (depth - rows[..., contract.LAW_CENTRE]) / rows[..., contract.LAW_SCALE]
    total = np.zeros_like(depth)
    for k in range(contract.TERMS - 1, -1, -1):
        total = total * x + rows[..., column + k]
    return total


def patch_semi_axis(contact: ElasticPlastic, vehicle: Wheelset, force: float) -> float:
    """Return the semi-axis of the contact patch along the rail, m, at a normal force of the wheelset (N)."""
    along, _ = semi_axes(
        np.array([0.5 / vehicle.radius]), np.array([0.5 / contact.rail_radius]), contact.youngs_modulus, contact.poisson
    )
    return float(along[0] * np.cbrt(force / vehicle.wheels))


def dissipated_by(law: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the work that loading a virgin surface up to indentations and unloading it dissipates."""
    force = loading_force(law, depth)
    return np.asarray(stored_below(law, depth) - 0.4 * force * (depth - left_after(law, depth)))


def plastic_bearing(law: FloatArray, residual: float = 0.0, bears: float = 0.0, factor: float = 1.0) -> Bearing:
    """Return a plastic law as the static state asks for it, in scaled units.

    Parameters
    ----------
    law
        Its pieces.
    residual, bears, factor
        State of a surface that has yielded: its residual indentation, its yield indentation from there, and the factor
        on its elastic force.
    """

    def borne(depth: Any) -> tuple[Any, Any]:
        if residual != 0.0 and depth <= bears:
            return factor * depth**1.5, 1.5 * factor * np.sqrt(depth)
        reached = np.asarray(depth + residual, dtype=float)
        if reached <= law[0, contract.LAW_START]:
            return reached**1.5, 1.5 * np.sqrt(reached)
        row = law[np.searchsorted(law[:, contract.LAW_START], reached, side="right") - 1]
        terms = np.polynomial.Polynomial(row[contract.LAW_FORCE : contract.LAW_FORCE + contract.TERMS])
        x = (reached - row[contract.LAW_CENTRE]) / row[contract.LAW_SCALE]
        return terms(x), terms.deriv()(x) / row[contract.LAW_SCALE]

    return borne


def static_force_of(law: FloatArray, stiffness: float) -> float:
    """Return the static force on level, virgin track over the weight, beside a spring, in scaled units."""
    return float(loading_force(law, indentation_at_rest(plastic_bearing(law), 1.0, stiffness)))


def yielding_program(
    scenario: Scenario, contact: ElasticPlastic, elastic: Program, units: Units, height: float
) -> tuple[Program, float]:
    """Return the program with the contact's plastic law instead of the elastic one, and the static force, N.

    Parameters
    ----------
    scenario, contact
        The scenario, and its contact.
    elastic, units
        The program with the elastic part of the contact, and its units.
    height
        Height of the path at x = 0, m.
    """
    length, force = units.length.item(), units.force.item()
    onset = contact.yield_indentation(units.contact_constant.item(), scenario.vehicle.wheels, units.static_force.item())
    law = law_rows(contact, onset / length)
    numbers = elastic.numbers.copy()
    numbers[contract.MEMORY] = float(scenario.speed == 0.0)
    stiffness = numbers[contract.STIFFNESS]
    static = static_force_of(law, stiffness)
    if numbers[contract.DECK_MASS] > 0.0:
        numbers[contract.PRESTRESS] = static
    marked = virgin_pieces(elastic.pieces, onset)
    if scenario.start == "equilibrium":
        at_start = height / length
        depth = float(indentation_at_rest(plastic_bearing(law), 1.0, stiffness, at_start))
        numbers[contract.START_HEIGHT] = at_start - depth
        if scenario.speed == 0.0 and depth > onset / length:
            _loaded_pieces(marked, law, depth, length)
    return Program(marked, numbers, law), static * force
