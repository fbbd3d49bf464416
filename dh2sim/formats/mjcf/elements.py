"""Elements of an MJCF that robots and mechanisms share: options, defaults, assets, shapes, actuators, sensors."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass

from dh2sim.formats.mjcf.sites import placed
from dh2sim.formats.mjcf.tree import DYNAMICS
from dh2sim.formats.xml_write import child, number, numbers
from dh2sim.kinematics.transforms import compose
from dh2sim.model.mass import MassProperties
from dh2sim.model.mechanism import AnyModel
from dh2sim.model.robot_model import Color, JointModel, LinkModel
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart
from dh2sim.robot.row import ActuatorType
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class MjcfOptions:
    """Options of the simulation in an MJCF."""

    timestep: float = 0.002
    """s."""
    integrator: str = "implicitfast"
    """'Euler', 'RK4', 'implicit' or 'implicitfast'."""
    energy: bool = False
    """Whether MuJoCo computes the energy at every step."""
    sensors: bool = True
    """Whether it evaluates the sensors, which takes time at every step of a small arm."""
    floating_base: bool = False
    """Whether base_link floats; it needs mass then, see ``with_base_mass``."""
    keyframes: bool = True
    """Whether named configurations become keyframes, whose controls take time to compute."""


def add_actuators(mujoco: ET.Element, model: AnyModel) -> None:
    """Add an actuator for every joint that is driven, in the order of the joints."""
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
        if joint.control_range is not None:
            element.set("ctrlrange", numbers(joint.control_range))
        if "effort" not in joint.assumed:
            element.set("forcerange", numbers([-joint.effort, joint.effort]))


def add_sensors(mujoco: ET.Element, model: AnyModel) -> None:
    """Add sensors of every joint's position, velocity and actuator force, and of tool0's pose."""
    sensors = child(mujoco, "sensor")
    for suffix, tag in (("position", "jointpos"), ("velocity", "jointvel"), ("torque", "jointactuatorfrc")):
        for joint in model.moving_joints:
            child(sensors, tag, name=f"{joint.name}_{suffix}", joint=joint.name)
    child(sensors, "framepos", name="tool0_pos", objtype="site", objname="tool0")
    child(sensors, "framequat", name="tool0_quat", objtype="site", objname="tool0")


def add_option(mujoco: ET.Element, model: AnyModel, options: MjcfOptions) -> None:
    """Add the options of the simulation."""
    option = child(
        mujoco,
        "option",
        timestep=number(options.timestep),
        integrator=options.integrator,
        gravity=numbers(model.spec.gravity),
    )
    flags = {**({"energy": "enable"} if options.energy else {}), **({} if options.sensors else {"sensor": "disable"})}
    if flags:
        child(option, "flag", **flags)


def add_defaults(mujoco: ET.Element, model: AnyModel) -> None:
    """Add the default classes."""
    outer = child(child(mujoco, "default"), "default", class_=class_name(model))
    child(outer, "joint", axis=numbers([0, 0, 1]))
    child(outer, "site", group="4", size=number(0.02 * _site_scale(model)), rgba="0.9 0.9 0.1 1")
    visual = child(outer, "default", class_=f"{model.name}_visual")
    child(visual, "geom", type="mesh", group="2", contype="0", conaffinity="0", mass="0")
    collision = child(outer, "default", class_=f"{model.name}_shape")
    child(collision, "geom", group="1")
    trim = child(outer, "default", class_=f"{model.name}_trim")
    child(trim, "geom", group="1", contype="0", conaffinity="0", mass="0")
    hidden = child(outer, "default", class_=f"{model.name}_collision")
    child(hidden, "geom", group="3")


def class_name(model: AnyModel) -> str:
    """Return the name of the robot's default class; MuJoCo has a class main already."""
    return "main_robot" if model.name == "main" else model.name


