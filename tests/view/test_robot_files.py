"""The robots that a page can show: those that come with dh2sim, and the files beside the first one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from dh2sim.errors import Dh2simError
from dh2sim.robot.catalog import builtin_path, builtin_robots
from dh2sim.robot.read import load_robot
from dh2sim.robot.yaml_tree import MAX_BYTES
from dh2sim.view.events import EditCell, Event, OpenText, SetMode
from dh2sim.view.initial_state import folder_of, open_state
from dh2sim.view.reduce import reduce
from dh2sim.view.robot_files import MAX_BESIDE, RobotFiles, robot_files_in
from dh2sim.view.state import Mode, ViewState
from tests.view.states import after

ONE = "name: one\nconvention: standard\njoints:\n  - {type: revolute, a: 0.5}\n"


class Browsed:
    """A page's state, and what its files do to it."""

    def __init__(self, state: ViewState) -> None:
        self.state = state
        self.opened = 0
        self.files = RobotFiles(lambda: self.state, self._apply, lambda _name, _data: None, self._open)

    def _apply(self, event: Event) -> None:
        self.state = reduce(self.state, event)

    def _open(self) -> None:
        self.opened += 1


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "one.yaml").write_text(ONE, encoding="utf-8")
    (tmp_path / "two.yml").write_text(f"# the second\n{ONE}".replace("0.5", "0.25"), encoding="utf-8")
    (tmp_path / "wrong.yaml").write_text(ONE.replace("revolute", "revolut"), encoding="utf-8")
    (tmp_path / "notes.yaml").write_text("notes: of joints:\n", encoding="utf-8")
    (tmp_path / "huge.yaml").write_text(ONE + " " * MAX_BYTES, encoding="utf-8")
    (tmp_path / "readme.txt").write_text(ONE, encoding="utf-8")
    (tmp_path / "folder.yaml").mkdir()
    return tmp_path


def opened(path: Path) -> Browsed:
    return Browsed(open_state(load_robot(path), folder_of(str(path))))


def test_files_beside_the_first_one_are_offered_with_the_robots_that_come_with_dh2sim(folder: Path) -> None:
    page = opened(folder / "one.yaml")
    assert page.files.robots == ("one.yaml", "two.yml", "wrong.yaml", *builtin_robots())
    assert page.files.chosen == "one.yaml"
    page.files.choose("two.yml")
    assert page.state.spec.rows[0].a == 0.25
    assert (page.files.chosen, page.opened, page.state.folder) == ("two.yml", 1, folder)
    page.files.choose("puma560")
    builtin_file = builtin_path("puma560")
    assert builtin_file is not None
    assert page.state.text == builtin_file.read_text(encoding="utf-8")
    assert (page.files.chosen, page.opened) == ("puma560", 2)


def test_a_built_in_robot_is_called_by_its_name_and_nothing_stands_beside_it() -> None:
    page = Browsed(open_state(load_robot("stanford"), folder_of("stanford")))
    assert page.files.robots == builtin_robots()
    assert page.files.chosen == "stanford"


def test_the_first_robot_is_reopened_as_it_was_and_can_still_play_its_run(folder: Path) -> None:
    page = opened(folder / "one.yaml")
    first = page.state
    page.state = after(page.state, EditCell(row=0, column="a", text="0.7"))
    page.files.choose("two.yml")
    page.files.choose("one.yaml")
    assert (page.state.text, page.state.file, page.state.folder) == (first.text, first.file, first.folder)


def test_an_invalid_file_changes_nothing_and_says_what_is_wrong(folder: Path) -> None:
    page = opened(folder / "one.yaml")
    before = page.state
    page.files.choose("wrong.yaml")
    assert "wrong.yaml:4:12: joints[0].type: found 'revolut'" in page.state.notice
    assert replace(page.state, notice="") == before
    assert page.opened == 0


def test_a_file_that_is_gone_is_an_error(folder: Path) -> None:
    page = opened(folder / "one.yaml")
    (folder / "two.yml").unlink()
    with pytest.raises(Dh2simError, match=r"^two\.yml: No such file or directory$"):
        page.files.choose("two.yml")
    with pytest.raises(Dh2simError, match=r"^\.\./secret\.yaml is no longer there\.$"):
        page.files.choose("../secret.yaml")


def test_an_uploaded_robot_is_listed_while_it_is_shown(folder: Path) -> None:
    page = opened(folder / "one.yaml")
    page.state = after(page.state, OpenText(text=ONE, file="sent.yaml"))
    assert page.files.robots[0] == page.files.chosen == "sent.yaml"
    page.files.choose("one.yaml")
    assert "sent.yaml" not in page.files.robots


def test_another_robot_is_in_manual_mode(folder: Path) -> None:
    page = opened(folder / "one.yaml")
    page.state = after(page.state, SetMode(mode=Mode.PHYSICS))
    page.files.choose("scara")
    assert page.state.mode is Mode.MANUAL


def test_no_more_files_than_can_be_chosen_from_are_listed(tmp_path: Path) -> None:
    for number in range(MAX_BESIDE + 5):
        (tmp_path / f"r{number:03}.yaml").write_text(ONE, encoding="utf-8")
    assert len(robot_files_in(tmp_path)) == MAX_BESIDE
    assert robot_files_in(tmp_path / "nowhere") == ()
    assert robot_files_in(None) == ()
