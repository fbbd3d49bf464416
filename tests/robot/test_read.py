"""Robots are found by path or by name."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from dh2sim.errors import Dh2simError, RobotFileError, UnknownRobotError
from dh2sim.robot import catalog
from dh2sim.robot.catalog import builtin_path, builtin_robots
from dh2sim.robot.read import load_robot, parse_robot
from tests.robot.files import MINIMAL


@pytest.fixture
def builtins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let two robots, ``arm`` and ``scara``, be all that come with dh2sim, and go to an empty folder."""
    folder = tmp_path / "builtin"
    folder.mkdir()
    for name in ("scara", "arm"):
        (folder / f"{name}.yaml").write_text(MINIMAL.replace("name: r", f"name: {name}"))
    (folder / "notes.txt").write_text("no robot")
    monkeypatch.setattr(catalog, "_FOLDERS", (tmp_path / "missing", folder))
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    return folder


def test_builtin_robots_are_listed_by_name(builtins: Path) -> None:
    assert builtin_robots() == ("arm", "scara")
    assert builtin_path("arm") == builtin_path("arm.yaml") == builtins / "arm.yaml"
    assert builtin_path("leg") is None
    assert builtin_path("../builtin/arm") is None


def test_without_a_folder_there_are_no_builtin_robots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalog, "_FOLDERS", (tmp_path / "missing",))
    assert builtin_robots() == ()


@pytest.mark.parametrize("name", ["arm", "arm.yaml"])
def test_a_builtin_robot_is_found_with_or_without_its_ending(builtins: Path, name: str) -> None:
    spec = load_robot(name)
    assert spec.name == "arm"
    assert spec.source_file is not None
    assert (spec.source_file.name, spec.source_file.path) == ("arm.yaml", "arm.yaml")


@pytest.mark.parametrize("name", ["arm", "arm.yaml"])
def test_a_path_that_exists_wins(builtins: Path, name: str) -> None:
    Path(name).write_text(MINIMAL)
    assert load_robot(name).name == "r"


def test_a_path_may_be_a_path_object_and_have_any_ending(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_text(MINIMAL)
    source = load_robot(path).source_file
    assert source is not None
    assert (source.name, source.path) == ("x.txt", str(path))


def test_mesh_paths_start_beside_the_robot_file(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(MINIMAL + "base: {mesh: {file: b.stl}}\n")
    (tmp_path / "b.stl").write_bytes(b"")
    mesh = load_robot(tmp_path / "x.yaml").base.mesh
    assert mesh is not None
    assert mesh.file == tmp_path / "b.stl"


def test_messages_name_the_file_as_the_user_did(builtins: Path) -> None:
    Path("x.yaml").write_text("name: r\n")
    with pytest.raises(RobotFileError) as caught:
        load_robot("./x.yaml")
    assert str(caught.value).startswith("./x.yaml:1:1: missing key 'convention'\n")


@pytest.mark.parametrize(
    ("name", "begins"),
    [
        ("arn", "no file or robot named 'arn'. Did you mean 'arm'?"),
        ("SCARA.yaml", "no file or robot named 'SCARA.yaml'. Did you mean 'scara'?"),
        ("", "no file or robot named ''."),
        ("a\0b", "no file or robot named 'a\\x00b'."),
        ("no/such/file.yaml", "no file or robot named 'no/such/file.yaml'."),
    ],
)
def test_the_error_of_an_unknown_name_lists_the_known_ones(builtins: Path, name: str, begins: str) -> None:
    with pytest.raises(UnknownRobotError) as caught:
        load_robot(name)
    assert str(caught.value) == f"{begins} Robots that come with dh2sim: arm, scara"


def test_an_unknown_name_of_any_length_is_reported(builtins: Path) -> None:
    with pytest.raises(UnknownRobotError):
        load_robot("x" * 10_000)


def test_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Dh2simError) as caught:
        load_robot(tmp_path)
    assert str(caught.value) == f"{tmp_path}: is a folder, not a robot file"


def test_the_error_of_a_folder_named_like_a_builtin_robot_says_how_to_get_the_robot(builtins: Path) -> None:
    Path("arm").mkdir()
    with pytest.raises(Dh2simError) as caught:
        load_robot("arm")
    assert str(caught.value) == "arm: is a folder, not a robot file; 'arm.yaml' is the robot that comes with dh2sim"
    assert load_robot("arm.yaml").name == "arm"


def test_a_file_that_cannot_be_opened_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.symlink_to(tmp_path / "nowhere")
    with pytest.raises(Dh2simError) as caught:
        load_robot(path)
    assert str(caught.value) == f"{path}: cannot be read: No such file or directory"


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    with path.open("wb") as stream:
        stream.truncate(10**12)
    with pytest.raises(RobotFileError) as caught:
        load_robot(path)
    assert str(caught.value) == f"{path}:1:1: the file has 1000000000000 bytes; at most 1000000 are allowed"


def test_text_may_come_as_bytes() -> None:
    assert parse_robot(MINIMAL.encode()).name == "r"


def test_text_without_a_name_is_called_string() -> None:
    with pytest.raises(RobotFileError) as caught:
        parse_robot("")
    assert str(caught.value).startswith("<string>:1:1: ")


def test_the_interface_does_not_pull_in_the_parser() -> None:
    code = "import sys, dh2sim.robot.spec; print('pydantic' in sys.modules, 'ruamel.yaml' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False False\n"
