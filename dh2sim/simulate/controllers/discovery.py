"""Controllers that are not dh2sim's own: of installed packages, and of a module of the user's."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import os
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Final

from dh2sim.errors import ControllerError
from dh2sim.robot.words import did_you_mean, listed
from dh2sim.simulate.controllers.blame import blamed, shown_path

GROUP: Final = "dh2sim.controllers"
"""Entry points of this group are controller classes."""
_MODULE: Final = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")
_CLASS: Final = re.compile(r"[^\W\d]\w*")


def plugins() -> Mapping[str, tuple[EntryPoint, ...]]:
    """Return the entry points of installed packages by name; nothing is imported."""
    found: dict[str, tuple[EntryPoint, ...]] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, entry.value)):
        if entry not in found.get(entry.name, ()):
            found[entry.name] = (*found.get(entry.name, ()), entry)
    return found


def load_plugin(name: str, entries: tuple[EntryPoint, ...]) -> type:
    """Return the controller class that an installed package offers under a name.

    Raises:
        ControllerError: more than one package offers it, or it cannot be imported, or is no class.
    """
    if len(entries) > 1:
        ways = listed((f"'{entry.value}'" for entry in entries), " or ")
        raise ControllerError(f"controller '{name}': more than one installed package has it; choose {ways}")
    with blamed(name):
        found = entries[0].load()
    return _class(name, found, f"'{entries[0].value}'")


def module_and_class(text: str) -> tuple[str, str, str] | None:
    """Take ``module:Class`` or ``module:Class:options`` apart; None if the text is neither."""
    module, _, rest = text.partition(":")
    name, _, options = rest.partition(":")
    if _MODULE.fullmatch(module.strip()) and _CLASS.fullmatch(name.strip()):
        return module.strip(), name.strip(), options
    return None


def load_class(module_name: str, class_name: str) -> type | None:
    """Import a controller class; the current directory is looked in first.

    Returns:
        The class, or None if there is no such module.

    Raises:
        ControllerError: the module cannot be imported, or has no such class.
    """
    name = f"{module_name}:{class_name}"
    with blamed(name), _from_here():
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
    """Return the SHA-256 of the file that a class is written in.

    If its bases are in other files, of the SHA-256 of all of them; dh2sim's own and Python's are left out.
    """
    sources = set()
    for base in found.__mro__:
        if base.__module__.split(".")[0] not in ("dh2sim", "builtins", "typing", "abc"):
            try:
                sources.add(inspect.getsourcefile(base))
            except TypeError:  # made in an interactive session
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
def _from_here() -> Iterator[None]:
    """Look for modules in the current directory: first while the context lasts, last from then on.

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
