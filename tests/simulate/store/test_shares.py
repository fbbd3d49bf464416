"""Several writers of one run at a time."""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from dh2sim import locks
from dh2sim.errors import RunBusyError, RunDiffersError, RunError
from dh2sim.simulate.store import directory
from dh2sim.simulate.store.reader import damaged_blocks
from dh2sim.simulate.store.writer import RunWriter
from tests.program import SLOWLY, contents, dh2sim, environment
from tests.simulate.store.runs import SECONDS, block_of, copy, finish, lasting, layout, make, resume

OF = layout(rollouts=8, block=2)


def test_writers_that_overlap_in_any_order_make_the_run_of_one(tmp_path: Path) -> None:
    path = tmp_path / "new" / "run.zarr"
    with RunWriter.join(path, OF) as first, RunWriter.join(path, OF) as second, RunWriter.join(path, OF) as third:
        for writer, block in ((third, 3), (second, 1), (first, 1), (first, 0), (second, 3), (second, 2), (third, 0)):
            writer.write(block, block_of(OF, block), SECONDS)
            assert block not in writer.pending()
        assert first.pending() == second.pending() == third.pending() == ()
    assert contents(path) == contents(make(tmp_path / "one.zarr", OF))


def test_who_joins_takes_over_the_time_and_the_command_of_who_made_the_run(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    RunWriter.join(path, OF).close()
    later = layout(rollouts=8, block=3, created="2027-01-01T00:00:00+00:00", command="dh2sim rollout --share 2/2")
    with RunWriter.join(path, later) as writer:
        finish(writer)
    assert contents(path) == contents(make(tmp_path / "one.zarr", OF))


def test_a_run_of_other_settings_or_none_at_all_cannot_be_joined(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", OF)
    before = contents(path)
    with pytest.raises(RunDiffersError, match="seed was 0 and is now 1"):
        RunWriter.join(path, layout(rollouts=8, block=2, settings={"seed": 1}))
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").write_text("years of work")
    with pytest.raises(RunError, match="is not a run of dh2sim"):
        RunWriter.join(tmp_path / "other", OF)
    with pytest.raises(RunError, match="there is no"):
        RunWriter.join(tmp_path / "none.zarr", OF, create=False)
    assert contents(path) == before
    assert not (tmp_path / "none.zarr").exists()


def test_a_second_writer_of_a_block_changes_nothing_and_one_with_other_numbers_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.zarr"
    with RunWriter.join(path, OF) as first, RunWriter.join(path, OF) as second:
        first.write(1, block_of(OF, 1), SECONDS)
        sound = contents(path)
        monkeypatch.setattr(second, "pending", lambda blocks: blocks)  # it looked before the other one committed
        second.write(1, block_of(OF, 1), 2 * SECONDS)
        assert contents(path) == sound
        other = {name: values + 1 for name, values in block_of(OF, 1).items()}
        with pytest.raises(RunDiffersError, match="was committed by another process with other"):
            second.write(1, other, SECONDS)
    assert damaged_blocks(path) == [1]
    assert resume(path, OF) == (0, 1, 2, 3)
    assert lasting(path) == lasting(make(tmp_path / "one.zarr", OF))


def test_a_writer_that_fails_leaves_the_block_of_its_twin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.zarr"
    with RunWriter.join(path, OF) as first, RunWriter.join(path, OF) as second:
        monkeypatch.setattr(second, "pending", lambda blocks: blocks)
        link = os.link

        def cut_off(*_: object) -> None:
            raise KeyboardInterrupt

        first.write(0, block_of(OF, 0), SECONDS)
        sound = contents(path)
        monkeypatch.setattr(os, "link", cut_off)
        with pytest.raises(KeyboardInterrupt):
            second.write(0, block_of(OF, 0), SECONDS)
        monkeypatch.setattr(os, "link", link)
        assert contents(path) == sound


def test_partial_files_of_living_writers_stay_and_those_of_dead_ones_go(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", OF)
    sound = contents(path)
    alive, dead = (path / "qpos" / f".c.0.0.0-host-{number}-0123abcd.partial" for number in (1, 2))
    dead.write_bytes(b"half")
    handle = os.open(alive, os.O_CREAT | os.O_RDWR)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        assert resume(path, OF) == ()
        assert alive.exists()
        assert not dead.exists()
    finally:
        os.close(handle)
    assert resume(path, OF) == ()
    assert contents(path) == sound


def test_a_run_that_others_write_to_can_be_resumed_and_joined_but_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with RunWriter.join(path, OF) as worker:
        worker.write(2, block_of(OF, 2), SECONDS)
        with pytest.raises(RunBusyError, match="another process is writing to"):
            RunWriter.create(path, OF, overwrite=True)
        with RunWriter.resume(path, OF) as resumed, RunWriter.join(path, OF) as other:
            assert resumed.pending() == (0, 1, 3)
            worker.write(0, block_of(OF, 0), SECONDS)
            other.write(3, block_of(OF, 3), SECONDS)
            assert finish(resumed) == (1,)
    assert contents(path) == contents(make(tmp_path / "one.zarr", OF))


def test_joining_trusts_records_and_verifying_does_not(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", OF)
    chunk = path / "qpos" / "c.2.0.0"
    chunk.write_bytes(chunk.read_bytes()[::-1])
    (path / "ctrl" / "c.3.0.0").unlink()
    with RunWriter.join(path, OF) as writer:
        assert writer.pending() == ()
    assert damaged_blocks(path) == [2, 3]
    assert resume(path, OF) == (2, 3)
    assert damaged_blocks(path) == []


def test_a_writer_notices_that_another_run_was_put_in_place_of_its_own(tmp_path: Path) -> None:
    path, other = tmp_path / "run.zarr", make(tmp_path / "other.zarr", layout(rollouts=8, block=2, robot="other"))
    with RunWriter.join(path, OF) as writer:
        shutil.rmtree(path)  # as where there are no locks
        copy(other, path)
        before = contents(path)
        (path / "blocks" / "record" / "c.0").unlink()
        with pytest.raises(RunDiffersError, match="was replaced or removed while it was written to"):
            writer.write(0, block_of(OF, 0), SECONDS)
    del before["blocks/record/c.0"]
    assert contents(path) == before


def test_a_plain_reader_sees_the_committed_blocks_of_a_run_in_the_making(tmp_path: Path) -> None:
    import xarray as xr

    path = tmp_path / "run.zarr"
    with RunWriter.join(path, OF) as writer:
        writer.write(1, block_of(OF, 1), SECONDS)
        status = xr.open_zarr(path).status.to_numpy()
    assert np.flatnonzero(status != -1).tolist() == [2, 3]


def test_a_run_that_another_process_has_made_meanwhile_is_joined_and_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.zarr"
    make_hidden = locks.make_hidden

    def late(target: Path, suffix: str) -> object:
        monkeypatch.setattr(directory, "make_hidden", make_hidden)
        make(path, OF)  # and its process has ended, so that nobody holds a lock
        return make_hidden(target, suffix)

    monkeypatch.setattr(directory, "make_hidden", late)
    with RunWriter.join(path, OF) as writer:
        assert writer.pending() == ()
    assert os.listdir(tmp_path) == ["run.zarr"]


RUN = "rollout planar_2r --controller random --rollouts 192 --steps 2000 --every 100 --block-size 4 --threads 1 -q -o"


def _share(folder: Path, share: str, *program: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, *(program or ("-m", "dh2sim")), *RUN.split(), "run.zarr", "--share", share]
    return subprocess.Popen(command, cwd=folder, env=environment())


def _made_of(run: Path) -> dict[str, bytes]:
    """Files of a run without when, how fast and by which command it was made, and what sums up these."""
    files = {name: data for name, data in contents(run).items() if not name.endswith("zarr.json")}
    for name, data in files.items():
        if name.startswith("blocks/record/c."):
            files[name] = re.sub(rb'"(seconds|run)": [^,]*', b"", data[8:-4])
    return files


@pytest.mark.slow
def test_four_shares_of_which_one_is_killed_and_started_again_make_the_run_of_one_process(tmp_path: Path) -> None:
    shares = [_share(tmp_path, f"{i}/4", *(["-c", SLOWLY] if i == 2 else [])) for i in (1, 2, 3, 4)]
    records, end = tmp_path / "run.zarr" / "blocks" / "record", time.monotonic() + 180
    while not list(records.glob("c.*")) and time.monotonic() < end:
        time.sleep(0.005)
    own = {f"c.{block}" for block in range(1, 48, 4)}
    while not own & {path.name for path in records.glob("c.*")} and time.monotonic() < end:
        time.sleep(0.002)
    shares[1].kill()
    assert [share.wait(180) for share in shares] == [0, -signal.SIGKILL, 0, 0]
    missing = own - {path.name for path in records.glob("c.*")}
    assert 0 < len(missing) < len(own)
    assert dh2sim("runs", tmp_path / "run.zarr", "--verify").status == 1
    assert _share(tmp_path, "2/4").wait(180) == 0
    assert dh2sim("runs", tmp_path / "run.zarr", "--verify").status == 0
    assert dh2sim(*RUN.split(), tmp_path / "one.zarr").status == 0
    many, one = (_made_of(tmp_path / name) for name in ("run.zarr", "one.zarr"))
    left = {name for name in many if name.endswith(".partial")}  # of the process that was killed
    assert {name: many[name] for name in many.keys() - left} == one
