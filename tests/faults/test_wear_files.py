"""Files of evolutions survive kills, and damaged ones are refused."""

import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from wheeltapper.ask import wear as wearing
from wheeltapper.ground.locks import locked

SCENE = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4, radius=0.46),
    contact=wt.contact.Thornton(constant=1.405e11),
    irregularity=wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.0),
    rolling="point",
    speed=36.0,
    duration=0.2 / 36.0,
)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    file = tmp_path_factory.mktemp("wear") / "wear.nc"
    return wt.wear_in(SCENE, 4, store=file, every=2), file.read_bytes()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # h5netcdf's, of a file half opened
def test_a_damaged_file_is_refused_in_one_line_or_not_damaged_where_it_matters(written, tmp_path):
    whole, content = written
    dice, refused = random.Random(5), 0
    file = tmp_path / "wear.nc"
    damaged = [content[:size] for size in (0, 1, 100, len(content) // 2, len(content) - 1)]
    for _ in range(25):
        flipped = bytearray(content)
        bit = dice.randrange(8 * len(content))
        flipped[bit // 8] ^= 1 << bit % 8
        damaged.append(bytes(flipped))
    for bytes_ in damaged:
        file.write_bytes(bytes_)
        for read in (lambda: wt.wear_in(SCENE, 4, store=file, every=2), lambda: wt.load(file)):
            try:
                found = read()
            except wt.InputError as error:
                refused += 1
                line = str(error)
                assert "\n" not in line
                assert str(file) in line
                continue
            np.testing.assert_array_equal(found.height, whole.height)
            np.testing.assert_array_equal(found.largest_force, whole.largest_force)
            assert found.attrs["ended"] == whole.attrs["ended"]
    assert refused > 40


def test_fewer_passes_than_the_file_holds_are_refused_and_the_file_stays(written, tmp_path):
    file = tmp_path / "wear.nc"
    file.write_bytes(written[1])
    with pytest.raises(wt.InputError, match=r"passes: found 3, where the file holds 4; allowed: 4 or more"):
        wt.wear_in(SCENE, 3, store=file, every=2)
    assert file.read_bytes() == written[1]


def test_a_folder_that_is_not_there_is_refused_before_anything_is_computed(tmp_path, monkeypatch):
    monkeypatch.setattr(wearing, "line_of", None)
    with pytest.raises(wt.InputError, match=r"store: found a place that cannot be written \(No such file"):
        wt.wear_in(SCENE, 3, store=tmp_path / "none" / "wear.nc")


def test_two_processes_do_not_write_one_file(tmp_path):
    with (
        locked(tmp_path / "wear.nc"),
        pytest.raises(wt.InputError, match="another process is filling; allowed: one process at a time"),
    ):
        wt.wear_in(SCENE, 1, store=tmp_path / "wear.nc")


@pytest.mark.slow
def test_what_a_kill_leaves_beside_the_file_goes_with_the_next_run(written, tmp_path):
    SCENE.to_toml(tmp_path / "scene.toml")
    file = tmp_path / "wear.nc"
    file.write_bytes(written[1])
    code = (
        "import os, signal, sys, xarray, wheeltapper as wt\n"
        "plain = xarray.Dataset.to_netcdf\n"
        "def killed(self, *a, **k):\n"
        "    plain(self, *a, **k)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
        "xarray.Dataset.to_netcdf = killed\n"
        "wt.wear_in(wt.load(sys.argv[1]), 6, store=sys.argv[2], every=2)\n"
    )
    arguments = [sys.executable, "-c", code, str(tmp_path / "scene.toml"), str(file)]
    done = subprocess.run(arguments, capture_output=True, timeout=300)
    assert done.returncode == -signal.SIGKILL
    left = set(os.listdir(tmp_path)) - {"wear.nc", "scene.toml"}
    assert left == {".wear.nc.partial", "wear.nc.lock"}
    assert file.read_bytes() == written[1]
    more = wt.wear_in(wt.load(tmp_path / "scene.toml"), 6, store=file, every=2)
    assert set(os.listdir(tmp_path)) == {"wear.nc", "scene.toml"}
    xr.testing.assert_identical(more.height, wt.wear_in(SCENE, 6, every=2).height)


@pytest.mark.whole
@pytest.mark.slow
def test_kills_at_any_moment_leave_a_file_that_goes_on(tmp_path):
    SCENE.to_toml(tmp_path / "scene.toml")
    file = tmp_path / "wear.nc"
    code = (
        "import sys, wheeltapper as wt\nfrom wheeltapper.ask import wear\nwear.SAVE_AFTER = 0.05\n"
        "wt.wear_in(wt.load(sys.argv[1]), 400, store=sys.argv[2])\n"
    )
    dice, kills = random.Random(3), 0
    while True:
        run = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "scene.toml"), str(file)])
        began = time.monotonic()
        wait = 1e9 if kills == 8 else dice.uniform(1.0, 4.0)
        while run.poll() is None and time.monotonic() - began < wait:
            time.sleep(0.02)
        if run.poll() is not None:
            break
        run.kill()
        run.wait()
        kills += 1
    assert run.returncode == 0
    assert kills > 0
    assert set(os.listdir(tmp_path)) == {"wear.nc", "scene.toml"}
    np.testing.assert_array_equal(wt.load(file).height, wt.wear_in(SCENE, 400).height)
