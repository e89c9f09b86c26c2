"""Files that are dropped on a page: a scenario becomes the scene, a recording is diagnosed with its site."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from wheeltapper.describe.scenario import TABLES, toml_table
from wheeltapper.describe.site import Site, as_site
from wheeltapper.faces.cli_site import RECORDINGS
from wheeltapper.faces.explore.paths import Files
from wheeltapper.faces.explore.session import Session
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.progress import reporting

LARGEST = 2**28
"""Largest dropped file, bytes."""


def safe_name(name: str) -> str:
    """Return the name under which a dropped file is kept: no folder, no character that means anything."""
    last = re.split(r"[\\/]", name)[-1]
    return re.sub(r"[^\w.\- ]", "_", last).lstrip(".")[-80:] or "file"


def taken(session: Session, path: Path, say: Callable[[str], None]) -> dict[str, Any]:
    """Take a dropped file; return what the page says and shows of it.

    Raises
    ------
    InputError
        If it is neither a scenario, nor a site, nor a recording.
    """
    if path.suffix.lower() == ".toml":
        return _taken_table(session, path, say)
    if path.suffix.lower() not in RECORDINGS:
        allowed = f"a scenario or a site in TOML, or a recording: {', '.join(RECORDINGS)}"
        raise InputError(path.name, "", f"the suffix {path.suffix!r}", allowed)
    session.recording = path
    if session.site is None:
        return {"words": f"{path.name} is kept; now drop the TOML file of its site."}
    return _diagnosed(session, say)


def _taken_table(session: Session, path: Path, say: Callable[[str], None]) -> dict[str, Any]:
    text = path.read_text(encoding="utf-8", errors="replace")
    fields = {line.split("=")[0].strip(" []").split(".")[0] for line in text.splitlines()}
    if TABLES["a site"][0] not in fields:
        refused = session.edit([{"do": "bring", "scene": toml_table(path, "a scenario")}])
        if refused:
            raise InputError(path.name, "", refused[0].line, "a scenario that this page can show")
        return {"words": f"{path.name} is the scene now.", "scene": True}
    held = Files(path.parent).checked(toml_table(path, "a site"))  # what it names has to be dropped, too
    session.site = as_site(Site.of(held, path.name))
    if session.recording is None:
        return {"words": f"{path.name} is the site; now drop a recording."}
    return _diagnosed(session, say)


def _diagnosed(session: Session, say: Callable[[str], None]) -> dict[str, Any]:
    from wheeltapper.diagnosis.diagnose import diagnose
    from wheeltapper.faces.explore.exports import picture
    from wheeltapper.record.read_recording import read_recording

    path, site = session.recording, session.site
    assert path is not None
    say(f"diagnosing {path.name}")
    with reporting(lambda what, done, total: None, say):
        recording = read_recording(path, apart=True)
        finding = diagnose(recording, site, progress=lambda what, done, total: None)
    drawn = base64.b64encode(picture(finding, "png")).decode()
    text = str(finding).replace(str(path), path.name)
    return {"words": f"{path.name}: {finding.verdict}", "finding": text, "picture": f"data:image/png;base64,{drawn}"}
