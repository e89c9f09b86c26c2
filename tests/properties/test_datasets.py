"""Data sets of labelled passages: each is the run that its labels say, as its sensors record it."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from tests.faults.test_stores import files
from wheeltapper.ask.filled import FilledStore
from wheeltapper.diagnosis import CATALOGUE, DatasetPlan, make_dataset
from wheeltapper.diagnosis.dataset.passages import passage_of, scenario_of
from wheeltapper.diagnosis.dataset.store import DatasetStore
from wheeltapper.faces.cli import main

EXAMPLE = Path(__file__).parents[2] / "examples" / "flats_dataset.toml"
SHIPPED = EXAMPLE.parent / "data" / "flats.zarr"
RAILS = {
    "scenario": wt.Scenario(
        vehicle=wt.Wheelset(mass=1200, load=188_228),
        track=wt.tracks.Ballasted(
            rail="UIC60", spacing=0.6, pad_stiffness=1.8e8, pad_damping=1.8e4, sleeper_mass=150,
            ballast_stiffness=1.05e8, ballast_damping=4.8e4,
        ),
        contact=wt.Hertz(constant=1.8825e11), speed=25.0, duration=0.3,
    ),
    "sensors": (
        wt.sensors.RailShearForce(name="left 1", x1=3.7, x2=4.1, rate=10e3),
        wt.sensors.PadForce(name="pad", seat=6, rate=10e3),
    ),
    "vary": {"vehicle.load": {"from": 1e5, "to": 2e5}, "sensors.left 1.gain": {"mean": 1.0, "deviation": 0.05}},
    "faults": {"healthy": {}, "wheel flat": {"size": ["30 mm", "50 mm"]}},
    "seed": 4,
}  # fmt: skip

BOGIE = wt.vehicles.Bogie(
    wheelset_mass=1200, frame_mass=3000, pitch_inertia=2500, wheelbase=1.8, primary_stiffness=2e6, primary_damping=2e4,
    secondary_stiffness=1e6, secondary_damping=2e4, wheel_load=2e5,
)  # fmt: skip


def of_labels(found, number, plan):
    """Return the scenario that a passage's labels describe."""
    values = {row.path: float(found[row.path][number].squeeze()) for row in plan.rows}
    scene = plan.scenario.replaced({path: one for path, one in values.items() if not path.startswith("sensors.")})
    name = found.fault.attrs["flag_meanings"].split()[int(found.fault[number, 0])].replace("_", " ")
    if name == "healthy":
        assert np.isnan(found["size"][number, 0])
        return scene
    return CATALOGUE[name].passage(scene, float(found["size"][number, 0]), float(found["place"][number, 0]))


def test_each_passage_is_the_run_that_its_labels_say(tmp_path):
    plan = DatasetPlan.from_toml(EXAMPLE).model_copy(update={"count": 6, "chunk": 4})
    quiet = plan.sensors[0].model_copy(update={"noise": 0.0})
    plan = plan.model_copy(update={"sensors": (quiet,)})
    found = make_dataset(plan, tmp_path / "a.zarr", progress=False).load()
    assert {*found.status.values} == {0}
    assert len({*found.fault.values.ravel()}) > 1
    for number in range(6):
        record = wt.simulate(of_labels(found, number, plan))
        readings = record.recordings(quiet)["deck acceleration"].samples
        np.testing.assert_array_equal(found["deck acceleration"][number], readings.astype(np.float32))
        assert float(found.largest_force[number, 0]) == float(wt.features.largest_force()(record))


def test_the_deck_moves_as_in_recordings_that_are_synthesised(tmp_path):
    site = wt.diagnosis.Site.from_toml(EXAMPLE.with_name("site.toml"))
    sensor = site.sensor.model_copy(update={"noise": 0.0})
    plan = DatasetPlan(scenario=site.passage, sensors=(sensor,), faults={"wheel flat": {"size": 0.03, "place": 0.4}})
    (other,) = wt.synthesise(
        site, fault=wt.diagnosis.Condition("wheel flat", 0.03, 0.4), vary=False, noise=0.0, progress=False
    )
    np.testing.assert_array_equal(passage_of(plan, 0).readings["deck acceleration"], other.samples)