def _site_scale(model: AnyModel) -> float:
    radii = [shape.radius for link in model.all_links for shape in link.shapes if shape.solid]
    return 10.0 * min(radii)


def add_assets(mujoco: ET.Element, model: AnyModel) -> dict[Color, str]:
    """Add materials and meshes; return the materials' names by colour."""
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


def _moved(T: Array) -> dict[str, str]:
    """Return the attributes of a pose, like ``placed``, without those of the identity."""
    return {name: text for name, text in placed(T).items() if text not in ("0.0 0.0 0.0", "1.0 0.0 0.0 0.0")}


def add_inertial(body: ET.Element, properties: MassProperties | None) -> None:
    """Add the mass properties of a body; zeros for one that weighs nothing."""
    if properties is None:  # without this MuJoCo takes the body's place in its parent for its principal frame
        child(body, "inertial", pos=numbers([0, 0, 0]), mass=number(0), diaginertia=numbers([0, 0, 0]))
        return
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = properties.inertia.tolist()
    inertial = child(body, "inertial", pos=numbers(properties.com.tolist()), mass=number(properties.mass))
    if xy == xz == yz == 0.0:
        inertial.set("diaginertia", numbers([xx, yy, zz]))
    else:
        inertial.set("fullinertia", numbers([xx, yy, zz, xy, xz, yz]))


def add_joint(body: ET.Element, joint: JointModel, reference: float = 0.0) -> None:
    """Add the joint of a body; ``reference`` is the coordinate at which the body is where the file puts it."""
    element = child(body, "joint", name=joint.name, type="hinge" if joint.type.turns else "slide")
    if reference:
        element.set("ref", number(reference))
    if joint.sign < 0:
        element.set("axis", numbers([0, 0, -1]))
    if joint.position_range is not None:
        element.set("range", numbers(joint.position_range))
    if "effort" not in joint.assumed:
        element.set("actuatorfrcrange", numbers([-joint.effort, joint.effort]))
    for key, attribute in DYNAMICS.items():
        if value := getattr(joint.dynamics, key):
            element.set(attribute, number(value))


def add_geoms(
    body: ET.Element, model: AnyModel, link: LinkModel, T_link_dh: Array, materials: dict[Color, str]
) -> None:
    """Add the shapes of a link, and its mesh."""
    if link.mesh is not None:
        material = materials[link.color]
        child(
            body,
            "geom",
            class_=f"{model.name}_visual",
            mesh=link.name,
            material=material,
            **placed(compose(T_link_dh, link.mesh.T_dh_mesh)),  # of the file's frame, not of MuJoCo's own
        )
    kind = "shape" if link.mesh is None else "collision"
    # a base that does not move needs no mass, and so MuJoCo gives it no principal frame of its own; that of one that
    # floats is written out
    weight = {"mass": "0"} if link is model.base else {}
    for shape in link.shapes:
        color = link.color if shape.part is ShapePart.LINK else link.joint_color
        if shape.solid:
            _geom(body, f"{model.name}_{kind}", shape, materials[color], weight)
        elif link.mesh is None:
            _geom(body, f"{model.name}_trim", shape, materials[color], {})


def _geom(body: ET.Element, class_: str, shape: Shape, material: str, weight: dict[str, str]) -> None:
    match shape.kind:
        case ShapeKind.BOX if shape.size is not None:
            size = [0.5 * side for side in shape.size]
        case ShapeKind.SPHERE:
            size = [shape.radius]
        case _:
            size = [shape.radius, 0.5 * shape.length]
    attributes = {"type": shape.kind.value, "size": numbers(size), "material": material}
    child(body, "geom", class_=class_, **attributes, **weight, **_moved(shape.T_link_shape))


def add_contact(mujoco: ET.Element, model: AnyModel) -> None:
    """Add the pairs of links that do not collide."""
    if model.excluded:
        contact = child(mujoco, "contact")
        for pair in model.excluded:
            child(contact, "exclude", body1=pair.link1, body2=pair.link2)
