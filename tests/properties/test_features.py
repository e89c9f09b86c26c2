"""A feature of a record is the feature of a map's cell, and what the record's own tables say; of every vehicle."""

import numpy as np
import pytest

import wheeltapper as wt
from tests.scenes import BUMP
from wheeltapper.describe.registry import registered_in

FEATURES = [
    *(
        make(waves=40) if name == "growth_exponent" else make()  # its usual number of waves takes seconds
        for name, make in registered_in("wheeltapper.record.features").items()
    ),
    wt.features.largest_force(over_static=True),
    wt.features.impact_interval(2, 3, between="peaks").renamed("of_peaks"),
    wt.features.force_ratio(1, 30).renamed("too_late"),
    wt.features.impulse(2).renamed("second_impulse"),
    wt.features.custom(lambda train: train.closing_speed.max(), "hardest", "m/s", impacts=1),
    wt.features.custom(lambda train: train.peak_impact[-1], "impacts_before_the_last_peak", impacts=1),
]
SCENES = {
    "bump": BUMP,
    "on a deck": BUMP.replaced({"track": wt.FloatingDeck(mass=15e3, stiffness=5e8, damping=1e5)}),
    "falling": BUMP.replaced({"start": {"displacement": "0.3 mm", "velocity": 0.1}}),
    "rolling flat": BUMP.replaced({
        "irregularity": wt.WheelFlat(depth="0.3 mm", position=0.02), "rolling": "circle", "contact": wt.Hertz(),
    }),
    "calm": BUMP.replaced({"irregularity.0.height": 1e-6}),
    "linear": BUMP.replaced({"contact": wt.Linear(stiffness=2e9)}),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_every_feature_of_a_record_is_that_of_a_cell(name):
    scene = SCENES[name]
    record, chart = wt.simulate(scene), wt.sweep(scene, {"speed": [scene.speed]}, FEATURES)
    for feature in FEATURES:
        found, expected = feature(record), chart[feature.name][0]
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=0, err_msg=feature.name)
        found.attrs.pop("note", None)  # a chart's notes stand together
        assert found.attrs == expected.attrs


def told_by_tables(record, impacts, losses, peaks, end, starts_in_flight=False):
    """Return what single features must be, from the tables of one contact."""
    after = dict(enumerate(impacts.impulse.values, 1))
    flights = np.sum(impacts.time.values) - np.sum(losses)
    flights += end * (len(losses) + starts_in_flight - impacts.sizes["impact"])
    return {
        "number_of_impacts": impacts.sizes["impact"],
        "largest_force": peaks.max() if len(peaks) else np.nan,
        "first_loss": losses[0] if len(losses) else np.nan,
        "last_loss": losses[-1] if len(losses) else np.nan,
        "time_in_air": flights,
        "impulse": after.get(1, np.nan),
        "second_impulse": after.get(2, np.nan),
        "impact_interval": impacts.interval.values[0] if impacts.sizes["impact"] else np.nan,
        "force_ratio": impacts.force_ratio.values[0] if impacts.sizes["impact"] > 1 else np.nan,
        "hardest": impacts.closing_speed.values.max() if impacts.sizes["impact"] else np.nan,
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"contact": wt.contact.Thornton(constant=1.405e11)},
        {"vehicle.damper_play": 5e-5},
        {"vehicle.bush_stiffness": 5e7},
    ],
)
def test_features_of_records_without_maps_say_what_the_tables_say(changes, tmp_path):
    record = wt.simulate(BUMP.replaced(changes))
    losses = record.events.time.values[record.events.kind.values == "loss"]
    expected = told_by_tables(record, record.impacts, losses, record.peaks.normal_force.values, record.end)
    assert expected["number_of_impacts"] > 3
    assert expected["time_in_air"] == pytest.approx(record.time_in_air, rel=1e-9)
    record.save(tmp_path / "record.nc")
    for again in (record, wt.load(tmp_path / "record.nc")):
        found = {feature.name: float(feature(again)) for feature in FEATURES}
        for name, value in expected.items():
            assert found[name] == pytest.approx(value, rel=1e-12, nan_ok=True), name
        sampled = float(again.history(rate=1e6).wheel_displacement.max())
        assert sampled <= found["largest_displacement"] + 1e-15 < sampled + 1e-9
        assert found["decay_rate"] > 0
        assert np.isnan(found["too_late"])


def test_a_soft_law_that_never_yields_has_the_features_of_the_elastic_one():
    plastic = BUMP.replaced({"contact": wt.contact.Thornton(constant=1.405e11, yield_force="900 kN")})
    one, other = wt.simulate(plastic), wt.simulate(BUMP)
    for feature in FEATURES:
        rtol, atol = (1e-8, 0.0) if feature.name != "missing_energy" else (0.0, 1e-10)  # which is an error itself
        np.testing.assert_allclose(feature(one), feature(other), rtol=rtol, atol=atol, err_msg=feature.name)


