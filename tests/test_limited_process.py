"""Requests in another process: answered, or stopped at a limit, and the caller goes on."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dh2sim import limited_process
from dh2sim.limited_process import MEMORY, MOST_BYTES, WorkerError, ask_worker
from tests.refusals import refusal

WORKER = "tests.hostile_worker"
on_linux = pytest.mark.skipif(sys.platform != "linux", reason="memory is limited, and what is written, on Linux only")


def asked(request: str, seconds: int = 5) -> bytes:
    return ask_worker(WORKER, request.encode(), seconds=seconds)


def stopped(request: str, seconds: int = 5) -> str:
    """The reason why a request was stopped; the next one is answered."""
    reason = refusal(WorkerError, asked, request, seconds)
    assert asked("add 2 3") == b"5"
    return reason


def test_a_request_is_answered() -> None:
    assert asked("add 1 2 3") == b"6"
    assert len(asked("return 3000000")) == 3_000_000


def test_what_is_printed_is_no_part_of_the_answer(capfd: pytest.CaptureFixture[str]) -> None:
    assert asked("print") == b"done"
    assert asked("add 2 3") == b"5"
    assert capfd.readouterr() == ("", "")


@on_linux
def test_a_request_that_needs_too_much_memory_is_stopped() -> None:
    assert stopped("grow") == f"it needs more than {MEMORY // 1_000_000} MB of memory"


def test_an_answer_that_is_too_large_is_not_sent() -> None:
    assert stopped(f"return {MOST_BYTES + 1}") == f"it needs more than {MEMORY // 1_000_000} MB of memory"


@pytest.mark.slow
def test_a_request_that_computes_without_end_is_stopped() -> None:
    assert stopped("loop", seconds=1) == "it takes longer than 1 seconds"


def test_a_request_that_waits_without_end_is_stopped() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(limited_process, "PATIENCE", 0.5)
        assert refusal(WorkerError, asked, "sleep", 1) == "it takes longer than 1 seconds"
    assert asked("add 2 3") == b"5"


@pytest.mark.skipif(os.name == "nt", reason="no signals here")
def test_a_request_that_ends_the_process_does_not_end_the_caller() -> None:
    assert stopped("abort") == "it ended the process that read it (signal 6)"
    assert stopped("exit").startswith("it ended the process that read it (exit status ")


def test_an_error_of_the_worker_is_reported() -> None:
    assert stopped("?") == "it failed: ValueError: unknown request"
    reason = refusal(WorkerError, ask_worker, "tests.no_such_worker", b"")
    assert reason == "it failed: ModuleNotFoundError: No module named 'tests.no_such_worker'"


@on_linux
def test_a_worker_writes_no_file(tmp_path: Path) -> None:
    assert "File too large" in stopped(f"write {tmp_path / 'made'}")
    assert not any(path.stat().st_size for path in tmp_path.iterdir())


@pytest.mark.slow
def test_modules_in_the_current_folder_are_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("dh2sim", "struct", "tests"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'run')!r}, 'w')")
    monkeypatch.chdir(tmp_path)
    limited_process._end()  # so that a new process is started here
    limited_process._workers.clear()
    assert asked("add 2 3") == b"5"
    assert not (tmp_path / "run").exists()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_fork_of_the_caller_has_workers_of_its_own() -> None:
    assert asked("add 2 3") == b"5"
    child = os.fork()
    if child == 0:
        os._exit(0 if asked("add 1 1") == b"2" else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert asked("add 2 3") == b"5"


def test_nothing_is_left_running_when_the_caller_ends() -> None:
    script = (
        "from dh2sim import limited_process as p\n"
        f"p.ask_worker({WORKER!r}, b'add 1 1')\n"
        "print([worker.process.pid for worker in p._workers.values()])"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=True)
    assert done.stderr == ""
    for pid in done.stdout.strip("[]\n").split(","):
        if pid and os.name != "nt":
            deadline = time.monotonic() + 60.0
            while Path(f"/proc/{int(pid)}").exists() and time.monotonic() < deadline:
                time.sleep(0.01)
            assert not Path(f"/proc/{int(pid)}").exists()
