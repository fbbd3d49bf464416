"""RobotModel -> MJCF, MuJoCo's own format."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from dh2sim.errors import ModelError
from dh2sim.formats.xml import child, document, number, numbers, provenance
from dh2sim.kinematics.transforms import compose, quaternion_from_rotation
from dh2sim.model.mass import MassProperties
from dh2sim.model.robot_model import Color, JointModel, LinkModel, RobotModel
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart
from dh2sim.robot.spec import ActuatorType, JointType
from dh2sim.typing import Array

TIMESTEP = 0.002
"""s."""
MOST_BODIES = 496
"""MuJoCo's XML reader refuses a deeper nesting of bodies; base_link is one of them."""


def to_mjcf(model: RobotModel) -> str:
    """Write a robot as MJCF.

    Args:
        model: the robot.

    Returns:
        The text of the file. Meshes are looked for in ``meshes`` beside it.

    Raises:
        ModelError: the robot has more bodies than MuJoCo can read back.
    """
    if 1 + len(model.links) > MOST_BODIES:
        raise ModelError(
            f"{model.name}: {len(model.links)} rows make {1 + len(model.links)} nested bodies with base_link; MuJoCo "
            f"reads at most {MOST_BODIES}. Split the chain, or export it as URDF only (--format urdf)"
        )
    mujoco = ET.Element("mujoco", model=model.name)
    child(mujoco, "compiler", angle="radian", autolimits="true", meshdir="meshes")
    child(
        mujoco,
        "option",
        timestep=number(TIMESTEP),
        integrator="implicitfast",
        gravity=numbers(model.spec.gravity),
    )
    _defaults(mujoco, model)
    materials = _assets(mujoco, model)
    _bodies(mujoco, model, materials)
    _contact(mujoco, model)
    _actuators(mujoco, model)
    _sensors(mujoco, model)
    _keyframes(mujoco, model)
    return document(mujoco, provenance(model))


def _defaults(mujoco: ET.Element, model: RobotModel) -> None:
    outer = child(child(mujoco, "default"), "default", class_=model.name)
    child(outer, "joint", axis=numbers([0, 0, 1]))
    child(outer, "site", group="4", size=number(0.02 * _site_scale(model)), rgba="0.9 0.9 0.1 1")
    visual = child(outer, "default", class_=f"{model.name}_visual")
    child(visual, "geom", type="mesh", group="2", contype="0", conaffinity="0", mass="0")
    collision = child(outer, "default", class_=f"{model.name}_shape")
    child(collision, "geom", group="1")
    hidden = child(outer, "default", class_=f"{model.name}_collision")
    child(hidden, "geom", group="3")


def _site_scale(model: RobotModel) -> float:
    radii = [shape.radius for link in model.all_links for shape in link.shapes]
    return 10.0 * min(radii)


def _assets(mujoco: ET.Element, model: RobotModel) -> dict[Color, str]:
    asset = child(mujoco, "asset")
    materials: dict[Color, str] = {}
    for link in model.all_links:
        for color in (link.color, link.joint_color):
            if color not in materials:
                materials[color] = f"color_{len(materials) + 1}"
                child(
                    asset,
                    "material",
                    name=materials[color],
                    rgba=numbers(color),
                    specular="0.3",
                    shininess="0.3",
                )
        if link.mesh is not None:
            # a mesh that only shows a link need not be closed: as a shell its volume does not matter
            scale = numbers([link.mesh.scale] * 3)
            child(asset, "mesh", name=link.name, file=link.mesh.file_name, scale=scale, inertia="shell")
    return materials


def _bodies(mujoco: ET.Element, model: RobotModel, materials: dict[Color, str]) -> None:
    body = child(child(mujoco, "worldbody"), "body", name=model.base.name, childclass=model.name)
    _geoms(body, model, model.base, model.chain.T_base_link_dh0, materials)
    _site(body, "dh_0", model.chain.T_base_link_dh0)
    for i, (link, joint) in enumerate(zip(model.links, model.joints, strict=True), start=1):
        body = child(body, "body", name=link.name, **_placed(joint.joint.T_parent_joint))
        if link.inertial is not None:
            _inertial(body, link.inertial)
        if joint.joint.type is not JointType.FIXED:
            _joint(body, joint)
        _geoms(body, model, link, joint.joint.T_joint_dh, materials)
        _site(body, f"dh_{i}", joint.joint.T_joint_dh)
    _site(body, "tool0", compose(model.joints[-1].joint.T_joint_dh, model.chain.T_dhn_tool0))


def _placed(T: Array) -> dict[str, str]:
    return {"pos": numbers(T[:3, 3]), "quat": numbers(quaternion_from_rotation(T[:3, :3]))}


def _moved(T: Array) -> dict[str, str]:
    """As ``_placed``, without what is the identity."""
    return {name: text for name, text in _placed(T).items() if text not in ("0.0 0.0 0.0", "1.0 0.0 0.0 0.0")}


def _site(body: ET.Element, name: str, T: Array) -> None:
    child(body, "site", name=name, **_placed(T))


def _inertial(body: ET.Element, properties: MassProperties) -> None:
    I = properties.inertia  # noqa: E741
    inertial = child(body, "inertial", pos=numbers(properties.com), mass=number(properties.mass))
    if I[0, 1] == I[0, 2] == I[1, 2] == 0.0:
        inertial.set("diaginertia", numbers([I[0, 0], I[1, 1], I[2, 2]]))
    else:
        inertial.set("fullinertia", numbers([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]))


