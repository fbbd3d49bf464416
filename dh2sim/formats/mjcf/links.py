"""The links of an MJCF's arm: from each body and all that is fixed to it its mass, its inertia and its appearance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Final

import numpy as np

from dh2sim.formats.mesh_paths import OUTSIDE
from dh2sim.formats.mjcf.compile import Compiled, MeshFile
from dh2sim.formats.mjcf.tree import WORLD, MjcfBody, MjcfTree, pose
from dh2sim.formats.serial_robot import Inertial, Look, SerialMesh, can_show, possible_inertial
from dh2sim.kinematics.transforms import compose, invert, rotate_tensor
from dh2sim.messages import Notes, listed
from dh2sim.model.mass import MassProperties, combine, in_frame
from dh2sim.model.robot_model import Color
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    import mujoco


def read_inertial(compiled: Compiled, tree: MjcfTree, body: MjcfBody, name: str, notes: Notes) -> Inertial:
    """Return the mass properties of a body and of all that is fixed to it, in the body's frame, as compiled.

    Args:
        compiled: The model.
        tree: Its bodies.
        body: A link of the arm.
        name: Of the link.
        notes: Takes what is unknown.
    """
    model = compiled.model
    parts = tree.rigid(body.id)
    if any(model.body_gravcomp[part] for part in parts):
        notes.group("Compensation of gravity is not carried over, of links {}.", name)
    if compiled.unknown_masses.intersection(parts):
        notes.group("The mass is unknown, as it would come from missing shapes, of links {}.", name)
        return Inertial()
    known = [_in_link(model, tree, body, part) for part in parts if model.body_mass[part] > 0.0]
    if not known:
        notes.group("The file gives no mass for links {}.", name)
        return Inertial()
    whole = known[0] if len(known) == 1 else combine(known)
    if not _is_finite(whole):
        notes.group("Masses that cannot be used are left out, of links {}.", name)
        return Inertial()
    return possible_inertial(whole, name, notes)


def _is_finite(body: MassProperties) -> bool:
    """Whether all numbers are finite."""
    return bool(np.isfinite([body.mass, *body.com, *body.inertia.ravel()]).all())


def _in_link(model: mujoco.MjModel, tree: MjcfTree, link: MjcfBody, part: int) -> MassProperties:
    T = pose(model.body_ipos[part], model.body_iquat[part])
    own = MassProperties(
        mass=float(model.body_mass[part]),
        com=read_only(T[:3, 3]),
        inertia=rotate_tensor(T, read_only(np.diag(model.body_inertia[part]))),
    )
    return own if part == link.id else in_frame(tree.drawn_pose(link.id, part), own)


def weight_of(compiled: Compiled, tree: MjcfTree, bodies: Sequence[int]) -> str:
    """Return words for some bodies and their mass, such as ``body 'finger' (0.1 kg)``."""
    unknown = compiled.unknown_masses.intersection(bodies)
    mass = None if unknown else sum(float(compiled.model.body_mass[body]) for body in bodies)
    return tree.links.weighed(bodies, mass)


_GREY: Final = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's colour of a geom for which the file gives none."""


def read_look(compiled: Compiled, tree: MjcfTree, body: MjcfBody, name: str, notes: Notes) -> Look:
    """Choose the mesh and the colour of a body with all that is fixed to it.

    Geoms that only show the body (contype and conaffinity 0) come first; among these the first mesh that can be
    used, with its colour; or else the first colour.

    Args:
        compiled: The model.
        tree: Its bodies.
        body: A link of the arm; geoms of the world are not part of one.
        name: Of the link.
        notes: Takes what was left out.
    """
    model = compiled.model
    if body.id == WORLD:
        return Look()
    geoms = [(part, geom) for part in tree.rigid(body.id) for geom in _geoms_of(model, part)]
    geoms.sort(key=lambda item: not _only_shows(model, item[1]))  # a stable sort
    mesh = None
    colors: list[Color | None] = []
    for part, geom in geoms:
        T = tree.drawn_pose(body.id, part)
        found = _mesh(compiled, geom, T, name, mesh is not None, notes)
        if found is not None:
            mesh, colors = found, [_color(model, geom)]
        elif mesh is None:
            colors.append(_color(model, geom))
    if shapes := list(dict.fromkeys(kind for _, geom in geoms if (kind := _primitive(compiled, geom)))):
        notes.group("Shapes other than meshes are not carried over, of links {}.", name, listed(shapes))
    return Look(mesh=mesh, color=next((color for color in colors if color is not None), None))


