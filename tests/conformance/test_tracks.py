"""Every track: at rest it rests, its energy closes, and it is not silently another one."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.march import run

from . import samples


def tracks():
    return samples(Track)


def is_marched(track):
    return run.fastest_march(run.SIMULATE, track.needs) is not None


SAMPLES = {name: track for name, track in tracks().items() if is_marched(track)}
REFUSED = {name: track for name, track in tracks().items() if not is_marched(track)}


def gives_way(track):
    """Return whether sleepers excite a wheel that moves, and modes are left out."""
    return isinstance(track, SupportedRail)


def scene(track, height=1e-4, speed=8.0):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4),
        track=track,
        contact=wt.Hertz(constant=1.405e11),
        irregularity=wt.CosineBump(height=height, length=0.06, start=0.05) if height else None,
        rolling="point",
        speed=speed,
        duration=0.06,
    )


def test_tracks_give_different_answers():
    largest = {name: wt.simulate(scene(track)).peaks.normal_force.values.max() for name, track in SAMPLES.items()}
    assert len({round(float(force), 3) for force in largest.values()}) == len(SAMPLES), largest


@pytest.mark.parametrize("name", SAMPLES)
def test_at_rest_nothing_moves(name):
    track = SAMPLES[name]
    history = wt.simulate(scene(track, height=0.0, speed=0.0 if gives_way(track) else 8.0)).history(1e4)
    rounding = 2e-5 if gives_way(track) else 1e-8  # the modes' tables have single precision: 1e-7 of the static force
    np.testing.assert_allclose(history.wheel_acceleration, 0.0, atol=rounding)


@pytest.mark.parametrize("name", SAMPLES)
@pytest.mark.slow
def test_energy_closes(name):
    method = "strict" if gives_way(SAMPLES[name]) else "default"
    assert abs(wt.simulate(scene(SAMPLES[name]), method).energy.relative_imbalance.item()) < 1e-8


@pytest.mark.parametrize("name", REFUSED)
def test_what_no_march_takes_is_refused_with_the_one_sentence(name):
    expected = run.refusal(run.SIMULATE, REFUSED[name].needs)
    with pytest.raises(wt.InputError) as caught:
        scene(REFUSED[name], height=0.0)
    assert str(caught.value) == str(expected)
    assert "\n" not in str(expected)
