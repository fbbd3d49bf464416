"""RobotModel -> MJCF, MuJoCo's own format: bodies, actuators, sensors and keyframes."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from dh2sim.formats.mjcf.elements import (
    MjcfOptions,
    add_actuators,
    add_assets,
    add_contact,
    add_defaults,
    add_geoms,
    add_inertial,
    add_joint,
    add_option,
    add_sensors,
    class_name,
)
from dh2sim.formats.mjcf.mechanism import to_mechanism_mjcf
from dh2sim.formats.mjcf.sites import add_site, placed
from dh2sim.formats.xml_write import child, document, numbers, provenance
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.model.mass import LIGHTEST
from dh2sim.model.mechanism import MechanismModel, written_model
from dh2sim.model.robot_model import Color, RobotModel
from dh2sim.robot.row import JointType
from dh2sim.robot.spec import SpecLike
from dh2sim.typing import Array

EXPORTED = MjcfOptions()
"""Of the files that ``dh2sim export`` writes."""


def to_mjcf(model: SpecLike, options: MjcfOptions | None = None) -> str:
    """Write a robot or a mechanism as MJCF.

    Args:
        model: the robot, in any form.
        options: how it is simulated; by default as in the files that ``dh2sim export`` writes.

    Returns:
        The text of the file. Meshes are looked for in ``meshes`` beside it.
    """
    model = written_model(model)
    if isinstance(model, MechanismModel):
        return to_mechanism_mjcf(model) if options is None else to_mechanism_mjcf(model, options)
    options = EXPORTED if options is None else options
    mujoco = ET.Element("mujoco", model=model.name)
    child(mujoco, "compiler", angle="radian", autolimits="true", meshdir="meshes")
    add_option(mujoco, model, options)
    add_defaults(mujoco, model)
    materials = add_assets(mujoco, model)
    _bodies(mujoco, model, materials, options)
    add_contact(mujoco, model)
    add_actuators(mujoco, model)
    add_sensors(mujoco, model)
    if options.keyframes:
        _add_keyframes(mujoco, model, floating_base=options.floating_base)
    return document(mujoco, provenance(model))


def _bodies(mujoco: ET.Element, model: RobotModel, materials: dict[Color, str], options: MjcfOptions) -> None:
    body = child(child(mujoco, "worldbody"), "body", name=model.base.name, childclass=class_name(model))
    if options.floating_base:
        add_inertial(body, model.base.inertial)
        child(body, "freejoint")  # nameless: any name might be that of a joint of the table
    add_geoms(body, model, model.base, model.chain.T_base_link_dh0, materials)
    add_site(body, "dh_0", model.chain.T_base_link_dh0, model.base.inertial if options.floating_base else None)
    for i, (link, joint) in enumerate(zip(model.links, model.joints, strict=True), start=1):
        body = child(body, "body", name=link.name, **placed(joint.T_parent_joint))
        add_inertial(body, link.inertial or (LIGHTEST if joint.type.moves else None))
        if joint.type is not JointType.FIXED:
            add_joint(body, joint)
        add_geoms(body, model, link, joint.T_joint_dh, materials)
        frames = [(f"dh_{i}", joint.T_joint_dh)] if i < len(model.links) else _last_frames(model)
        for name, T in frames:
            add_site(body, name, T, link.inertial)
    if model.tool is not None:
        body = child(body, "body", name=model.tool.name, **placed(model.joints[-1].T_joint_dh))
        add_inertial(body, model.tool.inertial)
        add_geoms(body, model, model.tool, identity(), materials)


def _last_frames(model: RobotModel) -> list[tuple[str, Array]]:
    """Return the names of the last DH frame and of tool0, and their poses in the last link."""
    T = model.joints[-1].T_joint_dh
    return [(f"dh_{len(model.links)}", T), ("tool0", compose(T, model.chain.T_dhn_tool0))]


def _add_keyframes(mujoco: ET.Element, model: RobotModel, *, floating_base: bool) -> None:
    """Add a keyframe for every named configuration, with the controls that hold the robot still in it.

    A base that floats starts at the origin.
    """
    if not model.spec.configurations or not model.moving_joints:
        return
    keyframe = child(mujoco, "keyframe")
    configurations = model.spec.configurations
    held = model.holding_controls_of(list(configurations.values()))
    for (name, q), controls in zip(configurations.items(), held, strict=True):
        key = child(keyframe, "key", name=name, qpos=numbers([0, 0, 0, 1, 0, 0, 0, *q] if floating_base else q))
        if controls:
            key.set("ctrl", numbers(controls))
