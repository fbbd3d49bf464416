"""MechanismModel -> MJCF: the tree of bodies, and equality constraints that close its loops.

The reference of every joint is its coordinate in the assembly, so that MuJoCo's ``qpos0`` is the assembly, in which
the loops are closed. Constraints are between sites, which do not depend on that.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from math import hypot
from typing import Final

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
from dh2sim.formats.mjcf.sites import add_site, placed
from dh2sim.formats.xml_write import child, document, number, numbers, provenance
from dh2sim.kinematics.parallelograms import find_couplings
from dh2sim.kinematics.transforms import compose, identity, invert, joint_part, move_point
from dh2sim.kinematics.tree import BASE, Closure, body_poses
from dh2sim.kinematics.tree import placed as frame_pose
from dh2sim.kinematics.trig import atan2
from dh2sim.model.mass import LIGHTEST
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.robot_model import Color
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.row import JointType
from dh2sim.typing import Array, read_only

TIMESTEP: Final = 0.0005
"""s; constraints are stiffer the shorter it is."""
EXPORTED: Final = MjcfOptions(timestep=TIMESTEP)
"""Of the files that ``dh2sim export`` writes."""
DAMPING_RATIO: Final = 1.0
"""Of the constraints; their time constant is two time steps, the least that MuJoCo allows."""
SOLIMP: Final = (0.99, 0.9999, 0.0001, 0.5, 2.0)
HELPERS: Final = {
    ClosureType.UNIVERSAL: ("hinge",),
    ClosureType.CYLINDRICAL: ("slide", "hinge"),
    ClosureType.PRISMATIC: ("slide",),
}
"""Joints, along or about the z axis of frame a, of a body of its own between the two links of a closure."""
ARMATURE: Final = 1e-3
"""Of those joints, in moving masses, and sizes squared: a body without any would make the constraints soft."""
HELPER: Final = "_joint"
"""End of the names of those bodies."""
GAP: Final = "_gap"
"""End of the names of sensors that say how far constraints are open."""
ARM: Final = 0.1
"""Distance, in sizes of the mechanism, of the two points of an axis that are connected."""
RESTING: Final = 0.01
"""Distance, in sizes of the mechanism, from an axis at which a centre of mass counts as on it."""


def to_mechanism_mjcf(model: MechanismModel, options: MjcfOptions = EXPORTED) -> str:
    """Write a mechanism as MJCF.

    Args:
        model: The mechanism.
        options: How it is simulated; its base is fixed.

    Returns:
        The text of the file. Spherical closures are ``connect``, revolute ones two of them on the axis, fixed ones
        ``weld``; universal, cylindrical and prismatic ones have a light body with joints of its own in between.
    """
    mujoco = ET.Element("mujoco", model=model.name)
    child(mujoco, "compiler", angle="radian", autolimits="true", meshdir="meshes")
    add_option(mujoco, model, options)
    add_defaults(mujoco, model)
    materials = add_assets(mujoco, model)
    bodies = _tree(mujoco, model, materials)
    add_contact(mujoco, model)
    if model.tree.closures:
        equality = child(mujoco, "equality")
        poses = body_poses(model.tree, model.q)
        for closure in model.tree.closures:
            _close(equality, bodies, model, closure, poses, (2 * options.timestep, DAMPING_RATIO))
        _couple(equality, model, (2 * options.timestep, DAMPING_RATIO))
    add_actuators(mujoco, model)
    add_sensors(mujoco, model)
    _add_gap_sensors(mujoco)
    keyframe = child(mujoco, "keyframe")
    for name, q in model.configurations().items():
        key = child(keyframe, "key", name=name, qpos=_qpos(mujoco, model, q))
        if controls := model.holding_controls(q):
            key.set("ctrl", numbers(controls))
    return document(mujoco, provenance(model))


def _tree(mujoco: ET.Element, model: MechanismModel, materials: dict[Color, str]) -> dict[int, ET.Element]:
    """Add the bodies of all rows; return the elements of the bodies by joint."""
    base = child(child(mujoco, "worldbody"), "body", name=model.base.name, childclass=class_name(model))
    add_geoms(base, model, model.base, model.main.chain.T_base_link_dh0, materials)
    tree = model.tree
    bodies = {BASE: base}
    for k, (link, joint) in enumerate(zip(model.links, model.joints, strict=True)):
        index = tree.coordinates[k]
        reference = 0.0 if index < 0 else float(model.q[index])
        moved = joint.sign * reference
        at = joint_part(moved, 0.0) if joint.type.turns else joint_part(0.0, moved)
        T = joint.T_parent_joint if index < 0 else compose(joint.T_parent_joint, at)
        bodies[k] = child(bodies[tree.parents[k]], "body", name=link.name, **placed(T))
        add_inertial(bodies[k], link.inertial or (LIGHTEST if joint.type.moves else None))
        if joint.type is not JointType.FIXED:
            add_joint(bodies[k], joint, reference)
        add_geoms(bodies[k], model, link, joint.T_joint_dh, materials)
    for name, (body, T_body_frame) in tree.frames.items():
        if name.rpartition("/")[2].startswith(("dh_", "tool0")):
            add_site(bodies[body], name, T_body_frame, None if body == BASE else model.links[body].inertial)
    if (tool := model.main.tool) is not None:
        last = len(model.main.joints) - 1
        element = child(bodies[last], "body", name=tool.name, **placed(model.main.joints[last].T_joint_dh))
        add_inertial(element, tool.inertial)
        add_geoms(element, model, tool, identity(), materials)
    return bodies


def _close(
    equality: ET.Element,
    bodies: dict[int, ET.Element],
    model: MechanismModel,
    closure: Closure,
    poses: tuple[Array, ...],
    solref: tuple[float, float],
) -> None:
    """Add the constraints of a closure, with the sites and the body that they need."""
    a, b = model.tree.frame(closure.a), model.tree.frame(closure.b)
    body_a, body_b = bodies[a.body], bodies[b.body]
    T_a, T_b = a.T_body_frame, b.T_body_frame
    mass_b = None if b.body == BASE else model.links[b.body].inertial
    name, arm = closure.name, ARM * model.size
    apart = all(_rests(model, poses, frame.body) for frame in (a, b))
    inertial = None if a.body == BASE else model.links[a.body].inertial
    if closure.type in HELPERS:
        T_a_b = compose(invert(frame_pose(poses, a)), frame_pose(poses, b))
        start = _helper_start(closure.type, T_a_b)
        body_a = child(body_a, "body", name=f"{name}{HELPER}", **placed(compose(T_a, start)))
        add_inertial(body_a, LIGHTEST)
        for kind in HELPERS[closure.type]:
            inertia = ARMATURE * model.mass * (model.size**2 if kind == "hinge" else 1.0)
            child(body_a, "joint", name=f"{name}_{kind}", type=kind, armature=number(inertia))
        T_a, inertial = identity(), None
        if closure.type is ClosureType.UNIVERSAL:
            T_a = read_only([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # its z along the helper's x
    match closure.type:
        case ClosureType.SPHERICAL:
            points = [0.0]
        case ClosureType.REVOLUTE | ClosureType.UNIVERSAL:
            points = [-arm / 2, arm / 2]
        case _:
            add_site(body_a, f"{name}_a", T_a, inertial, apart=apart)
            add_site(body_b, f"{name}_b", T_b, mass_b, apart=apart)
            _constraint(equality, "weld", name, f"{name}_a", f"{name}_b", solref)
            return
    for k, height in enumerate(points):
        suffix = "" if len(points) == 1 else f"_{k + 1}"
        along = joint_part(0.0, height)
        add_site(body_a, f"{name}_a{suffix}", compose(T_a, along), inertial, apart=apart)
        add_site(body_b, f"{name}_b{suffix}", compose(T_b, along), mass_b, apart=apart)
        _constraint(equality, "connect", f"{name}{suffix}", f"{name}_a{suffix}", f"{name}_b{suffix}", solref)


def _rests(model: MechanismModel, poses: tuple[Array, ...], body: int) -> bool:
    """Whether no joint moves a link's centre of mass, as in a spherical linkage of balls.

    MuJoCo takes the stiffness of a constraint between two links from how easily their centres of mass move: between
    two that rest it would be infinite, and the simulation unstable. What moves is the place of the site itself.
    """
    if body == BASE:
        return True
    inertial = model.links[body].inertial
    com = read_only(move_point(poses[body], identity()[:3, 3] if inertial is None else inertial.com))
    for k in model.tree.path(body):
        x, y, _ = move_point(invert(poses[k]), com)  # the joint's axis is z
        if model.joints[k].type.moves and not (model.joints[k].type.turns and hypot(x, y) <= RESTING * model.size):
            return False
    return True


def _couple(equality: ET.Element, model: MechanismModel, solref: tuple[float, float]) -> None:
    """Let joints that loops couple exactly, as parallelograms do, move as one: they cannot fold over then.

    MuJoCo measures their coordinates from the references, which are those of the assembly.
    """
    names = [joint.name for joint in model.moving_joints]
    for k, (root, sign, _) in find_couplings(model.spec).joints.items():
        coupled = {"joint1": names[k], "joint2": names[root], "polycoef": numbers([0, sign, 0, 0, 0])}
        child(
            equality, "joint", name=f"{names[k]}_coupled", **coupled, solref=numbers(solref), solimp=numbers(SOLIMP)
        )


def _helper_start(kind: ClosureType, T_a_b: Array) -> Array:
    """Return the pose in frame a of the body in between, in the assembly: at b, its joints about or along z of a."""
    if kind is not ClosureType.UNIVERSAL:
        return T_a_b
    x, y = float(T_a_b[0, 2]), float(T_a_b[1, 2])
    norm = (x * x + y * y) ** 0.5
    x, y = x / norm, y / norm
    return read_only([[x, -y, 0, 0], [y, x, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def _constraint(
    equality: ET.Element, kind: str, name: str, site1: str, site2: str, solref: tuple[float, float]
) -> None:
    child(equality, kind, name=name, site1=site1, site2=site2, solref=numbers(solref), solimp=numbers(SOLIMP))


def _add_gap_sensors(mujoco: ET.Element) -> None:
    """Add a sensor of how far each constraint is open: the place of one of its sites seen from the other."""
    sensors = mujoco.find("sensor")
    assert sensors is not None
    for constraint in mujoco.iterfind("equality/*"):
        if constraint.tag == "joint":
            continue
        ends = {"objtype": "site", "objname": "site1", "reftype": "site", "refname": "site2"}
        between = {key: constraint.get(value, value) for key, value in ends.items()}
        child(sensors, "framepos", name=f"{constraint.get('name')}{GAP}", **between)
        if constraint.tag == "weld":
            child(sensors, "framequat", name=f"{constraint.get('name')}{GAP}_turn", **between)


def joint_coordinates(model: MechanismModel, q: Array) -> dict[str, float]:
    """Return the coordinates of all joints of the MJCF by name, those of the bodies in between among them.

    Args:
        model: The mechanism.
        q: Joint vector at which its loops are closed, rad and m, shape (n,).
    """
    values = {joint.name: float(value) for joint, value in zip(model.moving_joints, q, strict=True)}
    assembled, now = (body_poses(model.tree, vector) for vector in (model.q, q))
    for closure in model.tree.closures:
        if closure.type in HELPERS:
            a, b = model.tree.frame(closure.a), model.tree.frame(closure.b)
            before, after = (
                compose(invert(frame_pose(poses, a)), frame_pose(poses, b)) for poses in (assembled, now)
            )
            column = 2 if closure.type is ClosureType.UNIVERSAL else 0
            angles = [atan2(float(T[1, column]), float(T[0, column])) for T in (before, after)]
            values[f"{closure.name}_slide"] = float(after[2, 3] - before[2, 3])
            values[f"{closure.name}_hinge"] = angles[1] - angles[0]
    return values


def _qpos(mujoco: ET.Element, model: MechanismModel, q: Array) -> str:
    """Return a joint vector in the order of the joints in the file."""
    values = joint_coordinates(model, q)
    world = mujoco.find("worldbody")
    assert world is not None
    return numbers(values[joint.get("name", "")] for joint in world.iter("joint"))
