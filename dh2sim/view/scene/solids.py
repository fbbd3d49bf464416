"""Links as solids made of triangles, for the robot, its ghost and exported pages.

Triangles are made once for every size of a shape and every mesh, and shared from then on, so that scenes compare
quickly, even those of an edited robot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise, product
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.transforms import compose, quaternion_from_rotation
from dh2sim.model.meshes import STL_FACE, STL_HEADER, MeshAsset
from dh2sim.model.robot_model import LinkModel, RobotModel
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart
from dh2sim.typing import Array
from dh2sim.view.scene.items import Color, Item, Placed, Quaternion, Solid, Vector, vector
from dh2sim.view.scene.link_poses import poses_at

SIDES = 32
"""Of a round shape's cross-section; its corners lie on the true surface, which makes it up to 1.5 % too small."""
RINGS = 8
"""Between the equator and the pole of a capsule's end."""
_SHAPES_CACHED = 128
"""Up to 140 kB each; every edit of a table makes a few new ones."""
_MESHES_CACHED = 32
_ROBOTS_CACHED = 6
"""The robot, opaque or not, and its ghost, on a few pages."""

Triangles: TypeAlias = tuple[tuple[Vector, ...], tuple[tuple[int, int, int], ...]]
"""Vertices, m, and the three corners of every face, anticlockwise from outside."""
_Profile: TypeAlias = list[tuple[float, float]]
"""Radii and heights of rings, from below."""


def link_solids(
    link: LinkModel, T_link_dh: Array, *, color: Color | None = None, opacity: float = 1.0
) -> dict[str, Solid]:
    """Return the solids of a link.

    Args:
        link: The link.
        T_link_dh: Pose of the link's DH frame, which carries its mesh, in the link's frame, from ``T_link_dh`` of the
            model; shape (4, 4).
        color: Instead of the link's own colours.
        opacity: Times the link's own.

    Returns:
        ``mesh`` alone, or ``shape_0``, ``shape_1``, …; each placed in the link's frame.
    """
    if link.mesh is not None:
        vertices, faces = mesh_triangles(link.mesh)
        T_link_mesh = compose(T_link_dh, link.mesh.T_dh_mesh)
        return {"mesh": _solid(vertices, faces, T_link_mesh, link.color, color, opacity)}
    solids = {}
    for number, shape in enumerate(link.shapes):
        vertices, faces = shape_triangles(shape)
        own = link.color if shape.part is ShapePart.LINK else link.joint_color
        solids[f"shape_{number}"] = _solid(vertices, faces, shape.T_link_shape, own, color, opacity)
    return solids


def robot_solids(
    model: RobotModel, q: ArrayLike, root: str, *, color: Color | None = None, opacity: float = 1.0
) -> dict[str, Item]:
    """Return a robot at a configuration.

    Args:
        model: The robot.
        q: Joint vector, rad and m, shape (n,).
        root: Name of the item that carries it, such as ``/robot``.
        color: Of all links, instead of their own colours.
        opacity: Times the links' own.

    Returns:
        ``root`` in base_link, a frame ``root/link_2`` at every link, and below it the solids of the link. Only the
        frames' poses change with ``q``.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    items: dict[str, Item] = {root: Placed()}
    for link, T in zip(model.all_links, poses_at(model, q).links, strict=True):
        items[f"{root}/{link.name}"] = Placed(position=position_of(T), orientation=orientation_of(T))
    return {**items, **_fixed_solids(model, root, color, opacity)}


@lru_cache(maxsize=_ROBOTS_CACHED)
def _fixed_solids(model: RobotModel, root: str, color: Color | None, opacity: float) -> Mapping[str, Solid]:
    """Return what is below the links' frames, the same at every configuration."""
    return {
        f"{root}/{link.name}/{name}": solid
        for link, T_link_dh in zip(model.all_links, model.T_link_dh, strict=True)
        for name, solid in link_solids(link, T_link_dh, color=color, opacity=opacity).items()
    }


def shape_triangles(shape: Shape) -> Triangles:
    """Return the closed surface of a shape in its own frame."""
    return _shape_triangles(shape.kind, shape.radius, shape.length, shape.size)


@lru_cache(maxsize=_SHAPES_CACHED)
def _shape_triangles(
    kind: ShapeKind, radius: float, length: float, size: tuple[float, float, float] | None
) -> Triangles:
    half = 0.5 * length
    match kind:
        case ShapeKind.CYLINDER:
            # the ends have vertices of their own, which makes their rims look sharp
            below, side, above = (
                [(0.0, -half), (radius, -half)],
                [(radius, -half), (radius, half)],
                [(radius, half), (0.0, half)],
            )
            return _merged([_revolved(profile) for profile in (below, side, above)])
        case ShapeKind.CAPSULE | ShapeKind.SPHERE:
            return _revolved(_capsule_profile(radius, half))
        case ShapeKind.BOX:
            return _box_triangles(size or (radius, radius, length))


