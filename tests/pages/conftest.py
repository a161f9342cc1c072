"""A real browser, without a screen, that looks at a page of this machine."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import BytesIO
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    *("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--use-angle=swiftshader"),
    *("--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"),
)
SIZE = {"width": 1280, "height": 800}
MOMENT = 100  # milliseconds
PATIENCE = 15.0  # seconds


@dataclass
class Visit:
    """What a visitor of a page sees and does.

    Parameters
    ----------
    page : playwright.sync_api.Page
    errors : list of str
        What the browser's console complained of.
    hosts : set of str
        Whom the browser asked for anything.
    """

    page: object
    errors: list[str] = field(default_factory=list)
    hosts: set[str] = field(default_factory=set)

    def picture(self) -> np.ndarray:
        """The middle of the window, where the stage is, (H, W, 3) from 0 to 1."""
        area = {"x": 350, "y": 60, "width": 550, "height": 680}
        return np.asarray(Image.open(BytesIO(self.page.screenshot(clip=area))).convert("RGB")) / 255

    def _track(self, label: str):
        spelled = re.compile(rf"^(● )?{re.escape(label)}$")
        name = self.page.locator("label").filter(has_text=spelled).first
        return self.page.locator(f'[id="{name.get_attribute("for")}"]')

    def slide(self, label: str, value: float) -> None:
        """Move a slider, by the number beside it."""
        number = self._track(label).locator("xpath=..").locator("input[inputmode=decimal]")
        number.fill(str(value))
        number.press("Enter")

    def value(self, label: str) -> float:
        """Where a slider stands."""
        return float(self._track(label).get_by_role("slider").get_attribute("aria-valuenow"))

    def until(self, condition: Callable[[], bool]) -> bool:
        """Whether something comes true before long."""
        for _ in range(round(1000 * PATIENCE / MOMENT)):
            if condition():
                return True
            self.page.wait_for_timeout(MOMENT)
        return False


@pytest.fixture(scope="session")
def _browser():
    """Chromium, started once."""
    sync = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip("no chromium on this machine")
    with sync.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def visit(_browser) -> Callable[[str], Iterator[Visit]]:
    """Opens an address, and waits until it shows something."""

    @contextmanager
    def go(address: str) -> Iterator[Visit]:
        context = _browser.new_context(viewport=SIZE)
        seen = Visit(context.new_page())
        seen.page.on("pageerror", lambda error: seen.errors.append(str(error)))
        seen.page.on(
            "console", lambda line: seen.errors.append(line.text) if line.type == "error" else None
        )
        for event in ("request", "websocket"):
            seen.page.on(event, lambda asked: seen.hosts.add(urlsplit(asked.url).hostname or ""))
        seen.page.goto(address)
        seen.page.locator("canvas").first.wait_for()
        assert seen.until(lambda: seen.picture().std() > 0.08)  # the backdrop alone has less
        yield seen
        context.close()

    return go
