"""The explorer as a widget: every view of it is a page, whose messages come over the channel of the notebook."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from threading import Thread
from typing import Any

import anywidget
import traitlets

from wheeltapper.describe.scenario import Scenario
from wheeltapper.faces.explore.exports import exported
from wheeltapper.faces.explore.launch import warm_up
from wheeltapper.faces.explore.link import Desk, Link, line_of
from wheeltapper.faces.explore.pagefiles import LIBRARIES, PAGE, library_folder

Message = dict[str, Any]
ELSEWHERE = ("socket.js", "widget.js", "icon.svg")
"""Files of the page that a widget's frame does not load."""


class ExplorerWidget(anywidget.AnyWidget):
    """The explorer's page in a notebook; on the last line of a cell it shows itself.

    Simulations run in threads of their own: cells can be executed meanwhile. While a cell keeps the kernel busy, the
    page waits.

    Attributes
    ----------
    height
        Height of the page, pixels.
    """

    _esm = PAGE / "widget.js"
    height = traitlets.Int().tag(sync=True)

    def __init__(self, scene: Scenario | None, height: int, folder: Path | None = None) -> None:
        self._desk = Desk(scene, folder or Path.cwd())
        self._links: dict[str, Link] = {}
        super().__init__(height=height)
        self.on_msg(self._heard)
        Thread(target=warm_up, args=(scene,), daemon=True).start()

    @property
    def scenario(self) -> Scenario:
        """The scenario of the view that was changed last."""
        return self._desk.start if self._desk.last is None else self._desk.last.scene

    def close(self) -> None:
        """End the explorer; views that are open keep what they show."""
        super().close()
        for view in list(self._links):
            _loop().call_soon_threadsafe(self._end, view)
        self._desk.close()

    def __repr__(self) -> str:
        return f"<ExplorerWidget {self.scenario!r}>"

    # -- messages: they come in the kernel's thread, and are answered in another one ----------------------------------

    def _heard(self, _: Any, message: Any, buffers: Sequence[memoryview]) -> None:
        if isinstance(message, dict) and isinstance(message.get("view"), str):
            asyncio.run_coroutine_threadsafe(self._take(message["view"], message, buffers), _loop())

    async def _take(self, view: str, message: Message, buffers: Sequence[memoryview]) -> None:
        self.send({"view": view, "heard": True})
        link = self._links.get(view)
        match message.get("do"):
            case "files":
                paths = [path for path in PAGE.iterdir() if path.is_file() and path.name not in ELSEWHERE]
                paths += [library_folder() / name for name in LIBRARIES]
                self.send({"view": view, "files": [one.name for one in paths]}, [one.read_bytes() for one in paths])
            case "hello":
                await self._begin(view, message)
            case "bye":
                self._end(view)
            case "export" | "drop" as what if link is not None:
                work = partial(self._exported if what == "export" else self._dropped, link, message, buffers)
                told, body = await asyncio.get_running_loop().run_in_executor(self._desk.pool, work)
                self.send({"view": view, "number": message.get("number")} | told, body)
            case _ if link is not None:
                link.ask(message)

    async def _begin(self, view: str, hello: Message) -> None:
        """Begin to answer a page, or one that was loaded again."""

        async def send(frame: bytes) -> None:
            self.send({"view": view}, [frame])

        self._end(view)
        if self._desk.last is not None:
            self._desk.given = self._desk.last.scene  # a second view shows what the first one shows
        link = self._links[view] = Link(self._desk, send)
        await link.begin({"session": hello.get("session", "")})

    def _end(self, view: str) -> None:
        link = self._links.pop(view, None)
        if link is not None:
            link.end()

    @staticmethod
    def _exported(link: Link, message: Message, _: Sequence[memoryview]) -> tuple[Message, list[bytes]]:
        try:
            body, kind = exported(link.session, str(message.get("name")))
        except Exception as error:  # whatever it is, the page says it in a line, and goes on
            return {"wrong": line_of(error)}, []
        return {"type": kind}, [body]

    def _dropped(self, link: Link, message: Message, buffers: Sequence[memoryview]) -> tuple[Message, list[bytes]]:
        path = self._desk.place_for(link.session, str(message.get("name", "")))
        path.write_bytes(b"".join(bytes(buffer) for buffer in buffers))
        return self._desk.taken(link.session, path), []


@cache
def _loop() -> asyncio.AbstractEventLoop:
    """Return the event loop in which the pages of all widgets are answered, in a thread of its own."""
    loop = asyncio.new_event_loop()
    Thread(target=loop.run_forever, name="explorer", daemon=True).start()
    return loop
