"""What a run on disk consists of: the manifest, kept once and verified by a digest, never restored.

The attributes of the run and the metadata of its arrays are in ``zarr.json`` of the root group. The manifest, which
is the attributes of the group ``blocks``, names those that belong to the run and holds their digest. It is written
once. Each block adds one record of its own to ``blocks/record``, which repeats the digest; nothing is shared between
the blocks, so that each may be written by another process.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from dh2sim.errors import RunDamagedError, RunError
from dh2sim.simulate.dataset_layout import FORMAT as LAYOUT_FORMAT

FORMAT: Final = 2
"""Version of the manifest and the records."""
BLOCKS: Final = "blocks"
"""Group that holds the manifest as its attributes, and the records."""
RECORD: Final = "record"
"""Array of texts in ``BLOCKS``: the records of committed blocks."""
COORDINATES: Final = "coordinates"
"""Attribute by which xarray tells coordinates from variables (CF conventions, section 5); not one of the run."""
METADATA: Final = "zarr.json"
_MARK, _STORE_MARK = "dh2sim_run", "dh2sim_store"
"""Attributes of the root group and of ``BLOCKS`` that only runs have: versions of the dataset and of the manifest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredArray:
    """An array of a run as its metadata describe it."""

    dtype: str
    """As NumPy names it."""
    dimensions: tuple[str, ...]
    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    attributes: Mapping[str, Any]

    @property
    def empty(self) -> bool:
        """Whether it has no elements, and so no chunks."""
        return 0 in self.shape

    def chunk_name(self, block: int) -> str:
        """Return the name of the file with a block's elements."""
        return ".".join(["c", str(block), *("0" for _ in self.shape[1:])])


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What a run consists of."""

    attributes: Mapping[str, Any]
    """Those of the root group, with any that a user added."""
    coordinates: Mapping[str, StoredArray]
    variables: Mapping[str, StoredArray]
    digest: str
    """SHA-256 of the metadata of the root group and its arrays, without what a user added."""
    nodes: Mapping[str, Mapping[str, Any]] = field(repr=False)
    """Zarr's metadata of every array, by its path."""

    @property
    def rollouts(self) -> int:
        """Number of rollouts."""
        return self._any.shape[0]

    @property
    def block(self) -> int:
        """Rollouts in a block; the last one may be smaller."""
        return self._any.chunk[0]

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return -(-self.rollouts // self.block)

    def part(self, block: int) -> slice:
        """Return the rollouts of a block."""
        return slice(block * self.block, min((block + 1) * self.block, self.rollouts))

    @property
    def _any(self) -> StoredArray:
        return next(iter(self.variables.values()))


def manifest_attributes(
    root: Mapping[str, Any], coordinates: Sequence[str], variables: Sequence[str]
) -> dict[str, Any]:
    """Return the attributes of the group ``BLOCKS`` of a new run.

    Args:
        root: Metadata of the root group, consolidated.
        coordinates: Names of the coordinates.
        variables: Names of the variables.
    """
    names = {"attributes": list(root["attributes"]), "coordinates": list(coordinates), "variables": list(variables)}
    return {_STORE_MARK: FORMAT, **names, "digest": _digest(_own(root, names))}


def is_run(path: Path) -> bool:
    """Return whether a folder is a run of dh2sim, even a damaged one.

    Raises:
        RunError: Its metadata may not be read.
    """
    return _marked(*_group_nodes(path))


def read_manifest(path: Path) -> Manifest:
    """Return the manifest of a run.

    Raises:
        RunError: There is no run, or it is one of another version of dh2sim.
        RunDamagedError: Its metadata are damaged.
    """
    if not path.exists():
        raise RunError(f"there is no '{path}'")
    root, blocks = _group_nodes(path)
    if not _marked(root, blocks):
        raise RunError(f"'{path}' is not a run of dh2sim")
    if root is None or blocks is None:
        raise damaged_metadata((path if root is None else path / BLOCKS) / METADATA)
    stored, attributes = _attributes(blocks), _attributes(root)
    for version, known in ((stored.get(_STORE_MARK, 1), FORMAT), (attributes.get(_MARK), LAYOUT_FORMAT)):
        if version is not None and version != known:
            raise RunError(
                f"'{path}' was written by another version of dh2sim: its format is {version!r}, "
                f"and this version reads {known}"
            )
    try:
        own = _own(root, stored)
        sound = stored["digest"] == _digest(own) and (blocks["zarr_format"], blocks["node_type"]) == (3, "group")
    except (KeyError, TypeError):
        sound = False
    if not sound:
        raise damaged_metadata(path / METADATA, path / BLOCKS / METADATA)
    nodes = own["consolidated_metadata"]["metadata"]
    return Manifest(
        attributes={name: value for name, value in attributes.items() if name != COORDINATES},
        coordinates={name: _stored_array(nodes[name]) for name in stored["coordinates"]},
        variables={name: _stored_array(nodes[name]) for name in stored["variables"]},
        digest=stored["digest"],
        nodes={name: node for name, node in nodes.items() if name != BLOCKS},
    )


def damaged_metadata(*files: Path) -> RunDamagedError:
    """Return the error for metadata that are not what was written; of several files one is damaged."""
    names = " or ".join(f"'{file}'" for file in files)
    return RunDamagedError(
        f"{names} is missing or damaged and cannot be restored; "
        "resume with the same options in a new folder, which computes the same bits"
    )


def read_node(file: Path) -> dict[str, Any] | None:
    """Return zarr's metadata of a group or an array, or None if they cannot be parsed.

    Raises:
        RunError: The file may not be read.
    """
    try:
        node = json.loads(file.read_bytes())
    except PermissionError as error:
        raise RunError(f"cannot read '{file}': {error.strerror}") from error
    except (OSError, ValueError, RecursionError):
        return None
    return node if isinstance(node, dict) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockRecord:
    """The record that commits a block."""

    block: int
    run: str
    """Digest of the run's manifest."""
    seconds: float
    """Wall time that the block took."""
    checksums: Mapping[str, int]
    """CRC-32C of the chunk of every variable that is not empty."""

    def to_text(self) -> str:
        """Return the record as JSON."""
        return json.dumps({name: getattr(self, name) for name in self.__dataclass_fields__})

    @staticmethod
    def from_text(text: str) -> BlockRecord | None:
        """Read a record; None if the text is not one."""
        try:
            return BlockRecord(**json.loads(text))
        except (TypeError, ValueError):
            return None


def _group_nodes(path: Path) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    return read_node(path / METADATA), read_node(path / BLOCKS / METADATA)


def _marked(root: dict[str, Any] | None, blocks: dict[str, Any] | None) -> bool:
    return _MARK in _attributes(root) or _STORE_MARK in _attributes(blocks)


def _attributes(node: Mapping[str, Any] | None) -> dict[str, Any]:
    attributes = None if node is None else node.get("attributes")
    return attributes if isinstance(attributes, dict) else {}


def _stored_array(node: Mapping[str, Any]) -> StoredArray:
    return StoredArray(
        dtype=str(node["data_type"]),
        dimensions=tuple(node["dimension_names"]),
        shape=tuple(node["shape"]),
        chunk=tuple(node["chunk_grid"]["configuration"]["chunk_shape"]),
        attributes=node["attributes"],
    )


def _own(root: Mapping[str, Any], names: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """Return the root's metadata without what a user added.

    Raises:
        KeyError, TypeError: Something is missing or not of its type.
    """
    consolidated, arrays = root["consolidated_metadata"], (*names["coordinates"], *names["variables"])
    nodes = {name: consolidated["metadata"][name] for name in (*arrays, f"{BLOCKS}/{RECORD}")}
    nodes[BLOCKS] = {**consolidated["metadata"][BLOCKS], "attributes": {}}  # the manifest
    attributes = {name: root["attributes"][name] for name in names["attributes"]}
    return {**root, "attributes": attributes, "consolidated_metadata": {**consolidated, "metadata": nodes}}


def _digest(own: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(own, sort_keys=True).encode()).hexdigest()
