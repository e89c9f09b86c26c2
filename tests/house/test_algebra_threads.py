"""Linear algebra keeps to one thread while marches share the cores, and has its own again afterwards."""

import numpy as np
import pytest
import scipy.linalg  # noqa: F401 - it brings a library of its own, which has to be there to be counted
from threadpoolctl import threadpool_info, threadpool_limits

import wheeltapper as wt
from wheeltapper.lower.track.reach import modes_of
from wheeltapper.march.common.blocks import algebra_on_one_thread
from wheeltapper.march.general import ensemble

SCENE = wt.Scenario(
    vehicle=wt.Wheelset(mass=600, load=9e4, wheels=1), track=wt.tracks.Ballasted.named("rolland_UIC60_example"),
    irregularity=wt.WheelFlat(length=0.04, position=0.3, repeat=False), speed=20, duration=0.02,
)  # fmt: skip


def threads():
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def _three_threads():
    with threadpool_limits(3, user_api="blas"):
        yield


def test_a_map_on_rails_marches_with_one_thread_of_algebra_each(monkeypatch):
    seen, marching = [], ensemble.march_all

    def watched(tasks, held, read, *rest):
        def reads(*block):
            seen.append(threads())
            read(*block)

        marching(tasks, held, reads, *rest)

    monkeypatch.setattr(ensemble, "march_all", watched)
    for held in (1, 2):
        wt.sweep(SCENE, {"speed": np.array([18.0, 20.0])}, "largest_force", threads=held, progress=False)
    assert seen
    assert set().union(*seen) == {1}
    assert threads() == {3}


def test_an_error_sets_them_back_too():
    with pytest.raises(ZeroDivisionError), algebra_on_one_thread():
        1 / 0  # noqa: B018
    assert threads() == {3}


def test_modes_of_an_irregular_track_are_made_on_one_thread(monkeypatch):
    """On busy cores two threads took six times the time of one."""
    seen, eig = [], np.linalg.eig
    monkeypatch.setattr(np.linalg, "eig", lambda matrix: (seen.append((len(matrix), threads())), eig(matrix))[1])
    fields = wt.tracks.Ballasted.example | {"bays": 20, "anomalies": [wt.tracks.MissingPad(seat=3)]}
    modes_of(wt.tracks.Ballasted(**fields))
    assert max(seen, key=lambda one: one[0])[1] == {1}
    assert threads() == {3}
