"""Robot files that are uploaded to a page, by a user in a browser and by somebody who means harm."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from dh2sim.robot.catalog import builtin_path
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.yaml_tree import MAX_BYTES
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import Page as ServedPage
from dh2sim.view.server import Viewer
from tests.program import dh2sim
from tests.view.on_page import (
    OpenPage,
    choose,
    field,
    open_tab,
    shown,
    wait_for_equal,
    wait_for_position,
    wait_for_text,
    wait_for_value,
    wait_for_whole_text,
    wait_for_work,
    wait_until,
)
from tests.view.without_browser import speaking

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

MINE = (
    "name: mine\nconvention: standard\nconfigurations: {home: [0.5, 0.2]}\njoints:\n"
    "  - {name: turn, type: revolute, a: 0.5, limits: {position: [-1, 1]}}\n"
    "  - {name: slide, type: prismatic, alpha: 0.3, limits: {position: [0, 0.4]}}\n"
)
OPEN, COMPARE = "Open a robot file", "Compare with a robot file"
PART = 512 * 1024
"""Bytes that viser's page sends at a time."""


def upload(page: Page, button: str, name: str, text: str) -> None:
    """Choose a file with an upload button: its input is not seen."""
    chooser = page.get_by_role("button", name=button).locator("xpath=preceding-sibling::input[@type='file']")
    chooser.set_input_files({"name": name, "mimeType": "application/yaml", "buffer": text.encode()})


def test_a_robot_file_is_opened_an_invalid_one_reported_and_the_first_reopened(
    open_page: OpenPage, viewer: Viewer, tmp_path: Path
) -> None:
    page, spec, stanford = open_page(), parse_robot(MINE), load_robot("stanford")
    (served,) = viewer.pages
    open_tab(page, "Files")
    upload(page, OPEN, "<b>my arm<b>.yaml", MINE)
    wait_for_whole_text(page, "notice", "Opened <b>my arm<b>.yaml: mine, 2 joints.")
    page.get_by_text("dh2sim · mine").wait_for()
    open_tab(page, "Joints")
    wait_for_position(page, spec, (0.5, 0.2))
    wait_for_value(page, "slide [m]", "0.2")
    open_tab(page, "Table")
    wait_for_value(page, "Row", "1: turn")
    wait_for_equal(page.locator("label", has_text="a₃").count, 0)  # it has two rows
    field(page, "a₁").fill("0.75")
    wait_until(lambda: served.state.spec.rows[0].a == 0.75, "it is edited")

    open_tab(page, "Files")
    upload(page, OPEN, "wrong.yaml", MINE.replace("a: 0.5", "a: 0.5 +").replace("prismatic", "prismatik"))
    wait_for_text(page, "notice", "wrong.yaml")
    lines = shown(page, "notice").split("\n")
    assert lines[0] == "Robot unchanged."
    assert lines[1] == "wrong.yaml:5:37: joints[0].a: in '0.5 +': it ends too early"
    assert lines[2].startswith("wrong.yaml:6:25: joints[1].type: found 'prismatik'. Did you mean 'prismatic'?")
    assert served.state.text == MINE.replace("a: 0.5", "a: 0.75")

    page.get_by_role("button", name="Reopen the first file").click()
    wait_for_text(page, "notice", "Opened ")
    page.get_by_text("dh2sim · stanford").wait_for()
    open_tab(page, "Joints")
    wait_for_position(page, stanford, stanford.configurations["home"].tolist())
    assert (served.state.file, served.state.folder) == (viewer._state.file, viewer._state.folder)


def test_a_robot_file_is_shown_as_the_ghost(open_page: OpenPage) -> None:
    page = open_page()
    open_tab(page, "Show")
    scara = builtin_path("scara")
    assert scara is not None
    upload(page, COMPARE, "any.yaml", scara.read_text(encoding="utf-8"))
    wait_until(lambda: shown(page, "ghost").startswith("scara has tool0 "), "the ghost")
    wait_for_value(page, "Ghost", "scara (uploaded)")
    upload(page, COMPARE, "any.yaml", "name: x\n")
    wait_for_text(page, "notice", "missing key 'joints'")
    assert shown(page, "ghost").startswith("scara has tool0 ")
    choose(page, "Ghost", "none")
    wait_for_whole_text(page, "ghost", "")


def test_a_file_that_is_too_large_is_refused_and_the_next_one_opened(open_page: OpenPage) -> None:
    page = open_page()
    open_tab(page, "Files")
    upload(page, OPEN, "big.yaml", MINE + "#" * 3 * MAX_BYTES)
    size = len(MINE) + 3 * MAX_BYTES
    wait_for_whole_text(page, "notice", f"big.yaml has {size} bytes; at most 1000000 are allowed.")
    wait_until(page.get_by_role("button", name=OPEN).is_enabled, "the button is free again")
    wait_for_equal(page.get_by_text("Uploading big.yaml").count, 0)  # nothing says that it was taken
    upload(page, OPEN, "next.yaml", MINE + "\n".join(["# comment"] * 70_000))
    wait_for_whole_text(page, "notice", "Opened next.yaml: mine, 2 joints.")  # of two parts


