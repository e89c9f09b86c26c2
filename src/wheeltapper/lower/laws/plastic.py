"""Elastic-plastic laws for the kernels: polynomial pieces over the indentation, and the static indentation."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.laws.ellipse import semi_axes
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program
from wheeltapper.march.general.at_rest import Bearing, indentation_at_rest

if TYPE_CHECKING:
    from wheeltapper.lower.numbers import Units

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


@lru_cache(maxsize=16)
def _rows_over_onset(contact: ElasticPlastic) -> FloatArray:
    """Return the pieces of a law; lengths are over δ_Y, and forces over N_Y."""
    inside = [b for b in contact.borders if b < LARGEST]
    pieces = list(zip([1.0, *inside], [*inside, LARGEST], strict=True))[::-1]
    rows = []
    while pieces:
        start, end = pieces.pop()
        centre, scale = 0.5 * (start + end), 0.5 * (end - start)
        at, checked = centre + scale * NODES, np.clip(centre + scale * CHECKS, start * (1 + 1e-15), end)
        row = np.zeros(contract.LAW_COLUMNS)
        row[contract.LAW_START], row[contract.LAW_CENTRE], row[contract.LAW_SCALE] = start, centre, scale
        is_exact = True
        for function, column, size in (
            (contact.loading, contract.LAW_FORCE, contact.loading(end)),
            (contact.residual, contract.LAW_RESIDUAL, end),
        ):
            inner = np.clip(at, np.nextafter(start, end), np.nextafter(end, start))
            terms = TO_POWERS @ function(inner)
            wrong = np.abs(np.polynomial.polynomial.polyval((checked - centre) / scale, terms) - function(checked))
            is_exact = is_exact and bool(wrong.max() <= TOLERANCE * float(size) or end - start < 1e-3 * start)
            terms[np.abs(terms) < 1e-16 * float(size)] = 0.0
            if np.abs(terms[2:]).sum() < STRAIGHT * float(size):
                terms[2:] = 0.0
            row[column : column + contract.TERMS] = terms
        if is_exact:
            rows.append(row)
        else:
            middle = np.sqrt(start * end)
            pieces += [(middle, end), (start, middle)]
    return np.array(rows)


def law_rows(contact: ElasticPlastic, yield_indentation: float) -> FloatArray:
    """Return the pieces of a law, in units in which the force of an elastic contact is δ^1.5.

    Parameters
    ----------
    contact
        The law.
    yield_indentation
        δ_Y in those units.
    """
    rows = _rows_over_onset(contact).copy()
    rows[:, : contract.LAW_FORCE] *= yield_indentation
    rows[:, contract.LAW_FORCE : contract.LAW_RESIDUAL] *= yield_indentation**1.5
    rows[:, contract.LAW_RESIDUAL :] *= yield_indentation
    return rows


@lru_cache(maxsize=16)
def stretched_rows(contact: ElasticPlastic) -> FloatArray:
    """Return the pieces of a law with the number of its borders up to each, for the general march.

    Lengths are over δ_Y, and forces over N_Y.
    """
    rows = _rows_over_onset(contact)
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


class PlasticLaw(NamedTuple):
    """A plastic law of one contact, with its units.

    Attributes
    ----------
    rows
        Its pieces, in its units.
    length
        Its unit of length, m.
    force
        Its unit of force, that of the whole wheelset, N.
    """

    rows: FloatArray
    length: float
    force: float

    @classmethod
    def over_onset(cls, rows: FloatArray, onset: float, constant: float) -> PlasticLaw:
        """Return a law with rows over δ_Y, m, and N_Y, from the constant of a wheelset's elastic contact, N/m^1.5."""
        return cls(rows, onset, constant * onset**1.5)

    @property
    def onset(self) -> float:
        """Indentation at which a virgin surface yields, m."""
        return float(self.rows[0, contract.LAW_START] * self.length)

    def force_at(self, onsets: float) -> float:
        """Return the force of a wheelset that indents virgin surface by so many times that, N."""
        return float(loading_force(self.rows, np.asarray(onsets * self.rows[0, contract.LAW_START]))) * self.force

    def left_after(self, depth: FloatArray) -> FloatArray:
        """Return the residual indentation after unloading from indentations of the virgin surface, m."""
        return left_after(self.rows, depth / self.length) * self.length

    def left_over(self, indentation: FloatArray, before: FloatArray) -> FloatArray:
        """Return the same where earlier contacts have left some, m, from indentations of the surface as it is, m."""
        return np.asarray(np.maximum(self.left_after(np.maximum(indentation, 0.0) + before), before))

    def dissipated_by(self, depth: FloatArray) -> FloatArray:
        """Return the work that loading a virgin surface up to indentations, m, and unloading it dissipates, J."""
        return dissipated_by(self.rows, depth / self.length) * (self.force * self.length)


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


@lru_cache(maxsize=256)
def _settled(contact: ElasticPlastic, onset: float, stiffness: float, height: float) -> tuple[FloatArray, float, float]:
    """Return a law for a yield indentation, its static force, and the indentation at rest on a height, all scaled."""
    law = law_rows(contact, onset)
    depth = indentation_at_rest(plastic_bearing(law), 1.0, stiffness, height)
    return law, static_force_of(law, stiffness), float(depth)


def yielding_programs(
    value: Fields, pieces: Sequence[FloatArray], numbers: FloatArray, units: Units, heights: FloatArray
) -> tuple[tuple[Program, ...], FloatArray]:
    """Return the programs of cells whose contacts yield, and their static forces, N.

    Parameters
    ----------
    value
        The scenario and its cells.
    pieces
        Of each cell's path.
    numbers, units
        Of the cells with the elastic part of the contact (cells, NUMBERS); the programs hold these rows, changed.
    heights
        Of the paths at x = 0, m, (cells,).
    """
    scenario, cells = value.scenario, len(numbers)
    kinds, kind_of_cell = value.variants([path for path in value.changed if path.startswith("contact.")])
    contacts: list[Any] = [(scenario.replaced(changes) if changes else scenario).contact for changes in kinds]
    programs, static = list[Program](), np.empty(cells)
    columns = (value("speed"), units.length, units.force, units.contact_constant, units.static_force, heights)
    rows = np.column_stack([np.broadcast_to(column, cells) for column in columns]).tolist()
    for cell, (speed, length, force, constant, elastic_force, height) in enumerate(rows):
        contact, own, at_start = contacts[kind_of_cell[cell]], numbers[cell], height / length
        onset = contact.yield_indentation(constant, scenario.vehicle.wheels, elastic_force)
        law, standing, depth = _settled(contact, onset / length, float(own[contract.STIFFNESS]), at_start)
        static[cell] = standing * force
        own[contract.MEMORY] = float(speed == 0.0)
        if own[contract.DECK_MASS] > 0.0:
            own[contract.PRESTRESS] = standing
        marked = virgin_pieces(pieces[cell], onset)
        if scenario.start == "equilibrium":
            own[contract.START_HEIGHT] = at_start - depth
            if speed == 0.0 and depth > onset / length:
                _loaded_pieces(marked, law, depth, length)
        programs.append(Program(marked, own, law))
    return tuple(programs), static
