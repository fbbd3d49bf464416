"""What conversions share: the run block by block, so that memory is bounded by a block, and the files they write."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dh2sim.errors import OutputError, RunDamagedError
from dh2sim.files import atomic_files
from dh2sim.simulate.store.local import LocalStore
from dh2sim.simulate.store.manifest import StoredArray
from dh2sim.simulate.store.places import open_store
from dh2sim.simulate.store.reader import StoredRun, damaged_run, open_dataset, open_run, reading
from dh2sim.simulate.store.storage import Place

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunBlocks:
    """The dataset of a run, to be read block by block."""

    dataset: xr.Dataset = field(repr=False)
    """All of it; coordinates are loaded, variables are not."""
    stored: StoredRun

    def __iter__(self) -> Iterator[tuple[range, xr.Dataset]]:
        """Yield ranges of rollouts with their part of the dataset, loaded; blank where a block is not committed.

        Raises:
            RunDamagedError: A chunk is damaged.
        """
        committed = self.stored.committed(range(self.stored.manifest.blocks))
        for block in range(self.stored.manifest.blocks):
            rollouts = self.stored.manifest.part(block)
            part = self.dataset.isel(rollout=rollouts)
            if block in committed:
                with reading(self.stored.store.name):
                    part = part.load()
            else:
                part = _blank(part, self.stored.manifest.variables)
            yield range(rollouts.start, rollouts.stop), part


def open_blocks(path: Place) -> RunBlocks:
    """Open a run.

    Raises:
        RunError: There is no run, or it is damaged.
    """
    dataset = open_dataset(path)
    with reading(path):
        dataset = dataset.assign_coords({name: labels.load() for name, labels in dataset.coords.items()})
    if not all(labels.is_unique for labels in dataset.indexes.values()):
        raise RunDamagedError(damaged_run(path))
    return RunBlocks(dataset=dataset, stored=open_run(path))


def _blank(part: xr.Dataset, variables: Mapping[str, StoredArray]) -> xr.Dataset:
    """Return a part of a run as it is before it is simulated."""
    return part.assign(
        {
            name: (variable.dims, np.full(variable.shape, variables[str(name)].fill, dtype=variable.dtype))
            for name, variable in part.data_vars.items()
        }
    )


def attribute_text(value: object) -> str:
    """Return an attribute as text: a string as it is, anything else as JSON."""
    return value if isinstance(value, str) else json.dumps(plain(value), ensure_ascii=False)


def plain(value: Any) -> Any:
    """Return NumPy's arrays and numbers as Python's lists and numbers."""
    return value.tolist() if hasattr(value, "tolist") else value


@contextmanager
def output_files(paths: Sequence[Path], *, run: Place, overwrite: bool) -> Iterator[list[Path]]:
    """Yield temporary files to write to; when the block ends well they become ``paths``, all or none.

    Args:
        paths: The files to write, all in one folder, which is made if it is missing.
        run: The run that is converted; it must not contain the files.
        overwrite: Whether existing files are replaced.

    Raises:
        OutputError: A file exists or cannot be written; what was there is unchanged.
    """
    folder = paths[0].parent
    store = open_store(run)
    if isinstance(store, LocalStore) and folder.resolve().is_relative_to(store.path.resolve()):
        raise OutputError(f"'{paths[0]}' would be inside the run '{store.name}'; name a file elsewhere")
    _refuse_existing(paths, overwrite=overwrite)
    with atomic_files(folder) as staging:
        yield [staging / path.name for path in paths]
        _refuse_existing(paths, overwrite=overwrite)


def refuse_folder(path: Path) -> None:
    """Raise an OutputError if the path of an output file is a folder."""
    if path.is_dir():
        raise OutputError(f"'{path}' is a folder; name a file")


def _refuse_existing(paths: Sequence[Path], *, overwrite: bool) -> None:
    for path in paths:
        refuse_folder(path)
    existing = [f"'{path}'" for path in paths if os.path.lexists(path)]
    if existing and not overwrite:
        exist, them = ("exists", "it") if len(existing) == 1 else ("exist", "them")
        raise OutputError(f"{' and '.join(existing)} already {exist}; overwrite {them}, or name another file")
