"""Files are written whole or not at all, alone or together."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from dh2sim.errors import OutputError
from dh2sim.files import atomic_file, atomic_files, partial_path, signals_deferred, write_file
from dh2sim.locks import FolderLock
from tests.program import contents

NEW = {"a.txt": b"new a", "meshes/b.txt": b"new b", "c.txt": b"new c"}


def _place(out: Path) -> None:
    with atomic_files(out, "arm") as staging:
        (staging / "meshes").mkdir()
        for name, data in NEW.items():
            (staging / name).write_bytes(data)


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
        f"cannot write '{target / 'c.txt'}': Is a directory; the existing files are unchanged"
    )
    after = (target / "a.txt").stat()
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert contents(tmp_path) == {"arm/a.txt": b"old a"}
    assert not (target / "meshes").exists()


def test_files_that_cannot_be_written_are_an_error_and_change_nothing(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with pytest.raises(OutputError) as caught, atomic_files(out, "arm") as staging:
        (staging / "missing" / "a.txt").write_bytes(b"new a")
    assert str(caught.value) == f"cannot write to '{out}': No such file or directory; nothing was changed"
    assert list(tmp_path.iterdir()) == []


def test_a_link_that_existed_is_put_back_as_a_link(tmp_path: Path) -> None:
    target = tmp_path / "arm"
    (target / "c.txt").mkdir(parents=True)
    (tmp_path / "elsewhere.txt").write_bytes(b"old a")
    (target / "a.txt").symlink_to(tmp_path / "elsewhere.txt")
    with pytest.raises(OutputError):
        _place(tmp_path)
    assert (target / "a.txt").readlink() == tmp_path / "elsewhere.txt"
    assert (tmp_path / "elsewhere.txt").read_bytes() == b"old a"


def test_a_file_replaces_another_only_when_it_is_whole(tmp_path: Path) -> None:
    out = tmp_path / "a.png"
    with atomic_file(out) as temporary:
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".png"
        temporary.write_bytes(b"new")
        assert not out.exists()
    assert out.read_bytes() == b"new"
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
    before = os.umask(0o027)
    try:
        with atomic_file(out):
            pass
    finally:
        os.umask(before)
    assert out.stat().st_mode & 0o777 == 0o640, "readable like any other new file"


def test_a_link_stays_and_the_file_that_it_names_is_written(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    link, target = tmp_path / "picture.png", tmp_path / "elsewhere" / "object"
    link.symlink_to(target)
    for data in (b"first", b"second"):  # a link to nothing at first
        with atomic_file(link) as draft:
            assert (draft.parent, draft.suffix) == (target.parent, ".png")
            draft.write_bytes(data)
        assert contents(tmp_path) == {"picture.png": data, "elsewhere/object": data}
        assert link.is_symlink()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names here")
def test_devices_and_pipes_are_not_replaced(tmp_path: Path) -> None:
    pipe, link = tmp_path / "pipe.csv", tmp_path / "link.csv"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link, Path(os.devnull)):
        with pytest.raises(OutputError, match="that is a device or a pipe, not a file"), atomic_file(path):
            pytest.fail("it may not be written")
    assert pipe.is_fifo()
    assert link.is_symlink()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["link.csv", "pipe.csv"]


def test_paths_that_no_file_can_have_are_refused(tmp_path: Path) -> None:
    for out, reported in (
        (tmp_path / "no" / "a.png", f"there is no folder '{tmp_path / 'no'}'"),
        (tmp_path, "that is a folder"),
    ):
        with pytest.raises(OutputError) as caught, atomic_file(out):
            pass
        assert str(caught.value) == f"cannot write '{out}': {reported}"
    assert list(tmp_path.iterdir()) == []


def test_a_file_whose_writer_fails_leaves_the_old_one(tmp_path: Path) -> None:
    out = tmp_path / "a.txt"
    out.write_bytes(b"old")

    def write() -> None:
        with atomic_file(out) as temporary:
            temporary.write_bytes(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write()
    assert contents(tmp_path) == {"a.txt": b"old"}


def test_bytes_are_written_under_another_name_first(tmp_path: Path) -> None:
    write_file(tmp_path / "a", b"new ", b"bytes")
    assert contents(tmp_path) == {"a": b"new bytes"}
    (tmp_path / "folder").mkdir()
    with pytest.raises(IsADirectoryError):
        write_file(tmp_path / "folder", b"data")
    assert partial_path(tmp_path / "folder").read_bytes() == b"data"


def test_a_signal_is_delivered_after_the_block(tmp_path: Path) -> None:
    done = []

    def interrupted() -> None:
        with signals_deferred():
            signal.raise_signal(signal.SIGINT)
            done.append("the rest of the block")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert done == ["the rest of the block"]


def test_a_folder_is_locked_once_until_the_lock_is_released(tmp_path: Path) -> None:
    lock = FolderLock(tmp_path)
    with pytest.raises(BlockingIOError):
        FolderLock(tmp_path)
    lock.release()
    again = FolderLock(tmp_path)
    assert again.effective
    again.release()


def test_a_lock_knows_whether_its_folder_was_replaced(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    lock = FolderLock(tmp_path / "run")
    assert lock.holds(tmp_path / "run")
    (tmp_path / "run").rename(tmp_path / "old")
    assert not lock.holds(tmp_path / "run")
    (tmp_path / "run").mkdir()
    assert not lock.holds(tmp_path / "run")
    lock.release()
