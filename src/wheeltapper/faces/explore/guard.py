"""Who may talk to the server: pages of its own, on this machine, that know the token."""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "font-src 'self' data:; connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""The page loads nothing from elsewhere. BokehJS writes style sheets into the page, which need 'unsafe-inline'."""


class Guard:
    """The outermost application: it refuses foreign hosts and origins, and addresses without the token.

    A page of another site that this machine's browser shows may send requests to 127.0.0.1. It can neither know the
    token, nor set Host and Origin, which therefore tell it apart, also where a name of its own leads to 127.0.0.1.

    Parameters
    ----------
    app
        What answers the others, at addresses without the token.
    token
        First part of every address.
    port
        Of the server.
    """

    def __init__(self, app: App, token: str, port: int) -> None:
        self._app, self._token = app, token
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        reason = self._refusal(scope)
        if reason is not None:
            await _refuse(scope, receive, send, reason)
            return
        inner = dict(scope)
        prefix = f"/{self._token}"
        inner["path"] = scope["path"].removeprefix(prefix) or "/"
        inner["raw_path"] = inner["path"].encode()
        host = self._header(scope, b"host") or ""
        await self._app(inner, receive, _with_headers(send, host))

    def _refusal(self, scope: Message) -> str | None:
        host, origin = self._header(scope, b"host"), self._header(scope, b"origin")
        if host not in self._hosts:
            return "this host is not the explorer's"
        if origin is not None and origin not in {f"http://{name}" for name in self._hosts}:
            return "this origin is not the explorer's"
        writes = scope["type"] == "websocket" or scope.get("method") not in ("GET", "HEAD")
        if writes and origin is None:
            return "an origin is needed"
        first = str(scope["path"]).split("/")[1:2]
        if not first or not secrets.compare_digest(first[0].encode(), self._token.encode()):
            return "the address needs the token that the explorer has printed"
        return None

    @staticmethod
    def _header(scope: Message, name: bytes) -> str | None:
        found = [value.decode("latin-1") for key, value in scope["headers"] if key == name]
        return found[0] if len(found) == 1 else None if not found else "\0several"


def _with_headers(send: Send, host: str) -> Send:
    """Return what sends answers with the headers by which a browser keeps the page to itself."""
    added = [
        (b"content-security-policy", POLICY.format(host=host).encode()),
        (b"referrer-policy", b"no-referrer"),
        (b"x-content-type-options", b"nosniff"),
        (b"cross-origin-resource-policy", b"same-origin"),
        (b"cross-origin-opener-policy", b"same-origin"),
    ]

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", ()), *added]
        await send(message)

    return sending


async def _refuse(scope: Message, receive: Receive, send: Send, reason: str) -> None:
    if scope["type"] == "websocket":
        await receive()  # the beginning of the connection, which is then refused
        await send({"type": "websocket.close", "code": 4403, "reason": reason})
        return
    text = f"refused: {reason}\n".encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(text)).encode())]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": text})
