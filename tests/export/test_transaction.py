from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dh2sim.errors import OutputError
from dh2sim.files import put_in_place, staged
from tests.export.robots import small, write
from tests.program import Outcome, contents, dh2sim, environment

NEW = {"a.txt": b"new a", "meshes/b.txt": b"new b", "c.txt": b"new c"}


def _place(out: Path) -> None:
    with staged(out, "arm", NEW) as folder:
        put_in_place(folder, out / "arm", NEW)


def test_files_are_put_in_place_and_nothing_else_is_left(tmp_path: Path) -> None:
    _place(tmp_path / "deep" / "out")
    assert contents(tmp_path) == {f"deep/out/arm/{name}": data for name, data in NEW.items()}


def test_other_files_in_the_folder_stay(tmp_path: Path) -> None:
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "notes.txt").write_bytes(b"mine")
    _place(tmp_path)
    assert contents(tmp_path / "arm") == {**NEW, "notes.txt": b"mine"}


def test_files_placed_before_one_that_cannot_be_are_put_back(tmp_path: Path) -> None:
    target = tmp_path / "arm"
    (target / "c.txt").mkdir(parents=True)
    (target / "a.txt").write_bytes(b"old a")
    before = (target / "a.txt").stat()
    with pytest.raises(OutputError) as caught:
        _place(tmp_path)
    assert str(caught.value) == (
        f"cannot write '{target / 'c.txt'}': Is a directory; the files that stood there are unchanged"
    )
    after = (target / "a.txt").stat()
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert contents(tmp_path) == {"arm/a.txt": b"old a"}
    assert not (target / "meshes").exists()


def test_files_that_vanish_from_the_staging_folder_are_an_error_and_the_others_are_put_back(
    tmp_path: Path,
) -> None:
    target = tmp_path / "arm"
    target.mkdir()
    (target / "a.txt").write_bytes(b"old a")
    with staged(tmp_path, "arm", NEW) as folder:
        (folder / "c.txt").unlink()
        with pytest.raises(OutputError):
            put_in_place(folder, target, NEW)
    assert contents(tmp_path) == {"arm/a.txt": b"old a"}


def test_a_link_that_stood_there_is_put_back_as_a_link(tmp_path: Path) -> None:
    target = tmp_path / "arm"
    (target / "c.txt").mkdir(parents=True)
    (tmp_path / "elsewhere.txt").write_bytes(b"old a")
    (target / "a.txt").symlink_to(tmp_path / "elsewhere.txt")
    with pytest.raises(OutputError):
        _place(tmp_path)
    assert (target / "a.txt").readlink() == tmp_path / "elsewhere.txt"
    assert (tmp_path / "elsewhere.txt").read_bytes() == b"old a"


def test_a_file_where_a_folder_is_needed_is_told(tmp_path: Path) -> None:
    robot = write(tmp_path, small())
    blocked = tmp_path / "file"
    blocked.write_bytes(b"mine")
    assert dh2sim("export", robot, "--out", blocked) == Outcome(
        status=2, out="", err=f"dh2sim: cannot write to '{blocked}': File exists; nothing was changed\n"
    )
    assert dh2sim("export", robot, "--out", blocked / "deeper") == Outcome(
        status=2,
        out="",
        err=f"dh2sim: cannot write to '{blocked / 'deeper'}': Not a directory; nothing was changed\n",
    )
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "small").write_bytes(b"mine")
    assert dh2sim("export", robot, "--out", tmp_path / "made") == Outcome(
        status=2,
        out="",
        err=f"dh2sim: cannot write '{tmp_path / 'made' / 'small'}': File exists; the files that stood there are "
        "unchanged\n",
    )
    assert contents(tmp_path / "made") == {"small": b"mine"}


