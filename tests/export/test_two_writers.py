"""Exports of several processes into one folder, and what killed ones leave."""

from __future__ import annotations

import json
import os
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
