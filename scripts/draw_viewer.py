#!/usr/bin/env python3
"""Take docs/images/viewer.png: the viewer in a real browser, with the table beside the robot that it describes.

And workspace_viewer.png: the points that the PUMA reaches.

Needs the extra `test`, and Chromium.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from playwright.sync_api import sync_playwright

from dh2sim.robot.read import load_robot
from dh2sim.view.events import SetJoints, Show
from dh2sim.view.initial_state import folder_of, open_state
from dh2sim.view.reduce import reduce
from dh2sim.view.server import Viewer, free_port
from dh2sim.view.state import Part, ViewState

IMAGES = Path(__file__).resolve().parent.parent / "docs" / "images"
HOST = "127.0.0.1"
SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
REACH = ("Pose", '[data-dh2sim="workspace"] td')


def main() -> None:
    """Take both pictures."""
    table = open_state(load_robot("stanford"), folder_of("stanford"))
    take(table, ("Table", '[data-dh2sim="row-matrix"]'), "viewer.png")
    reach = open_state(load_robot("puma560"), folder_of("puma560"))
    for part in (Part.ANNOTATIONS, Part.FRAME_NAMES, Part.HANDLE):
        reach = reduce(reach, Show(part=part, on=False))
    for part in (Part.WORKSPACE, Part.SECTION):
        reach = reduce(reach, Show(part=part, on=True))
    take(reduce(reach, SetJoints(q=(0.2, -0.8, -0.3, 0.1, 0.7, 0.2))), REACH, "workspace_viewer.png", farther=True)


def take(state: ViewState, wanted: tuple[str, str], name: str, *, farther: bool = False) -> None:
    """Open the page, show a tab, wait until everything is drawn, and take the picture."""
    browser_path = shutil.which("chromium") or shutil.which("google-chrome")
    viewer = Viewer(state, host=HOST, port=free_port(HOST, 8450))
    tab, element = wanted
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=browser_path, args=SOFTWARE)
            page = browser.new_page(viewport={"width": 1280, "height": 760})
            page.goto(viewer.url)
            page.get_by_role("tab", name=tab).click()
            page.locator(element).first.wait_for()
            page.locator(element).first.scroll_into_view_if_needed()
            if farther:
                page.mouse.move(400, 380)
                page.mouse.wheel(0, 900)
            page.wait_for_timeout(8000)
            close = page.locator(".mantine-Notification-closeButton")  # of the warning about software rendering
            if close.count():
                close.first.click()
            page.wait_for_timeout(2000)
            page.screenshot(path=IMAGES / name)
            browser.close()
    finally:
        viewer.stop()


if __name__ == "__main__":
    main()
