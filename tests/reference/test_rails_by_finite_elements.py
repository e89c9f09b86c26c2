"""A wheel on rails and sleepers against a program of its own: a finite-element rail, and Newmark's small steps."""

from math import sqrt

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

import wheeltapper as wt
from tests.finite_rail import CONSTANT, LOAD, RADIUS, STEP, TRACK, WHEEL, FiniteRail, Newmark

BAYS, PER_BAY = 90, 48
LIMITS = {
    "rail displacement": 2e-4, "rail acceleration": 8e-3, "rail strain": 1e-3, "sleeper displacement": 2e-4,
    "sleeper acceleration": 1e-3, "pad force": 1e-3, "ballast force": 2e-4,
}  # fmt: skip
"""Largest differences, over the largest reading. Linear elements answer each node that a wheel passes by a ripple, here
of 2.4 kHz; accelerations are therefore compared up to 1 kHz."""


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
    run, forces = Newmark(FiniteRail(TRACK, BAYS, PER_BAY), speed, path(0.0)), [LOAD]
    if gauge is not None:
        gauge = Gauge(run.rail, TRACK, *gauge)
    for number in range(1, round(duration / STEP) + 1):
        run.begin()
        forces.append(run.force_on(run.free, path(speed * number * STEP)))
        run.end(forces[-1], run.free)
        if gauge is not None:
            seen.append(gauge.read(run.u, run.v, run.a))
    return STEP * np.arange(len(forces)), np.array(forces)


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


@pytest.mark.few(1)
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
