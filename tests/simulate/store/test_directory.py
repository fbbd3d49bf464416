from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import zarr

from dh2sim.errors import RunBusyError, RunError, RunExistsError, RunOutputError
from dh2sim.simulate.store.writer import RunWriter
from tests.program import contents, environment
from tests.simulate.store.runs import SECONDS, block_of, copy, finish, lasting, layout, make, resume

HOLD = """
import sys, time
from pathlib import Path
from tests.simulate.store.runs import layout
from dh2sim.simulate.store.writer import RunWriter
with RunWriter.resume(Path(sys.argv[1]), layout()):
    print("locked", flush=True)
    time.sleep(60)
"""


def test_a_run_that_exists_is_not_touched(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    before = contents(tmp_path)
    with pytest.raises(RunExistsError) as caught:
        RunWriter.create(path, layout(settings={"seed": 1}))
    assert str(caught.value) == f"'{path}' already exists; resume it, overwrite it, or choose another folder"
    assert contents(tmp_path) == before


def test_overwriting_puts_a_new_run_in_place_of_the_old_one(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout(settings={"seed": 1}))
    (path / "note.txt").write_text("of the old run")
    with RunWriter.create(path, layout(), overwrite=True) as writer:
        assert finish(writer) == (0, 1, 2)
    assert lasting(path) == lasting(make(tmp_path / "other.zarr", layout()))
    assert sorted(os.listdir(tmp_path)) == ["other.zarr", "run.zarr"]


def test_a_damaged_run_can_be_overwritten(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    (path / "zarr.json").write_bytes(b"")
    with RunWriter.create(path, layout(), overwrite=True) as writer:
        assert writer.pending() == (0, 1, 2)


def _folder(path: Path) -> None:
    path.mkdir()
    (path / "thesis.txt").write_text("years of work")


def _file(path: Path) -> None:
    path.write_text("years of work")


def _other_zarr(path: Path) -> None:
    zarr.create_group(path, attributes={"of": "somebody else"})


@pytest.mark.parametrize("make_it", [_folder, _file, _other_zarr])
def test_what_is_no_run_is_never_replaced(tmp_path: Path, make_it: Callable[[Path], None]) -> None:
    path = tmp_path / "run.zarr"
    make_it(path)
    before = contents(tmp_path)
    reported = f"'{path}' is not a run of dh2sim"
    for overwrite in (False, True):
        with pytest.raises(RunExistsError) as caught:
            RunWriter.create(path, layout(), overwrite=overwrite)
        assert str(caught.value) == f"{reported}; remove it yourself, or choose another folder"
    with pytest.raises(RunError) as refused:
        RunWriter.resume(path, layout())
    assert str(refused.value) == reported
    assert contents(tmp_path) == before


def test_an_empty_folder_is_as_good_as_none(tmp_path: Path) -> None:
    for name in ("created.zarr", "resumed.zarr"):
        (tmp_path / name).mkdir()
    assert lasting(make(tmp_path / "created.zarr", layout())) == lasting(make(tmp_path / "run.zarr", layout()))
    assert resume(tmp_path / "resumed.zarr", layout()) == (0, 1, 2)


def test_resuming_what_does_not_exist_makes_it(tmp_path: Path) -> None:
    assert resume(tmp_path / "new" / "folder" / "run.zarr", layout()) == (0, 1, 2)
    assert lasting(tmp_path / "new" / "folder" / "run.zarr") == lasting(make(tmp_path / "run.zarr", layout()))


def test_a_symbolic_link_stays_one(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "run.zarr").symlink_to(tmp_path / "disk" / "run.zarr")
    make(tmp_path / "run.zarr", layout())
    with RunWriter.create(tmp_path / "run.zarr", layout(), overwrite=True) as writer:
        finish(writer)
    assert resume(tmp_path / "run.zarr", layout()) == ()
    assert (tmp_path / "run.zarr").is_symlink()
    assert os.listdir(tmp_path / "disk") == ["run.zarr"]


def test_a_run_has_the_permissions_that_files_have_here(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    (tmp_path / "folder").mkdir()
    assert path.stat().st_mode == (tmp_path / "folder").stat().st_mode


def test_there_is_one_writer_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    reported = f"another process is writing to '{path}'"
    with RunWriter.create(path, layout()) as first:
        first.write(0, block_of(layout(), 0), SECONDS)
        with pytest.raises(RunBusyError) as caught:
            RunWriter.resume(path, layout())
        assert str(caught.value) == reported
        with pytest.raises(RunBusyError) as caught:
            RunWriter.create(path, layout(), overwrite=True)
        assert str(caught.value) == reported
        assert finish(first) == (1, 2)
    assert resume(path, layout()) == ()
    assert os.listdir(tmp_path) == ["run.zarr"]


def test_a_writer_in_another_process_is_noticed_until_it_dies(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    command = [sys.executable, "-c", HOLD, str(path)]
    with subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "locked\n"
        with pytest.raises(RunBusyError) as caught:
            RunWriter.resume(path, layout())
        assert str(caught.value) == f"another process is writing to '{path}'"
        process.kill()
    assert resume(path, layout()) == ()


def test_what_a_killed_process_left_beside_a_run_is_removed(tmp_path: Path) -> None:
    run = make(tmp_path / "run.zarr", layout())
    copy(run, tmp_path / ".new.zarr-0123abcd.partial")
    copy(run, tmp_path / ".new.zarr-0123abcd.old")
    copy(run, tmp_path / ".new.zarr-mine.partial")
    copy(run, tmp_path / ".other.zarr-0123abcd.partial")
    with RunWriter.create(tmp_path / "new.zarr", layout()):
        left = sorted(os.listdir(tmp_path))
    assert left == [".new.zarr-mine.partial", ".other.zarr-0123abcd.partial", "new.zarr", "run.zarr"]


def test_where_no_folder_can_be_made_nothing_is(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    for path, reason in (
        (tmp_path / "file" / "run.zarr", "Not a directory"),
        (tmp_path / ("x" * 300), "File name too long"),
    ):
        with pytest.raises(RunOutputError) as caught:
            RunWriter.create(path, layout())
        assert str(caught.value) == f"cannot write to '{path}': {reason}; nothing was changed"
    assert os.listdir(tmp_path) == ["file"]
