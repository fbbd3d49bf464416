"""Optional dependencies, which come with extras of the package: ``pip install 'dh2sim[view]'``."""

from __future__ import annotations

from importlib.util import find_spec

from dh2sim.errors import MissingExtraError


def require_extra(extra: str, *modules: str, what: str) -> None:
    """Check that optional modules are installed, without importing them.

    Call it before the first of them is imported, and before any work that would be lost.

    Args:
        extra: the extra of the package that brings them.
        modules: their top-level names.
        what: needs them, for the message.

    Raises:
        MissingExtraError: one of them is not installed; the text says how to install it.
    """
    if not all(map(_installed, modules)):
        raise MissingExtraError(f"{what} needs the extra '{extra}': pip install 'dh2sim[{extra}]'")


def _installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ImportError:
        return False
