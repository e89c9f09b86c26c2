"""Any damper with an end of its own: no NaN, balanced energy, the end within its gap, the damper only ever brakes."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import wheeltapper as wt
from tests.drawn import drawn
from wheeltapper.ground.outcome import Outcome

from .test_random_scenarios import irregularities, tracks

contacts = st.one_of(
    st.builds(wt.Hertz, constant=st.floats(5e10, 4e11), hysteresis=st.sampled_from([None, 0.05, 0.5])),
    st.builds(wt.Hertz, rail_radius=st.floats(0.1, 0.5), curvature=st.booleans()),
    st.builds(wt.Linear, stiffness=st.floats(5e8, 4e9)),
)
starts = st.sampled_from([0.0, 1.0, -1.0]) | st.floats(-1.0, 1.0)
decades = st.floats(-8.0, -3.0).map(lambda power: 10.0**power)


@st.composite
def wheelsets(draw):
    damping = 10.0 ** draw(st.floats(2.0, 5.3))
    play = draw(st.just(0.0) | decades | decades)
    bush = 10.0 ** draw(st.floats(6.0, 9.5)) if play == 0.0 or draw(st.booleans()) else None
    return wt.Wheelset(
        mass=draw(st.floats(500, 2500)),
        load=draw(st.floats(2e4, 1.5e5)),
        stiffness=draw(st.floats(0, 1e7)),
        damping=damping,
        damper_play=play,
        damper_play_start=draw(starts) if play else 0.0,
        bush_stiffness=None if bush is None else min(bush, 9e5 * damping),
    )


scenarios = st.builds(
    wt.Scenario,
    vehicle=wheelsets(),
    track=tracks,
    contact=contacts,
    irregularity=irregularities,
    rolling=st.sampled_from(["circle", "point"]),
    speed=st.floats(1.0, 40.0),
    duration=st.floats(0.02, 0.06),
)


def simulated(scenario, method="default"):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return wt.simulate(scenario, method)
        except wt.InputError as error:  # a hollow that is more curved than the wheel
            assume("hollow" not in str(error))
            raise


def check_motion(record):
    """Check each sample against the law of the damper."""
    vehicle = record.scenario.vehicle
    history = record.history(50e3)
    for name in history:
        assert np.isfinite(history[name].values).all()
    away = history.wheel_displacement.values - history.damper_end_displacement.values
    velocity, force = history.wheel_velocity.values, history.damper_force.values
    beyond = np.maximum(np.abs(away) - vehicle.damper_play, 0.0)
    if vehicle.bush_stiffness is None:
        assert beyond.max() < 1e-13  # m
        assert (force * velocity <= 0.0).all()
        acts = force != 0.0
        np.testing.assert_allclose(force[acts], -vehicle.damping * velocity[acts], rtol=1e-12)
        acts &= np.abs(velocity) > 1e-12  # m/s
        assert vehicle.damper_play == 0.0 or (np.sign(away[acts]) == np.sign(velocity[acts])).all()
    else:
        law = -np.sign(away) * beyond * vehicle.bush_stiffness
        np.testing.assert_allclose(force, law, rtol=0, atol=1e-13 * vehicle.bush_stiffness)


def check_events(record):
    stops = record.damper_events
    kinds, sides = stops.kind.values, stops.side.values
    assert list(kinds) == ["reached", "left"] * (len(kinds) // 2) + ["reached"] * (len(kinds) % 2)
    assert (sides[0 : len(sides) - 1 : 2] == sides[1::2]).all()
    assert (np.diff(stops.time.values) >= 0.0).all()


def check_maxima(record):
    """Compare the maxima with samples; a jump of the path onto a wheel in flight begins with the largest force."""
    found = record.peaks.time.values
    assert all(b - a > 1e-10 for a, b in pairwise(found))
    if getattr(record.scenario.track, "start", None) is None:
        fine = record.history(400e3)
        times, force = fine.time.values, fine.normal_force.values
        before, here, after = force[:-2], force[1:-1], force[2:]
        tops = times[1:-1][(here > before * (1 + 1e-9)) & (here > after * (1 + 1e-9))]
        assert all(np.abs(found - top).min(initial=1.0) < 6e-6 for top in tops)


@drawn(60)
@given(scenarios)
@pytest.mark.slow
def test_every_damper_is_answered_soundly(scenario):
    record = simulated(scenario)
    assert record.outcome is Outcome.COMPLETED
    assert abs(record.energy.relative_imbalance.item()) < 1e-9
    check_motion(record)
    check_events(record)
    check_maxima(record)


@pytest.mark.slow
@drawn(40)
@given(scenarios)
def test_default_and_strict_agree_as_far_as_the_motion_is_predictable(scenario):
    strict, default = simulated(scenario, "strict"), simulated(scenario)
    assert abs(strict.energy.relative_imbalance.item()) < 1e-10
    start = strict.at(0.0)
    nearby = {"displacement": start.wheel_displacement.item() * (1 + 1e-9), "velocity": start.wheel_velocity.item()}
    other = simulated(scenario.replaced({"start": nearby}), "strict")
    for name in ("events", "damper_events"):
        a, b, c = (getattr(record, name).time.values for record in (strict, other, default))
        count = min(12, len(a), len(b))
        predictable = np.abs(a[:count] - b[:count]) < 1e-5 * np.maximum(a[:count], 1e-3)
        same = count if predictable.all() else int(np.argmin(predictable))
        assert len(c) >= same
        limit = 1e-8 + 10 * np.abs(a[:same] - b[:same])
        assert (np.abs(a[:same] - c[:same]) < limit).all()
