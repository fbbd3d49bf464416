"""URDF text -> SerialRobot; what of the file has no place in a serial arm is noted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

from dh2sim.formats.arm import described, note_gravity, note_left_out
from dh2sim.formats.mesh_paths import FindMesh
from dh2sim.formats.serial_robot import SerialLink, SerialRobot
from dh2sim.formats.urdf.chain import Selection, select_chain
from dh2sim.formats.urdf.joints import read_joints
from dh2sim.formats.urdf.links import Body, read_bodies, read_inertial, read_look, read_materials, weight_of
from dh2sim.formats.urdf.mechanics import urdf_mechanics
from dh2sim.formats.urdf.tree import UrdfJoint, UrdfTree, read_pose, read_tree
from dh2sim.formats.xacro import is_definition
from dh2sim.formats.xml_read import Element, XmlReport, parse_xml
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.messages import Notes, listed, shown
from dh2sim.typing import Array, read_only

_CARRIED: Final = {
    "robot": ("link", "joint", "material", "mujoco"),
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
}
"""Elements that are read, or noted elsewhere. ``mujoco`` only says how MuJoCo should read the file."""


def _note_unused(tree: UrdfTree, selection: Selection, bodies: Sequence[Body], notes: Notes) -> None:
    """Note what is merged, what is not on the arm, and what a robot file has no place for."""
    for body in bodies:
        merged = listed(shown(part.name) for part in body.parts[1:])
        if len(body.parts) > 1:
            notes.group(
                "Links that are fixed to a link of the arm were merged into it: {}.", body.name, f"with {merged}"
            )
    _note_branches(tree, selection, bodies, notes)
    if any(part.element.first("collision") for body in bodies for part in body.parts):
        notes.add("Collision shapes are not carried over.")
    _note_elements(tree, notes)


def _note_branches(tree: UrdfTree, selection: Selection, bodies: Sequence[Body], notes: Notes) -> None:
    if others := tree.links.not_below(selection.base):
        notes.add(f"What is not below the base {shown(selection.base)} is left out: {weight_of(tree, others)}.")

    def describe(joint: UrdfJoint) -> str:
        what = weight_of(tree, tree.links.below(joint.child))
        return f"with joint {shown(joint.name)} ({_kind(joint)}) on {shown(joint.parent)}: {what}"

    note_left_out(notes, [partial(describe, joint) for body in bodies for joint in body.branches])


def _kind(joint: UrdfJoint) -> str:
    mimic = joint.element.first("mimic")
    return joint.type if mimic is None else f"{joint.type}, mimics {shown(mimic.attributes.get('joint', ''))}"


def _note_elements(tree: UrdfTree, notes: Notes) -> None:
    counts: Counter[str] = Counter()
    for owner in (tree.robot, *tree.robot.all("link"), *tree.robot.all("joint")):
        for element in owner.children:
            if is_definition(element, tree.robot):
                name = element.attributes.get("name", "")
                notes.group("Definitions for xacro that nothing needs are left out: {}.", name, element.tag[:60])
            elif element.tag not in _CARRIED[owner.tag]:
                counts[element.tag] += 1
    if loops := counts.pop("loop_joint", 0):
        notes.add(f"The file closes loops with {loops} <loop_joint>; the arm is read as if it were open.")
    if counts:
        names = (f"{count} <{tag[:60]}>" if count > 1 else f"<{tag[:60]}>" for tag, count in sorted(counts.items()))
        notes.add(f"Elements that a robot file has no place for are not carried over: {listed(names)}.")


def read_urdf(
    data: bytes | Element, *, file: str, base: str | None = None, tip: str | None = None, find_mesh: FindMesh
) -> SerialRobot:
    """Return the serial arm that a URDF describes.

    Fixed joints are merged: poses are multiplied, and masses are combined into the link that carries them. Link
    frames are those of the URDF. What is not on the arm must be part of the tree, but its numbers do not matter.
    ``find_mesh`` may look for files; only COLLADA meshes are opened, for their up axis.

    Args:
        data: The file's content, or its root element.
        file: Its name, for messages.
        base: Name of the link at which the arm begins; by default the root.
        tip: Name of the link at which it ends. By default ``tool0`` where there is one; else where the only way that
            moves ends, or at a hand: a fork behind three joints or more, into branches of fewer joints.
        find_mesh: Returns the file of a mesh uri such as ``package://pkg/link.stl``, or None; never raises.

    Raises:
        ImportedFileError: The file is wrong, or holds no such arm; the error holds everything that is wrong.
    """
    report, notes = XmlReport(file), Notes()
    tree = read_tree(data if isinstance(data, Element) else parse_xml(data, file=file), report)
    selection = select_chain(tree, base, tip, report, notes)
    joints = read_joints(selection, report, notes)
    bodies = read_bodies(tree, selection, report, notes)
    links = _serial_links(tree, bodies, find_mesh, report, notes)
    report.check()
    gravity = _gravity(tree, selection, notes)
    _note_unused(tree, selection, bodies, notes)
    name = tree.robot.attributes.get("name", "") or Path(file).name.partition(".")[0]
    return SerialRobot(
        name=name,
        description=described("URDF", file, selection.base, selection.tip),
        chain=joints.chain,
        base=links[0],
        links=links[1:],
        limits=joints.limits,
        dynamics=joints.dynamics,
        gravity=gravity,
        mechanics=urdf_mechanics(tree.robot, [joint.name for joint in joints.chain.joints]),
        notes=notes.sentences(),
    )


def _serial_links(
    tree: UrdfTree, bodies: tuple[Body, ...], find_mesh: FindMesh, report: XmlReport, notes: Notes
) -> tuple[SerialLink, ...]:
    """Return the base and the moving links; a robot file has no mass of the base, so that nothing is noted of it."""
    materials = read_materials(tree.robot)
    links = []
    for body in bodies:
        is_base = body is bodies[0]
        inertial = read_inertial(body, XmlReport(report.file) if is_base else report, Notes() if is_base else notes)
        links.append(SerialLink.of(body.name, inertial, read_look(body, materials, find_mesh, report, notes)))
    return tuple(links)


def _gravity(tree: UrdfTree, selection: Selection, notes: Notes) -> Array:
    """Return gravity in the base, which may be turned in the root: in a URDF z of the root points up."""
    T_root_base = identity()
    unread = XmlReport("")
    joint = tree.above.get(selection.base)
    while joint is not None:
        T_root_base = compose(read_pose(joint.element, joint.path, unread), T_root_base)
        joint = tree.above.get(joint.parent)
    gravity = [-9.81 * value + 0.0 for value in T_root_base[2, :3].tolist()]
    if unread.problems or gravity == [0.0, 0.0, -9.81]:
        return read_only([0, 0, -9.81])
    note_gravity(notes, gravity, shown(selection.base), shown(tree.links.root))
    return read_only(gravity)
