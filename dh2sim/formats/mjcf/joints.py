"""The joints of an MJCF's arm: poses with fixed bodies merged, axes, limits, dynamics, and what drives them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.formats.mjcf.chain import Selection
from dh2sim.formats.mjcf.compile import Compiled
from dh2sim.formats.mjcf.includes import MjcfFiles
from dh2sim.formats.mjcf.tree import DYNAMICS, MjcfJoint, MjcfTree, Motion
from dh2sim.formats.serial_robot import GREATEST, ChainJoints
from dh2sim.formats.xml_read import place
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.kinematics.trig import sin_cos
from dh2sim.messages import Notes, shown
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Dynamics, JointType, Limits
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    import mujoco

_UNSUPPORTED: Final = "Actuators that a robot file has no place for are left out: {}."


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drive:
    """What drives a joint, and what that adds to its dynamics."""

    actuator: ActuatorSpec
    effort: float | None = None
    """N·m or N."""
    damping: float = 0.0
    """Of the actuators, seen at the joint, N·m·s/rad or N·s/m."""
    armature: float = 0.0
    """Likewise, kg·m² or kg."""
    nonlinear: bool = False
    """Whether an actuator's damping has a nonlinear part."""


def read_drives(compiled: Compiled, selection: Selection, names: Sequence[str], notes: Notes) -> tuple[Drive, ...]:
    """Return what drives each joint between base and tip.

    A position or velocity servo or a motor that acts on a joint alone, with gear 1 and without dynamics, is carried
    over; other actuators are noted.
    """
    import mujoco

    model = compiled.model
    direct = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    drivers: dict[int, list[int]] = {joint.id: [] for joint in selection.joints}
    for i in range(model.nactuator):
        joint = int(model.actuator_trnid[i, 0]) if int(model.actuator_trntype[i]) in direct else -1
        if joint in drivers:
            drivers[joint].append(i)
        else:
            notes.group("Actuators that act on no joint of the arm are left out: {}.", _name(model, i))
    return tuple(
        _drive(compiled, joint, name, drivers[joint.id], notes)
        for joint, name in zip(selection.joints, names, strict=True)
    )


def _drive(compiled: Compiled, joint: MjcfJoint, name: str, drivers: list[int], notes: Notes) -> Drive:
    model = compiled.model
    actuator = ActuatorSpec(type=ActuatorType.NONE)
    if len(drivers) == 1:
        actuator = _read(compiled, drivers[0], notes)
    for i in drivers if len(drivers) > 1 else ():
        notes.group(_UNSUPPORTED, _name(model, i), f"one of {len(drivers)} on joint {shown(name)}")
    gears = [float(model.actuator_gear[i, 0]) for i in drivers]
    squares = [(i, gear * gear) for i, gear in zip(drivers, gears, strict=True)]
    if actuator.type in (ActuatorType.POSITION, ActuatorType.VELOCITY):
        _note_control(model, drivers[0], joint, notes)
    return Drive(
        actuator=actuator,
        effort=_effort(model, joint, name, drivers, notes),
        damping=sum(float(model.actuator_damping[i]) * square for i, square in squares),
        armature=sum(float(model.actuator_armature[i]) * square for i, square in squares),
        nonlinear=any(np.any(model.actuator_dampingpoly[i]) for i in drivers),
    )


def _read(compiled: Compiled, i: int, notes: Notes) -> ActuatorSpec:
    """Return an actuator that is the only one of its joint."""
    model = compiled.model
    gain, bias = model.actuator_gainprm[i].tolist(), model.actuator_biasprm[i].tolist()
    reason = _unsupported(model, i)
    if reason is None:
        if _is_motor(model, i):
            if gain[0] == 1.0:
                return ActuatorSpec(type=ActuatorType.MOTOR)
            reason = f"gain {gain[0]:g}"
        elif 0.0 < gain[0] <= GREATEST and bias[0] == 0.0 and -GREATEST <= bias[2] <= 0.0 and not any(bias[3:]):
            damping = -bias[2] + 0.0
            if bias[1] == -gain[0]:
                kv = None if i in compiled.unknown_kv else damping
                if kv is None:
                    notes.group(
                        "A damping ratio is left out, as masses are unknown, of actuators {}.", _name(model, i)
                    )
                return ActuatorSpec(type=ActuatorType.POSITION, kp=gain[0], kv=kv)
            if bias[1] == 0.0 and damping == gain[0]:
                return ActuatorSpec(type=ActuatorType.VELOCITY, kv=damping)
    notes.group(_UNSUPPORTED, _name(model, i), reason or "neither a motor nor a position or velocity servo")
    return ActuatorSpec(type=ActuatorType.NONE)


