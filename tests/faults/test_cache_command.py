"""The command `cache`: it shows what is kept of compiled kernels, and removes it."""

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
        f"  {kept.MARCHES['wheel']}: 1 kernels, 1.5 MB",
        f"  {kept.MARCHES['general']}: 1 kernels, 0.5 MB, of other sources",
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
