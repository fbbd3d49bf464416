"""URDF text -> SerialRobot: the arm of a robot that somebody else described."""

from __future__ import annotations

from pathlib import Path

from dh2sim.formats.from_urdf.chain import Selection, select_chain
from dh2sim.formats.from_urdf.inertials import read_inertial
from dh2sim.formats.from_urdf.joints import read_joints
from dh2sim.formats.from_urdf.leftovers import note_leftovers
from dh2sim.formats.from_urdf.parts import Body, read_bodies
from dh2sim.formats.from_urdf.tree import UrdfTree, read_tree
from dh2sim.formats.from_urdf.values import read_pose
from dh2sim.formats.from_urdf.visuals import read_look, read_materials
from dh2sim.formats.mesh_paths import FindMesh
from dh2sim.formats.notes import Notes
from dh2sim.formats.serial_robot import SerialLink, SerialRobot
from dh2sim.formats.xml_tree import XmlReport, parse_xml
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.robot.words import shown
from dh2sim.typing import Array, read_only


def read_urdf(
    data: bytes, *, file: str, base: str | None = None, tip: str | None = None, find_mesh: FindMesh
) -> SerialRobot:
    """Return the serial arm that a URDF describes.

    Fixed joints are merged: poses are multiplied, and masses are combined into the link that carries them. Link
    frames are those of the URDF. What is not on the arm must have its place in the tree, but its numbers do not
    matter. Nothing is opened; ``find_mesh`` may look for files.

    Args:
        data: The file's content.
        file: Its name, for messages.
        base: Name of the link that the arm begins at; by default the root.
        tip: Name of the link that it ends at. By default ``tool0`` where there is one; else where the only way that
            moves ends, or at a hand: a fork behind three joints or more, into branches of fewer joints.
        find_mesh: Returns the file of a mesh uri such as ``package://pkg/link.stl``, or None; never raises.

    Raises:
        ImportedFileError: The file is wrong, or holds no such arm; the error holds everything that is wrong.
    """
    report, notes = XmlReport(file), Notes()
    tree = read_tree(parse_xml(data, file=file), report)
    selection = select_chain(tree, base, tip, report, notes)
    joints = read_joints(selection, report, notes)
    bodies = read_bodies(tree, selection, report, notes)
    links = _links(tree, bodies, find_mesh, report, notes)
    report.check()
    gravity = _gravity(tree, selection, notes)
    note_leftovers(tree, selection, bodies, notes)
    name = tree.robot.attributes.get("name", "") or Path(file).name.partition(".")[0]
    return SerialRobot(
        name=name,
        description=f"URDF {Path(file).name}, from {_plain(selection.base)} to {_plain(selection.tip)}",
        chain=joints.chain,
        base=links[0],
        links=links[1:],
        limits=joints.limits,
        dynamics=joints.dynamics,
        gravity=gravity,
        notes=notes.sentences(),
    )


def _links(
    tree: UrdfTree, bodies: tuple[Body, ...], find_mesh: FindMesh, report: XmlReport, notes: Notes
) -> tuple[SerialLink, ...]:
    """Return the base and the moving links. Nobody uses the base's mass, so that nothing is said of it."""
    materials = read_materials(tree.robot)
    links = []
    for body in bodies:
        is_base = body is bodies[0]
        weight = read_inertial(body, XmlReport(report.file) if is_base else report, Notes() if is_base else notes)
        look = read_look(body, materials, find_mesh, report, notes)
        links.append(
            SerialLink(
                name=body.name,
                mass=weight.mass,
                com=weight.com,
                inertia=weight.inertia,
                mesh=look.mesh,
                color=look.color,
            )
        )
    return tuple(links)


def _gravity(tree: UrdfTree, selection: Selection, notes: Notes) -> Array:
    """Return gravity in the base, which may hang on the root at an angle: in a URDF z of the root points up."""
    T_root_base = identity()
    unread = XmlReport("")
    joint = tree.above.get(selection.base)
    while joint is not None:
        T_root_base = compose(read_pose(joint.element, joint.path, unread), T_root_base)
        joint = tree.above.get(joint.parent)
    gravity = [-9.81 * value + 0.0 for value in T_root_base[2, :3].tolist()]
    if unread.problems or gravity == [0.0, 0.0, -9.81]:
        return read_only([0, 0, -9.81])
    words = ", ".join(f"{value:.6g}" for value in gravity)
    notes.add(f"Gravity is ({words}) m/s² in the base {shown(selection.base)}, as that hangs on {shown(tree.root)}.")
    return read_only(gravity)


def _plain(name: str) -> str:
    """A link's name as it is, if that is fit for a line of text."""
    return name if name.isprintable() and len(name) <= 60 else shown(name)
