"""How a place is opened: a folder, or an object store."""

from __future__ import annotations

import re
from os import fspath
from pathlib import Path, PurePath
from typing import Final

from dh2sim.arguments import file_path
from dh2sim.errors import RunError
from dh2sim.simulate.store.local import LocalStore
from dh2sim.simulate.store.objects import ObjectStore
from dh2sim.simulate.store.storage import Place

_LOST_SLASH: Final = re.compile(r"^(s3:)/(?=[^/])", re.IGNORECASE)
_SCHEME: Final = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+)://")


def open_store(place: Place) -> LocalStore | ObjectStore:
    """Return the store at a place, whether there is a run or not.

    Raises:
        RunError: The place is of a kind that is not known.
        MissingExtraError: It is an object store, and the library for those is not installed.
    """
    file_path("the place of a run", place)
    text = fspath(place)
    if isinstance(place, PurePath):  # which makes one slash of two, and on Windows a backslash
        text = _LOST_SLASH.sub(r"\1//", place.as_posix())
    scheme = _SCHEME.match(text)
    if scheme is None:
        return LocalStore(Path(place))
    if scheme[1].lower() != "s3":
        raise RunError(f"'{text}' cannot be opened: runs are in folders, or in object stores as s3://BUCKET/NAME")
    return ObjectStore(text)
