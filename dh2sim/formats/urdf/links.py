"""The links of a URDF's arm: what is fixed to each, and from all of that its mass, its inertia and its appearance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Final

import numpy as np

from dh2sim.formats.mesh_paths import OUTSIDE, FindMesh, MeshOutsideError
from dh2sim.formats.serial_robot import Inertial, Look, SerialMesh, can_show, possible_inertial
from dh2sim.formats.urdf.chain import Selection
from dh2sim.formats.urdf.tree import UrdfJoint, UrdfTree, read_number, read_numbers, read_only_child, read_pose
from dh2sim.formats.xml_read import Element, XmlReport, place
from dh2sim.kinematics.transforms import compose, identity, invert, move_point, rotate_tensor
from dh2sim.messages import Notes, shown
from dh2sim.model.collada import T_read_file
from dh2sim.model.mass import MassProperties, combine, thickened
from dh2sim.model.meshes import read_mesh_file
from dh2sim.model.robot_model import Color
from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """A link of the file that is fixed to a link of the arm."""

    name: str
    element: Element = field(repr=False)
    T_link_part: Array = field(repr=False)
    """Its pose in the link of the arm, shape (4, 4)."""
    on_chain: bool
    """Whether it lies between base and tip."""

    @property
    def path(self) -> str:
        """The start of the path of a problem."""
        return place("link", self.name)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A link of the arm with all that is fixed to it."""

    parts: tuple[Part, ...]
    """The link itself first."""
    branches: tuple[UrdfJoint, ...]
    """Joints on it that move and are not the arm's."""

    @property
    def name(self) -> str:
        """Name of the link of the arm."""
        return self.parts[0].name


def read_bodies(tree: UrdfTree, selection: Selection, report: XmlReport, notes: Notes) -> tuple[Body, ...]:
    """Return the base and the link of every moving joint, in order, with what is fixed to them.

    A fixed joint off the arm whose pose cannot be read is noted, and what it carries is left out.
    """
    arm = frozenset(joint.name for joint in selection.joints)
    starts = [selection.base, *(joint.child for joint in selection.joints if joint.moves)]
    return tuple(_body(tree, start, arm, report, notes) for start in starts)


def _body(tree: UrdfTree, start: str, arm: frozenset[str], report: XmlReport, notes: Notes) -> Body:
    parts, branches = [], []
    waiting = [Part(name=start, element=tree.elements[start], T_link_part=identity(), on_chain=True)]
    while waiting:
        part = waiting.pop()
        parts.append(part)
        fixed = []
        for joint in tree.below[part.name]:
            if joint.moves:
                branches += [] if joint.name in arm else [joint]
                continue
            off = XmlReport(report.file)  # the arm's own joints have been read, with the arm's report
            T = compose(part.T_link_part, read_pose(joint.element, joint.path, off))
            if off.problems and joint.name not in arm:
                sentence = "Joints that cannot be read are left out with all that they carry: {}."
                note_unreadable(off, sentence, joint.name, notes)
                continue
            element, on_chain = tree.elements[joint.child], joint.name in arm
            fixed.append(Part(name=joint.child, element=element, T_link_part=T, on_chain=on_chain))
        waiting += reversed(fixed)
    return Body(parts=tuple(parts), branches=tuple(branches))


def note_unreadable(report: XmlReport, sentence: str, name: str, notes: Notes) -> None:
    """Note a problem that does not matter to the arm; the sentence has a ``{}`` for all such names."""
    problem = min(report.problems)
    notes.group(sentence, name, f"line {problem.line}: {problem.message}")


def weight_of(tree: UrdfTree, links: Sequence[str]) -> str:
    """Return words for some links and their mass, such as ``link 'finger' (0.1 kg)``."""
    return tree.links.weighed(links, sum(_mass(tree.elements[name]) for name in links))


def _mass(link: Element) -> float:
    """Return the mass of a link off the arm, as far as it can be read."""
    inertial = link.first("inertial")
    mass = None if inertial is None else inertial.first("mass")
    value = 0.0 if mass is None else read_number(mass, "value", "", XmlReport(""))
    return value if value > 0.0 else 0.0


_POINT_MASS_SHARE: Final = 0.1
"""Of a body's mass: parts of unknown inertia that are lighter than that may count as points."""