@lru_cache(maxsize=1)
def ball_triangles() -> Triangles:
    """Return the closed surface of a ball of radius 1 around the origin."""
    angles = (math.pi * (k / (2 * RINGS) - 0.5) for k in range(1, 2 * RINGS))
    return _revolved([(0.0, -1.0), *((math.cos(angle), math.sin(angle)) for angle in angles), (0.0, 1.0)])


def mesh_triangles(mesh: MeshAsset) -> Triangles:
    """Return the surface of a mesh in its own frame, m; coincident corners are merged."""
    return _mesh_triangles(mesh.data, mesh.scale)


@lru_cache(maxsize=_MESHES_CACHED)
def _mesh_triangles(data: bytes, scale: float) -> Triangles:
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    count = (len(data) - STL_HEADER) // STL_FACE
    corners = np.frombuffer(data, dtype=record, count=count, offset=STL_HEADER)["corners"].reshape(-1, 3)
    points, indices = np.unique(corners, axis=0, return_inverse=True)
    scaled = points.astype(np.float64) * scale
    return (
        tuple((x, y, z) for x, y, z in scaled.tolist()),
        tuple((a, b, c) for a, b, c in indices.reshape(-1, 3).tolist()),
    )


def position_of(T: Array) -> Vector:
    """Return the position of a pose of shape (4, 4), m."""
    return vector(T[:3, 3])


def orientation_of(T: Array) -> Quaternion:
    """Return the orientation of a pose of shape (4, 4), (w, x, y, z)."""
    w, x, y, z = (float(component) for component in quaternion_from_rotation(T))
    return w, x, y, z


def _solid(
    vertices: tuple[Vector, ...],
    faces: tuple[tuple[int, int, int], ...],
    T_link_solid: Array,
    own: tuple[float, float, float, float],
    color: Color | None,
    opacity: float,
) -> Solid:
    return Solid(
        position=position_of(T_link_solid),
        orientation=orientation_of(T_link_solid),
        vertices=vertices,
        faces=faces,
        color=own[:3] if color is None else color,
        opacity=own[3] * opacity,
    )


def _capsule_profile(radius: float, half: float) -> _Profile:
    below = [
        (radius * math.cos(angle), -half + radius * math.sin(angle))
        for angle in (-0.5 * math.pi * (RINGS - k) / RINGS for k in range(1, RINGS + 1))
    ]
    above = [(r, -z) for r, z in reversed(below)]
    profile = [(0.0, -half - radius), *below, *above, (0.0, half + radius)]
    return list(dict.fromkeys(profile))  # a ball has one equator


def _box_triangles(size: tuple[float, float, float]) -> Triangles:
    """Return a box; every side has corners of its own, which makes its edges look sharp."""
    vertices: list[Vector] = []
    faces: list[tuple[int, int, int]] = []
    for axis, sign in product(range(3), (-1.0, 1.0)):
        u, v = ((axis + 1) % 3, (axis + 2) % 3) if sign > 0 else ((axis + 2) % 3, (axis + 1) % 3)
        first = len(vertices)
        for at_u, at_v in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
            corner = [0.0, 0.0, 0.0]
            corner[axis], corner[u], corner[v] = 0.5 * sign * size[axis], at_u * size[u], at_v * size[v]
            vertices.append((corner[0], corner[1], corner[2]))
        faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return tuple(vertices), tuple(faces)


def _revolved(profile: _Profile) -> Triangles:
    """Revolve a profile about z; a ring of radius 0 is a single point."""
    vertices: list[Vector] = []
    rings = []
    for radius, z in profile:
        first = len(vertices)
        if radius == 0.0:
            vertices.append((0.0, 0.0, z))
            rings.append([first] * SIDES)
        else:
            turns = (math.tau * k / SIDES for k in range(SIDES))
            vertices.extend((radius * math.cos(turn), radius * math.sin(turn), z) for turn in turns)
            rings.append(list(range(first, first + SIDES)))
    faces: list[tuple[int, int, int]] = []
    for lower, upper in pairwise(rings):
        for k in range(SIDES):
            a, b, c, d = lower[k], lower[(k + 1) % SIDES], upper[(k + 1) % SIDES], upper[k]
            faces.extend(face for face in ((a, b, c), (a, c, d)) if len(set(face)) == 3)
    return tuple(vertices), tuple(faces)


def _merged(parts: list[Triangles]) -> Triangles:
    vertices: list[Vector] = []
    faces: list[tuple[int, int, int]] = []
    for points, triangles in parts:
        first = len(vertices)
        vertices.extend(points)
        faces.extend((a + first, b + first, c + first) for a, b, c in triangles)
    return tuple(vertices), tuple(faces)
