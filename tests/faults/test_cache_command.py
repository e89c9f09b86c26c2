"""The command `cache`: it shows what is kept of compiled kernels, compiles what will be needed, and removes all."""

import contextlib
import os
import random
import subprocess
import sys

import pytest

from wheeltapper.faces.cli import main
from wheeltapper.march.compiling import kept, store


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a place for kernels, empty at first."""
    monkeypatch.setenv("WHEELTAPPER_CACHE", str(tmp_path))
    store.store_of.cache_clear()
    yield tmp_path
    store.store_of.cache_clear()


def test_what_is_kept_is_shown_and_removed(folder, capsys):
    assert main(["cache"]) == 0
    assert capsys.readouterr().out == f"compiled kernels in {folder}\n  none\n"
    current = store.store_of("wheel").folder
    for place, files in (
        (current, ("a.1.code", "b.2.part", ".a.1.lock")),
        (folder / f"general-{0:020d}-x", ("c.1.code",)),
    ):
        place.mkdir()
        for name in files:
            (place / name).write_bytes(bytes(2**19))
    (folder / "rails-photos").mkdir()
    shown = [
        f"compiled kernels in {folder}",
        f"  {kept.ROOMS['wheel']}: 1 kernels, 1.5 MB",
        f"  {kept.ROOMS['general']}: 1 kernels, 0.5 MB, of other sources",
    ]
    assert main(["cache"]) == 0
    assert capsys.readouterr().out.splitlines() == shown
    assert main(["cache", "--empty"]) == 0
    assert capsys.readouterr().out.splitlines() == [shown[0], f"{shown[1]}, removed", f"{shown[2]}, removed"]
    assert [path.name for path in folder.iterdir()] == ["rails-photos"]


def test_what_cannot_be_removed_is_said(folder, capsys, monkeypatch):
    (folder / f"wheel-{0:020d}-x").mkdir()

    def refuse(self, target):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.replace", refuse)
    assert main(["cache", "--empty"]) == 3
    assert capsys.readouterr().err == f"wheeltapper: {folder}: could not be emptied, it cannot be written\n"


FILL = """
import json, sys
import numpy as np
from wheeltapper.faces import filling
from wheeltapper.faces.cli import main
from wheeltapper.march.steps.layout import SCRATCH
from wheeltapper.march.wheel.margin import _smallest_value

def small(scenario, method):
    S = np.zeros(SCRATCH)
    S[:3] = 5.0, -2.0, 1.0
    assert _smallest_value(0, 2, 0.5, S) == 4.25

filling.asks = lambda: [(small, None, "default")] * 2
if "full" in sys.argv:
    import errno, pathlib

    def no_room(self, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    pathlib.Path.write_bytes = no_room
sys.exit(main(["cache", "--fill", "--workers", "1"]))
"""
"""The command with a question that compiles soon."""


def filled(folder, *words):
    environment = os.environ | {"WHEELTAPPER_CACHE": str(folder)}
    return subprocess.run([sys.executable, "-c", FILL, *words], env=environment, capture_output=True, text=True)


@pytest.mark.slow
def test_what_will_be_needed_is_compiled_in_silence_and_once(tmp_path):
    for _ in range(2):
        done = filled(tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert f"{kept.ROOMS['wheel']}: 1 kernels" in done.stdout
        (file,) = tmp_path.rglob("*.code")
        made = file.stat().st_mtime_ns
    assert file.stat().st_mtime_ns == made


@pytest.mark.slow
def test_a_full_disk_and_a_place_that_others_can_write_end_a_filling_with_a_sentence(tmp_path):
    done = filled(tmp_path, "full")
    assert done.returncode == 3
    assert done.stderr == f"wheeltapper: {tmp_path}: {store.NOT_KEPT} (No space left on device)\n"
    if os.name != "nt":
        tmp_path.chmod(0o777)
        done = filled(tmp_path)
        assert done.returncode == 3
        said = f"wheeltapper: {tmp_path} can be written by other users: compiled kernels are not kept, "
        assert done.stderr == f"{said}each process compiles its own\n"


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="kills by signals")
def test_kills_of_fillings_and_removals_leave_a_place_that_works(tmp_path):
    dice = random.Random(38)
    environment = os.environ | {"WHEELTAPPER_CACHE": str(tmp_path)}
    remove = [sys.executable, "-c", "from wheeltapper.faces.cli import main; main(['cache', '--empty'])"]
    for kill in range(20):
        start = remove if kill % 3 == 2 else [sys.executable, "-c", FILL]
        process = subprocess.Popen(start, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(dice.uniform(0.2, 2.5))
        process.kill()
        process.wait()
    assert filled(tmp_path).returncode == 0
    assert len([*tmp_path.rglob("*.code")]) == 1
