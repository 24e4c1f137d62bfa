"""A real browser without a window, for tests of pages; skips with a word where there is none."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
SOFTWARE = ("--no-sandbox", "--use-angle=swiftshader", "--ignore-gpu-blocklist")

TWO_FRAMES = """new Promise(done => requestAnimationFrame(
    () => requestAnimationFrame(() => setTimeout(done, 20))))"""


@contextmanager
def opened_browser() -> Iterator[Any]:
    """A browser of the system, drawing in software."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip("no Chromium on PATH")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=list(SOFTWARE))
        try:
            yield browser
        finally:
            browser.close()


class OpenPage:
    """A page in the browser, and what it wrote to its console or asked of the network."""

    def __init__(
        self,
        browser: Any,
        path: Path,
        *,
        before: Callable[[Any], object] = lambda page: None,
        **context: Any,
    ) -> None:
        self.messages: list[str] = []
        self.requests: list[str] = []
        settings = {"viewport": {"width": 900, "height": 620}, "reduced_motion": "reduce"}
        self.context = browser.new_context(**{**settings, **context})
        self.page = self.context.new_page()
        self.page.on("console", lambda message: self.messages.append(message.text))
        self.page.on("pageerror", lambda error: self.messages.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        before(self.page)
        self.page.goto(path.as_uri())

    def text(self, selector: str) -> str:
        """The text of the first element found."""
        return str(self.page.text_content(selector))

    def picture(self, selector: str = "#canvas") -> bytes:
        """What the inner part of an element looks like, as PNG; buttons lie along its edges."""
        box = self.page.locator(selector).first.bounding_box()
        sides = (("x", "width"), ("y", "height"))
        inner = {key: box[key] + 0.15 * box[size] for key, size in sides}
        inner |= {size: 0.7 * box[size] for _, size in sides}
        return bytes(self.page.screenshot(clip=inner))

    def wait_for(self, condition: str) -> None:
        """Wait until an expression is true; at most ten seconds.

        Playwright's own way evaluates a text in the page, which a page's policy may forbid.
        """
        for _ in range(200):
            if self.page.evaluate(condition):
                return
            self.settle()
        raise AssertionError(f"{condition} is not true after ten seconds")

    def settle(self) -> None:
        """Wait until what was asked for is drawn."""
        self.page.evaluate(TWO_FRAMES)