def read_inertial(body: Body, report: XmlReport, notes: Notes) -> Inertial:
    """Combine the masses of all parts of a body.

    Broken numbers in a part on the way from base to tip are problems; elsewhere they are noted and the part has no
    mass. An impossible inertia is noted and counts as unknown. Parts of unknown inertia count as point
    masses where they are light; else the inertia of the whole is unknown.

    Args:
        body: A link of the arm.
        report: Takes the problems.
        notes: Takes what was left out.
    """
    known = [found for part in body.parts if (found := _read_part(part, report, notes)) is not None]
    if not known:
        notes.group("The file gives no mass for links {}.", body.name)
        return Inertial()
    whole = known[0][0] if len(known) == 1 else combine(mass for mass, _ in known)
    unknown = [mass.mass for mass, has_inertia in known if not has_inertia]
    if not unknown:
        return possible_inertial(whole, body.name, notes)
    if math.fsum(unknown) > _POINT_MASS_SHARE * whole.mass:
        if len(known) > 1:
            notes.group("The inertia of a heavy part is unknown, and so that of the whole, for links {}.", body.name)
        return Inertial(mass=whole.mass, com=whole.com)
    notes.group("Light parts of unknown inertia were counted as point masses, in links {}.", body.name)
    return possible_inertial(whole, body.name, notes)


def _read_part(part: Part, report: XmlReport, notes: Notes) -> tuple[MassProperties, bool] | None:
    """Return a part's mass properties in the link of the arm and whether its inertia is known; None without mass."""
    own = report if part.on_chain else XmlReport(report.file)
    before = len(own.problems)
    inertial = read_only_child(part.element, "inertial", part.path, own)
    if inertial is None:
        return None
    path = f"{part.path}.inertial"
    T = compose(part.T_link_part, read_pose(inertial, path, own))
    mass_element = read_only_child(inertial, "mass", path, own)
    mass = 0.0 if mass_element is None else read_number(mass_element, "value", f"{path}.mass", own)
    tensor = _tensor(inertial, path, own)
    if len(own.problems) > before:
        if own is not report:
            note_unreadable(own, "Masses that cannot be read are left out, of links {}.", part.name, notes)
        return None
    if mass < 0.0:
        notes.group("Negative masses are left out, of links {}.", part.name)
    elif mass == 0.0 and tensor is not None and tensor.any():
        notes.group("Inertias without a mass are left out, of links {}.", part.name)
    if mass <= 0.0:
        return None
    com = read_only(move_point(T, read_only([0, 0, 0])))
    if tensor is not None and thickened(tensor) is None:
        notes.group("Impossible inertias are left out, of links {}.", part.name)
        tensor = None
    elif tensor is None:
        notes.group("The file gives a mass without an inertia for links {}.", part.name)
    inertia = rotate_tensor(T, read_only(np.zeros((3, 3))) if tensor is None else tensor)
    return MassProperties(mass=mass, com=com, inertia=inertia), tensor is not None


