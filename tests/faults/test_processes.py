"""Processes that die, callbacks that raise: other work goes on, and what is computed is kept."""

import json
import sys
import time
from itertools import count
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from tests.faults import tasks
from tests.faults.test_stores import files, written
from wheeltapper.ask import spec
from wheeltapper.ask.fill import fill_store
from wheeltapper.ask.store import Store
from wheeltapper.diagnosis import folder, performance, processes, train
from wheeltapper.diagnosis.processes import Lost, ProcessError, in_processes
from wheeltapper.faces.cli import main
from wheeltapper.ground.progress import reporting

SITE = Path(__file__).parents[2] / "examples" / "site.toml"
posix = pytest.mark.skipif(sys.platform == "win32", reason="no process is killed by a signal there")


# -- processes --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@posix
def test_a_process_that_dies_takes_no_other_task_with_it(tmp_path):
    how = ["well", "always", "well", "once", "well", "exit", "late", "well", "answering", "well"]
    found = dict(in_processes(tasks.squared, tmp_path, list(enumerate(how)), 2))
    assert found.pop(1) == Lost("was ended by SIGKILL")
    assert found.pop(5) == Lost("ended with exit code 7")
    assert found == {i: i**2 for i in range(10) if i not in (1, 5)}
    assert [len((tmp_path / str(i)).read_text()) for i in range(10)] == [1, 2, 1, 2, 1, 2, 2, 1, 2, 1]
    assert not active_children()


@posix
@pytest.mark.parametrize("doomed", [range(1), range(3), range(1, 1000), range(1000)], ids=str)
def test_processes_that_are_killed_as_they_start_are_replaced_while_there_is_room(doomed, tmp_path, monkeypatch):
    started = count()

    class Killed(processes._Worker):
        def __init__(self, *given):
            super().__init__(*given)
            if next(started) in doomed:
                self._process.kill()

    monkeypatch.setattr(processes, "_Worker", Killed)
    if len(doomed) < 1000:
        found = dict(in_processes(tasks.squared, tmp_path, [(i, "well") for i in range(6)], 2))
        assert found == {i: i**2 for i in range(6)}
    else:
        with pytest.raises(ProcessError, match="4 processes died as they started, the last one was ended by SIGKILL"):
            dict(in_processes(tasks.squared, tmp_path, [(i, "well") for i in range(6)], 2))
        assert not list(tmp_path.iterdir())
    assert not active_children()


@posix
def test_a_process_that_is_killed_before_it_is_given_its_task_is_replaced(tmp_path, monkeypatch):
    class Killed(processes._Worker):
        left = 1

        def take(self, waiting):
            if Killed.left:
                Killed.left -= 1
                self._process.kill()
                self._process.join()
            super().take(waiting)

    monkeypatch.setattr(processes, "_Worker", Killed)
    found = dict(in_processes(tasks.squared, tmp_path, [(i, "well") for i in range(4)], 2))
    assert found == {i: i**2 for i in range(4)}


@pytest.mark.parametrize(
    ("which", "kind", "said"),
    [
        ("ValueError", ValueError, "bad"),
        ("InputError", wt.InputError, "a: b: found c; allowed: d"),
        ("other", RuntimeError, "TwoReasonsError: no and pickle"),
    ],
)
def test_what_a_task_raises_is_raised_by_whoever_asked(which, kind, said):
    with pytest.raises(kind) as caught:
        list(in_processes(tasks.raising, None, [which] * 3, 2))
    assert str(caught.value) == said
    assert "tasks.py" in "".join(caught.value.__notes__)
    assert not active_children()


def test_whoever_stops_before_the_end_ends_the_processes(tmp_path):
    found = in_processes(tasks.squared, tmp_path, [(0, "well"), (1, "asleep"), (2, "asleep")], 2)
    assert next(found) == (0, 0)
    assert active_children()
    begun = time.monotonic()
    found.close()
    assert not active_children()
    assert time.monotonic() - begun < 5.0


# -- folders, trains, studies -----------------------------------------------------------------------------------------


def quiet(path):
    wt.diagnosis.write_recording(
        wt.diagnosis.Recording(0.07 * np.random.default_rng(1).standard_normal(4000), 20e3), path
    )
    return path


def second_is_lost(function, shared, tasks, workers):
    yield from ((i, Lost("was ended by SIGKILL") if i == 1 else function(shared, task)) for i, task in enumerate(tasks))


