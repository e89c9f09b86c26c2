"""A finite-element rail on sleepers, and a wheel on it in Newmark's steps.

The rail is long and has ends, its elements are linear, with their shear integrated at the middle; the wheel's force is
solved for in each step. Nothing of it is shared with the package: no Bloch waves, no modes, no events.
"""

from math import sqrt

import numpy as np
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

import wheeltapper as wt

TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example")
MASS, LOAD, CONSTANT, RADIUS = 600.0, 1e5, 9.4125e10, 0.46
STEP = 1e-5
WHEEL = wt.Wheelset(mass=MASS, load=LOAD - 9.81 * MASS, wheels=1, radius=RADIUS)


class FiniteRail:
    """A rail on sleepers: matrices, with the unknowns of each node together, and a sleeper's after its seat.

    `pads` and `ballasts` are factors at seats that differ.
    """

    def __init__(self, track, bays, per_bay, pads=None, ballasts=None):
        rail = track.rail
        self.length = track.spacing / per_bay
        self.shear = rail.shear_stiffness
        self.start = -(bays // 4) * track.spacing
        nodes = bays * per_bay + 1
        seats = np.arange(0, nodes, per_bay)
        before = np.zeros(nodes, dtype=int)
        before[seats[:-1] + 1] = 1
        self.deflections = 2 * np.arange(nodes) + np.cumsum(before)
        self.size = 2 * nodes + len(seats)
        slope = np.array([-1.0, -0.5 * self.length, 1.0, -0.5 * self.length]) / self.length  # w' - θ at the middle
        turn = np.array([0.0, -1.0, 0.0, 1.0]) / self.length
        element = self.length * (self.shear * np.outer(slope, slope) + rail.bending_stiffness * np.outer(turn, turn))
        weights = np.diag([rail.mass_per_length, 7850.0 * rail.bending_stiffness / 210e9])
        stiffness = self._chain(element)
        mass = self._chain(self.length / 6.0 * np.kron([[2.0, 1.0], [1.0, 2.0]], weights))
        top, sleeper = self.deflections[seats], self.deflections[seats] + 2
        number = np.arange(len(seats)) - bays // 4
        share = np.array([(pads or {}).get(int(seat), 1.0) for seat in number])
        own = np.array([(ballasts or {}).get(int(seat), 1.0) for seat in number])
        tied = [self._at(a, b, share) for a, b in ((top, top), (sleeper, sleeper), (top, sleeper), (sleeper, top))]
        held = tied[0] + tied[1] - tied[2] - tied[3]
        ground = self._at(sleeper, sleeper, own)
        self.stiffness = stiffness + track.pad_stiffness * held + track.ballast_stiffness * ground
        self.damping = rail.damping * stiffness + track.pad_damping * held + track.ballast_damping * ground
        self.mass = mass + track.sleeper_mass * self._at(sleeper, sleeper)

    def _chain(self, element):
        ends = np.stack(
            [self.deflections[:-1], self.deflections[:-1] + 1, self.deflections[1:], self.deflections[1:] + 1]
        )
        rows, columns = np.repeat(ends, 4, axis=0), np.tile(ends, (4, 1))
        values = np.repeat(element.reshape(16, 1), ends.shape[1], axis=1)
        return sparse.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(self.size, self.size))

    def _at(self, rows, columns, values=1.0):
        return sparse.csr_matrix((values * np.ones(len(rows)), (rows, columns)), shape=(self.size, self.size))

    def factor(self, matrix):
        """Return Cholesky's factor of a matrix of this band."""
        diagonals = [matrix.diagonal(k) for k in range(6)]
        upper = np.zeros((6, self.size))
        for k, values in enumerate(diagonals):
            upper[5 - k, k:] = values
        return cholesky_banded(upper), False

    def load_at(self, x):
        """Return the two deflections that carry a force at x, their shares, and how the element itself gives."""
        number, share = divmod((x - self.start) / self.length, 1.0)
        nodes = self.deflections[int(number) : int(number) + 2]
        return nodes, np.array([1.0 - share, share]), self.length * share * (1.0 - share) / self.shear


class Newmark:
    """A wheel on a finite rail, from rest under its load at x = 0; its centre begins at `height`, upwards.

    Of the step under way: the rail without the wheel's force (`free`), what a unit of that moves (`unit`), how rail and
    wheel give to it together (`gives`), and the wheel without it (`fallen`).
    """

    def __init__(self, rail, speed, height=0.0):
        self.rail, self.speed, self.number = rail, speed, 0
        nodes, shares, own = rail.load_at(0.0)
        self.u = cho_solve_banded(rail.factor(rail.stiffness), LOAD * self._force(nodes, shares))
        self.v, self.a = np.zeros((2, rail.size))
        sunk = shares @ self.u[nodes] + own * LOAD + (LOAD / CONSTANT) ** (2.0 / 3.0) - height
        self.wheel = np.array([sunk, 0.0, 0.0])
        self.factor = rail.factor(rail.stiffness + 2.0 / STEP * rail.damping + 4.0 / STEP**2 * rail.mass)

    def _force(self, nodes, shares):
        force = np.zeros(self.rail.size)
        force[nodes] = shares
        return force

    def moved_by(self, nodes, shares):
        """Return how far the rail is moved in a step by forces at some unknowns."""
        return cho_solve_banded(self.factor, self._force(nodes, shares), check_finite=False)

    def begin(self):
        """Begin the next step."""
        self.number, rail, h = self.number + 1, self.rail, STEP
        self.nodes, self.shares, own = rail.load_at(self.speed * self.number * h)
        self.free = cho_solve_banded(
            self.factor,
            rail.mass @ (4.0 / h**2 * self.u + 4.0 / h * self.v + self.a) + rail.damping @ (2.0 / h * self.u + self.v),
            check_finite=False,
        )
        self.unit = self.moved_by(self.nodes, self.shares)
        self.gives = self.shares @ self.unit[self.nodes] + own + 0.25 * h**2 / MASS
        self.fallen = self.wheel @ [1.0, h, 0.25 * h**2] + 0.25 * h**2 * LOAD / MASS

    def force_on(self, rail, height=0.0):
        """Return the contact's force where the rail would be so without it, and the path so high."""
        return contact_force(self.fallen + height - self.shares @ rail[self.nodes], self.gives)

    def end(self, pressed, rail):
        """End the step with the wheel's force, and the rail as it is without that."""
        h = STEP
        new = rail + pressed * self.unit
        change = 4.0 / h**2 * (new - self.u) - 4.0 / h * self.v - self.a
        self.v += 0.5 * h * (self.a + change)
        self.u, self.a = new, change
        fall = (LOAD - pressed) / MASS
        place = self.wheel[0] + h * self.wheel[1] + 0.25 * h**2 * (self.wheel[2] + fall)
        self.wheel = np.array([place, self.wheel[1] + 0.5 * h * (self.wheel[2] + fall), fall])


def contact_force(overlap, gives):
    """Return N of δ + gives·N = overlap, N = C·δ^1.5 and never negative."""
    if overlap <= 0.0:
        return 0.0
    root = sqrt(overlap)  # of δ
    for _ in range(60):
        change = (root**2 + gives * CONSTANT * root**3 - overlap) / (2.0 * root + 3.0 * gives * CONSTANT * root**2)
        root -= change
        if abs(change) < 1e-13 * root:
            return CONSTANT * root**3
    raise AssertionError(overlap)