def test_a_passage_depends_neither_on_their_number_nor_on_what_else_is_drawn():
    plan = DatasetPlan.from_toml(EXAMPLE)
    more = plan.model_copy(
        update={"count": 99, "vary": plan.vary | {"track.damping": {"from": 4e4, "to": 6e4}}, "features": ()}
    )
    one, other = (passage_of(DatasetPlan.model_validate(each.model_dump(mode="json")), 3) for each in (plan, more))
    assert other.drawn.pop("track.damping") != 5e4
    assert one.drawn == other.drawn
    assert (one.part, one.vehicles[0].size, one.vehicles[0].drawn) == (
        other.part, other.vehicles[0].size, other.vehicles[0].drawn,
    )  # fmt: skip


def test_what_is_drawn_has_the_stated_shares_and_ranges():
    plan = DatasetPlan.from_toml(EXAMPLE)
    rows = {row.path: row for row in plan.rows}
    assert rows["speed"].draw.ends == (8.0, 12.0)
    random = np.random.default_rng(1)
    for path, mean, low, high in (
        ("speed", 10.0, 8.0, 12.0), ("vehicle.load", 91307.0, 55307.0, 127307.0),
        ("contact.constant", 4e10 / np.log(4 / 3), 1.2e11, 1.6e11), ("vehicle.radius", 0.44, 0.42, 0.46),
    ):  # fmt: skip
        drawn = np.array([rows[path].draw.drawn(random) for _ in range(4000)])
        assert low <= drawn.min() < drawn.max() <= high
        assert abs(drawn.mean() - mean) < 4.0 * drawn.std() / np.sqrt(4000)
    np.testing.assert_allclose(plan.shares, [0.5, 0.2, 0.1, 0.1, 0.1])


def test_a_train_is_the_sum_of_its_vehicles():
    train = DatasetPlan(**RAILS | {"vehicles": (0.0, 8.0), "vary": {"vehicle.load": [1e5, 2e5]}})
    found = passage_of(train, 0)
    samples = round(8.0 * 10e3 / 25.0)
    assert found.vehicles[1].distance == samples * 25.0 / 10e3
    scenes = [scenario_of(train, found.drawn, one) for one in found.vehicles]
    each = [wt.simulate(scene).recordings(list(train.sensors)) for scene in scenes]
    for name, readings in found.readings.items():
        whole = np.zeros(len(readings))
        whole[: len(each[0][name].samples)] += each[0][name].samples
        whole[samples:] += each[1][name].samples
        np.testing.assert_array_equal(readings, whole)


def test_gains_scale_readings_and_noise_is_as_large_as_stated():
    plain = DatasetPlan(**RAILS)
    noisy = DatasetPlan(**RAILS | {"noise": {"left 1": "0.5 kN"}})
    fixed = DatasetPlan(**RAILS | {"vary": {"vehicle.load": RAILS["vary"]["vehicle.load"]}})
    one, other, still = (passage_of(plan, 5) for plan in (plain, noisy, fixed))
    np.testing.assert_array_equal(one.readings["pad"], other.readings["pad"])
    np.testing.assert_allclose(
        one.readings["left 1"], one.drawn["sensors.left 1.gain"] * still.readings["left 1"], rtol=1e-9, atol=1e-6
    )
    left = other.readings["left 1"] - one.readings["left 1"]
    assert abs(left.std() - 500.0) < 4.0 * 500.0 / np.sqrt(2 * len(left))


