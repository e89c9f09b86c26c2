"""Anomalies of a track against the program of finite elements: hanging sleeper, void, missing pad, random ballast.

Newmark's small steps; the force below a void is solved for in each, with that of the wheel. Nothing of it is shared
with the package but the random numbers.
"""

import numpy as np
import pytest

import wheeltapper as wt
from tests.finite_rail import CONSTANT, LOAD, STEP, TRACK, WHEEL, FiniteRail, Newmark

BAYS, PER_BAY, SPEED, DURATION, SEAT = 48, 48, 30.0, 0.065, 2
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
    run = Newmark(FiniteRail(TRACK, BAYS, PER_BAY, pads, ballasts), SPEED)
    sleeper = run.rail.deflections[round((SEAT * TRACK.spacing - run.rail.start) / run.rail.length)] + 2
    lifted = run.moved_by(sleeper, -1.0)  # by a unit force below the sleeper
    found, below = [(LOAD, run.u[sleeper], 0.0)], 0.0
    for _ in range(round(DURATION / STEP)):
        run.begin()
        for _ in range(50):
            pressed = run.force_on(run.free + below * lifted)
            before = below
            if void is not None:
                deflected = run.free[sleeper] + pressed * run.unit[sleeper]
                below = ballast_force(deflected, lifted[sleeper], run.u[sleeper], run.v[sleeper], void)
            if abs(below - before) < 1e-6:
                break
        run.end(pressed, run.free + below * lifted)
        found.append((pressed, run.u[sleeper], below))
    return STEP * np.arange(len(found)), *np.array(found).T


def ballast_force(free, lifted, before, speed, void):
    """Return F = k·(s - void) + c·s' where both it and s - void are positive, else 0; s is `free` + F·`lifted`."""
    k, c = TRACK.ballast_stiffness, TRACK.ballast_damping
    rate = 2.0 / STEP  # s' = rate·(s - before) - speed
    pressed = (k * (free - void) + c * (rate * (free - before) - speed)) / (1.0 - (k + c * rate) * lifted)
    return pressed if pressed > 0.0 and free + pressed * lifted > void else 0.0


@pytest.mark.few(1)
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
