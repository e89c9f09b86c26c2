"""The command `orbits`: its file is kept while the branch grows, continued after an interruption, and guarded."""

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from wheeltapper.faces.cli import main
from wheeltapper.orbits import walk
from wheeltapper.orbits.file import follow_into

SCENE = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4), contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.1), rolling="point", speed=5.0, duration=1.0,
)  # fmt: skip
OVER = {"speed": (4.0, 8.0)}


@pytest.fixture
def scene_file(tmp_path):
    SCENE.to_toml(tmp_path / "scene.toml")
    return tmp_path / "scene.toml"


@pytest.mark.few(1)
@pytest.mark.parametrize("reports", [30, 110])
@pytest.mark.slow
def test_an_interrupted_branch_is_continued_to_the_same_end(tmp_path, monkeypatch, reports):
    monkeypatch.setattr(walk, "KEPT", 10)
    told = iter(range(reports))

    def interrupt(*_):
        if next(told, None) is None:
            raise KeyboardInterrupt

    file = tmp_path / "branch.nc"
    with pytest.raises(KeyboardInterrupt):
        follow_into(file, SCENE, OVER, progress=interrupt)
    with xr.open_dataset(file) as part:
        assert 1 < part.sizes["point"] <= reports + 2
        assert "" in (part.attrs["begins"], part.attrs["ends"])
        assert part.sizes["special"] == 0
    found = follow_into(file, SCENE, OVER, resume=True, progress=False)
    expected = wt.orbits.follow(wt.orbits.find(SCENE), OVER)
    assert found.kind.values.tolist() == expected.kind.values.tolist()
    np.testing.assert_allclose(found.parameter, expected.parameter, rtol=1e-9)
    assert found.speed.values[[0, -1]] == pytest.approx(expected.speed.values[[0, -1]])
    with xr.open_dataset(file) as kept:
        assert kept.kind.values.tolist() == expected.kind.values.tolist()


@pytest.mark.slow
def test_the_command_writes_tells_and_draws(scene_file, tmp_path, capsys):
    file, picture = tmp_path / "branch.nc", tmp_path / "branch.png"
    arguments = ["orbits", str(scene_file), "--over", "speed=4.9:6.9", "--output", str(file)]
    assert main([*arguments, "--plot", str(picture)]) == 0
    told = capsys.readouterr().out
    assert "grazing: speed = 6.747641791 m/s" in told
    assert "fold: speed = 6.753010494 m/s" in told
    assert picture.stat().st_size > 1000
    loaded, followed = wt.load(file), wt.orbits.follow(wt.orbits.find(SCENE), {"speed": (4.9, 6.9)})
    assert loaded.kind.values.tolist() == followed.kind.values.tolist()
    np.testing.assert_allclose(loaded.largest_force, followed.largest_force, rtol=1e-9)
    wt.plot(loaded)
    assert main(arguments) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*arguments, "--resume"]) == 0


@pytest.mark.parametrize(
    ("changed", "told"),
    [(["--over", "speed"], "--over: found 'speed'"), (["--over", "speed=5"], "--over"),
     (["--over", "speed=6:7"], "speed: found a range without 5"), (["--over", "speed=4:fast"], "speed"),
     (["--waves", "0"], "waves"), (["--output", "branch.txt"], "--output"), (["--method", "best"], "method")],
)  # fmt: skip
def test_wrong_options_are_refused_in_one_line(scene_file, tmp_path, capsys, changed, told):
    options = {"--over": "speed=4:6", "--output": str(tmp_path / "branch.nc")} | dict([changed])
    assert main(["orbits", str(scene_file), *(part for pair in options.items() for part in pair)]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
    assert not (tmp_path / "branch.nc").exists()


def test_the_branch_of_another_scenario_is_not_continued(scene_file, tmp_path, capsys):
    file = tmp_path / "branch.nc"
    arguments = ["--over", "speed=4.9:5.1", "--output", str(file), "--resume"]
    assert main(["orbits", str(scene_file), *arguments]) == 0
    before = file.read_bytes()
    SCENE.replaced({"vehicle.mass": 1600.0}).to_toml(scene_file)
    assert main(["orbits", str(scene_file), *arguments]) == 2
    assert "scenario: found a branch of something else" in capsys.readouterr().err
    assert file.read_bytes() == before


def test_a_file_of_something_else_is_not_continued(scene_file, tmp_path, capsys):
    file = tmp_path / "branch.nc"
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(file, engine="h5netcdf")
    assert main(["orbits", str(scene_file), "--over", "speed=4:6", "--output", str(file), "--resume"]) == 2
    assert "no branch of orbits" in capsys.readouterr().err


def test_a_branch_without_its_orbits_is_refused(tmp_path):
    branch = wt.orbits.follow(wt.orbits.find(SCENE), {"speed": (4.9, 5.1)})
    assert branch.sizes["special"] == 0
    branch.to_netcdf(tmp_path / "whole.nc", engine="h5netcdf")
    assert wt.load(tmp_path / "whole.nc").sizes == branch.sizes
    branch.drop_vars("displacement").to_netcdf(tmp_path / "part.nc", engine="h5netcdf")
    with pytest.raises(wt.InputError, match="displacement"):
        wt.load(tmp_path / "part.nc")