def _unsupported(model: mujoco.MjModel, i: int) -> str | None:
    """Return what a robot file has no place for in an actuator, or None."""
    import mujoco

    gear = model.actuator_gear[i].tolist()
    affine = int(mujoco.mjtBias.mjBIAS_AFFINE)
    if gear[0] != 1.0:
        return f"gear {gear[0]:g}"
    if int(model.actuator_dyntype[i]) != int(mujoco.mjtDyn.mjDYN_NONE):
        return "with dynamics of its own"
    if model.actuator_ctrlnum[i] != 1 or model.actuator_outnum[i] != 1:
        return "of several controls"
    if model.actuator_delay[i] > 0.0:
        return "with a delay"
    if int(model.actuator_gaintype[i]) != int(mujoco.mjtGain.mjGAIN_FIXED) or model.actuator_biastype[i] > affine:
        return "neither a motor nor a position or velocity servo"
    return None


def _is_motor(model: mujoco.MjModel, i: int) -> bool:
    import mujoco

    fixed = int(model.actuator_gaintype[i]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    return fixed and int(model.actuator_biastype[i]) == int(mujoco.mjtBias.mjBIAS_NONE)


def _effort(model: mujoco.MjModel, joint: MjcfJoint, name: str, drivers: list[int], notes: Notes) -> float | None:
    """Return the greatest force at a joint: the least of what limits it, where the file limits it."""
    ranges = [model.jnt_actfrcrange[joint.id].tolist()] if model.jnt_actfrclimited[joint.id] else []
    if len(drivers) == 1:
        i = drivers[0]
        gear = float(model.actuator_gear[i, 0])
        if model.actuator_forcelimited[i]:
            ranges.append([gear * value for value in model.actuator_forcerange[i].tolist()])
        control = int(model.actuator_ctrladr[i])
        if (
            _is_motor(model, i)
            and _unsupported(model, i) in (None, f"gear {gear:g}")
            and model.actuator_ctrllimited[control]
        ):
            factor = gear * float(model.actuator_gainprm[i, 0])
            ranges.append([factor * value for value in model.actuator_ctrlrange[control].tolist()])
    efforts = []
    for lower, upper in map(sorted, ranges):
        efforts.append(min(-lower, upper))
        if -lower != upper:
            notes.group(
                "Limits of force that differ in the two directions: the smaller one is used, for joints {}.",
                name,
                f"{lower:g}, {upper:g}",
            )
    effort = min(efforts, default=None)
    if effort is None or 0.0 < effort <= GREATEST:
        return effort
    notes.group("Limits of force that cannot be used are left out, of joints {}.", name, f"{effort:g}")
    return None


def _note_control(model: mujoco.MjModel, i: int, joint: MjcfJoint, notes: Notes) -> None:
    control = int(model.actuator_ctrladr[i])
    limited = bool(model.actuator_ctrllimited[control])
    limits = model.jnt_range[joint.id].tolist() if model.jnt_limited[joint.id] else None
    if limited and model.actuator_ctrlrange[control].tolist() != limits:
        lower, upper = model.actuator_ctrlrange[control].tolist()
        notes.group(
            "Ranges of controls other than the joint's own are not carried over, of actuators {}.",
            _name(model, i),
            f"{lower:g}, {upper:g}",
        )


def _name(model: mujoco.MjModel, i: int) -> str:
    return model.actuator(i).name or f"actuator {i + 1}"


def check_joints(tree: MjcfTree, selection: Selection, files: MjcfFiles) -> None:
    """Check that every joint from base to tip can be a row of a table, and that every number is fit for use.

    Raises:
        ImportedFileError: One is not; the error holds all that are not.
    """
    problems: list[Problem] = []
    for joint in selection.joints:
        if joint.motion in (Motion.BALL, Motion.FREE):
            message = f"a {joint.motion} joint has no row in a table; choose a base or tip that leaves it out"
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
    T = identity()  # of the current body in the link of the last joint
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
    """Return the pose of the body moved by a joint, in the body before; shape (4, 4)."""
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
    if joint.id in compiled.unknown_damping:
        notes.group("A damping ratio counts as no damping, as masses are unknown, for joints {}.", name)
    if np.any(model.dof_dampingpoly[dof]) or drive.nonlinear:
        notes.group("Only the linear part of the damping is carried over, of joints {}.", name)
    if model.jnt_stiffness[joint.id] or np.any(model.jnt_stiffnesspoly[joint.id]):
        notes.group("Springs are not carried over, of joints {}.", name, f"{model.jnt_stiffness[joint.id]:g}")
    values = {name: float(getattr(model, f"dof_{attribute}")[dof]) for name, attribute in DYNAMICS.items()}
    values["damping"] = 0.0 if joint.id in compiled.unknown_damping else values["damping"] + drive.damping
    values["armature"] += drive.armature
    for what, value in values.items():
        if not 0.0 <= value <= GREATEST:
            notes.group(f"A {what} that cannot be used was made 0, for joints {{}}.", name, f"{value!r}")
            values[what] = 0.0
    return Dynamics(**values)


def note_solver(compiled: Compiled, joints: Collection[MjcfJoint], names: Sequence[str], notes: Notes) -> None:
    """Note MuJoCo's settings for limits and friction where they are not its defaults."""
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