def test_a_folder_at_a_files_name_is_told_and_old_files_stay(tmp_path: Path) -> None:
    robot, out = write(tmp_path, small()), tmp_path / "made"
    dh2sim("export", robot, "--out", out)
    (out / "small" / "scene.xml").unlink()
    (out / "small" / "scene.xml").mkdir()
    before = contents(out)
    write(tmp_path, small(length=0.5))
    run = dh2sim("export", robot, "--out", out)
    path = out / "small" / "scene.xml"
    assert run == Outcome(
        status=2,
        out="",
        err=f"dh2sim: cannot write '{path}': Is a directory; the files that stood there are unchanged\n",
    )
    assert contents(out) == before


def _shell(script: str, **variables: str) -> Outcome:
    done = subprocess.run(
        ["sh", "-c", script],
        env=environment(PYTHON=sys.executable, **variables),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    return Outcome(status=done.returncode, out=done.stdout, err=done.stderr)


def test_a_disk_that_takes_no_more_leaves_old_files_untouched(tmp_path: Path) -> None:
    robot, out = write(tmp_path, small()), tmp_path / "made"
    dh2sim("export", robot, "--out", out)
    before = contents(out)
    write(tmp_path, small(length=0.5))
    script = 'ulimit -f 4 && exec "$PYTHON" -m dh2sim export "$ROBOT" --out "$OUT"'  # files of 2 or 4 KiB at most
    run = _shell(script, ROBOT=str(robot), OUT=str(out))
    assert run == Outcome(
        status=2, out="", err=f"dh2sim: cannot write to '{out}': File too large; nothing was changed\n"
    )
    assert contents(out) == before
    run = _shell(script, ROBOT=str(robot), OUT=str(tmp_path / "fresh" / "deep"))
    assert run.status == 2
    assert not (tmp_path / "fresh").exists()


@pytest.fixture(scope="module")
def own_mounts(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The command that runs another with mounts of its own; skips where that is not allowed."""
    command = "unshare -m" if os.geteuid() == 0 else "unshare -rm"
    probe = f"""{command} sh -c 'mount -t tmpfs -o size=16k none "$OUT"'"""
    if shutil.which("unshare") is None or _shell(probe, OUT=str(tmp_path_factory.mktemp("probe"))).status != 0:
        pytest.skip("needs the right to mount a small file system (unshare and mount)")
    return command


def test_a_full_file_system_leaves_old_files_untouched(tmp_path: Path, own_mounts: str) -> None:
    first = write(tmp_path, small(), "first")
    second = write(tmp_path, small(length=0.5), "second")
    out = tmp_path / "disk"
    out.mkdir()
    script = f"""{own_mounts} sh -c '
        mount -t tmpfs -o size=1m none "$OUT" || exit 99
        "$PYTHON" -m dh2sim export "$FIRST" --out "$OUT" >/dev/null || exit 98
        cat /dev/zero >"$OUT/full" 2>/dev/null
        cp -r "$OUT" "$BEFORE"
        "$PYTHON" -m dh2sim export "$SECOND" --out "$OUT"
        status=$?
        cp -r "$OUT" "$AFTER"
        exit $status'"""
    before, after = tmp_path / "before", tmp_path / "after"
    run = _shell(script, OUT=str(out), FIRST=str(first), SECOND=str(second), BEFORE=str(before), AFTER=str(after))
    assert run == Outcome(
        status=2, out="", err=f"dh2sim: cannot write to '{out}': No space left on device; nothing was changed\n"
    )
    assert set(contents(before)) == {"full", "small/small.urdf", "small/small.xml", "small/scene.xml"}
    assert contents(before) == contents(after)


def test_a_file_system_that_is_only_read_is_told(tmp_path: Path, own_mounts: str) -> None:
    out = tmp_path / "disk"
    out.mkdir()
    script = f"""{own_mounts} sh -c '
        mount -t tmpfs -o ro none "$OUT" || exit 99
        exec "$PYTHON" -m dh2sim export "$ROBOT" --out "$OUT"'"""
    assert _shell(script, OUT=str(out), ROBOT=str(write(tmp_path, small()))) == Outcome(
        status=2, out="", err=f"dh2sim: cannot write to '{out}': Read-only file system; nothing was changed\n"
    )
