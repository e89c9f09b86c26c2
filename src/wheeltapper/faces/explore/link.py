"""The connection of a page, whatever carries its messages: it reads what is asked, and answers the newest."""

from __future__ import annotations

import asyncio
import re
import secrets
from collections import deque
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from wheeltapper.describe.registry import registered_in
from wheeltapper.describe.scenario import Scenario
from wheeltapper.faces.explore.drops import safe_name, taken
from wheeltapper.faces.explore.exports import EXPORTS
from wheeltapper.faces.explore.frames import Frame
from wheeltapper.faces.explore.paths import Files
from wheeltapper.faces.explore.sampling import Shown
from wheeltapper.faces.explore.scenes import start_scene, table_of
from wheeltapper.faces.explore.session import Session, SupersededError
from wheeltapper.ground.errors import ComputationError, InputError
from wheeltapper.ground.progress import reporting
from wheeltapper.march.common.blocks import core_count

MOST_SESSIONS = 64
"""Sessions that are kept; of more, those without a page go first."""
KEY = r"[0-9a-f]{16}"
"""What a session may be called."""
FEATURES = "wheeltapper.record.features"
"""The room of what a map can show."""
LINES = 8
"""Most lines of refused edits that are sent at a time."""


class GoneError(Exception):
    """The page is gone, and nothing can be sent to it."""


class Desk:
    """All sessions, and the threads that compute for them.

    Parameters
    ----------
    scene
        What a new page shows; None: the last scene of its browser, or a wheelset over a bump.
    folder
        The working folder: files that scenes name must be in it.
    """

    def __init__(self, scene: Scenario | None, folder: Path) -> None:
        self.given = scene
        self.files = Files(folder, None if scene is None else table_of(scene))
        self.sessions: dict[str, Session] = {}
        self.linked: set[str] = set()
        self.says: dict[str, Callable[[str], None]] = {}
        self._folder = TemporaryDirectory(prefix="wheeltapper-")
        self.dropped = Path(self._folder.name)
        self.last: Session | None = None
        self.pool = ThreadPoolExecutor(max_workers=max(2, core_count()), thread_name_prefix="explorer")

    def close(self) -> None:
        """Stop computing, and remove what was dropped."""
        self.pool.shutdown(wait=False, cancel_futures=True)
        self._folder.cleanup()

    @property
    def start(self) -> Scenario:
        """What a page shows that brings nothing."""
        return start_scene() if self.given is None else self.given

    def session(self, key: str, kept: Any) -> tuple[Session, str]:
        """Return a page's session, and a line that says what could not be brought back.

        Parameters
        ----------
        key
            What the page was called before; a page that shows up twice gets a session of its own.
        kept
            The scene that the page has kept, for a server that does not know it.
        """
        found = self.sessions.get(key)
        if found is not None and key not in self.linked:
            self.linked.add(key)
            return found, ""
        if key in self.linked or not re.fullmatch(KEY, key):  # a key names a folder
            key = secrets.token_hex(8)
        new, line = Session(key, self.start, self.files), ""
        if found is not None:
            new.scene, new.site = found.scene, found.site
        elif kept is not None:
            try:
                new.scene = new.read_table(kept)
            except (InputError, RecursionError, TypeError, ValueError) as error:
                line = f"the last scene cannot be brought back: {error}"
        self.sessions[new.key] = new
        self.linked.add(new.key)
        self._forget()
        return new, line

    def place_for(self, session: Session, name: str) -> Path:
        """Return where a file that is dropped on a page is kept."""
        folder = self.dropped / session.key
        folder.mkdir(exist_ok=True)
        return folder / safe_name(name)

    def taken(self, session: Session, path: Path) -> dict[str, Any]:
        """Take a dropped file; return what the page says and shows of it, or what is wrong with it."""
        say: Callable[[str], None] = self.says.get(session.key, lambda line: None)
        try:
            return taken(session, path, say)
        except Exception as error:  # whatever it is, the page says it in a line, and goes on
            return {"wrong": line_of(error).replace(f"{path.parent}/", "")}
        finally:
            say("")

    def _forget(self) -> None:
        for key in [key for key in self.sessions if key not in self.linked]:
            if len(self.sessions) <= MOST_SESSIONS:
                return
            del self.sessions[key]


