"""A real browser, and pages in it."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import pytest

from dh2sim.robot.read import load_robot
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import Page as ServedPage
from dh2sim.view.server import Viewer
from dh2sim.view.state import ViewState
from tests.view.on_page import DEADLINE, OpenPage, Serve, wait_until
from tests.view.slow_page import slow_pages

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

NO_DRAWING = """
for (const call of ["clear", "drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"])
    WebGL2RenderingContext.prototype[call] = () => {};
"""

Windows: TypeAlias = "Callable[[bool], BrowserContext]"


@pytest.fixture(scope="session", autouse=True)
def slow_page(request: pytest.FixtureRequest) -> Iterator[None]:
    """Pages that are late at random, if that is asked for."""
    seed: int | None = request.config.getoption("--slow-page")
    if seed is None:
        yield
        return
    with slow_pages(seed):
        yield


@pytest.fixture(scope="session")
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


@pytest.fixture(scope="session")
def viewer() -> Iterator[Viewer]:
    """A server that shows the Stanford arm."""
    server = Viewer(open_state(load_robot("stanford")))
    yield server
    server.stop()


@pytest.fixture(scope="session")
def windows(browser: Browser) -> Windows:
    """Browser windows that draw, or do not; pages in one share what is loaded."""
    opened: dict[bool, BrowserContext] = {}

    def window(drawn: bool) -> BrowserContext:
        if drawn not in opened:
            opened[drawn] = browser.new_context(viewport={"width": 900, "height": 640}, accept_downloads=True)
            opened[drawn].set_default_timeout(1000.0 * DEADLINE)  # ms
            if not drawn:
                opened[drawn].add_init_script(NO_DRAWING)
        return opened[drawn]

    return window


@pytest.fixture
def drawn() -> bool:
    """Whether pages draw; without a graphics card, that takes most of the time."""
    return False


@pytest.fixture
def window(windows: Windows, drawn: bool) -> BrowserContext:
    """A browser window, small because it may be drawn in software."""
    return windows(drawn)


def wait_for_panel(page: Page) -> None:
    """Wait until the panel of a page is complete: the pose is shown last."""
    page.locator('[data-dh2sim="readout"] td').first.wait_for()


@pytest.fixture
def open_page(window: BrowserContext, viewer: Viewer) -> Iterator[OpenPage]:
    """Opens pages of the viewer, which are closed when the test ends."""
    pages: list[Page] = []
    wait_until(lambda: not viewer.pages, "those of before are closed")

    def opened() -> Page:
        pages.append(window.new_page())
        pages[-1].goto(viewer.url)
        wait_for_panel(pages[-1])
        return pages[-1]

    yield opened
    for page in pages:
        page.close()
    wait_until(lambda: not viewer.pages, "the pages are closed")


@pytest.fixture
def serve(window: BrowserContext) -> Iterator[Serve]:
    """Serves any state, and opens a page of it, until the test ends."""
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
