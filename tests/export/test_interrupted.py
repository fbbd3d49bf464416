from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dh2sim import load_robot
from dh2sim.cli.common import INTERRUPTED
from dh2sim.robot.catalog import builtin_robots
from tests.program import STARTED, contents, dh2sim, environment
from tests.robot_files import small, write

FOREVER = """
import sys
from dh2sim.cli.app import app
from dh2sim.cli.signals import Signals
signals = Signals()
signals.listen()
try:
    while True:
        for robot in sys.argv[2:]:
            try:
                app(["export", robot, "--out", sys.argv[1], "--no-verify"])
            except SystemExit as end:
                if end.code:
                    raise
            sys.stdout.flush()
except KeyboardInterrupt:  # between two exports
    sys.exit(130)
finally:
    signals.end()
"""
"""Export versions of a robot in turn, for ever."""


KILLS = 8


def _start(*command: str | Path, cwd: Path | None = None) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, *map(str, command)],
        cwd=cwd,
        env=environment(PYTHONUNBUFFERED="1"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _versions(folder: Path) -> list[tuple[Path, dict[str, bytes]]]:
    """Two versions of a robot file, and what an undisturbed export makes of each."""
    made = []
    for number, length in enumerate((0.4, 0.5)):
        version = folder / f"version_{number}"
        version.mkdir()
        robot = write(version, small(length=length))
        assert dh2sim("export", robot, "--out", version / "made").status == 0
        made.append((robot, contents(version / "made")))
    return made


@pytest.mark.slow
@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL], ids=lambda kind: kind.name)
def test_an_export_cut_off_at_any_moment_leaves_whole_files(tmp_path: Path, kind: signal.Signals) -> None:
    versions = _versions(tmp_path)
    rng = random.Random(0)
    for attempt in range(KILLS):
        out = tmp_path / f"out_{attempt}"
        out.mkdir()
        process = _start("-c", FOREVER, out, *(robot for robot, _ in versions))
        assert process.stdout is not None
        process.stdout.readline()  # the first set stands
        time.sleep(rng.uniform(0.0, 0.02))
        process.send_signal(kind)
        stderr = process.communicate(timeout=180)[1]
        stands = {name: data for name, data in contents(out).items() if not name.startswith(".")}
        if kind is signal.SIGKILL:  # which nothing can put off: each file by itself is whole
            assert set(stands) == set(versions[0][1])
            assert all(data in (made[name] for _, made in versions) for name, data in stands.items())
        else:
            assert stands in [made for _, made in versions]
        if kind is signal.SIGINT:
            assert process.returncode == INTERRUPTED
            assert stderr == ""
            assert [path.name for path in out.iterdir()] == ["small"], "the temporary folder is removed"


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_the_program_ends_in_good_order_on_a_signal(tmp_path: Path, kind: signal.Signals, status: int) -> None:
    process = _start("-m", "dh2sim", "export", *builtin_robots(), "--out", tmp_path)
    assert process.stdout is not None
    first = process.stdout.readline()
    process.send_signal(kind)
    _, stderr = process.communicate(timeout=180)
    assert first == f"{builtin_robots()[0]}: {tmp_path / builtin_robots()[0]}\n"
    assert (process.returncode, stderr) == (status, "dh2sim: interrupted\n" if kind is signal.SIGINT else "")
    for folder in tmp_path.iterdir():
        name = load_robot(folder.name).name
        assert {path.name for path in folder.iterdir()} == {f"{name}.urdf", f"{name}.xml", "scene.xml"}


@pytest.mark.slow
@pytest.mark.parametrize("moment", [0.7, 1.5, 3.0])
def test_an_interruption_during_a_long_validation_is_heeded_at_once(tmp_path: Path, moment: float) -> None:
    process = _start("-c", STARTED, "validate", "stanford", "--samples", "4000000", cwd=tmp_path)
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(moment)  # while engines are imported, and while they are compared
    process.send_signal(signal.SIGINT)
    before = os.times()
    out, stderr = process.communicate(timeout=180)
    after = os.times()
    # of a processor, as others may use it, too; until it is done, it would take half a minute
    assert after.children_user + after.children_system - before.children_user - before.children_system < 15.0
    assert (process.returncode, out, stderr) == (130, "", "dh2sim: interrupted\n")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="elsewhere glfw comes without libraries to choose from"
)
def test_an_export_starts_no_other_process_that_an_interruption_could_hit(tmp_path: Path) -> None:
    listening = (
        'import sys; sys.addaudithook(lambda event, _: event == "subprocess.Popen" and print("STARTED", event))'
    )
    process = _start("-c", f"{listening}\n{STARTED}", "export", "stanford", "--out", tmp_path)
    out, stderr = process.communicate(timeout=180)
    assert (process.returncode, stderr) == (0, "")
    assert "stanford.xml" in out
    assert "STARTED" not in out


@pytest.mark.slow
def test_an_interruption_while_the_program_starts_is_no_traceback(tmp_path: Path) -> None:
    rng = random.Random(0)
    for _ in range(8):
        process = _start("-c", STARTED, "export", "stanford", "--out", tmp_path)
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(rng.uniform(0.0, 0.5))
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=180)
        # before the program listens, and after it is done, the signal itself ends the process
        assert process.returncode in (0, 130, -signal.SIGINT)
        if process.returncode == 130:
            assert stderr == "dh2sim: interrupted\n"


def test_an_interruption_that_whoever_started_the_program_ignores_is_ignored(tmp_path: Path) -> None:
    script = 'trap "" INT TERM; echo started; exec "$0" -m dh2sim export stanford --out "$1"'
    command = ["sh", "-c", script, sys.executable, str(tmp_path)]
    with subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        while process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.send_signal(signal.SIGTERM)
            time.sleep(0.02)
    assert process.returncode == 0
    assert [path.name for path in tmp_path.iterdir()] == ["stanford"]
