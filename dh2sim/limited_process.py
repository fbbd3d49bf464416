"""Work on files of strangers in another process, whose time and memory are limited.

A worker is a module with a function ``answer(request: bytes) -> bytes``. Its process is started once, imports the
module, and answers one request after another. On Linux a fork of it does that, for which alone the limits of memory
and processor time are; elsewhere there is no safe fork, and time by the clock is what is limited.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import os
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Final, NoReturn, TypeAlias

from dh2sim.errors import Dh2simError

MEMORY: Final = 1_000_000_000
"""Bytes that a request may take."""
SECONDS: Final = 20
"""Of processor time, for a request."""
PATIENCE: Final = 3
"""By the clock a request may take this many times as long, on a machine that is busy."""
MOST_BYTES: Final = 250_000_000
"""Of an answer."""

_FORKS: Final = sys.platform == "linux"
_HEAD: Final = struct.Struct("<cIQQ")
"""Of a message: its kind, the seconds and the bytes of memory that a request may take, and the bytes that follow."""
_REQUEST, _DONE, _FULL, _FAILED = b"r", b"d", b"m", b"f"
_Answer: TypeAlias = Callable[[bytes], bytes]


class WorkerError(Dh2simError):
    """A request was stopped, or failed; the text says why, such as ``it takes longer than 20 seconds``."""


class _Worker:
    """The process of a worker's module."""

    def __init__(self, module: str) -> None:
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(folder for folder in sys.path if folder),
            "MUJOCO_GL": "disable",  # or else its import opens libraries for drawing
            "OPENBLAS_NUM_THREADS": "1",  # a process is forked safely as long as it has one thread
            "OMP_NUM_THREADS": "1",
        }
        self._stopped = False
        self.process = subprocess.Popen(
            # -P: modules in the current folder are not those of Python
            [sys.executable, "-P", "-c", f"from {__name__} import serve; serve({module!r})"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment,
            start_new_session=True,  # Ctrl-C is for the caller, who ends this one
        )

    def ask(self, request: bytes, seconds: int) -> bytes:
        """Return the answer to a request.

        Raises:
            WorkerError: It takes too much time or memory, or ended the process.
        """
        clock = threading.Timer(seconds * PATIENCE, self._stop)
        clock.daemon = True
        clock.start()
        try:
            kind, answer = self._exchange(request, seconds)
        except (OSError, EOFError):
            self.close()
            raise WorkerError(self._reason(seconds)) from None
        finally:
            clock.cancel()
        if kind == _DONE:
            return answer
        if kind == _FULL:
            raise WorkerError(f"it needs more than {MEMORY // 1_000_000} MB of memory")
        raise WorkerError(f"it failed: {answer.decode(errors='replace')}")

    def _exchange(self, request: bytes, seconds: int) -> tuple[bytes, bytes]:
        stdin, stdout = self.process.stdin, self.process.stdout
        if stdin is None or stdout is None:
            raise EOFError
        stdin.write(_HEAD.pack(_REQUEST, seconds, MEMORY, len(request)) + request)
        stdin.flush()
        kind, _, answer = _receive(stdout)
        return kind, answer

    def _reason(self, seconds: int) -> str:
        number = _signal_of(self.process.returncode)
        if self._stopped or number == getattr(signal, "SIGXCPU", None):
            return f"it takes longer than {seconds} seconds"
        how = f"exit status {self.process.returncode}" if number is None else f"signal {number}"
        return f"it ended the process that read it ({how})"

    def _stop(self) -> None:
        self._stopped = True
        self._kill()

    def _kill(self) -> None:
        with contextlib.suppress(OSError):
            if sys.platform == "win32":
                self.process.kill()
            else:
                os.killpg(self.process.pid, signal.SIGKILL)  # with its forks

    def close(self) -> None:
        """End the process, whatever it does."""
        self._kill()
        self.process.wait()
        self.disown()

    def disown(self) -> None:
        """Close the pipes of the process, and think no more of it."""
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()
        if self.process.returncode is None:
            self.process.returncode = 0


def _signal_of(status: int) -> int | None:
    """Return the number of the signal that ended a process, or None."""
    if status > 128:  # as a shell reports it, and ``serve``
        return status - 128
    return -status if status < 0 else None


_workers: dict[str, _Worker] = {}
_lock = threading.RLock()


def start_worker(module: str) -> None:
    """Start the process of a worker's module, where it does not run, without waiting for it."""
    with _lock:
        if module not in _workers:
            _workers[module] = _Worker(module)


def ask_worker(module: str, request: bytes, *, seconds: int = SECONDS) -> bytes:
    """Return the answer of a worker's module to a request.

    Args:
        module: Its full name.
        request: What its function ``answer`` is given.
        seconds: Limit of processor time.

    Raises:
        WorkerError: It takes too much time or memory, or ended the process.
    """
    with _lock:
        start_worker(module)
        worker = _workers.pop(module)
        try:
            answer = worker.ask(request, seconds)
        except BaseException:  # Ctrl-C among others, after which the process may be at work still
            worker.close()
            raise
        _workers[module] = worker
        return answer


@atexit.register
def _end() -> None:
    for worker in _workers.values():
        worker.close()


def _forget() -> None:
    """Leave the workers to the process that this one was forked from."""
    global _lock
    _lock = threading.RLock()
    for worker in _workers.values():
        worker.disown()
    _workers.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)


