"""Failures of code that is not dh2sim's own, told by their text and place, without a traceback."""

from __future__ import annotations

import functools
import os
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from dh2sim.errors import ControllerError, Dh2simError
from dh2sim.simulate.controllers.protocol import Controller

_METHODS = ("control", "controls", "reference")
_DH2SIM = Path(__file__).parents[2]
_INSTALLED = {"site-packages", "dist-packages"}
"""Folders of installed libraries."""


@contextmanager
def blamed(name: str) -> Iterator[None]:
    """Turn what a user's code raises into an error that says what was raised and where.

    Args:
        name: of the controller, as typed.

    Raises:
        ControllerError: the code raised an exception that is not dh2sim's.
    """
    try:
        yield
    except Dh2simError:
        raise
    except (Exception, SystemExit) as error:
        raise ControllerError(f"controller '{name}': {_what(error)}{_where(error)}") from error


def guarded(name: str, controller: Controller) -> Controller:
    """Return a controller that does the same, whose failures are told by ``blamed``."""
    methods = {}
    for method in _METHODS:
        if callable(getattr(controller, method, None)):
            methods[method] = _guarded(name, getattr(controller, method))
    return cast("Controller", SimpleNamespace(**methods))


def shown_path(path: str | os.PathLike[str]) -> str:
    """Return how a message names a file: from the current directory on if it is below that."""
    absolute = Path(path).absolute()
    return str(absolute.relative_to(Path.cwd()) if absolute.is_relative_to(Path.cwd()) else absolute)


def _guarded(name: str, method: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(method)
    def call(*args: Any, **kwargs: Any) -> Any:
        with blamed(name):
            return method(*args, **kwargs)

    return call


def _what(error: BaseException) -> str:
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _where(error: BaseException) -> str:
    """Name the deepest line of the traceback in a file of the user's, or of the library that is not dh2sim's own."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        return f" ({shown_path(error.filename)}, line {error.lineno})"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not _of_python_or_dh2sim(f.filename)]
    own = [f for f in frames if not _installed(f.filename)] or [f for f in frames if f.filename == frames[0].filename]
    return f" ({shown_path(own[-1].filename)}, line {own[-1].lineno})" if own else ""


def _installed(file: str) -> bool:
    return not _INSTALLED.isdisjoint(Path(file).parts)


def _of_python_or_dh2sim(file: str) -> bool:
    of_python = Path(file).is_relative_to(Path(os.__file__).parent) and not _installed(file)
    return of_python or file.startswith("<") or Path(file).is_relative_to(_DH2SIM)
