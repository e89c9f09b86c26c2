"""The explorer as a widget: what comes over a notebook's channel is what the server sends; no other file is needed."""

import re
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.faces.explore.frames import decoded
from wheeltapper.faces.explore.launch import Explorer
from wheeltapper.faces.explore.scenes import start_scene

from .cells import EXTRA, Cell, Channel
from .pages import EXTRA as SERVER
from .pages import Conversation, Head, Page

pytestmark = EXTRA
ROOT = Path(__file__).parents[2]


@pytest.fixture
def widget(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.chdir(tmp_path)
    held = wt.show.widget(start_scene())
    yield held
    held.close()


def said(page: Conversation) -> tuple[Head, list[Any]]:
    """Return a page's run without what differs from page to page: the number of the question."""
    return {name: held for name, held in page.run.items() if name != "seq"}, page.arrays


@SERVER
def test_a_cell_gets_the_frames_that_the_server_sends(widget: Any, tmp_path: Path) -> None:
    cell = Cell(Channel(widget))
    with Explorer(start_scene(), folder=tmp_path).start() as explorer, Page(explorer) as page:
        assert cell.hello.keys() == page.hello.keys()
        for path, value in ((None, None), ("vehicle.damping", "30 kN s/m"), ("track", {"type": "FloatingDeck"})):
            if path is not None:
                assert cell.set(path, value) == page.set(path, value)
            (ours, our_arrays), (theirs, their_arrays) = said(cell), said(page)
            assert ours == theirs
            assert len(our_arrays) > 10
            for one, other in zip(our_arrays, their_arrays, strict=True):
                np.testing.assert_array_equal(one, other)
            assert cell.scene == page.scene
    assert widget.scenario == wt.Scenario.of(cell.scene["table"])


def test_of_many_values_of_a_slider_the_last_one_is_shown(widget: Any) -> None:
    cell = Cell(Channel(widget))
    for damping in np.linspace(1e4, 9e4, 40):
        cell.send("set", path="vehicle.damping", value=float(damping), settled=False)
    cell.send("set", path="vehicle.damping", value="77 kN s/m")
    cell.scene, _ = cell.next("scene")
    assert cell.scene["table"]["vehicle"]["damping"] == 77e3
    assert cell.frames.empty() or cell.frames.qsize() < 20, "most values were superseded"
    assert widget.scenario.vehicle.damping == 77e3


def test_messages_are_taken_at_once_and_answered_by_other_threads(widget: Any) -> None:
    import threading

    channel, threads = Channel(widget), set[str]()
    channel.listen(lambda content, buffers: threads.add(threading.current_thread().name))
    cell = Cell(channel)
    cell.set("speed", 8.0)
    assert cell.heard == 2
    assert threads == {"explorer"}


def test_a_value_that_the_scene_cannot_take_is_refused_beside_its_field(widget: Any) -> None:
    cell = Cell(Channel(widget))
    cell.send("set", path="vehicle.mass", value=-1.0)
    refused, _ = cell.next("refused")
    assert "greater than 0" in refused["lines"][0][1]
    assert widget.scenario == start_scene()


def test_a_view_that_is_loaded_again_finds_its_scene_and_a_second_one_begins_with_it(widget: Any) -> None:
    channel = Channel(widget)
    first = Cell(channel)
    first.set("speed", 7.0)
    again = Cell(channel, session=first.hello["session"])  # the frame was moved in the notebook
    assert again.hello["session"] == first.hello["session"]
    assert again.scene["table"]["speed"] == 7.0
    second = Cell(channel, "b")
    assert second.scene["table"]["speed"] == 7.0
    second.set("speed", 5.0)
    assert again.set("vehicle.mass", 1400.0)["speed"] == 7.0


def test_the_page_comes_over_the_channel_and_needs_no_other_file(widget: Any) -> None:
    cell = Cell(Channel(widget))
    told, bodies = cell.ask("files")
    files = dict(zip(told["files"], (body.decode() for body in bodies), strict=True))
    assert {"index.html", "style.css", "main.js", "comm.js", "bokeh.min.js", "bokeh-api.min.js"} <= files.keys()
    for name, text in files.items():
        if name.endswith(".js") and not name.endswith(".min.js"):
            assert set(re.findall(r'from "\./([\w-]+\.js)"', text)) <= files.keys(), name
            assert 'from "http' not in text
    assert "socket.js" not in files


def test_what_is_taken_and_what_is_dropped_goes_over_the_channel(widget: Any, tmp_path: Path) -> None:
    cell = Cell(Channel(widget))
    told, (body,) = cell.ask("export", name="record.nc", number=1)
    (tmp_path / "record.nc").write_bytes(body)
    loaded = wt.load(tmp_path / "record.nc")
    assert isinstance(loaded, wt.Record)
    assert (told["number"], loaded.scenario) == (1, start_scene())
    told, bodies = cell.ask("export", name="passwd", number=2)
    assert "scene.toml" in told["wrong"]
    assert bodies == []
    flat = (ROOT / "examples" / "wheel_flat.toml").read_bytes()
    told, _ = cell.ask("drop", [flat], name="../flat.toml", number=3)
    assert told["scene"]
    assert isinstance(widget.scenario.irregularity[0], wt.WheelFlat)
    assert list(tmp_path.glob("*.toml")) == []
    told, _ = cell.ask("drop", [b"MZ"], name="x.exe", number=4)
    assert "suffix" in told["wrong"]


def test_files_outside_the_working_folder_are_refused(widget: Any, tmp_path: Path) -> None:
    (tmp_path.parent / "secret.csv").write_text("x [m];z [mm]\n0;0\n1;0\n", encoding="utf-8")
    cell = Cell(Channel(widget))
    for path in ("../secret.csv", "/etc/passwd"):
        cell.send("set", path="irregularity.0", value={"type": "Measured", "path": path, "noise": 1e-6})
        refused, _ = cell.next("refused")
        assert "the working folder" in refused["lines"][0][1]
    assert widget.scenario == start_scene()


def test_without_the_extra_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "wheeltapper.faces.explore.notebook.find_spec", lambda name: None if name == "anywidget" else name
    )
    with pytest.raises(wt.InputError, match=r"no package anywidget; allowed: pip install 'wheeltapper\[notebook\]'"):
        wt.show.widget()


