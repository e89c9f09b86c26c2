"""Measure what a user of the explorer waits for, in headless Chromium.

    uv run --extra explore --group browser python benchmarks/explore.py [--repeats 60] [--chromium /usr/bin/chromium]

Slider to picture: from a slider's event in the page to the end of the frame in which all panels are drawn anew, with
the march, its samples and the way there and back between. Beside it stand its parts: the march alone, and all that
Python does, in a process without a browser; and drawing alone. First picture: from the printed address to the drawn
panels; its parts are times since the browser began to load the page. Map: from the request to the last of 64 × 64
cells, drawn.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import Any

from options import parser_of

from wheeltapper.faces.explore.launch import NEEDED

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(sys.executable).with_name("wheeltapper")
FLAGS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip
SCENES = {"bump of 0.12 s": "bump.toml", "flat of 0.5 s": "wheel_flat.toml"}
PATH = "vehicle.damping"
DURATIONS = "name => performance.getEntriesByName(name).map(entry => entry.duration)"
PARTS = """() => {
    const at = (name) => Math.max(0, ...performance.getEntriesByName(name).map((entry) => entry.startTime));
    const ends = (kind) => Math.max(0, ...performance.getEntriesByType(kind).map((entry) => entry.responseEnd));
    return [["the page is there", ends("navigation")], ["all scripts are there", ends("resource")],
        ["last frame before the panels are ready", at("early frame")], ["panels are ready", at("panels")],
        ["drawn", at("first picture")]];
}"""
MEASURED = "([name, count]) => performance.getEntriesByName(name).length >= count"


def march_times(file: Path, repeats: int) -> list[float]:
    """Return the wall times of the march alone, ms."""
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.record.simulate import simulated_scenario

    scene, times = Scenario.from_toml(file), []
    for number in range(repeats + 3):
        one = scene.replaced({PATH: scene.vehicle.damping * (1.0 + 0.003 * number)})
        start = time.perf_counter()
        simulated_scenario(one, "default", lambda notes: None)
        times.append(1e3 * (time.perf_counter() - start))
    return times[3:]


def python_times(file: Path, repeats: int) -> list[float]:
    """Return the wall times of an edit, the march, its samples and the frame as it is sent, ms."""
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.faces.explore.paths import Files
    from wheeltapper.faces.explore.session import Session

    session, times = Session("", Scenario.from_toml(file), Files(file.parent)), []
    damping = session.scene.vehicle.damping
    for number in range(repeats + 3):
        start = time.perf_counter()
        session.edit([{"do": "set", "path": PATH, "value": damping * (1.0 + 0.003 * number)}])
        for frame in session.run_frames(number, lambda: False, lambda line: None):
            frame.encoded()
        times.append(1e3 * (time.perf_counter() - start))
    return times[3:]


def tell(what: str, found: list[float]) -> None:
    """Print the median and the 95 % share of some times."""
    print(f"  {what:44}{median(found):8.1f}{share(found, 0.95):9.1f}")


def share(times: list[float], of: float) -> float:
    """Return the value below which a share of the times lies."""
    return sorted(times)[min(len(times) - 1, round(of * len(times)))]


def measure(browser: Any, file: Path, repeats: int, with_map: bool) -> None:
    """Open a page, move a slider, fill a map."""
    server = subprocess.Popen(
        [PROGRAM, "explore", str(file), "--no-browser"], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    assert server.stdout is not None
    address = server.stdout.readline().split()[-1]
    start = time.perf_counter()
    page = browser.new_page(viewport={"width": 1500, "height": 1000})
    try:
        page.goto(address)
        page.wait_for_selector("html[data-drawn]", timeout=300_000)
        first = time.perf_counter() - start
        slider = page.locator(f'[data-path="{PATH}"] input[type=range]')
        slider.focus()
        for number in range(repeats + 5):
            if number == 5:
                page.evaluate("performance.clearMeasures()")
            done = page.evaluate("performance.getEntriesByName('slider to picture').length")
            slider.press("ArrowRight" if number % 60 < 30 else "ArrowLeft")
            page.wait_for_function(MEASURED, arg=["slider to picture", done + 1])
            page.wait_for_timeout(80)
        for name, words in (
            ("drawing", "drawing in the browser alone, ms"), ("slider to frame", "slider to its frame, ms"),
            ("slider to picture", "slider to picture, ms: median, 95 %"),
        ):  # fmt: skip
            tell(words, page.evaluate(DURATIONS, name))
        print(f"  {'first picture, s':44}{first:8.2f}")
        for words, at in page.evaluate(PARTS):
            print(f"    {words:42}{at / 1e3:8.2f}")
        if with_map:
            for number in (1, 2, 3):
                page.evaluate("document.querySelector('#map-part').open = true")
                page.evaluate("document.querySelector('#map-fill').click()")
                page.wait_for_function(MEASURED, arg=["map", number], timeout=300_000)
            found = page.evaluate("performance.getEntriesByName('map').map(entry => entry.duration)")
            print(f"  {'map of 64 x 64, s: shortest, longest':44}{min(found) / 1e3:8.2f}{max(found) / 1e3:9.2f}")
    finally:
        page.close()
        server.terminate()
        server.communicate(timeout=30)


def main() -> None:
    parser = parser_of("Measure what a user of the explorer waits for.")
    parser.add_argument("--repeats", type=int, default=60, help="moves of the slider (default 60)")
    parser.add_argument("--chromium", default=shutil.which("chromium"), help="path of the browser")
    options = parser.parse_args()
    if options.smallest:
        options.repeats = 3
    for name, file in SCENES.items():
        times = march_times(ROOT / "examples" / file, options.repeats)
        print(name)
        tell("march alone, ms: median, 95 %", times)
        tell("all that Python does, ms", python_times(ROOT / "examples" / file, options.repeats))
        missing = [module for module in ("playwright", *NEEDED) if find_spec(module) is None]
        if options.chromium is None or missing:
            print(f"  no {', '.join(missing) or 'chromium'}: nothing is measured in the browser")
            continue
        from playwright.sync_api import sync_playwright

        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=options.chromium, args=FLAGS)
            measure(browser, ROOT / "examples" / file, options.repeats, with_map=file == "bump.toml")
            browser.close()


if __name__ == "__main__":
    main()
