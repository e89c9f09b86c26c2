"""Every track of the scenario: at rest it rests, its energy closes, and it is not silently another one."""

from typing import get_args

import numpy as np
import pytest

import wheeltapper as wt

SAMPLES = {
    "StiffTrack": wt.StiffTrack(),
    "FloatingDeck": wt.FloatingDeck(mass=5000, stiffness=2e7, damping=1e4),
}


def scene(track, height=1e-4):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4),
        track=track,
        contact=wt.Hertz(constant=1.405e11),
        irregularity=wt.CosineBump(height=height, length=0.06, start=0.05) if height else None,
        rolling="point",
        speed=8,
        duration=0.06,
    )


def test_every_track_has_a_sample():
    choices = get_args(wt.Scenario.model_fields["track"].annotation)
    assert {get_args(choice)[0].__name__ for choice in choices} == set(SAMPLES)


def test_tracks_give_different_answers():
    largest = {name: wt.simulate(scene(track)).peaks.normal_force.values.max() for name, track in SAMPLES.items()}
    assert len({round(float(force), 3) for force in largest.values()}) == len(SAMPLES), largest


@pytest.mark.parametrize("name", SAMPLES)
def test_at_rest_nothing_moves(name):
    history = wt.simulate(scene(SAMPLES[name], height=0.0)).history(1e4)
    np.testing.assert_allclose(history.wheel_acceleration, 0.0, atol=1e-8)


@pytest.mark.parametrize("name", SAMPLES)
def test_energy_closes(name):
    assert abs(wt.simulate(scene(SAMPLES[name])).energy.relative_imbalance.item()) < 1e-8
