"""COLLADA files (.dae) as triangles: what their scene shows, in metres and with z up.

Materials, textures and animations are left out. COLLADA 1.4.1 and 1.5, Khronos Group.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple, TypeAlias
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from dh2sim.kinematics.trig import sin_cos
from dh2sim.messages import shown
from dh2sim.typing import Array, read_only

MAX_BYTES: Final = 100_000_000
MAX_INSTANCES: Final = 10_000
"""Of geometries in the scene."""
MAX_FACES: Final = 2_000_000
MAX_DEPTH: Final = 200
"""Of nodes in nodes."""

_Indices: TypeAlias = NDArray[np.int64]
_Matrix: TypeAlias = tuple[tuple[float, ...], ...]
_IDENTITY: Final[_Matrix] = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
_UP: Final[Mapping[str, tuple[tuple[int, int], ...]]] = {
    "X_UP": ((1, -1), (2, -1), (0, 1)),
    "Y_UP": ((0, 1), (2, -1), (1, 1)),
    "Z_UP": ((0, 1), (1, 1), (2, 1)),
}
"""Of x, y and z with z up: which coordinate of the file it is, and its sign."""
_DECLARATION: Final = re.compile(r"<!(?:DOCTYPE|ENTITY)")


class Triangles(NamedTuple):
    """Triangles in space."""

    vertices: Array
    """m, shape (n, 3)."""
    faces: _Indices
    """Indices of corners, anticlockwise as seen from outside, shape (m, 3)."""


def read_collada(data: bytes) -> Triangles:
    """Return the triangles that the scene of a COLLADA file shows; all geometries where it has no scene.

    Lengths are made metres (``<unit meter="…">``), and the file's up axis (``<up_axis>``) becomes z. Polygons are cut
    into fans.

    Raises:
        ValueError: The file is not COLLADA, refers to what it does not have, or grows beyond the limits above.
    """
    file = _File(_parsed(data))
    vertices: list[Array] = [np.zeros((0, 3))]
    faces: list[_Indices] = [np.zeros((0, 3), dtype=np.int64)]
    count, corners = 0, 0
    for number, (geometry, T) in enumerate(file.instances()):
        own = file.triangles(geometry)
        count += len(own.faces)
        if number >= MAX_INSTANCES or count > MAX_FACES:
            raise ValueError(f"the scene has more than {MAX_INSTANCES} geometries, or {MAX_FACES} faces")
        vertices.append(_moved(own.vertices, T))
        faces.append((own.faces[:, ::-1] if _mirrors(T) else own.faces) + corners)
        corners += len(own.vertices)
    whole = np.concatenate(vertices) * file.unit
    up = np.stack([sign * whole[:, axis] for axis, sign in file.up], axis=1)
    return Triangles(up, np.concatenate(faces))


def T_read_file(data: bytes) -> Array:
    """Return the pose of a COLLADA file's own frame in the frame that ``read_collada`` gives, shape (4, 4).

    Raises:
        ValueError: The file is not well-formed so far, or has another up axis than x, y or z.
    """
    up = _up_axis(None)
    try:
        for _, element in ElementTree.iterparse(io.BytesIO(_checked(data))):
            tag = str(element.tag).rpartition("}")[2]
            if tag == "up_axis":
                up = _up_axis(element.text)
            if tag == "asset":  # the document's own is the first element of all
                break
    except ElementTree.ParseError as error:
        raise ValueError(f"not well-formed XML: {error}") from None
    T = np.zeros((4, 4))
    T[3, 3] = 1.0
    for row, (axis, sign) in enumerate(up):
        T[row, axis] = sign
    return read_only(T)


def _up_axis(text: str | None) -> tuple[tuple[int, int], ...]:
    axis = (text or "Y_UP").strip()  # which is COLLADA's default
    if axis not in _UP:
        raise ValueError(f"the up axis must be X_UP, Y_UP or Z_UP, found {shown(axis)}")
    return _UP[axis]


def _checked(data: bytes) -> bytes:
    """Return a file without blanks around it; nothing in it is declared, and so nothing can grow."""
    if len(data) > MAX_BYTES:
        raise ValueError(f"the file has {len(data)} bytes; at most {MAX_BYTES} are read")
    is_utf_16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    if _DECLARATION.search(data.decode("utf-16" if is_utf_16 else "latin-1", "replace")):
        raise ValueError("a document type with declarations is refused")
    return data if is_utf_16 else data.strip(b" \t\r\n\0")


def _parsed(data: bytes) -> ElementTree.Element:
    try:
        root = ElementTree.fromstring(_checked(data))
    except ElementTree.ParseError as error:
        raise ValueError(f"not well-formed XML: {error}") from None
    for element in root.iter():
        element.tag = str(element.tag).rpartition("}")[2]  # without its namespace
    if root.tag != "COLLADA":
        raise ValueError(f"expected <COLLADA>, found <{root.tag[:60]}>")
    return root


class _File:
    """The elements of a file, by id."""

    def __init__(self, root: ElementTree.Element) -> None:
        self._root = root
        self._ids = {element.attrib["id"]: element for element in root.iter() if "id" in element.attrib}
        self._read: dict[int, Triangles] = {}
        unit = root.find("asset/unit")
        self.unit = 1.0 if unit is None else float(unit.get("meter", "1"))
        if not 0.0 < self.unit < math.inf:
            raise ValueError(f"the unit must be a positive number of metres, found {self.unit!r}")
        self.up = _up_axis(root.findtext("asset/up_axis"))

    def instances(self) -> Iterator[tuple[ElementTree.Element, _Matrix]]:
        """Yield every geometry that the scene shows, with its place."""
        shown_scene = self._root.find("scene/instance_visual_scene")
        scene = self._root.find("library_visual_scenes/visual_scene")
        if shown_scene is not None:
            scene = self._referred(shown_scene, "url", "visual_scene")
        if scene is None:
            yield from ((geometry, _IDENTITY) for geometry in self._root.findall("library_geometries/geometry"))
            return
        waiting = [(node, _IDENTITY, 0) for node in reversed(scene.findall("node"))]
        seen = 0
        while waiting:
            node, T, depth = waiting.pop()
            seen += 1
            if depth > MAX_DEPTH or seen > MAX_INSTANCES:
                raise ValueError(f"nodes are nested more than {MAX_DEPTH} deep, or more than {MAX_INSTANCES}")
            below = []
            for child in node:
                match child.tag:
                    case "matrix" | "translate" | "rotate" | "scale":
                        T = _product(T, _transform(child))
                    case "lookat" | "skew":
                        raise ValueError(f"<{child.tag}> is not read")
                    case "node":
                        below.append(child)
                    case "instance_node":
                        below.append(self._referred(child, "url", "node"))
                    case "instance_geometry":
                        yield self._referred(child, "url", "geometry"), T
                    case "instance_controller":
                        yield self._skin(child, T)
            waiting += [(child, T, depth + 1) for child in reversed(below)]

    def _skin(self, instance: ElementTree.Element, T: _Matrix) -> tuple[ElementTree.Element, _Matrix]:
        """Return the geometry of a controller in the pose in which it was bound, and its place."""
        controller = self._referred(instance, "url", "controller")
        for _ in range(MAX_DEPTH):
            what = next((child for child in controller if child.tag in ("skin", "morph")), None)
            if what is None:
                break
            bound = what.find("bind_shape_matrix")
            T = T if bound is None else _product(T, _transform(bound))
            source = self._ids.get(what.get("source", "").lstrip("#"))
            if source is not None and source.tag == "geometry":
                return source, T
            controller = self._referred(what, "source", "controller")
        raise ValueError("a controller has no geometry")

    def _referred(self, element: ElementTree.Element, attribute: str, tag: str) -> ElementTree.Element:
        url = element.get(attribute, "")
        found = self._ids.get(url.removeprefix("#"))
        if found is None or found.tag != tag:
            raise ValueError(f"<{element.tag}> refers to {shown(url)}, which is not a <{tag}> of the file")
        return found

    def triangles(self, geometry: ElementTree.Element) -> Triangles:
        """Return the triangles of a geometry, in its own frame and unit; lines and splines have none."""
        if id(geometry) not in self._read:
            self._read[id(geometry)] = self._triangles(geometry)
        return self._read[id(geometry)]

    def _triangles(self, geometry: ElementTree.Element) -> Triangles:
        mesh = next((child for child in geometry if child.tag in ("mesh", "convex_mesh")), None)
        positions: dict[str, Array] = {}
        faces: list[_Indices] = [np.zeros((0, 3), dtype=np.int64)]
        corners = 0
        for part in () if mesh is None else mesh:
            if part.tag not in ("triangles", "polylist", "polygons", "tristrips", "trifans"):
                continue
            inputs = [(own.get("semantic"), int(own.get("offset", "0")), own) for own in part.findall("input")]
            stride = max((offset for _, offset, _ in inputs), default=0) + 1
            vertex = next((own for semantic, _, own in inputs if semantic == "VERTEX"), None)
            if vertex is None:
                raise ValueError(f"<{part.tag}> has no <input> of its vertices")
            source = vertex.get("source", "")
            if source not in positions:
                positions[source] = self._positions(vertex)
            start = sum(len(known) for known in list(positions.values())[: list(positions).index(source)])
            offset = int(vertex.get("offset", "0"))
            found = _faces(part, stride, offset)
            if found.size and not 0 <= int(found.min()) <= int(found.max()) < len(positions[source]):
                raise ValueError(f"<{part.tag}> refers to a vertex that is not there")
            corners += len(found)
            if corners > MAX_FACES:
                raise ValueError(f"a geometry has more than {MAX_FACES} faces")
            faces.append(found + start)
        return Triangles(np.concatenate([np.zeros((0, 3)), *positions.values()]), np.concatenate(faces))

    def _positions(self, vertex: ElementTree.Element) -> Array:
        """Return the positions of vertices, shape (n, 3)."""
        vertices = self._referred(vertex, "source", "vertices")
        own = next((own for own in vertices.findall("input") if own.get("semantic") == "POSITION"), None)
        if own is None:
            raise ValueError("<vertices> has no <input> of positions")
        source = self._referred(own, "source", "source")
        values = source.find("float_array")
        accessor = source.find("technique_common/accessor")
        numbers = _numbers(values)
        stride = 3 if accessor is None else int(accessor.get("stride", "1"))
        first = 0 if accessor is None else int(accessor.get("offset", "0"))
        count = (len(numbers) - first) // max(stride, 1)
        if accessor is not None:
            count = int(accessor.get("count", count))
        if stride < 3 or first < 0 or count < 0 or first + count * stride > len(numbers):
            raise ValueError("<source> has fewer positions than it says, or of fewer than three numbers")
        return numbers[first : first + count * stride].reshape(count, stride)[:, :3]


def _faces(part: ElementTree.Element, stride: int, offset: int) -> _Indices:
    """Return the corners of a part's triangles, shape (m, 3)."""
    lists = [_indices(element)[offset::stride] for element in part.iter("p")]
    match part.tag:
        case "triangles":
            return np.concatenate([np.zeros(0, dtype=np.int64), *lists]).reshape(-1, 3)
        case "polylist":
            counts = _indices(part.find("vcount"))
            whole = np.concatenate([np.zeros(0, dtype=np.int64), *lists])
            if len(counts) and (int(counts.min()) < 1 or int(counts.sum()) > len(whole)):
                raise ValueError("<polylist> has fewer corners than <vcount> says")
            return _fans(whole, counts)
        case "tristrips":
            strips = [np.stack([own[:-2], own[1:-1], own[2:]], axis=1) for own in lists if len(own) > 2]
            turned = [np.where(np.arange(len(own))[:, None] % 2 == 1, own[:, [1, 0, 2]], own) for own in strips]
            return np.concatenate([np.zeros((0, 3), dtype=np.int64), *turned])
        case _:  # polygons and trifans
            counts = np.array([len(own) for own in lists], dtype=np.int64)
            return _fans(np.concatenate([np.zeros(0, dtype=np.int64), *lists]), counts)


