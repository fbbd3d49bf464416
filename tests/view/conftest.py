"""A real browser, and pages in it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest

from dh2sim.robot.load import load_robot
from dh2sim.view.opening import open_state
from dh2sim.view.server import Viewer

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

TIMEOUT = 60_000
"""ms that a page may take to show something: a browser without a graphics card is slow."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium, drawing in software."""
    api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("there is no Chromium here")
    options = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with api.sync_playwright() as playwright:
        launched = playwright.chromium.launch(
            executable_path=chromium, args=[*options, "--disable-background-networking"]
        )
        yield launched
        launched.close()


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    """A server that shows the Stanford arm."""
    server = Viewer(open_state(load_robot("stanford")))
    yield server
    server.stop()


@pytest.fixture(scope="module")
def window(browser: Browser) -> Iterator[BrowserContext]:
    """A browser window, small because it is drawn in software; its pages share what is loaded."""
    context = browser.new_context(viewport={"width": 900, "height": 640}, accept_downloads=True)
    context.set_default_timeout(TIMEOUT)
    yield context
    context.close()


@pytest.fixture
def open_page(window: BrowserContext, viewer: Viewer) -> Iterator[Callable[[], Page]]:
    """Opens pages of the viewer, which are closed when the test ends."""
    pages = []

    def opened() -> Page:
        pages.append(window.new_page())
        pages[-1].goto(viewer.url)
        pages[-1].get_by_role("tab", name="Joints").wait_for()
        return pages[-1]

    yield opened
    for page in pages:
        page.close()
