"""The dh2sim program as tests call it: in this process, or in one of its own."""

from __future__ import annotations

import fcntl
import io
import os
import pty
import struct
import subprocess
import sys
import termios
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path

from dh2sim.cli.app import app

STARTED = """
print("started", flush=True)
from dh2sim.cli.main import main
main()
"""
"""The program, which reports when Python has started."""
SLOWLY = """
import time
from dh2sim.simulate.store.writer import RunWriter

write = RunWriter.write

def write_and_rest(*arguments):
    write(*arguments)
    time.sleep(0.25)

RunWriter.write = write_and_rest
from dh2sim.cli.main import main
main()
"""
"""The program, which rests after each block of a run: it is still at work when it is killed or interrupted then."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How a run ended."""

    status: int
    out: str
    err: str


def dh2sim(*arguments: str | Path) -> Outcome:
    """Run a command line in this process."""
    out, err = io.StringIO(), io.StringIO()
    status: object = None
    with redirect_stdout(out), redirect_stderr(err):
        try:
            app([str(argument) for argument in arguments], prog_name="dh2sim")
        except SystemExit as end:
            status = end.code
    assert isinstance(status, int), f"not an exit status: {status!r}"
    return Outcome(status=status, out=out.getvalue(), err=err.getvalue())


def environment(**variables: str) -> dict[str, str]:
    """This process's environment with some variables changed."""
    return {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **variables}


def dh2sim_process(
    *arguments: str | Path, cwd: Path | None = None, variables: dict[str, str] | None = None
) -> Outcome:
    """Run a command line in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "dh2sim", *map(str, arguments)],
        cwd=cwd,
        env=environment(**(variables or {})),
        capture_output=True,
        encoding="utf-8",
        errors="surrogateescape",
        timeout=300,
        check=False,
    )
    return Outcome(status=done.returncode, out=done.stdout, err=done.stderr)


def shell(script: str, **variables: str) -> Outcome:
    """Run a script in a shell, in which $PYTHON is this Python and $DH2SIM the program."""
    done = subprocess.run(
        ["sh", "-c", script],
        env=environment(PYTHON=sys.executable, DH2SIM=f"{sys.executable} -m dh2sim", **variables),
        capture_output=True,
        encoding="utf-8",
        timeout=300,
        check=False,
    )
    return Outcome(status=done.returncode, out=done.stdout, err=done.stderr)


def on_terminal(*arguments: object, columns: int) -> str:
    """Run the program on a terminal of so many columns, and return what it prints there."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    with os.fdopen(master, "rb", buffering=0) as screen:
        command = [sys.executable, "-m", "dh2sim", *map(str, arguments)]
        variables = {name: value for name, value in environment().items() if name != "COLUMNS"}
        with subprocess.Popen(command, env=variables, stdin=slave, stdout=slave, stderr=slave):
            os.close(slave)
            text = b""
            with suppress(OSError):  # as Linux reports the end of it
                while part := screen.read(4096):
                    text += part
    return text.decode().replace("\r\n", "\n")


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, by its path in it; hidden ones too."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()
    }
