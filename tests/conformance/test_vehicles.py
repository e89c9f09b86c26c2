"""Every vehicle on every kind of track: it runs, is told, drawn, animated, its energy closes, files bring it back."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.ground.outcome import Outcome
from wheeltapper.march.common import program as contract
from wheeltapper.march.march import March

from ..marks import slow

WHEELSET = {"mass": 1200.0, "load": 88e3, "stiffness": 2.4e6, "damping": 3e4}
TRACKS = {
    "stiff": wt.StiffTrack(), "deck": wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4),
    "rails": wt.tracks.Ballasted(**wt.tracks.Ballasted.example | {"cutoff": 1000, "bays": 80}),
}  # fmt: skip


def vehicles():
    """Return one of every vehicle by the name of its class."""
    given = {"Wheelset": wt.Wheelset(**WHEELSET), "Wagon": wt.Wagon.erri_b176()}
    kinds = {kind.__name__: kind for kind in makeable_nouns(Vehicle)}
    return {name: given.get(name) or kind(**getattr(kind, "example", {})) for name, kind in kinds.items()}


SAMPLES = vehicles()
RUN = [f"{name} on {track}" for name in SAMPLES for track in TRACKS]


def offers_what_every_march_does(record):
    """Check what a march offers (march/march.py) against the record's tables."""
    march, contacts = record._march, record._contacts.lanes
    assert {name for name in vars(March) if not name.startswith("_")} <= set(dir(march))
    begins, lengths = march.spans.T
    assert begins[0] == 0.0
    np.testing.assert_allclose(begins[1:], (begins + lengths)[:-1], rtol=0, atol=1e-9 * march.end)
    assert begins[-1] + lengths[-1] == pytest.approx(march.end, rel=1e-9)
    free = march.without_force(contacts)
    assert free.shape == (len(begins), len(contacts))
    middles = (begins + 0.5 * lengths)[lengths > 1e-6 * march.end] * record._lowered.time
    force = record._variables_at(middles)["normal_force"][1].reshape(len(middles), -1)
    np.testing.assert_array_equal(force == 0.0, free[lengths > 1e-6 * march.end, : force.shape[1]])
    assert [rows.ndim for rows in march.happened()] == [2] * len(march.happened())
    assert march.events.shape[1] == contract.EVENT_COLUMNS
    assert march.peaks.shape[1] == contract.PEAK_COLUMNS


@pytest.mark.slow
@pytest.mark.parametrize("run", slow(RUN, "ErriB176 on rails", "Wagon on rails"))
@pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
def test_a_vehicle_runs_its_energy_closes_and_it_is_told_drawn_and_kept(run, tmp_path):
    name, track = run.split(" on ")
    scene = wt.Scenario(
        vehicle=SAMPLES[name], track=TRACKS[track], contact=wt.Hertz(constant_per_wheel=7e10), rolling="point",
        irregularity=wt.CosineBump(height=8e-4, length=0.06, start=0.01), speed=9.0, duration=0.05,
    )  # fmt: skip
    record = wt.simulate(scene)
    assert record.outcome is Outcome.COMPLETED
    assert record.impacts.sizes["impact"] > 0
    assert "impact" in str(record)
    offers_what_every_march_does(record)
    history = record.history("2 kHz")
    for name, values in history.data_vars.items():
        assert np.isfinite(values).all(), name
        assert values.attrs["long_name"], name
        assert "units" in values.attrs, name
    assert abs(float(record.energy.relative_imbalance)) < 1e-6
    for what in (scene.vehicle, scene, record):
        assert wt.plot(what).axes
    film = {"start": 0.0, "stop": 0.01, "seconds": 0.3, "frames_per_second": 10}
    assert wt.show.animate(record, tmp_path / "moves.gif", **film).stat().st_size > 0
    record.save(tmp_path / "kept.nc")
    again = wt.load(tmp_path / "kept.nc")
    assert again.scenario == scene
    for name, values in again.history("2 kHz").data_vars.items():
        np.testing.assert_array_equal(values, history[name])
