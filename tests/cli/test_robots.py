"""How a robot is named on the command line, and what is said of files that are wrong."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

import pytest

from dh2sim.robot.catalog import builtin_mechanisms, builtin_robots
from tests.program import Outcome, dh2sim
from tests.robot_files import small, write

COMMANDS = ("export", "validate", "fk", "info")
NAMES = [*builtin_robots(), *builtin_mechanisms()]
KNOWN = f"'dh2sim list' lists the {len(NAMES)} robots that come with dh2sim, such as {', '.join(NAMES[:3])}"


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("name", "hint"),
    [("stanfrd", " Did you mean 'stanford'?"), ("stanfrd.yaml", " Did you mean 'stanford'?"), ("xyzzy", "")],
)
def test_a_robot_that_is_unknown_is_reported_with_those_that_are(command: str, name: str, hint: str) -> None:
    message = f"dh2sim: no file or robot named '{name}'.{hint} {KNOWN}\n"
    assert dh2sim(command, name) == Outcome(status=2, out="", err=message)


def test_a_built_in_robot_is_named_with_and_without_its_ending() -> None:
    assert dh2sim("fk", "stanford") == dh2sim("fk", "stanford.yaml")


@pytest.mark.parametrize("name", ["stanford", "stanford.yaml"])
def test_a_path_that_exists_wins_over_a_built_in_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(write(tmp_path, small("mine")), tmp_path / name)
    run = dh2sim("fk", name)
    assert run.status == 0
    assert run.out.startswith("mine: pose of tool0 in base_link\n")


def test_a_robot_file_named_without_its_ending_is_offered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path, small("mine"), "mine")
    run = dh2sim("fk", "mine", "home")
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith("dh2sim: no file or robot named 'mine'. Did you mean 'mine.yaml'? ")


def test_two_robots_of_one_name_are_refused(tmp_path: Path) -> None:
    left, right = write(tmp_path, small("arm"), "left"), write(tmp_path, small("arm"), "right")
    message = f"{left} and {right}: both robots are named 'arm', but each needs a folder of its own name"
    for command in ("export", "validate"):
        run = dh2sim(command, left, "stanford", right)
        assert run == Outcome(status=2, out="", err=f"dh2sim: {message}\n")
    assert {path.name for path in tmp_path.iterdir()} == {"left.yaml", "right.yaml"}


WRONG = """\
name: wrong
convention: standrad
joints:
  - {type: revolute, alfa: 1}
  - {type: revolute, a: two}
"""
PROBLEMS = (
    "2:13: convention: expected one of standard, modified, found 'standrad'. Did you mean 'standard'?",
    "4:22: joints[0]: unknown key 'alfa'. Did you mean 'alpha'?",
    "5:25: joints[1].a: unknown name 'two'.",
)


def _places(text: str) -> list[str]:
    return [":".join(line.split(":")[:3]) for line in text.splitlines()]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_error_of_a_file_is_reported_with_its_place(tmp_path: Path, command: str) -> None:
    file = write(tmp_path, WRONG)
    run = dh2sim(command, file)
    assert (run.status, run.out) == (2, "")
    assert _places(run.err) == [f"{file}:{':'.join(problem.split(':')[:2])}" for problem in PROBLEMS]
    assert [line.split(": ")[1] for line in run.err.splitlines()] == ["convention", "joints[0]", "joints[1].a"]


@pytest.mark.parametrize("command", ["export", "validate"])
def test_all_wrong_files_are_reported_at_once(tmp_path: Path, command: str) -> None:
    files = [write(tmp_path, WRONG, name) for name in ("first", "second")]
    run = dh2sim(command, files[0], "xyzzy", files[1], "stanford")
    assert (run.status, run.out) == (2, "")
    lines = run.err.splitlines()
    assert [line.split(":")[0] for line in lines] == [str(files[0])] * 3 + ["dh2sim"] + [str(files[1])] * 3


def test_meshes_of_all_robots_that_cannot_be_used_are_reported_at_once(tmp_path: Path) -> None:
    (tmp_path / "broken.stl").write_bytes(b"no mesh")
    files = [
        write(tmp_path, small(name).replace("alpha: 0.651,", "alpha: 0.651, link: {mesh: {file: broken.stl}},"))
        for name in ("left", "right")
    ]
    run = dh2sim("export", *files, "--out", tmp_path / "made")
    assert (run.status, run.out) == (2, "")
    places = [line.split(":")[:4] for line in run.err.splitlines()]
    assert places == [[str(file), "4", places[0][2], " joints[0].link.mesh.file"] for file in files]
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("data", "what"),
    [(b"", "1:1"), (b"\xff\xfe\xfa", "1:1"), (b"[1, 2]", "1:1"), (b"a: [", ""), (b"\x00\x01", "")],
)
def test_a_file_that_is_no_robot_file_makes_no_traceback(tmp_path: Path, data: bytes, what: str) -> None:
    file = tmp_path / "file.yaml"
    file.write_bytes(data)
    run = dh2sim("info", file)
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith(f"{file}:{what}")


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("arm.urdf", '<?xml version="1.0"?>\n<!-- an arm -->\n<robot name="arm"/>', "a URDF"),
        ("arm.txt", '\ufeff<robot name="arm"/>', "a URDF"),
        ("arm.urdf", "<damaged", "a URDF"),
        ("arm.xml", "<mujoco model='arm'/>", "an MJCF"),
        ("arm.yaml", "<mujocoinclude/>", "an MJCF"),
        ("arm.xml", "<sdf/>", "XML"),
        ("my table.csv", "a,alpha,d,theta", "a CSV table"),
        ("arm.tsv", "", "a TSV table"),
        ("arm.md", "# Arm\n", "a Markdown table"),
        ("arm.yaml", "\n| a | alpha |\n", "a Markdown table"),
        ("arm.txt", "a\talpha\td\ttheta\n", "a table"),
    ],
)
def test_a_file_of_another_format_is_to_be_imported_first(tmp_path: Path, name: str, text: str, kind: str) -> None:
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    made = shlex.quote(f"{file.stem}_imported.yaml" if name == f"{file.stem}.yaml" else f"{file.stem}.yaml")
    message = (
        f"{file}: this is {kind}, not a robot file: run 'dh2sim import {shlex.quote(str(file))} -o {made}' first"
    )
    for command in (*COMMANDS, "jacobian", "view"):
        assert dh2sim(command, file) == Outcome(status=2, out="", err=f"dh2sim: {message}\n")
    assert dh2sim("convert", file, "--to", "modified").err == f"dh2sim: {message}\n"
    assert dh2sim("rollout", file, "--out", tmp_path / "run.zarr").err == f"dh2sim: {message}\n"


def test_a_file_that_cannot_be_read_is_reported(tmp_path: Path) -> None:
    link = tmp_path / "loop.yaml"
    link.symlink_to(link)
    run = dh2sim("info", link)
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith(f"dh2sim: {link}: cannot be read: ")
    run = dh2sim("info", tmp_path)
    assert (run.status, run.err) == (2, f"dh2sim: {tmp_path}: is a folder, not a robot file\n")
