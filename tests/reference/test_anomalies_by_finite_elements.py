"""Anomalies of a track against the program of finite elements: hanging sleeper, void, missing pad, random ballast.

Newmark's small steps; the force below a void is solved for in each, with that of the wheel. Nothing of it is shared
with the package but the random numbers.
"""

import numpy as np
import pytest
from scipy.linalg import cho_solve_banded

import wheeltapper as wt

from .test_rails_by_finite_elements import CONSTANT, LOAD, MASS, TRACK, WHEEL, FiniteRail, contact_force

BAYS, PER_BAY, STEP, SPEED, DURATION, SEAT = 48, 48, 1e-5, 30.0, 0.065, 2
SCATTERED = wt.tracks.Scatter(ballast=0.3, seed=5)
RANDOM = {change.seat: change.ballast for change in SCATTERED.changes(range(-12, 37))}
CASES = {
    "hanging": (wt.tracks.HangingSleeper(seat=SEAT), {}, {SEAT: 0.0}, None),
    "void": (wt.tracks.HangingSleeper(seat=SEAT, void="0.25 mm"), {}, {SEAT: 0.0}, 0.25e-3),
    "missing pad": (wt.tracks.MissingPad(seat=SEAT), {SEAT: 0.0}, {}, None),
    "random ballast": (SCATTERED, {}, RANDOM, None),
}


def newmark_motion(pads, ballasts, void):
    """Return times, the wheel's force, the sleeper's deflection and the force below its void."""
    rail, h = FiniteRail(TRACK, BAYS, PER_BAY, pads, ballasts), STEP
    nodes, shares, own = rail.load_at(0.0)
    force = np.zeros(rail.size)
    force[nodes] = shares * LOAD
    u = cho_solve_banded(rail.factor(rail.stiffness), force)
    v, a = np.zeros((2, rail.size))
    wheel = np.array([shares @ u[nodes] + own * LOAD + (LOAD / CONSTANT) ** (2.0 / 3.0), 0.0, 0.0])
    factor = rail.factor(rail.stiffness + 2.0 / h * rail.damping + 4.0 / h**2 * rail.mass)
    sleeper = rail.deflections[round((SEAT * TRACK.spacing - rail.start) / rail.length)] + 2
    force[:] = 0.0
    force[sleeper] = -1.0
    lifted = cho_solve_banded(factor, force)  # by a unit force below the sleeper
    found, below = [(LOAD, u[sleeper], 0.0)], 0.0
    for number in range(1, round(DURATION / h) + 1):
        nodes, shares, own = rail.load_at(SPEED * number * h)
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
        for _ in range(50):
            pressed = contact_force(fallen - shares @ (free[nodes] + below * lifted[nodes]), gives)
            before = below
            if void is not None:
                deflected = free[sleeper] + pressed * unit[sleeper]
                below = ballast_force(deflected, lifted[sleeper], u[sleeper], v[sleeper], void)
            if abs(below - before) < 1e-6:
                break
        new = free + pressed * unit + below * lifted
        change = 4.0 / h**2 * (new - u) - 4.0 / h * v - a
        v += 0.5 * h * (a + change)
        u, a = new, change
        found.append((pressed, u[sleeper], below))
        fall = (LOAD - pressed) / MASS
        place = wheel[0] + h * wheel[1] + 0.25 * h**2 * (wheel[2] + fall)
        wheel = np.array([place, wheel[1] + 0.5 * h * (wheel[2] + fall), fall])
    return h * np.arange(len(found)), *np.array(found).T


def ballast_force(free, lifted, before, speed, void):
    """Return F = k·(s - void) + c·s' where both it and s - void are positive, else 0; s is `free` + F·`lifted`."""
    k, c = TRACK.ballast_stiffness, TRACK.ballast_damping
    rate = 2.0 / STEP  # s' = rate·(s - before) - speed
    pressed = (k * (free - void) + c * (rate * (free - before) - speed)) / (1.0 - (k + c * rate) * lifted)
    return pressed if pressed > 0.0 and free + pressed * lifted > void else 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_force_and_sleeper_are_those_of_finite_elements(name):
    anomaly, pads, ballasts, void = CASES[name]
    times, force, sleeper, below = newmark_motion(pads, ballasts, void)
    scene = wt.Scenario(
        vehicle=WHEEL, track=TRACK.model_copy(update={"anomalies": (anomaly,)}), contact=wt.Hertz(constant=CONSTANT),
        speed=SPEED, duration=DURATION,
    )  # fmt: skip
    record = wt.simulate(scene)
    late = times > 0.015
    own = record.at(times).normal_force.values
    assert np.ptp(force[late]) > 0.02 * LOAD
    np.testing.assert_allclose(own[late], force[late], atol=2e-3 * LOAD)
    seat = record.track(1.0 / STEP, seat=[SEAT]).sel(seat=SEAT).isel(time=slice(len(times)))
    deepest = np.abs(sleeper).max()
    np.testing.assert_allclose(-seat.sleeper_displacement.values[late], sleeper[late], atol=1e-3 * deepest + 1e-7)
    if void is not None:
        changes = times[1:][(below[1:] > 0.0) != (below[:-1] > 0.0)]
        assert record.events.kind.values.tolist() == ["void closes", "void opens"][: len(changes)]
        np.testing.assert_allclose(record.events.time, changes, atol=2.0 * STEP)
        np.testing.assert_allclose(record.events.position, SEAT * TRACK.spacing)
        np.testing.assert_allclose(seat.ballast_force.values[late], below[late], atol=5e-3 * below.max())
