"""A real browser, and pages in it."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dh2sim.robot.read import load_robot
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import Page as ServedPage
from dh2sim.view.server import Viewer
from dh2sim.view.state import ViewState
from scripts.bench_view_probes import NO_DRAWING
from tests.view.on_page import Serve

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
def drawn() -> bool:
    """Whether pages draw; where nothing is looked at, leaving that out saves most of the time."""
    return True


@pytest.fixture(scope="module")
def window(browser: Browser, drawn: bool) -> Iterator[BrowserContext]:
    """A browser window, small because it is drawn in software; its pages share what is loaded."""
    context = browser.new_context(viewport={"width": 900, "height": 640}, accept_downloads=True)
    context.set_default_timeout(TIMEOUT)
    if not drawn:
        context.add_init_script(NO_DRAWING)
    yield context
    context.close()


def wait_for_panel(page: Page) -> None:
    """Wait until a page has all that its panel is made of, keys included: a pose is shown after these."""
    page.locator('[data-dh2sim="readout"] td').first.wait_for()


@pytest.fixture
def open_page(window: BrowserContext, viewer: Viewer) -> Iterator[Callable[[], Page]]:
    """Opens pages of the viewer, which are closed when the test ends."""
    pages = []

    def opened() -> Page:
        pages.append(window.new_page())
        pages[-1].goto(viewer.url)
        wait_for_panel(pages[-1])
        return pages[-1]

    yield opened
    for page in pages:
        page.close()


@pytest.fixture
def serve(window: BrowserContext) -> Iterator[Serve]:
    """Serves any state, and opens a page of it; until the test ends."""
    with contextlib.ExitStack() as stack:

        def served(state: ViewState, run: Path | None = None) -> tuple[Page, ServedPage]:
            server = Viewer(state, run=run)
            stack.callback(server.stop)
            page = window.new_page()
            stack.callback(page.close)
            page.goto(server.url)
            wait_for_panel(page)
            (serving,) = server.pages
            return page, serving

        yield served
