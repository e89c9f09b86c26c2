"""Wrong sites, recordings and options: one clear line and exit code 2, on the command line as in Python."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.scenario import write_toml
from wheeltapper.diagnosis import write_recording
from wheeltapper.faces.cli import main
from wheeltapper.record.recordings.speeds import read_speeds

EXAMPLES = Path(__file__).parents[2] / "examples"
SITE, RECORDING, BUMP = EXAMPLES / "site.toml", EXAMPLES / "data" / "deck_flat.csv.gz", EXAMPLES / "bump.toml"


def refused(capsys, *arguments):
    assert main([str(argument) for argument in arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("wheeltapper: ")
    assert "Traceback" not in error
    return error


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('rate = "20 kHz"', 'rate = "20 kg"', "sensor.rate"),
        ("bits = 16", "bitz = 16", "bits"),
        ('"vehicle.load" = 0.1', '"vehicle.lode" = 0.1', "vehicle.lode"),
        ("speed = 0.1", "speed = -0.1", "uncertainty"),
        ("trigger = 0.0", "trigger = -1e-3", "trigger: found -0.001"),
        ("trigger = 0.0", "trigger = nan", "trigger: found nan"),
        ("trigger = 0.0", 'trigger = "1 mm"', "which is not a time"),
        ("trigger = 0.0", 'trigger = "no"', "trigger: found 'no'"),
        ('type = "FloatingDeck"', 'type = "StiffTrack"', "track"),
        ("[passage] ", "[passages] ", "passage"),
    ],
)
def test_a_wrong_site_is_refused(old, new, said, tmp_path, capsys):
    text = SITE.read_text(encoding="utf-8")
    assert old in text
    wrong = tmp_path / "site.toml"
    wrong.write_text(text.replace(old, new, 1), encoding="utf-8")
    error = refused(capsys, "diagnose", RECORDING, "--site", wrong)
    assert said in error
    assert "site.toml" in error
    if "passages" not in new:
        with pytest.raises(wt.InputError):
            wt.load(wrong)


def test_recordings_that_are_not_there_are_refused(tmp_path, capsys):
    assert "folder without recordings" in refused(capsys, "diagnose", tmp_path, "--site", SITE)
    assert "nowhere.csv" in refused(capsys, "diagnose", tmp_path / "nowhere.csv", "--site", SITE)
    assert "files or folders" in refused(capsys, "diagnose", "--site", SITE)
    assert "nosite.toml" in refused(capsys, "diagnose", RECORDING, "--site", tmp_path / "nosite.toml")
    empty = tmp_path / "empty.csv"
    empty.write_text("")
    assert "empty.csv" in refused(capsys, "diagnose", empty, "--site", SITE)
    twice = [tmp_path / "a" / "1.csv", tmp_path / "b" / "1.csv"]
    for path in twice:
        path.parent.mkdir()
        path.write_text("")
    assert "1.csv" in refused(capsys, "diagnose", *twice, "--site", SITE, "-o", tmp_path / "found")


def test_a_recording_of_another_rate_is_refused(tmp_path, capsys):
    recording = wt.diagnosis.Recording(np.random.default_rng(1).standard_normal(2000), 10e3, source="slow")
    write_recording(recording, tmp_path / "slow.csv")
    error = refused(capsys, "diagnose", tmp_path / "slow.csv", "--site", SITE)
    assert "10000 Hz" in error
    assert "20000 Hz" in error


@pytest.mark.parametrize("name", ["sensor", "sensors"])
def test_a_file_with_sensors_alone_is_a_site(name, tmp_path):
    path = tmp_path / "sensors.toml"
    path.write_text(f'[[{name}]]\nkind = "contact force"\nname = "a"\nx1 = 0.0\nx2 = 0.5\n', encoding="utf-8")
    assert [one.name for one in wt.load(path).sensors] == ["a"]
    write_toml(wt.load(path), path)
    assert "rate" not in wt.load(path).sensors[0].model_fields_set  # else files of another rate would be refused


def test_a_trigger_has_a_unit_or_is_none_in_a_file(tmp_path):
    text = SITE.read_text(encoding="utf-8")
    for given, held in (('"1 ms"', 1e-3), ("0.002", 2e-3), ('"none"', None)):
        path = tmp_path / "site.toml"
        path.write_text(text.replace("trigger = 0.0", f"trigger = {given}", 1), encoding="utf-8")
        site = wt.load(path)
        assert site.trigger == held
        write_toml(site, path)
        assert wt.load(path) == site
    assert wt.load(SITE).trigger == 0.0


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("", "line 1"),
        ("file,weight\nflat.csv,3\n", "line 1"),
        ("file,speed [kg]\nflat.csv,3\n", "speeds in 'kg'"),
        ("file,speed [km/h]\nother.csv,30\n", "no speed of deck_flat.csv.gz"),
        ("file,speed [km/h]\ndeck_flat.csv.gz\n", "line 2"),
        ("file,speed [km/h]\ndeck_flat.csv.gz,-30\n", "line 2, speed"),
        ("file,speed [km/h]\ndeck_flat.csv.gz,fast\n", "line 2, speed"),
        ("file,speed\ndeck_flat.csv.gz,9\na/deck_flat.csv.gz,8\n", "line 3: found a second speed"),
    ],
)
def test_a_wrong_table_of_speeds_is_refused(table, said, tmp_path, capsys):
    path = tmp_path / "speeds.csv"
    path.write_text(table, encoding="utf-8")
    error = refused(capsys, "diagnose", RECORDING, "--site", SITE, "--speeds", path)
    assert said in error
    assert "speeds.csv" in error


def test_a_speed_for_all_and_a_table_of_speeds_exclude_each_other(tmp_path, capsys):
    path = tmp_path / "speeds.csv"
    path.write_text("file,speed\ndeck_flat.csv.gz,9\n", encoding="utf-8")
    error = refused(capsys, "diagnose", RECORDING, "--site", SITE, "--speeds", path, "--speed", "9 m/s")
    assert "speeds" in error


@pytest.mark.parametrize(
    "table", ["file,speed [km/h]\n{},32.4\n", "speed;file\n9,0;x/{}\n", "recording\tV [m/s]\n{}\t32.4 km/h\n"]
)
def test_speeds_come_from_a_table(table, tmp_path):
    path = tmp_path / "speeds.csv"
    path.write_text(table.format("a.csv"), encoding="utf-8")
    assert read_speeds(path) == {"a.csv": pytest.approx(9.0)}


def test_each_recording_of_a_folder_has_its_own_speed(tmp_path):
    site = wt.load(SITE)
    near = wt.diagnosis.Site(
        passage=site.passage.replaced({"duration": 0.1, "irregularity.0.start": 0.5}), sensor=site.sensor,
        uncertainty={"speed": 0.01},
    )  # fmt: skip
    for name, speed in (("slow", 7.0), ("fast", 11.0)):
        (recording,) = wt.synthesise(near, changes={"speed": speed, "duration": 0.15}, seed=1)
        write_recording(recording, tmp_path / f"{name}.csv")
    path = tmp_path / "speeds.tsv"
    path.write_text("file\tspeed [km/h]\nslow.csv\t25.2\nfast.csv\t39.6\n", encoding="utf-8")
    files = [tmp_path / "slow.csv", tmp_path / "fast.csv"]
    found = wt.diagnosis.diagnose_all(files, near, speeds=path, workers=1, progress=False)
    assert [one["verdict"] for one in found] == ["healthy", "healthy"]
    assert [one["speed"] for one in found] == [pytest.approx(7.0, rel=0.05), pytest.approx(11.0, rel=0.05)]


def test_what_is_asked_of_assess_is_checked_first(tmp_path, capsys):
    assert "broken spring" in refused(capsys, "assess", SITE, "--faults", "rusty spring")
    assert "NAME=SIZE" in refused(capsys, "assess", SITE, "--faults", "wheel flat=big")
    assert "count: found 1; allowed: a whole number, at least 2" in refused(capsys, "assess", SITE, "--count", "1")
    assert ".json" in refused(capsys, "assess", SITE, "--output", tmp_path / "out.txt")


def test_options_take_one_or_several_values_and_may_be_repeated(tmp_path, monkeypatch, capsys):
    asked = {}

    def measured(place, faults, **options):
        asked["faults"] = faults
        raise wt.InputError("", "stop", "here", "")

    def designed(place, parameters, speeds, *, rail, **options):
        asked.update(parameters=parameters, speeds=speeds, shapes=rail["shapes"])
        raise wt.InputError("", "stop", "here", "")

    monkeypatch.setattr("wheeltapper.diagnosis.performance.assess", measured)
    monkeypatch.setattr("wheeltapper.diagnosis.site.design.design_site", designed)
    refused(capsys, "assess", SITE, "--faults", "broken spring", "wheel flat=0.01:0.02", "--faults", "lost damper=0.1")
    assert asked["faults"] == {"broken spring": None, "wheel flat": (0.01, 0.02), "lost damper": 0.1}
    refused(
        capsys, "design", SITE, "-o", tmp_path / "out.toml", "--speeds", "6", "9", "--speeds", "12", "--shapes", "bump",
        "step up", "--parameters", "vehicle.mass", "vehicle.load",
    )  # fmt: skip
    assert asked["speeds"] == (6.0, 9.0, 12.0)
    assert asked["shapes"] == ("bump", "step up")
    assert asked["parameters"] == ("vehicle.mass", "vehicle.load")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("assess", SITE, "--faults", "wheel flat=0.01:0.02", "wheel flat=0.01:0.05"), "two different sizes"),
        (("assess", SITE, "--faults", "wheel flat", "broken spring", "wheel flat=0.01"), "two different sizes"),
        (("assess", SITE, "--faults"), "--faults: found nothing"),
        (("assess", SITE, "--faults", "wheel flt"), "(did you mean 'wheel flat'?)"),
        (("design", SITE, "--output", "out.toml", "--speeds"), "--speeds: found nothing"),
        (("design", SITE, "--output", "out.toml", "--speeds", "-3"), "site.toml: speeds: found [-3.0]"),
        (("design", SITE, "--output", "out.toml", "--parameters", "vehicle.mas"), "(did you mean 'mass'?)"),
        (("run", SITE), "site.toml: found a site: use `wheeltapper diagnose`"),
        (("sweep", SITE, "--output", "out.zarr"), "site.toml: found a site: use `wheeltapper diagnose`"),
        (("diagnose", RECORDING, "--site", BUMP), "bump.toml: found a scenario: use `wheeltapper run`"),
        (("assess", EXAMPLES / "bump_study.toml"), "bump_study.toml: found a study: use `wheeltapper sweep`"),
    ],
)  # fmt: skip
def test_what_is_mistaken_for_something_else_is_named(arguments, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    error = refused(capsys, *arguments)
    assert said in error
    assert error.count("\n") == 1


def test_ctrl_c_keeps_what_assess_has_computed(tmp_path, monkeypatch, capsys):
    from wheeltapper.diagnosis import performance

    calls = []

    def whole(site, task):
        return performance.DiagnosedPassage(task[0], task[2], 1.1, "healthy", False, 0.0, {"suspension": 0.0}, 1.1)

    def stopped(site, task):
        calls.append(task)
        if len(calls) > 2:
            raise KeyboardInterrupt
        return whole(site, task)

    monkeypatch.setattr(performance, "_diagnosed_passage", stopped)
    arguments = ["assess", str(SITE), "--faults", "mass deviation", "--count", "2", "--workers", "1"]
    assert main([*arguments, "-o", str(tmp_path / "found.json")]) == 3
    error = capsys.readouterr().err
    assert f"interrupted; what is computed is in {tmp_path / 'found.jsonl'}; the same command goes on" in error
    assert len((tmp_path / "found.jsonl").read_text().splitlines()) == 2
    calls[:] = [None, None]
    assert main(arguments) == 3
    assert "interrupted; nothing was kept" in capsys.readouterr().err
    monkeypatch.setattr(performance, "_diagnosed_passage", whole)
    assert main([*arguments, "-o", str(tmp_path / "found.json")]) == 0
    assert len((tmp_path / "found.jsonl").read_text().splitlines()) == 4


@pytest.mark.parametrize("judged", [0, 12])
def test_ctrl_c_keeps_the_best_rail_that_was_found(judged, tmp_path, monkeypatch, capsys):
    from wheeltapper.diagnosis.site.design_search import Judge

    whole, calls = Judge.lowered_to_limit, []

    def stopped(self, *arguments):
        if len(calls) == judged:
            raise KeyboardInterrupt
        calls.append(arguments)
        return whole(self, *arguments)

    monkeypatch.setattr(Judge, "lowered_to_limit", stopped)
    target = tmp_path / "designed.toml"
    assert main(["design", str(SITE), "-o", str(target), "--budget", "100"]) == 3
    error = capsys.readouterr().err
    if not judged:
        assert "interrupted; nothing was found yet" in error
        assert not target.exists()
        return
    assert f"interrupted; the best rail so far is in {target}" in error
    assert wt.load(target).passage.irregularity != wt.load(SITE).passage.irregularity


SLEEPING = """
import signal, sys, time
from wheeltapper.diagnosis.processes import in_processes
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it for what runs in the background
    print("begun", flush=True)
    try:
        for number, _ in in_processes(max, 0.0, [1.0, 2.0], 2):
            pass
        print("computed", flush=True)
        for _ in in_processes(pow, 3, [10**8] * 8, 2):
            pass
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="Ctrl-C reaches all processes at once on POSIX only")
def test_ctrl_c_ends_all_processes_at_once_and_without_their_tracebacks(tmp_path):
    (tmp_path / "sleeping.py").write_text(SLEEPING)
    begun = subprocess.Popen(
        [sys.executable, "sleeping.py"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
    assert begun.stdout.readline() == "begun\n"
    assert begun.stdout.readline() == "computed\n"
    time.sleep(2.0)  # the processes are busy now, with minutes of work
    os.killpg(begun.pid, signal.SIGINT)
    out, error = begun.communicate(timeout=30.0)
    assert out == "interrupted\n"
    assert error == ""


NO_NUMBERS = ["vehicle.bush_stiffness", "vehicle.mas", "irregularity.0", "irregularity.7.height", "rolling"]


@pytest.mark.parametrize("path", NO_NUMBERS)
def test_a_field_without_a_number_is_neither_uncertain_nor_asked_for(path):
    site = wt.load(SITE)
    recording = wt.diagnosis.Recording(np.zeros(400), 20e3)
    for call in (
        lambda: wt.diagnosis.identify(recording, site, (path,)),
        lambda: wt.diagnosis.information(site, (path,)),
        lambda: wt.diagnosis.information(site, together=[(path,)]),
        lambda: wt.diagnosis.Site.of({"passage": site.passage, "uncertainty": {path: 0.1}}),
    ):
        with pytest.raises(wt.InputError) as caught:
            call()
        assert "\n" not in str(caught.value)
        assert path in str(caught.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rate": 10e3}, "rate: found 10000 Hz"),
        ({"samples": np.zeros(31)}, "samples: found 31 of them"),
        ({"quantity": "force"}, "quantity: found 'force'"),
    ],
)
def test_recordings_of_another_sensor_are_not_identified(change, said):
    recording = wt.diagnosis.Recording(**({"samples": np.zeros(400), "rate": 20e3} | change))
    for call in (wt.diagnosis.identify, wt.diagnose):
        with pytest.raises(wt.InputError, match=said):
            call(recording, wt.load(SITE))


def test_what_is_no_site_no_recording_and_no_noise_is_refused():
    site, recording = wt.load(SITE), wt.diagnosis.Recording(np.zeros(400), 20e3)
    for call, said in (
        (lambda: wt.diagnose(site, site), "recording: found Site.*; allowed: a Recording, or the path of its file"),
        (
            lambda: wt.diagnose(recording, site.passage),
            "site: found Scenario.*; allowed: a Site, or the path of its TOML file",
        ),
        (lambda: wt.diagnose(recording, site, noise=-1.0), "noise: found -1.0"),
        (lambda: wt.diagnosis.information(site, speeds=[]), r"speeds: found \[\]"),
        (lambda: wt.design_site(site, budget=0), "budget: found 0"),
    ):
        with pytest.raises(wt.InputError, match=said):
            call()


def test_the_schema_of_sites(capsys):
    assert main(["schema", "site"]) == 0
    schema = json.loads(capsys.readouterr().out)
    parts = ["passage", "sensor", "sensors", "static_force"]
    assert [one["required"] for one in schema["anyOf"]] == [[part] for part in parts]
    assert set(schema["properties"]) >= {"passage", "sensor", "uncertainty", "name", "format"}
