"""Cells of a wagon: each is what its record says, whatever computes it."""

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from wheeltapper.ask.computed import STATUS
from wheeltapper.faces.cli import main
from wheeltapper.record.simulate import ModelWarning

COACH = wt.Wagon.erri_b176()
BUMP = wt.CosineBump(height=2e-4, length=0.05, start=0.02)
SCENE = wt.Scenario(vehicle=COACH, irregularity=BUMP, speed=20.0, duration=0.03)
RAILS = wt.tracks.Slab(**wt.tracks.Slab.example, cutoff=1000, bays=160)
ASKED = ["largest_force", "time_in_air", "impact_interval"]
MASS = "vehicle.axles.0.mass"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "over"),
    [
        (SCENE, {"speed": [15.0, 20.0, 25.0], MASS: [1700.0, 1813.0]}),
        (SCENE.replaced({"creep": wt.creep.Polach(friction=0.35)}), {"vehicle.bodies.0.mass": [2e4, 3e4]}),
        (SCENE.replaced({"track": RAILS, "duration": 0.01}), {"irregularity.0.height": [1e-4, 2e-4]}),
    ],
)
def test_cells_are_what_records_say_for_any_number_of_threads(scene, over):
    one, two = (wt.sweep(scene, over, ASKED, threads=threads) for threads in (1, 2))
    xr.testing.assert_identical(one, two)
    assert one.time_in_air.dims == ("wheelset", "side", *over)
    assert not one.status.any()
    assert float(one.largest_force.max()) > 6.5e4  # N
    last = {path: values[-1] for path, values in over.items()}
    record = wt.simulate(scene.replaced(last))
    for name in ASKED:
        np.testing.assert_array_equal(one[name].sel(last), getattr(wt.features, name)()(record))


def test_a_store_of_wagons_goes_on_to_the_same_values(tmp_path, capsys):
    study, store = tmp_path / "study.toml", tmp_path / "map.zarr"
    SCENE.to_toml(tmp_path / "coach.toml")
    study.write_text('features = ["time_in_air"]\nchunk = 1\nscenario = "coach.toml"\n[over]\nspeed = [15.0, 20.0]\n')
    assert main(["sweep", str(study), "--output", str(store)]) == 0
    with xr.open_zarr(store) as held:
        held = held.load()
    expected = wt.sweep(SCENE, {"speed": [15.0, 20.0]}, ["time_in_air"])
    assert held.time_in_air.dims == ("wheelset", "side", "speed")
    assert held.side.values.tolist() == ["left", "right"]
    np.testing.assert_array_equal(held.time_in_air, expected.time_in_air)
    (store / "status" / "c" / "1").unlink()
    assert main(["sweep", str(study), "--output", str(store), "--resume"]) == 0
    with xr.open_zarr(store) as again:
        np.testing.assert_array_equal(again.load().time_in_air, held.time_in_air)


def test_a_cell_that_cannot_be_is_refused_and_the_others_are_told():
    rail = wt.Measured(positions=np.linspace(-20.0, 1.0, 211), heights=1e-5 * np.cos(np.arange(211)))
    scene = SCENE.replaced({"irregularity": rail})
    with pytest.warns(ModelWarning, match=r"1 of 2 cells cannot be computed; the first: .*irregularity"):
        found = wt.sweep(scene, {"speed": [20.0, 40.0]}, ["largest_force"])
    assert [STATUS[number] for number in found.status.values] == ["complete", "refused"]
    assert np.isnan(found.largest_force.values[..., 1]).all()
    assert np.isfinite(found.largest_force.values[..., 0]).all()
