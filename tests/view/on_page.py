"""What tests do on a page in a browser, and read there.

A page shows a state bit by bit: first the scene, then the panel, one widget after the other, then what is slow to
compute; and a browser takes its time with each. So a test never asserts what a page shows, it waits for it; and it
compares values of one reading, not of two.
"""

from __future__ import annotations

import math
import re
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.view.scene.camera import viewpoint_of

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

    from dh2sim.view.page import Page as ServedPage

DEADLINE = 120.0
"""s: nothing takes as long, not even in a browser without a graphics card, on a machine that is busy."""

Read = TypeVar("Read")

OpenPage: TypeAlias = "Callable[[], Page]"
Serve: TypeAlias = "Callable[..., tuple[Page, ServedPage]]"
"""Of a state, and of the path of a run if there is one: a page in the browser, and what serves it."""


def wait_until(holds: Callable[[], bool], what: str | Callable[[], str], seconds: float = DEADLINE) -> None:
    """Wait until something holds; a message that says what was found instead is a function."""
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, what if isinstance(what, str) else what()
        time.sleep(0.05)


def is_soon(holds: Callable[[], bool]) -> bool:
    """Return whether something holds within some seconds; otherwise, the mouse may have to be moved again."""
    end = time.monotonic() + 10.0
    while not holds():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def wait_for_equal(read: Callable[[], object], expected: object) -> None:
    """Wait until what is read is as expected."""
    found: object = None

    def is_equal() -> bool:
        nonlocal found
        found = read()
        return bool(found == expected)

    wait_until(is_equal, lambda: f"{found!r} is not {expected!r}")


def at_rest(read: Callable[[], Read]) -> Read:
    """What is read three times in a row, with pauses between."""
    found: list[Read] = []

    def rests() -> bool:
        found.append(read())
        if len(found) >= 3 and found[-1] == found[-2] == found[-3]:
            return True
        time.sleep(0.3)
        return False

    wait_until(rests, lambda: f"it does not come to rest: {found[-3:]}")
    return found[-1]


def shown(page: Page, name: str) -> str:
    """The text of a part of the panel, at this moment."""
    return page.locator(f'[data-dh2sim="{name}"]').first.inner_text()


def wait_for_text(page: Page, name: str, words: str) -> None:
    """Wait until a part of the panel contains some words."""
    found = ""

    def contains() -> bool:
        nonlocal found
        found = shown(page, name)
        return words in found

    wait_until(contains, lambda: f"{words!r} is not in {found!r}")


def wait_for_whole_text(page: Page, name: str, text: str) -> None:
    """Wait until a text, maybe none, is all that a part of the panel shows."""
    wait_for_equal(lambda: shown(page, name), text)


def wait_for_value(page: Page, label: str, text: str) -> None:
    """Wait until a field contains a text."""
    wait_for_equal(lambda: field(page, label).input_value(), text)


def xyz(page: Page) -> list[float]:
    """The position that the page shows at this moment, m; nothing while it shows none."""
    found = re.search(r"xyz \[m\]\s+(\S+) (\S+) (\S+)", shown(page, "readout"))
    return [] if found is None else [float(number) for number in found.groups()]


def wait_for_position(page: Page, spec: RobotSpec, q: Sequence[float] | Callable[[], Sequence[float]]) -> None:
    """Wait until the page shows where the table has tool0, at a joint vector or at the present one."""
    found, expected = [], np.empty(3)

    def is_there() -> bool:
        nonlocal found, expected
        expected = table_tool_pose(spec, q() if callable(q) else q)[:3, 3]
        found = xyz(page)
        return len(found) == 3 and bool(np.allclose(found, expected, rtol=0, atol=1.1e-6))

    wait_until(is_there, lambda: f"{found} is not {expected}")


def wait_for_matrix(page: Page, name: str, T: Array) -> None:
    """Wait until a table of the panel shows a pose, of shape (4, 4)."""

    def is_shown() -> bool:
        numbers = shown(page, name).split()
        return len(numbers) == 16 and bool(
            np.allclose(np.array(numbers, dtype=np.float64).reshape(4, 4), T, rtol=0, atol=1e-6)
        )

    wait_until(is_shown, lambda: f"{shown(page, name)} is not {T}")


def wait_for_aim(served: ServedPage) -> None:
    """Wait until the camera of a page, of which the panel takes a part, is where the robot fills the picture."""
    camera = served.client.camera
    wait_until(lambda: camera.aspect < 1.0, "the panel is beside the scene")
    wait_until(
        lambda: np.allclose(camera.position, viewpoint_of(served.state.model, camera.aspect).position, atol=1e-6),
        "the camera is aimed at the robot",
    )


def wait_for_work(served: ServedPage) -> None:
    """Wait until a page has worked through what was sent to it so far."""
    done = threading.Event()
    served.send(done.set)
    wait_until(done.is_set, "the page is busy")


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
