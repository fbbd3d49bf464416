"""The ``dh2sim`` program, from its start to its end; what it can do is imported when it runs."""

from __future__ import annotations

import io
import os
import signal
import sys
from types import FrameType


def main() -> None:
    """Run the command line; does not return."""
    signal.signal(signal.SIGTERM, _terminate)
    try:
        _prepare_streams()
        from dh2sim.cli.app import app

        app()
    except KeyboardInterrupt:  # outside of any command: those tell it themselves
        sys.stderr.write("dh2sim: interrupted\n")
        raise SystemExit(130) from None
    finally:
        # Python takes a while to end; a Ctrl-C meanwhile ends it at once, without a traceback
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def _terminate(number: int, _frame: FrameType | None) -> None:
    """End in good order: temporary folders are removed. The status is the one that a shell gives to such an end."""
    raise SystemExit(128 + number)


def _prepare_streams() -> None:
    """Make sure that there are streams to write to, and that they can write every character in some way."""
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
