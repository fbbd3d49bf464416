"""What a run was made from, kept twice with a digest: the one copy tells whether the other is what was written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from dh2sim.simulate.dataset_layout import Layout

BLOCKS: Final = "blocks"
"""Name of the group that holds the seal, as attributes, and the record of committed blocks."""
SECONDS: Final = "seconds"
CHECKSUM: Final = "checksum"
"""Names of its arrays."""
COORDINATES: Final = "coordinates"
"""Attribute by which xarray knows coordinates from variables (CF conventions, section 5); of no layout."""
OWN: Final = ("created", "command")
"""Attributes that tell of the making of a run; they stay when it is resumed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredVariable:
    """Type and extent of a variable."""

    dtype: str
    dimensions: tuple[str, ...]
    shape: tuple[int, ...]

    @property
    def chunk_key(self) -> str:
        """Name of a block's chunk file, with ``{}`` for the block."""
        return ".".join(["c", "{}", *("0" for _ in self.shape[1:])])

    @property
    def empty(self) -> bool:
        """Whether it has no elements, and so no chunks."""
        return 0 in self.shape


@dataclass(frozen=True, slots=True, kw_only=True)
class Seal:
    """What blocks are made of, and a digest over that and the run's attributes."""

    block: int
    """Rollouts in a block."""
    rollouts: int
    variables: Mapping[str, StoredVariable]
    own: Mapping[str, Any]
    """Attributes named in ``OWN``."""
    names: tuple[str, ...]
    """Names of the attributes that the digest covers."""
    digest: str

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return -(-self.rollouts // self.block)

    def size(self, block: int) -> int:
        """Return the number of rollouts in a block."""
        return min(self.block, self.rollouts - block * self.block)

    def fits(self, attributes: Mapping[str, Any]) -> bool:
        """Tell whether attributes are those that the seal was made with; others beside them do not matter."""
        if not all(name in attributes for name in self.names):
            return False
        known = {name: attributes[name] for name in self.names}
        return self.digest == _digest(known, self.block, self.rollouts, self.variables)

    def to_json(self) -> dict[str, Any]:
        """Return the attributes of the group ``BLOCKS``."""
        return {
            "block": self.block,
            "rollouts": self.rollouts,
            "variables": _variables_json(self.variables),
            "own": dict(self.own),
            "names": list(self.names),
            "digest": self.digest,
        }


def make_seal(layout: Layout, attributes: Mapping[str, Any]) -> Seal:
    """Seal a run's attributes; what xarray adds to them, or a user, is not covered."""
    names = tuple(name for name in layout.attributes if name != COORDINATES)
    rollouts, variables = layout.sizes["rollout"], stored_variables(layout)
    known = {name: attributes[name] for name in names}
    return Seal(
        block=layout.block,
        rollouts=rollouts,
        variables=variables,
        own={name: attributes[name] for name in OWN if name in attributes},
        names=names,
        digest=_digest(known, layout.block, rollouts, variables),
    )


def stored_variables(layout: Layout) -> dict[str, StoredVariable]:
    """Return the variables of a layout as a seal names them."""
    return {
        variable.name: StoredVariable(
            dtype=variable.dtype.name, dimensions=variable.dimensions, shape=layout.shape(variable)
        )
        for variable in layout.variables
    }


def stored_attributes(path: Path) -> dict[str, Any] | None:
    """Return a run's attributes as they stand there, or None if they cannot be read.

    Raises:
        PermissionError: the file may not be read.
    """
    return _attributes(_node(path))


def seals(path: Path) -> Iterator[Seal]:
    """Yield the copies of a run's seal that can be read.

    Raises:
        PermissionError: a file may not be read.
    """
    inline = _node(path)
    for key in ("consolidated_metadata", "metadata", BLOCKS):
        found = inline.get(key) if isinstance(inline, dict) else None
        inline = found if isinstance(found, dict) else None
    for node in (_node(path / BLOCKS), inline):
        seal = _parse(_attributes(node))
        if seal is not None:
            yield seal


def _node(folder: Path) -> dict[str, Any] | None:
    try:
        node = json.loads((folder / "zarr.json").read_bytes())
    except PermissionError:
        raise
    except (OSError, ValueError, RecursionError):
        return None
    return node if isinstance(node, dict) else None


def _attributes(node: dict[str, Any] | None) -> dict[str, Any] | None:
    attributes = None if node is None else node.get("attributes")
    return attributes if isinstance(attributes, dict) else None


def _parse(attributes: dict[str, Any] | None) -> Seal | None:
    """Return the seal that attributes hold. Its numbers are right if its digest fits, and are not trusted before."""
    if attributes is None:
        return None
    try:
        seal = Seal(
            block=int(attributes["block"]),
            rollouts=int(attributes["rollouts"]),
            variables={
                str(name): StoredVariable(
                    dtype=str(found["dtype"]),
                    dimensions=tuple(map(str, found["dimensions"])),
                    shape=tuple(map(int, found["shape"])),
                )
                for name, found in attributes["variables"].items()
            },
            own=dict(attributes["own"]),
            names=tuple(map(str, attributes["names"])),
            digest=str(attributes["digest"]),
        )
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        return None
    return seal if seal.block > 0 and seal.rollouts > 0 else None


def _digest(attributes: Mapping[str, Any], block: int, rollouts: int, variables: Mapping[str, StoredVariable]) -> str:
    sealed = [attributes, block, rollouts, _variables_json(variables)]
    return hashlib.sha256(json.dumps(sealed, sort_keys=True).encode()).hexdigest()


def _variables_json(variables: Mapping[str, StoredVariable]) -> dict[str, Any]:
    return {
        name: {"dtype": stored.dtype, "dimensions": list(stored.dimensions), "shape": list(stored.shape)}
        for name, stored in variables.items()
    }
