"""Sleepers that roll below a wagon, against two finite-element rails on the same rigid sleepers, in Newmark's steps."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

import wheeltapper as wt

from ..finite_rail import FiniteRail

EVEN = wt.tracks.Ballasted(**wt.tracks.Ballasted.example)
ROLL = {"sleeper_roll_inertia": 120.0, "ballast_roll_stiffness": 7e7, "ballast_roll_damping": 2e4, "seat_distance": 1.4}
ROLLING = wt.tracks.Ballasted(**wt.tracks.Ballasted.example | ROLL)
STEP = 1e-5
BAYS, PER_BAY = 64, 12
AXLES = tuple(
    wt.vehicles.Axle(mass=1500.0, inertia=(600.0, 80.0, 600.0), position=-1.9 * i, load=5e4) for i in range(2)
)


def rolled_over(track, method="default", duration=0.04):
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=(), axles=AXLES), contact=wt.Hertz(constant_per_wheel=7e10), track=track,
        irregularity={"left": wt.Corrugation(amplitude=1.5e-4, wavelength=0.4, start=0.05)}, rolling="point",
        profiles=wt.profiles.Cones(), speed=20.0, duration=duration,
    )  # fmt: skip
    return wt.simulate(scene, method)


class TwoRails:
    """Two finite rails, left before right, on sleepers that are rigid from seat to seat."""

    def __init__(self, track, inertia, stiffness, damping, distance):
        self.rail = one = FiniteRail(track, BAYS, PER_BAY)
        seats = one.deflections[::PER_BAY]
        self.top, self.sleepers = seats, seats + 2
        against = np.zeros((2 * one.size, len(seats)))
        against[self.sleepers, np.arange(len(seats))] = 1.0
        against[one.size + self.sleepers, np.arange(len(seats))] = -1.0
        couple = sparse.csr_matrix(against) @ sparse.csr_matrix(against).T  # (left - right)², sleeper by sleeper

        def both(matrix, of_roll, of_half):
            # A rigid body of mass 2h and inertia J has h·(l + r)²/4 + J·(l - r)²/(2d²), two halves h·(l² + r²)/2.
            return sparse.block_diag([matrix, matrix]) + (of_roll / distance**2 - 0.5 * of_half) * couple

        self.mass = both(one.mass, inertia, track.sleeper_mass).tocsc()
        self.stiffness = both(one.stiffness, stiffness, track.ballast_stiffness).tocsc()
        self.damping = both(one.damping, damping, track.ballast_damping).tocsc()

    def loads(self, places, forces):
        """Return the load vector of forces (2, wheelsets) at places (wheelsets,)."""
        out = np.zeros(2 * self.rail.size)
        for side in range(2):
            for place, force in zip(places, forces[side], strict=True):
                nodes, shares, _ = self.rail.load_at(place)
                out[side * self.rail.size + nodes] += shares * force
        return out

    def motion(self, places, forces):
        """Return all unknowns over time (times, unknowns) under forces (times, 2, wheelsets), at first at rest."""
        u = splu(self.stiffness).solve(self.loads(places[0], forces[0]))
        v, a = np.zeros((2, len(u)))
        solver = splu((self.stiffness + 2.0 / STEP * self.damping + 4.0 / STEP**2 * self.mass).tocsc())
        out = [u]
        for place, force in zip(places[1:], forces[1:], strict=True):
            inertia = self.mass @ (4.0 / STEP**2 * u + 4.0 / STEP * v + a) + self.damping @ (2.0 / STEP * u + v)
            new = solver.solve(self.loads(place, force) + inertia)
            change = 4.0 / STEP**2 * (new - u) - 4.0 / STEP * v - a
            v = v + 0.5 * STEP * (a + change)
            u, a = new, change
            out.append(u)
        return np.array(out)


@pytest.mark.slow
def test_two_finite_rails_on_rigid_sleepers_agree():
    record = rolled_over(ROLLING)
    assert len(record.events.time) >= 2
    times = np.arange(round(0.04 / STEP) + 1) * STEP
    forces = record.at(times).normal_force.transpose("time", "side", "wheelset").values
    places = np.add.outer(20.0 * times, [0.0, -1.9])
    rails = TwoRails(EVEN, 120.0, 7e7, 2e4, 1.4)
    found = rails.motion(places, forces).reshape(len(times), 2, rails.rail.size)
    number = np.arange(len(rails.top)) - BAYS // 4
    seats = [0, 1, -2]
    columns = [int(np.flatnonzero(number == seat)[0]) for seat in seats]
    rail, sleeper = found[:, :, rails.top[columns]], found[:, :, rails.sleepers[columns]]
    own = record.track(1.0 / STEP, rail=[0.6 * seat for seat in seats], seat=seats)
    for name, expected in (("rail_displacement", -rail), ("sleeper_displacement", -sleeper)):
        values = own[name].transpose("time", "side", ...).values
        np.testing.assert_allclose(values, expected, rtol=0, atol=2e-3 * np.abs(expected).max(), err_msg=name)
    plain = rolled_over(EVEN).track(1.0 / STEP, seat=seats).sleeper_displacement.transpose("time", "side", ...).values
    assert np.abs(plain + sleeper).max() > 0.05 * np.abs(sleeper).max()  # the roll is felt


def test_an_even_sleeper_of_two_free_halves_is_none():
    """Halves on two seats at ±d/2 roll with J = m·d²/2: so rolls a rigid sleeper with this inertia."""
    same = wt.tracks.Ballasted(**wt.tracks.Ballasted.example, sleeper_roll_inertia=0.5 * EVEN.sleeper_mass * 1.5**2)
    times = np.linspace(0.0, 0.03, 61)
    one, other = (rolled_over(track, duration=0.03).at(times).normal_force for track in (EVEN, same))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-5)


def test_a_wheel_on_one_rail_says_that_its_sleepers_do_not_roll():
    for wheels, said in ((1, True), (2, False)):
        scene = wt.Scenario(
            vehicle=wt.Wheelset(mass=600.0, load=5e4, wheels=wheels), track=ROLLING, speed=0.0, duration=0.01
        )
        assert any("this vehicle runs on one rail" in note for note in wt.simulate(scene).notes) == said


@pytest.mark.slow
def test_a_file_keeps_both_ways(tmp_path):
    record = rolled_over(ROLLING, duration=0.01)
    record.save(tmp_path / "a.nc")
    again = wt.load(tmp_path / "a.nc")
    place = {"rate": 2e3, "rail": [0.1], "seat": [0, 1]}
    one, other = record.track(**place), again.track(**place)
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name], other[name])


@pytest.mark.slow
def test_energy_closes():
    assert float(rolled_over(ROLLING, "strict").energy.relative_imbalance) < 1e-8
