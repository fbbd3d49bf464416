#!/usr/bin/env python3
"""Take docs/images/viewer.png: the viewer in a real browser, with the table beside the robot that it describes.

Needs the extra `test`, and Chromium.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from playwright.sync_api import sync_playwright

from dh2sim.robot.read import load_robot
from dh2sim.view.initial_state import folder_of, open_state
from dh2sim.view.server import Viewer, free_port

OUT = Path(__file__).resolve().parent.parent / "docs" / "images" / "viewer.png"
HOST = "127.0.0.1"
SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
ROBOT = "stanford"


def main() -> None:
    """Open the page, show the table, wait until everything is drawn, and take the picture."""
    browser_path = shutil.which("chromium") or shutil.which("google-chrome")
    viewer = Viewer(open_state(load_robot(ROBOT), folder_of(ROBOT)), host=HOST, port=free_port(HOST, 8450))
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=browser_path, args=SOFTWARE)
            page = browser.new_page(viewport={"width": 1280, "height": 760})
            page.goto(viewer.url)
            page.get_by_role("tab", name="Table").click()
            page.locator('[data-dh2sim="row-matrix"]').wait_for()
            page.wait_for_timeout(8000)
            close = page.locator(".mantine-Notification-closeButton")  # of the warning about software rendering
            if close.count():
                close.first.click()
            page.wait_for_timeout(2000)
            page.screenshot(path=OUT)
            browser.close()
    finally:
        viewer.stop()


if __name__ == "__main__":
    main()
