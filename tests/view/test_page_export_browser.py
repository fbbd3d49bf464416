"""What a real browser without a network shows of a page that opens without a server."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from PIL import Image

from dh2sim.draw.rollout_data import select_rollout
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.view.page_export import BoundingSphere, export_page, page_html
from dh2sim.view.scene.items import ORIGIN, Color, Placed, Scene, Solid, Vector
from tests.draw.datasets import swinging
from tests.sample_robots import robot
from tests.view.on_page import DEADLINE

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Route

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
UNIT = BoundingSphere(centre=(0.0, 0.0, 0.0), radius=1.0)
WIDTH, HEIGHT = 480, 360


def box(color: Color, half: float = 0.3, position: Vector = ORIGIN) -> Solid:
    corners = tuple((x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half))
    faces = (
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    )  # fmt: skip
    return Solid(vertices=corners, faces=faces, color=color, position=position)


@pytest.fixture(scope="module")
def puma() -> RobotModel:
    return build_model(robot("puma560"))


@dataclass
class Tab:
    """A page in a browser that reaches files alone."""

    browser: Browser
    errors: list[str] = field(default_factory=list)
    """Of the console, and what was not caught."""
    asked: list[str] = field(default_factory=list)
    """Addresses that were asked for and are no files."""

    def open(self, path: Path) -> None:
        context = self.browser.new_context(viewport={"width": WIDTH, "height": HEIGHT}, offline=True)
        context.set_default_timeout(1000.0 * DEADLINE)
        context.route("**/*", lambda route: self._route(route))
        self.page = context.new_page()
        self.page.on("console", lambda entry: self.errors.append(entry.text) if entry.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.goto(path.as_uri())
        # the notice that this browser has no graphics card covers part of the picture
        self.page.add_style_tag(content=".mantine-Notifications-root { display: none; }")

    def _route(self, route: Route) -> None:
        address = route.request.url
        if address.startswith("file:"):
            route.continue_()
        else:
            self.asked.append(address)
            route.abort()

    def picture(self) -> NDArray[np.int64]:
        """What is seen, shape (height, width, 3)."""
        with Image.open(io.BytesIO(self.page.screenshot())) as image:
            return np.asarray(image.convert("RGB")).astype(np.int64)

    def picture_when(self, seen: Callable[[NDArray[np.int64]], bool]) -> NDArray[np.int64]:
        end = time.monotonic() + DEADLINE
        picture = self.picture()
        while not seen(picture) and time.monotonic() < end:
            time.sleep(0.2)
            picture = self.picture()
        return picture

    def picture_at_rest(self) -> NDArray[np.int64]:
        end = time.monotonic() + DEADLINE
        while time.monotonic() < end:
            before = self.picture()
            self.page.wait_for_timeout(1000)
            after = self.picture()
            if (before == after).all():
                return after
        raise AssertionError("the picture does not come to rest")


@pytest.fixture
def tab(browser: Browser) -> Iterator[Tab]:
    opened = Tab(browser)
    yield opened
    opened.page.context.close()


def most(picture: NDArray[np.int64], x: int, y: int) -> int:
    """Which of red, green and blue is most at a place: 0, 1 or 2; -1 where it is grey."""
    color = picture[y - 3 : y + 4, x - 3 : x + 4].reshape(-1, 3).mean(axis=0)
    return int(np.argmax(color)) if np.ptp(color) > 60 else -1


def orange(picture: NDArray[np.int64]) -> NDArray[np.bool_]:
    red, green, blue = np.moveaxis(picture, -1, 0)
    return np.asarray((red > blue + 60) & (red > green + 15) & (green > blue + 10))


def dark(picture: NDArray[np.int64]) -> NDArray[np.bool_]:
    return np.asarray((picture.max(axis=2) < 110) & (np.ptp(picture, axis=2) < 40))


def robot_is_seen(picture: NDArray[np.int64]) -> bool:
    """Whether links and joints are there in full colour; viser fades a picture in."""
    return bool(orange(picture).mean() > 0.01 and dark(picture).mean() > 0.003)


def middle_is(channel: int) -> Callable[[NDArray[np.int64]], bool]:
    return lambda picture: most(picture, WIDTH // 2, HEIGHT // 2) == channel


@pytest.mark.slow
def test_a_robot_is_seen_from_all_sides_without_server_or_network_and_the_console_is_clean(
    puma: RobotModel, tab: Tab, tmp_path: Path
) -> None:
    path = tmp_path / "puma.html"
    export_page(puma, puma.home, path)
    tab.open(path)
    picture = tab.picture_when(robot_is_seen)
    assert tab.page.title() == "puma560"
    assert orange(picture).mean() > 0.01, "the links"
    assert dark(picture).mean() > 0.003, "the joints"
    rows, columns = np.nonzero(orange(picture))
    assert 0.2 * WIDTH < columns.mean() < 0.8 * WIDTH, "near the middle"
    assert 0.2 * HEIGHT < rows.mean() < 0.8 * HEIGHT
    assert np.ptp(rows) > 0.2 * HEIGHT, "and not small"
    before = orange(tab.picture_at_rest())
    mouse = tab.page.mouse
    mouse.move(0.5 * WIDTH, 0.85 * HEIGHT)
    mouse.down()
    mouse.move(0.3 * WIDTH, 0.8 * HEIGHT, steps=5)
    mouse.up()
    moved = orange(tab.picture_when(lambda seen: (orange(seen) != before).mean() > 0.01))
    assert (moved != before).mean() > 0.01, "from another side"
    assert moved.mean() > 0.002, "it is still there"
    assert tab.errors == []
    assert tab.asked == []


@pytest.mark.slow
def test_solids_are_seen_where_they_are_in_the_colour_that_they_have(tab: Tab, tmp_path: Path) -> None:
    path = tmp_path / "boxes.html"
    scene: Scene = {
        "/red": box(RED),
        "/up": Placed(position=(0.0, 0.0, 0.8)),
        "/up/blue": box(BLUE, half=0.15),
        "/green": box(GREEN, half=0.15, position=(0.8, 0.0, -0.3)),
    }
    path.write_text(page_html([(0.0, scene)], title="boxes", bounds=UNIT), encoding="utf-8")
    tab.open(path)
    picture = tab.picture_when(middle_is(0))
    assert middle_is(0)(picture)
    above = {most(picture, WIDTH // 2, y) for y in range(10, HEIGHT // 3, 3)}
    assert 2 in above, "z goes up"
    right = {most(picture, x, y) for x in range(int(0.6 * WIDTH), WIDTH - 10, 4) for y in range(100, HEIGHT - 40, 4)}
    assert 1 in right, "x goes to the right"
    assert 2 not in right
    assert tab.errors == []


@pytest.mark.slow
def test_an_animation_loops_and_can_be_searched(tab: Tab, tmp_path: Path) -> None:
    path = tmp_path / "colours.html"
    moments = [(0.4 * k, {"/box": box(color)}) for k, color in enumerate((RED, GREEN, BLUE))]
    path.write_text(page_html(moments, title="colours", bounds=UNIT), encoding="utf-8")
    tab.open(path)
    clock = tab.page.locator("input").first
    clock.wait_for()
    assert begins_again(tab, clock)
    stop(tab, clock)
    for moment, channel in (("0.5", 1), ("0.1", 0), ("0.8", 2), ("0.2", 0)):
        clock.fill(moment)
        assert middle_is(channel)(tab.picture_when(middle_is(channel))), moment
        assert clock.input_value() == moment, "it stays there"
    track = tab.page.locator(".mantine-Slider-track").bounding_box()
    assert track is not None
    tab.page.mouse.click(track["x"] + 0.6 * track["width"], track["y"] + 0.5 * track["height"])
    assert middle_is(1)(tab.picture_when(middle_is(1))), "the slider goes there too"
    assert tab.errors == []
    assert tab.asked == []


def stop(tab: Tab, clock: Locator) -> None:
    tab.page.keyboard.press("Space")
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        before = clock.input_value()
        tab.page.wait_for_timeout(1000)
        if clock.input_value() == before:
            return
    raise AssertionError("the animation does not stop")


def begins_again(tab: Tab, clock: Locator) -> bool:
    """Whether a clock goes back by itself."""
    end, highest = time.monotonic() + DEADLINE, 0.0
    while time.monotonic() < end:
        now = float(clock.input_value())
        if now < highest:
            return True
        highest = now
        tab.page.wait_for_timeout(100)
    return False


def test_a_rollout_moves_the_robot_in_the_page(puma: RobotModel, tab: Tab, tmp_path: Path) -> None:
    path = tmp_path / "puma.html"
    run = swinging("puma560")
    waist = xr.DataArray([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], dims="joint")
    turned = (run["qpos"] + 15.0 * run["time"] * waist).transpose(*run["qpos"].dims)  # by 1.8 rad in all
    export_page(puma, puma.home, path, rollout=select_rollout(run.assign(qpos=turned), 0, "run.zarr"))
    tab.open(path)
    clock = tab.page.locator("input").first
    clock.wait_for()
    stop(tab, clock)
    clock.fill("0.1")
    tab.picture_when(robot_is_seen)
    away = orange(tab.picture_at_rest())
    clock.fill("0.01")
    tab.picture_when(lambda seen: (orange(seen) != away).mean() > 0.005)
    first = orange(tab.picture_at_rest())
    clock.fill("0.1")
    later = orange(tab.picture_when(lambda seen: (orange(seen) != first).mean() > 0.005))
    clock.fill("0.01")
    again = orange(tab.picture_when(lambda seen: (orange(seen) != first).mean() < 0.0005))
    assert first.mean() > 0.005
    assert later.mean() > 0.001, "the arm points at the camera"
    assert (later != first).mean() > 0.005, "it moves"
    assert (again != first).mean() < 0.0005, "and is back at the beginning"
    assert tab.errors == []
