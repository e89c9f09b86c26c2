"""A widget as a notebook's kernel sees it: messages that come over its channel, and what it sends there."""

from importlib.util import find_spec
from queue import Queue
from typing import Any

import pytest

from wheeltapper.faces.explore.notebook import NEEDED

from .pages import Conversation, Head

MISSING = [name for name in NEEDED if find_spec(name) is None]
EXTRA = pytest.mark.skipif(bool(MISSING), reason=f"the extra notebook is not installed: no {', '.join(MISSING)}")
Message = tuple[Head, list[bytes]]


class Channel:
    """The kernel's end of a widget's channel: what is published is heard by all who listen."""

    def __init__(self, widget: Any) -> None:
        self.widget, self.listening = widget, []
        widget.comm.publish_msg = self._published

    def listen(self, heard: Any) -> None:
        self.listening.append(heard)

    def _published(self, kind: str, data: Any = None, metadata: Any = None, buffers: Any = None, **more: Any) -> None:
        if kind == "comm_msg" and data["method"] == "custom":
            for heard in self.listening:
                heard(data["content"], [bytes(buffer) for buffer in buffers or ()])

    def send(self, content: Head, buffers: list[bytes] | None = None) -> None:
        """Give the widget a message as Jupyter does."""
        message = {"content": {"data": {"method": "custom", "content": content}}, "buffers": buffers or []}
        self.widget.comm.handle_msg(message)


class Cell(Conversation):
    """A view of a widget in a cell's output."""

    def __init__(self, channel: Channel, view: str = "a", session: str = "") -> None:
        self.channel, self.view = channel, view
        self.frames: Queue[bytes] = Queue()
        self.answers: Queue[Message] = Queue()
        self.heard = 0
        channel.listen(self._hear)
        self.send("hello", session=session)
        self.begin()

    def _hear(self, content: Head, buffers: list[bytes]) -> None:
        if content["view"] != self.view:
            return
        if content.get("heard"):
            self.heard += 1
        elif "files" in content or "number" in content:
            self.answers.put((content, buffers))
        else:
            self.frames.put(buffers[0])

    def received(self) -> bytes:
        return self.frames.get(timeout=900)

    def send(self, do: str, **message: Any) -> None:
        self.channel.send({"view": self.view, "do": do, **message})

    def ask(self, do: str, buffers: list[bytes] | None = None, **message: Any) -> Message:
        """Ask something that has one answer."""
        self.channel.send({"view": self.view, "do": do, **message}, buffers)
        return self.answers.get(timeout=300)
