"""Hunt-Crossley's force, held at zero where it would pull, against Runge-Kutta steps of 0.1 us of the same equations.

Written from the equations of motion alone; it shares no code with the package.
"""

from dataclasses import dataclass
from math import cos, pi, sin

import numba
import numpy as np
import pytest

import wheeltapper as wt

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
STEP = 1e-7
G = 9.81


@numba.njit
def path(t, bump, height, length, start, speed):
    """Height and velocity of the bump or the corrugation under the wheel."""
    x = speed * t - start
    k = 2 * pi / length
    if x < 0.0 or (bump and x > length):
        return 0.0, 0.0
    if bump:
        return 0.5 * height * (1 - cos(k * x)), 0.5 * height * k * speed * sin(k * x)
    return height * sin(k * x), height * k * speed * cos(k * x)


@numba.njit
def touch(t, s, on_deck, constant, chi, shape):
    """Force, and what is positive just where there is a force."""
    height, rise = path(t, *shape)
    d = height - s[0] + (s[2] if on_deck else 0.0)
    grip = 1.0 + chi * (rise - s[1] + (s[3] if on_deck else 0.0))
    if d <= 0.0 or grip <= 0.0:
        return 0.0, min(d * 1e4, grip)
    return constant * d**1.5 * grip, min(d * 1e4, grip)


@numba.njit
def rates(t, s, out, wheel, deck, static, constant, chi, shape):
    mass, load, stiffness, damping = wheel
    force, _ = touch(t, s, deck[0] > 0.0, constant, chi, shape)
    out[0] = s[1]
    out[1] = (force - load - mass * G - stiffness * s[0] - damping * s[1]) / mass
    out[2] = 0.0
    out[3] = 0.0
    if deck[0] > 0.0:
        out[2] = s[3]
        out[3] = (static - force - deck[1] * s[2] - deck[2] * s[3]) / deck[0]


@numba.njit
def march(y0, static, end, wheel, deck, constant, chi, shape):
    """Times at which the force ends (-) and begins (+), and the largest force between them."""
    s = np.array([y0, 0.0, 0.0, 0.0])
    k1, k2, k3, k4 = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4)
    times, largest = [], []
    force, held = touch(0.0, s, deck[0] > 0.0, constant, chi, shape)
    top = force
    for n in range(int(end / STEP)):
        t = n * STEP
        rates(t, s, k1, wheel, deck, static, constant, chi, shape)
        rates(t + 0.5 * STEP, s + 0.5 * STEP * k1, k2, wheel, deck, static, constant, chi, shape)
        rates(t + 0.5 * STEP, s + 0.5 * STEP * k2, k3, wheel, deck, static, constant, chi, shape)
        rates(t + STEP, s + STEP * k3, k4, wheel, deck, static, constant, chi, shape)
        s = s + STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        before = held
        force, held = touch(t + STEP, s, deck[0] > 0.0, constant, chi, shape)
        if (held > 0.0) != (before > 0.0):
            at = t + STEP * before / (before - held)
            times.append(at if held > 0.0 else -at)
            largest.append(top)
            top = 0.0
        top = max(top, force)
    largest.append(top)
    return np.array(times), np.array(largest)


@dataclass
class Case:
    scene: wt.Scenario
    deck: tuple[float, float, float]
    shape: tuple[bool, float, float, float, float]

    def peer(self):
        v = self.scene.vehicle
        constant = self.scene.contact.constant
        weight = v.load + v.mass * G
        d = (weight / constant) ** (2 / 3)
        for _ in range(60):
            d = ((weight - v.stiffness * d) / constant) ** (2 / 3) if v.stiffness * d < weight else 0.5 * d
        wheel = (v.mass, v.load, v.stiffness, v.damping)
        chi = self.scene.contact.hysteresis_factor
        static = constant * d**1.5
        return march(-d, static, self.scene.duration, wheel, self.deck, constant, chi, self.shape)


def drawn(rng):
    """A wheel with strong material damping on something that throws it."""
    bump, on_deck = bool(rng.integers(2)), rng.uniform() < 0.3
    speed, start = rng.uniform(4, 25), 0.01
    height = float(rng.choice([-1, 1]) * rng.uniform(5e-5, 3e-4) if bump else rng.uniform(1e-5, 6e-5))
    length = float(rng.uniform(0.03, 0.15))
    deck = (float(rng.uniform(800, 8000)), float(rng.uniform(1e7, 2e8)), float(rng.uniform(0, 5e4)))
    scene = wt.Scenario(
        vehicle=wt.Wheelset(
            mass=float(rng.uniform(800, 2000)), load=float(rng.uniform(4e4, 1.2e5)),
            stiffness=float(rng.uniform(0, 4e6)), damping=float(rng.uniform(0, 1e5)), gravity=G,
        ),
        track=wt.FloatingDeck(mass=deck[0], stiffness=deck[1], damping=deck[2]) if on_deck else wt.StiffTrack(),
        contact=wt.Hertz(
            constant=float(rng.uniform(5e10, 2e11)), restitution=float(rng.uniform(0.1, 0.7)),
            impact_speed=float(rng.uniform(0.03, 0.3)),
        ),
        irregularity=(
            wt.CosineBump(height=height, length=length, start=start) if bump
            else wt.Corrugation(amplitude=height, wavelength=length, start=start)
        ),
        rolling="point", speed=float(speed), duration=0.03,
    )  # fmt: skip
    return Case(scene, deck if on_deck else (0.0, 0.0, 0.0), (bump, height, length, start, float(speed)))


def check(case):
    """Compare a case; return False where events lie too near each other for steps of 0.1 us."""
    record = wt.simulate(case.scene)
    times, kinds = record.events.time.values, record.events.kind.values
    if len(times) and np.diff(times, prepend=-1.0, append=1.0).min() < 5e-6:
        return False
    expected, largest = case.peer()
    assert len(times) == len(expected)
    np.testing.assert_array_equal(kinds == "impact", expected > 0)
    np.testing.assert_allclose(times, np.abs(expected), rtol=0, atol=2e-7)
    borders = np.concatenate([[0.0], times, [record.end]])
    peaks = record.peaks.normal_force.values
    for i, kind in enumerate(["impact", *kinds]):
        among = (record.peaks.time.values > borders[i]) & (record.peaks.time.values < borders[i + 1])
        if kind == "loss":
            assert largest[i] == 0
            assert not among.any()
        elif 0 < i < len(kinds):
            # At the kink where a corrugation begins the force jumps, and small steps err in proportion to their length.
            assert abs(peaks[among].max() - largest[i]) < 1e-5 * largest[i] + 1e-7 * record.static_force
    return True


@pytest.mark.slow
def test_losses_and_impacts_while_indented_are_those_of_small_steps():
    rng = np.random.default_rng(7)
    assert sum(check(drawn(rng)) for _ in range(8)) >= 6


@pytest.mark.whole
@pytest.mark.slow
def test_losses_and_impacts_while_indented_are_those_of_small_steps_in_a_hundred_cases():
    rng = np.random.default_rng(8)
    assert sum(check(drawn(rng)) for _ in range(110)) >= 100
