"""Meshes that show links, converted to binary STL, which every engine reads; trimesh reads all but COLLADA."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dh2sim.errors import MeshError
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.model.collada import read_collada
from dh2sim.robot.spec import MeshSpec
from dh2sim.typing import Array

if TYPE_CHECKING:
    import trimesh

MAX_FACES = 200_000
"""MuJoCo refuses an STL file with more."""
MIN_CORNERS = 4
"""MuJoCo refuses a mesh with fewer."""
MIN_AREA = 1e-12
"""m²: MuJoCo finds no centre of a smaller surface."""
STL_HEADER, STL_FACE = 84, 50
"""Bytes of a binary STL file: before the faces, and for each."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshAsset:
    """A mesh file as it is exported; it shows a link, placed in the link's DH frame."""

    file_name: str
    """Name in the export's ``meshes`` folder."""
    data: bytes = field(repr=False)
    """A binary STL file."""
    scale: float
    """Metres per unit of the file."""
    T_dh_mesh: Array = field(repr=False)
    """Pose of the mesh's own frame in the link's DH frame, shape (4, 4)."""
    converted_from: str | None
    """Suffix of the original where it was no binary STL file, such as ``.glb``; colours and textures are lost."""


def load_mesh(mesh: MeshSpec, link_name: str) -> MeshAsset:
    """Read a mesh file.

    Args:
        mesh: Which file, its scale and its pose.
        link_name: Names the exported file.

    Raises:
        MeshError: It cannot be read, has no faces or too many, fewer than four corners, no area, or numbers that
            are not finite; the text names the row of the robot file, or the link.
    """
    place = mesh.location or link_name
    try:
        original = mesh.file.read_bytes()
        surface = _read(mesh, original)
    except Exception as error:  # trimesh's readers raise many types
        raise MeshError(f"{place}: cannot read the mesh '{mesh.file}': {_words(error)}") from error
    _check(surface, mesh, place)
    suffix = mesh.file.suffix.lower()
    if suffix == ".stl" and len(original) == STL_HEADER + STL_FACE * len(surface.faces):
        data, converted = original, None
    else:
        data, converted = bytes(surface.export(file_type="stl")), suffix
    return MeshAsset(
        file_name=f"{link_name}.stl",
        data=data,
        scale=mesh.scale,
        T_dh_mesh=pose_from_rpy(mesh.pose.xyz, mesh.pose.rpy),
        converted_from=converted,
    )


def _read(mesh: MeshSpec, data: bytes) -> trimesh.Trimesh:
    import trimesh  # takes seconds: only robots with meshes pay for it

    if mesh.file.suffix.lower() == ".dae":
        vertices, faces = read_collada(data)
        return trimesh.Trimesh(vertices, faces, process=False)
    return trimesh.load_mesh(mesh.file, process=False)


def _check(surface: trimesh.Trimesh, mesh: MeshSpec, place: str) -> None:
    import numpy as np

    faces = len(getattr(surface, "faces", ()))
    if faces == 0:
        raise MeshError(f"{place}: the mesh '{mesh.file}' has no faces")
    if faces > MAX_FACES:
        raise MeshError(
            f"{place}: the mesh '{mesh.file}' has {faces} faces; MuJoCo reads at most {MAX_FACES}. "
            "Simplify it, for instance with Blender's Decimate or trimesh's simplify_quadric_decimation"
        )
    corners = np.asarray(surface.vertices)[np.unique(surface.faces)]
    if not (np.abs(corners) <= np.finfo(np.float32).max).all():  # STL files hold single precision
        raise MeshError(f"{place}: the mesh '{mesh.file}' has coordinates that are not finite")
    if len(np.unique(corners.astype(np.float32), axis=0)) < MIN_CORNERS:
        raise MeshError(f"{place}: the mesh '{mesh.file}' has fewer than {MIN_CORNERS} corners; MuJoCo refuses it")
    area = float(surface.area) * mesh.scale**2
    if not area >= MIN_AREA:
        raise MeshError(
            f"{place}: the mesh '{mesh.file}' has an area of {area:.3g} m² with scale {mesh.scale!r}; MuJoCo "
            f"needs at least {MIN_AREA!r}"
        )


def _words(error: Exception) -> str:
    text = " ".join((error.strerror if isinstance(error, OSError) and error.strerror else str(error)).split())
    return text or type(error).__name__
