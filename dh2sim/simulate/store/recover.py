"""A run that stands: whether it is the one that is asked for, and its metadata as they should be."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from dh2sim.errors import RunDamagedError, RunDiffersError, RunError
from dh2sim.simulate.dataset_layout import FORMAT, Layout
from dh2sim.simulate.store.files import PARTIAL, put, remove, sync_folder
from dh2sim.simulate.store.identity import differences
from dh2sim.simulate.store.place import is_run, not_a_run
from dh2sim.simulate.store.seal import COORDINATES, make_seal, seals, stored_attributes


def adopt(path: Path, layout: Layout) -> Layout:
    """Return a layout with the block size and the attributes of the run that stands at a path.

    Attributes that a user added are kept. If those of the run are damaged, and the layout's with the time and command
    of the seal are what was sealed, then these are what stood there.

    Raises:
        RunError: there is no run there, or its layout is of another version.
        RunDiffersError: it was made with other settings.
        RunDamagedError: its attributes are damaged, and the layout's are others.
    """
    if not is_run(path):
        raise RunError(not_a_run(path))
    attributes = stored_attributes(path)
    copies = list(seals(path))
    for seal in copies if attributes else ():
        if attributes and seal.fits(attributes):
            check_format(path, attributes.get("dh2sim_run"))
            found = differences(attributes, seal, layout)
            if found:
                raise RunDiffersError(
                    f"'{path}' was made with other settings: {'; '.join(found)}. "
                    "Give the same options, or write to another --out"
                )
            attributes.pop(COORDINATES, None)
            return replace(layout, attributes=attributes, block=seal.block)
    for seal in copies:
        rebuilt = replace(layout, attributes={**layout.attributes, **seal.own}, block=seal.block)
        if seal.digest == make_seal(rebuilt, rebuilt.attributes).digest:
            return rebuilt
    raise RunDamagedError(
        f"'{path / 'zarr.json'}' is damaged. It can be mended with the options and versions that the run was "
        "made with; these are others, or too much is lost. Give the same, or write to another --out"
    )


def check_format(path: Path, version: object) -> None:
    """Refuse a layout that this version of dh2sim does not know.

    Raises:
        RunError: it is another.
    """
    if version != FORMAT:
        raise RunError(
            f"'{path}' was made by another version of dh2sim: its layout is {version!r}, "
            f"and this version reads {FORMAT}"
        )


def mend(path: Path, skeleton: dict[str, bytes]) -> None:
    """Rewrite metadata and coordinates that are not what they should be, and remove files that were never finished.

    Raises:
        OSError: a file cannot be written.
    """
    folders = {(path / relative).parent for relative in skeleton}
    for folder in sorted(folders):
        if not folder.is_dir():
            folder.mkdir(parents=True)
            sync_folder(folder.parent)
        for name in os.listdir(folder):
            if name.startswith(".") and name.endswith(PARTIAL):
                remove(folder / name)
    for relative, data in skeleton.items():
        if not _holds(path / relative, data):
            put(path / relative, data)


def _holds(path: Path, data: bytes) -> bool:
    try:
        return path.stat().st_size == len(data) and path.read_bytes() == data
    except OSError:
        return False
