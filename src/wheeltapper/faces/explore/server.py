"""The server: the page's files, its websocket, exports and dropped files."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from wheeltapper.faces.explore.drops import LARGEST as MOST_DROPPED
from wheeltapper.faces.explore.exports import exported
from wheeltapper.faces.explore.guard import Guard
from wheeltapper.faces.explore.link import Desk, GoneError, Link
from wheeltapper.faces.explore.pagefiles import LIBRARIES, PAGE, library_folder
from wheeltapper.ground.errors import ComputationError, InputError

KINDS = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}


def application(desk: Desk, token: str, port: int) -> Guard:
    """Return the whole application, guarded."""

    async def page(request: Request) -> Response:
        name = request.path_params.get("name") or "index.html"
        return _file(PAGE, name, tuple(path.name for path in PAGE.iterdir()))

    async def library(request: Request) -> Response:
        return _file(library_folder(), request.path_params["name"], LIBRARIES, "private, max-age=86400")

    async def export(request: Request) -> Response:
        session = desk.sessions.get(request.path_params["session"])
        if session is None:
            return PlainTextResponse("there is no such session\n", 404)
        name = request.path_params["name"]
        try:
            body, kind = await asyncio.get_running_loop().run_in_executor(desk.pool, exported, session, name)
        except (InputError, ComputationError) as error:
            return PlainTextResponse(f"{error}\n", 400)
        headers = {"content-disposition": f'attachment; filename="{name}"', "cache-control": "no-store"}
        return Response(body, media_type=kind, headers=headers)

    async def drop(request: Request) -> Response:
        session = desk.sessions.get(request.query_params.get("session", ""))
        if session is None:
            return JSONResponse({"wrong": "there is no such session"}, 404)
        path, size = desk.place_for(session, request.query_params.get("name", "")), 0
        with path.open("wb") as out:
            async for part in request.stream():
                size += len(part)
                if size > MOST_DROPPED:
                    return JSONResponse({"wrong": f"{path.name}: more than {MOST_DROPPED >> 20} MiB"}, 413)
                out.write(part)
        told = await asyncio.get_running_loop().run_in_executor(desk.pool, desk.taken, session, path)
        return JSONResponse(told, 400 if "wrong" in told else 200)

    async def link(socket: WebSocket) -> None:
        await _serve(desk, socket)

    inner = Starlette(
        routes=[
            Route("/", page), Route("/page/{name}", page), Route("/lib/{name}", library),
            Route("/export/{session}/{name}", export), Route("/drop", drop, methods=["POST"]),
            WebSocketRoute("/link", link),
        ]
    )  # fmt: skip
    return Guard(inner, token, port)


async def _serve(desk: Desk, socket: WebSocket) -> None:
    """Answer a page until it goes away."""

    async def send(message: bytes) -> None:
        try:
            await socket.send_bytes(message)
        except (WebSocketDisconnect, RuntimeError) as error:  # RuntimeError: it went away while something was sent
            raise GoneError from error

    await socket.accept()
    link = Link(desk, send)
    try:
        await link.begin(json.loads(await socket.receive_text()))
        while True:
            link.ask(json.loads(await socket.receive_text()))
    except (WebSocketDisconnect, GoneError):
        pass
    except (ValueError, ArithmeticError, AttributeError, LookupError, TypeError, RecursionError):
        await socket.close(code=4400, reason="a message that no page sends")
    finally:
        link.end()


def _file(folder: Path, name: str, known: tuple[str, ...], keep: str = "no-store") -> Response:
    if name not in known or Path(name).suffix not in KINDS:
        return PlainTextResponse("there is nothing at this address\n", 404)
    kind = KINDS[Path(name).suffix]
    return Response((folder / name).read_bytes(), media_type=f"{kind}; charset=utf-8", headers={"cache-control": keep})
