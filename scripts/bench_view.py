#!/usr/bin/env python3
"""The part of ``scripts/bench`` that measures the viewer in a real browser, which draws without a graphics card.

scripts/bench_view.py --minutes 3       this part alone, clicking at random for so long
scripts/bench_view.py --only delays     of this part; also first, chain, memory, or pages
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import re
import shutil
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from scripts.bench_timing import Row
from scripts.bench_view_pages import OPTIONS, choose_plain_shading, click, go, opened, program, window
from scripts.bench_view_probes import FIRST_PICTURE, FRAMES, NO_DRAWING, NUMBERS, POSES

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from dh2sim.view.page import Page as ViewerPage

MOVES = 50
FROM_REST = 1.0
"""s between moves: viser draws on for a quarter of a second after anything has changed."""
SECONDS = 8.0
"""For how long frames are counted."""
WARM_UP = 60.0
"""s of clicking, before memory is measured: until then libraries are loaded, and what is kept is filled."""
PAGES, TOGETHER = 50, 2
"""Pages that are opened and closed, and how many of them at once."""
FIRST_PAINT = "() => performance.timeOrigin + performance.getEntriesByName('first-contentful-paint')[0].startTime"
"""ms since 1970."""


PARTS = ("first", "delays", "chain", "memory", "pages")


def view(minutes: float = 2.0, parts: Sequence[str] = PARTS) -> Iterator[Row]:
    """First picture, delay of a slider, frames a second of a long chain, and memory after clicks and closed pages."""
    what = "viewer in a browser"
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        yield what, f"not measured ({error})", "", None
        return
    if chromium is None:
        yield what, "not measured (there is no Chromium)", "", None
        return
    with sync_playwright() as playwright:
        options = [*OPTIONS, "--disable-background-networking"]
        browser = playwright.chromium.launch(executable_path=chromium, args=options)
        try:
            measures: list[Callable[[], Iterator[Row]]] = [
                lambda: _first_pictures(browser),
                lambda: _delays(browser),
                lambda: _long_chain(browser),
                lambda: _memory(browser, minutes),
                lambda: _pages(browser),
            ]
            for part, measure in zip(PARTS, measures, strict=True):
                if part in parts:
                    yield from measure()
        finally:
            browser.close()


def _first_pictures(browser: Browser) -> Iterator[Row]:
    """From the command to the robot on the screen; each time in an empty window, with nothing in store."""
    paints, robots = [], []
    for _ in range(7):
        page = window(browser, FIRST_PICTURE)
        time.sleep(2.0)  # the browser is done with the window before
        start = time.time()
        with program() as (_process, url):
            go(page, url)
            page.wait_for_function("() => window.robotShown !== undefined")
            robots.append(1e-3 * page.evaluate("() => window.robotShown") - start)
            paints.append(1e-3 * page.evaluate(FIRST_PAINT) - start)
            page.context.close()
    for what, times in (("first paint", paints), ("robot on the screen", robots)):
        middle = statistics.median(times)
        figures = f"{middle:.1f} s ({min(times):.1f} to {max(times):.1f})"
        yield f"view: from the command to the {what}", figures, "3 s", middle <= 3.0


def _delays(browser: Browser) -> Iterator[Row]:
    """From the key that moves a slider to the robot's pose, as the page's own clock has it.

    Of a move from rest, and of one on the heels of another, which waits until the pictures of that are drawn.
    """
    with program() as (_process, url):
        for words, scripts, soft in (
            (", drawn in software", (POSES,), True),
            (", drawn in software without soft shading", (POSES,), False),
            (", drawing left out", (POSES, NO_DRAWING), True),
        ):
            for when, pause in (("from rest", FROM_REST), ("5 moves a second", 0.2)):
                page = opened(browser, url, *scripts)
                if not soft:
                    choose_plain_shading(page)
                posed, painted, figures = _slider_delays(page, pause)
                page.context.close()
                yield _row(f"view: slider to the robot's pose, {when}{words}", posed, 50.0)
                yield _row(f"view: slider to the frame after it, {when}{words}", painted, None)
                yield _row(f"view: slider to the pose in numbers, {when}{words}", figures, None)


def _slider_delays(page: Page, pause: float) -> tuple[list[float], list[float], list[float]]:
    time.sleep(3.0)  # the fading in of the first picture
    page.get_by_role("slider").first.focus()
    figures = []
    for _ in range(MOVES + 5):
        page.evaluate(NUMBERS)
        page.keyboard.press("ArrowRight")  # on and on: to poses where it was not before
        figures.append(page.evaluate("() => window.moved"))
        time.sleep(pause)
    posed, painted = page.evaluate("() => [window.posed, window.painted]")
    return posed[5:], painted[5:], figures[5:]  # without the first, which are slower


def _long_chain(browser: Browser) -> Iterator[Row]:
    """60 joints: the server's own time for a move, and frames a second while a joint moves and while none does."""
    from dh2sim import parse_robot
    from dh2sim.view.initial_state import open_state
    from dh2sim.view.server import Viewer

    viewer = Viewer(open_state(parse_robot(_chain(60))))
    try:
        for scripts, words in (((), "drawn in software"), ((NO_DRAWING,), "drawing left out")):
            shown = opened(browser, viewer.url, FIRST_PICTURE, *scripts)
            if not scripts:
                shown.wait_for_function("() => window.robotShown !== undefined")
            time.sleep(3.0)
            page = viewer.pages[-1]
            yield _row(f"view: 60 joints, event to sent to the browser, {words}", _server_times(page), 50.0)
            still = shown.evaluate(FRAMES, SECONDS)
            with _moving(page):
                moving = shown.evaluate(FRAMES, SECONDS)
            figures = f"{moving:.0f} ({still:.0f} while none moves)"
            yield f"view: 60 joints, frames a second, {words}", figures, "30", moving >= 30.0
            shown.context.close()
    finally:
        viewer.stop()


