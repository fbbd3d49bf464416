"""Reads meshes of every format in a process of its own (``dh2sim.limited_process``); nothing but triangles is kept.

trimesh reads all but COLLADA. Materials and textures are not opened, and no other file is: a picture of 0.5 MB can be
one of 13000 x 13000 pixels. How much a file says it holds is checked before room is made for it.
"""

from __future__ import annotations

import io
import json
import re
import struct
from typing import Any, Final

import numpy as np
import trimesh

from dh2sim.messages import shown
from dh2sim.model.collada import read_collada
from dh2sim.model.mesh_defects import ascii_stl_defect, defect_of, reason_of
from dh2sim.model.meshes import MAX_FACES
from dh2sim.typing import Array

MAX_READ: Final = 2_000_000
"""Faces, or corners, that a file may say it has."""
MAX_PARTS: Final = 10_000
"""Nodes, meshes, buffers and the like of a GLB file."""
MAX_JSON: Final = 10_000_000
"""Bytes of the part of a GLB file that describes it."""


def answer(request: bytes) -> bytes:
    """Return the triangles of a mesh: a line of JSON, and a binary STL file.

    The request is the suffix of the file's name, on a line of its own, and the file's content. The line of JSON has
    the number of faces (``faces``), and unless it is 0 or too great, the number of different corners (``corners``),
    the area (``area``), the greatest coordinate (``largest``), and whether all numbers are finite (``finite``); or
    what is wrong (``refused``).
    """
    suffix, _, data = request.partition(b"\n")
    try:
        facts, stl = _surface(suffix.decode(), data)
    except _UnreadableError as error:
        facts, stl = {"refused": " ".join(str(error).split())}, b""
    return json.dumps(facts).encode() + b"\n" + stl


class _UnreadableError(Exception):
    """A file holds no mesh; the text says why."""