@pytest.mark.parametrize(("options", "match"), [({"height": 10}, "height"), ({"scene": 3}, "scenario")])
def test_wrong_arguments_are_one_line(options: Head, match: str) -> None:
    with pytest.raises(wt.InputError, match=match):
        wt.show.widget(**options)


def test_neither_the_package_nor_the_explorer_loads_what_notebooks_need() -> None:
    import subprocess

    asked = "import sys, wheeltapper.faces.explore.launch; print({'anywidget', 'ipywidgets'} & sys.modules.keys())"
    assert subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True).stdout == "set()\n"


KERNEL = pytest.mark.skipif(
    any(find_spec(name) is None for name in ("ipykernel", "nbclient")), reason="no packages ipykernel, nbclient"
)


@pytest.mark.slow
@KERNEL
@pytest.mark.filterwarnings("ignore")
def test_a_notebook_with_the_widget_runs_in_jupyter(tmp_path: Path) -> None:
    from nbclient import NotebookClient
    from nbformat.v4 import new_code_cell, new_notebook

    lines = [
        "import wheeltapper as wt\npage = wt.show.widget()\npage",
        "wt.simulate(page.scenario)\nprint(page.scenario.speed)",
    ]
    notebook = new_notebook(cells=[new_code_cell(line) for line in lines])
    NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": tmp_path}}).execute()
    first, second = (cell.outputs for cell in notebook.cells)  # a slow machine shows a bar besides
    (shown,) = (one for one in first if "data" in one)
    (printed,) = (one for one in second if one.get("name") == "stdout")
    model = shown["data"]["application/vnd.jupyter.widget-view+json"]["model_id"]
    state = notebook.metadata.widgets["application/vnd.jupyter.widget-state+json"]["state"][model]["state"]
    assert (state["_model_module"], state["height"]) == ("anywidget", 820)
    assert "msg:custom" in state["_esm"]
    assert len(state["_esm"]) < 10_000, "what a notebook keeps is small"
    assert printed["text"] == "9.0\n"


@pytest.mark.slow
@KERNEL
@pytest.mark.filterwarnings("ignore")
def test_a_kernel_answers_a_page_while_a_cell_waits_for_its_run() -> None:
    """Messages go over a kernel's own sockets, as a notebook's do."""
    from jupyter_client.manager import start_new_kernel

    manager, client = start_new_kernel(kernel_name="python3")
    try:
        client.execute("import wheeltapper as wt\npage = wt.show.widget()\npage")
        opened = published(client, is_the_widget)[-1]
        channel = opened["content"]["comm_id"]

        def send(**content: Any) -> None:
            data = {"method": "custom", "content": {"view": "a", **content}}
            client.shell_channel.send(client.session.msg("comm_msg", {"comm_id": channel, "data": data}))

        def frame(kind: str) -> Head:
            def is_it(message: Any) -> bool:
                held = message.get("buffers")
                return bool(held) and decoded(bytes(held[0]))[0]["kind"] == kind

            return decoded(bytes(published(client, is_it)[-1]["buffers"][0]))[0]

        send(do="hello")
        assert frame("hello")["features"]
        assert frame("run")["summary"] == str(wt.simulate(start_scene()))
        send(do="set", path="speed", value=7.0)
        assert frame("run")["speed"] == 7.0
        assert frame("scene")["table"]["speed"] == 7.0
        send(do="set", path="speed", value=6.0)
        client.execute("import time; time.sleep(3.0); print('slept')")
        seen = published(client, lambda message: message["msg_type"] == "stream")
        kinds = [decoded(bytes(one["buffers"][0]))[0]["kind"] for one in seen if one.get("buffers")]
        assert "run" in kinds, "a run that was asked before a cell is drawn while the cell is busy"
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)


def is_the_widget(message: Any) -> bool:
    """Return whether a message opens the widget's channel; its layout has one of its own."""
    held = message["content"].get("data", {}).get("state", {})
    return bool(message["msg_type"] == "comm_open" and held.get("_model_module") == "anywidget")


def published(client: Any, is_last: Callable[[Any], bool]) -> list[Any]:
    """Return what a kernel publishes, to the first message that is the last one wanted."""
    found: list[Any] = []
    while not (found and is_last(found[-1])):
        found.append(client.get_iopub_msg(timeout=120))
    return found
