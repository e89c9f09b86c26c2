"""A session: the scene of one page, what was changed in it, and the newest question about it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wheeltapper.describe.paths import held_at
from wheeltapper.describe.scenario import Scenario
from wheeltapper.faces.explore.form import added, changed, form_of
from wheeltapper.faces.explore.frames import Frame
from wheeltapper.faces.explore.paths import Files
from wheeltapper.faces.explore.sampling import Shown, run_frame, surface_frame, surface_key
from wheeltapper.faces.explore.scenes import python_of, table_of, toml_of
from wheeltapper.ground.errors import ComputationError, InputError, value_text
from wheeltapper.ground.progress import reporting
from wheeltapper.record.record import Record
from wheeltapper.record.simulate import simulated_scenario

if TYPE_CHECKING:
    from wheeltapper.faces.explore.mapping import Map

PAST = 100
"""Scenes that can be brought back one by one."""
LONGEST = 1e7
"""Longest product of duration and speed or of duration and 1 m/s that a page marches without being asked, m: what is
beyond is a slip of the keyboard, and would keep the machine busy."""


class SupersededError(Exception):
    """Something newer was asked meanwhile."""


@dataclass
class Refused:
    """An edit that the scene cannot take: the field, and the line that says why."""

    field: str
    line: str


@dataclass
class Session:
    """The scene of one page.

    Attributes
    ----------
    key
        Its name, which the page keeps over a reload.
    scene
        What the page shows.
    files
        What its scenes may name.
    record
        Of the scene's run, once it is marched.
    shown
        What the page has chosen to see of it.
    site, recording
        What was dropped on the page.
    map
        The last map that was filled.
    """

    key: str
    scene: Scenario
    files: Files
    record: Record | None = None
    shown: Shown = field(default_factory=Shown)
    site: Any = None
    recording: Path | None = None
    map: Map | None = None
    past: list[Scenario] = field(default_factory=list)
    future: list[Scenario] = field(default_factory=list)
    sent_form: str = ""
    sent_surface: Any = None
    lock: threading.Lock = field(default_factory=threading.Lock)

    # -- edits --------------------------------------------------------------------------------------------------------

    def edit(self, edits: list[dict[str, Any]]) -> list[Refused]:
        """Change the scene by edits in order; those that it cannot take are returned, and change nothing."""
        refused, before = [], self.scene
        for one in edits:
            path = str(one.get("path", ""))
            try:
                self.scene = self._edited(one, path)
            except InputError as error:
                refused.append(Refused(error.field or path, str(error)))
            except (ArithmeticError, AttributeError, KeyError, OSError, RecursionError, TypeError, ValueError) as error:
                refused.append(Refused(path, f"{path}: {' '.join(str(error).split()) or type(error).__name__}"))
        if self.scene == before:
            self.scene = before  # with its record
        else:
            self.past = [*self.past, before][-PAST:]
            self.future = []
            self.record = None
        return refused

    def _edited(self, one: dict[str, Any], path: str) -> Scenario:
        match one.get("do"):
            case "set":
                return changed(self.scene, path, self._checked(path, one.get("value")))
            case "set several":
                values = one.get("values")
                if not isinstance(values, dict):
                    raise InputError("", "values", value_text(values), "paths with their values")
                return self.scene.replaced({at: self._checked(at, value) for at, value in values.items()})
            case "add":
                return added(self.scene, path, str(one.get("type")))
            case "remove":
                return self.scene.replaced({path: None})
            case "bring":
                return self.read_table(one.get("scene"))
            case other:
                raise InputError("", "do", value_text(other), "set, set several, add, remove or bring")

    def _checked(self, path: str, value: Any) -> Any:
        """Return a value in which files are those that the page may name."""
        head, _, name = path.rpartition(".")
        holder: Any = {name: value}
        if head:
            _, _, held = held_at(self.scene, head)
            holder["type"] = type(held).__name__
        return self.files.checked(holder)[name]

    def read_table(self, data: Any) -> Scenario:
        """Return the scene in a table that a page has kept, or that a file holds."""
        if not isinstance(data, dict):
            raise InputError("", "scene", value_text(data), "a table that describes a scenario")
        plain = {name: value for name, value in data.items() if name not in ("format", "type")}
        return Scenario.of(self.files.checked(plain))

    def back(self) -> bool:
        """Bring the scene before the last change back."""
        return self._turned(self.past, self.future)

    def forth(self) -> bool:
        """Change again what was brought back."""
        return self._turned(self.future, self.past)

    def _turned(self, taken: list[Scenario], given: list[Scenario]) -> bool:
        if not taken:
            return False
        given.append(self.scene)
        self.scene, self.record = taken.pop(), None
        return True

    # -- what the page is sent ----------------------------------------------------------------------------------------

    def marched(self, is_stale: Callable[[], bool], say: Callable[[str], None]) -> Record:
        """Return the record of the scene; give up as soon as something newer was asked.

        Raises
        ------
        SupersededError
            If there is something newer.
        InputError
            If the scene cannot be simulated.
        """

        def tell(what: str, done: float, total: float) -> None:
            if is_stale():
                raise SupersededError
            if total:
                say(f"{what}: {100.0 * done / total:.0f} %")

        with self.lock:
            scene = self.scene
            if self.record is None or self.record.scenario is not scene:
                check_size(scene)
                with reporting(tell, say):
                    record = simulated_scenario(scene, "default", lambda notes: None)
                self.record = record
                return record
            return self.record

    def run_frames(self, seq: int, is_stale: Callable[[], bool], say: Callable[[str], None]) -> list[Frame]:
        """Return what a page draws of the scene: its run, and the surfaces where they have changed."""
        record = self.marched(is_stale, say)
        if not record.end > 0.0:
            raise ComputationError(record.outcome)
        frames = []
        key = surface_key(record)
        if key != self.sent_surface:
            frames.append(surface_frame(record))
            self.sent_surface = key
        frame = run_frame(record, self.shown, seq)
        frame.head["table"] = table_of(record.scenario)  # a pin has to hold the scene of the run that it shows
        return [*frames, frame]

    def scene_frame(self) -> Frame:
        """Return the form of the scene, and the scene as the page keeps and copies it."""
        return Frame(
            "scene", form=form_of(self.scene), table=table_of(self.scene), toml=toml_of(self.scene),
            python=python_of(self.scene), back=bool(self.past), forth=bool(self.future),
        )  # fmt: skip


def check_size(scene: Scenario) -> None:
    """Refuse a run so long that it can only be a slip.

    Raises
    ------
    InputError
        With what is too much.
    """
    if scene.duration > LONGEST or scene.duration * scene.speed > LONGEST:
        found = f"{scene.duration:g} s at {scene.speed:g} m/s"
        raise InputError("", "duration", found, f"at most {LONGEST:g} s and {LONGEST:g} m on this page")
