"""The ``dh2sim`` program, from its start to its end; its commands are imported when it runs."""

from __future__ import annotations

import gc
import importlib.util
import io
import os
import signal
import sys

from dh2sim.cli.signals import INTERRUPTED, Signals


def main() -> None:
    """Run the command line; does not return."""
    signals = Signals()
    try:
        signals.listen()
        _prepare_streams()
        _prepare_imports()
        from dh2sim.cli.app import app

        app(prog_name="dh2sim")
    except BaseException:
        signals.end()
        # a module that is interrupted while it is imported may raise any error
        if signals.first is None:
            raise
        if signals.first == signal.SIGINT:
            sys.stderr.write(INTERRUPTED)
            exec("")  # if the last string of code was interrupted, Python kills itself with SIGINT at its end
        raise SystemExit(128 + signals.first) from None
    finally:
        gc.freeze()  # no search for garbage at exit; see _prepare_imports


def _prepare_imports() -> None:
    """Save CPU time of short commands, most of which goes into imports.

    Measured on ``fk``: freezing what is left at the end (in ``main``) saves 30 %, for Python searches it for garbage
    at exit; letting the collector wait for 100 000 new objects in place of 700 saves 8 %, and not searching all
    installed packages for pydantic's plugins 2 %.
    """
    gc.set_threshold(100_000)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    _prepare_glfw()


def _prepare_glfw() -> None:
    """Name glfw's own library to glfw, which MuJoCo imports.

    Otherwise it starts another Python process to find out the library's version, which takes its time, and which
    prints a traceback on Ctrl-C.
    """
    found = importlib.util.find_spec("glfw")
    if found is None or found.origin is None:
        return
    variant = "wayland" if os.environ.get("XDG_SESSION_TYPE") == "wayland" else "x11"
    library = os.path.join(os.path.dirname(found.origin), variant, "libglfw.so")
    if "PYGLFW_LIBRARY_VARIANT" not in os.environ and os.path.exists(library):
        os.environ.setdefault("PYGLFW_LIBRARY", library)


def _prepare_streams() -> None:
    """Make sure that there are streams to write to, and that they can write every character in some way."""
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
