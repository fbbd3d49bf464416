"""The files that a run begins with: zarr's metadata, the coordinates, and the manifest."""

from __future__ import annotations

import json
import warnings
from typing import Any, Final

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec
from zarr.core.buffer import Buffer
from zarr.storage import MemoryStore

from dh2sim.errors import RunError
from dh2sim.simulate.dataset_layout import Coordinate, Layout, Variable
from dh2sim.simulate.store.codec import CODECS, LARGEST_CHUNK
from dh2sim.simulate.store.manifest import BLOCKS, COORDINATES, METADATA, RECORD, manifest_attributes

_KEYS: Final = {"name": "default", "separator": "."}
"""One folder for each array, and no folders in it: fewer to bring to the disk."""


def make_metadata(layout: Layout) -> dict[str, bytes]:
    """Return the files of a run without any block, by relative path; the same for the same layout.

    Raises:
        RunError: A block is too large for a chunk.
    """
    files: dict[str, Buffer] = {}
    store = MemoryStore(store_dict=files)
    names = " ".join(item.name for item in layout.coordinates if item.name != item.dimension)
    group = zarr.create_group(store, zarr_format=3, attributes={**layout.attributes, COORDINATES: names})
    for coordinate in layout.coordinates:
        _add_coordinate(group, layout, coordinate)
    for variable in layout.variables:
        _add_variable(group, layout, variable)
    _add_records(group.create_group(BLOCKS), layout.blocks)
    with warnings.catch_warnings():
        # zarr warns that other programs may not know consolidated metadata; they do not need them
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(store, zarr_format=3)
    contents = {name: buffer.to_bytes() for name, buffer in sorted(files.items())}
    return {**contents, **_with_manifest(contents, layout)}


def _with_manifest(contents: dict[str, bytes], layout: Layout) -> dict[str, bytes]:
    """Return the metadata of the two groups, with the manifest and with the arrays in the order of the layout."""
    coordinates = [coordinate.name for coordinate in layout.coordinates]
    variables = [variable.name for variable in layout.variables]
    root, blocks = (json.loads(contents[name]) for name in (METADATA, f"{BLOCKS}/{METADATA}"))
    nodes = root["consolidated_metadata"]["metadata"]
    blocks["attributes"] = nodes[BLOCKS]["attributes"] = manifest_attributes(root, coordinates, variables)
    order = [*coordinates, *variables]
    root["consolidated_metadata"]["metadata"] = {name: nodes[name] for name in [*order, *sorted({*nodes} - {*order})]}
    groups = {METADATA: root, f"{BLOCKS}/{METADATA}": blocks}
    return {name: json.dumps(node, indent=2).encode() for name, node in groups.items()}


def _add_coordinate(group: zarr.Group, layout: Layout, coordinate: Coordinate) -> None:
    size = layout.sizes[coordinate.dimension]
    values = np.asarray(coordinate.values)
    labels = values.dtype.kind in "UTO"
    array = group.create_array(
        coordinate.name,
        shape=(size,),
        chunks=(max(size, 1),),
        dtype="string" if labels else values.dtype.newbyteorder("<"),
        compressors=[Crc32cCodec()],
        chunk_key_encoding=_KEYS,  # type: ignore[arg-type]
        dimension_names=(coordinate.dimension,),
        attributes=dict(coordinate.attributes),
        config={"write_empty_chunks": True},
    )
    if size:
        array[:] = values.astype(object) if labels else values


def _add_variable(group: zarr.Group, layout: Layout, variable: Variable) -> None:
    shape = layout.shape(variable)
    chunks = tuple(max(size, 1) for size in (layout.block, *shape[1:]))
    amount = int(np.prod(chunks, dtype=object)) * variable.dtype.itemsize
    if amount > LARGEST_CHUNK:
        raise RunError(
            f"{layout.block} rollouts of '{variable.name}' take {amount / 2**30:.1f} GiB, but a chunk holds at most "
            "2 GiB: record fewer states or simulate fewer steps"
        )
    group.create_array(
        variable.name,
        shape=shape,
        chunks=chunks,
        dtype=variable.dtype.newbyteorder("<"),
        compressors=CODECS,
        chunk_key_encoding=_KEYS,  # type: ignore[arg-type]
        fill_value=variable.fill,
        dimension_names=variable.dimensions,
        attributes=dict(variable.attributes),
    )


def _add_records(blocks: zarr.Group, count: int) -> None:
    attributes: dict[str, Any] = {"long_name": "record of the committed block, JSON; empty: not committed"}
    blocks.create_array(
        RECORD,
        shape=(count,),
        chunks=(1,),
        dtype="string",
        compressors=[Crc32cCodec()],
        chunk_key_encoding=_KEYS,  # type: ignore[arg-type]
        dimension_names=("block",),
        attributes=attributes,
    )