@pytest.mark.parametrize("wheelset", [0, 1])
def test_a_fault_is_on_the_wheel_that_its_label_names(wheelset):
    scene = RAILS["scenario"].replaced({"vehicle": BOGIE})
    plan = DatasetPlan(**RAILS | {"scenario": scene, "vary": {}, "faults": {"wheel flat": {"size": "40 mm"}}})
    number = next(i for i in range(9) if passage_of(plan, i).vehicles[0].wheel == (wheelset,))
    forces = passage_of(plan, number).features[0, 0]
    assert forces[wheelset] > 1.2 * forces[1 - wheelset]


def test_runs_that_end_early_leave_nan_behind(tmp_path):
    fields = {"way": 6.0, "vary": {"speed": [20.0, 30.0]}, "count": 6, "faults": {"healthy": {}}}
    found = make_dataset(DatasetPlan(**RAILS | fields), tmp_path / "a.zarr", progress=False)
    known = np.isfinite(found["left 1"]).sum("time").values
    np.testing.assert_array_equal(known, np.floor(6.0 / found.speed.values * 10e3 * (1 + 1e-12)) + 1)
    assert found.sizes["time"] == known.max() == 3001


def test_passages_that_cannot_be_run_say_so_in_their_status(tmp_path, monkeypatch):
    plan = DatasetPlan.from_toml(EXAMPLE).model_copy(update={"count": 3})
    whole = make_dataset(plan, tmp_path / "a.zarr", progress=False).load()
    run = "wheeltapper.diagnosis.dataset.passages.simulated_quietly"
    plain, ran = wt.simulate, []
    trials = 1 + 2 * (len(plan.conditions) - 1)  # before the store is begun: healthy, and both sizes of each fault

    def refusing(scenario, method):
        ran.append(scenario)
        if len(ran) == trials + 2:
            raise wt.InputError("", "speed", "too much", "less")
        return plain(scenario, method=method)

    monkeypatch.setattr(run, refusing)
    found = make_dataset(plan, tmp_path / "b.zarr", progress=False).load()
    meanings = found.status.attrs["flag_meanings"].split()
    assert [meanings[one] for one in found.status.values] == ["complete", "refused", "complete"]
    assert np.isnan(found["deck acceleration"][1]).all()
    assert np.isnan(found.largest_force[1]).all()
    np.testing.assert_array_equal(found["deck acceleration"][2], whole["deck acceleration"][2])


def test_an_interrupted_data_set_goes_on_with_the_same_bits(tmp_path, monkeypatch):
    plan = DatasetPlan.from_toml(EXAMPLE).model_copy(update={"count": 7, "chunk": 2})
    make_dataset(plan, tmp_path / "whole.zarr", progress=False)
    plain, written = FilledStore.write, []

    def stopping(self, place, threads):
        if len(written) == 2:
            raise KeyboardInterrupt
        written.append(place)
        return plain(self, place, threads)

    monkeypatch.setattr(DatasetStore, "write", stopping)
    with pytest.raises(KeyboardInterrupt):
        make_dataset(plan, tmp_path / "broken.zarr", progress=False)
    monkeypatch.undo()
    with pytest.warns(UserWarning, match=r"3 of 7 passages are not computed; wheeltapper dataset --resume"):
        wt.load(tmp_path / "broken.zarr")
    make_dataset(plan, tmp_path / "broken.zarr", resume=True, progress=False)
    assert files(tmp_path / "broken.zarr") == files(tmp_path / "whole.zarr")


