"""The explorer's page in headless Chromium: what a user does, and what the page then shows."""

import base64
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from wheeltapper import Scenario, WheelFlat, load, simulate

from .chromium import MISSING
from .pages import EXTRA

ROOT = Path(__file__).parents[2]
PROGRAM = Path(sys.executable).with_name("wheeltapper")
pytestmark = [EXTRA, pytest.mark.slow, pytest.mark.skipif(bool(MISSING), reason=f"the page is not tested: {MISSING}")]
BUMP = "completed, 0.12 s: 11 impacts"


class Server:
    """The command, in a process of its own."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.process = subprocess.Popen(
            [PROGRAM, "explore", *options, "--no-browser"], cwd=folder, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().split()[-1]
        self.port = self.address.split(":")[2].split("/")[0]

    def end(self, by: int = signal.SIGINT) -> tuple[int, str]:
        self.process.send_signal(by)
        said, _ = self.process.communicate(timeout=30)
        return self.process.returncode, said


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    held = Server(tmp_path_factory.mktemp("page"))
    yield held
    code, said = held.end()
    assert (code, said) == (0, "wheeltapper: explorer ended\n"), "Ctrl-C ends it, and nothing else was said"


def shows(page: Any, text: str) -> None:
    page.wait_for_function("text => document.querySelector('#summary').textContent.includes(text)", arg=text)


def type_into(page: Any, path: str, text: str) -> Any:
    field = page.locator(f'[data-path="{path}"] input.number')
    field.fill(text)
    field.press("Enter")
    return field


def test_sliders_keys_pins_and_undo(server: Server, opened: Callable[..., Any]) -> None:
    page = opened(server.address)
    shows(page, BUMP)
    page.locator('[data-path="vehicle.damping"] input[type=range]').focus()
    for _ in range(12):
        page.keyboard.press("ArrowRight")
    page.wait_for_function("() => performance.getEntriesByName('slider to picture').length >= 1")
    page.wait_for_function(
        "() => !document.querySelector('#summary').textContent.includes('11 impacts, largest force 5.566')"
    )
    page.keyboard.press("p")
    assert page.locator("#pins tr").count() == 3
    assert "pin 1" in page.inner_text("#force .key")
    for _ in range(40):  # each change of a slider by a key is settled
        if page.locator("#back").is_disabled():
            break
        page.evaluate("document.querySelector('#back').click()")  # nothing where it has just been disabled
        page.wait_for_timeout(60)
    shows(page, f"{BUMP}, largest force 5.566")
    assert "vehicle.damping" in page.inner_text("#pins")
    page.locator("body").press("l")
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    page.focus("#pictures")
    page.keyboard.press(" ")
    page.wait_for_function("() => parseFloat(document.querySelector('#clock').textContent) > 0")
    page.keyboard.press(" ")
    assert page.get_attribute("#play", "aria-pressed") == "false"


def test_wrong_input_is_said_beside_its_field_and_a_reload_keeps_the_scene(
    server: Server, opened: Callable[..., Any]
) -> None:
    page = opened(server.address)
    for text, said in (("-3", "greater than 0"), ("12 kN", "not a mass"), ("1e400", "mass"), ("lots", "mass")):
        type_into(page, "vehicle.mass", text)
        page.wait_for_function(
            "said => document.querySelector('[data-path=\"vehicle.mass\"] .wrong').textContent.includes(said)", arg=said
        )
        shows(page, BUMP)
    type_into(page, "vehicle.mass", "1600 kg")
    page.wait_for_function("() => document.querySelector('#toml').textContent.includes('mass = 1600')")
    assert page.inner_text('[data-path="vehicle.mass"] .wrong') == ""
    page.reload()
    page.wait_for_selector("html[data-drawn]")
    page.wait_for_function("() => document.querySelector('#toml').textContent.includes('mass = 1600')")
    page.select_option('[data-path="track"] > summary select', "FloatingDeck")
    page.wait_for_selector('[data-path="track.stiffness"]')
    page.wait_for_function("() => document.querySelector('#toml').textContent.includes('FloatingDeck')")


def test_a_click_on_the_map_loads_its_run(server: Server, opened: Callable[..., Any]) -> None:
    page = opened(server.address)
    page.locator("body").press("m")
    page.wait_for_selector("html[data-mapped]", timeout=300_000)  # its kernels may have to be compiled
    page.wait_for_function("() => document.querySelector('#map').getBoundingClientRect().top < innerHeight")
    page.locator("#map").scroll_into_view_if_needed()
    page.wait_for_function("() => document.querySelector('#map .key').textContent.includes('steepest rise')")
    before = page.inner_text("#summary")
    box = page.locator("#map .plot").bounding_box()
    page.mouse.click(box["x"] + 0.7 * box["width"], box["y"] + 0.3 * box["height"])
    page.wait_for_function("before => document.querySelector('#summary').textContent !== before", arg=before)
    page.wait_for_function(  # the picture is sent first, the scene's text behind it
        """() => {
            const speed = Number(document.querySelector('#toml').textContent.match(/speed = ([\\d.]+)/)[1]);
            return 11.0 < speed && speed < 16.0;
        }"""
    )
    page.focus("#map")
    clicked = page.inner_text("#summary")
    for key in ("ArrowLeft", "ArrowLeft", "ArrowDown", "Enter"):
        page.keyboard.press(key)
    page.wait_for_function("before => document.querySelector('#summary').textContent !== before", arg=clicked)


def test_nothing_on_the_page_comes_from_elsewhere_and_every_picture_is_named(
    server: Server, browser: Any, opened: Callable[..., Any]
) -> None:
    page = opened(server.address)
    page.locator("body").press("m")  # its figure is made when it is first looked at
    page.wait_for_selector("html[data-mapped]", timeout=300_000)
    loaded = page.evaluate("performance.getEntriesByType('resource').map(entry => entry.name)")
    assert len(loaded) > 10
    assert {name for name in loaded if not name.startswith(server.address)} == set()
    for name in ("force", "below", "phase", "spectrum"):
        assert len(page.inner_text(f"#{name} h2")) > 10
    page.wait_for_function("() => Bokeh.documents.length === 5")  # those out of sight are made after the first picture
    labels = page.evaluate(
        """() => Bokeh.documents.flatMap(held => held.roots())
            .flatMap(figure => [...figure.xaxis, ...figure.yaxis]).map(axis => axis.axis_label)"""
    )
    assert len(labels) == 10
    assert all("[" in label for label in labels if label.strip())
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("input, select, button")].filter(held => held.checkVisibility()
            && !held.labels?.length && !held.getAttribute("aria-label") && !held.textContent.trim()).length"""
    )
    assert unnamed == 0