class Link:
    """What answers one page; all but the computing happens in the event loop in which it is made.

    Parameters
    ----------
    desk
        Where the page's session is kept.
    send
        Sends a frame's bytes to the page, or raises a `GoneError`.
    """

    def __init__(self, desk: Desk, send: Callable[[bytes], Awaitable[None]]) -> None:
        self._desk, self._carry = desk, send
        self._edits: deque[dict[str, Any]] = deque()
        self._asked: dict[str, dict[str, Any]] = {}
        self._seq = 0
        self._wake = asyncio.Event()
        self._newest: dict[str, int] = {}
        self._sending = asyncio.Lock()
        self._loop = asyncio.get_running_loop()
        self._session: Session | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._last_words = ""

    async def begin(self, hello: dict[str, Any]) -> None:
        """Answer a page's first message, and from then on what is asked."""
        kept = hello.get("scene") or (hello.get("last") if self._desk.given is None else None)
        self._session, line = self._desk.session(str(hello.get("session", ""))[:64], kept)
        self._desk.last = self._session
        self._desk.says[self._session.key] = self._say
        self._session.sent_surface = None
        await self._send(Frame("hello", session=self._session.key, line=line, **_offers()))
        await self._send(self._session.scene_frame())
        self.ask({"do": "look"})
        runner = asyncio.create_task(self._answer())
        self._tasks.add(runner)
        runner.add_done_callback(self._tasks.discard)

    def end(self) -> None:
        """Answer no more; the session is kept for the page's return."""
        self._newest = {name: number + 1 for name, number in self._newest.items()}
        for task in self._tasks:
            task.cancel()
        if self._session is not None:
            self._desk.linked.discard(self._session.key)
            self._desk.says.pop(self._session.key, None)

    # -- what is asked ------------------------------------------------------------------------------------------------

    def ask(self, message: dict[str, Any]) -> None:
        """Take a message of the page; of questions only the newest of a kind is kept."""
        what = str(message.get("do", ""))
        self._seq = int(message.get("seq", self._seq) or 0)
        if what in ("set", "set several", "add", "remove", "bring"):
            if self._edits and what == "set" and self._edits[-1].get("path") == message.get("path"):
                self._edits.pop()
            self._edits.append(message)
        else:
            self._asked[what] = message
        kind = "map" if what == "map" else "run"
        self._newest[kind] = self._newest.get(kind, 0) + 1
        self._wake.set()

    async def _answer(self) -> None:
        while True:
            await self._wake.wait()
            self._wake.clear()
            edits, asked = list(self._edits), dict(self._asked)
            self._edits.clear()
            self._asked.clear()
            try:
                await self._answer_run(edits, asked)
                for what, message in asked.items():
                    await self._answer_other(what, message)
            except GoneError:
                return

    async def _answer_run(self, edits: list[dict[str, Any]], asked: dict[str, dict[str, Any]]) -> None:
        session, number, seq = self.session, self._newest.get("run", 0), self._seq
        self._desk.last = session
        settled, before, refused = any(one.get("settled", True) for one in edits), session.scene, []
        if edits:
            refused = await self._in_thread(session.edit, edits)
            if refused:
                lines = [[one.field, one.line] for one in refused][:LINES]
                await self._send(Frame("refused", seq=seq, lines=lines))
        if "back" in asked or "forth" in asked:
            settled = (session.back if "back" in asked else session.forth)() or settled
        if "look" in asked:
            session.shown = _shown(asked["look"], session.shown)
        settled = settled or "show" in asked
        if edits and session.scene is before and session.record is not None and not refused and not asked:
            frame = await self._in_thread(session.scene_frame)  # a slider came to rest where its run is shown already
            frame.head["seq"] = seq
            await self._send(frame)
            return
        if not edits and not {"back", "forth", "look", "show"} & set(asked):
            return
        try:
            frames = await self._in_thread(
                session.run_frames, seq, lambda: number != self._newest.get("run"), self._say
            )
        except SupersededError:
            self._wake.set()
            return
        except Exception as error:  # whatever it is, the page says it in a line, and goes on
            field = error.field if isinstance(error, InputError) else ""
            await self._send(Frame("refused", seq=seq, lines=[[field, line_of(error)]], run=False))
        else:
            for frame in frames:
                await self._send(frame)
        if settled:
            await self._send(await self._in_thread(session.scene_frame))

    async def _answer_other(self, what: str, message: dict[str, Any]) -> None:
        """Answer what is neither an edit nor a look: a map, which is filled beside the runs."""
        if what != "map":
            return
        number = self._newest["map"]
        task = asyncio.create_task(self._fill(message, lambda: number != self._newest.get("map")))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _fill(self, message: dict[str, Any], is_stale: Callable[[], bool]) -> None:
        """Fill a map in a thread, and send each tile as soon as it is there."""
        from wheeltapper.faces.explore.mapping import Asked, Map  # what no first picture waits for

        session, told = self.session, asyncio.Queue[Frame | None]()

        def fill() -> None:
            try:
                with reporting(lambda what, done, total: None, self._say):
                    found = Map(Asked.of(message, session.scene))
                    for frame in found.frames(is_stale):
                        self._loop.call_soon_threadsafe(told.put_nowait, frame)
                session.map = found
            except Exception as error:  # whatever it is, the page says it in a line, and goes on
                frame = Frame("map refused", number=message.get("number"), line=line_of(error))
                self._loop.call_soon_threadsafe(told.put_nowait, frame)
            finally:
                self._loop.call_soon_threadsafe(told.put_nowait, None)

        work = self._loop.run_in_executor(self._desk.pool, fill)
        with suppress(GoneError):
            while (frame := await told.get()) is not None:
                if not is_stale():
                    await self._send(frame)
        await work

    # -- sending ------------------------------------------------------------------------------------------------------

    @property
    def session(self) -> Session:
        """The page's session, once it has begun."""
        assert self._session is not None
        return self._session

    async def _in_thread(self, work: Any, *arguments: Any) -> Any:
        return await self._loop.run_in_executor(self._desk.pool, work, *arguments)

    def _say(self, line: str) -> None:
        """Show a line on the page, from any thread; an empty one ends what was told of a work that is done."""
        if line != self._last_words:
            self._last_words = line
            asyncio.run_coroutine_threadsafe(self._send(Frame("words", line=line)), self._loop)

    async def _send(self, frame: Frame) -> None:
        async with self._sending:
            await self._carry(frame.encoded())


def line_of(error: Exception) -> str:
    """Return what a page says of an error, in one line."""
    if isinstance(error, InputError | ComputationError):
        return str(error)
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def _offers() -> dict[str, Any]:
    """Return what a page can ask for besides runs."""
    features = [make() for make in registered_in(FEATURES).values()]
    return {
        "features": [[one.name, one.unit, one.definition] for one in features],
        "exports": [[name, export.words] for name, export in EXPORTS.items()],
    }


def _shown(asked: dict[str, Any], before: Shown) -> Shown:
    """Return what the page has chosen to see."""
    texts = {name: str(asked[name])[:200] for name in ("below", "phase", "spectrum") if asked.get(name) is not None}
    out = replace(before, **texts)  # type: ignore[arg-type]
    if "first" in asked:
        first, last = asked.get("first"), asked.get("last")
        if isinstance(first, int | float) and isinstance(last, int | float) and 0.0 <= first < last:
            return replace(out, first=float(first), last=float(last))
        return replace(out, first=0.0, last=None)
    return out
