"""Opening a run's dataset, finished or not."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dh2sim.errors import RunDamagedError, RunError
from dh2sim.extras import require_extra
from dh2sim.simulate.store.place import is_run
from dh2sim.simulate.store.recover import check_format
from dh2sim.simulate.store.seal import BLOCKS, CHECKSUM, Seal, seals, stored_attributes

if TYPE_CHECKING:
    import xarray


def open_dataset(path: str | PathLike[str]) -> xarray.Dataset:
    """Open a run's dataset; numbers are read when they are looked at.

    Of rollouts that are not run yet ``status`` is -1 and numbers are NaN. Wrap what looks at numbers in ``reading``.

    Raises:
        RunError: there is no run.
        RunDamagedError: its metadata or coordinates are damaged, or committed chunks are missing.
        MissingExtraError: xarray is not installed.
    """
    require_extra("data", "xarray", what="a run as an xarray dataset")
    import xarray

    path = Path(path)
    attributes = read_attributes(path)
    with reading(path):
        dataset = xarray.open_dataset(path, engine="zarr", chunks=None)
        missing = _lacks_chunks(path, read_seal(path, attributes), dataset)
    if missing:  # zarr would fill them with blanks
        raise RunDamagedError(damaged(path))
    return dataset


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what zarr raises of a damaged chunk into an error for users; put nothing but reading into it.

    Raises:
        RunDamagedError: something that is read is damaged.
    """
    try:
        yield
    except (OSError, ValueError, RuntimeError, KeyError, TypeError) as error:
        raise RunDamagedError(damaged(path)) from error


def damaged(path: Path) -> str:
    """Return the words for a run that cannot be read."""
    return f"'{path}' is damaged; `dh2sim rollout` with the options it was made with and --resume mends it"


def read_attributes(path: Path) -> dict[str, Any]:
    """Return a run's attributes.

    Raises:
        RunError: there is no run, or its layout is of another version.
        RunDamagedError: they cannot be read.
    """
    if not path.exists():
        raise RunError(f"there is no '{path}'")
    if not is_run(path):
        raise RunError(f"'{path}' is not a run of dh2sim")
    attributes = stored_attributes(path)
    if attributes is None or "dh2sim_run" not in attributes:
        raise RunDamagedError(damaged(path))
    check_format(path, attributes["dh2sim_run"])
    return attributes


def read_seal(path: Path, attributes: dict[str, Any]) -> Seal:
    """Return what a run's blocks are made of.

    Raises:
        RunDamagedError: neither copy fits the attributes.
    """
    for seal in seals(path):
        if seal.fits(attributes):
            return seal
    raise RunDamagedError(damaged(path))


def _lacks_chunks(path: Path, seal: Seal, dataset: xarray.Dataset) -> bool:
    """Tell whether chunks of coordinates or of committed blocks are missing, without opening any."""
    if any(
        coordinate.size and not (path / str(name) / "c.0").is_file() for name, coordinate in dataset.coords.items()
    ):
        return True
    records = [name.split(".")[1] for name in os.listdir(path / BLOCKS / CHECKSUM) if name.startswith("c.")]
    for name, stored in seal.variables.items():
        there = set(os.listdir(path / name))
        if not stored.empty and any(stored.chunk_key.format(block) not in there for block in records):
            return True
    return False