def test_ten_tabs_have_ten_scenes_and_a_killed_server_loses_none(tmp_path: Path, opened: Callable[..., Any]) -> None:
    first = Server(tmp_path)
    pages = [opened(first.address) for _ in range(10)]
    for number, page in enumerate(pages):
        type_into(page, "speed", f"{5 + number / 10} m/s")
    for number, page in enumerate(pages):
        page.wait_for_function(
            "text => document.querySelector('#toml').textContent.includes(text)", arg=f"speed = {5 + number / 10}"
        )
    code, said = first.end(signal.SIGKILL)
    assert (code, said) == (-signal.SIGKILL, "")
    page = pages[3]
    page.wait_for_function("() => document.querySelector('#words').textContent.includes('connection')")
    assert "speed = 5.3" in page.text_content("#toml")
    type_into(page, "speed", "7.5 m/s")  # nobody hears it yet
    second = Server(tmp_path, "--port", first.port)
    page.goto(second.address)  # in the same tab: its scene comes back
    page.wait_for_selector("html[data-drawn]")
    page.wait_for_function("() => document.querySelector('#toml').textContent.includes('speed = 5.3')")
    code, said = second.end()
    assert (code, said) == (0, "wheeltapper: explorer ended\n")


# -- recordings with their sites ---------------------------------------------------------------------------------------


