"""RobotModel -> URDF 1.0, with the base_link, base, flange and tool0 of REP-199."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import replace

from dh2sim.formats.urdf.tree import DYNAMICS
from dh2sim.formats.xml_write import child, document, number, numbers, provenance
from dh2sim.kinematics.parallelograms import find_couplings
from dh2sim.kinematics.transforms import compose, identity, invert, pose_from_rpy, rpy_from_rotation
from dh2sim.model.mass import LIGHTEST, MassProperties
from dh2sim.model.mechanism import BranchModel, MechanismModel, written_model
from dh2sim.model.robot_model import Color, JointModel, LinkModel
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart
from dh2sim.robot.row import JointType
from dh2sim.robot.spec import SpecLike
from dh2sim.typing import Array, read_only

MASSLESS = MassProperties(mass=0.0, com=read_only([0.0, 0.0, 0.0]), inertia=read_only([[0.0] * 3] * 3))
"""Written for links without mass: PyBullet would take 1 kg and 1 kg·m² for a link without an ``inertial``."""

T_FLANGE_DHN = pose_from_rpy([0, 0, 0], [0, math.pi / 2, 0])
"""REP-199: x of the flange points out of it, as z of tool0 does; pose of the last DH frame in the flange."""
T_DHN_FLANGE = invert(T_FLANGE_DHN)


def to_urdf(model: SpecLike, *, dh_frames: bool = True) -> str:
    """Write a robot as URDF.

    Args:
        model: the robot, in any form.
        dh_frames: whether to add the massless links dh_0 … dh_n, one at every DH frame.

    Returns:
        The text of the file. Mesh file names are relative to it: ``meshes/link_1.stl``. The ``mujoco`` element, which
        other readers ignore, makes MuJoCo keep the fixed links as bodies and give no mass to the base. Massless links
        have an ``inertial`` of zeros, but for the root, where KDL warns of any.
    """
    whole = written_model(model)
    mechanism = whole if isinstance(whole, MechanismModel) else None
    model = whole.main if isinstance(whole, MechanismModel) else whole
    robot = ET.Element("robot", name=model.name)
    child(child(robot, "mujoco"), "compiler", fusestatic="false", inertiafromgeom="false")
    materials = _materials(whole.all_links)
    for color, name in materials.items():
        child(child(robot, "material", name=name), "color", rgba=numbers(color))
    _link(robot, model.base, model.chain.T_base_link_dh0, materials, model.base.inertial)
    _frame(robot, "base", "base_link", identity())
    if dh_frames:
        _frame(robot, "dh_0", "base_link", model.chain.T_base_link_dh0)
    parent = model.base.name
    for i, (link, joint) in enumerate(zip(model.links, model.joints, strict=True), start=1):
        _row(robot, link, joint, parent, materials, f"dh_{i}" if dh_frames else "")
        parent = link.name
    if mechanism is not None:
        for branch in mechanism.branches:
            _branch(robot, branch, mechanism.body_name(branch.body), materials, dh_frames=dh_frames)
    if model.tool is not None:
        _fixed_joint(robot, parent, model.tool.name, model.joints[-1].T_joint_dh)
        _link(robot, model.tool, identity(), materials, model.tool.inertial or MASSLESS)
    _frame(robot, "flange", parent, compose(model.joints[-1].T_joint_dh, T_DHN_FLANGE))
    _frame(robot, "tool0", "flange", compose(T_FLANGE_DHN, model.chain.T_dhn_tool0))
    if mechanism is not None:
        _mimic(robot, mechanism)
    header = [*provenance(whole), *(entry.sentence for entry in whole.assumptions)]
    return '<?xml version="1.0" encoding="utf-8"?>\n' + document(robot, header)


def _mimic(robot: ET.Element, model: MechanismModel) -> None:
    """Let joints that loops couple exactly mimic each other."""
    names = [joint.name for joint in model.moving_joints]
    elements = {element.get("name"): element for element in robot.iterfind("joint")}
    for k, (root, sign, offset) in find_couplings(model.spec).joints.items():
        child(elements[names[k]], "mimic", joint=names[root], multiplier=number(sign), offset=number(offset))


def _row(
    robot: ET.Element, link: LinkModel, joint: JointModel, parent: str, materials: dict[Color, str], frame: str
) -> None:
    """Add the joint and the link of a row, and its DH frame where that has a name."""
    _joint(robot, joint, parent, link.name)
    _link(robot, link, joint.T_joint_dh, materials, link.inertial or (LIGHTEST if joint.type.moves else MASSLESS))
    if frame:
        _frame(robot, frame, link.name, joint.T_joint_dh)


def _branch(
    robot: ET.Element, branch: BranchModel, parent: str, materials: dict[Color, str], *, dh_frames: bool
) -> None:
    if dh_frames:
        _frame(robot, f"{branch.name}/dh_0", parent, branch.T_body_dh0)
    for i, (link, joint) in enumerate(zip(branch.links, branch.joints, strict=True), start=1):
        _row(robot, link, joint, parent, materials, f"{branch.name}/dh_{i}" if dh_frames else "")
        parent = link.name


def _materials(links: Iterable[LinkModel]) -> dict[Color, str]:
    materials: dict[Color, str] = {}
    for link in links:
        for color in (link.color, link.joint_color):
            materials.setdefault(color, f"color_{len(materials) + 1}")
    return materials


def _frame(robot: ET.Element, name: str, parent: str, T_parent_frame: Array) -> None:
    _inertial(child(robot, "link", name=name), MASSLESS)
    _fixed_joint(robot, parent, name, T_parent_frame)


def _fixed_joint(robot: ET.Element, parent: str, name: str, T_parent_child: Array) -> None:
    joint = child(robot, "joint", name=f"{parent}-{name}", type="fixed")
    _ends(joint, parent, name, T_parent_child)


def _ends(joint: ET.Element, parent: str, name: str, T_parent_joint: Array) -> None:
    child(joint, "parent", link=parent)
    child(joint, "child", link=name)
    _origin(joint, T_parent_joint)


def _origin(element: ET.Element, T: Array) -> None:
    child(element, "origin", xyz=numbers(T[:3, 3]), rpy=numbers(rpy_from_rotation(T[:3, :3])))


def _link(
    robot: ET.Element,
    link: LinkModel,
    T_link_dh: Array,
    materials: dict[Color, str],
    inertial: MassProperties | None,
) -> None:
    element = child(robot, "link", name=link.name)
    if inertial is not None:
        _inertial(element, inertial)
    if link.mesh is not None:
        visual = child(element, "visual")
        _origin(visual, compose(T_link_dh, link.mesh.T_dh_mesh))
        scale = numbers([link.mesh.scale] * 3)
        child(child(visual, "geometry"), "mesh", filename=f"meshes/{link.mesh.file_name}", scale=scale)
        child(visual, "material", name=materials[link.color])
    for shape in link.shapes:
        for simple in _without_capsules(shape):
            if link.mesh is None:
                visual = child(element, "visual")
                _geometry(visual, simple)
                color = link.color if shape.part is ShapePart.LINK else link.joint_color
                child(visual, "material", name=materials[color])
    for shape in link.shapes:
        for simple in _without_capsules(shape) if shape.solid else []:
            _geometry(child(element, "collision"), simple)


def _without_capsules(shape: Shape) -> list[Shape]:
    """Return the cylinder and balls that make up a capsule, which URDF 1.0 has not; any other shape as it is."""
    if shape.kind is not ShapeKind.CAPSULE:
        return [shape]
    balls = []
    for end in shape.ends:
        T = [[1.0 if i == j else 0.0 for j in range(3)] + [float(end[i])] for i in range(3)]
        T_link_ball = read_only([*T, [0.0, 0.0, 0.0, 1.0]])
        balls.append(replace(shape, kind=ShapeKind.SPHERE, length=0.0, T_link_shape=T_link_ball))
    return [replace(shape, kind=ShapeKind.CYLINDER), *balls]


def _geometry(element: ET.Element, shape: Shape) -> None:
    _origin(element, shape.T_link_shape)
    geometry = child(element, "geometry")
    if shape.size is not None:
        child(geometry, "box", size=numbers(shape.size))
    elif shape.kind is ShapeKind.SPHERE:
        child(geometry, "sphere", radius=number(shape.radius))
    else:
        child(geometry, "cylinder", radius=number(shape.radius), length=number(shape.length))


def _inertial(element: ET.Element, body: MassProperties) -> None:
    """Along the link's own axes, without rpy, which some readers apply wrongly."""
    inertial = child(element, "inertial")
    child(inertial, "origin", xyz=numbers(body.com), rpy=numbers([0, 0, 0]))
    child(inertial, "mass", value=number(body.mass))
    I = body.inertia  # noqa: E741
    child(
        inertial,
        "inertia",
        ixx=number(I[0, 0]),
        ixy=number(I[0, 1]),
        ixz=number(I[0, 2]),
        iyy=number(I[1, 1]),
        iyz=number(I[1, 2]),
        izz=number(I[2, 2]),
    )


def _joint(robot: ET.Element, joint: JointModel, parent: str, name: str) -> None:
    kind = joint.type
    element = child(robot, "joint", name=joint.name, type=kind.value)
    _ends(element, parent, name, joint.T_parent_joint)
    if kind is JointType.FIXED:
        return
    child(element, "axis", xyz=numbers([0, 0, joint.sign]))
    limit = child(element, "limit")
    if joint.position_range is not None:
        lower, upper = joint.position_range
        limit.set("lower", number(lower))
        limit.set("upper", number(upper))
    limit.set("effort", number(joint.effort))
    limit.set("velocity", number(joint.velocity))
    child(element, "dynamics", **{key: number(getattr(joint.dynamics, key)) for key in DYNAMICS})
