"""The ``dh2sim`` program, from its start to its end; its commands are imported when it runs."""

from __future__ import annotations

import _thread
import gc
import io
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable
from types import FrameType


def main() -> None:
    """Run the command line; does not return."""
    interruptions: list[int] = []

    def interrupt(number: int, _frame: FrameType | None) -> None:
        interruptions.append(number)
        _cut_off()
        raise KeyboardInterrupt

    _handle(signal.SIGINT, interrupt)
    _handle(signal.SIGTERM, _terminate)
    sys.unraisablehook = interrupt_again
    try:
        _prepare_streams()
        _prepare_imports()
        from dh2sim.cli.app import app

        app(prog_name="dh2sim")
    except BaseException:
        # a module that is interrupted while it is imported may raise any error
        if not interruptions:
            raise
        sys.stderr.write("dh2sim: interrupted\n")
        raise SystemExit(130) from None
    finally:
        gc.freeze()  # no search for garbage at exit; see _prepare_imports
        # Python takes a while to end; a Ctrl-C meanwhile ends it at once, without a traceback
        _handle(signal.SIGINT, signal.SIG_DFL)


def _handle(kind: signal.Signals, handler: Callable[[int, FrameType | None], None] | signal.Handlers) -> None:
    """Handle a signal, unless the program was started with it ignored, as by 'nohup'."""
    if signal.getsignal(kind) is not signal.SIG_IGN:
        signal.signal(kind, handler)


def _terminate(number: int, _frame: FrameType | None) -> None:
    """End in good order: temporary folders are removed. The status is what a shell reports for this signal."""
    _cut_off()
    raise SystemExit(128 + number)


def _cut_off() -> None:
    """Suppress the warnings of libraries whose coroutines are cut off by an end at any moment."""
    warnings.filterwarnings("ignore", message="coroutine .* was never awaited", category=RuntimeWarning)


def interrupt_again(error: sys.UnraisableHookArgs) -> None:
    """Repeat a signal whose exception came to nothing, as in a callback of the garbage collector."""
    match error.exc_value:
        case KeyboardInterrupt():
            kind = signal.SIGINT
        case SystemExit():
            kind = signal.SIGTERM
        case _:
            sys.__unraisablehook__(error)
            return
    threading.Timer(0.01, _signal_main_thread, [kind]).start()


def _signal_main_thread(kind: signal.Signals) -> None:
    if hasattr(signal, "pthread_kill"):  # wakes the main thread, which may be asleep by now
        signal.pthread_kill(threading.main_thread().ident or 0, kind)
    else:
        _thread.interrupt_main(kind)


def _prepare_imports() -> None:
    """Save CPU time of short commands, most of which goes into imports.

    Measured on ``fk``: freezing what is left at the end (in ``main``) saves 30 %, for Python searches it for garbage
    at exit; letting the collector wait for 100 000 new objects in place of 700 saves 8 %, and not searching all
    installed packages for pydantic's plugins 2 %.
    """
    gc.set_threshold(100_000)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


def _prepare_streams() -> None:
    """Make sure that there are streams to write to, and that they can write every character in some way."""
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
