"""Starting and ending the explorer: a free port, a token, a server on this machine alone."""

from __future__ import annotations

import secrets
import socket
import sys
import threading
import time
import webbrowser
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wheeltapper.ground.arguments import as_count, check_flag
from wheeltapper.ground.errors import InputError, value_text

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario

NEEDED = ("bokeh", "starlette", "uvicorn", "websockets")
"""What the extra `explore` brings."""
FIRST, TRIED = 8377, 16
"""Ports that are tried first, in order: a browser keeps the last scene by address, port included."""
HOST = "127.0.0.1"
SWITCH = 5e-4
"""Time after which the thread that loads kernels lets those run that answer the page, s; Python's own is 5 ms."""
PATIENCE = 10.0
"""Time in which the server begins to answer, or ends, s."""


def check_installed() -> None:
    """Refuse to begin without the extra.

    Raises
    ------
    InputError
        With what to install.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise InputError(
            "", "explore", f"no package {', '.join(missing)}", "pip install 'wheeltapper[explore]', which brings it"
        )


class Explorer:
    """A running explorer; it ends with the program, at `close`, or at the end of a `with` block.

    Attributes
    ----------
    address
        Address of its page, with the token.
    """

    def __init__(self, scene: Scenario | None = None, port: int | None = None, folder: Path | None = None) -> None:
        check_installed()
        self._socket = _listening(port)
        self.port = int(self._socket.getsockname()[1])
        self._token = secrets.token_urlsafe(24)
        self.address = f"http://{HOST}:{self.port}/{self._token}/"
        self._warming = threading.Thread(target=warm_up, args=(scene,), daemon=True)
        self._warming.start()
        import uvicorn

        from wheeltapper.faces.explore.link import Desk
        from wheeltapper.faces.explore.server import application

        self._desk = Desk(scene, folder or Path.cwd())
        config = uvicorn.Config(
            application(self._desk, self._token, self.port), log_level="critical", access_log=False, lifespan="off",
            timeout_graceful_shutdown=1, ws="websockets-sansio", ws_max_size=2**24, ws_per_message_deflate=False,
        )  # fmt: skip
        self._server = uvicorn.Server(config)
        self._thread: threading.Thread | None = None

    @property
    def scenario(self) -> Scenario:
        """The scenario of the page that was changed last."""
        return self._desk.start if self._desk.last is None else self._desk.last.scene

    def serve(self) -> None:
        """Serve the page in this thread, until Ctrl-C."""
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self._socket.close()
            self._desk.close()

    def start(self) -> Explorer:
        """Serve the page in a thread of its own, and return at once."""
        self._thread = threading.Thread(target=self.serve, name="explorer", daemon=True)
        self._thread.start()
        end = time.monotonic() + PATIENCE
        while not self._server.started and time.monotonic() < end:
            time.sleep(0.005)
        return self

    def wait(self) -> None:
        """Wait until the explorer is closed: a script that does nothing else needs this."""
        while self._thread is not None and self._thread.is_alive():
            self._thread.join(0.5)

    def close(self) -> None:
        """End the explorer; pages that are open keep what they show."""
        self._server.should_exit = True
        if self._thread is not None:
            self._thread.join(PATIENCE)

    def __enter__(self) -> Explorer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Explorer {self.address}>"


def explore(
    scene: Scenario | str | Path | None = None, *, port: int | None = None, open_browser: bool = True
) -> Explorer:
    """Open a page on this machine that shows what a scenario does while its fields are changed.

    The page is served at 127.0.0.1 and uses no network; its address holds a token, and requests without it get no
    answer. It needs the extra `explore`.

    Parameters
    ----------
    scene
        A scenario, or the path of its TOML file. None: the last scene of the browser, or a wheelset over a bump.
    port
        Port of the server; None: a free one.
    open_browser
        Whether the page is opened in the browser.

    Returns
    -------
    Explorer
        Its `address`, the `scenario` that the page shows now, `wait` and `close`. For the output of a
        notebook's cell, `wheeltapper.show.widget` returns the same page.

    Raises
    ------
    InputError
        If the extra is not installed, the port is taken, or there is no such scenario.
    """
    check_installed()
    check_flag(open_browser, "open_browser")
    port = None if port is None else as_count(port, "port")
    found: Any = None
    if scene is not None:
        from wheeltapper.record.arguments import as_scenario

        found = as_scenario(scene)
    explorer = Explorer(found, port).start()
    if open_browser:
        webbrowser.open(explorer.address)
    return explorer


def _listening(port: int | None) -> socket.socket:
    """Return a socket at the port that is asked for, or at a free one."""
    tried = [port] if port is not None else [*range(FIRST, FIRST + TRIED), 0]
    if port is not None and not 0 < port < 2**16:
        raise InputError("", "port", value_text(port), "1 to 65535")
    for one in tried:
        held = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            held.bind((HOST, one or 0))
            held.listen(128)
        except OSError as error:
            held.close()
            if one == tried[-1]:
                raise InputError("", "port", f"{one}, which is taken ({error.strerror})", "a free port") from error
            continue
        return held
    raise AssertionError


def warm_up(scene: Scenario | None) -> None:
    """Load the kernels for the first scene while the browser starts."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH)
    try:
        _compute_once(scene)
    finally:
        sys.setswitchinterval(before)


def _compute_once(scene: Scenario | None) -> None:
    from wheeltapper.faces.explore.sampling import Shown, run_frame
    from wheeltapper.faces.explore.scenes import start_scene
    from wheeltapper.record.simulate import simulated_scenario

    try:
        record = simulated_scenario(scene or start_scene(), "default", lambda notes: None)
        run_frame(record, Shown(), 0)
    except InputError:
        pass  # the page says it
