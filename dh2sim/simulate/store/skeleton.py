"""Everything of a run that is known before it begins: zarr's metadata, coordinates, attributes."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import zarr
from zarr.abc.store import Store
from zarr.codecs import Crc32cCodec
from zarr.core.buffer import Buffer
from zarr.storage import MemoryStore

from dh2sim.errors import RunError
from dh2sim.simulate.dataset_layout import Coordinate, Layout, Variable
from dh2sim.simulate.store.codec import CODECS, LARGEST_CHUNK
from dh2sim.simulate.store.seal import BLOCKS, CHECKSUM, COORDINATES, SECONDS, make_seal

_KEYS: Final = {"name": "default", "separator": "."}
"""One folder a variable, and no folders in it: that many fewer to bring to the disk."""


def make_skeleton(layout: Layout) -> dict[str, bytes]:
    """Return the files of a run of which no block is committed, by relative path; the same for the same layout.

    Raises:
        RunError: a block is too large for a chunk.
    """
    files: dict[str, Buffer] = {}
    store = MemoryStore(store_dict=files)
    attributes = {name: value for name, value in layout.attributes.items() if name != COORDINATES}
    names = " ".join(coordinate.name for coordinate in layout.coordinates if not _is_index(coordinate))
    group = zarr.create_group(store, zarr_format=3, attributes={**attributes, COORDINATES: names})
    for coordinate in layout.coordinates:
        _add_coordinate(group, layout, coordinate)
    for variable in layout.variables:
        _add_variable(group, layout, variable)
    _add_blocks(group, layout, attributes)
    _consolidate(store)
    contents = {name: buffer.to_bytes() for name, buffer in sorted(files.items())}
    members = [part.name for part in layout.coordinates] + [part.name for part in layout.variables]
    return {**contents, "zarr.json": _in_order(contents["zarr.json"], members)}


def _is_index(coordinate: Coordinate) -> bool:
    return coordinate.name == coordinate.dimension


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
            f"{layout.block} rollouts of '{variable.name}' take {amount / 2**30:.1f} GiB, and a chunk of a run holds "
            "2 GiB: record fewer states with --every, or simulate fewer steps"
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


def _add_blocks(group: zarr.Group, layout: Layout, attributes: Mapping[str, Any]) -> None:
    """Add the record of committed blocks."""
    blocks = group.create_group(BLOCKS, attributes=make_seal(layout, attributes).to_json())
    count, variables = layout.blocks, len(layout.variables)
    for name, shape, dtype, dimensions, attributes_of in (
        (SECONDS, (count,), "<f8", ("block",), {"units": "s", "long_name": "time that the block took"}),
        (CHECKSUM, (count, variables), "<u4", ("block", "variable"), {"long_name": "CRC-32C of the block's chunks"}),
    ):
        blocks.create_array(
            name,
            shape=shape,
            chunks=(1, *shape[1:]),
            dtype=dtype,
            compressors=[Crc32cCodec()],
            chunk_key_encoding=_KEYS,  # type: ignore[arg-type]
            fill_value=np.nan if name == SECONDS else 0,
            dimension_names=dimensions,
            attributes=dict(attributes_of),
        )


def _consolidate(store: Store) -> None:
    with warnings.catch_warnings():
        # zarr warns that other programs may know nothing of consolidated metadata; they need not
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(store, zarr_format=3)


def _in_order(root: bytes, members: list[str]) -> bytes:
    """Return the root's metadata with those of its members in the layout's order, and not in that of a listing."""
    node = json.loads(root)
    metadata = node["consolidated_metadata"]["metadata"]
    rest = sorted(metadata.keys() - members)
    node["consolidated_metadata"]["metadata"] = {name: metadata[name] for name in (*members, *rest)}
    return json.dumps(node, indent=2).encode()
