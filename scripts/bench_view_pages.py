"""The viewer in a browser, as ``scripts/bench_view.py`` opens it, looks at it, and clicks in it."""

from __future__ import annotations

import contextlib
import random
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from dh2sim.view.scene.annotations import subscript

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

OPTIONS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@contextlib.contextmanager
def program() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The program itself, once it tells where it serves, and that address."""
    command = [sys.executable, "-m", "dh2sim", "view", "stanford", "--no-browser", "--port", "8700"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+", process.stdout.readline())
            if found is None:
                raise RuntimeError("dh2sim view does not serve")
            yield process, found.group()
        finally:
            process.terminate()


def opened(browser: Browser, url: str, *scripts: str) -> Page:
    """A page in a window of its own, once its panel is there; ``scripts`` run before those of the page."""
    page = window(browser, *scripts)
    go(page, url)
    return page


def window(browser: Browser, *scripts: str) -> Page:
    """An empty window; ``scripts`` run before those of any page in it."""
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    for script in scripts:
        page.add_init_script(script)
    return page


def go(page: Page, url: str) -> None:
    """Go to the viewer, until its panel is there."""
    page.goto(url, wait_until="commit")
    _wait_for_panel(page)


def _wait_for_panel(page: Page) -> None:
    """Wait for what comes last: a pose in numbers."""
    page.locator('[data-dh2sim="readout"] td').first.wait_for()


def choose_plain_shading(page: Page) -> None:
    """Let surfaces be drawn in the way that is faster without a graphics card."""
    _tab(page, "Show")
    page.get_by_text("Soft shading", exact=True).click()
    _tab(page, "Joints")


def click(page: Page, rng: random.Random, seconds: float) -> int:
    """Do anything, for so long; return how often. Every page is left for a new one now and then."""
    end, count = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        count += 1
        if count % 100 == 0:
            page.reload()
            _wait_for_panel(page)
        match rng.choices(("joint", "configuration", "cell", "convention", "physics"), (6, 3, 3, 2, 1))[0]:
            case "joint":
                _tab(page, "Joints")
                page.get_by_role("slider").nth(rng.randrange(6)).focus()
                for _ in range(rng.randint(1, 8)):
                    page.keyboard.press(rng.choice(("ArrowLeft", "ArrowRight", "Home", "End")))
            case "configuration":
                _tab(page, "Joints")
                page.get_by_role("button", name=rng.choice(("home", "zero", "printed", "random")), exact=True).click()
            case "cell":
                _tab(page, "Table")
                text = rng.choice(("0", "0.1", "90", "pi/2", "d2", "-45", "90 +"))
                _field(page, rng.choice("dθ") + subscript(1 + rng.randrange(6))).fill(text)
            case "convention":
                _tab(page, "Table")
                _choose(page, "convention[₀-₉]", rng.randrange(3))
            case _:
                _tab(page, "Motion")
                _choose(page, "Mode", 1)
                time.sleep(rng.uniform(0.0, 1.0))
                _choose(page, "Mode", 0)
    return count


def _tab(page: Page, name: str) -> None:
    page.get_by_role("tab", name=name).click()


def _choose(page: Page, label: str, number: int) -> None:
    options = page.get_by_role("option")
    options.first.wait_for(state="hidden")  # those of another field fade for a while
    _field(page, label).click()
    options.nth(number).click()


def _field(page: Page, label: str) -> Locator:
    """What can be typed into beside a label, a regular expression."""
    name = page.locator("label", has_text=re.compile(f"^{label}$")).locator("visible=true")
    return name.locator("xpath=ancestor::*[.//input[not(@type='hidden')]][1]//input[not(@type='hidden')]").first
