"""Stores survive what happens to long computations: they hold each cell once, and the same bits as if nothing had."""

import json
import os
import random
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
from wheeltapper.ask import fill as filling
from wheeltapper.ask import spec
from wheeltapper.ask import store as stores
from wheeltapper.faces.cli import main
from wheeltapper.ground.locks import locked

SCENARIO = """
speed = 9.0
duration = 0.12
rolling = "point"
[vehicle]
type = "Wheelset"
mass = 1500
load = 91307
stiffness = 2.44e6
damping = 5e4
[contact]
type = "Hertz"
constant = 1.405e11
[[irregularity]]
type = "CosineBump"
height = "0.2 mm"
length = "50 mm"
start = 0.009
"""
STUDY = """
scenario = "bump.toml"
features = ["impact_interval", {{ type = "largest_force", over_static = true, name = "peak" }}]
gradient = {gradient}
chunk = {chunk}
[over]
vehicle.damping = {{ from = 2e4, to = 1e5, count = {count} }}
vehicle.mass = ["800 kg", "1 t", 1500, 2000]
"""


def written(folder, count=10, chunk=8, gradient="false"):
    (folder / "bump.toml").write_text(SCENARIO)
    path = folder / "study.toml"
    path.write_text(STUDY.format(count=count, chunk=chunk, gradient=gradient))
    return path


def files(path):
    return {str(file.relative_to(path)): file.read_bytes() for file in sorted(path.rglob("*")) if file.is_file()}


@pytest.mark.slow
@pytest.mark.parametrize("gradient", ["false", "true", '["speed"]'])
def test_a_store_opens_in_plain_xarray_and_holds_what_sweep_says(tmp_path, capsys, gradient):
    study, store = written(tmp_path, gradient=gradient), tmp_path / "map.zarr"
    assert main(["sweep", str(study), "--output", str(store)]) == 0
    assert "store:" in capsys.readouterr().out
    scene = wt.Scenario.from_toml(tmp_path / "bump.toml")
    asked = [wt.features.impact_interval(), wt.features.largest_force(over_static=True).renamed("peak")]
    over = {"vehicle.damping": np.linspace(2e4, 1e5, 10), "vehicle.mass": [800.0, 1000.0, 1500.0, 2000.0]}
    expected = wt.sweep(scene, over, asked, gradient=json.loads(gradient))
    with xr.open_zarr(store) as held:
        held = held.load()
    assert set(held.variables) == set(expected.variables)
    for name in expected.variables:
        if expected[name].dtype.kind == "f":
            np.testing.assert_allclose(held[name], expected[name], rtol=1e-9, atol=1e-12)
        else:
            assert (held[name].values == expected[name].values).all()
        for attribute in ("units", "long_name"):
            assert held[name].attrs.get(attribute) == expected[name].attrs.get(attribute)
    assert held.attrs["wheeltapper"] == expected.attrs["wheeltapper"]
    assert json.loads(held.attrs["scenario"]) == json.loads(expected.attrs["scenario"])
    wt.plot(held)
    assert not list(tmp_path.glob("*.lock"))


def test_samples_and_zipped_lists_go_to_stores_too(tmp_path):
    (tmp_path / "bump.toml").write_text(SCENARIO)
    study = tmp_path / "cloud.toml"
    study.write_text(
        'scenario = "bump.toml"\nfeatures = "first_loss"\nsamples = 32\nsampling = "latin hypercube"\nchunk = 10\n'
        '[over]\n"vehicle.mass" = [1000, 2000]\nspeed = ["30 km/h", "40 km/h"]\n'
    )
    assert main(["sweep", str(study), "--output", str(tmp_path / "cloud.zarr")]) == 0
    with xr.open_zarr(tmp_path / "cloud.zarr") as held:
        assert dict(held.sizes) == {"cell": 32}
        assert np.isfinite(held.first_loss.values).all()
        assert {"vehicle.mass", "speed"} <= set(held.variables)


def test_a_chart_that_xarray_saved_is_loaded_and_one_of_a_newer_format_refused(tmp_path):
    (tmp_path / "bump.toml").write_text(SCENARIO)
    scene = wt.Scenario.from_toml(tmp_path / "bump.toml")
    over = {"vehicle.damping": [4e4, 5e4, 6e4], "vehicle.mass": [1400.0, 1500.0]}
    chart = wt.sweep(scene, over, ["impact_interval"], gradient=True)
    chart.to_netcdf(tmp_path / "map.nc")
    held = wt.load(tmp_path / "map.nc")
    xr.testing.assert_identical(held, chart)
    assert wt.plot(held).axes[0].get_xlabel() == wt.plot(chart).axes[0].get_xlabel()
    chart.assign_attrs(format=chart.attrs["format"] + 1).to_netcdf(tmp_path / "newer.nc")
    with pytest.raises(wt.InputError, match=r"newer\.nc: format: found 3; allowed: at most 2"):
        wt.load(tmp_path / "newer.nc")


