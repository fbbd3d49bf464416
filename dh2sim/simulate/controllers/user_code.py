"""Controllers of installed packages and of users' modules; their failures become errors that name the line."""

from __future__ import annotations

import functools
import hashlib
import importlib
import inspect
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, cast

from dh2sim.errors import ControllerError, Dh2simError
from dh2sim.messages import did_you_mean, listed
from dh2sim.simulate.controllers.protocol import Controller

_METHODS = ("control", "controls", "reference")
_DH2SIM = Path(__file__).parents[2]
_INSTALLED = {"site-packages", "dist-packages"}
"""Folders of installed libraries."""


@contextmanager
def user_code(name: str) -> Iterator[None]:
    """Turn what a user's code raises into an error that says what was raised and where.

    Args:
        name: Name of the controller, as typed.

    Raises:
        ControllerError: The code raised an exception other than dh2sim's.
    """
    try:
        yield
    except Dh2simError:
        raise
    except (Exception, SystemExit) as error:
        raise ControllerError(f"controller '{name}': {what_and_where(error)}") from error


def guard_methods(name: str, controller: Controller) -> Controller:
    """Return a controller whose methods do the same, with their failures reported by ``user_code``."""
    methods = {}
    for method in _METHODS:
        if callable(getattr(controller, method, None)):
            methods[method] = _guard(name, getattr(controller, method))
    return cast("Controller", SimpleNamespace(**methods))


def shown_path(path: str | os.PathLike[str]) -> str:
    """Return how a message names a file: relative to the current directory if it is inside it."""
    absolute = Path(path).absolute()
    return str(absolute.relative_to(Path.cwd()) if absolute.is_relative_to(Path.cwd()) else absolute)


def _guard(name: str, method: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(method)
    def call(*args: Any, **kwargs: Any) -> Any:
        with user_code(name):
            return method(*args, **kwargs)

    return call


def what_and_where(error: BaseException) -> str:
    """Return what a user's code raised, and in which line of which file."""
    return f"{_what(error)}{_where(error)}"


def _what(error: BaseException) -> str:
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _where(error: BaseException) -> str:
    """Return the deepest line of the traceback in a file of the user, or else of the library outside dh2sim."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        return f" ({shown_path(error.filename)}, line {error.lineno})"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not _of_python_or_dh2sim(f.filename)]
    own = [f for f in frames if not _installed(f.filename)] or [f for f in frames if f.filename == frames[0].filename]
    return f" ({shown_path(own[-1].filename)}, line {own[-1].lineno})" if own else ""


def _installed(file: str) -> bool:
    return not _INSTALLED.isdisjoint(Path(file).parts)


def _of_python_or_dh2sim(file: str) -> bool:
    # importlib_metadata, where a package brings it, takes the place of Python's own importlib.metadata
    path = Path(file)
    of_python = (path.is_relative_to(Path(os.__file__).parent) and not _installed(file)) or (
        "importlib_metadata" in path.parts
    )
    return of_python or file.startswith("<") or path.is_relative_to(_DH2SIM)


ENTRY_POINTS: Final = "dh2sim.controllers"
"""Entry points of this group are controller classes."""
_MODULE: Final = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")
_CLASS: Final = re.compile(r"[^\W\d]\w*")


def plugins() -> Mapping[str, tuple[EntryPoint, ...]]:
    """Return the entry points of installed packages by name; nothing is imported."""
    found: dict[str, tuple[EntryPoint, ...]] = {}
    for entry in sorted(entry_points(group=ENTRY_POINTS), key=lambda entry: (entry.name, entry.value)):
        if entry not in found.get(entry.name, ()):
            found[entry.name] = (*found.get(entry.name, ()), entry)
    return found


def load_plugin(name: str, entries: tuple[EntryPoint, ...]) -> type:
    """Return the controller class that an installed package offers under a name.

    Raises:
        ControllerError: More than one package offers it, or it cannot be imported, or is not a class.
    """
    if len(entries) > 1:
        choices = listed((f"'{entry.value}'" for entry in entries), " or ")
        raise ControllerError(f"controller '{name}': more than one installed package has it; choose {choices}")
    with user_code(name):
        found = entries[0].load()
    return _class(name, found, f"'{entries[0].value}'")


def module_and_class(text: str) -> tuple[str, str, str] | None:
    """Split ``module:Class`` or ``module:Class:options``; None if the text is neither."""
    module, _, rest = text.partition(":")
    name, _, options = rest.partition(":")
    if _MODULE.fullmatch(module.strip()) and _CLASS.fullmatch(name.strip()):
        return module.strip(), name.strip(), options
    return None


def load_class(module_name: str, class_name: str) -> type | None:
    """Import a controller class, searching the current directory first.

    Returns:
        The class, or None if the module is not found.

    Raises:
        ControllerError: The module cannot be imported, or does not have the class.
    """
    name = f"{module_name}:{class_name}"
    with user_code(name), from_here():
        try:
            module = importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            if error.name is not None and (module_name == error.name or module_name.startswith(f"{error.name}.")):
                return None
            raise
    where = f"module '{module_name}'"
    if getattr(module, "__file__", None):
        where += f" ({shown_path(str(module.__file__))})"
    if not hasattr(module, class_name):
        classes = [key for key, value in vars(module).items() if _is_candidate(value, module_name)]
        raise ControllerError(
            f"controller '{name}': {where} has no class '{class_name}'.{did_you_mean(class_name, classes)} "
            f"It has: {listed(classes)}"
        )
    return _class(name, getattr(module, class_name), f"'{class_name}' of {where}")


def source_digest(found: type) -> str:
    """Return the SHA-256 of the file that defines a class.

    If its bases are in other files, that of the SHA-256 of all of them; those of dh2sim and Python are left out.
    """
    sources = set()
    for base in found.__mro__:
        if base.__module__.split(".")[0] not in ("dh2sim", "builtins", "typing", "abc"):
            try:
                sources.add(inspect.getsourcefile(base))
            except (OSError, TypeError):  # defined in an interactive session
                continue
    digests = [hashlib.sha256(Path(source).read_bytes()) for source in sorted(filter(None, sources))]
    if len(digests) < 2:
        return digests[0].hexdigest() if digests else ""
    return hashlib.sha256(b"".join(digest.digest() for digest in digests)).hexdigest()


def _class(name: str, found: object, what: str) -> type:
    if not isinstance(found, type):
        raise ControllerError(f"controller '{name}': {what} is not a class")
    return found


def _is_candidate(value: object, module_name: str) -> bool:
    return isinstance(value, type) and value.__module__ == module_name and not value.__name__.startswith("_")


@contextmanager
def from_here() -> Iterator[None]:
    """Search the current directory for modules: first while the context lasts, and last afterwards.

    Last, so that code which imports something later finds it, and no file there hides an installed library.
    """
    here = os.getcwd()
    sys.path.insert(0, here)
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path.remove(here)
        if here not in sys.path and "" not in sys.path:
            sys.path.append(here)