@pytest.mark.slow
@pytest.mark.whole
def test_killed_workers_lose_no_bit(tmp_path):
    told = ["dataset", str(EXAMPLE), "--count", "60", "--output"]
    assert main([*told, str(tmp_path / "whole.zarr")]) == 0
    text = EXAMPLE.read_text(encoding="utf-8").replace("count = 40", "count = 60\nchunk = 5")
    plan = tmp_path / "plan.toml"
    plan.write_text(text, encoding="utf-8")
    broken = tmp_path / "broken.zarr"
    command = [sys.executable, "-m", "wheeltapper.faces.cli", "dataset", str(plan), "--output", str(broken)]
    driver = subprocess.Popen([*command, "--workers", "2"], start_new_session=True)
    deadline = time.monotonic() + 300
    while not list(broken.glob("status/c/*")) and time.monotonic() < deadline and driver.poll() is None:
        time.sleep(0.1)
    os.killpg(driver.pid, signal.SIGKILL)
    driver.wait()
    assert main(["dataset", str(plan), "--output", str(broken), "--resume"]) == 0
    one, other = (xr.open_zarr(tmp_path / f"{name}.zarr").load() for name in ("whole", "broken"))
    assert other.sizes["passage"] == 60
    for name in one.variables:
        np.testing.assert_array_equal(one[name], other[name])


def test_the_command_writes_a_store_and_its_card(tmp_path, capsys):
    output = tmp_path / "flats.zarr"
    assert main(["dataset", str(EXAMPLE), "--output", str(output), "--count", "3"]) == 0
    card = output.with_suffix(".md").read_text(encoding="utf-8")
    for words in (
        "3 simulated passages",
        "CC-BY-4.0",
        "| speed | uniform, 8 to 12 | m/s | passage |",
        "| wheel flat |",
    ):
        assert words in card
    with xr.open_zarr(output) as found:
        assert found.attrs["card"] == card
        assert found.attrs["licence"] == "CC-BY-4.0"
    assert main(["dataset", str(EXAMPLE), "--output", str(output), "--count", "3"]) == 2
    assert "--resume to go on with it" in capsys.readouterr().err
    assert main(["dataset", str(EXAMPLE), "--output", str(output), "--count", "4", "--resume"]) == 2
    assert "the store of another data set" in capsys.readouterr().err


def test_the_shipped_data_set_is_that_of_the_example(tmp_path):
    shutil.copytree(SHIPPED, tmp_path / "copy.zarr")
    held = wt.load(tmp_path / "copy.zarr").load()
    plan = DatasetPlan.from_toml(EXAMPLE)
    assert DatasetPlan.model_validate(json.loads(held.attrs["study"])) == plan
    assert held.attrs["card"] == SHIPPED.with_suffix(".md").read_text(encoding="utf-8")
    for number in (0, 4, 23):
        found = passage_of(plan, number)
        assert found.vehicles[0].condition == int(held.fault[number, 0])
        scale = float(abs(held["deck acceleration"][number]).max())
        apart = abs(found.readings["deck acceleration"] - held["deck acceleration"][number].values).max()
        assert apart <= 2.0 * plan.sensors[0].step + 1e-6 * scale  # a step of the converter, where rounding differs


def test_a_sensor_that_reads_nothing_of_the_run_is_refused_before_the_store_is_begun(tmp_path):
    plan = DatasetPlan.from_toml(EXAMPLE).model_copy(update={"sensors": (wt.sensors.PadForce(name="pad", seat=3),)})
    with pytest.raises(wt.InputError, match="a FloatingDeck, of which nothing is read"):
        make_dataset(plan, tmp_path / "a.zarr", progress=False)
    assert not (tmp_path / "a.zarr").exists()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"faults": {"weak damper": {}}, "vehicle": BOGIE}, "faults.weak damper.*faults of treads"),
        ({"faults": {"weak damper": {}}}, "faults.weak damper.size.*changes nothing here"),
        ({"faults": {"wheel flat": {"size": ["20 mm", "1.5 m"]}}}, "faults.wheel flat.*less than 0.92 m"),
        ({"vary": {"speed": [0.0, 10.0]}, "way": 5.0}, "speed: found 0 m/s; allowed: more than 0 with `way`"),
        ({"vary": {"track.pad_stiffness": {"mean": 1e8, "deviation": 3e7}}}, "vary.track.pad_stiffness"),
        ({"vehicles": (0.0, 5.0, 5.0)}, "distances in m that rise from 0"),
        ({"sensors": (wt.sensors.DeckAcceleration(),), "vary": {}}, "deck acceleration.*on a Ballasted"),
        ({"features": ("largest_force", "largest_force")}, "which another variable has"),
    ],
)
def test_what_cannot_be_computed_is_refused_before_the_store_is_begun(tmp_path, changes, message):
    given = RAILS | changes
    if "vehicle" in changes:
        given = given | {"scenario": RAILS["scenario"].replaced({"vehicle": given.pop("vehicle")}), "vary": {}}
    with pytest.raises(wt.InputError, match=message):
        make_dataset(DatasetPlan(**given), tmp_path / "a.zarr", progress=False)
    assert not (tmp_path / "a.zarr").exists()


