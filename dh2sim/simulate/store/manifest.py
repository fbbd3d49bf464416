"""What a run on disk consists of: the manifest, kept once and verified by a digest, never restored.

The attributes of the run and the metadata of its arrays are in ``zarr.json`` of the root group. The manifest, which
is the attributes of the group ``blocks``, names those that belong to the run and holds their digest. It is written
once. Each block adds one record of its own to ``blocks/record``, which repeats the digest; nothing is shared between
the blocks, so that each may be written by another process.

A run may come from a stranger. Its metadata are compared with what dh2sim writes before a library sees them: codecs,
types and names are those of a short list, and sizes are bounded by files that are there.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from dh2sim.errors import RunDamagedError, RunError
from dh2sim.messages import listed, shown
from dh2sim.simulate.dataset_layout import FORMAT as LAYOUT_FORMAT
from dh2sim.simulate.options import MOST_ROLLOUTS, MOST_STEPS
from dh2sim.simulate.store.codec import ITEM_SIZES, LARGEST_CHUNK, READABLE_CODECS, is_known, largest_chunk_file
from dh2sim.simulate.store.storage import Store

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
MOST_METADATA: Final = 64 * 2**20
"""Bytes of a file of metadata, which holds the MJCF of the robot."""
MOST_VALUES: Final = 2_000_000
"""In a file of metadata, each of which takes some hundred bytes of memory; its long texts have few commas."""
MOST_BLOCKS: Final = 100_000
_NAME: Final = re.compile("[A-Za-z][A-Za-z0-9_]*")
_KEYS: Final = {"name": "default", "configuration": {"separator": "."}}
_ATTRIBUTES: Final[dict[str, type | tuple[type, ...]]] = {
    "robot": str,
    "command": str,
    "created": str,
    "integrator": str,
    "timestep": (int, float),
    "versions": dict,
    "randomize": dict,
    "settings": dict,
    "settings.controller": str,
    "settings.start": str,
    "settings.steps": int,
    "settings.every": int,
    "settings.seed": int,
}
"""Attributes that readers use, with their types."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredArray:
    """An array of a run as its metadata describe it."""

    dtype: str
    """As NumPy names it."""
    dimensions: tuple[str, ...]
    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    fill: float | int | str
    """Value where nothing was recorded."""
    attributes: Mapping[str, Any]

    @property
    def empty(self) -> bool:
        """Whether it has no elements, and so no chunks."""
        return 0 in self.shape

    @property
    def largest_file(self) -> int:
        """Bytes that the file of a chunk may have."""
        return largest_chunk_file(self.chunk, self.dtype)

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


def is_run(store: Store) -> bool:
    """Return whether there is a run of dh2sim, even a damaged one.

    Raises:
        RunError: Its metadata may not be read.
    """
    return _marked(*_group_nodes(store))


def read_manifest(store: Store) -> Manifest:
    """Return the manifest of a run.

    Raises:
        RunError: There is no run, or it is one of another version of dh2sim.
        RunDamagedError: Its metadata are damaged.
    """
    root, blocks = _group_nodes(store)
    if not _marked(root, blocks):
        raise RunError(f"'{store.name}' is not a run of dh2sim" if store.exists() else f"there is no '{store.name}'")
    if root is None or blocks is None:
        raise damaged_metadata(store.file(METADATA if root is None else f"{BLOCKS}/{METADATA}"))
    stored, attributes = _attributes(blocks), _attributes(root)
    for version, known in ((stored.get(_STORE_MARK, 1), FORMAT), (attributes.get(_MARK), LAYOUT_FORMAT)):
        if version is not None and version != known:
            raise RunError(
                f"'{store.name}' was written by another version of dh2sim: its format is {version!r}, "
                f"and this version reads {known}"
            )
    try:
        own = _own(root, stored)
        sound = stored["digest"] == _digest(own) and (blocks["zarr_format"], blocks["node_type"]) == (3, "group")
    except (KeyError, TypeError):
        sound = False
    if not sound:
        raise damaged_metadata(store.file(METADATA), store.file(f"{BLOCKS}/{METADATA}"))
    nodes = own["consolidated_metadata"]["metadata"]
    if problem := _problem(root, own, stored, attributes):
        raise RunError(f"'{store.name}' is not a run as dh2sim writes it: {problem}")
    return Manifest(
        attributes={name: value for name, value in attributes.items() if name != COORDINATES},
        coordinates={name: _stored_array(nodes[name]) for name in stored["coordinates"]},
        variables={name: _stored_array(nodes[name]) for name in stored["variables"]},
        digest=stored["digest"],
        nodes={name: node for name, node in nodes.items() if name != BLOCKS},
    )