def test_a_store_that_was_stopped_anywhere_goes_on_to_the_same_bits(tmp_path, monkeypatch):
    study = written(tmp_path)
    whole, broken = tmp_path / "whole.zarr", tmp_path / "broken.zarr"
    assert main(["sweep", str(study), "--output", str(whole)]) == 0
    plain = stores.Store.write
    computed = []

    def stopping(self, place, threads):
        if len(computed) % 2 == 1:
            computed.append(None)
            raise KeyboardInterrupt
        computed.append(place)
        return plain(self, place, threads)

    monkeypatch.setattr(stores.Store, "write", stopping)
    runs = 0
    while main(["sweep", str(study), "--output", str(broken), *(["--resume"] if runs else [])]) == 3:
        runs += 1
        assert runs < 20
    assert runs == 4
    places = [place for place in computed if place is not None]
    assert len(places) == len(set(places)) == 5  # nothing twice
    assert files(whole) == files(broken)


def test_a_full_disk_is_said_and_costs_nothing(tmp_path, monkeypatch, capsys):
    study = written(tmp_path)
    whole, broken = tmp_path / "whole.zarr", tmp_path / "broken.zarr"
    assert main(["sweep", str(study), "--output", str(whole)]) == 0
    import zarr.storage._local as disk

    plain, budget = disk._put, [28]

    def full(path, value, exclusive=False):
        budget[0] -= 1
        if budget[0] < 0:
            raise OSError(28, "No space left on device")
        return plain(path, value, exclusive)

    monkeypatch.setattr(disk, "_put", full)
    assert main(["sweep", str(study), "--output", str(broken)]) == 3
    assert "No space left" in capsys.readouterr().err
    monkeypatch.setattr(disk, "_put", plain)
    assert main(["sweep", str(study), "--output", str(broken), "--resume"]) == 0
    assert files(whole) == files(broken)


def test_a_poisonous_chunk_is_named_and_does_not_stop_the_rest(tmp_path, monkeypatch, capsys):
    study, store = written(tmp_path), tmp_path / "map.zarr"
    plain = stores.Store.write

    def poisoned(self, place, threads):
        if place == (2, 0):
            raise ZeroDivisionError("poison")
        return plain(self, place, threads)

    monkeypatch.setattr(stores.Store, "write", poisoned)
    assert main(["sweep", str(study), "--output", str(store)]) == 3
    said = capsys.readouterr().err
    assert "poison" in said
    assert "vehicle.damping 55555.6 to 64444.4, vehicle.mass 800 to 2000" in said
    with xr.open_zarr(store) as held:
        assert int((held.status == -1).sum()) == 8
        assert int((held.status == 0).sum()) == 32
    monkeypatch.setattr(stores.Store, "write", plain)
    assert main(["sweep", str(study), "--output", str(store), "--resume"]) == 0


def test_what_is_no_store_of_this_study_is_refused(tmp_path, capsys):
    study, store = written(tmp_path), tmp_path / "map.zarr"
    assert main(["sweep", str(study), "--output", str(store)]) == 0

    def refused(*arguments, text):
        assert main(["sweep", *map(str, arguments)]) == 2
        assert text in capsys.readouterr().err

    refused(study, "--output", store, text="--resume to go on")
    other = tmp_path / "other"
    other.mkdir()
    refused(written(other, count=11), "--output", store, "--resume", text="the store of another study")
    (store / "status" / "zarr.json").unlink()
    refused(study, "--output", store, "--resume", text="status: found no readable metadata; allowed: a whole store")
    (store / "zarr.json").write_text("{ trunca")
    refused(study, "--output", store, "--resume", text="no whole store")
    foreign = tmp_path / "foreign.zarr"
    xr.Dataset({"a": ("x", [1.0])}).to_zarr(foreign, consolidated=False)
    refused(study, "--output", foreign, "--resume", text="a store that wheeltapper did not write")
    refused(study, "--output", tmp_path / "map.nc", text=".zarr")
    refused(study, "--output", tmp_path / "none" / "map.zarr", text="cannot be written")
    refused(study, "--output", tmp_path / "x.zarr", "--workers", "2", "--scheduler", "a:1", text="one of them")
    refused(study, "--output", tmp_path / "x.zarr", "--workers", "2", "--threads", "3", text="--threads: found 3")
    assert not (tmp_path / "x.zarr").exists()


