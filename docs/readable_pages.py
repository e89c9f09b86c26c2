"""Whether all of the built pages can be read: in windows of three widths, one of them at 200 %, and in print.

uv run --group docs --group browser python docs/readable_pages.py docs/_build/html

No page is wider than its window, nothing is cut in print, and each word is on paper. It needs Chromium and pdftotext.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.faces.chromium import CHROMIUM, FLAGS

WIDTHS = 1280, 640, 360
"""Of windows, in CSS pixels; 640 is a window of 1280 at 200 %."""
PAPER = {"width": 717, "height": 1046}
"""Of A4 without its margins."""
NOT_READ = "_modules", "_static", "genindex.html", "py-modindex.html", "search.html"
WIDE = "document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"
CUT = """() => [...document.querySelectorAll('article *')].filter((one) => {
    const wide = one.clientWidth > 4 && one.scrollWidth > one.clientWidth + 2;
    return wide && getComputedStyle(one).overflowX !== 'visible';
}).map((one) => one.textContent.trim().slice(0, 60))"""
SAID = """() => {
    const hidden = [...document.querySelectorAll('.sd-hide-link-text')].map((one) => one.innerText);
    return [document.querySelector('article').innerText, hidden.join(' ')];
}"""


def words(text: str) -> set[str]:
    """Return words of four letters and more; shorter ones are anywhere."""
    return set(re.findall("[A-Za-z]{4,}", text))


def flaws(page: Any, paper: Path) -> Iterator[str]:
    """Yield what of a page cannot be read; its print is written to `paper`."""
    page.emulate_media(media="screen")
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 900})
        if page.evaluate(WIDE):
            yield f"wider than a window of {width} px"
    page.set_viewport_size(PAPER)
    page.emulate_media(media="print")
    for text in page.evaluate(CUT):
        yield f"cut in print: {text!r}"
    page.pdf(path=paper, format="A4")
    printed = subprocess.run(["pdftotext", paper, "-"], capture_output=True, text=True, check=True).stdout
    said, hidden = page.evaluate(SAID)
    printed = re.sub(r"[\s-]", "", printed)  # words may be divided
    if missing := [one for one in sorted(words(said) - words(hidden)) if one not in printed]:
        yield f"not in print: {', '.join(missing[:12])}"


def main() -> int:
    """Look at each page; return how many have a flaw, at most 1."""
    built = Path(sys.argv[1]).resolve()
    files = [one for one in sorted(built.rglob("*.html")) if not any(name in one.parts for name in NOT_READ)]
    flawed = 0
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page()
        page.route("http*://**", lambda route: route.abort())  # formulas stay as they are written
        for file in files:
            page.goto(file.as_uri())
            for flaw in flaws(page, built.parent / "printed.pdf"):
                flawed += 1
                print(f"{file.relative_to(built)}: {flaw}", flush=True)
        browser.close()
    print(f"{len(files)} pages, {flawed} flaws")
    return int(flawed > 0)


if __name__ == "__main__":
    sys.exit(main())
