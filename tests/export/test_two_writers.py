"""Exports of several processes into one folder, and what killed ones leave."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dh2sim import build_model, parse_robot
from dh2sim.export import export_robot
from dh2sim.files import PARTIAL
from dh2sim.locks import FolderLock
from tests.program import contents, dh2sim, environment
from tests.robot_files import small, write

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and locks on folders")
ROOT = Path(__file__).resolve().parents[2]


def campaign(name: str, count: int) -> dict[str, int]:
    """Run a campaign in a process of its own, and return what it found."""
    command = [sys.executable, "-m", "tests.export.campaigns", name, str(count)]
    run = subprocess.run(
        command, cwd=ROOT, env=environment(), capture_output=True, text=True, check=False, timeout=600
    )
    assert run.returncode == 0, run.stderr
    found: dict[str, int] = json.loads(run.stdout)
    return found


@pytest.mark.parametrize("count", [20, pytest.param(150, marks=pytest.mark.slow)])
def test_a_killed_export_is_finished_by_the_next_look_and_leaves_nothing(count: int) -> None:
    found = campaign("kills", count)
    assert {*found} <= {"mixed at first", "left something"}
    assert found["left something"] > 0, "kills must have hit exports at work"


@pytest.mark.parametrize("count", [10, pytest.param(60, marks=pytest.mark.slow)])
def test_two_exports_to_one_folder_never_mix(count: int) -> None:
    assert campaign("pairs", count) == {}


def test_what_was_being_moved_is_moved_by_validate_and_by_the_next_export(tmp_path: Path) -> None:
    old, new = (build_model(parse_robot(small(length=length))) for length in (0.4, 0.5))
    export_robot(new, tmp_path / "new")
    wanted = contents(tmp_path / "new" / "small")
    robot = write(tmp_path, small(length=0.5))
    looks: tuple[list[str | Path], ...] = (
        ["validate", robot, "--dir", tmp_path / "made", "--samples", "2"],
        ["export", robot, "--out", tmp_path / "made", "--check"],
        ["export", robot, "--out", tmp_path / "made"],
    )
    for look in looks:
        export_robot(old, tmp_path / "made")
        hidden = tmp_path / "made" / f".small-0123abcd{PARTIAL}"
        (hidden / "new").mkdir(parents=True)
        for name, data in wanted.items():
            (hidden / "new" / name).write_bytes(data)
        (hidden / "journal").write_text(json.dumps({"take": "new", "files": sorted(wanted)}))
        (hidden / "new" / "scene.xml").rename(tmp_path / "made" / "small" / "scene.xml")  # and then it was killed
        dh2sim(*look)
        stands = contents(tmp_path / "made")
        if look[0] != "export" or "--check" in look:
            assert stands == {f"small/{name}": data for name, data in wanted.items()}
        assert not hidden.exists()


def test_an_export_waits_for_another_or_fails_where_it_is_told_not_to(tmp_path: Path) -> None:
    robot, out = write(tmp_path, small()), tmp_path / "made"
    dh2sim("export", robot, "--out", out)
    before = contents(out)
    lock = FolderLock(out / "small")
    write(tmp_path, small(length=0.5))
    run = dh2sim("export", robot, "--out", out, "--no-wait")
    folder = out / "small"
    assert (run.status, run.out) == (2, "")
    assert run.err == f"dh2sim: another process is writing to '{folder}'; nothing was changed\n"
    assert contents(out) == before
    waiting = subprocess.Popen(
        [sys.executable, "-m", "dh2sim", "export", str(robot), "--out", str(out)],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert waiting.stderr is not None
    told = waiting.stderr.readline()
    assert told == f"dh2sim: waiting for another process that is writing to '{folder}'\n"
    assert contents(out / "small") == {name.removeprefix("small/"): data for name, data in before.items()}
    lock.release()
    assert waiting.communicate(timeout=180)[0].startswith(f"small: {folder}\n")
    assert waiting.returncode == 0
    assert contents(out) != before


def _forged(out: Path, journal: object) -> Path:
    """Leave a folder as a killed export does, with a journal that no export writes."""
    robot = build_model(parse_robot(small()))
    export_robot(robot, out / "made")
    hidden = out / "made" / f".small-0123abcd{PARTIAL}"
    (hidden / "new" / "sub").mkdir(parents=True)
    (hidden / "new" / "small.xml").write_text("forged")
    (hidden / "journal").write_text(journal if isinstance(journal, str) else json.dumps(journal))
    return hidden


@pytest.mark.parametrize(
    "journal",
    [
        {"take": "old", "files": ["../../victim"]},
        {"take": "new", "files": ["../../victim"]},
        {"take": "new/sub/..", "files": ["small.xml"]},
        {"take": "..", "files": ["small.xml"]},
        {"take": "old", "files": [str(ROOT / "no such file")]},
        {"take": "old", "files": ["sub/../../../victim"]},
        {"take": "old", "files": [""]},
        {"take": "old", "files": ["."]},
        {"take": "old", "files": [7]},
        {"take": "old", "files": "victim"},
        {"take": "new", "files": ["small.xml"], "folder": "/"},
        {"take": "new"},
        [],
        "[" * 100_000,
        "{",
    ],
)
def test_a_forged_journal_moves_and_removes_nothing(tmp_path: Path, journal: object) -> None:
    victim = tmp_path / "victim"
    victim.write_text("mine")
    _forged(tmp_path, journal)
    before = contents(tmp_path)
    robot = write(tmp_path, small())
    for words in (["--check"], []):
        run = dh2sim("export", robot, "--out", tmp_path / "made", *words)
        assert (run.status, run.err.count("\n")) == (2, 1)
        assert "cannot be moved: its journal " in run.err or "cannot be moved: " in run.err
    robot.unlink()
    assert contents(tmp_path) == before


@pytest.mark.parametrize("part", ["new", "new/sub", "target"])
def test_a_leftover_with_links_moves_nothing(tmp_path: Path, part: str) -> None:
    hidden = _forged(tmp_path, {"take": "new", "files": ["sub/key"]})
    elsewhere = tmp_path / "elsewhere"
    (elsewhere / "sub").mkdir(parents=True)
    for key in (elsewhere / "key", elsewhere / "sub" / "key"):
        key.write_text("mine")
    shutil.rmtree(hidden / "new")
    if part == "target":
        (hidden / "new" / "sub").mkdir(parents=True)
        (hidden / "new" / "sub" / "key").write_text("forged")
        (tmp_path / "made" / "small" / "sub").symlink_to(elsewhere)
    elif part == "new":
        (hidden / "new").symlink_to(elsewhere)
    else:
        (hidden / "new").mkdir()
        (hidden / "new" / "sub").symlink_to(elsewhere / "sub")
    run = dh2sim("export", write(tmp_path, small()), "--out", tmp_path / "made", "--check")
    assert (run.status, run.err.count("\n")) == (2, 1)
    assert "is a link, not a folder" in run.err or "not a plain" in run.err
    assert contents(elsewhere) == {"key": b"mine", "sub/key": b"mine"}
