"""What tests of pages share."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from .chromium import CHROMIUM, FLAGS


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        held = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield held
        held.close()


@pytest.fixture
def opened(browser: Any) -> Iterator[Callable[..., Any]]:
    """Return what opens a page; at the end no page may have met an error."""
    context = browser.new_context(viewport={"width": 1500, "height": 1000}, accept_downloads=True)
    errors: list[str] = []

    def open_page(address: str, drawn: bool = True) -> Any:
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(address)
        if drawn:
            page.wait_for_selector("html[data-drawn]", timeout=60_000)
        return page

    yield open_page
    context.close()
    assert errors == []