def test_a_healthy_label_beside_the_scenarios_own_flat_is_told(tmp_path):
    flawed = RAILS["scenario"].replaced({"irregularity": wt.WheelFlat(length=0.03, position=1.0)})
    plan = DatasetPlan(**RAILS | {"scenario": flawed, "count": 1})
    with pytest.warns(UserWarning, match="labelled healthy have the scenario's own WheelFlat"):
        make_dataset(plan, tmp_path / "a.zarr", progress=False)


def test_a_drop_has_no_speed(tmp_path):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=9e4), track=wt.FloatingDeck(mass=15e3, stiffness=1.5e7, damping=5e4),
        contact=wt.Hertz(constant=1.4e11), speed=0.0, duration=0.05, start={"displacement": 1e-3, "velocity": 0.0},
    )  # fmt: skip
    plan = DatasetPlan(scenario=scene, sensors=(wt.sensors.DeckAcceleration(),), faults={"healthy": {}}, count=2)
    found = make_dataset(plan, tmp_path / "a.zarr", progress=False)
    assert {*found.status.values} == {0}
    assert float(found.number_of_impacts.min()) >= 1.0


WRONG = {
    "count = 40": ("count = 0", "count"),
    '"wheel flat" = {': ('"wheel flatt" = {', "wheel flat"),
    'size = ["5 mm", "40 mm"]': ('size = ["50 mm", "40 mm"]', "faults.wheel flat.size"),
    "healthy = { share = 5 }": ("healthy = { share = 5, size = 1 }", "faults.healthy"),
    'speed = { from = "8 m/s", to = "12 m/s" }': ('speed = { from = "8 m/s" }', "vary.speed"),
    '"vehicle.load" = { mean = 91307, deviation = 9000 }': (
        '"vehicle.load" = { mean = 91307, deviation = 90000 }', "vary.vehicle.load"
    ),
    '"vehicle.radius" = [0.42, 0.44, 0.46]': ('"vehicle.radios" = [0.42]', "vary.vehicle.radios"),
    'kind = "deck acceleration"': ('kind = "pad force"\nname = "pad"\nseat = 3', "sensors.0"),
    'features = ["largest_force"': ('features = ["largest_forces"', "largest_force"),
    "parts = {": ("parts = { other = -1.0,", "parts"),
    'spacing = "log"': ('spacing = "logs"', "vary.contact.constant"),
    "seed = 2026": ("seed = 2026\nvehicles = [0.0, 5.0]", "sensors along the track"),
    "seed = 2026\n": ("seed = 2026\nnoise = { x = 1 }\n", "noise"),
    "[faults]": ("[fault]", "fault"),
}  # fmt: skip


@pytest.mark.parametrize("old", WRONG)
def test_bad_input_is_one_line_that_names_its_field(tmp_path, capsys, old):
    new, word = WRONG[old]
    text = EXAMPLE.read_text(encoding="utf-8")
    assert old in text
    plan = tmp_path / "plan.toml"
    plan.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert main(["dataset", str(plan), "--output", str(tmp_path / "a.zarr")]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1, said
    assert word in said[0]
    assert str(plan) in said[0]
    assert not (tmp_path / "a.zarr").exists()
