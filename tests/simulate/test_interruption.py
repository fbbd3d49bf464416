"""The command itself, cut off in the ways that happen."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
import xarray

from dh2sim.cli.common import BAD_INPUT, INTERRUPTED
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from dh2sim.simulate.description import describe
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.run import fill
from dh2sim.simulate.store.reader import open_dataset
from dh2sim.simulate.store.writer import RunWriter
from tests.program import SLOWLY, Outcome, contents, dh2sim, dh2sim_process, environment
from tests.robot_files import small

ROLLOUTS, STEPS, BLOCK = 60, 200, 3
CONTROLLER = "pd"
OPTIONS = ("--rollouts", str(ROLLOUTS), "--steps", str(STEPS), "--controller", CONTROLLER, "--start", "random")
WAIT = 180.0


def _begin(folder: Path) -> tuple[Path, RunWriter]:
    """A run that has not begun, of blocks so small that there are many; whoever resumes it keeps them."""
    (folder / "small.yaml").write_text(small(), encoding="utf-8")
    options = RolloutOptions(rollouts=ROLLOUTS, steps=STEPS, controller=CONTROLLER, start="random")
    job = prepare(build_model(load_robot(folder / "small.yaml")), options)
    path = folder / "run.zarr"
    return path, RunWriter.create(path, replace(job.layout, block=BLOCK))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path, writer = _begin(tmp_path_factory.mktemp("undisturbed"))
    with writer:
        options = RolloutOptions(rollouts=ROLLOUTS, steps=STEPS, controller=CONTROLLER, start="random")
        fill(writer, prepare(build_model(load_robot(path.parent / "small.yaml")), options))
    return path


@pytest.fixture
def run(tmp_path: Path) -> Path:
    path, writer = _begin(tmp_path)
    writer.close()
    return path


def _command(run: Path, *more: str) -> list[str]:
    return ["rollout", str(run.parent / "small.yaml"), "--out", str(run), *OPTIONS, *more]


def _start(run: Path, *more: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", SLOWLY, *_command(run, "--resume", *more)],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _blocks(run: Path) -> int:
    return len(list((run / "blocks" / "record").glob("c.*")))


def _wait_for_another_block(run: Path, before: int) -> None:
    end = time.monotonic() + WAIT
    while _blocks(run) <= before:
        assert time.monotonic() < end, "no block was written"
        time.sleep(0.001)


def _chunks(run: Path) -> dict[str, bytes]:
    """Every chunk of the dataset."""
    files = {name: data for name, data in contents(run).items() if not name.startswith("blocks/")}
    return {name: data for name, data in files.items() if not name.endswith("zarr.json")}


def _assert_same(run: Path, undisturbed: Path) -> None:
    assert _chunks(run) == _chunks(undisturbed)
    assert open_dataset(run).load().drop_attrs().identical(open_dataset(undisturbed).load().drop_attrs())
    ours, theirs = (xarray.open_zarr(path).attrs for path in (run, undisturbed))
    assert {**ours, "created": "", "command": ""} == {**theirs, "created": "", "command": ""}


def _finish(run: Path, *more: str) -> Outcome:
    outcome = dh2sim(*_command(run, "--resume", *more))
    assert (outcome.status, outcome.err) == (0, "")
    return outcome


@pytest.mark.slow
def test_a_command_that_is_killed_again_and_again_ends_as_if_it_had_not_been(run: Path, undisturbed: Path) -> None:
    for threads in ("1", "2", "3"):
        before = _blocks(run)
        process = _start(run, "--threads", threads)
        _wait_for_another_block(run, before)
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
    assert describe(run).not_run > 0
    _finish(run, "--threads", "1")
    _assert_same(run, undisturbed)


@pytest.mark.slow
def test_an_interrupt_finishes_the_block_at_hand_and_tells_how_to_carry_on(run: Path, undisturbed: Path) -> None:
    process = _start(run)
    _wait_for_another_block(run, 0)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=WAIT)
    assert process.returncode == INTERRUPTED
    safe = ROLLOUTS - describe(run).not_run
    assert 0 < safe < ROLLOUTS
    assert safe % BLOCK == 0
    assert err == (
        "dh2sim: finishing the rollouts in progress; interrupt again to stop at once\n"
        f"dh2sim: interrupted; {safe} of {ROLLOUTS} rollouts are saved in {run}. "
        "Continue with the same command and --resume\n"
    )
    assert f"finished {safe}, not run {ROLLOUTS - safe}" in out
    rest = _finish(run)
    assert re.search(rf"simulated {ROLLOUTS - safe} in ", rest.out)
    _assert_same(run, undisturbed)


@pytest.mark.slow
def test_a_second_interrupt_ends_at_once_and_loses_no_committed_block(run: Path, undisturbed: Path) -> None:
    process = _start(run)
    _wait_for_another_block(run, 0)
    process.send_signal(signal.SIGINT)
    time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    err = process.communicate(timeout=WAIT)[1]
    assert process.returncode in (INTERRUPTED, -signal.SIGINT)
    assert "Traceback" not in err
    _finish(run)
    _assert_same(run, undisturbed)


@pytest.mark.slow
def test_a_finished_run_is_left_alone(run: Path, undisturbed: Path) -> None:
    _finish(run)
    before = contents(run)
    assert "all of them were simulated before" in _finish(run).out
    assert contents(run) == before


@pytest.mark.slow
def test_blocks_that_were_damaged_by_hand_are_computed_again(run: Path, undisturbed: Path) -> None:
    _finish(run)
    (run / "qpos" / "c.4.0.0").unlink()
    chunk = run / "ctrl" / "c.7.0.0"
    chunk.write_bytes(bytes(byte ^ 1 if at == 40 else byte for at, byte in enumerate(chunk.read_bytes())))
    reported = dh2sim("runs", run)
    assert (reported.status, reported.out) == (BAD_INPUT, "")
    assert reported.err == (
        f"dh2sim: '{run}' is damaged; resume it with the same options to compute the damaged blocks again\n"
    )
    assert f"simulated {2 * BLOCK} in " in _finish(run).out
    _assert_same(run, undisturbed)


@pytest.mark.slow
def test_a_run_whose_metadata_were_damaged_by_hand_is_computed_again_elsewhere(
    run: Path, undisturbed: Path, tmp_path: Path
) -> None:
    _finish(run)
    (run / "zarr.json").write_text("")
    reported = f"'{run / 'zarr.json'}' is missing or damaged and cannot be restored; "
    for arguments in (["runs", str(run)], _command(run, "--resume")):
        outcome = dh2sim(*arguments)
        assert (outcome.status, outcome.out) == (BAD_INPUT, "")
        assert (
            outcome.err
            == f"dh2sim: {reported}resume with the same options in a new folder, which computes the same bits\n"
        )
    assert dh2sim(*_command(run, "--resume", "--out", str(tmp_path / "new.zarr"))).status == 0
    new, old = open_dataset(tmp_path / "new.zarr"), open_dataset(undisturbed)
    assert new.load().drop_attrs().identical(old.load().drop_attrs())


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        (("--seed", "1"), "seed was 0 and is now 1"),
        (("--controller", "hold"), "controller was 'pd' and is now 'hold'"),
        (("--timestep", "0.001"), "timestep was 0.002 and is now 0.001"),
        (("--randomize", "mass=0.1"), "randomize was none and is now mass=0.1"),
    ],
)
def test_other_settings_are_refused(run: Path, options: Sequence[str], reported: str) -> None:
    before = contents(run)
    outcome = dh2sim(*_command(run, *options, "--resume"))
    assert (outcome.status, outcome.out, outcome.err) == (
        BAD_INPUT,
        "",
        f"dh2sim: '{run}' was made with other settings: {reported}. Use the same options, or choose another folder\n",
    )
    assert contents(run) == before


def test_another_robot_under_the_same_name_is_refused(run: Path) -> None:
    (run.parent / "small.yaml").write_text(small(length=0.5), encoding="utf-8")
    outcome = dh2sim(*_command(run, "--resume"))
    assert outcome.status == BAD_INPUT
    assert re.fullmatch(
        rf"dh2sim: '{run}' was made with other settings: the robot file has changed \(SHA-256 "
        r"[0-9a-f]{12}…, now [0-9a-f]{12}…\)\. Use the same options, or choose another folder\n",
        outcome.err,
    )


def test_an_existing_run_is_overwritten_only_if_that_is_said(run: Path) -> None:
    before = contents(run)
    refused = dh2sim(*_command(run))
    assert (refused.status, refused.err) == (
        BAD_INPUT,
        f"dh2sim: '{run}' already exists; resume it, overwrite it, or choose another folder\n",
    )
    assert contents(run) == before
    assert dh2sim(*_command(run, "--overwrite")).status == 0
    assert describe(run).complete


@pytest.mark.slow
def test_two_commands_do_not_write_to_one_run(run: Path) -> None:
    process = _start(run)
    try:
        _wait_for_another_block(run, 0)
        outcome = dh2sim(*_command(run, "--resume"))
    finally:
        process.kill()
        process.communicate()
    assert (outcome.status, outcome.err) == (BAD_INPUT, f"dh2sim: another process is writing to '{run}'\n")


FULL = """
mount -t tmpfs -o size=4m tmpfs "$1" && cd "$1" && cp -r "$2" run.zarr || exit 1
head -c $(($(stat -f -c '%a * %S' .) - 300000)) /dev/zero > filler
shift 2
"$@"
echo "status $?"
rm filler
"$@" > finished && cp -r run.zarr "$COPIED"
"""


@pytest.mark.slow
def test_on_a_full_disk_a_run_stops_and_carries_on_when_there_is_room(
    tmp_path: Path, run: Path, undisturbed: Path
) -> None:
    command = ["unshare", "--user", "--map-root-user", "--mount"]
    if not shutil.which("unshare") or subprocess.run([*command, "true"], capture_output=True, check=False).returncode:
        pytest.skip("needs unshare(1), and leave to make a user namespace")
    disk, copied = tmp_path / "disk", tmp_path / "copied.zarr"
    disk.mkdir()
    program = [sys.executable, "-m", "dh2sim", *_command(run, "--resume")]
    program[program.index(str(run))] = "run.zarr"
    done = subprocess.run(
        [*command, "sh", "-c", FULL, "sh", str(disk), str(run), *program],
        env=environment(COPIED=str(copied)),
        capture_output=True,
        text=True,
        timeout=2 * WAIT,
        check=False,
    )
    assert done.stdout == "status 2\n", done.stderr
    reported = re.fullmatch(
        r"dh2sim: cannot write to 'run\.zarr': No space left on device; (\d+) of 60 rollouts are safe\. "
        r"Make room, then resume\n",
        done.stderr,
    )
    assert reported is not None, done.stderr
    assert 0 < int(reported[1]) < ROLLOUTS
    _assert_same(copied, undisturbed)


def test_a_folder_that_cannot_be_made_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    outcome = dh2sim_process("rollout", "stanford", "--out", tmp_path / "file" / "run.zarr", "--steps", "1")
    assert (outcome.status, outcome.out, outcome.err) == (
        BAD_INPUT,
        "",
        f"dh2sim: cannot write to '{tmp_path / 'file' / 'run.zarr'}': Not a directory; nothing was changed\n",
    )