def _server_times(page: ViewerPage) -> list[float]:
    """From an event to the end of its drawing, ms; one event at a time."""
    from dh2sim.view.events import MoveJoint

    sent, flush = threading.Event(), page.client.flush

    def flushed() -> None:
        flush()
        sent.set()

    page.client.flush = flushed  # type: ignore[method-assign]
    times = []
    for k in range(MOVES):
        sent.clear()
        start = time.perf_counter()
        page.send(MoveJoint(joint=k % 60, value=0.02 * (k % 7)))
        if not sent.wait(20.0):
            raise TimeoutError("the page does not draw")
        times.append(1e3 * (time.perf_counter() - start))
        time.sleep(0.1)
    page.client.flush = flush  # type: ignore[method-assign]
    return times


@contextlib.contextmanager
def _moving(page: ViewerPage) -> Iterator[None]:
    """A joint that moves 30 times a second."""
    from dh2sim.view.events import MoveJoint

    ended = threading.Event()

    def move() -> None:
        k = 0
        while not ended.wait(1.0 / 30.0):
            k += 1
            page.send(MoveJoint(joint=5, value=0.01 * (k % 50)))

    mover = threading.Thread(target=move)
    mover.start()
    try:
        yield
    finally:
        ended.set()
        mover.join()


def _memory(browser: Browser, minutes: float) -> Iterator[Row]:
    """Memory of the server after clicking at random, of that after a warm-up."""
    what = f"view: memory after {minutes:g} minutes of clicking, times"
    if not Path("/proc/self/status").exists():
        yield what, "not measured (there is no /proc)", "1.1", None
        return
    rng = random.Random(0)
    with program() as (process, url):
        page = opened(browser, url, NO_DRAWING)
        click(page, rng, WARM_UP)
        before = _resident(process)
        count = click(page, rng, 60.0 * minutes)
        time.sleep(1.0)
        after = _resident(process)
        page.context.close()
    figures = f"{after / before:.2f} ({before / 1e6:.0f} to {after / 1e6:.0f} MB, {count} clicks)"
    yield what, figures, "1.1", after <= 1.1 * before


def _pages(browser: Browser) -> Iterator[Row]:
    """Memory of the server once 50 pages that drew are closed, of that after the first."""
    what = f"view: memory after {PAGES} pages, times"
    if not Path("/proc/self/status").exists():
        yield what, "not measured (there is no /proc)", "1.1", None
        return
    with program() as (process, url):
        _open_and_close(browser, url, 1)
        before, most = _resident(process), 0
        for _ in range(PAGES // TOGETHER):
            most = max(most, _open_and_close(browser, url, TOGETHER, process))
        after = _resident(process)
    figures = f"{after / before:.2f} ({before / 1e6:.0f} to {after / 1e6:.0f} MB, {most / 1e6:.0f} MB meanwhile)"
    yield what, figures, "1.1", after <= 1.1 * before


def _open_and_close(browser: Browser, url: str, count: int, process: subprocess.Popen[str] | None = None) -> int:
    """Open pages at once, let them draw the robot, and close them; return the memory before that."""
    pages = [window(browser, FIRST_PICTURE) for _ in range(count)]
    for page in pages:
        page.set_default_timeout(120_000.0)
        page.set_viewport_size({"width": 400, "height": 300})  # drawn in software
        go(page, url)
    for page in pages:
        page.wait_for_function("() => window.robotShown !== undefined")
        page.get_by_role("button", name="random").click()
    most = 0 if process is None else _resident(process)
    for page in pages:
        page.context.close()
    time.sleep(5.0)
    return most


def _resident(process: subprocess.Popen[str]) -> int:
    """Memory of a process, bytes."""
    found = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{process.pid}/status").read_text(encoding="ascii"))
    assert found is not None
    return int(found.group(1)) * 1024


def _chain(joints: int) -> str:
    rows = "".join(
        f"  - {{type: revolute, a: 0.1, alpha: {90 * (i % 2)}, d: 0.02, theta: 0}}\n" for i in range(joints)
    )
    return f"name: chain\nconvention: standard\nunits: {{angle: deg}}\njoints:\n{rows}"


def _row(what: str, times: list[float], target: float | None) -> Row:
    """Notify times, ms."""
    middle, most = statistics.median(times), statistics.quantiles(times, n=10)[-1]
    met = None if target is None else middle <= target
    return what, f"{middle:.0f} ms (90 %: {most:.0f} ms)", "" if target is None else f"{target:.0f} ms", met


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=2.0, help="of clicking at random")
    parser.add_argument("--only", action="append", choices=PARTS, help="a part to be measured; may be repeated")
    arguments = parser.parse_args()
    for what, figure, target, met in view(arguments.minutes, arguments.only or PARTS):
        words = {True: "met", False: "MISSED", None: ""}[met]
        print(f"{what}: {figure}; target {target or 'none'} {words}".rstrip(), flush=True)
    print(f"load: {' '.join(f'{load:.1f}' for load in os.getloadavg())}")


if __name__ == "__main__":
    main()
