"""A wheel on rails and sleepers against a program of its own: a finite-element rail, and Newmark's small steps.

The rail is long and has ends, its elements are linear, with their shear integrated at the middle; the wheel's force is
solved for in each step. Nothing of it is shared with the package: no Bloch waves, no modes, no events.
"""

from math import sqrt

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.signal import butter, sosfiltfilt

import wheeltapper as wt

TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example")
MASS, LOAD, CONSTANT, RADIUS = 600.0, 1e5, 9.4125e10, 0.46
BAYS, PER_BAY, STEP = 90, 48, 1e-5
LIMITS = {
    "rail displacement": 2e-4, "rail acceleration": 8e-3, "rail strain": 1e-3, "sleeper displacement": 2e-4,
    "sleeper acceleration": 1e-3, "pad force": 1e-3, "ballast force": 2e-4,
}  # fmt: skip
"""Largest differences, over the largest reading. Linear elements answer each node that a wheel passes by a ripple, here
of 2.4 kHz; accelerations are therefore compared up to 1 kHz."""
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


class Gauge:
    """Readings of a place of the rail and a seat: deflections and accelerations downwards, strain, and forces."""

    def __init__(self, rail, track, x, seat):
        node = round((x - rail.start) / rail.length)
        self.track, self.bends = track, -track.rail.foot_distance / (2.0 * rail.length)
        self.place = rail.deflections[node]
        self.turns = rail.deflections[[node + 1, node - 1]] + 1
        self.top = rail.deflections[round((seat * track.spacing - rail.start) / rail.length)]

    def read(self, u, v, a):
        track, sleeper = self.track, self.top + 2
        pad = track.pad_stiffness * (u[self.top] - u[sleeper]) + track.pad_damping * (v[self.top] - v[sleeper])
        ballast = track.ballast_stiffness * u[sleeper] + track.ballast_damping * v[sleeper]
        strain = self.bends * (u[self.turns[0]] - u[self.turns[1]])
        return u[self.place], a[self.place], strain, u[sleeper], a[sleeper], pad, ballast


def newmark_forces(path, speed, duration, gauge=None, seen=None):
    """Return times and forces of the wheel, from rest under its load at x = 0; `path` is its centre's, upwards.

    A gauge at a place and a seat writes what it reads to `seen`.
    """
    rail, h = FiniteRail(TRACK, BAYS, PER_BAY), STEP
    if gauge is not None:
        gauge = Gauge(rail, TRACK, *gauge)
    nodes, shares, own = rail.load_at(0.0)
    force = np.zeros(rail.size)
    force[nodes] = shares * LOAD
    u = cho_solve_banded(rail.factor(rail.stiffness), force)
    v, a = np.zeros((2, rail.size))
    sunk = shares @ u[nodes] + own * LOAD + (LOAD / CONSTANT) ** (2.0 / 3.0) - path(0.0)
    wheel = np.array([sunk, 0.0, 0.0])
    factor = rail.factor(rail.stiffness + 2.0 / h * rail.damping + 4.0 / h**2 * rail.mass)
    forces = [LOAD]
    for number in range(1, round(duration / h) + 1):
        nodes, shares, own = rail.load_at(speed * number * h)
        free = cho_solve_banded(
            factor,
            rail.mass @ (4.0 / h**2 * u + 4.0 / h * v + a) + rail.damping @ (2.0 / h * u + v),
            check_finite=False,
        )
        force[:] = 0.0
        force[nodes] = shares
        unit = cho_solve_banded(factor, force, check_finite=False)
        gives = shares @ unit[nodes] + own + 0.25 * h**2 / MASS
        fallen = wheel @ [1.0, h, 0.25 * h**2] + 0.25 * h**2 * LOAD / MASS
        forces.append(contact_force(fallen + path(speed * number * h) - shares @ free[nodes], gives))
        new = free + forces[-1] * unit
        change = 4.0 / h**2 * (new - u) - 4.0 / h * v - a
        v += 0.5 * h * (a + change)
        u, a = new, change
        if gauge is not None:
            seen.append(gauge.read(u, v, a))
        fall = (LOAD - forces[-1]) / MASS
        place = wheel[0] + h * wheel[1] + 0.25 * h**2 * (wheel[2] + fall)
        wheel = np.array([place, wheel[1] + 0.5 * h * (wheel[2] + fall), fall])
    return h * np.arange(len(forces)), np.array(forces)


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


def flat_path(length, position):
    """Return the path of the centre over a fresh flat."""

    def path(x):
        left = 0.5 * length - abs(x - position)
        return -(left**2) / (RADIUS + sqrt(RADIUS**2 - left**2)) if left > 0.0 else 0.0

    return path