def _fans(corners: _Indices, counts: _Indices) -> _Indices:
    """Cut polygons, given one after the other, into fans around their first corners."""
    starts = np.cumsum(counts) - counts
    pieces = np.maximum(counts - 2, 0)
    first = np.repeat(starts, pieces)
    step = np.arange(int(pieces.sum())) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1
    return np.stack([corners[first], corners[first + step], corners[first + step + 1]], axis=1)


def _numbers(element: ElementTree.Element | None) -> Array:
    text = "" if element is None else element.text or ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, sep=" ") if text.strip() else np.zeros(0)
        except (DeprecationWarning, ValueError):
            raise ValueError(
                f"<{'' if element is None else element.tag}> contains something that is not a number"
            ) from None


def _indices(element: ElementTree.Element | None) -> _Indices:
    numbers = _numbers(element)
    whole = numbers.astype(np.int64)
    if not np.array_equal(whole, numbers):
        raise ValueError(f"<{'' if element is None else element.tag}> holds what is not an index")
    return whole


def _transform(element: ElementTree.Element) -> _Matrix:
    """Return the matrix of a transformation."""
    values = _numbers(element).tolist()
    count = {"translate": 3, "rotate": 4, "scale": 3}.get(element.tag, 16)
    if len(values) != count or not all(map(math.isfinite, values)):
        raise ValueError(f"<{element.tag}> must have {count} numbers")
    match element.tag:
        case "translate":
            x, y, z = values
            return ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z), _IDENTITY[3])
        case "scale":
            x, y, z = values
            return ((x, 0.0, 0.0, 0.0), (0.0, y, 0.0, 0.0), (0.0, 0.0, z, 0.0), _IDENTITY[3])
        case "rotate":
            return _rotation(values[:3], math.radians(values[3]))
        case _:
            return tuple(tuple(values[i : i + 4]) for i in range(0, 16, 4))