def _tensor(inertial: Element, path: str, report: XmlReport) -> Array | None:
    """Return the inertia along the axes of the inertial's own frame, or None where there is none."""
    element = read_only_child(inertial, "inertia", path, report)
    if element is None:
        return None
    path = f"{path}.inertia"
    xx, yy, zz = (read_number(element, name, path, report) for name in ("ixx", "iyy", "izz"))
    xy, xz, yz = (
        read_number(element, name, path, report) if name in element.attributes else 0.0
        for name in ("ixy", "ixz", "iyz")
    )
    return read_only([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def read_materials(robot: Element) -> Mapping[str, Color]:
    """Return the colours with a name; the robot's own win over those that links define."""
    materials: dict[str, Color] = {}
    visuals = [visual for link in robot.all("link") for visual in link.all("visual")]
    for owner in (robot, *visuals):
        for material in owner.all("material"):
            color = _color(material, "", XmlReport(""))
            if color is not None:
                materials.setdefault(material.attributes.get("name", ""), color)
    materials.pop("", None)
    return materials


def read_look(
    body: Body, materials: Mapping[str, Color], find_mesh: FindMesh, report: XmlReport, notes: Notes
) -> Look:
    """Choose the mesh and the colour of a body.

    Args:
        body: A link of the arm.
        materials: Colours by name.
        find_mesh: Returns the file of a mesh uri, or None.
        report: Only for the file's name: problems of the appearance are not errors.
        notes: Takes what was left out, links of one reason together.

    Returns:
        The first mesh that can be used, with its colour; or else the first colour.
    """
    mesh = None
    colors: list[Color | None] = []
    for part in body.parts:
        for visual in part.element.all("visual"):
            own = XmlReport(report.file)
            found = _mesh(visual, part, find_mesh, mesh is not None, own, notes)
            color = _material(visual, f"{part.path}.visual", materials, own)
            if own.problems:
                note_unreadable(own, "Visuals that cannot be read are left out, of links {}.", part.name, notes)
            if found is not None:
                mesh, colors = found, [color]
            elif mesh is None:
                colors.append(color)
    return Look(mesh=mesh, color=next((color for color in colors if color is not None), None))


def _mesh(
    visual: Element, part: Part, find_mesh: FindMesh, has_one: bool, report: XmlReport, notes: Notes
) -> SerialMesh | None:
    """Return the mesh of a visual, if it is one that can be used and the first."""
    path = f"{part.path}.visual"
    geometry = read_only_child(visual, "geometry", path, report)
    mesh = None if geometry is None else geometry.first("mesh")
    if mesh is None:
        for shape in () if geometry is None else geometry.children:
            notes.group("Shapes other than meshes are not carried over: {}.", part.name, shape.tag[:60])
        return None
    uri = mesh.attributes.get("filename", "")
    scale = read_numbers(mesh, "scale", f"{path}.geometry.mesh", report, count=3, default=(1.0, 1.0, 1.0))
    T = compose(part.T_link_part, read_pose(visual, path, report))
    if report.problems:
        return None
    if has_one:
        notes.group("A link shows one mesh; further ones are not carried over, of links {}.", part.name)
    elif not can_show(PurePosixPath(uri).suffix, scale, part.name, notes):
        return None
    else:
        return _found(uri, scale[0], T, part.name, find_mesh, notes)
    return None


def _found(uri: str, scale: float, T: Array, name: str, find_mesh: FindMesh, notes: Notes) -> SerialMesh | None:
    """Return a mesh that can be shown, if its file is there and may be used."""
    try:
        file = find_mesh(uri)
    except MeshOutsideError:
        notes.group(OUTSIDE, name, uri)
        return None
    if file is None:
        notes.group(f"Meshes were not found in {_folder(uri)}, of links {{}}.", name)
        return None
    return SerialMesh(uri=uri, path=file, scale=scale, T_link_mesh=_unturned(file, T, name, notes))


def _unturned(file: Path, T: Array, name: str, notes: Notes) -> Array:
    """Return the pose of a mesh; readers of URDF take no notice of the up axis of a COLLADA file."""
    if file.suffix.lower() != ".dae":
        return T
    try:
        T_file = T_read_file(read_mesh_file(file))
    except (OSError, ValueError):  # which the export will report
        return T
    if not np.array_equal(T_file, identity()):
        notes.group("The up axis of COLLADA meshes is not applied, as URDF has it, of links {}.", name)
    return compose(T, invert(T_file))


def _folder(uri: str) -> str:
    """Return words for where a mesh should be: its package, or the folder in its name."""
    scheme, between, rest = uri.partition("://")
    if between:
        return shown(f"{scheme}://{rest.partition('/')[0]}")
    folder = str(PurePosixPath(uri).parent)
    return "the file's folder" if folder == "." else shown(folder)


def _material(visual: Element, path: str, materials: Mapping[str, Color], report: XmlReport) -> Color | None:
    """Return the colour of a visual: its own, or that of the material with its name."""
    material = visual.first("material")
    if material is None:
        return None
    color = _color(material, path, report)
    return materials.get(material.attributes.get("name", "")) if color is None else color


def _color(material: Element, path: str, report: XmlReport) -> Color | None:
    element = material.first("color")
    if element is None:
        return None
    path = f"{path}.material.color"
    nothing = (-1.0, -1.0, -1.0, -1.0)
    red, green, blue, alpha = read_numbers(element, "rgba", path, report, count=4, default=nothing)
    color = (red, green, blue, alpha)
    if all(0.0 <= value <= 1.0 for value in color):
        return color
    if not report.problems:
        found = shown(element.attributes.get("rgba", ""))
        report.add(element, f"{path}.rgba", f"expected 4 numbers from 0 to 1, found {found}")
    return None
