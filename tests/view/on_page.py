"""What tests do on a page in a browser, and read there."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

    from dh2sim.view.page import Page as ServedPage

DEADLINE = 60.0
"""s."""

OpenPage: TypeAlias = "Callable[[], Page]"
Serve: TypeAlias = "Callable[..., tuple[Page, ServedPage]]"
"""Of a state, and of the path of a run if there is one: a page in the browser, and what serves it."""


def shown(page: Page, name: str) -> str:
    """The text of a part of the panel."""
    return page.locator(f'[data-dh2sim="{name}"]').first.inner_text()


def xyz(page: Page) -> list[float]:
    """The position that the page shows, m."""
    found = re.search(r"xyz \[m\]\s+(\S+) (\S+) (\S+)", shown(page, "readout"))
    assert found is not None
    return [float(number) for number in found.groups()]


def wait_until(holds: Callable[[], bool], what: str, seconds: float = DEADLINE) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, what
        time.sleep(0.05)


def wait_for_position(page: Page, spec: RobotSpec, q: Sequence[float]) -> None:
    """Wait until the page shows where the table has tool0."""
    expected = table_tool_pose(spec, q)[:3, 3]
    wait_until(lambda: bool(np.allclose(xyz(page), expected, rtol=0, atol=1.1e-6)), f"{xyz(page)} is not {expected}")


def field(page: Page, label: str) -> Locator:
    """The field that can be typed into beside a label, of those that are seen."""
    name = page.locator("label", has_text=re.compile(f"^{re.escape(label)}$")).locator("visible=true")
    return name.locator("xpath=ancestor::*[.//input[not(@type='hidden')]][1]//input[not(@type='hidden')]").first


def choose(page: Page, label: str, option: str) -> None:
    page.get_by_role("option").first.wait_for(state="hidden")  # those of another field fade for a while
    field(page, label).click()
    page.get_by_role("option", name=option, exact=True).click()


def open_tab(page: Page, name: str) -> None:
    page.get_by_role("tab", name=name).click()


def pixel(page: Page, served: ServedPage, point: ArrayLike) -> tuple[float, float]:
    """Where a point of base_link, m, is on the page: the camera is a pinhole that looks along its z."""
    camera, box = served.client.camera, page.locator("canvas").first.bounding_box()
    assert box is not None
    w, *v = camera.wxyz.tolist()
    offset = np.subtract(point, camera.position)
    right, down, ahead = offset + 2.0 * np.cross(v, np.cross(v, offset) - w * offset)  # turned back
    focal = 0.5 * box["height"] / math.tan(0.5 * camera.fov)
    return (
        box["x"] + 0.5 * box["width"] + focal * float(right / ahead),
        box["y"] + 0.5 * box["height"] + focal * float(down / ahead),
    )