def _joint(body: ET.Element, joint: JointModel) -> None:
    element = child(body, "joint", name=joint.name, type="hinge" if joint.joint.type.turns else "slide")
    if joint.joint.sign < 0:
        element.set("axis", numbers([0, 0, -1]))
    if joint.range is not None:
        element.set("range", numbers([joint.range.lower, joint.range.upper]))
    if "effort" not in joint.assumed:
        element.set("actuatorfrcrange", numbers([-joint.effort, joint.effort]))
    dynamics = joint.dynamics
    for name, value in (
        ("damping", dynamics.damping),
        ("frictionloss", dynamics.friction),
        ("armature", dynamics.armature),
    ):
        if value:
            element.set(name, number(value))


def _geoms(
    body: ET.Element, model: RobotModel, link: LinkModel, T_link_dh: Array, materials: dict[Color, str]
) -> None:
    if link.mesh is not None:
        material = materials[link.color]
        child(
            body,
            "geom",
            class_=f"{model.name}_visual",
            mesh=link.name,
            material=material,
            **_placed(T_link_dh),
        )
    kind = "shape" if link.mesh is None else "collision"
    for shape in link.shapes:
        color = link.joint_color if shape.part is ShapePart.JOINT else link.color
        _geom(body, f"{model.name}_{kind}", shape, materials[color])


def _geom(body: ET.Element, class_: str, shape: Shape, material: str) -> None:
    kind = "capsule" if shape.kind is ShapeKind.CAPSULE else "cylinder"
    size = numbers([shape.radius, 0.5 * shape.length])
    child(body, "geom", class_=class_, type=kind, size=size, material=material, **_moved(shape.T_link_shape))


def _contact(mujoco: ET.Element, model: RobotModel) -> None:
    if model.excluded:
        contact = child(mujoco, "contact")
        for pair in model.excluded:
            child(contact, "exclude", body1=pair.link1, body2=pair.link2)


def _actuators(mujoco: ET.Element, model: RobotModel) -> None:
    driven = [joint for joint in model.moving_joints if joint.actuator.type is not ActuatorType.NONE]
    if not driven:
        return
    actuators = child(mujoco, "actuator")
    for joint in driven:
        name = f"{joint.name}_{joint.actuator.type.value}"
        match joint.actuator.type:
            case ActuatorType.POSITION:
                gains = {"kp": number(joint.actuator.kp), "kv": number(joint.actuator.kv)}
            case ActuatorType.VELOCITY:
                gains = {"kv": number(joint.actuator.kv)}
            case _:
                gains = {}
        element = child(actuators, joint.actuator.type.value, name=name, joint=joint.name, **gains)
        control = control_range(joint)
        if control is not None:
            element.set("ctrlrange", numbers(control))
        if "effort" not in joint.assumed:
            element.set("forcerange", numbers([-joint.effort, joint.effort]))


def control_range(joint: JointModel) -> tuple[float, float] | None:
    """Range of a joint's control, from its limits: rad or m, their rate, N·m or N; None where it is unlimited."""
    match joint.actuator.type:
        case ActuatorType.POSITION:
            return None if joint.range is None else (joint.range.lower, joint.range.upper)
        case ActuatorType.VELOCITY:
            return -joint.velocity, joint.velocity
        case ActuatorType.MOTOR:
            return -joint.effort, joint.effort
        case ActuatorType.NONE:
            return None


def _sensors(mujoco: ET.Element, model: RobotModel) -> None:
    sensors = child(mujoco, "sensor")
    for suffix, tag in (("position", "jointpos"), ("velocity", "jointvel"), ("torque", "jointactuatorfrc")):
        for joint in model.moving_joints:
            child(sensors, tag, name=f"{joint.name}_{suffix}", joint=joint.name)
    child(sensors, "framepos", name="tool0_position", objtype="site", objname="tool0")
    child(sensors, "framequat", name="tool0_orientation", objtype="site", objname="tool0")


def _keyframes(mujoco: ET.Element, model: RobotModel) -> None:
    if not model.spec.configurations or not model.moving_joints:
        return
    keyframe = child(mujoco, "keyframe")
    for name, q in model.spec.configurations.items():
        controls = holding_controls(model, name)
        key = child(keyframe, "key", name=name, qpos=numbers(q))
        if controls:
            key.set("ctrl", numbers(controls))


def holding_controls(model: RobotModel, configuration: str) -> list[float]:
    """Controls, one an actuator, with which the robot stands still in a named configuration.

    A position actuator is asked for a little more than the joint's position, so that its pull balances gravity.
    Clipped to the control's range.
    """
    controls = []
    q, loads = model.spec.configurations[configuration], model.holding[configuration]
    for joint, position, load in zip(model.moving_joints, q, loads, strict=True):
        match joint.actuator.type:
            case ActuatorType.POSITION:
                control = float(position) + (load / joint.actuator.kp if joint.actuator.kp else 0.0)
            case ActuatorType.VELOCITY:
                control = 0.0
            case ActuatorType.MOTOR:
                control = load
            case ActuatorType.NONE:
                continue
        allowed = control_range(joint)
        controls.append(control if allowed is None else min(max(control, allowed[0]), allowed[1]))
    return controls
