"""A file that has changed under its name is read anew, be it as long as before and written in the same second."""

import os
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.diagnosis.folder import diagnose_all
from wheeltapper.faces.cli import main
from wheeltapper.lower.laws.patches import geometry_of, patch_tables

SCENE = """
speed = 9.0
duration = 0.05
[vehicle]
type = "Wheelset"
mass = 1500
load = 91307
[contact]
type = "Hertz"
constant = 1.405e11
[[irregularity]]
"""
RAIL = 'type = "Measured"\npath = "surface.csv"\nbeyond = "flat"\n'
WHEEL = 'type = "OutOfRound"\npath = "surface.csv"\n'
STUDY = 'scenario = "scene.toml"\nfeatures = "largest_force"\nchunk = 2\n[over]\nspeed = [8.0, 9.0, 10.0, 11.0]\n'


def rewrite(path, text):
    """Write as many bytes as before, at the time at which they were written before."""
    before = path.stat()
    assert len(text) == before.st_size
    path.write_text(text)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def surface(height):
    places = np.linspace(0.0, 2.0, 41)
    return "x [m];z [mm]\n" + "".join(f"{x:.3f};{height * np.sin(9.0 * x) ** 2:.4f}\n" for x in places)


def files(folder, item, height=0.1):
    (folder / "surface.csv").write_text(surface(height))
    (folder / "scene.toml").write_text(SCENE + item)
    (folder / "study.toml").write_text(STUDY)


def largest(path):
    return float(wt.simulate(wt.Scenario.from_toml(path)).peaks.normal_force.max())


@pytest.mark.parametrize("item", [RAIL, WHEEL])
def test_a_rewritten_surface_gives_the_new_answer(tmp_path, item):
    files(tmp_path, item)
    old = largest(tmp_path / "scene.toml")
    rewrite(tmp_path / "surface.csv", surface(0.2))
    new = largest(tmp_path / "scene.toml")
    assert new > 1.02 * old
    files(tmp_path, item, 0.2)
    assert largest(tmp_path / "scene.toml") == new


def test_a_rewritten_surface_gives_a_new_sweep(tmp_path):
    files(tmp_path, RAIL)
    scene = tmp_path / "scene.toml"

    def swept():
        return wt.sweep(wt.Scenario.from_toml(scene), {"speed": [8.0, 9.0]}, [wt.features.largest_force()])

    old = swept().largest_force.values
    rewrite(tmp_path / "surface.csv", surface(0.2))
    assert (swept().largest_force.values > 1.02 * old).all()


def test_a_store_goes_on_with_the_files_that_it_began_with_alone(tmp_path, capsys):
    files(tmp_path, RAIL)
    study, store = str(tmp_path / "study.toml"), str(tmp_path / "map.zarr")
    assert main(["sweep", study, "--output", store]) == 0
    assert main(["sweep", study, "--output", store, "--resume"]) == 0
    rewrite(tmp_path / "surface.csv", surface(0.2))
    assert main(["sweep", study, "--output", store, "--resume"]) == 2
    assert "the store of another study" in capsys.readouterr().err


def test_findings_are_kept_only_while_the_sites_files_stay(tmp_path):
    (tmp_path / "surface.csv").write_text(surface(0.1))
    item = wt.Measured(path=tmp_path / "surface.csv", beyond="flat")
    site = wt.load("examples/site.toml")
    site = wt.diagnosis.Site(passage=site.passage.replaced({"irregularity": item}), sensor=site.sensor)
    broken = tmp_path / "broken.csv"
    broken.write_text("nothing")
    for _ in range(2):
        diagnose_all([broken], site, output=tmp_path / "out", workers=1)
    kept = tmp_path / "out" / "broken.csv.json"
    before = kept.read_text()
    rewrite(tmp_path / "surface.csv", surface(0.2))
    diagnose_all([broken], site, output=tmp_path / "out", workers=1)
    assert kept.read_text() != before


@pytest.mark.slow
def test_a_rewritten_rail_gives_the_new_contact(tmp_path):
    def rail(height):
        y = np.linspace(-36.5, 36.5, 293)
        z = rail_60e1(y) + height * np.exp(-(((y + 10.0) / 3.0) ** 2))
        return "".join(f"{a:9.4f} {b:9.4f}\n" for a, b in zip(y, z, strict=True))

    path = tmp_path / "rail.txt"
    path.write_text(rail(0.0))
    old = geometry_of(wt.profiles.WheelRail(rail=str(path)), 0.46, 0.3)
    tables = patch_tables(wt.profiles.WheelRail(rail=str(path)), wt.Hertz(), 0.46)
    rewrite(path, rail(0.02))
    new = geometry_of(wt.profiles.WheelRail(rail=str(path)), 0.46, 0.3)
    assert np.abs(new.place - old.place).max() > 1e-4
    assert np.abs(patch_tables(wt.profiles.WheelRail(rail=str(path)), wt.Hertz(), 0.46) - tables).max() > 0.0
    rewrite(path, rail(0.0).replace(".", ";", 1))
    with pytest.raises(wt.InputError, match="line 1"):
        geometry_of(wt.profiles.WheelRail(rail=str(path)), 0.46, 0.3)
    Path(path).unlink()
    with pytest.raises(wt.InputError, match="no such file"):
        geometry_of(wt.profiles.WheelRail(rail=str(path)), 0.46, 0.3)