def dropped(page: Any, *paths: Path) -> Any:
    """Drop files on the page as a user does, from a folder of the desktop."""
    data = page.evaluate_handle("() => new DataTransfer()")
    for path in paths:
        page.evaluate(
            """([data, name, text]) => {
                const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
                data.items.add(new File([bytes], name));
            }""",
            [data, path.name, base64.b64encode(path.read_bytes()).decode()],
        )
    page.dispatch_event("body", "drop", {"dataTransfer": data})


def test_a_recording_that_is_dropped_with_its_site_is_diagnosed_on_the_page(
    server: Server, opened: Callable[..., Any]
) -> None:
    page = opened(server.address)
    dropped(page, ROOT / "examples" / "data" / "deck_flat.csv.gz")
    page.wait_for_function("() => document.querySelector('#drop-words').textContent.includes('drop the TOML file')")
    dropped(page, ROOT / "examples" / "site.toml")
    page.wait_for_selector("#finding pre", timeout=600_000)  # kernels may have to be compiled
    assert page.inner_text("#drop-words") == "deck_flat.csv.gz: wheel flat"
    said = page.inner_text("#finding pre")
    size = re.search(r"Length: ([\d.]+) mm", said)
    assert size is not None, said
    assert float(size[1]) == pytest.approx(40.0, abs=0.1)  # what README.md says of this recording
    page.wait_for_function("() => document.querySelector('#finding img').naturalWidth > 600")
    assert page.get_attribute("#finding img", "alt") == "finding: deck_flat.csv.gz: wheel flat"
    assert page.locator("#drop-part").get_attribute("open") is not None
    page.wait_for_function("() => document.querySelector('#words').textContent === ''")


def test_a_train_that_is_dropped_with_its_detector_is_measured_on_the_page(
    server: Server, opened: Callable[..., Any]
) -> None:
    page = opened(server.address)
    passage = ROOT / "examples" / "data" / "passages" / "2026-11-02T08-12_id=4711.csv.gz"
    dropped(page, passage, ROOT / "examples" / "detector.toml")
    page.wait_for_selector("#finding pre", timeout=300_000)
    assert "axles" in page.inner_text("#drop-words")
    assert "strikes: axle 7 right" in page.inner_text("#finding pre")
    page.wait_for_function("() => document.querySelector('#finding img').naturalWidth > 600")


def test_what_cannot_be_diagnosed_is_told_in_a_line(server: Server, opened: Callable[..., Any], tmp_path: Path) -> None:
    page = opened(server.address)
    broken = tmp_path / "broken.csv"
    broken.write_text("t [s],a [m/s^2]\n0,x\n", encoding="utf-8")
    dropped(page, broken, ROOT / "examples" / "site.toml")
    page.wait_for_function("() => document.querySelector('#drop-words').classList.contains('wrong')", timeout=60_000)
    said = page.inner_text("#drop-words")
    assert said.startswith("broken.csv")
    assert "\n" not in said
    assert page.locator("#finding pre").count() == 0


# -- vehicles with several wheels --------------------------------------------------------------------------------------


COACH = ("4 wheels", "car body", "bogie 1", "bogie 2")
SEVERAL: dict[str, tuple[int, str, tuple[str, ...]]] = {
    "coach_step.toml": (8, "the right", COACH),
    "coach_on_ballast.toml": (8, "the left", (*COACH, "sleepers")),
    "bogie_over_weld.toml": (2, "", ("2 wheels", "frame", "sleepers")),
    "flat_on_ballast.toml": (1, "", ("a wheel", "sleepers")),
    "three wheelsets": (3, "", ("3 wheels", "sleepers")),
}
"""By example: its contacts, the side that is shown, and what moves."""


