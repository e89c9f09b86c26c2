"""Marks of plastic contacts on a rail: the largest indentation of each place so far, and the pieces of a path over it.

samples  The largest indentation of the virgin surface so far, at close places.
means    Means of the samples within one interval.
splines  Cubic B-splines of the means: twice continuously differentiable, and within the range of the means.
pieces   Path, residual indentation and yield indentation follow from the splines. The factor on the elastic force is
         interpolated; with it the elastic force meets the plastic law at the yield indentation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.plastic import PlasticLaw, loading_force
from wheeltapper.lower.paths.table import PathTable, row_values
from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TO_POWERS = np.array([[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]]) / 6.0
"""Matrix from the coefficients of four neighbouring cubic B-splines to the coefficients of powers. The variable of
these is the place in the interval that the four share, from 0 to 1."""
BEFORE = 2
"""Number of intervals before the place of the first mean into which its B-spline reaches."""
FACTOR_NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(5) / 4.0)
"""Places in an interval, from 0 to 1, at which the factor on the contact force is computed."""
TO_FACTOR = np.linalg.inv(np.vander(FACTOR_NODES, increasing=True))
SAMPLES = 4
"""Usual number of samples of a mark per interval."""
SEMI_AXIS = 2
"""Number of intervals per semi-axis of the patch. A cubic B-spline, four intervals wide, is then as wide as the patch
is long."""


VIRGIN = Note(
    'each wheel finds the rail without the marks of the wheels before it; with rolling="point" it meets them',
    "virgin rail",
)
"""What several wheels that yield do where they roll as circles."""


@dataclass(frozen=True)
class Surface:
    """The running surface of a rail from x = 0 on.

    Attributes
    ----------
    borne
        Indentation beyond which each sample yields, relative to the virgin surface, m; sample i lies at (i +
        1/2)·spacing.
    left
        Permanent indentation of each sample, of rail and wheels together, m.
    interval
        Spacing of the means, m.
    onset
        Indentation at which the virgin surface yields, m.
    per_interval
        Number of samples per mean.
    """

    borne: FloatArray
    left: FloatArray
    interval: float
    onset: float
    per_interval: int

    @classmethod
    def virgin_surface(cls, length: float, semi_axis: float, onset: float, per_interval: int) -> Surface:
        """Return a virgin surface of at least this length (m), for patches with this semi-axis (m)."""
        interval = semi_axis / SEMI_AXIS
        samples = int(np.ceil(length / interval)) * per_interval
        return cls(np.full(samples, onset), np.zeros(samples), interval, onset, per_interval)

    @property
    def sample_spacing(self) -> float:
        """Spacing of the samples, m."""
        return self.interval / self.per_interval

    @property
    def sample_positions(self) -> FloatArray:
        """Places of the samples, m."""
        return np.asarray((np.arange(len(self.borne)) + 0.5) * self.sample_spacing, dtype=np.float64)

    @property
    def spline_breaks(self) -> FloatArray:
        """Borders of the intervals on which the splines are polynomials, m."""
        count = len(self.borne) // self.per_interval
        return np.asarray((np.arange(-BEFORE, count + BEFORE) + 0.5) * self.interval, dtype=np.float64)

    def mean_spline(self, samples: FloatArray, outside: float) -> FloatArray:
        """Return the splines of the means, (breaks - 1, 4): powers of the place in each interval, from 0 to 1."""
        means = samples.reshape(-1, self.per_interval).mean(axis=1)
        padded = np.concatenate([np.full(3, outside), means, np.full(3, outside)])
        return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, 4) @ TO_POWERS.T, dtype=np.float64)

    def interval_of(self, x: FloatArray) -> IntArray:
        """Return the interval in which each place (m) lies; outside the splines it is negative or too large."""
        return np.asarray(np.floor(x / self.interval - 0.5).astype(np.int64) + BEFORE)

    def spline_at(self, splines: FloatArray, x: FloatArray) -> FloatArray:
        """Return splines at places, m."""
        piece = np.clip(self.interval_of(x), 0, len(splines) - 1)
        share = x / self.interval - 0.5 + BEFORE - piece
        c = splines[piece].T
        return np.asarray(c[0] + share * (c[1] + share * (c[2] + share * c[3])), dtype=np.float64)

    def yield_reached(self, first: int, depths: FloatArray) -> FloatArray:
        """Return the new yield indentation of the samples from `first` on, m, under given indentations."""
        behind = slice(first, first + len(depths))
        bore = self.spline_at(self.mean_spline(self.borne, self.onset), self.sample_positions[behind])
        return np.asarray(self.borne[behind] + np.maximum(depths - bore, 0.0))

    def after_yielding(self, first: int, reached: FloatArray, law: PlasticLaw, hardening: float) -> Surface:
        """Return the surface after its samples have yielded.

        Parameters
        ----------
        first, reached
            Result of `reached` for the samples from `first` on.
        law
            The plastic law.
        hardening
            1: a sample yields again only beyond its largest indentation so far. 0: it yields as early as a virgin one.
        """
        behind = slice(first, first + len(reached))
        borne, left = self.borne.copy(), self.left.copy()
        left[behind] += law.left_after(reached) - law.left_after(borne[behind])
        borne[behind] = np.maximum(borne[behind], self.onset + hardening * (reached - self.onset))
        return replace(self, borne=borne, left=left)

    def settled_indentation(self) -> FloatArray:
        """Return the permanent indentation at the samples, averaged over the patch as the wheels meet it, m."""
        return self.spline_at(self.mean_spline(self.left, 0.0), self.sample_positions)


class MarkedPath:
    """The pieces of a path over a rail with marks. Borders and the path without marks are computed once.

    Parameters
    ----------
    table
        The path over the rail without marks.
    surface
        A surface; its intervals cut the path.
    end
        Position up to which the path is needed, m.
    """

    def __init__(self, table: PathTable, surface: Surface, end: float) -> None:
        base = _unrolled_pieces(table, end)
        borders = np.unique(
            np.concatenate([[base[0, contract.START]], base[1:, contract.START], surface.spline_breaks])
        )
        borders = borders[(borders >= base[0, contract.START]) & (borders < base[-1, contract.STOP])]
        near = np.diff(borders, prepend=-np.inf) > 1e-12
        borders = borders[near]
        stops = np.append(borders[1:], base[-1, contract.STOP])
        owner = np.clip(np.searchsorted(base[:, contract.START], borders + 1e-12, side="right") - 1, 0, len(base) - 1)
        middle = np.where(np.isfinite(stops), 0.5 * (borders + stops), borders)
        self._interval = surface.interval_of(middle)
        self._inside = (self._interval >= 0) & (self._interval < len(surface.spline_breaks) - 1)
        centre = np.asarray((self._interval - BEFORE + 0.5) * surface.interval, dtype=np.float64)
        rows = np.zeros((len(borders), contract.MARKED_COLUMNS))
        rows[:, : contract.PIECE_COLUMNS] = _recentred_pieces(base[owner], centre, surface.interval)
        rows[:, contract.START], rows[:, contract.STOP] = borders, stops
        rows[:, contract.JOIN] = np.where(
            borders == base[owner, contract.START], base[owner, contract.JOIN], contract.SOFT
        )
        rows[:, contract.BEARS] = surface.onset
        self._rows, self._base, self._owner = rows, base, owner

    def pieces_over(self, surface: Surface, law: PlasticLaw, share: float) -> FloatArray:
        """Return the pieces over a given state of the surface.

        Parameters
        ----------
        surface
            A surface with the same intervals.
        law
            The plastic law.
        share
            Share of the permanent indentation that belongs to the rail.
        """
        rows = self._rows.copy()
        inside = np.flatnonzero(self._inside)
        left = surface.mean_spline(surface.left, 0.0)[self._interval[inside]]
        marked = np.any(left != 0.0, axis=1)
        deeper = inside[marked]
        rows[deeper, contract.COEFFICIENT : contract.COEFFICIENT + 4] -= share * left[marked]
        rows[deeper, contract.DEGREE] = np.maximum(rows[deeper, contract.DEGREE], 3.0)
        r = surface.mean_spline(law.left_after(surface.borne), 0.0)[self._interval[inside]]
        b = surface.mean_spline(surface.borne, surface.onset)[self._interval[inside]]
        hardened = np.any(r != 0.0, axis=1)
        marked, r, b = inside[hardened], r[hardened], b[hardened]
        rows[marked, contract.RESIDUAL : contract.RESIDUAL + 4] = r
        rows[marked, contract.RESIDUAL_DEGREE] = 3.0
        rows[marked, contract.BEARS : contract.BEARS + 4] = b - r
        rows[marked, contract.BEARS_DEGREE] = 3.0
        powers = FACTOR_NODES[:, None] ** np.arange(4)
        carried, remains = b @ powers.T / law.length, r @ powers.T / law.length
        factor = loading_force(law.rows, carried) / (carried - remains) ** 1.5
        rows[marked, contract.FACTOR : contract.FACTOR + len(FACTOR_NODES)] = factor @ TO_FACTOR.T
        rows[marked, contract.FACTOR_DEGREE] = len(FACTOR_NODES) - 1.0
        return rows

    def shortened_pieces(self, surface: Surface, law: PlasticLaw, share: float) -> FloatArray:
        """Return the same pieces, but uncut where there are no marks."""
        rows = self.pieces_over(surface, law, share)
        marked = np.any(rows != self._rows, axis=1)
        begins = np.append(True, np.diff(self._owner) != 0) | marked | np.append(False, marked[:-1])
        plain = ~marked
        out, base = rows.copy(), self._base[self._owner[plain]]
        out[plain] = 0.0
        out[plain, : contract.PIECE_COLUMNS] = base
        out[plain, contract.BEARS] = surface.onset
        for column in (contract.START, contract.JOIN):
            out[:, column] = rows[:, column]
        kept = np.asarray(out[begins])
        kept[:, contract.STOP] = np.append(kept[1:, contract.START], rows[-1, contract.STOP])
        return kept


def height_at(row: FloatArray, x: float) -> float:
    """Return the height of a piece at a place, m."""
    return float(row_values(row[None, : contract.PIECE_COLUMNS], np.array([x]))[0])


def marks_at(row: FloatArray, x: float) -> tuple[float, float, float]:
    """Return residual indentation (m), yield indentation (m), and the elastic factor of a piece at a place."""
    powers = ((x - row[contract.CENTRE]) / row[contract.SCALE]) ** np.arange(contract.TERMS)
    columns = (contract.RESIDUAL, contract.BEARS, contract.FACTOR)
    residual, bears, factor = (float(row[first : first + contract.TERMS] @ powers) for first in columns)
    return residual, bears, factor if row[contract.FACTOR_DEGREE] >= 0 else 1.0


def _unrolled_pieces(table: PathTable, end: float) -> FloatArray:
    """Return the pieces of a path with its periods written out up to a place."""
    if not table.period:
        return table.rows
    rounds = int(np.ceil(max(end - table.rows[-1, contract.STOP], 0.0) / table.period)) + 1
    again = table.rows[table.loop :].copy()
    again[0, contract.JOIN] = table.loop_join
    out = [table.rows]
    for k in range(1, rounds + 1):
        moved = again.copy()
        moved[:, [contract.START, contract.STOP, contract.CENTRE]] += k * table.period
        out.append(moved)
    return np.vstack(out)


def _recentred_pieces(rows: FloatArray, centre: FloatArray, scale: float) -> FloatArray:
    """Return the same pieces as functions of (x - centre)/scale."""
    out = rows.copy()
    away = centre - rows[:, contract.CENTRE]
    at, rate = away / rows[:, contract.SCALE], scale / rows[:, contract.SCALE]
    for first in (contract.COEFFICIENT, contract.FACTOR):
        c = rows[:, first : first + contract.TERMS].copy()
        for i in range(contract.MAX_DEGREE):
            for k in range(contract.MAX_DEGREE - 1, i - 1, -1):
                c[:, k] += at * c[:, k + 1]
        out[:, first : first + contract.TERMS] = c * rate[:, None] ** np.arange(contract.TERMS)
    phase = rows[:, contract.WAVENUMBER] * away
    sine, cosine = rows[:, contract.SINE], rows[:, contract.COSINE]
    out[:, contract.SINE] = sine * np.cos(phase) - cosine * np.sin(phase)
    out[:, contract.COSINE] = sine * np.sin(phase) + cosine * np.cos(phase)
    out[:, contract.CENTRE], out[:, contract.SCALE] = centre, scale
    return out