def _surface(suffix: str, data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return facts of a mesh, and its triangles as a binary STL file.

    Raises:
        _UnreadableError: The file is malformed or too large.
    """
    try:
        _check_file(suffix, data)
        vertices, faces = read_collada(data) if suffix == ".dae" else (None, None)
    except ValueError as error:
        raise _UnreadableError(str(error)) from error
    try:
        surface = trimesh.Trimesh(vertices, faces, process=False) if suffix == ".dae" else _read(suffix, data)
        facts, stl = _measured(surface)
        if facts["faces"] == 0 and suffix == ".stl" and (defect := ascii_stl_defect(data)) is not None:
            raise _UnreadableError(defect)  # some versions of trimesh pass over what they cannot read
        return facts, stl
    except MemoryError:
        raise
    except _UnreadableError:
        raise
    except Exception as error:  # trimesh's readers raise many types, with words of Python or NumPy
        raise _UnreadableError(reason_of(suffix, data)) from error


def _measured(surface: Any) -> tuple[dict[str, Any], bytes]:
    facts: dict[str, Any] = {"faces": len(getattr(surface, "faces", ()))}
    stl = b""
    if 0 < facts["faces"] <= MAX_FACES:
        if not 0 <= surface.faces.min() <= surface.faces.max() < len(surface.vertices):
            raise _UnreadableError("a face refers to a corner that is not there")
        corners: Array = np.asarray(surface.vertices)[np.unique(surface.faces)]
        # STL files hold single precision
        facts["finite"] = bool((np.abs(corners) <= np.finfo(np.float32).max).all())
        if facts["finite"]:
            facts["corners"] = len(np.unique(corners.astype(np.float32), axis=0))
            facts["area"] = float(surface.area)
            facts["largest"] = float(np.abs(corners).max())
            stl = bytes(surface.export(file_type="stl"))
    return facts, stl


def _check_file(suffix: str, data: bytes) -> None:
    """Check how much a file says that it holds.

    Raises:
        ValueError: It is too much, or plainly not what its name says.
    """
    if (defect := defect_of(suffix, data)) is not None:
        raise ValueError(defect)
    match suffix:
        case ".glb":
            check_glb(data)
        case ".ply":
            check_ply(data)


def _read(suffix: str, data: bytes) -> Any:
    return trimesh.load_mesh(io.BytesIO(data), file_type=suffix[1:], process=False, skip_materials=True)


def check_ply(data: bytes) -> None:
    """Check that a PLY file is as long as it says.

    Raises:
        ValueError: It announces more elements than it has bytes, or too many.
    """
    header = data[: data.find(b"end_header") + 1 or 100_000]
    for element, digits in re.findall(rb"^\s*element\s+(\S+)\s+(\d+)", header, re.MULTILINE):
        count = int(digits[:20])
        if count > min(MAX_READ, len(data)):
            what = f"{count} of element {shown(element.decode('latin-1'))}"
            raise ValueError(f"it announces {what}; the file has {len(data)} bytes, and at most {MAX_READ} are read")


def check_glb(data: bytes) -> None:
    """Check how large the scene of a GLB file becomes; what is malformed is left to trimesh.

    Raises:
        ValueError: It has too many parts, or shows too many faces.
    """
    if len(data) < 20 or data[:4] != b"glTF":
        return
    size = struct.unpack_from("<I", data, 12)[0]
    if size > MAX_JSON:
        raise ValueError(f"its description has {size} bytes; at most {MAX_JSON} are read")
    try:
        tree = json.loads(data[20 : 20 + size])
    except ValueError:
        return
    if isinstance(tree, dict):
        _Glb(tree).check()


class _Glb:
    """The description of a glTF scene, glTF 2.0, Khronos Group."""

    def __init__(self, tree: dict[str, Any]) -> None:
        self._parts = {
            name: [item if isinstance(item, dict) else {} for item in value]
            for name, value in tree.items()
            if isinstance(value, list)
        }

    def check(self) -> None:
        for name, items in self._parts.items():
            if len(items) > MAX_PARTS:
                raise ValueError(f"it has {len(items)} {name}; at most {MAX_PARTS} are read")
        total = sum(_count(accessor) for accessor in self._parts.get("accessors", []))
        if total > 4 * MAX_READ:
            raise ValueError(f"its accessors hold {total} items; at most {4 * MAX_READ} are read")
        nodes = self._parts.get("nodes", [])
        corners = [self._corners(mesh) for mesh in self._parts.get("meshes", [])]
        drawn, seen, waiting = 0, 0, self._roots(nodes)
        while waiting:
            node, seen = nodes[waiting.pop()], seen + 1
            drawn += sum(corners[mesh] for mesh in _numbers([node.get("mesh")], len(corners)))
            waiting += _numbers(node.get("children"), len(nodes))
            if drawn > 3 * MAX_READ or seen > MAX_PARTS:
                raise ValueError(f"its scene has more than {MAX_PARTS} nodes, or {MAX_READ} faces")

    def _roots(self, nodes: list[dict[str, Any]]) -> list[int]:
        """Return the nodes that no other one has below it; all where there is none."""
        below = {child for node in nodes for child in _numbers(node.get("children"), len(nodes))}
        roots = [number for number in range(len(nodes)) if number not in below]
        return roots or list(range(len(nodes)))

    def _corners(self, mesh: dict[str, Any]) -> int:
        """Return the number of corners of a mesh, or of its faces where these are more."""
        primitives = mesh.get("primitives")
        accessors = self._parts.get("accessors", [])
        total = 0
        for primitive in primitives if isinstance(primitives, list) else []:
            attributes = primitive.get("attributes") if isinstance(primitive, dict) else None
            given = [primitive.get("indices")] if isinstance(primitive, dict) else []
            given += [attributes.get("POSITION")] if isinstance(attributes, dict) else []
            total += max((_count(accessors[number]) for number in _numbers(given, len(accessors))), default=0)
        return total


def _count(accessor: dict[str, Any]) -> int:
    count = accessor.get("count")
    return max(count, 0) if isinstance(count, int) else 0


def _numbers(values: Any, most: int) -> list[int]:
    """Return those of some values that are numbers of items."""
    given = values if isinstance(values, list) else []
    return [value for value in given if isinstance(value, int) and 0 <= value < most]