@pytest.mark.parametrize("file", SEVERAL)
def test_every_panel_of_a_vehicle_shows_its_run(file: str, opened: Callable[..., Any], tmp_path: Path) -> None:
    contacts, side, bodies = SEVERAL[file]
    scene = ROOT / "examples" / file
    if not scene.exists():
        scene = tmp_path / "scene.toml"
        flat = Scenario.from_toml(ROOT / "examples" / "flat_on_ballast.toml")
        flats = {"wheelset 2": [WheelFlat(length="60 mm", position=1.8)]}
        row = {"type": "Wheelsets", "wheelsets": [flat.vehicle] * 3, "positions": [0.0, -2.56, -9.0]}
        flat.replaced({"vehicle": row, "irregularity": flats, "duration": 0.3}).to_toml(scene)
    held = Server(tmp_path, str(scene))
    try:
        page = opened(held.address, drawn=False)
        page.wait_for_selector("html[data-drawn]", timeout=900_000)  # kernels may have to be compiled
        shows(page, "completed")
        page.wait_for_function("() => document.querySelector('#words').innerText === ''")
        for name in ("force", "below", "phase", "spectrum"):
            page.locator(f"#{name}").scroll_into_view_if_needed()
            page.wait_for_function(
                """name => Bokeh.documents.flatMap((held) => held.roots()).some((figure) => figure.name === name
                    && figure.renderers.some((one) => one.data_source?.data.x?.length > 500))""",
                arg=name,
            )
            assert len(page.inner_text(f"#{name} h2")) > 10
        if contacts == 8:
            assert page.inner_text("#below h2").endswith(": car body, z")
            assert page.inner_text("#phase h2").endswith("car body, z")
        assert side in page.inner_text("#motion-words")
        record = simulate(load(scene))
        said = page.get_attribute("#force .strips", "aria-label") or ""
        assert said.count("impacts") == (1 + contacts if contacts > 1 else 0)
        hits = int((record.events.kind == "impact").sum())
        if contacts > 1:
            assert sum(map(int, re.findall(r"(\d+) impacts", said))) == hits
            assert hits or file == "bogie_over_weld.toml"
            page.locator("#force .strips").wait_for(state="visible")
        assert page.inner_text("#summary") == str(record)
        moving = page.get_attribute("#stage", "aria-label") or ""
        assert [name for name in bodies if name not in moving] == []
        before = page.inner_text("#summary")
        type_into(page, "speed", "11 m/s")
        page.wait_for_function(
            "before => document.querySelector('#summary').textContent !== before", arg=before, timeout=300_000
        )
        page.wait_for_function("() => document.querySelector('#toml').textContent.includes('speed = 11')")
        page.wait_for_function("() => document.querySelector('#words').innerText === ''")
    finally:
        held.end()


def test_a_wagon_is_chosen_in_the_form_and_runs(server: Server, opened: Callable[..., Any]) -> None:
    page = opened(server.address)
    page.select_option('[data-path="contact"] > summary select', "Hertz")
    page.fill('[data-path="contact.constant"] input.number', "")
    page.press('[data-path="contact.constant"] input.number', "Enter")
    page.wait_for_function("() => !/constant = 1.4/.test(document.querySelector('#toml').textContent)")
    page.select_option('[data-path="vehicle"] > summary select', "ErriB176")
    page.wait_for_function(
        "() => document.querySelector('#force h2').textContent === 'Normal force on each wheel'", timeout=300_000
    )
    page.wait_for_function("() => document.querySelector('#toml').textContent.includes('type = \"Wagon\"')")
    page.locator("#force .strips").wait_for(state="visible")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [420, 1500])
def test_the_page_fits_its_window_in_light_and_dark(
    server: Server, opened: Callable[..., Any], scheme: str, width: int
) -> None:
    page = opened(server.address)
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": 900})
    time.sleep(0.3)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("#form input[type=range]").first.bounding_box()["y"] < 900
    assert page.evaluate("document.documentElement.dataset.theme") == scheme


def test_panels_out_of_sight_are_drawn_when_all_is_quiet_so_that_a_print_has_them(
    server: Server, opened: Callable[..., Any]
) -> None:
    page = opened(server.address)
    page.set_viewport_size({"width": 1200, "height": 300})
    type_into(page, "speed", "7")
    page.wait_for_function("() => document.querySelector('#spectrum h2').textContent.startsWith('Spectrum')")
    assert page.evaluate("document.querySelector('#spectrum').getBoundingClientRect().top") > 300
