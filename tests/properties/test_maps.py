"""Maps against single records: the same numbers, whatever the tables share and however many threads march."""

from types import SimpleNamespace

import numpy as np
import pytest

import wheeltapper as wt
from tests.scenes import BUMP
from wheeltapper.lower.lowered import balanced
from wheeltapper.march import run

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
PAIR = [wt.features.impact_interval(), wt.features.force_ratio()]
VARIED = {
    "vehicle.mass": [1000.0, 1500.0],
    "vehicle.load": [5e4, 1e5],
    "vehicle.stiffness": [0.0, 1e7],
    "vehicle.damping": [2e4, 1e5],
    "vehicle.radius": [0.4, 0.5],
    "contact.constant": [1e11, 2e11],
    "irregularity.0.height": [1e-4, -1e-4],
    "irregularity.0.length": [0.04, 0.07],
    "irregularity.0.start": [0.0, 0.05],
    "speed": [8.0, 12.0],
    "duration": [0.1, 0.12],
}


@pytest.mark.parametrize("rolling", ["point", "circle"])
@pytest.mark.parametrize("path", VARIED)
def test_a_map_holds_what_records_say(path, rolling):
    scene = BUMP.replaced({"rolling": rolling})
    chart = wt.sweep(scene, {path: VARIED[path]}, PAIR)
    for i, value in enumerate(VARIED[path]):
        impacts = wt.simulate(scene.replaced({path: value})).impacts
        assert float(chart.impact_interval[i]) == pytest.approx(float(impacts.interval[0]), rel=1e-9)
        assert float(chart.force_ratio[i]) == pytest.approx(float(impacts.force_ratio[0]), rel=1e-9)
    assert (chart.status == 0).all()


def test_position_and_length_and_speed_together_share_one_table():
    over = {"irregularity.0.start": [0.002, 0.03], "irregularity.0.length": [0.04, 0.06], "speed": [8.0, 10.0]}
    chart = wt.sweep(BUMP, over, PAIR)
    for cell in np.ndindex(2, 2, 2):
        one = BUMP.replaced({path: values[i] for (path, values), i in zip(over.items(), cell, strict=True)})
        assert float(chart.impact_interval[cell]) == pytest.approx(
            float(wt.simulate(one).impacts.interval[0]), rel=1e-9
        )


def test_every_feature_against_the_record():
    record = wt.simulate(BUMP)
    features = wt.features
    asked = [
        features.largest_force(),
        features.largest_force(over_static=True),
        features.number_of_impacts(),
        features.time_in_air(),
        features.first_loss(),
        features.last_loss(),
        features.contact_frequency(),
        features.decay_rate(),
        features.impulse(2),
        features.largest_displacement(),
        features.impact_interval(2, 4),
        features.force_ratio(2, 3),
    ]
    chart = wt.sweep(BUMP, {"vehicle.mass": [1500.0]}, asked).isel({"vehicle.mass": 0})
    impacts, losses = record.impacts, record.events.time.values[record.events.kind.values == "loss"]
    time, force = impacts.time.values, impacts.peak_force.values
    peak_times = record.peaks.time.values[np.isin(record.peaks.normal_force.values, force)]
    expected = {
        "largest_force": record.peaks.normal_force.values.max(),
        "largest_force_over_static": record.peaks.normal_force.values.max() / record.static_force,
        "number_of_impacts": 11.0,
        "time_in_air": record.time_in_air,
        "first_loss": losses[0],
        "last_loss": losses[-1],
        "contact_frequency": 10 / (time[-1] - time[0]),
        "decay_rate": -np.polyfit(peak_times, np.log(force), 1)[0],
        "impulse": impacts.impulse.values[1],
        "largest_displacement": record.history(5e5).wheel_displacement.values.max(),
        "impact_interval": time[3] - time[1],
        "force_ratio": force[1] / force[2],
    }
    for name, value in expected.items():
        assert float(chart[name]) == pytest.approx(value, rel=1e-8), name
        assert chart[name].attrs["long_name"]


def test_between_peaks_and_a_feature_of_ones_own():
    record = wt.simulate(BUMP)
    peaks = record.peaks.time.values[1:3]
    second_speed = wt.features.custom(
        lambda train: train.closing_speed[1], "second_speed", "m/s", impacts=2, until="impact"
    )
    chart = wt.sweep(BUMP, {"speed": [9.0]}, [wt.features.impact_interval(between="peaks"), second_speed])
    assert float(chart.impact_interval[0]) == pytest.approx(peaks[1] - peaks[0], rel=1e-9)
    assert float(chart.second_speed[0]) == pytest.approx(float(record.impacts.closing_speed[1]), rel=1e-9)


def test_too_few_impacts_are_nan_and_the_cell_is_complete():
    chart = wt.sweep(BUMP, {"irregularity.0.height": [1e-6, 2e-4]}, [*PAIR, wt.features.number_of_impacts()])
    assert np.isnan(chart.impact_interval[0])
    assert np.isnan(chart.force_ratio[0])
    assert chart.number_of_impacts.values.tolist() == [0.0, 11.0]
    assert (chart.status == 0).all()


