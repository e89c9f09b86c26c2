"""A page of the explorer as its server sees it: what it sends, and what comes back."""

import json
from contextlib import ExitStack, closing
from http.client import HTTPConnection
from importlib.util import find_spec
from types import TracebackType
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import pytest

from wheeltapper.faces.explore.frames import decoded
from wheeltapper.faces.explore.launch import NEEDED, Explorer

Head = dict[str, Any]
MISSING = [name for name in NEEDED if find_spec(name) is None]
EXTRA = pytest.mark.skipif(bool(MISSING), reason=f"the extra explore is not installed: no {', '.join(MISSING)}")


class Answer(NamedTuple):
    status: int
    headers: Any
    body: bytes


def request(
    explorer: Explorer, path: str = "", method: str = "GET", headers: dict[str, str] | None = None, body: bytes = b"",
    token: str | None = None,
) -> Answer:  # fmt: skip
    """Send a request as it is, without a client's own ideas of Host and of dots in paths."""
    given = {"Host": f"127.0.0.1:{explorer.port}"} | (headers or {})
    prefix = urlsplit(explorer.address).path if token is None else f"/{token}/"
    with closing(HTTPConnection("127.0.0.1", explorer.port, timeout=60)) as connection:
        connection.putrequest(method, prefix + path, skip_host=True)
        for name, value in (given | {"Content-Length": str(len(body)), "Connection": "close"}).items():
            connection.putheader(name, value)
        connection.endheaders(body)
        with connection.getresponse() as answer:
            return Answer(answer.status, answer.headers, answer.read())


def origin(explorer: Explorer) -> str:
    return f"http://127.0.0.1:{explorer.port}"


class Conversation:
    """A page that is open, whatever carries its messages."""

    hello: Head
    scene: Head
    run: Head
    arrays: list[Any]

    def received(self) -> bytes:
        """Return the next frame; kernels may have to be compiled first."""
        raise NotImplementedError

    def send(self, do: str, **message: Any) -> None:
        raise NotImplementedError

    def begin(self) -> None:
        self.hello, _ = self.next("hello")
        self.scene, _ = self.next("scene")
        self.run, self.arrays = self.next("run")

    def next(self, *kinds: str) -> tuple[Head, list[Any]]:
        """Return the next frame of one of some kinds."""
        while True:
            head, arrays = decoded(self.received())
            if head["kind"] in kinds:
                return head, arrays

    def set(self, path: str, value: Any) -> Head:
        """Change a field and return the scene that then is."""
        self.send("set", path=path, value=value)
        self.run, self.arrays = self.next("run")
        self.scene, _ = self.next("scene")
        return dict(self.scene["table"])


class Page(Conversation):
    """A page of the server."""

    def __init__(self, explorer: Explorer, session: str = "", scene: Head | None = None) -> None:
        from websockets.sync.client import connect

        address = explorer.address.replace("http:", "ws:") + "link"
        self._open = ExitStack()
        self.socket: Any = self._open.enter_context(connect(address, origin=origin(explorer), max_size=None))
        self.socket.send(json.dumps({"session": session, "scene": scene}))
        self.begin()

    def received(self) -> bytes:
        message = self.socket.recv(timeout=900)
        assert isinstance(message, bytes)
        return message

    def send(self, do: str, **message: Any) -> None:
        self.socket.send(json.dumps({"do": do, **message}))

    def __enter__(self) -> "Page":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._open.close()
