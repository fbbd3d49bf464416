"""The joints of an MJCF's arm: poses with fixed bodies merged, axes, limits and dynamics."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.formats.from_mjcf.actuators import Drive
from dh2sim.formats.from_mjcf.chain import Selection
from dh2sim.formats.from_mjcf.compile import Compiled
from dh2sim.formats.from_mjcf.files import MjcfFiles
from dh2sim.formats.from_mjcf.tree import MjcfJoint, MjcfTree, Motion
from dh2sim.formats.notes import Notes
from dh2sim.formats.serial_robot import GREATEST
from dh2sim.formats.xml_tree import place
from dh2sim.kinematics.serial import SerialChain, SerialJoint
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.kinematics.trig import sin_cos
from dh2sim.robot.spec import Dynamics, JointType, Limits
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChainJoints:
    """The moving joints of the arm, and what the file says of each."""

    chain: SerialChain
    limits: tuple[Limits, ...]
    dynamics: tuple[Dynamics, ...]


def check_joints(tree: MjcfTree, selection: Selection, files: MjcfFiles) -> None:
    """Check that every joint from base to tip can be a row of a table, and that every number is fit for use.

    Raises:
        ImportedFileError: One is not; the error holds all that are not.
    """
    problems: list[Problem] = []
    for joint in selection.joints:
        if joint.motion in (Motion.BALL, Motion.FREE):
            message = f"a {joint.motion} joint has no row in a table. Choose --base or --tip so that it is left out"
            problems.append(_problem(joint, message, tree, files))
        elif not _usable([*joint.pos.tolist(), *joint.axis.tolist(), joint.ref]):
            problems.append(_problem(joint, _too_large("the joint"), tree, files))
    for body in selection.bodies:
        if not _usable(body.T_parent_body.ravel().tolist()):
            element = ("body", body.name)
            problems.append(
                files.problem(_too_large("the body's pose"), path=place("body", body.name), element=element)
            )
    site = selection.site
    if site is not None and not _usable(site.T_body_site.ravel().tolist()):
        element = ("site", site.name)
        problems.append(files.problem(_too_large("the site's pose"), path=place("site", site.name), element=element))
    if problems:
        raise ImportedFileError(dict.fromkeys(problems))


def _problem(joint: MjcfJoint, message: str, tree: MjcfTree, files: MjcfFiles) -> Problem:
    if joint.name:
        return files.problem(message, path=place("joint", joint.name), element=("joint", joint.name))
    body = tree.bodies[joint.body]
    return files.problem(message, path=f"{place('body', body.name)}.joint", element=("body", body.name))


def _usable(values: Sequence[float]) -> bool:
    return all(abs(value) <= GREATEST for value in values)  # false for NaN


def _too_large(what: str) -> str:
    return f"{what} has a number that is not finite, or greater than {GREATEST:g}"


def joint_names(selection: Selection, notes: Notes) -> tuple[str, ...]:
    """Return a name for every joint from base to tip; those without one are numbered along the arm."""
    taken = {joint.name for joint in selection.joints}
    names: list[str] = []
    for i, joint in enumerate(selection.joints, start=1):
        name = joint.name
        if not name:
            name = f"joint_{i}"
            while name in taken:
                name += "_"
            taken.add(name)
            notes.group("Joints without a name are called {}.", name)
        names.append(name)
    return tuple(names)


def read_joints(
    compiled: Compiled, selection: Selection, names: Sequence[str], drives: Sequence[Drive], notes: Notes
) -> ChainJoints:
    """Return the chain of the joints between base and tip.

    MuJoCo moves a body by its joints one after the other, each about the axis that those before it have moved; so
    several joints of one body make as many links, of which only the last is the body. A coordinate counts as in the
    file: it is the joint's ``ref`` in the pose that the file draws.

    Args:
        compiled: The model.
        selection: The arm; ``check_joints`` found nothing.
        names: Of its joints.
        drives: What drives each.
        notes: Takes what was left out.
    """
    T = identity()  # of what is at hand in the link of the last joint
    joints, limits, dynamics = [], [], []
    rest = iter(zip(names, drives, strict=True))
    for body in selection.bodies:
        T = compose(T, body.T_parent_body)
        for joint in body.joints:
            name, drive = next(rest)
            kind = _type(compiled.model, joint)
            joints.append(
                SerialJoint(
                    name=name,
                    type=kind,
                    T_parent_link=compose(T, _motion(joint, -joint.ref)),
                    axis=joint.axis,
                    point=joint.pos,
                )
            )
            limits.append(Limits(position=_range(compiled.model, joint, name, notes), effort=drive.effort))
            dynamics.append(_dynamics(compiled, joint, name, drive, notes))
            T = identity()
    if selection.site is not None:
        T = compose(T, selection.site.T_body_site)
    return ChainJoints(
        chain=SerialChain(joints=tuple(joints), T_link_tip=T), limits=tuple(limits), dynamics=tuple(dynamics)
    )


def _type(model: mujoco.MjModel, joint: MjcfJoint) -> JointType:
    if joint.motion is Motion.SLIDE:
        return JointType.PRISMATIC
    return JointType.REVOLUTE if model.jnt_limited[joint.id] else JointType.CONTINUOUS


def _motion(joint: MjcfJoint, q: float) -> Array:
    """Pose of the body moved by a joint, in the body before; shape (4, 4)."""
    if q == 0.0:
        return identity()
    x, y, z = joint.axis.tolist()
    if joint.motion is Motion.SLIDE:
        return read_only([[1, 0, 0, q * x], [0, 1, 0, q * y], [0, 0, 1, q * z], [0, 0, 0, 1]])
    s, c = sin_cos(q)
    v = 1.0 - c
    R = (
        (c + v * x * x, v * x * y - s * z, v * x * z + s * y),
        (v * x * y + s * z, c + v * y * y, v * y * z - s * x),
        (v * x * z - s * y, v * y * z + s * x, c + v * z * z),
    )
    p = joint.pos.tolist()
    rows = [[*row, own - (row[0] * p[0] + row[1] * p[1] + row[2] * p[2])] for row, own in zip(R, p, strict=True)]
    return read_only([*rows, [0.0, 0.0, 0.0, 1.0]])


def _range(model: mujoco.MjModel, joint: MjcfJoint, name: str, notes: Notes) -> tuple[float, float] | None:
    if not model.jnt_limited[joint.id]:
        if joint.motion is Motion.SLIDE:
            notes.group("No position limits are given for joints {}.", name)
        return None
    lower, upper = (value + 0.0 for value in model.jnt_range[joint.id].tolist())
    if _usable([lower, upper]) and lower < upper:
        return lower, upper
    notes.group("Position limits that cannot be used are left out, of joints {}.", name, f"{lower!r}, {upper!r}")
    return None


def _dynamics(compiled: Compiled, joint: MjcfJoint, name: str, drive: Drive, notes: Notes) -> Dynamics:
    model, dof = compiled.model, int(compiled.model.jnt_dofadr[joint.id])
    damping = float(model.dof_damping[dof]) + drive.damping
    if joint.id in compiled.unknown_damping:
        damping = 0.0
        notes.group("A damping ratio stands for no damping, as masses are not known, for joints {}.", name)
    if np.any(model.dof_dampingpoly[dof]) or drive.nonlinear:
        notes.group("Only the linear part of the damping is carried over, of joints {}.", name)
    if model.jnt_stiffness[joint.id] or np.any(model.jnt_stiffnesspoly[joint.id]):
        notes.group("Springs are not carried over, of joints {}.", name, f"{model.jnt_stiffness[joint.id]:g}")
    values = {
        "damping": damping,
        "friction": float(model.dof_frictionloss[dof]),
        "armature": float(model.dof_armature[dof]) + drive.armature,
    }
    for what, value in values.items():
        if not 0.0 <= value <= GREATEST:
            notes.group(f"A {what} that cannot be used was made 0, for joints {{}}.", name, f"{value!r}")
            values[what] = 0.0
    return Dynamics(**values)


def note_solver(compiled: Compiled, joints: Collection[MjcfJoint], names: Sequence[str], notes: Notes) -> None:
    """Note what says how MuJoCo holds a limit or friction, where that is not its default."""
    model = compiled.model
    for joint, name in zip(joints, names, strict=True):
        dof = int(model.jnt_dofadr[joint.id])
        pairs = (
            (model.jnt_solref[joint.id], (0.02, 1.0)),
            (model.jnt_solimp[joint.id], (0.9, 0.95, 0.001, 0.5, 2.0)),
            (model.dof_solref[dof], (0.02, 1.0)),
            (model.dof_solimp[dof], (0.9, 0.95, 0.001, 0.5, 2.0)),
        )
        if model.jnt_margin[joint.id] or any(tuple(found.tolist()) != usual for found, usual in pairs):
            notes.group("Settings of MuJoCo's solver (solref, solimp, margin) are not carried over: {}.", name)