@pytest.mark.slow
@posix
@pytest.mark.parametrize("killed", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_recording_that_kills_its_process_is_one_row(killed, tmp_path, monkeypatch, capsys):
    files = [quiet(tmp_path / name) for name in ("1.csv", "2_kill.csv", "3.csv")]
    found, command = tmp_path / "found", ["diagnose", *map(str, files), "--site", str(SITE), "--workers"]
    command += ["2" if killed else "1", "--output", str(tmp_path / "found")]
    with monkeypatch.context() as during:
        if killed:
            during.setattr(folder, "_diagnose_file", tasks.one_diagnosed)
        else:
            during.setattr(folder, "in_processes", second_is_lost)
        assert main(command) == 3
        said = capsys.readouterr().out
        assert f"{files[1]}: two processes died of it, and the last one was ended by SIGKILL" in said
        assert "3 recordings: 2 no wheel, 1 not diagnosed" in said
        assert json.loads((found / "2_kill.csv.json").read_text())["verdict"] == "not diagnosed"
    assert main(command) == 0  # what was not diagnosed is tried again
    assert "3 recordings: 3 no wheel" in capsys.readouterr().out


def test_a_wheelset_that_kills_its_process_is_one_row(monkeypatch):
    samples = 0.07 * np.random.default_rng(1).standard_normal(4000)
    monkeypatch.setattr(train, "in_processes", second_is_lost)
    found = train.diagnose_train([wt.diagnosis.Recording(samples, 20e3) for _ in range(3)], SITE)
    assert [row["verdict"] for row in found.table()] == ["no wheel", "not diagnosed", "no wheel"]
    assert found.axles[1]["paragraph"] == "recording: two processes died of it, and the last one was ended by SIGKILL"
    assert "not healthy: 1, 2, 3" in str(found)


def test_who_wants_to_stop_at_a_recording_that_kills_its_process_is_told(tmp_path, monkeypatch):
    files = [quiet(tmp_path / f"{i}.csv") for i in range(2)]
    monkeypatch.setattr(folder, "in_processes", second_is_lost)
    with pytest.raises(ProcessError, match=r"1\.csv: two processes died of it"):
        folder.diagnose_all(files, SITE, raising=True)


@pytest.fixture
def computed(monkeypatch):
    """Passages that cost nothing; a list of those that were asked for."""
    asked = []

    def passage(site, task):
        asked.append((task[0], task[2]))
        return performance.DiagnosedPassage(task[0], task[2], 1.1, "healthy", False, 0.0, {"suspension": 0.0}, 1.1)

    monkeypatch.setattr(performance, "_diagnosed_passage", passage)
    return asked


def test_passages_that_kill_their_process_are_named_and_the_others_kept(tmp_path, monkeypatch, computed, capsys):
    command = ["assess", str(SITE), "--faults", "mass deviation", "--count", "3", "--workers", "1"]
    command += ["--output", str(tmp_path / "found.json")]
    with monkeypatch.context() as during:
        during.setattr(performance, "in_processes", second_is_lost)
        assert main(command) == 3
    error = capsys.readouterr().err
    assert "1 of 6 passages were not computed; mass deviation 1: two processes died of it" in error
    assert "the same command goes on" in error
    assert len((tmp_path / "found.jsonl").read_text().splitlines()) == 5
    computed.clear()
    assert main(command) == 0
    assert computed == [("mass deviation", 1)]


def test_a_line_that_was_cut_off_costs_no_other_passage(tmp_path, computed):
    path = tmp_path / "found.jsonl"

    def assessed():
        computed.clear()
        performance.assess(SITE, ["mass deviation"], count=2, output=path, workers=1)
        return len(computed)

    assert assessed() == 4
    whole = path.read_bytes()
    path.write_bytes(whole[:-30])
    assert (assessed(), assessed()) == (1, 0)
    path.write_bytes(b'5\n{"site": 1}\n\xff\n[]\n' + whole)
    assert assessed() == 0


def test_passages_are_kept_only_while_the_sites_files_stay(tmp_path, computed):
    surface = tmp_path / "surface.csv"
    site = wt.load(SITE)
    for height, many in ((0.1, 4), (0.1, 0), (0.2, 4)):
        rows = (f"{x:.3f};{height * np.sin(9.0 * x) ** 2:.4f}\n" for x in np.linspace(0.0, 2.0, 41))
        surface.write_text("x [m];z [mm]\n" + "".join(rows))
        item = wt.Measured(path=surface, beyond="flat")
        here = wt.diagnosis.Site(passage=site.passage.replaced({"irregularity": item}), sensor=site.sensor)
        computed.clear()
        performance.assess(here, ["mass deviation"], count=2, output=tmp_path / "found.jsonl", workers=1)
        assert len(computed) == many


# -- callbacks --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_what_a_callback_raises_reaches_the_user_and_what_is_kept_is_whole(workers, tmp_path):
    files = [quiet(tmp_path / f"{i}.csv") for i in range(4)]

    def stop(what, done, of):
        if done:
            raise LookupError("my own")

    for given in ({"progress": stop}, {"after": tasks.refusing}):
        found = tmp_path / f"found {[*given]}"
        with pytest.raises(LookupError, match="my own"):
            folder.diagnose_all(files, SITE, output=found, workers=workers, **given)
        assert not active_children()
        kept = [json.loads(path.read_text())["verdict"] for path in found.glob("*.json")]
        assert kept
        assert set(kept) == {"no wheel"}
        entries = folder.diagnose_all(files, SITE, output=found, workers=1)
        assert [entry["verdict"] for entry in entries] == ["no wheel"] * 4


def test_what_no_process_can_be_sent_is_refused_before_anything_is_done(tmp_path):
    files = [quiet(tmp_path / f"{i}.csv") for i in range(2)]
    with pytest.raises(
        wt.InputError, match=r"^workers: found more than one process, .*lambda.*; allowed: 1, or"
    ) as caught:
        folder.diagnose_all(files, SITE, output=tmp_path / "found", workers=2, after=lambda *_: None)
    assert "\n" not in str(caught.value)
    assert not active_children()
    bump = wt.Profile(function=lambda x: 1e-4 * np.sin(x) ** 2)
    site = wt.load(SITE)
    site = wt.diagnosis.Site(passage=site.passage.replaced({"irregularity": bump}), sensor=site.sensor)
    with pytest.raises(wt.InputError, match=r"^workers: found more than one process"):
        performance.assess(site, ["mass deviation"], count=2, workers=2)
    for call in (performance.assess, lambda site, **more: folder.diagnose_all(files, site, **more)):
        with pytest.raises(wt.InputError, match=r"^output: found a site with a Profile"):
            call(site, output=tmp_path / "kept")


class MyOwnError(Exception):
    pass


def raised_after(calls):
    """Return a callback that raises when it is called for the second time."""

    def progress(*told):
        calls.append(told)
        if len(calls) == 2:
            raise MyOwnError(2)

    return progress


def test_passages_that_a_callback_stops_go_on(tmp_path, computed):
    given = {"count": 3, "output": tmp_path / "found.jsonl", "workers": 1}
    with pytest.raises(MyOwnError, match=r"^2$"):
        performance.assess(SITE, ["mass deviation"], **given, progress=raised_after([]))
    assert len(computed) == 1
    performance.assess(SITE, ["mass deviation"], **given)
    assert len(computed) == len(set(computed)) == 6


@pytest.mark.slow
def test_wheels_that_a_callback_stops_go_on(tmp_path):
    vehicle = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
    bump = wt.CosineBump(height=1e-4, length=0.05, start=0.02)
    scene = wt.Scenario(
        vehicle=vehicle, contact=wt.contact.Thornton(), irregularity=bump, rolling="point", speed=5.0, duration=0.03
    )
    with pytest.raises(MyOwnError, match=r"^2$"):
        wt.wear_in(scene, 4, every=1, store=tmp_path / "a.nc", progress=raised_after([]))
    assert wt.load(tmp_path / "a.nc").sizes["pass"] == 2
    done = []
    more = wt.wear_in(scene, 4, every=1, store=tmp_path / "a.nc", progress=lambda *told: done.append(told))
    assert done == [("passes", 3, 4), ("passes", 4, 4)]
    np.testing.assert_array_equal(more.height, wt.wear_in(scene, 4, every=1).height)


def test_a_design_that_a_callback_stops_says_so():
    with pytest.raises(MyOwnError, match=r"^2$"):
        wt.design_site(SITE, budget=50, progress=raised_after([]))


def test_a_store_that_a_callback_stops_goes_on(tmp_path):
    study = spec.read_study(written(tmp_path))
    with pytest.raises(MyOwnError, match=r"^2$"), reporting(raised_after([]), say=lambda line: None):
        fill_store(Store(tmp_path / "a.zarr", study))
    fill_store(Store(tmp_path / "a.zarr", study), resume=True)
    fill_store(Store(tmp_path / "b.zarr", study))
    assert files(tmp_path / "a.zarr") == files(tmp_path / "b.zarr")