def _geoms_of(model: mujoco.MjModel, body: int) -> range:
    start, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    return range(start, start + count) if count else range(0)


def _only_shows(model: mujoco.MjModel, geom: int) -> bool:
    return int(model.geom_contype[geom]) == 0 and int(model.geom_conaffinity[geom]) == 0


def _primitive(compiled: Compiled, geom: int) -> str | None:
    """Return the kind of a shape that is not a mesh, or None."""
    import mujoco

    kind = int(compiled.model.geom_type[geom])
    if geom in compiled.lost_geoms or kind == int(mujoco.mjtGeom.mjGEOM_MESH):
        return None
    return str(mujoco.mjtGeom(kind).name).removeprefix("mjGEOM_").lower()


def _mesh(
    compiled: Compiled, geom: int, T_link_body: Array, name: str, has_one: bool, notes: Notes
) -> SerialMesh | None:
    """Return the mesh of a geom, if it is one that can be used and the first; others are noted."""
    import mujoco

    model = compiled.model
    if geom in compiled.lost_geoms:
        if compiled.lost_geoms[geom] in compiled.outside:
            notes.group(OUTSIDE, name, compiled.lost_geoms[geom])
            return None
        how = "used" if compiled.meshes_refused else "found"
        uri = PurePosixPath(compiled.lost_geoms[geom]).name or "a height field"
        notes.group(f"Meshes were not {how}, of links {{}}.", name, uri)
        return None
    if int(model.geom_type[geom]) != int(mujoco.mjtGeom.mjGEOM_MESH):
        return None
    file = compiled.mesh_files.get(int(model.geom_dataid[geom]))
    if has_one:
        if _only_shows(model, geom):
            notes.group("A link shows one mesh; further ones are not carried over, of links {}.", name)
        return None
    if file is None:
        notes.group("Meshes that are written in the file itself are not carried over, of links {}.", name)
    elif can_show(file.path.suffix, file.scale, name, notes):
        T = compose(T_link_body, T_body_file(model, geom, file))
        if np.isfinite(T).all():
            return SerialMesh(uri=file.uri, path=file.path, scale=file.scale[0], T_link_mesh=T)
    return None


def T_body_file(model: mujoco.MjModel, geom: int, file: MeshFile) -> Array:
    """Return the pose of a mesh file's own frame, its positions scaled, in the body of a geom; shape (4, 4).

    MuJoCo makes vertices v of positions p of the file in two steps: R(refquat)ᵀ scale (p - refpos), and then it
    centres and turns the mesh, which ``mesh_pos`` and ``mesh_quat`` undo. The geom's pose has been changed to match.
    """
    mesh = int(model.geom_dataid[geom])
    T_body_geom = pose(model.geom_pos[geom], model.geom_quat[geom])
    T_centre = pose(model.mesh_pos[mesh], model.mesh_quat[mesh])
    T_ref = pose(np.multiply(file.scale, file.refpos), np.array(file.refquat))
    return compose(compose(T_body_geom, invert(T_centre)), invert(T_ref))


def _color(model: mujoco.MjModel, geom: int) -> Color | None:
    """Return the colour that MuJoCo shows a geom in, or None where the file gives none."""
    material = int(model.geom_matid[geom])
    own = _rgba(model.geom_rgba[geom])
    if own != _GREY:
        return own if _is_color(own) else None
    if material < 0:
        return None
    color = _rgba(model.mat_rgba[material])
    return color if _is_color(color) else None


def _rgba(values: Array) -> Color:
    """Return four numbers as they were written: MuJoCo keeps them in single precision."""
    red, green, blue, alpha = (float(str(np.float32(value))) for value in values)
    return red, green, blue, alpha


def _is_color(color: Color) -> bool:
    return all(0.0 <= value <= 1.0 for value in color)
