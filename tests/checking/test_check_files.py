from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from dh2sim import check_files
from dh2sim.checking.files import find_robot_files
from dh2sim.checking.findings import CheckReport
from dh2sim.errors import Dh2simError, UnknownRobotError
from dh2sim.export import export_robot
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from tests.robot_files import small, write


@pytest.fixture(autouse=True)
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two robots, of which the first one has its exports; it is the current one."""
    monkeypatch.chdir(tmp_path)
    robots = tmp_path / "robots"
    robots.mkdir()
    write(robots, small("first"))
    write(robots, small("second"))
    export_robot(build_model(load_robot(robots / "first.yaml")), tmp_path / "generated", verify=False)
    return tmp_path


def rules(report: CheckReport) -> list[str]:
    return [finding.rule for finding in report.findings]


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_robots_that_are_right_pass_with_and_without_exports() -> None:
    report = check_files(samples=5)
    assert (report.ok, report.failed, rules(report)) == (True, 0, [])
    assert [(robot.name, robot.exports) for robot in report.robots] == [
        ("first", "generated/first"),
        ("second", None),
    ]
    worst = report.robots[0].worst_error
    assert worst is not None
    assert 0.0 <= worst[0] < 1e-12


def test_all_errors_of_all_files_are_found_with_their_places(repository: Path) -> None:
    edit(repository / "robots/first.yaml", "convention: standard", "convention: standrd")
    edit(repository / "robots/second.yaml", "a: 0.3", "a: x")
    edit(repository / "robots/second.yaml", "alpha: 0.651", "alpha: y")
    report = check_files(parts=["files"])
    places = [(finding.file, finding.line, finding.path) for finding in report.findings]
    assert places == [
        ("robots/first.yaml", 2, "convention"),
        ("robots/second.yaml", 4, "joints[0].alpha"),
        ("robots/second.yaml", 5, "joints[1].a"),
    ]
    assert set(rules(report)) == {"robot-file"}


def test_a_likely_slip_is_a_finding(repository: Path) -> None:
    edit(repository / "robots/second.yaml", "alpha: 0.651", "alpha: 90")
    [finding] = check_files(parts=["files"]).findings
    assert (finding.rule, finding.level, finding.line) == ("degrees-in-rad", "warning", 4)


def test_an_export_that_was_edited_is_found_at_its_line_and_by_the_engines_that_read_it(repository: Path) -> None:
    exported = repository / "generated/first/first.xml"
    text = exported.read_text(encoding="utf-8")
    line = next(k for k, content in enumerate(text.splitlines(), 1) if 'pos="0.4 ' in content)
    exported.write_text(text.replace('pos="0.4 ', 'pos="0.41 ', 1), encoding="utf-8")
    report = check_files(samples=5)
    drifted, *engines = report.findings
    assert (drifted.rule, drifted.file, drifted.line) == ("drift", "generated/first/first.xml", line)
    assert {finding.rule for finding in engines} == {"engine"}
    assert all("mujoco-mjcf" in finding.message for finding in engines)
    assert report.failed == 1


def test_with_a_folder_named_every_robot_must_have_exports_in_it() -> None:
    report = check_files(exports="generated", parts=["drift"])
    assert {finding.file for finding in report.findings} == {
        f"generated/second/{name}" for name in ("second.urdf", "second.xml", "scene.xml")
    }
    assert all(finding.message.startswith("missing") for finding in report.findings)


def test_two_robots_of_one_name_clash_where_they_have_exports(repository: Path) -> None:
    write(repository / "robots", small("first"), name="copy")
    copy, first, _second = check_files(parts=["drift"]).robots
    assert {finding.rule for finding in copy.findings} == {"drift"}, "its exports name another file"
    [finding] = first.findings
    assert finding.rule == "name-clash"
    assert "'robots/copy.yaml'" in finding.message


def test_folders_are_searched_for_files_with_joints_right_or_wrong(repository: Path) -> None:
    (repository / "docs").mkdir()
    (repository / "docs/mkdocs.yml").write_text("site_name: joints\n")
    (repository / "docs/broken.yml").write_text("name: [\njoints:\n")
    (repository / ".hidden").mkdir()
    write(repository / ".hidden", small())
    (repository / "env").mkdir()
    (repository / "env/pyvenv.cfg").touch()
    write(repository / "env", small())
    found = find_robot_files([Path(), Path("robots/first.yaml")])
    assert [path.as_posix() for path in found] == ["docs/broken.yml", "robots/first.yaml", "robots/second.yaml"]


def test_a_path_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(UnknownRobotError, match="no file or folder named 'nowhere'"):
        check_files(["nowhere"])


def test_one_path_and_one_part_may_be_given_alone(repository: Path) -> None:
    report = check_files("robots/first.yaml", parts="files")
    assert [robot.file for robot in report.robots] == ["robots/first.yaml"]


# ---------------------------------------------------------------------------- changes


def git(*arguments: str) -> None:
    subprocess.run(
        ["git", "-c", "user.name=a", "-c", "user.email=a@example.org", *arguments], check=True, capture_output=True
    )


@pytest.fixture
def committed(repository: Path) -> Path:
    """The same folder as a repository of git."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    git("init", "-q", "-b", "main")
    git("add", "-A")
    git("commit", "-qm", "robots")
    return repository


@pytest.mark.parametrize("changed", ["robots/first.yaml", "generated/first/first.xml"])
def test_only_robots_that_changed_are_checked(committed: Path, changed: str) -> None:
    assert check_files(parts=["files"], changed_since="main").robots == ()
    with (committed / changed).open("a", encoding="utf-8") as file:
        file.write("\n")
    report = check_files(parts=["files"], changed_since="main")
    assert [robot.name for robot in report.robots] == ["first"]


def test_a_new_robot_and_one_whose_mesh_changed_are_checked(committed: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = committed / "robots/part.stl"
    trimesh.creation.box((0.1, 0.1, 0.1)).export(mesh)
    edit(committed / "robots/second.yaml", "a: 0.3,", "a: 0.3, link: {mesh: {file: part.stl}},")
    git("add", "-A")
    git("commit", "-qm", "mesh")
    write(committed / "robots", small("third"))
    mesh.write_bytes(mesh.read_bytes()[:-1])
    report = check_files(parts=["files"], changed_since="HEAD")
    assert [robot.file for robot in report.robots] == ["robots/second.yaml", "robots/third.yaml"]
    [finding] = report.findings
    assert (finding.rule, finding.file) == ("robot-file", "robots/second.yaml")
    assert "part.stl" in finding.message


def test_a_revision_that_git_does_not_know_is_an_error(committed: Path) -> None:
    with pytest.raises(Dh2simError, match="git knows no revision 'nowhere'"):
        check_files(changed_since="nowhere")
    with pytest.raises(Dh2simError, match="git knows no revision '--output=x'"):
        check_files(changed_since="--output=x")


def test_outside_a_repository_git_cannot_tell_what_changed(repository: Path) -> None:
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    with pytest.raises(Dh2simError, match="git cannot say what changed"):
        check_files(changed_since="main")