def damaged_metadata(*files: str) -> RunDamagedError:
    """Return the error for metadata that are not what was written; of several files one is damaged."""
    names = " or ".join(f"'{file}'" for file in files)
    return RunDamagedError(
        f"{names} is missing or damaged and cannot be restored; "
        "resume with the same options in a new folder, which computes the same bits"
    )


def read_node(store: Store, key: str) -> dict[str, Any] | None:
    """Return zarr's metadata of a group or an array, or None if they cannot be parsed.

    Raises:
        RunError: The file may not be read, or has too many values.
    """
    try:
        data = store.get(key, most=MOST_METADATA)
        if sum(map(data.count, (b",", b"[", b"{"))) > MOST_VALUES:
            raise RunError(f"'{store.file(key)}' has more than {MOST_VALUES} values")
        node = json.loads(data)
    except PermissionError as error:
        raise RunError(f"cannot read '{store.file(key)}': {error.strerror}") from error
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
            record = BlockRecord(**json.loads(text))
        except (TypeError, ValueError, RecursionError):
            return None
        numbers = record.checksums.values() if isinstance(record.checksums, dict) else [None]
        sound = type(record.block) is int and all(type(number) is int for number in numbers)
        return record if sound and isinstance(record.seconds, float) and 0.0 <= record.seconds < math.inf else None


def _group_nodes(store: Store) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    return read_node(store, METADATA), read_node(store, f"{BLOCKS}/{METADATA}")


def _marked(root: dict[str, Any] | None, blocks: dict[str, Any] | None) -> bool:
    return _MARK in _attributes(root) or _STORE_MARK in _attributes(blocks)


def _attributes(node: Mapping[str, Any] | None) -> dict[str, Any]:
    attributes = None if node is None else node.get("attributes")
    return attributes if isinstance(attributes, dict) else {}


