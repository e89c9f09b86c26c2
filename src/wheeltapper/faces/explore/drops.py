"""Files that are dropped on a page: a scenario becomes the scene, a recording is diagnosed with its site."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from wheeltapper.describe.scenario import TABLES, toml_table
from wheeltapper.describe.site import Site
from wheeltapper.faces.cli_site import RECORDINGS
from wheeltapper.faces.explore.paths import Files
from wheeltapper.faces.explore.session import Session
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.progress import reporting

LARGEST = 2**28
"""Largest dropped file, bytes."""
UNPACKED, SAMPLES = 2**26, 2_000_000
"""Largest recording of a deck that a page answers, in bytes unpacked and in samples: others take minutes."""
LONG_ONES = f"up to {SAMPLES} samples on a page; cut it about the passage, or use `wheeltapper diagnose`"


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
    table = toml_table(path, "a scenario or a site")
    has_sensors = "vehicle" not in table and not {"sensor", "sensors"}.isdisjoint(table)
    if TABLES["a site"][0] not in table and not has_sensors:
        refused = session.edit([{"do": "bring", "scene": toml_table(path, "a scenario")}])
        if refused:
            raise InputError(path.name, "", refused[0].line, "a scenario that this page can show")
        return {"words": f"{path.name} is the scene now.", "scene": True}
    held = Files(path.parent).checked(table)  # what it names has to be dropped, too
    session.site = Site.of(held, path.name)
    if session.recording is None:
        return {"words": f"{path.name} is the site; now drop a recording."}
    return _diagnosed(session, say)


def _diagnosed(session: Session, say: Callable[[str], None]) -> dict[str, Any]:
    from wheeltapper.faces.explore.exports import picture

    path, site = session.recording, session.site
    assert path is not None
    say(f"diagnosing {path.name}")

    def tell(what: str, done: float, total: float) -> None:
        if total:
            say(f"{what}: {100.0 * done / total:.0f} %")

    with reporting(tell, say):
        verdict, found = _of_deck(path, site, tell) if site.passage is not None else _of_detector(path, site)
    drawn = base64.b64encode(picture(found, "png")).decode()
    text = str(found).replace(str(path), path.name)
    return {"words": f"{path.name}: {verdict}", "finding": text, "picture": f"data:image/png;base64,{drawn}"}


def _of_deck(path: Path, site: Site, tell: Callable[[str, float, float], None]) -> tuple[str, Any]:
    """Return the verdict on the wheelset that a deck has recorded, and the finding."""
    from wheeltapper.diagnosis.diagnose import diagnose
    from wheeltapper.record.recordings.read import read_recording

    try:
        recording = read_recording(path, apart=True, largest=UNPACKED)
    except InputError as error:
        if "bytes unpacked" not in str(error):
            raise
        raise InputError(path.name, "", f"more than {UNPACKED >> 20} MiB unpacked", LONG_ONES) from None
    if len(recording.samples) > SAMPLES:
        raise InputError(path.name, "", f"{len(recording.samples)} samples", LONG_ONES)
    finding = diagnose(recording, site, progress=tell)
    return finding.verdict, finding


def _of_detector(path: Path, site: Site) -> tuple[str, Any]:
    """Return what sensors along the track have recorded of a train."""
    from wheeltapper.diagnosis.wayside.channels import read_channels
    from wheeltapper.diagnosis.wayside.measure import measure_trains

    trains = measure_trains(read_channels(path, site, apart=True, largest=LARGEST), site, name=path.name)
    if not trains:
        raise InputError(path.name, "", "no axle", "a recording of a train by the sensors of the site")
    train = max(trains, key=lambda one: len(one.axles))
    more = f"; of {len(trains)} trains the longest" if len(trains) > 1 else ""
    return f"{len(train.axles)} axles, {len(train.alarms)} alarms{more}", train
