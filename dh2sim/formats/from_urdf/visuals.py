"""How the links of a URDF's arm look: one mesh and one colour a link; what else is shown is noted."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Final

from dh2sim.formats.from_urdf.parts import Body, Part, note_unreadable
from dh2sim.formats.from_urdf.values import read_numbers, read_only_child, read_pose
from dh2sim.formats.mesh_paths import FindMesh
from dh2sim.formats.notes import Notes
from dh2sim.formats.serial_robot import Color, Look, SerialMesh
from dh2sim.formats.xml_tree import Element, XmlReport
from dh2sim.kinematics.transforms import compose
from dh2sim.robot.fields import MESH_SUFFIXES
from dh2sim.robot.words import listed, shown

_SAME: Final = 1e-6
"""By which the three scales of a mesh may differ, relative to the greatest."""


def read_materials(robot: Element) -> Mapping[str, Color]:
    """Return the colours that have a name and can be read; the robot's own win over those that links define."""
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
        report: Only for the file's name: nothing about looks is an error.
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
            notes.group("Shapes that are no meshes are not carried over: {}.", part.name, shape.tag[:60])
        return None
    uri = mesh.attributes.get("filename", "")
    scale = read_numbers(mesh, "scale", f"{path}.geometry.mesh", report, count=3, default=(1.0, 1.0, 1.0))
    T = compose(part.T_link_part, read_pose(visual, path, report))
    if report.problems:
        return None
    suffix = PurePosixPath(uri).suffix
    if has_one:
        notes.group("A link shows one mesh; further ones are not carried over, of links {}.", part.name)
    elif suffix.lower() not in MESH_SUFFIXES:
        sentence = f"Meshes are not carried over that are none of {listed(MESH_SUFFIXES)}: those of links {{}}."
        notes.group(sentence, part.name, suffix[:20] or "no suffix")
    elif min(scale) <= 0.0 or max(scale) - min(scale) > _SAME * max(scale):
        detail = " ".join(f"{value:g}" for value in scale)
        notes.group("Meshes that are mirrored or scaled unevenly are not carried over: {}.", part.name, detail)
    elif (file := find_mesh(uri)) is None:
        notes.group(f"Meshes were not found in {_folder(uri)}, of links {{}}.", part.name)
    else:
        return SerialMesh(uri=uri, path=file, scale=scale[0], T_link_mesh=T)
    return None


def _folder(uri: str) -> str:
    """Words for where a mesh should be: its package, or the folder that the file names."""
    scheme, between, rest = uri.partition("://")
    if between:
        return shown(f"{scheme}://{rest.partition('/')[0]}")
    folder = str(PurePosixPath(uri).parent)
    return "the file's folder" if folder == "." else shown(folder)


def _material(visual: Element, path: str, materials: Mapping[str, Color], report: XmlReport) -> Color | None:
    """Return the colour of a visual: its own, or the one that its name stands for."""
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