def _receive(stream: IO[bytes]) -> tuple[bytes, tuple[int, int], bytes]:
    """Return the kind of a message, its limits, and its content.

    Raises:
        EOFError: There is none.
    """
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        raise EOFError
    kind, seconds, memory, size = _HEAD.unpack(head)
    content = stream.read(size)
    if len(content) < size:
        raise EOFError
    return kind, (seconds, memory), content


def serve(module: str) -> NoReturn:
    """Answer requests on standard input, each within its limits; runs in the worker's process."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is not an answer
    function = _function(module)
    _limit({"FSIZE": 0, "CORE": 0})
    while True:
        try:
            _, limits, request = _receive(sys.stdin.buffer)
        except EOFError:
            os._exit(0)
        if not _FORKS:
            _reply(function, request, answers)
            continue
        child = os.fork()
        if child == 0:
            try:
                _limit({"CPU": limits[0], "AS": _taken() + limits[1]})
                _reply(function, request, answers)
                os._exit(0)
            finally:
                os._exit(1)
        _, status = os.waitpid(child, 0)
        if status:
            os._exit(128 + os.WTERMSIG(status) if os.WIFSIGNALED(status) else 1)


def _function(module: str) -> _Answer:
    """Return the function that answers; one that raises what the import has raised."""
    try:
        function: _Answer = importlib.import_module(module).answer
    except Exception as error:
        reason = error

        def function(_request: bytes) -> bytes:
            raise reason

    return function


def _reply(function: _Answer, request: bytes, answers: IO[bytes]) -> None:
    try:
        kind, content = _DONE, function(request)
    except MemoryError:
        kind, content = _FULL, b""
    except Exception as error:
        kind, content = _FAILED, f"{type(error).__name__}: {error}".encode(errors="replace")
    if len(content) > MOST_BYTES:
        kind, content = _FULL, b""
    answers.write(_HEAD.pack(kind, 0, 0, len(content)))
    answers.write(content)
    answers.flush()


def _taken() -> int:
    """Return the bytes of address space that this process has, on Linux."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * os.sysconf("SC_PAGE_SIZE")


def _limit(limits: Mapping[str, int]) -> None:
    """Limit resources of this process, by the names that follow ``RLIMIT_``, where the system has them."""
    try:
        import resource
    except ImportError:  # on Windows
        return
    for what, most in limits.items():
        with contextlib.suppress(ValueError, OSError):
            limit = getattr(resource, f"RLIMIT_{what}")
            hard = resource.getrlimit(limit)[1]
            most = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(limit, (most, hard if what == "CPU" else most))  # at a hard one, no signal says why
