from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from tests.program import contents, dh2sim, dh2sim_process
from tests.robot_files import ODD, RICH, small, write

ALL_FILES = ["odd.urdf", "odd.xml", "scene.xml"]


def test_two_runs_write_the_same_bytes_and_the_second_leaves_them_as_they_are(tmp_path: Path) -> None:
    robot, out = write(tmp_path, ODD), tmp_path / "made"
    assert dh2sim("export", robot, "--out", out).status == 0
    first = contents(out)
    assert sorted(first) == [f"odd/{name}" for name in ALL_FILES]
    again = dh2sim("export", robot, "--out", out)
    assert again.status == 0
    assert contents(out) == first
    assert again.out.count("unchanged") == len(ALL_FILES)


@pytest.mark.slow
@pytest.mark.parametrize(
    "variables",
    [
        {"PYTHONHASHSEED": "1"},
        {"PYTHONHASHSEED": "77"},
        {"LC_ALL": "C"},
        {"LC_ALL": "C", "PYTHONUTF8": "0"},
        {"TZ": "Asia/Tokyo"},
    ],
    ids=str,
)
def test_bytes_depend_on_nothing_around_the_program(tmp_path: Path, variables: dict[str, str]) -> None:
    robot = write(tmp_path, ODD)
    assert dh2sim("export", robot, "--out", tmp_path / "here").status == 0
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    run = dh2sim_process("export", os.path.relpath(robot, elsewhere), cwd=elsewhere, variables=variables)
    assert run.status == 0, run.err
    assert contents(elsewhere / "generated") == contents(tmp_path / "here")


@pytest.mark.parametrize("text", [ODD, RICH], ids=["odd", "rich"])
def test_every_file_names_its_source_and_its_hash(tmp_path: Path, text: str) -> None:
    robot = write(tmp_path, text, "source")
    assert dh2sim("export", robot, "--out", tmp_path / "made").status == 0
    digest = hashlib.sha256(robot.read_bytes()).hexdigest()
    for data in contents(tmp_path / "made").values():
        assert f"made by dh2sim from source.yaml (SHA-256 {digest})." in data.decode()
        assert str(tmp_path) not in data.decode(), "and nothing of where it lay"


def test_a_comment_in_the_robot_file_changes_the_header_and_nothing_else(tmp_path: Path) -> None:
    made = []
    for comment in ("# one\n", "# another\n"):
        robot = write(tmp_path, small() + comment, "robot")
        assert dh2sim("export", robot, "--out", tmp_path / "made").status == 0
        made.append({name: data.decode().splitlines() for name, data in contents(tmp_path / "made").items()})
    for name, lines in made[0].items():
        differing = [(a, b) for a, b in zip(lines, made[1][name], strict=True) if a != b]
        assert len(differing) == 1, name
        assert all("SHA-256" in line for line in differing[0])


def test_a_source_whose_name_is_no_text_is_named_as_far_as_it_is(tmp_path: Path) -> None:
    raw = os.fsencode(tmp_path) + b"/\xff.yaml"
    try:
        with open(raw, "wb") as file:
            file.write(small().encode())
    except OSError:
        pytest.skip("this file system refuses file names that are not UTF-8")
    run = dh2sim("export", os.fsdecode(raw), "--out", tmp_path / "made")
    assert run.status == 0, run.err
    for data in contents(tmp_path / "made").values():
        assert b".yaml (SHA-256" in data
        data.decode("utf-8")


@pytest.mark.parametrize(
    ("formats", "files"),
    [
        (["urdf"], ["odd.urdf"]),
        (["mjcf"], ["odd.xml", "scene.xml"]),
        (["urdf", "mjcf"], ALL_FILES),
        (["mjcf", "urdf", "mjcf"], ALL_FILES),
    ],
    ids=["urdf", "mjcf", "both", "one twice"],
)
def test_only_the_formats_asked_for_are_written(tmp_path: Path, formats: list[str], files: list[str]) -> None:
    options = [option for name in formats for option in ("--format", name)]
    run = dh2sim("export", write(tmp_path, ODD), "--out", tmp_path / "made", *options)
    assert run.status == 0
    assert sorted(contents(tmp_path / "made" / "odd")) == files


def test_a_format_that_there_is_not_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    run = dh2sim("export", write(tmp_path, ODD), "--out", tmp_path / "made", "--format", "sdf")
    assert run.status == 2
    assert run.out == ""
    assert "sdf" in run.err
    assert "urdf" in run.err
    assert "mjcf" in run.err
    assert not (tmp_path / "made").exists()


def test_dh_frames_can_be_left_out_of_the_urdf(tmp_path: Path) -> None:
    robot, out = write(tmp_path, ODD), tmp_path / "made"
    assert dh2sim("export", robot, "--out", out, "--no-dh-frames").status == 0
    bare = contents(out / "odd")
    assert b'"dh_' not in bare["odd.urdf"]
    assert b'<link name="tool0"' in bare["odd.urdf"]
    assert b'name="dh_5"' in bare["odd.xml"], "the MJCF keeps its sites"
    assert dh2sim("export", robot, "--out", out).status == 0
    assert b'<link name="dh_5"' in contents(out / "odd")["odd.urdf"]


def test_an_unverified_export_says_so_and_writes_the_same(tmp_path: Path) -> None:
    robot = write(tmp_path, ODD)
    assert dh2sim("export", robot, "--out", tmp_path / "verified").status == 0
    run = dh2sim("export", robot, "--out", tmp_path / "unverified", "--no-verify")
    assert run.status == 0
    assert run.out.count("not verified") == 2
    assert contents(tmp_path / "unverified") == contents(tmp_path / "verified")