def _problem(
    root: Mapping[str, Any], own: Mapping[str, Any], names: Mapping[str, Any], attributes: Mapping[str, Any]
) -> str | None:
    """Return why a run's metadata, which match their digest, are not such as dh2sim writes; None if they are."""
    nodes = own["consolidated_metadata"]["metadata"]
    if (root.get("zarr_format"), root.get("node_type")) != (3, "group"):
        return "it is not a group of zarr's format 3"
    if unknown := sorted({*root["consolidated_metadata"]["metadata"]} - {*nodes}):
        return f"it has arrays that do not belong to it ({listed(map(shown, unknown))})"
    sizes: dict[str, int] = {}
    for name in (*names["coordinates"], *names["variables"], f"{BLOCKS}/{RECORD}"):
        if problem := _array_problem(name, nodes[name]):
            return f"array {shown(name)}: {problem}"
    for name in names["coordinates"]:
        dimensions, shape = nodes[name]["dimension_names"], nodes[name]["shape"]
        if len(shape) != 1 or sizes.setdefault(dimensions[0], shape[0]) != shape[0]:
            return f"coordinate {shown(name)} is not one number or label for each of a dimension"
    blocks = {nodes[name]["chunk_grid"]["configuration"]["chunk_shape"][0] for name in names["variables"]}
    rollouts = sizes.get("rollout", 0)
    if not 1 <= rollouts <= MOST_ROLLOUTS or len(blocks) != 1 or -(-rollouts // min(blocks)) > MOST_BLOCKS:
        return "its rollouts do not make up a possible number of blocks"
    for name in names["variables"]:
        node = nodes[name]
        shape, chunk = node["shape"], node["chunk_grid"]["configuration"]["chunk_shape"]
        known = [sizes.get(dimension) for dimension in node["dimension_names"]]
        if node["dimension_names"][0] != "rollout" or known != shape:
            return f"variable {shown(name)} has other sizes than the coordinates"
        if chunk[1:] != [max(size, 1) for size in shape[1:]] or node["data_type"] == "string":
            return f"variable {shown(name)} has chunks of other sizes"
    return _attribute_problem(attributes)


def _array_problem(name: str, node: Any) -> str | None:
    """Return why a node is not an array as dh2sim writes them, or None."""
    if not all(map(_NAME.fullmatch, name.split("/"))):
        return "not a name"
    if problem := _shape_problem(node):
        return problem
    if node.get("chunk_key_encoding") != _KEYS or not isinstance(node.get("attributes"), dict):
        return "its files are named in another way"
    if not is_known(node["data_type"], node.get("codecs")):
        return "other types or codecs than those of dh2sim"
    fill = node.get("fill_value")
    if fill not in ("", "NaN", 0, -1) or isinstance(fill, bool):
        return f"its fill value is {shown(fill)}"
    return None


def _shape_problem(node: Any) -> str | None:
    """Return why a node is not an array of a possible shape, or None."""
    if not isinstance(node, dict) or (node.get("zarr_format"), node.get("node_type")) != (3, "array"):
        return "not an array"
    grid, shape, dimensions = node.get("chunk_grid"), node.get("shape"), node.get("dimension_names")
    configuration = grid.get("configuration") if isinstance(grid, dict) and grid.get("name") == "regular" else None
    chunk = configuration.get("chunk_shape") if isinstance(configuration, dict) else None
    if not (isinstance(shape, list) and isinstance(chunk, list) and isinstance(dimensions, list)):
        return "no shape"
    if not 1 <= len(shape) == len(chunk) == len(dimensions) or not all(isinstance(each, str) for each in dimensions):
        return "no shape"
    if not (_whole_numbers(shape, 0) and _whole_numbers(chunk, 1)):
        return "no shape"
    if not isinstance(node.get("data_type"), str) or node["data_type"] not in ITEM_SIZES:
        return f"its type is {shown(node.get('data_type'))}"
    if node.get("storage_transformers"):
        return "its numbers are stored in another way"
    if math.prod(chunk) * ITEM_SIZES[node["data_type"]] > LARGEST_CHUNK:
        return "its chunks are too large"
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class ForeignArray:
    """How an array that dh2sim or xarray wrote is stored."""

    codecs: tuple[str, ...]
    largest_file: int
    """Bytes that the file of a chunk may have."""


def check_array(store: Store, name: str, *, most: int | None = None) -> ForeignArray:
    """Check an array that dh2sim or xarray wrote, before zarr opens it; its numbers are read by the slice.

    Its chunks are to be checked, too.

    Args:
        store: Of the run.
        name: Of the array.
        most: Items that it may have, where it is to be read as a whole.

    Raises:
        RunError: It is none, its codecs are not those that xarray uses, or it is too large.
    """
    node = read_node(store, f"{name}/{METADATA}")
    problem = _shape_problem(node)
    if node is not None and problem is None:
        codecs = node.get("codecs")
        names = [codec.get("name") for codec in codecs if isinstance(codec, dict)] if isinstance(codecs, list) else []
        if not isinstance(codecs, list) or len(names) != len(codecs) or not set(names) <= READABLE_CODECS:
            problem = "its codecs are not among those that are read"
        elif most is not None and math.prod(node["shape"]) > most:
            problem = "it is too large"
    if problem is not None or node is None:
        raise RunError(f"'{store.file(name)}' cannot be read: {problem}")
    chunk, kind = node["chunk_grid"]["configuration"]["chunk_shape"], node["data_type"]
    return ForeignArray(codecs=tuple(map(str, names)), largest_file=largest_chunk_file(chunk, kind))


def _whole_numbers(value: Any, least: int) -> bool:
    return isinstance(value, list) and all(type(number) is int and least <= number < 2**62 for number in value)


def _attribute_problem(attributes: Mapping[str, Any]) -> str | None:
    """Return which attribute is missing or of another type, or None."""
    for path, kind in _ATTRIBUTES.items():
        value: Any = attributes
        for key in path.split("."):
            value = value.get(key)
        if not isinstance(value, kind) or isinstance(value, bool):
            return f"its attribute '{path}' is {shown(value)}"
    settings, timestep = attributes["settings"], attributes["timestep"]
    if not (0.0 < timestep <= 1.0 and 0 <= settings["steps"] <= MOST_STEPS and settings["every"] >= 1):
        return "its time steps are impossible"
    if not all(isinstance(version, str) for version in attributes["versions"].values()):
        return "its attribute 'versions' does not hold text"
    if not all(isinstance(setting, int | float | str) for setting in attributes["randomize"].values()):
        return "its attribute 'randomize' does not hold numbers and texts"
    return None


def _stored_array(node: Mapping[str, Any]) -> StoredArray:
    return StoredArray(
        dtype=str(node["data_type"]),
        dimensions=tuple(node["dimension_names"]),
        shape=tuple(node["shape"]),
        chunk=tuple(node["chunk_grid"]["configuration"]["chunk_shape"]),
        fill=math.nan if node["fill_value"] == "NaN" else node["fill_value"],
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
