"""Workers on this machine: seen from here only, and replaced whenever they die."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.faults.test_stores import command, files, offspring, written
from wheeltapper.ask import fill as filling
from wheeltapper.faces.cli import main

pytestmark = pytest.mark.skipif(not Path("/proc").is_dir(), reason="finds the workers in /proc")
LISTENING = "0A"
"""The state of such a socket in /proc/net/tcp."""


def listening(processes):
    """Return the addresses, as the system writes them, at which some processes wait for connections."""
    sockets = set()
    for process in processes:
        try:
            sockets |= {os.readlink(handle) for handle in Path(f"/proc/{process}/fd").iterdir()}
        except OSError:
            continue
    tables = [Path(f"/proc/net/{name}") for name in ("tcp", "tcp6")]
    rows = [line.split() for table in tables if table.exists() for line in table.read_text().splitlines()[1:]]
    return {row[1].partition(":")[0] for row in rows if row[3] == LISTENING and f"socket:[{row[9]}]" in sockets}


def spawned(driver):
    """Return the worker processes of a driver."""
    found = []
    for process in offspring(driver.pid):
        try:
            if b"spawn_main" in Path(f"/proc/{process}/cmdline").read_bytes():
                found.append(process)
        except OSError:
            continue
    return found


@pytest.mark.whole
@pytest.mark.slow
def test_workers_and_their_dashboard_listen_on_this_machine_only(tmp_path):
    study = written(tmp_path, count=40, chunk=16)
    heard = set()
    driver = subprocess.Popen(
        command(study, tmp_path / "map.zarr", "--workers", "2"), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    while driver.poll() is None:
        heard |= listening([driver.pid, *offspring(driver.pid)])
        time.sleep(0.02)
    said = driver.stderr.read()
    driver.stderr.close()
    assert driver.returncode == 0, said
    assert "dashboard: http://127.0.0.1:" in said
    assert heard == {"0100007F"}  # 127.0.0.1


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("moment", ["as it starts", "in its first task"])
def test_a_worker_that_is_killed_early_does_not_end_the_study(tmp_path, moment):
    study = written(tmp_path, count=400, chunk=40)
    whole, broken, errors = tmp_path / "whole.zarr", tmp_path / "broken.zarr", tmp_path / "errors"
    assert main(["sweep", str(study), "--output", str(whole)]) == 0
    with errors.open("w") as said:
        driver = subprocess.Popen(command(study, broken, "--workers", "2"), stdout=subprocess.DEVNULL, stderr=said)
    first = broken / "impact_interval" / "c"
    while driver.poll() is None and not (spawned(driver) and (moment == "as it starts" or first.exists())):
        time.sleep(0.005)
    os.kill(spawned(driver)[0], signal.SIGKILL)
    assert driver.wait(timeout=300) == 0, errors.read_text()
    assert files(whole) == files(broken)


def test_a_cluster_whose_workers_die_as_they_start_is_begun_anew_but_not_for_ever(monkeypatch):
    import distributed

    begun = []

    def dying(**options):
        begun.append(options)
        if len(begun) <= lives:
            raise RuntimeError("Nanny failed to start.")
        return "cluster"

    monkeypatch.setattr(distributed, "LocalCluster", dying)
    lives = 2
    assert filling._local_cluster(3) == "cluster"
    assert [options["n_workers"] for options in begun] == [3, 3, 3]
    assert all(options["dashboard_address"].startswith("127.0.0.1:") for options in begun)
    begun.clear()
    lives = 99
    with pytest.raises(RuntimeError, match="Nanny failed"):
        filling._local_cluster(3)
    assert len(begun) == 3
