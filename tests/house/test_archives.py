"""The archives of a release: built, installed into an empty environment, and used as a newcomer would."""

import shutil
import subprocess
import sys
import tarfile
import urllib.request
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
UV = shutil.which("uv")
BIN = "Scripts" if sys.platform == "win32" else "bin"
pytestmark = [pytest.mark.slow, pytest.mark.skipif(UV is None, reason="archives are built by uv")]


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    out = tmp_path_factory.mktemp("dist")
    subprocess.run([UV, "build", "-q", "--out-dir", out, ROOT], check=True)
    return {path.suffix: path for path in out.iterdir() if path.suffix in (".whl", ".gz")}


@pytest.fixture(params=[".whl", ".gz"], ids=["wheel", "source archive"])
def installed(request, archives, tmp_path):
    """Return the folder of the programs of an empty environment into which one archive was installed."""
    place = tmp_path / "environment"
    subprocess.run([UV, "venv", "-q", "--python", sys.executable, place], check=True)
    python = place / BIN / "python"
    what = f"{archives[request.param]}[explore]"
    subprocess.run([UV, "pip", "install", "-q", "--python", python, what], check=True, cwd=tmp_path)
    return place / BIN


def test_archives_hold_what_they_need_and_nothing_else(archives):
    with zipfile.ZipFile(archives[".whl"]) as wheel:
        names = wheel.namelist()
    roots = {name.split("/")[0] for name in names}
    assert {root for root in roots if not root.endswith(".dist-info")} == {"wheeltapper"}
    for path in (ROOT / "src" / "wheeltapper").rglob("*"):
        name = path.relative_to(ROOT / "src").as_posix()
        if path.is_file() and "__pycache__" not in name and "/prebuilt/" not in name:
            assert name in names
    with tarfile.open(archives[".gz"]) as source:
        held = {name.split("/", 1)[1] for name in source.getnames() if "/" in name}
    assert {"README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md", "pyproject.toml"} <= held
    assert not [name for name in held if name.startswith((".venv", "docs/_build", "uv.lock"))]


def test_an_installed_archive_runs_the_readmes_example_and_the_explorer(installed, tmp_path):
    example = tmp_path / "wheel_flat.toml"
    shutil.copy(ROOT / "examples" / "wheel_flat.toml", example)
    command = installed / "wheeltapper"
    ran = subprocess.run([command, "run", example], capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert ran.returncode == 0, ran.stderr
    assert "10 impacts, largest force 3.161 of static" in ran.stdout
    page = subprocess.Popen(
        [command, "explore", example, "--no-browser"], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    )
    try:
        address = page.stdout.readline().strip().removeprefix("explorer: ")
        with urllib.request.urlopen(address, timeout=60) as answer:
            assert "<title>" in answer.read().decode()
    finally:
        page.terminate()
        page.communicate(timeout=30)
