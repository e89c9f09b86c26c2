"""Damaged, foreign and cut records are refused in one line, or answer; no index from a file reaches a kernel unchecked.

The answers are asked for in a process of its own, since a kernel that follows a wrong index ends its process.
"""

import json
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from tests.earlier import EARLIER, earlier

WHEELSET = {"mass": 1500, "load": 91307, "stiffness": 2.44e6, "damping": 5e4, "radius": 0.46}
SCENE = {
    "contact": wt.Hertz(constant=1.405e11), "speed": 9.0, "duration": 0.03,
    "irregularity": wt.CosineBump(height=4e-4, length=0.05, start=0.05),
}  # fmt: skip
MAKERS = {
    "wheelset": lambda: wt.Scenario(vehicle=wt.Wheelset(**WHEELSET), **SCENE),
    "deck": lambda: wt.Scenario(
        vehicle=wt.Wheelset(**WHEELSET), track=wt.FloatingDeck(mass=500, stiffness=5e7, damping=1e4), **SCENE
    ),
    "play": lambda: wt.Scenario(vehicle=wt.Wheelset(**WHEELSET, damper_play=5e-5), **SCENE),
    "plastic": lambda: wt.Scenario(
        vehicle=wt.Wheelset(**WHEELSET), **SCENE | {"contact": wt.contact.Thornton(constant=1.405e11)}
    ),
    "wagon": lambda: wt.Scenario.from_toml("examples/coach_step.toml").replaced({"duration": 0.02}),
    "wagon on rails": lambda: wt.Scenario.from_toml("examples/coach_step.toml").replaced(
        {"duration": 0.01, "track": wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 1000, "bays": 160})}
    ),
}
EXTREMES = (1e9, -1.0, float("nan"), float("inf"), 1e300, 0.5)
ANSWERS = """
import json, sys, warnings
import numpy as np
import wheeltapper as wt
warnings.simplefilter("ignore")
for path in json.load(sys.stdin):
    print(path, end=" ", flush=True)
    try:
        record = wt.load(path)
    except wt.InputError as error:
        text = str(error)
        assert text.startswith(path + ": ") and "\\n" not in text, text
        print("refused", flush=True)
        continue
    assert len(record.events.event) >= 0 and len(record.peaks.peak) >= 0 and len(record.impacts.impact) >= 0
    record.at([0.0, 0.5 * record.end, record.end]), record.energy, str(record)
    try:
        record.history(2000.0)
    except wt.InputError as error:  # an end so late that its samples do not fit in memory
        assert str(error).startswith("rate: "), error
    try:
        record.damper_events
    except wt.InputError as error:  # of a wagon
        assert str(error).startswith("vehicle: found a Wagon, "), error
    print("answered", flush=True)
"""


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Return a function that gives a saved record of a kind, simulated once."""
    folder, made = tmp_path_factory.mktemp("records"), {}

    def of(kind):
        if kind not in made:
            made[kind] = folder / f"{kind}.nc"
            wt.simulate(MAKERS[kind]()).save(made[kind])
        return made[kind]

    return of


def stored(data):
    """Return the variables that a load reads."""
    names = ("march_", "witness", "program_", "units", "rails_", "assembly", "task", "logged_", "seat_events")
    return [str(name) for name in data.variables if str(name).startswith(names)]


def mutated(data, count, dice):
    """Yield contents with one value, a row, a column or a variable that is not as it was."""
    names = stored(data)
    for number in range(count):
        name = names[number % len(names)]
        out = data.copy(deep=True)
        values = out[name].values
        if values.size == 0:
            continue
        extreme = EXTREMES[dice.integers(len(EXTREMES))]
        kind = dice.integers(6)
        if kind < 3:
            for _ in range(int(dice.integers(1, 4))):
                values.flat[dice.integers(values.size)] = extreme
        elif kind == 3:
            values[..., dice.integers(values.shape[-1])] = extreme
        elif kind == 4:
            values[:] = np.roll(values, int(dice.integers(1, 9)), axis=int(dice.integers(values.ndim)))
        else:
            out = cut(out, name, dice)
        yield out


def cut(data, name, dice):
    """Return contents without a variable, or with another length or kind of it."""
    variable = data[name]
    kind = dice.integers(4)
    if kind == 0:
        return data.drop_vars(name)
    if kind == 1:
        data[name] = (tuple(f"{name}_{k}" for k in range(variable.ndim)), variable.values[: len(variable) // 2])
    elif kind == 2:
        data[name] = (tuple(f"{name}_{k}" for k in range(variable.ndim)), variable.values[..., :-1])
    else:
        data[name] = (variable.dims, variable.values.astype(str))
    return data


def answered(paths):
    """Ask records for all that they tell; return which were refused and which answered."""
    done = subprocess.run(
        [sys.executable, "-c", ANSWERS], input=json.dumps([str(path) for path in paths]), capture_output=True,
        text=True, timeout=500, check=False,
    )  # fmt: skip
    assert done.returncode == 0, (done.returncode, done.stdout[-300:], done.stderr[-2000:])
    return [line.split()[-1] for line in done.stdout.splitlines()]


def mutants(path, folder, seed, count):
    """Write mutated copies of a record; return their names."""
    with xr.open_dataset(path, engine="h5netcdf") as opened:
        data = opened.load()
    data.attrs = without_checksum(data)
    paths = []
    for number, changed in enumerate(mutated(data, count, np.random.default_rng(seed))):
        paths.append(folder / f"{number} {path.name}")
        changed.to_netcdf(paths[-1], engine="h5netcdf")
    return paths


@pytest.mark.slow
def test_mutated_records_are_refused_or_answer(tmp_path, saved):
    whole = [saved(kind) for kind in ("wheelset", "plastic")]
    paths = [path for each in whole for path in mutants(each, tmp_path, 1, 5)]
    found = answered([*whole, *paths])
    assert found[: len(whole)] == ["answered"] * len(whole)
    assert len(found) == len(whole) + len(paths)
    assert set(found[len(whole) :]) == {"answered", "refused"}


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize(("kind", "seed"), [(kind, seed) for seed, kind in enumerate(MAKERS)])
def test_many_mutated_records_are_refused_or_answer(tmp_path, saved, kind, seed):
    paths = mutants(saved(kind), tmp_path, seed, 60)
    assert len(answered(paths)) == len(paths)


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize(("kind", "version"), EARLIER)
def test_mutated_records_of_earlier_formats_are_refused_or_answer(tmp_path, kind, version):
    path, _ = earlier(kind, version, tmp_path)
    paths = mutants(path, tmp_path, version, 20)
    assert len(answered(paths)) == len(paths)


def test_a_loaded_record_answers_as_the_one_that_was_saved(saved):
    record = wt.simulate(MAKERS["deck"]())
    loaded = wt.load(saved("deck"))
    for name, values in record.history(5000.0).items():
        np.testing.assert_array_equal(loaded.history(5000.0)[name], values)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "index", "value", "said"),
    [
        ("march_steps", (3, 6), 1e9, "march_steps: found 1e+09 at [3]; allowed: whole numbers from 0 to"),
        ("march_steps", (3, 6), -1.0, "march_steps: found -1 at [3]"),
        ("march_steps", (3, 1), np.nan, "march_steps: found nan at [3, 1]; allowed: finite numbers"),
        ("march_steps", (3, 0), 4.0, "march_steps: found 4 at [3]; allowed: whole numbers from 0 to 3"),
        ("march_events", (0, 1), 7.0, "march_events: found 7 at [0]"),
    ],
)
def test_a_value_that_no_march_writes_is_named(tmp_path, saved, name, index, value, said):
    with xr.open_dataset(saved("wheelset"), engine="h5netcdf") as opened:
        data = opened.load()
    check_value_is_named(data, tmp_path, name, index, value, said)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "index", "value", "said"),
    [
        ("program_numbers", (17,), 13.0, "program_numbers: found the order 13"),
        ("program_pieces", (2, 5), 60.0, "program_pieces: found 60 at [2]; allowed: whole numbers from 0 to 8"),
        ("units", (1,), -1.0, "units: found -1 at [1]; allowed: positive numbers"),
    ],
)
def test_a_value_that_no_earlier_version_wrote_is_named(tmp_path, name, index, value, said):
    _, data = earlier("wheelset", 2, tmp_path)
    check_value_is_named(data, tmp_path, name, index, value, said)


def without_checksum(data):
    """Return the attributes of a file that tells no damage itself, so that what is read has to."""
    return {name: value for name, value in data.attrs.items() if name != "checksum"}


def check_value_is_named(data, tmp_path, name, index, value, said):
    data.attrs = without_checksum(data)
    data[name].values[index] = value
    data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    with pytest.raises(wt.InputError) as caught:
        wt.load(tmp_path / "a.nc")
    assert str(caught.value).startswith(f"{tmp_path / 'a.nc'}: {said}")


@pytest.mark.slow
@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("format", "new", "format: found 'new'"),
        ("format", 4, "format: found 4; allowed: at most 3"),
        ("scenario", "{}", "scenario"),
        ("scenario", "{", "scenario"),
        ("scenario", "Scenario(vehicle=…", "a Python function"),
        ("status", 17, "status: found 17"),
        ("status", "done", "status: found 'done'"),
        ("method", "quick", "method: found 'quick'; allowed: default, strict"),
        ("notes", "no list", "notes: found 'no list'"),
        ("inputs", "0", "scenario: found another one than that of the record"),
    ],
)
def test_an_attribute_that_wheeltapper_does_not_write_is_named(tmp_path, saved, name, value, said):
    with xr.open_dataset(saved("wheelset"), engine="h5netcdf") as opened:
        data = opened.load()
    data.attrs = without_checksum(data)
    for changed in (data.assign_attrs({name: value}), data.assign_attrs({name: value}).drop_attrs(deep=False)):
        changed.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        with pytest.raises(wt.InputError) as caught:
            wt.load(tmp_path / "a.nc")
        message = str(caught.value)
        assert message.startswith(f"{tmp_path / 'a.nc'}: ")
        assert "\n" not in message
        assert said in message or not changed.attrs


@pytest.mark.slow
def test_a_changed_scenario_is_refused(tmp_path, saved):
    with xr.open_dataset(saved("wheelset"), engine="h5netcdf") as opened:
        data = opened.load()
    data.attrs["scenario"] = data.attrs["scenario"].replace("0.0004", "0.0005")
    for said in ("a damaged file", "scenario: found another one than that of the record"):
        data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        with pytest.raises(wt.InputError, match=said):
            wt.load(tmp_path / "a.nc")
        data.attrs = without_checksum(data)


@pytest.mark.slow
@pytest.mark.parametrize(("loop", "said"), [([99, 0], "loop: found 99"), ("x", "loop: found 'x'")])
def test_a_loop_that_no_earlier_version_wrote_is_named(tmp_path, loop, said):
    _, data = earlier("wheelset", 2, tmp_path)
    data.assign_attrs(loop=loop).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    with pytest.raises(wt.InputError, match=said):
        wt.load(tmp_path / "a.nc")


@pytest.mark.slow
def test_an_older_record_without_the_latest_numbers_is_loaded(tmp_path):
    path, data = earlier("wheelset", 2, tmp_path)
    old = data.drop_vars("program_numbers")
    old["program_numbers"] = ("number", data.program_numbers.values[:22])
    old["march_peaks"] = (("peak", "old_column"), data.march_peaks.values[:, :3])
    old.to_netcdf(tmp_path / "old.nc", engine="h5netcdf")
    record, whole = wt.load(tmp_path / "old.nc"), wt.load(path)
    np.testing.assert_array_equal(record.history(3000.0).normal_force, whole.history(3000.0).normal_force)
    np.testing.assert_array_equal(record._march.peaks, whole._march.peaks)
    assert str(record) == str(whole)


@pytest.mark.slow
def test_an_older_record_of_a_wagon_with_other_columns_is_loaded(tmp_path):
    path, data = earlier("wagon", 2, tmp_path)
    old = data.drop_vars(["march_events", "march_peaks"])
    old["march_events"] = (("event", "event_column"), data.march_events.values[:, [0, 1, 3, 2]])
    old["march_peaks"] = (("peak", "peak_column"), data.march_peaks.values[:, [0, 3, 1, 2]])
    del old.attrs["rows_like_a_wheels"]
    old.to_netcdf(tmp_path / "old.nc", engine="h5netcdf")
    record, whole = wt.load(tmp_path / "old.nc"), wt.load(path)
    assert record.peaks.sizes["peak"] > 0
    assert record.events.identical(whole.events)
    assert record.peaks.identical(whole.peaks)
    assert record.impacts.identical(whole.impacts)


def foreign(folder):
    """Yield names of files and folders that are no record, and what is said of each."""
    (folder / "empty.nc").write_bytes(b"")
    (folder / "text.nc").write_text("no netCDF")
    (folder / "folder.nc").mkdir()
    (folder / "folder.toml").mkdir()
    (folder / "file.zarr").write_text("x")
    (folder / "empty.zarr").mkdir()
    (folder / "empty.toml").write_text("")
    (folder / "table.csv").write_text("1;2")
    (folder / "nosuffix").write_text("x")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(folder / "other.nc", engine="h5netcdf")
    xr.Dataset({"a": ("x", [1.0])}, attrs={"title": "wheeltapper wear"}).to_netcdf(folder / "w.nc", engine="h5netcdf")
    return {
        "empty.nc": "no readable netCDF", "text.nc": "no readable netCDF", "folder.nc": "a folder",
        "folder.toml": "a folder", "file.zarr": "a file", "empty.zarr": "no readable store", "empty.toml": "an empty",
        "table.csv": "the suffix '.csv'", "nosuffix": "no suffix", "other.nc": "wheeltapper did not write",
        "w.nc": "speed: found nothing", "none.nc": "no such file", "none.zarr": "no such file", "none.toml": "no such",
        ".": "no suffix", "a.nc/b.nc": "no such file",
    }  # fmt: skip


def test_what_is_no_file_of_wheeltapper_is_refused_in_one_line(tmp_path):
    for name, said in foreign(tmp_path).items():
        with pytest.raises(wt.InputError, match=said) as caught:
            wt.load(tmp_path / name)
        assert str(caught.value).startswith(f"{tmp_path / name}: ")
        assert "\n" not in str(caught.value)
    for value in (None, 3, b"a.nc", ["a.nc"]):
        with pytest.raises(wt.InputError, match="path: found "):
            wt.load(value)


def test_cut_files_of_records_are_refused(tmp_path, saved):
    whole = saved("wheelset").read_bytes()
    for part in (1, 100, len(whole) // 3, len(whole) // 2, len(whole) - 100):
        (tmp_path / "a.nc").write_bytes(whole[:part])
        with pytest.raises(wt.InputError) as caught:
            wt.load(tmp_path / "a.nc")
        assert "\n" not in str(caught.value)
    with pytest.raises(wt.InputError, match="more than 1000 bytes"):
        wt.load(saved("wheelset"), largest=1000)
