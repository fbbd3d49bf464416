"""The end of the program on SIGINT (Ctrl-C) or SIGTERM, whatever it is doing at that moment.

The handler raises an exception in the main thread. That alone is not enough: Python drops what is raised in a
finalizer or in a callback of the garbage collector, and libraries may catch it, as some do while they are imported.
So a thread repeats the signal until the program ends. A repetition raises nothing while the exception is on its way,
so that cleaning up is not disturbed; only a second signal from outside cuts it short.

Before the program listens, and once it has ended, a signal ends the process at once, with the same words and the same
status.
"""

from __future__ import annotations

import _thread
import atexit
import contextlib
import os
import signal
import sys
import warnings
from collections.abc import Callable
from types import FrameType

PAUSE = 0.05
"""s between repetitions of a signal."""


def leave_on_signals() -> None:
    """Let SIGINT and SIGTERM end the process at once."""
    _install(signal.SIGINT, _leave)
    _install(signal.SIGTERM, _leave)


def _leave(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
    if number == signal.SIGINT:
        os.write(2, INTERRUPTED.encode())
    os._exit(128 + number)


INTERRUPTED = "dh2sim: interrupted\n"


class Signals:
    """Turns SIGINT into KeyboardInterrupt, and SIGTERM into SystemExit with the status that a shell reports."""

    def __init__(self) -> None:
        """Prepare to listen."""
        self.first: int | None = None
        """The first signal that arrived."""
        self._ended = False
        self._repeated = False
        """Whether the signal under way is a repetition."""
        self._sending = _thread.allocate_lock()
        self._over = _thread.allocate_lock()
        """Held until the program ends."""
        self._over.acquire()
        self._repeating = _thread.allocate_lock()
        """Held by the thread that repeats a signal."""
        self._handler = self._handle
        self._main_thread = _thread.get_ident()

    def listen(self) -> None:
        """Handle signals from now on."""
        _install(signal.SIGINT, self._handler)
        _install(signal.SIGTERM, self._handler)
        atexit.register(_ignore_late_interrupts)  # the first to be registered is the last to be called
        sys.unraisablehook = self._report_dropped

    def end(self) -> None:
        """Let signals end the process at once from now on: Python itself takes a while to end.

        Python before 3.11.3 crashes where a thread begins to run while it ends, so the one here is waited for.
        """
        self._ended = True
        self._over.release()
        with self._sending:  # no repetition is on its way any more
            leave_on_signals()
        self._repeating.acquire(timeout=1.0)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        repeated, self._repeated = self._repeated, False
        if self._ended:
            return
        if self.first is None:
            self.first = number
            # libraries warn of coroutines that are cut off
            warnings.filterwarnings("ignore", message="coroutine .* was never awaited", category=RuntimeWarning)
            # a threading.Thread takes locks, which the interrupted code may hold
            self._repeating.acquire()
            _thread.start_new_thread(self._repeat, ())
        if self._is_reporting(frame) or (repeated and _is_ending()):
            return
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        raise SystemExit(128 + number)

    def _repeat(self) -> None:
        """Repeat the first signal until the program ends."""
        assert self.first is not None
        while not self._over.acquire(timeout=PAUSE):
            with self._sending:
                if self._ended:
                    break
                # whoever has installed another handler meanwhile waits for signals from outside
                if signal.getsignal(self.first) == self._handler:
                    self._repeated = True
                    self._interrupt_main_thread(self.first)
        self._repeating.release()

    def _interrupt_main_thread(self, number: int) -> None:
        if hasattr(signal, "pthread_kill"):  # wakes the main thread, which may be asleep
            signal.pthread_kill(self._main_thread, number)
        else:
            _thread.interrupt_main(signal.Signals(number))

    def _report_dropped(self, error: sys.UnraisableHookArgs) -> None:
        """Report an exception that Python drops, unless it is that of a signal, which is repeated."""
        if self.first is None or not isinstance(error.exc_value, KeyboardInterrupt | SystemExit):
            sys.__unraisablehook__(error)

    def _is_reporting(self, frame: FrameType | None) -> bool:
        """Return whether ``_report_dropped`` is interrupted: Python reports what is raised there."""
        while frame is not None:
            if frame.f_code is Signals._report_dropped.__code__:
                return True
            frame = frame.f_back
        return False


def _is_ending() -> bool:
    """Return whether the main thread is cleaning up after an exception that ends the program."""
    error = sys.exception()
    while error is not None:
        if isinstance(error, KeyboardInterrupt | SystemExit):
            return True
        error = error.__context__
    return False


def _install(kind: signal.Signals, handler: Callable[[int, FrameType | None], None] | signal.Handlers) -> None:
    """Handle a signal, unless the program was started with it ignored, as by 'nohup'."""
    if signal.getsignal(kind) is not signal.SIG_IGN:
        signal.signal(kind, handler)


def _ignore_late_interrupts() -> None:
    """Ignore SIGINT in the last milliseconds of Python's end, where it runs no handlers: all is done and written."""
    with contextlib.suppress(Exception):  # which Python itself reports
        sys.stdout.flush()
    _install(signal.SIGINT, signal.SIG_IGN)
