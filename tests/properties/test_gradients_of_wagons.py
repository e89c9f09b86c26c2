"""Gradients of wagons: closed forms, what has none, and charts."""

import json

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from wheeltapper.ask.computed import TRUST_BY_DIFFERENCES
from wheeltapper.faces.cli import main

BUMP = wt.CosineBump(height=2e-4, length=0.05, start=0.02)
SCENE = wt.Scenario(
    vehicle=wt.Wagon.erri_b176(), irregularity=BUMP, creep=wt.creep.Polach(friction=0.35), speed=20.0, duration=0.03
)
DIP = SCENE.replaced({"irregularity.0.height": -3.6e-5, "duration": 0.01, "creep": None})
HEIGHT, MASS = "irregularity.0.height", "vehicle.axles.0.mass"


def status_of(found):
    return TRUST_BY_DIFFERENCES[int(found.gradient_status)]


def test_what_begins_later_happens_later_and_is_the_same():
    features = ["first_loss", "impact_interval", "largest_force"]
    found = wt.gradient(SCENE, features, ["irregularity.0.start"]).isel(parameter=0).sel(wheelset=1)
    assert status_of(found) == "by_differences"
    np.testing.assert_allclose(found.first_loss_gradient, 1 / 20.0, rtol=1e-9)
    for name in features[1:]:
        assert np.all(np.abs(found[f"{name}_elasticity"]) < 1e-9)


def test_a_wheel_in_the_air_at_the_end_stays_there():
    found = wt.gradient(SCENE, ["time_in_air", "number_of_impacts"], ["duration"]).isel(parameter=0)
    np.testing.assert_allclose(found.time_in_air_gradient.sel(wheelset=1), 1.0, rtol=1e-9)
    assert np.all(found.time_in_air_gradient.sel(wheelset=[2, 3, 4]) == 0.0)
    assert "number_of_impacts_gradient" not in found  # a count


@pytest.mark.slow
def test_a_field_that_is_zero_has_a_derivative_that_belongs_to_those_beside():
    path = "vehicle.bodies.0.position.1"
    at = {value: SCENE.replaced({path: value}) for value in (0.0, 1e-4, -1e-4)}
    slopes = [wt.gradient(one, ["largest_force"], [path]).largest_force_gradient.sel(wheelset=1) for one in at.values()]
    np.testing.assert_allclose(slopes[0], 0.5 * (slopes[1] + slopes[2]), rtol=3e-6)
    left, right = slopes[0].values.ravel()
    assert left == pytest.approx(-right, rel=1e-7)


def test_a_corner_of_a_feature_has_no_derivative():
    first = float(wt.features.first_loss()(wt.simulate(SCENE, "strict"))[0, 0])
    folded = wt.features.custom(lambda train: abs(train.loss_time.sum() - first), "folded", "s")
    found = wt.gradient(SCENE.replaced({"duration": 0.008}), [folded, "first_loss"], ["speed"])
    assert status_of(found) == "not_differentiable"
    assert np.isnan(found.folded_gradient.sel(wheelset=1)).all()
    assert np.isfinite(found.first_loss_gradient.sel(wheelset=1)).all()
    said = "folded has no derivative by speed (NaN): the slopes below and above this value differ"
    assert json.loads(found.notes)[-1] == said


@pytest.mark.slow
def test_where_contact_begins_to_be_lost_there_is_no_derivative_and_close_to_it_the_cell_grazes():
    """The time in the air grows like the square root of the distance to the border."""
    over = {HEIGHT: [-4e-5, -3e-5], "speed": [19.0, 21.0]}
    border = wt.border(DIP, over, resolution=2, method="strict")
    onset = float(border[HEIGHT][np.abs(border.speed.values - 20.0).argmin()])
    found = wt.gradient(DIP.replaced({HEIGHT: onset}), ["largest_force"], [HEIGHT, MASS])
    assert status_of(found) == "not_differentiable"
    assert np.isnan(found.largest_force_gradient).all()
    (note,) = (note for note in json.loads(found.notes) if "no derivative" in note)
    assert note.startswith(f"largest_force has no derivative by {HEIGHT}, {MASS} (NaN): even for a tiny change other")
    near, far = (
        wt.gradient(DIP.replaced({HEIGHT: onset * more}), ["time_in_air"], [HEIGHT]) for more in (1.0000001, 1.2)
    )
    assert (status_of(near), status_of(far)) == ("grazing", "by_differences")


def test_near_chaotic_cells_are_told():
    found = wt.gradient(SCENE, ["first_loss"], ["speed"], chaos_limit=2)
    assert status_of(found) == "near_chaotic"
    assert 2.0 < float(found.amplification) < 10.0


@pytest.mark.slow
def test_cells_of_a_map_have_the_gradients_that_they_have_alone_for_any_number_of_threads():
    over = {"speed": [19.0, 20.0]}
    one, two = (
        wt.sweep(SCENE, over, ["largest_force"], gradient=["speed", MASS], threads=threads) for threads in (1, 2)
    )
    xr.testing.assert_identical(one, two)
    assert one.largest_force_gradient.dims == ("parameter", "wheelset", "side", "speed")
    assert one.largest_force_gradient_error.dims == one.largest_force_gradient.dims
    alone = wt.gradient(SCENE, ["largest_force"], ["speed", MASS])
    for name in ("largest_force_gradient", "largest_force_gradient_error"):
        np.testing.assert_array_equal(one[name].sel(speed=20.0), alone[name])
    plain = wt.sweep(SCENE, over, ["largest_force"])
    np.testing.assert_array_equal(one.largest_force, plain.largest_force)


@pytest.mark.slow
def test_a_store_holds_gradients_of_wagons_with_their_errors(tmp_path):
    study, store = tmp_path / "study.toml", tmp_path / "map.zarr"
    SCENE.replaced({"duration": 0.005}).to_toml(tmp_path / "coach.toml")
    study.write_text(
        'features = ["first_loss"]\nchunk = 1\ngradient = true\nscenario = "coach.toml"\n[over]\nspeed = [15.0, 20.0]\n'
    )
    assert main(["sweep", str(study), "--output", str(store)]) == 0
    with xr.open_zarr(store) as held:
        held = held.load()
    expected = wt.sweep(SCENE.replaced({"duration": 0.005}), {"speed": [15.0, 20.0]}, ["first_loss"], gradient=True)
    for name in ("first_loss_gradient", "first_loss_gradient_error", "gradient_status"):
        np.testing.assert_array_equal(held[name], expected[name])
