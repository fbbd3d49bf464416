"""Meshes that show links, converted to binary STL, which every engine reads.

They may come from strangers: another process reads them (``mesh_worker``), within limits of time and memory.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from dh2sim.errors import MeshError
from dh2sim.files import read_plain_file
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.limited_process import WorkerError, ask_worker
from dh2sim.robot.links import MeshSpec
from dh2sim.robot.magnitudes import LENGTH, shown_size
from dh2sim.typing import Array

MAX_BYTES: Final = 100_000_000
"""Of a mesh file."""
MAX_FACES = 200_000
"""MuJoCo refuses an STL file with more."""
MAX_COORDINATE = 2.0**30
"""In a file; MuJoCo refuses one with more."""
MIN_CORNERS = 4
"""MuJoCo refuses a mesh with fewer."""
MIN_AREA = 1e-12
"""m²: MuJoCo finds no centre of a smaller surface."""
_WORKER: Final = "dh2sim.model.mesh_worker"
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
        MeshError: It cannot be read or is too large, has no faces or too many, fewer than four corners, no area, or
            numbers that are not finite; the text names the row of the robot file, or the link.
    """
    place = mesh.location or link_name
    try:
        original = read_mesh_file(mesh.file)
        facts, data = _read(mesh.file.suffix.lower(), original)
    except (OSError, WorkerError) as error:
        raise MeshError(f"{place}: cannot read the mesh '{mesh.file}': {_words(error)}") from error
    _check(facts, mesh, place)
    suffix = mesh.file.suffix.lower()
    if suffix == ".stl" and len(original) == STL_HEADER + STL_FACE * facts["faces"]:
        data, converted = original, None
    else:
        converted = suffix
    return MeshAsset(
        file_name=f"{link_name}.stl",
        data=data,
        scale=mesh.scale,
        T_dh_mesh=pose_from_rpy(mesh.pose.xyz, mesh.pose.rpy),
        converted_from=converted,
    )


def read_mesh_file(path: Path) -> bytes:
    """Return the content of a mesh file.

    Raises:
        OSError: It cannot be read, is not a plain file, or has more than ``MAX_BYTES`` bytes.
    """
    return read_plain_file(path.resolve(), MAX_BYTES)


def _read(suffix: str, data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return what the worker says of a mesh, and the triangles as a binary STL file."""
    head, _, stl = ask_worker(_WORKER, suffix.encode() + b"\n" + data).partition(b"\n")
    return json.loads(head), stl


def _check(facts: dict[str, Any], mesh: MeshSpec, place: str) -> None:
    if (reason := facts.get("refused")) is not None:
        raise MeshError(f"{place}: cannot read the mesh '{mesh.file}': {reason}")
    faces = facts["faces"]
    if faces == 0:
        raise MeshError(f"{place}: the mesh '{mesh.file}' has no faces")
    if faces > MAX_FACES:
        raise MeshError(
            f"{place}: the mesh '{mesh.file}' has {faces} faces; MuJoCo reads at most {MAX_FACES}. "
            "Simplify it, for instance with Blender's Decimate or trimesh's simplify_quadric_decimation"
        )
    if not facts["finite"]:
        raise MeshError(f"{place}: the mesh '{mesh.file}' has coordinates that are not finite")
    if facts["corners"] < MIN_CORNERS:
        raise MeshError(f"{place}: the mesh '{mesh.file}' has fewer than {MIN_CORNERS} corners; MuJoCo refuses it")
    if facts["largest"] > MAX_COORDINATE:
        raise MeshError(
            f"{place}: the mesh '{mesh.file}' has a coordinate of {facts['largest']:.3g}; MuJoCo reads at most "
            f"{MAX_COORDINATE:.3g}"
        )
    if (largest := facts["largest"] * mesh.scale) > LENGTH.most:
        raise MeshError(
            f"{place}: the mesh '{mesh.file}' has a coordinate of {largest:.3g} m with scale {mesh.scale!r}; at most "
            f"{shown_size(LENGTH.most)} m is allowed"
        )
    area = facts["area"] * mesh.scale**2
    if not area >= MIN_AREA:
        raise MeshError(
            f"{place}: the mesh '{mesh.file}' has an area of {area:.3g} m² with scale {mesh.scale!r}; MuJoCo "
            f"needs at least {MIN_AREA!r}"
        )


def _words(error: Exception) -> str:
    text = " ".join((error.strerror if isinstance(error, OSError) and error.strerror else str(error)).split())
    return text or type(error).__name__
