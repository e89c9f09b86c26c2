"""Elastic-plastic laws for the kernels: polynomial pieces over the indentation, and the static indentation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.lower.numbers import Units
from wheeltapper.march import program as contract
from wheeltapper.march.program import Program

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]

LARGEST = 1000.0
"""D up to which a law is written out; its last piece goes on beyond."""
TOLERANCE = 2e-14
"""How exactly, relative to force and indentation."""
NODES = np.cos(np.pi * (np.arange(contract.TERMS) + 0.5) / contract.TERMS)
CHECKS = np.cos(np.pi * np.arange(2 * contract.TERMS + 1) / (2 * contract.TERMS))
TO_POWERS = np.linalg.inv(np.vander(NODES, increasing=True))


def law_rows(contact: ElasticPlastic, yield_indentation: float) -> FloatArray:
    """Return the pieces of a law, in units in which an elastic contact carries δ^1.5.

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
            row[column : column + contract.TERMS] = terms * unit
        if is_exact:
            rows.append(row)
        else:
            middle = np.sqrt(start * end)
            pieces += [(middle, end), (start, middle)]
    return np.array(rows)


def loading_force(law: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the loading force of a virgin surface at indentations ≥ 0, in the law's units."""
    depth = np.asarray(depth, dtype=float)
    elastic = np.maximum(depth, 0.0) ** 1.5
    return np.where(depth <= law[0, contract.LAW_START], elastic, _evaluated(law, depth, contract.LAW_FORCE))


def left_after(law: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the residual indentation after unloading from indentations, in the law's units."""
    depth = np.asarray(depth, dtype=float)
    return np.where(depth <= law[0, contract.LAW_START], 0.0, _evaluated(law, depth, contract.LAW_RESIDUAL))


def stored_below(law: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the work of loading a virgin surface up to indentations ≥ 0."""
    depth = np.asarray(depth, dtype=float)
    total = 0.4 * np.minimum(np.maximum(depth, 0.0), law[0, contract.LAW_START]) ** 2.5
    ends = np.append(law[1:, contract.LAW_START], np.inf)
    for row, end in zip(law, ends, strict=True):
        terms = np.polynomial.polynomial.polyint(row[contract.LAW_FORCE : contract.LAW_FORCE + contract.TERMS])
        top = np.clip(depth, row[contract.LAW_START], end)
        low, high = ((x - row[contract.LAW_CENTRE]) / row[contract.LAW_SCALE] for x in (row[contract.LAW_START], top))
        work = np.polynomial.polynomial.polyval(high, terms) - np.polynomial.polynomial.polyval(low, terms)
        total = total + row[contract.LAW_SCALE] * work
    return np.asarray(total)


def _evaluated(law: FloatArray, depth: FloatArray, column: int) -> FloatArray:
    """Return the polynomials that begin at a column, each in its own piece."""
    starts = law[:, contract.LAW_START]
    rows = law[np.clip(np.searchsorted(starts, depth, side="right") - 1, 0, len(law) - 1)]
    x = (depth - rows[..., contract.LAW_CENTRE]) / rows[..., contract.LAW_SCALE]
    total = np.zeros_like(depth)
    for k in range(contract.TERMS - 1, -1, -1):
        total = total * x + rows[..., column + k]
    return total


def static_depth(law: FloatArray, stiffness: float, height: float) -> float:
    """Return the static indentation on a virgin path at `height`: 1 + K·(height - δ) = N(δ), in scaled units."""
    from scipy.optimize import brentq

    def missing(depth: float) -> float:
        return 1.0 + stiffness * (height - depth) - float(loading_force(law, np.asarray(depth)))

    high = 1.0
    while missing(high) > 0.0:
        high *= 2.0
    return float(brentq(missing, 0.0, high, xtol=1e-15, rtol=1e-15))


def yielding_program(
    scenario: Scenario, contact: ElasticPlastic, elastic: Program, units: Units, height: float
) -> tuple[Program, float]:
    """Return the program with the contact's plastic law instead of the elastic one, and the static force, N.

    Parameters
    ----------
    scenario, contact
        What is simulated, and its contact.
    elastic, units
        The program with the elastic part of the contact, and its units.
    height
        Of the path at x = 0, m.
    """
    length, force = units.length.item(), units.force.item()
    onset = contact.yield_indentation(units.contact_constant.item(), scenario.vehicle.wheels, units.static_force.item())
    law = law_rows(contact, onset / length)
    numbers = elastic.numbers.copy()
    numbers[contract.MEMORY] = float(scenario.speed == 0.0)
    stiffness = numbers[contract.STIFFNESS]
    static = float(loading_force(law, np.asarray(static_depth(law, stiffness, 0.0))))
    if numbers[contract.DECK_MASS] > 0.0:
        numbers[contract.PRESTRESS] = static
    if scenario.start == "equilibrium":
        at_start = height / length
        numbers[contract.START_HEIGHT] = at_start - static_depth(law, stiffness, at_start)
    marked = np.zeros((len(elastic.pieces), contract.MARKED_COLUMNS))
    marked[:, : contract.PIECE_COLUMNS] = elastic.pieces
    marked[:, contract.BEARS] = onset
    return Program(marked, numbers, law), static * force
