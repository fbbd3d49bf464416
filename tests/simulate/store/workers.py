"""Processes that write runs, and can be killed, without the time that a new interpreter takes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.program import environment

_PARENT = """
import os, sys
from pathlib import Path
import zarr
from tests.simulate.store.runs import finish, layout
from dh2sim.simulate.store.writer import RunWriter
path, rollouts = Path(sys.argv[1]), int(sys.argv[2])
while sys.stdin.readline():
    child = os.fork()  # before any thread of zarr's is started
    if child == 0:
        with RunWriter.resume(path, layout(rollouts=rollouts, block=1)) as writer:
            finish(writer)
        os._exit(0)
    print(child, flush=True)
    sys.stdin.readline()  # until then a child that has ended keeps its id
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class Workers:
    """Makes processes that resume a run, block after block of one rollout."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def start(self) -> int:
        """Start one and return its id."""
        self._say("go")
        return int(self._read())

    def kill(self, worker: int) -> int:
        """Kill one outright, and return its exit status."""
        os.kill(worker, signal.SIGKILL)
        self._say("killed")
        return int(self._read())

    def _say(self, word: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{word}\n")
        self._process.stdin.flush()

    def _read(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()


@contextmanager
def workers(path: Path, rollouts: int) -> Iterator[Workers]:
    """Yield what starts them."""
    with subprocess.Popen(
        [sys.executable, "-c", _PARENT, str(path), str(rollouts)],
        env=environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        yield Workers(process)
        assert process.stdin is not None
        process.stdin.close()
