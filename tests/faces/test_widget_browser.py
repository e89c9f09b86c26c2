"""The widget's page in headless Chromium: what a user does in a cell's output, with the widget in this process."""

import json
import threading
from collections.abc import Callable, Iterator
from queue import Queue
from typing import Any

import pytest

import wheeltapper as wt
from wheeltapper.faces.explore.scenes import start_scene

from .cells import EXTRA, Channel
from .chromium import MISSING

pytestmark = [EXTRA, pytest.mark.slow, pytest.mark.skipif(bool(MISSING), reason=f"the page is not tested: {MISSING}")]
NOTEBOOK = """<!doctype html><html><head><meta charset="utf-8"><title>notebook</title></head>
<body data-jp-theme-light="THEME"><main id="output"></main></body></html>"""
MODEL = """async ([port, esm, height]) => {
    // What anywidget gives a widget's module: messages as objects with buffers, which begin anywhere in a message.
    const heard = new Set(), socket = new WebSocket(`ws://127.0.0.1:${port}`);
    socket.binaryType = "arraybuffer";
    await new Promise((opened) => { socket.onopen = opened; });
    let content = null, missing = 0, buffers = [];
    const given = () => { for (const callback of [...heard]) callback(content, buffers); };
    socket.onmessage = ({ data }) => {
        if (typeof data === "string") {
            ({ content, missing } = JSON.parse(data));
            buffers = [];
        } else {
            const whole = new Uint8Array(data.byteLength + 3);
            whole.set(new Uint8Array(data), 3);
            buffers.push(new DataView(whole.buffer, 3));
            missing -= 1;
        }
        if (missing === 0) given();
    };
    const model = {
        get: (name) => ({ height })[name],
        on: (name, callback) => { if (name === "msg:custom") heard.add(callback); },
        off: (name, callback) => { heard.delete(callback); },
        send(message, _, sent = []) {
            socket.send(JSON.stringify({ content: message, missing: sent.length }));
            for (const buffer of sent) socket.send(buffer);
        },
    };
    const address = URL.createObjectURL(new Blob([esm], { type: "text/javascript" }));
    const { default: widget } = await import(address);
    globalThis.clean = widget.render({ model, el: document.querySelector("#output") });
}"""


@pytest.fixture
def relayed() -> Iterator[tuple[Any, int]]:
    """A widget, and the port at which its channel is reached."""
    from websockets.sync.server import serve

    widget = wt.show.widget(start_scene(), height=900)
    channel = Channel(widget)

    def answer(socket: Any) -> None:
        out: Queue[tuple[Any, list[bytes]] | None] = Queue()
        channel.listen(lambda content, buffers: out.put((content, buffers)))

        def sending() -> None:
            while (one := out.get()) is not None:
                content, buffers = one
                socket.send(json.dumps({"content": content, "missing": len(buffers)}))
                for buffer in buffers:
                    socket.send(buffer)

        thread = threading.Thread(target=sending, daemon=True)
        thread.start()
        for text in socket:
            message = json.loads(text)
            channel.send(message["content"], [socket.recv() for _ in range(message["missing"])])
        out.put(None)
        thread.join()

    def notebook(socket: Any, request: Any) -> Any:
        """Answer what is no connection with the page of a notebook."""
        if "Upgrade" in request.headers:
            return None
        page = socket.respond(200, NOTEBOOK.replace("THEME", request.path.strip("/")))
        del page.headers["Content-Type"]
        page.headers["Content-Type"] = "text/html"
        return page

    with serve(answer, "127.0.0.1", 0, process_request=notebook) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield widget, server.socket.getsockname()[1]
        server.shutdown()
    widget.close()


@pytest.fixture
def cell(relayed: tuple[Any, int], browser: Any) -> Iterator[Callable[[str], Any]]:
    """Return what shows the widget in a page, light ("true") or dark; at the end no page may have met an error."""
    widget, port = relayed
    context = browser.new_context(viewport={"width": 1300, "height": 950}, accept_downloads=True)
    errors: list[str] = []

    def shown(light: str = "true") -> Any:
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(f"http://127.0.0.1:{port}/{light}")
        page.evaluate(MODEL, [port, str(widget._esm), widget.height])
        page.frame_locator("iframe").locator("html[data-drawn]").wait_for(state="attached", timeout=60_000)
        return page

    yield shown
    context.close()
    assert errors == []


def inside(page: Any) -> Any:
    return page.locator("iframe").element_handle().content_frame()


def wait_for_summary(frame: Any, scene: wt.Scenario) -> None:
    last = str(wt.simulate(scene))
    frame.wait_for_function("last => document.querySelector('#summary').textContent === last", arg=last)


def test_a_slider_in_a_cell_changes_the_picture(cell: Callable[..., Any], relayed: tuple[Any, int]) -> None:
    widget, _ = relayed
    page = cell()
    frame = inside(page)
    wait_for_summary(frame, start_scene())
    before = frame.locator("#force .plot").screenshot()
    frame.focus('[data-path="vehicle.damping"] input[type=range]')
    for _ in range(5):  # half of the slider, to its end
        page.keyboard.press("PageUp")
    wait_for_summary(frame, start_scene().replaced({"vehicle.damping": 5e5}))
    assert widget.scenario.vehicle.damping == pytest.approx(5e5)
    for _ in range(100):  # the words change before the curves are painted
        if frame.locator("#force .plot").screenshot() != before:
            break
        page.wait_for_timeout(50)
    else:
        pytest.fail("the picture of the force stays")
    loaded = frame.evaluate("performance.getEntriesByType('resource').map((entry) => entry.name)")
    assert [name for name in loaded if not name.startswith("blob:")] == []


def test_a_frame_that_is_moved_in_the_notebook_keeps_its_scene(cell: Callable[..., Any]) -> None:
    page = cell("false")
    frame = inside(page)
    assert frame.get_attribute("html", "data-theme") == "dark"  # as the notebook is
    field = frame.locator('[data-path="speed"] input.number')
    field.fill("7 m/s")
    field.press("Enter")
    frame.wait_for_function("() => document.querySelector('#toml').textContent.includes('speed = 7')")
    page.evaluate("document.body.append(document.querySelector('iframe'))")  # it is loaded again
    frame = inside(page)
    frame.wait_for_selector("html[data-drawn]", state="attached")
    frame.wait_for_function("() => document.querySelector('#toml').textContent.includes('speed = 7')")


def test_what_is_taken_in_a_cell_is_saved_by_the_browser(cell: Callable[..., Any]) -> None:
    page = cell()
    frame = inside(page)
    frame.locator("#scene-part > summary").click()
    with page.expect_download() as taken:
        frame.locator("#exports a", has_text="scene, TOML").click()
    assert taken.value.suggested_filename == "scene.toml"
    assert wt.Scenario.from_toml(taken.value.path()) == start_scene()