def test_features_of_a_wagon_are_those_of_its_wheels_treads():
    record = wt.simulate(
        wt.Scenario(
            vehicle=wt.Wagon.erri_b176(1500.0), contact=wt.Hertz(constant_per_wheel=7.025e10),
            creep=wt.creep.Polach(friction=0.35), speed=5.0, duration=0.04,
            irregularity={"left": wt.Step(height=1e-4, position=0.02), "right": wt.Step(height=6e-5, position=0.02)},
        )
    )  # fmt: skip
    found = {feature.name: feature(record) for feature in FEATURES}
    assert all(values.dims == ("wheelset", "side") for values in found.values())
    assert "per wheel" in found["largest_force"].attrs["long_name"]
    assert "per wheelset" not in found["largest_force"].attrs["long_name"]
    assert float(found["time_in_air"].sum()) == pytest.approx(record.time_in_air, rel=1e-9)
    over = found["largest_force_over_static"] * record.static_forces
    np.testing.assert_allclose(over, found["largest_force"], rtol=1e-12)
    mine = {"wheelset": 1, "side": "left"}
    assert int(found["number_of_impacts"].sel(mine)) == 2
    for side in ("left", "right"):
        tables = [
            table.isel({dimension: (table.wheelset == 1) & (table.side == side) & (table.surface == "tread")})
            for table, dimension in ((record.impacts, "impact"), (record.events, "event"), (record.peaks, "peak"))
        ]
        impacts, events, peaks = tables
        losses = events.time.values[events.kind.values == "loss"]
        expected = told_by_tables(record, impacts, losses, peaks.normal_force.values, record.end)
        for name, value in expected.items():
            assert float(found[name].sel(wheelset=1, side=side)) == pytest.approx(value, rel=1e-12, nan_ok=True), name
    history = record.at(np.linspace(0.0, record.end, 4001)).displacement.sel(body="wheelset 1", motion="z")
    highest = float(found["largest_displacement"].sel(mine))
    assert float(history.max()) <= highest + 1e-15 < float(history.max()) + 1e-9


def test_a_run_that_broke_off_has_no_features():
    scene = BUMP.replaced({"vehicle.damping": 0.0, "duration": 0.05, "start": {"displacement": 1e-12, "velocity": 0.0}})
    record = wt.simulate(scene)
    record._kept_march = record._kept_march._replace(status=4)
    assert record.outcome.name != "COMPLETED"
    assert all(np.isnan(feature(record)) for feature in FEATURES)


@pytest.mark.parametrize("what", [BUMP, [1.0], None])
def test_what_is_no_record_is_refused_in_one_line(what):
    with pytest.raises(wt.InputError, match=r"largest_force: found a .*; allowed: a record") as error:
        wt.features.largest_force()(what)
    assert "\n" not in str(error.value)


MASS, LOAD, STIFFNESS, FALL = 1500.0, 91_307.0, 2e9, 0.1
LONE = wt.Wheelset(mass=MASS, load=LOAD)
FALLING = wt.Scenario(
    vehicle=LONE, contact=wt.Linear(stiffness=STIFFNESS), speed=0.0, duration=1e-3,
    start={"displacement": 0.0, "velocity": -FALL},
)  # fmt: skip


@pytest.mark.parametrize("vehicle", [LONE, wt.vehicles.Wheelsets(wheelsets=(LONE, LONE), positions=(0.0, -2.5))])
def test_a_force_without_a_maximum_is_largest_at_an_end_of_the_run(vehicle):
    """The wheel falls on to a linear spring and is still going down at the end; the force there in closed form."""
    omega, weight, end = np.sqrt(STIFFNESS / MASS), LOAD + 9.81 * MASS, 1e-3
    deep = weight / STIFFNESS * (1.0 - np.cos(omega * end)) + FALL / omega * np.sin(omega * end)
    scene = FALLING.replaced({"vehicle": vehicle})
    record, features = wt.simulate(scene), ["largest_force", wt.features.largest_force(over_static=True)]
    assert record.peaks.sizes["peak"] == 0
    chart = wt.sweep(scene, {"duration": [end, 2.0 * np.pi / omega]}, features)
    for found in (wt.features.largest_force()(record), chart.largest_force.isel(duration=0)):
        np.testing.assert_allclose(found, STIFFNESS * deep, rtol=1e-9)
    np.testing.assert_allclose(chart.largest_force_over_static * weight, chart.largest_force, rtol=1e-12)
    whole = STIFFNESS * (weight / STIFFNESS + np.hypot(weight / STIFFNESS, FALL / omega))
    np.testing.assert_allclose(chart.largest_force.isel(duration=1), whole, rtol=1e-9)  # its maximum


def test_what_has_no_gradient_is_said():
    chart = wt.gradient(BUMP, ["number_of_impacts", "largest_force"], ["speed"])
    assert "largest_force_gradient" in chart
    assert "no gradient of number_of_impacts: counts, bounds and filtered forces have none" in chart.attrs["notes"]
    with pytest.raises(wt.InputError, match="features: found number_of_impacts, which has no derivatives"):
        wt.gradient(BUMP, "number_of_impacts", ["speed"])