def test_a_second_driver_is_refused(tmp_path, capsys):
    study, store = written(tmp_path), tmp_path / "map.zarr"
    with locked(store):
        assert main(["sweep", str(study), "--output", str(store)]) == 2
    assert "another process" in capsys.readouterr().err
    assert main(["sweep", str(study), "--output", str(store)]) == 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "scenario: found nothing"),
        ('scenario = "none.toml"\nfeatures = "first_loss"\n[over]\nspeed = [9]', "none.toml"),
        ('scenario = "bump.toml"\nfeatures = "first_los"\n[over]\nspeed = [9]', "first_loss"),
        ('scenario = "bump.toml"\nfeatures = [{ type = "impulse", impakt = 2 }]\n[over]\nspeed = [9]', "impakt"),
        ('scenario = "bump.toml"\nfeatures = "first_loss"\nspeed = 3\n[over]\nspeed = [9]', "unknown name 'speed'"),
        ('scenario = "bump.toml"\nfeatures = "first_loss"\n[over]\nspeed = { from = 1, to = 2 }', "count"),
        (
            'scenario = "bump.toml"\nfeatures = "first_loss"\n[over]\nspeed = { from = 1, to = 2, count = 0 }',
            "at least 1",
        ),
        ('scenario = "bump.toml"\nfeatures = "first_loss"\n[over]\nvehicle.wheels = [1, 2]', "no continuous number"),
        ('scenario = "bump.toml"\nfeatures = "first_loss"\nchunk = 0\n[over]\nspeed = [9]', "at least 1"),
        ('format = 9\nscenario = "bump.toml"\nfeatures = "first_loss"\n[over]\nspeed = [9]', "newer"),
        ("scenario = [", "not TOML"),
    ],
)
def test_a_wrong_study_is_refused_with_one_clear_message(tmp_path, capsys, text, said):
    written(tmp_path)
    study = tmp_path / "wrong.toml"
    study.write_text(text)
    assert main(["sweep", str(study), "--output", str(tmp_path / "map.zarr")]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert ".toml" in message
    assert not (tmp_path / "map.zarr").exists()


def command(study, store, *more):
    return [sys.executable, "-m", "wheeltapper.faces.cli", "sweep", str(study), "--output", str(store), *more]


def swept(study, store, *more):
    """Compute a study in a process that loads its kernels: here they may just be compiled, and round otherwise."""
    done = subprocess.run(command(study, store, *more), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_two_worker_processes_write_the_same_bits(tmp_path):
    study = written(tmp_path, count=40, chunk=16)
    alone, shared = tmp_path / "alone.zarr", tmp_path / "shared.zarr"
    swept(study, alone)
    done = subprocess.run(command(study, shared, "--workers", "2"), capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "dashboard: http" in done.stderr
    assert files(alone) == files(shared)


ON_RAILS = """
scenario = "flat.toml"
features = ["largest_force", "time_in_air"]
gradient = {gradient}
chunk = 4
[over]
speed = [15.0, 22.0]
irregularity.0.length = {{ from = 0.03, to = 0.06, count = 4 }}
"""


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize("gradient", ["false", "true"])
def test_a_study_on_rails_has_the_same_bits_by_two_worker_processes(tmp_path, gradient):
    track = wt.tracks.Ballasted.named("rolland_UIC60_example").model_copy(update={"cutoff": 2000.0, "bays": 40})
    wt.Scenario(
        vehicle=wt.Wheelset(mass=1200, load=188_228), track=track, contact=wt.Hertz(constant=1.8825e11),
        irregularity=wt.WheelFlat(length=0.06, position=0.05), speed=20, duration=0.03,
    ).to_toml(tmp_path / "flat.toml")  # fmt: skip
    study, alone, shared = (tmp_path / name for name in ("study.toml", "alone.zarr", "shared.zarr"))
    study.write_text(ON_RAILS.format(gradient=gradient))
    swept(study, alone)
    swept(study, shared, "--workers", "2")
    assert files(alone) == files(shared)
    with xr.open_zarr(shared) as held:
        assert (held.status == 0).all()
        assert float(held.time_in_air.max()) > 0.0


POISON = """
import os, sys
if any("spawn" in part or "multiprocessing" in part for part in sys.orig_argv):
    from wheeltapper.ask import store
    plain = store.Store.write
    def write(self, place, threads):
        if place == (2, 0):
            os._exit(1)
        return plain(self, place, threads)
    store.Store.write = write
"""


@pytest.mark.whole
@pytest.mark.slow
def test_a_chunk_that_kills_its_workers_is_named_and_does_not_stop_the_rest(tmp_path):
    study, store = written(tmp_path), tmp_path / "map.zarr"
    (tmp_path / "sitecustomize.py").write_text(POISON)
    poisoned = os.environ | {"PYTHONPATH": str(tmp_path), "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}
    done = subprocess.run(
        command(study, store, "--workers", "2"), capture_output=True, text=True, timeout=240, env=poisoned
    )
    assert done.returncode == 3, done.stderr
    assert "vehicle.damping 55555.6 to 64444.4, vehicle.mass 800 to 2000: KilledWorker" in done.stderr
    with xr.open_zarr(store) as held:
        assert int((held.status == -1).sum()) == 8
        assert int((held.status == 0).sum()) == 32
    swept(study, store, "--resume")
    whole = tmp_path / "whole.zarr"
    swept(study, whole)
    assert files(whole) == files(store)


@pytest.mark.whole
@pytest.mark.slow
def test_a_cluster_at_an_address_writes_the_same_bits(tmp_path):
    study = written(tmp_path, count=40, chunk=16)
    alone, shared, where = tmp_path / "alone.zarr", tmp_path / "shared.zarr", tmp_path / "scheduler.json"
    swept(study, alone)
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    cluster = [
        subprocess.Popen(
            [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", where],
            **quiet,
        )
    ]
    try:
        began = time.monotonic()
        while not where.exists() or not where.read_text().strip():
            assert time.monotonic() - began < 60
            time.sleep(0.1)
        worker = [*dask, "worker", "--scheduler-file", where, "--nthreads", "1", "--no-dashboard"]
        cluster += [subprocess.Popen(worker, **quiet) for _ in range(2)]
        address = json.loads(where.read_text())["address"]
        done = subprocess.run(
            command(study, shared, "--scheduler", address), capture_output=True, text=True, timeout=120
        )
    finally:
        for process in reversed(cluster):
            process.terminate()
            process.wait(timeout=60)
    assert done.returncode == 0, done.stderr
    assert files(alone) == files(shared)


def offspring(parent):
    """Return the processes below one, workers and their nannies among them."""
    children = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        children.setdefault(int(fields[1]), []).append(int(stat.parent.name))
    found, waiting = [], [parent]
    while waiting:
        below = children.get(waiting.pop(), [])
        found += below
        waiting += below
    return found


@pytest.mark.slow
@pytest.mark.whole
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="finds the workers in /proc")
def test_twenty_kills_of_workers_and_drivers_leave_the_same_bits(tmp_path):
    study = written(tmp_path, count=3000, chunk=40, gradient="true")
    whole, broken = tmp_path / "whole.zarr", tmp_path / "broken.zarr"
    swept(study, whole)
    dice, errors = random.Random(7), tmp_path / "errors"
    kills, code, began = 0, None, time.monotonic()
    while code != 0:
        assert time.monotonic() - began < 240
        more = ["--resume"] if broken.exists() else []
        with errors.open("w") as said:
            driver = subprocess.Popen(
                command(study, broken, "--workers", "2", *more), stdout=subprocess.DEVNULL, stderr=said,
                start_new_session=True,
            )  # fmt: skip
        for _ in range(5):
            time.sleep(dice.uniform(0.2, 1.5) + (2.5 if _ == 0 else 0.0))
            if kills >= 22 or driver.poll() is not None:
                break
            victims = offspring(driver.pid)
            if _ == 4 or not victims:
                os.killpg(driver.pid, signal.SIGKILL)
                kills += 1
                break
            victim = dice.choice(victims)
            try:
                os.kill(victim, signal.SIGKILL)
                kills += 1
            except ProcessLookupError:
                pass
        code = driver.wait(timeout=200)
        for left in offspring(driver.pid):
            os.kill(left, signal.SIGKILL)
        assert code in (0, 3, -signal.SIGKILL), errors.read_text()
    assert kills >= 20
    assert files(whole) == files(broken)


def test_kernels_are_compiled_before_the_first_chunk_is_given_to_a_worker(tmp_path, monkeypatch):
    store = stores.Store(tmp_path / "map.zarr", spec.read_study(written(tmp_path)))
    done = []
    monkeypatch.setattr("wheeltapper.ask.store.compute_cells", lambda study, changed, threads: done.append(changed))
    store.compile_first()
    assert [{path: values.tolist() for path, values in cell.items()} for cell in done] == [
        {"vehicle.damping": [2e4], "vehicle.mass": [800.0]}
    ]


def test_a_scheduler_that_does_not_answer_is_waited_for_with_a_word_and_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(filling, "ANSWER", 0.5)
    study = written(tmp_path)
    for address in ("tcp://127.0.0.1:9", "nonsense"):
        assert main(["sweep", str(study), "--output", str(tmp_path / "x.zarr"), "--scheduler", address]) == 2
        said = capsys.readouterr().err
        assert f"looking for the scheduler at {address}, for 0.5 s at most" in said
        assert f"--scheduler: found '{address}', where no scheduler answers in 0.5 s" in said
        shutil.rmtree(tmp_path / "x.zarr")
