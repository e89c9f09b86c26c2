"""Runs on rails that end within an irregularity: they are the beginning of longer ones."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ground.outcome import Outcome

TRACK = wt.tracks.Slab(**wt.tracks.Slab.example, cutoff=1500, bays=160)
WHEELSET = wt.Wheelset(mass=1300, load=1e5, stiffness=3e6, damping=8e4)
SPEED, SHORT, LONG = 15.0, 0.0543, 0.0618  # s; no whole numbers of macro steps
X = np.linspace(-2.0, SPEED * LONG, 301)


@pytest.mark.parametrize("rolling", ["circle", "point"])
@pytest.mark.parametrize(
    ("irregularity", "contact"),
    [
        (wt.irregularities.Weld(height=8e-4, length=0.75, position=0.6), wt.Hertz()),
        (wt.irregularities.DippedJoint(angle=0.01, length=0.7, position=0.6), wt.Hertz(constant_per_wheel=7e10)),
        (wt.CosineBump(height=-2e-3, length=0.7, start=0.3), wt.contact.Thornton(constant_per_wheel=7e10)),
        (wt.Measured(positions=X, heights=1e-4 * np.sin(9.0 * X)), wt.Linear(stiffness=1.2e9)),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_run_that_ends_within_an_irregularity_begins_a_longer_one(irregularity, contact, rolling):
    scene = wt.Scenario(
        vehicle=WHEELSET, track=TRACK, contact=contact, irregularity=irregularity, speed=SPEED, duration=SHORT,
        rolling=rolling,
    )  # fmt: skip
    short, long = wt.simulate([scene, scene.replaced({"duration": LONG})])
    assert short.outcome is long.outcome is Outcome.COMPLETED
    assert short.end == SHORT
    times = np.linspace(0.0, SHORT, 200)
    one, other = (record.at(times).normal_force.values for record in (short, long))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-7 * one.max())
    assert float(np.ptp(one)) > 1e4  # N
