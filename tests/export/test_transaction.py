from __future__ import annotations

from pathlib import Path

from tests.program import Outcome, contents, dh2sim, shell
from tests.robot_files import small, write


def test_a_file_where_a_folder_is_needed_is_reported(tmp_path: Path) -> None:
    robot = write(tmp_path, small())
    blocked = tmp_path / "file"
    blocked.write_bytes(b"mine")
    assert dh2sim("export", robot, "--out", blocked) == Outcome(
        status=2, out="", err=f"dh2sim: cannot write to '{blocked}': Not a directory; nothing was changed\n"
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
        err=f"dh2sim: cannot write '{tmp_path / 'made' / 'small'}': Not a directory; "
        "the existing files are unchanged\n",
    )
    assert contents(tmp_path / "made") == {"small": b"mine"}


def test_robots_that_were_exported_before_an_error_are_named(tmp_path: Path) -> None:
    robots = [write(tmp_path, small(name), name) for name in "abcd"]
    out = tmp_path / "made"
    out.mkdir()
    (out / "c").write_bytes(b"mine")
    run = dh2sim("export", *robots, "--out", out)
    assert run.status == 2
    assert run.err == (
        f"dh2sim: c: cannot write '{out / 'c'}': Not a directory; the existing files are unchanged\n"
        "dh2sim: exported before it: a, b; not exported: c, d\n"
    )
    assert {path.name for path in out.iterdir()} == {"a", "b", "c"}


def test_a_folder_at_a_files_name_is_reported_and_old_files_stay(tmp_path: Path) -> None:
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
        err=f"dh2sim: cannot write '{path}': Is a directory; the existing files are unchanged\n",
    )
    assert contents(out) == before


def test_a_disk_that_takes_no_more_leaves_old_files_untouched(tmp_path: Path) -> None:
    robot, out = write(tmp_path, small()), tmp_path / "made"
    dh2sim("export", robot, "--out", out)
    before = contents(out)
    write(tmp_path, small(length=0.5))
    script = 'ulimit -f 4 && exec "$PYTHON" -m dh2sim export "$ROBOT" --out "$OUT"'  # files of 2 or 4 KiB at most
    run = shell(script, ROBOT=str(robot), OUT=str(out))
    assert run == Outcome(
        status=2, out="", err=f"dh2sim: cannot write to '{out}': File too large; nothing was changed\n"
    )
    assert contents(out) == before
    run = shell(script, ROBOT=str(robot), OUT=str(tmp_path / "fresh" / "deep"))
    assert run.status == 2
    assert not (tmp_path / "fresh").exists()


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
    run = shell(script, OUT=str(out), FIRST=str(first), SECOND=str(second), BEFORE=str(before), AFTER=str(after))
    assert run == Outcome(
        status=2, out="", err=f"dh2sim: cannot write to '{out}': No space left on device; nothing was changed\n"
    )
    assert set(contents(before)) == {"full", "small/small.urdf", "small/small.xml", "small/scene.xml"}
    assert contents(before) == contents(after)


def test_a_file_system_that_is_only_read_is_reported(tmp_path: Path, own_mounts: str) -> None:
    out = tmp_path / "disk"
    out.mkdir()
    script = f"""{own_mounts} sh -c '
        mount -t tmpfs -o ro none "$OUT" || exit 99
        exec "$PYTHON" -m dh2sim export "$ROBOT" --out "$OUT"'"""
    assert shell(script, OUT=str(out), ROBOT=str(write(tmp_path, small()))) == Outcome(
        status=2, out="", err=f"dh2sim: cannot write to '{out}': Read-only file system; nothing was changed\n"
    )