@pytest.mark.slow
def test_a_recording_is_played_only_with_its_own_robot(
    window: BrowserContext, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("run") / "run.zarr"
    done = dh2sim("rollout", "stanford", "--rollouts", "1", "--duration", "1", "--out", path, "--quiet")
    assert done.status == 0, done.err
    viewer = Viewer(open_state(load_robot("stanford")), run=path)
    try:
        with contextlib.closing(window.new_page()) as page:
            page.goto(viewer.url)
            open_tab(page, "Motion")
            choose(page, "Mode", "recording")
            wait_until(lambda: shown(page, "motion").startswith("Rollout 0: "), "it is played")
            open_tab(page, "Files")
            upload(page, OPEN, "mine.yaml", MINE)
            wait_for_whole_text(page, "notice", "Opened mine.yaml: mine, 2 joints.")
            open_tab(page, "Motion")
            wait_for_value(page, "Mode", "manual")  # it has ended
            field(page, "Mode").click()
            page.get_by_role("option", name="physics", exact=True).wait_for()
            wait_for_equal(page.get_by_role("option", name="recording", exact=True).count, 0)
            page.keyboard.press("Escape")
            page.get_by_text("Rollout", exact=True).wait_for(state="hidden")
            (served,) = viewer.pages
            served.send(lambda: served.motion.play(0))
            notice = "The recording is of the robot opened first: return to that to play it."
            wait_for_whole_text(page, "notice", notice)
            open_tab(page, "Joints")
            wait_for_position(page, parse_robot(MINE), (0.5, 0.2))
            open_tab(page, "Files")
            page.get_by_role("button", name="Reopen the first file").click()
            open_tab(page, "Motion")
            choose(page, "Mode", "recording")
            wait_until(lambda: shown(page, "motion").startswith("Rollout 0: "), "it is played again")
    finally:
        viewer.stop()


@pytest.fixture
def speaker(viewer: Viewer) -> Iterator[tuple[ServedPage, Callable[..., None]]]:
    """A page without a browser, and what sends the server a message from it."""
    wait_until(lambda: not viewer.pages, "other pages are closed")
    with speaking(viewer.url) as say:
        wait_until(lambda: len(viewer.pages) == 1, "the page")
        (served,) = viewer.pages
        wait_for_work(served)  # whose turn comes once all is shown
        yield served, say


def buttons(served: ServedPage) -> dict[str, str]:
    """Which upload button has which label."""
    import viser

    handles = list(served.client.gui._gui_input_handle_from_uuid.items())
    return {uuid: handle.label for uuid, handle in handles if isinstance(handle, viser.GuiUploadButtonHandle)}


def test_after_nonsense_the_next_valid_file_is_opened(speaker: tuple[ServedPage, Callable[..., None]]) -> None:
    served, say = speaker
    button = next(uuid for uuid, label in buttons(served).items() if label == OPEN)
    others = [uuid for uuid in served.client.gui._gui_input_handle_from_uuid if uuid not in buttons(served)]
    numbers = itertools.count()

    def announce(size: Any, count: Any, source: Any = button, name: Any = "x.yaml") -> str:
        transfer = f"transfer {next(numbers)}"
        say(
            "FileTransferStartUpload",
            source_component_uuid=source,
            transfer_uuid=transfer,
            filename=name,
            mime_type="",
            part_count=count,
            size_bytes=size,
        )
        return transfer

    def send(transfer: Any, index: Any, content: Any) -> None:
        say(
            "FileTransferPart",
            source_component_uuid=button,
            transfer_uuid=transfer,
            part_index=index,
            content=content,
        )

    before = served.state
    for size, count in ((10**12, 10**6), (10, 10**9), (10, 500)):  # more than there will be
        transfer = announce(size, count)
        for index in range(4):
            send(transfer, index, b"x")
    for source in (*others, "", "unknown"):  # not upload buttons at all
        send(announce(3, 1, source), 0, b"abc")
    send("unknown", 0, b"x")
    send(announce(MAX_BYTES + 1, 1), 0, b"x" * (MAX_BYTES + 1))
    refusal = f"x.yaml has {MAX_BYTES + 1} bytes; at most {MAX_BYTES} are allowed."
    wait_until(lambda: served.state.notice == refusal, "it is refused")
    assert served.state.model is before.model
    last = announce(len(MINE), 1, name="<script>\x00" + "y" * 300)
    send(last, 0, MINE.encode())
    wait_until(lambda: served.state.spec.name == "mine", "a right one is still taken")
    assert served.state.notice == f"Opened <script>_{'y' * 45}…yyyyy: mine, 2 joints."
    assert served.state.model is not before.model
    assert served.state.file.startswith("<script>_y")