def test_the_number_of_threads_changes_no_bit():
    over = {"vehicle.damping": np.linspace(2e4, 1e5, 40), "vehicle.mass": np.linspace(700, 3000, 50)}
    one, many = (wt.sweep(BUMP, over, PAIR, threads=threads) for threads in (1, 4))
    assert one.identical(many)


def test_every_axis_has_its_unit():
    round_wheel = wt.OutOfRound(orders=(8,), amplitudes=(2e-4,), phases=(0.1,), position=0.1)
    scene = BUMP.replaced({"irregularity": round_wheel, "rolling": "circle"})
    units = {
        "vehicle.damping": "N s/m", "contact.constant": "N/m^1.5", "speed": "m/s", "duration": "s",
        "irregularity.0.amplitudes.0": "m", "irregularity.0.phases.0": "rad", "irregularity.0.position": "m",
    }  # fmt: skip
    for path, unit in units.items():
        value = scene
        for part in path.split("."):
            value = value[int(part)] if part.isdigit() else getattr(value, part)
        chart = wt.sweep(scene, {path: [value]}, [wt.features.number_of_impacts()])
        assert chart[path].attrs["units"] == unit, path


def test_samples_and_zipped_lists():
    ranges = {"vehicle.mass": ["1 t", "2 t"], "speed": ["30 km/h", "40 km/h"]}
    for sampling in ("sobol", "latin hypercube"):
        chart = wt.sweep(BUMP, ranges, PAIR, samples=16, sampling=sampling, seed=4)
        assert chart.sizes == {"cell": 16}
        assert chart["vehicle.mass"].attrs["units"] == "kg"
        assert 1000 <= float(chart["vehicle.mass"].min()) < float(chart["vehicle.mass"].max()) <= 2000
        assert chart.identical(wt.sweep(BUMP, ranges, PAIR, samples=16, sampling=sampling, seed=4))
    zipped = wt.sweep(BUMP, {"vehicle.mass": [1500, 1400], "speed": [9, 10]}, PAIR, zipped=True)
    for i in range(2):
        one = BUMP.replaced({"vehicle.mass": [1500, 1400][i], "speed": [9, 10][i]})
        assert float(zipped.impact_interval[i]) == pytest.approx(float(wt.simulate(one).impacts.interval[0]), rel=1e-9)


def test_a_cell_that_cannot_be_lowered_is_refused_alone():
    hollow = BUMP.replaced(
        {"contact": wt.Hertz(), "irregularity": wt.CosineBump(height=-1e-5, length=0.05, start=0.01)}
    )
    chart = wt.sweep(hollow, {"irregularity.0.height": [-1e-5, -9e-4, -2e-5]}, [wt.features.largest_force()])
    assert chart.status.values.tolist() == [0, 5, 0]
    assert "hollow" in chart.attrs["notes"]


@pytest.mark.parametrize("track", [wt.FloatingDeck(mass=3000, stiffness=1e8, start=0.004, length=0.4)])
def test_a_deck_and_a_step_and_a_start_in_the_air(track):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307), track=track, contact=wt.Hertz(constant=1.4e11, hysteresis=0.1),
        irregularity=wt.Step(height=1e-4, position=0.1), start={"displacement": 1e-4}, speed=5, duration=0.05,
    )  # fmt: skip
    asked = [wt.features.time_in_air(), wt.features.first_loss(), wt.features.number_of_impacts()]
    over = {"start.displacement": [1e-4, 2e-4], "track.mass": [2e3, 4e3], "contact.hysteresis": [0.1, 0.3]}
    chart = wt.sweep(scene, over, asked)
    for cell in np.ndindex(2, 2, 2):
        record = wt.simulate(
            scene.replaced({path: values[i] for (path, values), i in zip(over.items(), cell, strict=True)})
        )
        assert float(chart.time_in_air[cell]) == pytest.approx(record.time_in_air, rel=1e-9)
        assert float(chart.number_of_impacts[cell]) == record.impacts.sizes["impact"]
        losses = record.events.time.values[record.events.kind.values == "loss"]
        assert float(chart.first_loss[cell]) == pytest.approx(losses[0], rel=1e-9)


@pytest.mark.parametrize("gradient", [False, True])
def test_a_map_checks_the_energy_of_its_cells_on_request(gradient, monkeypatch):
    over = {"irregularity.0.height": [1e-4, 2e-4], "vehicle.damping": [2e4, 5e4]}
    marched = []

    def damaged(program):
        march = run.march(program)
        marched.append(program)
        return march._replace(steps=np.delete(march.steps, 20, axis=0)) if len(marched) == 3 else march

    monkeypatch.setattr(balanced, "run", SimpleNamespace(**vars(run) | {"march": damaged}))
    plain = wt.sweep(BUMP, over, PAIR, gradient=gradient)
    assert not marched
    checked = wt.sweep(BUMP, over, [*PAIR, wt.features.missing_energy()], gradient=gradient)
    assert len(marched) == 4
    np.testing.assert_array_equal(checked.missing_energy > balanced.LIMIT, [[False, False], [True, False]])
    assert float(checked.missing_energy[0].max()) < balanced.NOTABLE
    np.testing.assert_array_equal(checked.force_ratio, plain.force_ratio)