def dip_path(depth, length, start):
    def path(x):
        return -0.5 * depth * (1.0 - np.cos(2.0 * np.pi * (x - start) / length)) if start < x < start + length else 0.0

    return path


def simulated(irregularity, speed, duration, rolling, method="default"):
    scene = wt.Scenario(
        vehicle=WHEEL, track=TRACK, contact=wt.Hertz(constant=CONSTANT), irregularity=irregularity, speed=speed,
        duration=duration, rolling=rolling,
    )  # fmt: skip
    return wt.simulate(scene, method)


def largest_maxima(times, forces, after, count):
    """Return times and heights of the largest maxima, parabolas through their highest samples, in order of time."""
    i = np.flatnonzero((forces[1:-1] > forces[:-2]) & (forces[1:-1] >= forces[2:]) & (times[1:-1] > after)) + 1
    i = np.sort(i[np.argsort(forces[i])[-count:]])
    before, here, behind = forces[i - 1], forces[i], forces[i + 1]
    shift = 0.5 * (before - behind) / (before - 2.0 * here + behind)
    return times[i] + shift * (times[1] - times[0]), here - 0.25 * (before - behind) * shift


@pytest.mark.slow
def test_the_blow_of_a_flat_on_the_track():
    speed, duration, position = 20.0, 0.075, 1.2
    times, forces = newmark_forces(flat_path(0.04, position), speed, duration)
    record = simulated(wt.WheelFlat(length=0.04, position=position, repeat=False), speed, duration, "circle", "strict")
    largest = forces.max()
    assert record.events.kind.values.tolist() == ["loss", "impact"]
    air = times[(forces == 0.0)]
    np.testing.assert_allclose(record.events.time, [air[0], air[-1] + STEP], atol=1.5 * STEP)
    found = record.at(times).normal_force.values.ravel()
    np.testing.assert_allclose(found[times > 0.02], forces[times > 0.02], atol=2.5e-3 * largest)
    when, peaks = largest_maxima(times, forces, 0.055, 5)
    own = record.peaks.where(record.peaks.time > 0.055, drop=True)
    for time, peak in zip(when, peaks, strict=True):
        near = int(np.abs(own.time.values - time).argmin())
        assert own.time.values[near] == pytest.approx(time, abs=1.5e-5)
        assert own.normal_force.values[near] == pytest.approx(peak, rel=1.5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["default", "strict"])
def test_a_smooth_dip_of_the_rail(method):
    speed, duration = 30.0, 0.08
    dip = wt.CosineBump(height=-1.5e-3, length=1.0, start=0.9)
    times, forces = newmark_forces(dip_path(1.5e-3, 1.0, 0.9), speed, duration)
    record = simulated(dip, speed, duration, "point", method)
    found = record.at(times).normal_force.values.ravel()
    assert forces.max() > 1.2 * LOAD
    np.testing.assert_allclose(found[times > 0.01], forces[times > 0.01], atol=2e-3 * LOAD)


@pytest.mark.slow
def test_gauges_on_rail_and_sleeper_read_what_finite_elements_do():
    """A dip of the rail, which excites nothing beyond the cut-off; the wheel ends 0.3 m from the gauge."""
    speed, duration, x, seat = 30.0, 0.08, 2.7, 4
    seen = []
    dip = wt.CosineBump(height=-1.5e-3, length=1.0, start=0.9)
    times, _ = newmark_forces(dip_path(1.5e-3, 1.0, 0.9), speed, duration, (x, seat), seen)
    own = simulated(dip, speed, duration, "point", "strict").track(1.0 / STEP, rail=[x], seat=[seat])
    rail, seats = own.sel(rail=x), own.sel(seat=seat)
    found = [
        -rail.rail_displacement, -rail.rail_acceleration, rail.rail_strain, -seats.sleeper_displacement,
        -seats.sleeper_acceleration, seats.pad_force, seats.ballast_force,
    ]  # fmt: skip
    quiet, compared = butter(4, 1e3, fs=1.0 / STEP, output="sos"), slice(1500, -1500)  # 15 ms of start and of filter
    for (name, limit), one, expected in zip(LIMITS.items(), found, np.array(seen).T, strict=True):
        pair = np.stack([one.values[1 : len(times)], expected])
        if name.endswith("acceleration"):
            pair = sosfiltfilt(quiet, pair)
        here, there = pair[:, compared]
        assert np.abs(here - there).max() < limit * np.abs(there).max(), name