def _rotation(axis: list[float], angle: float) -> _Matrix:
    """Return a rotation about an axis of any length by an angle, rad (Rodrigues)."""
    length = math.hypot(*axis)
    if length == 0.0:
        return _IDENTITY
    x, y, z = (value / length for value in axis)
    s, c = sin_cos(angle)
    v = 1.0 - c
    return (
        (c + v * x * x, v * x * y - s * z, v * x * z + s * y, 0.0),
        (v * x * y + s * z, c + v * y * y, v * y * z - s * x, 0.0),
        (v * x * z - s * y, v * y * z + s * x, c + v * z * z, 0.0),
        _IDENTITY[3],
    )


def _product(A: _Matrix, B: _Matrix) -> _Matrix:
    columns = tuple(zip(*B, strict=True))
    return tuple(tuple(sum(a * b for a, b in zip(row, column, strict=True)) for column in columns) for row in A)


def _moved(points: Array, T: _Matrix) -> Array:
    x, y, z = points.T  # a product by BLAS would not round alike everywhere
    return np.stack([row[0] * x + row[1] * y + row[2] * z + row[3] for row in T[:3]], axis=1)


def _mirrors(T: _Matrix) -> bool:
    (a, b, c), (d, e, f), (g, h, i) = (row[:3] for row in T[:3])
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0
