from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from tests.program import Outcome, contents, dh2sim
from tests.robot_files import small, write

ADVICE = "dh2sim: some files are not what the robot files say; write them with 'dh2sim export'\n"


@pytest.fixture
def exported(tmp_path: Path) -> Path:
    """A folder that holds robot.yaml and its export in made/."""
    assert dh2sim("export", write(tmp_path, small(), "robot"), "--out", tmp_path / "made").status == 0
    return tmp_path


def _check(folder: Path, *options: str) -> Outcome:
    before = contents(folder)
    run = dh2sim("export", folder / "robot.yaml", "--out", folder / "made", "--check", *options)
    assert contents(folder) == before, "a check writes nothing"
    return run


def test_files_that_are_current_pass(exported: Path) -> None:
    assert _check(exported) == Outcome(status=0, out="small: up to date\n", err="")


def test_an_export_and_a_check_are_printed_as_json(exported: Path) -> None:
    made = exported / "made" / "small"
    [robot] = json.loads(dh2sim("export", exported / "robot.yaml", "--out", exported / "made", "--json").out)[
        "robots"
    ]
    assert robot["name"] == "small"
    assert [file["path"] for file in robot["files"]] == [
        str(made / n) for n in ("small.urdf", "small.xml", "scene.xml")
    ]
    assert not any(file["changed"] for file in robot["files"])
    assert {each["format"] for each in robot["verified"]} == {"urdf", "mjcf"}
    assert all(each["max_position_error"] < 1e-14 for each in robot["verified"])
    assert json.loads(_check(exported, "--json").out) == {
        "ok": True, "robots": [{"name": "small", "ok": True, "drift": []}]
    }  # fmt: skip
    (made / "scene.xml").unlink()
    found = _check(exported, "--json")
    drift = [{"path": str(made / "scene.xml"), "what": "missing"}]
    assert (found.status, found.err) == (1, "")
    assert json.loads(found.out) == {"ok": False, "robots": [{"name": "small", "ok": False, "drift": drift}]}


@pytest.mark.parametrize("name", ["small.urdf", "small.xml", "scene.xml"])
def test_a_changed_byte_is_found_in_its_file_and_line(exported: Path, name: str) -> None:
    path = exported / "made" / "small" / name
    lines = path.read_bytes().splitlines(keepends=True)
    lines[9] = lines[9].replace(b"e", b"E", 1)
    path.write_bytes(b"".join(lines))
    assert _check(exported) == Outcome(status=1, out=f"small: {path}: differs from line 10\n", err=ADVICE)


def test_a_file_cut_short_is_found(exported: Path) -> None:
    path = exported / "made" / "small" / "small.xml"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:7]))
    assert _check(exported) == Outcome(status=1, out=f"small: {path}: differs from line 8\n", err=ADVICE)


def test_line_ends_that_were_converted_are_found(exported: Path) -> None:
    path = exported / "made" / "small" / "small.urdf"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert _check(exported) == Outcome(status=1, out=f"small: {path}: differs in its line ends\n", err=ADVICE)


def test_a_missing_file_is_found(exported: Path) -> None:
    path = exported / "made" / "small" / "scene.xml"
    path.unlink()
    assert _check(exported) == Outcome(status=1, out=f"small: {path}: missing\n", err=ADVICE)


def test_what_cannot_be_read_is_distinguished_from_what_is_missing(exported: Path) -> None:
    path = exported / "made" / "small" / "scene.xml"
    path.unlink()
    path.mkdir()
    assert _check(exported) == Outcome(status=1, out=f"small: {path}: unreadable: Is a directory\n", err=ADVICE)


def test_a_robot_never_exported_misses_all_its_files(exported: Path) -> None:
    (exported / "made").rename(exported / "away")
    folder = exported / "made" / "small"
    assert _check(exported) == Outcome(
        status=1,
        out="".join(f"small: {folder / name}: missing\n" for name in ("small.urdf", "small.xml", "scene.xml")),
        err=ADVICE,
    )


def test_a_changed_robot_file_makes_all_its_files_differ(exported: Path) -> None:
    write(exported, small(length=0.41), "robot")
    run = _check(exported)
    assert run.status == 1
    assert [line.rsplit(": ", 1)[1] for line in run.out.splitlines()] == [
        "differs from line 3",
        "differs from line 2",
        "differs from line 2",
    ]


def test_only_the_formats_asked_for_are_compared(exported: Path) -> None:
    (exported / "made" / "small" / "small.xml").unlink()
    assert _check(exported, "--format", "urdf") == Outcome(status=0, out="small: up to date\n", err="")
    assert _check(exported, "--format", "mjcf").status == 1


def test_a_urdf_with_dh_frames_is_not_one_without(exported: Path) -> None:
    path = exported / "made" / "small" / "small.urdf"
    run = _check(exported, "--no-dh-frames")
    assert run.status == 1
    assert run.out.startswith(f"small: {path}: differs from line ")
    assert run.out.count("\n") == 1


@pytest.mark.parametrize("old", ["small.urdf", "small.xml", "scene.xml"])
def test_files_of_different_exports_are_noticed_in_one_folder(exported: Path, old: str) -> None:
    folder = exported / "made" / "small"
    kept, before = (folder / old).read_bytes(), hashlib.sha256((exported / "robot.yaml").read_bytes()).hexdigest()
    robot = write(exported, small(length=0.5), "robot")
    assert dh2sim("export", robot, "--out", exported / "made").status == 0
    (folder / old).write_bytes(kept)
    after = hashlib.sha256(robot.read_bytes()).hexdigest()
    others = [name for name in ("small.urdf", "small.xml", "scene.xml") if name != old]
    parts = [
        f"{', '.join(others)} from robot.yaml (SHA-256 {after[:12]}…)",
        f"{old} from robot.yaml (SHA-256 {before[:12]}…)",
    ]
    if old == "small.urdf":
        parts.reverse()
    run = _check(exported)
    assert (run.status, run.err) == (1, ADVICE)
    assert run.out.splitlines()[1:] == [f"small: {folder}: contains files of different exports: {'; '.join(parts)}"]
    alone = "mjcf" if old == "small.urdf" else "urdf"
    assert _check(exported, "--format", alone).status == 0


def test_files_that_no_export_wrote_are_of_no_export(exported: Path) -> None:
    path = exported / "made" / "small" / "small.urdf"
    path.write_bytes(b"<robot name='small'/>\n")
    assert "different exports" not in _check(exported).out
