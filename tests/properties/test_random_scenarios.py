"""Any valid scenario: no crash, no NaN, balanced energy, no tension, force and indentation consistent."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import wheeltapper as wt
from tests.drawn import drawn
from wheeltapper.ground.outcome import Outcome

SHAPES = st.sampled_from(["fresh", "rounded"])
heights = st.floats(1e-5, 4e-4).flatmap(lambda h: st.sampled_from([h, -h]))
irregularities = st.one_of(
    st.builds(wt.CosineBump, height=heights, length=st.floats(0.02, 0.3), start=st.floats(0.0, 0.05)),
    st.builds(wt.Step, height=heights, position=st.floats(0.02, 0.1), ideal=st.booleans()),
    st.builds(
        wt.Corrugation, amplitude=st.floats(5e-6, 8e-5), wavelength=st.floats(0.03, 0.2), start=st.floats(0.0, 0.05)
    ),
    st.builds(
        wt.WheelFlat,
        depth=st.floats(2e-5, 4e-4),
        position=st.floats(0.05, 0.1),
        shape=SHAPES,
    ),
    st.builds(
        wt.OutOfRound, orders=st.just((1, 7)), amplitudes=st.tuples(st.floats(1e-5, 2e-4), st.floats(1e-5, 5e-5))
    ),
)
contacts = st.one_of(
    st.builds(wt.Hertz, constant=st.floats(5e10, 4e11), hysteresis=st.sampled_from([None, 0.05, 0.5])),
    st.builds(wt.Hertz, rail_radius=st.floats(0.1, 0.5), curvature=st.just(False)),
    st.builds(wt.Linear, stiffness=st.floats(5e8, 4e9), bilateral=st.booleans()),
)
tracks = st.one_of(
    st.just(wt.StiffTrack()),
    st.builds(wt.FloatingDeck, mass=st.floats(200, 2e4), stiffness=st.floats(1e6, 1e8), damping=st.floats(0, 1e5)),
    st.builds(
        wt.FloatingDeck, mass=st.floats(500, 2e4), stiffness=st.floats(1e6, 1e8), start=st.floats(0.01, 0.1),
        length=st.floats(0.05, 0.5),
    ),
)  # fmt: skip
scenarios = st.builds(
    wt.Scenario,
    vehicle=st.builds(
        wt.Wheelset,
        mass=st.floats(500, 2500),
        load=st.floats(2e4, 1.5e5),
        stiffness=st.floats(0, 1e7),
        damping=st.floats(0, 2e5),
    ),
    track=tracks,
    contact=contacts,
    irregularity=st.one_of(irregularities, st.tuples(irregularities, irregularities)),
    rolling=st.sampled_from(["circle", "point"]),
    speed=st.floats(1.0, 40.0),
    duration=st.floats(0.02, 0.06),
)


def simulated(scenario, method):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return wt.simulate(scenario, method)


@pytest.mark.slow
@drawn(60)
@given(scenarios)
def test_every_valid_scenario_is_answered_soundly(scenario):
    record = simulated(scenario, "default")
    assert record.outcome is Outcome.COMPLETED
    history = record.history(20e3)
    for name in history:
        assert np.isfinite(history[name].values).all()
    assert abs(record.energy.relative_imbalance.item()) < 1e-9
    force, indentation = history.normal_force.values, history.indentation.values
    if not getattr(scenario.contact, "bilateral", False):
        assert (force >= 0).all()
        assert (force[indentation <= 0] == 0).all()
    kinds = record.events.kind.values
    assert all(a != b for a, b in zip(kinds[:-1], kinds[1:], strict=True))
    assert (np.diff(record.events.time.values) >= 0).all()


@pytest.mark.slow
@drawn(40)
@given(scenarios)
def test_default_and_strict_agree_as_far_as_the_motion_is_predictable(scenario):
    strict, default = simulated(scenario, "strict"), simulated(scenario, "default")
    start = strict.at(0.0)
    nearby = {"displacement": start.wheel_displacement.item() * (1 + 1e-9), "velocity": start.wheel_velocity.item()}
    other = simulated(scenario.replaced({"start": nearby}), "strict")
    a, b, c = (r.events.time.values for r in (strict, other, default))
    count = min(10, len(a), len(b))
    predictable = np.abs(a[:count] - b[:count]) < 1e-5 * np.maximum(a[:count], 1e-3)
    same = count if predictable.all() else int(np.argmin(predictable))
    assert len(c) >= same
    limit = 1e-8 + 10 * np.abs(a[:same] - b[:same])
    assert (np.abs(a[:same] - c[:same]) < limit).all()
