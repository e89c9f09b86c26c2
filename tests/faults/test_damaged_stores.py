"""A store that lost something, or that a disk has changed, says so when it is read, and resuming makes it whole."""

import json
import shutil
import warnings

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from tests.faults.test_stores import files, written
from wheeltapper.ask import store as stores
from wheeltapper.faces.cli import main
from wheeltapper.record.files.filled import CHECKSUMS, load_filled
from wheeltapper.record.simulate import ModelWarning


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    study = written(folder, gradient="true")
    assert main(["sweep", str(study), "--output", str(folder / "whole.zarr")]) == 0
    return study, folder / "whole.zarr"


def copied(whole, tmp_path):
    study, store = whole
    return study, shutil.copytree(store, tmp_path / "map.zarr")


def resumed(study, store):
    return main(["sweep", str(study), "--output", str(store), "--resume"])


def flip(file, bit):
    held = bytearray(file.read_bytes())
    held[bit // 8] ^= 1 << bit % 8
    file.write_bytes(held)


DAMAGES = {
    "emptied": lambda file: file.write_bytes(b""),
    "cut in half": lambda file: file.write_bytes(file.read_bytes()[: file.stat().st_size // 2]),
    "cut by one byte": lambda file: file.write_bytes(file.read_bytes()[:-1]),
    "first bit": lambda file: flip(file, 0),
    "a bit inside": lambda file: flip(file, 4 * file.stat().st_size + 3),
    "last bit": lambda file: flip(file, 8 * file.stat().st_size - 1),
    "of another program": lambda file: file.write_bytes(b"not a chunk of anything" * 9),
}
CHUNKS = ["status/c/2/0", "peak/c/0/0", "impact_interval_gradient/c/0/1/0", "amplification/c/4/0"]


@pytest.mark.parametrize(
    ("chunk", "damage"),
    [(CHUNKS[1], damage) for damage in DAMAGES]
    + [(chunk, "a bit inside") for chunk in (*CHUNKS, "vehicle.mass/c/0", "parameter/c/0") if chunk != CHUNKS[1]],
)
def test_a_damaged_chunk_is_refused_in_one_line_and_computed_again(whole, tmp_path, chunk, damage):
    study, store = copied(whole, tmp_path)
    DAMAGES[damage](store / chunk)
    name = chunk.split("/")[0]
    with pytest.raises(wt.InputError, match=rf"{name}: found a damaged chunk .*--resume") as error:
        wt.load(store)
    assert "\n" not in str(error.value)
    assert resumed(study, store) == 0
    assert files(store) == files(whole[1])


@pytest.mark.slow
@pytest.mark.parametrize("chunk", CHUNKS)
def test_cells_whose_chunk_is_missing_have_the_status_of_cells_not_computed(whole, tmp_path, chunk):
    study, store = copied(whole, tmp_path)
    before = wt.load(store).load()
    (store / chunk).unlink()
    with pytest.warns(ModelWarning, match=r"map.zarr: 8 of 40 cells are not computed; .*--resume") as warnings:
        chart = wt.load(store).load()
    assert len(warnings) == 1
    row = 2 * int(chunk.split("/")[-2])
    lost = np.zeros((10, 4), dtype=bool)
    lost[row : row + 2] = True
    assert (chart.status.values == np.where(lost, -1, before.status.values)).all()
    for name in ("peak", "impact_interval"):
        np.testing.assert_array_equal(chart[name].values[~lost], before[name].values[~lost])
    assert resumed(study, store) == 0
    xr.testing.assert_identical(wt.load(store).load(), before)


@pytest.mark.parametrize("name", ["vehicle.mass", "vehicle.damping", "parameter"])
def test_a_lost_axis_is_refused_and_written_again(whole, tmp_path, name):
    study, store = copied(whole, tmp_path)
    (store / name / "c" / "0").unlink()
    with pytest.raises(wt.InputError, match=rf"{name}: found no chunk 0; allowed: a whole store; .*--resume"):
        wt.load(store)
    assert resumed(study, store) == 0
    assert files(store) == files(whole[1])


def test_a_store_that_was_stopped_says_how_many_cells_are_not_computed(tmp_path, monkeypatch):
    study, store = written(tmp_path), tmp_path / "map.zarr"
    plain = stores.Store.write

    def stopping(self, place, threads):
        if place == (3, 0):
            raise KeyboardInterrupt
        return plain(self, place, threads)

    monkeypatch.setattr(stores.Store, "write", stopping)
    assert main(["sweep", str(study), "--output", str(store)]) == 3
    with pytest.warns(ModelWarning, match="16 of 40 cells are not computed"):
        chart = wt.load(store)
    assert int((chart.status == -1).sum()) == 16
    assert int(chart.peak.isnull().sum()) == 16


def test_a_chunk_in_which_no_cell_has_a_value_is_there_all_the_same(tmp_path):
    study = written(tmp_path)
    study.write_text(study.read_text().replace('"impact_interval"', '{ type = "impact_interval", second = 99 }'))
    store = tmp_path / "map.zarr"
    assert main(["sweep", str(study), "--output", str(store)]) == 0
    chart = wt.load(store)
    assert chart.impact_interval.isnull().all()
    assert (chart.status == 0).all()
    (store / "impact_interval" / "c" / "0" / "0").unlink()
    with pytest.warns(ModelWarning, match="8 of 40 cells are not computed"):
        wt.load(store)


def old(store):
    """Make a store one of format 1: no checksums, and no file where a chunk holds nothing but NaN or zeros."""
    (store / CHECKSUMS).unlink()
    for meta in store.rglob("zarr.json"):
        held = json.loads(meta.read_text())
        for one in (held, *held.get("consolidated_metadata", {}).get("metadata", {}).values()):
            if "codecs" in one:
                one["codecs"] = [codec for codec in one["codecs"] if codec["name"] != "crc32c"]
            one.get("attributes", {}).update({"format": 1} if "format" in one.get("attributes", {}) else {})
        meta.write_text(json.dumps(held))
    for chunk in store.rglob("c/**/*"):
        if chunk.is_file():
            chunk.write_bytes(chunk.read_bytes()[:-4])


@pytest.mark.slow
def test_a_store_of_format_1_still_opens_and_goes_on(whole, tmp_path):
    study, store = copied(whole, tmp_path)
    before = wt.load(store).load()
    old(store)
    after = wt.load(store).load()
    assert after.attrs.pop("format") == 1
    assert before.attrs.pop("format") == 2
    xr.testing.assert_identical(after, before)
    (store / "peak" / "c" / "1" / "0").write_bytes(b"")
    with pytest.raises(wt.InputError, match="peak: found a damaged chunk"):
        wt.load(store)
    (store / "status" / "c" / "0" / "0").unlink()
    assert resumed(study, store) == 0
    after = wt.load(store).load()
    after.attrs.pop("format")
    xr.testing.assert_identical(after, before)


def test_what_is_no_chart_is_refused_in_one_line(whole, tmp_path):
    _, store = copied(whole, tmp_path)
    foreign = tmp_path / "foreign.zarr"
    xr.Dataset({"a": ("x", [1.0])}).to_zarr(foreign, consolidated=False)
    (tmp_path / "empty.zarr").mkdir()
    newer = shutil.copytree(store, tmp_path / "newer.zarr")
    meta = newer / "zarr.json"
    meta.write_text(meta.read_text().replace('"format": 2', '"format": 3'))
    (store / "zarr.json").write_text("{ trunca")
    cases = {
        foreign: "did not write",
        tmp_path / "empty.zarr": "no readable store",
        newer: "at most 2",
        store: "no read",
    }
    for path, text in cases.items():
        with pytest.raises(wt.InputError, match=text) as error:
            load_filled(path)
        assert "\n" not in str(error.value)


def changed(name, *keys, to=None, by=None):
    """Return what sets an entry of a variable's metadata, or adds to it; without either it is removed."""

    def change(store):
        meta = store / name / "zarr.json"
        held = json.loads(meta.read_text())
        inner = held
        for key in keys[:-1]:
            inner = inner[key]
        if to is None and by is None:
            del inner[keys[-1]]
        else:
            inner[keys[-1]] = to if by is None else inner[keys[-1]] + by
        meta.write_text(json.dumps(held))

    return change


def moved(name, to):
    def move(store):
        (store / name).rename(store / to)

    return move


def exchanged(one, other):
    def exchange(store):
        for name, new in ((one, "away"), (other, one), ("away", other)):
            (store / name).rename(store / new)

    return exchange


METADATA = {
    "a unit": (changed("vehicle.mass", "attributes", "units", to="t"), "vehicle.mass"),
    "no meaning": (changed("peak", "attributes", "long_name"), "peak"),
    "another value of what is not there": (changed("impact_interval", "fill_value", to=0.0), "impact_interval"),
    "another type": (changed("peak", "data_type", to="float32"), "peak"),
    "no dimensions": (changed("amplification", "dimension_names"), "amplification"),
    "other dimensions": (
        changed("peak", "dimension_names", to=["vehicle.mass", "vehicle.damping"]), "peak",
    ),
    "another shape": (changed("peak_gradient", "shape", 0, by=1), "peak_gradient"),
    "no kind": (changed("parameter", "node_type"), "parameter"),
    "a renamed variable": (moved("peak", "peak_x"), "peak"),
    "a renamed axis": (moved("vehicle.damping", "vehicle.damper"), "vehicle.damping"),
    "two variables exchanged": (exchanged("peak", "impact_interval"), "peak"),
    "status and another exchanged": (exchanged("status", "gradient_status"), "status"),
    "a value of the scenario": (changed("", "attributes", "scenario", by=" "), "zarr.json"),
    "no list of coordinates": (changed("", "attributes", "coordinates"), "zarr.json"),
    "a summary that differs": (
        changed("", "consolidated_metadata", "metadata", "peak", "attributes", "units", to="kN"), "zarr.json",
    ),
    "checksums that are cut": (lambda store: (store / CHECKSUMS).write_text("{ "), CHECKSUMS),
}  # fmt: skip


@pytest.mark.parametrize(("damage", "name"), METADATA.values(), ids=METADATA)
def test_metadata_that_is_not_what_was_written_is_refused_in_one_line(whole, tmp_path, capsys, damage, name):
    study, store = copied(whole, tmp_path)
    damage(store)
    with pytest.raises(wt.InputError, match=rf"{name}: found .*; allowed: a whole store") as error:
        wt.load(store)
    assert "\n" not in str(error.value)
    capsys.readouterr()
    assert resumed(study, store) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert f"{name}: found" in line


def test_a_copy_of_a_chart_has_no_checksums_of_its_metadata(whole, tmp_path):
    before = wt.load(whole[1]).load()
    changed = before.assign_attrs(by="hand").assign_coords({"vehicle.mass": 1e-3 * before["vehicle.mass"]})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of texts, which extend Zarr 3
        changed.drop_encoding().to_zarr(tmp_path / "copy.zarr")
    xr.testing.assert_identical(wt.load(tmp_path / "copy.zarr").load(), changed)
