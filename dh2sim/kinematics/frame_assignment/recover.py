"""The simplest table of a chain within a tolerance, and how far it is from the chain."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from dh2sim.arguments import instance, number
from dh2sim.errors import Dh2simError
from dh2sim.kinematics.arm_path import arm_path
from dh2sim.kinematics.frame_assignment.assign import assign_frames
from dh2sim.kinematics.frame_assignment.result import Assignment, JointPart, LinkPart, Tolerances
from dh2sim.kinematics.frame_assignment.rounding import simple_angle, simple_angles, simple_length, simple_vector
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint, serial_link_poses
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.kinematics.transforms import pose_errors, rpy_from_rotation
from dh2sim.messages import member
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array


def proximal_from(assignment: Assignment, convention: Convention) -> int:
    """Return from which row on, counted from 0, rows are modified ones.

    A Hayati row is distal: its link part comes after its joint. So do those of all rows before it; only rows after
    the last Hayati row can be modified.
    """
    if convention is not Convention.MODIFIED:
        return len(assignment.joints)
    return max((i for i, part in enumerate(assignment.links) if part.hayati), default=0)


def to_spec(
    assignment: Assignment, chain: SerialChain, convention: Convention, tolerances: Tolerances, name: str
) -> RobotSpec:
    """Return the robot that an assignment's numbers, made simple, describe; nothing of links or limits."""
    proximal = proximal_from(assignment, convention)
    links = [_simple_link(part, tolerances) for part in assignment.links]
    joints = [
        JointPart(theta=simple_angle(part.theta, tolerances), d=simple_length(part.d, tolerances))
        for part in assignment.joints
    ]
    rows = []
    for i, (joint, part) in enumerate(zip(chain.joints, joints, strict=True)):
        if i < proximal:
            rows.append(_row(joint, part, links[i + 1], Convention.STANDARD))
        else:  # the first modified row behind distal ones has its link part in the row before
            front = links[i] if i > proximal or proximal == 0 else LinkPart()
            rows.append(_row(joint, part, front, Convention.MODIFIED))
    return RobotSpec(
        name=name,
        rows=tuple(rows),
        convention=convention,
        base=BaseSpec(pose=_pose(assignment.T_base_dh0, tolerances)),
        tool=ToolSpec.at(_pose(assignment.T_dhn_tip, tolerances)),
    )


def frames_on_links(assignment: Assignment, convention: Convention) -> tuple[Array, ...]:
    """Return the pose of DH frame i in link i's own frame, i = 1 … n, each of shape (4, 4)."""
    proximal = proximal_from(assignment, convention)
    return assignment.T_link_behind[:proximal] + assignment.T_link_before[proximal:]


def _row(joint: SerialJoint, part: JointPart, link: LinkPart, convention: Convention) -> Row:
    return Row(
        name=joint.name,
        type=joint.type,
        convention=Convention.HAYATI if link.hayati else convention,
        a=link.a,
        alpha=link.alpha,
        d=part.d,
        theta=part.theta,
        beta=link.beta,
    )


def _simple_link(part: LinkPart, tolerances: Tolerances) -> LinkPart:
    return LinkPart(
        a=simple_length(part.a, tolerances),
        alpha=simple_angle(part.alpha, tolerances),
        beta=simple_angle(part.beta, tolerances),
        hayati=part.hayati,
    )


def _pose(T: Array, tolerances: Tolerances) -> Pose:
    return Pose(xyz=simple_vector(T[:3, 3], tolerances), rpy=simple_angles(rpy_from_rotation(T[:3, :3]), tolerances))


SEED = 0
_BLOCK_POSES = 40_000
"""Poses held at a time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Residual:
    """The greatest differences over all configurations, of the joint axes and the tip."""

    position: float
    """m: of the tip, and of a joint's place from its axis in the table."""
    rotation: float
    """rad: of the tip, and of the directions of axes."""
    worst: str
    """The joint, or ``the tip``, where it is greatest, of the larger of the two."""
    configurations: int

    @property
    def largest(self) -> float:
        """The larger number of the two."""
        return max(self.position, self.rotation)


def measure_residual(spec: RobotSpec, chain: SerialChain, configurations: int, slide: float) -> Residual:
    """Compare a table with a chain at random configurations, whatever the joints' limits.

    Both sides are computed straight from their own numbers: the textbooks' matrices of the table's rows, and the
    file's transforms and axes.

    Args:
        spec: The table; one moving row for every joint of the chain, in the same order.
        chain: The chain.
        configurations: How many, drawn with a fixed seed.
        slide: Sliding joints are drawn from this far on both sides of zero, m; turning ones from a whole turn.
    """
    bound = np.array([np.pi if joint.type.turns else slide for joint in chain.joints])
    q = random_configurations(-bound, bound, configurations, SEED)
    block = max(1, _BLOCK_POSES // (chain.n + 2))
    positions, rotations = [], []
    for start in range(0, configurations, block):
        position, rotation = _errors(spec, chain, q[start : start + block])
        positions.append(position)
        rotations.append(rotation)
    position, rotation = np.max(positions, axis=0), np.max(rotations, axis=0)
    names = [*(f"joint '{joint.name}'" for joint in chain.joints), "the tip"]
    return Residual(
        position=float(position.max()),
        rotation=float(rotation.max()),
        worst=names[int(np.argmax(np.maximum(position, rotation)))],
        configurations=configurations,
    )


def _errors(spec: RobotSpec, chain: SerialChain, q: Array) -> tuple[Array, Array]:
    """Return the greatest position and rotation errors of every joint's axis and of the tip, each (n + 1,)."""
    links = serial_link_poses(chain, q)
    frames = table_frame_poses(spec, q)
    position, rotation = np.zeros(chain.n + 1), np.zeros(chain.n + 1)
    moving = [(i, row) for i, row in enumerate(spec.rows) if row.type.moves]
    for k, (joint, (i, row)) in enumerate(zip(chain.joints, moving, strict=True)):
        frame = frames[:, i + 1 if row.convention is Convention.MODIFIED else i]
        z = -frame[:, :3, 2] if row.flip else frame[:, :3, 2]
        axis = links[:, k, :3, :3] @ joint.axis
        rotation[k] = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * np.linalg.norm(axis - z, axis=1))).max()
        if joint.type.turns:
            gap = links[:, k, :3, :3] @ joint.point + links[:, k, :3, 3] - frame[:, :3, 3]
            along = np.sum(gap * z, axis=1, keepdims=True)
            position[k] = np.linalg.norm(gap - along * z, axis=1).max()
    tip_position, tip_rotation = pose_errors(links[:, -1], table_tool_pose(spec, q))
    position[-1], rotation[-1] = tip_position.max(), tip_rotation.max()
    return position, rotation


TOLERANCE = 1e-9
"""rad, and m for a reach of up to 1 m, then of the reach: residuals above it are errors."""
CONFIGURATIONS = 1000
_SHARES = (1.0, 0.3, 0.03, 1e-3)
"""Of the tolerance: what a number may be changed by to make it simple, tried in turn."""
_LEAST = 1e-13
"""What a number is changed by at any rate: rounding."""
_TRIALS = 60
"""Configurations at which a choice of tolerances is tried before it is measured at all of them."""
_MARGIN = 0.8
"""Of the tolerance; the rest is for configurations that were not among those."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recovery:
    """A chain's table."""

    spec: RobotSpec
    """Rows, base and tool; joints keep their names and senses. Nothing of links and limits."""
    assignment: Assignment
    """How the frames were chosen."""
    T_link_dh: tuple[Array, ...] = field(repr=False)
    """Pose of DH frame i in link i's own frame, i = 1 … n, each of shape (4, 4)."""
    residual: Residual
    """At 1000 configurations, or fewer where it is above the tolerance."""
    tolerances: Tolerances
    """By what numbers were changed to make them simple."""
    reach: float
    """m, of ``bounded_reach``; residuals are compared with it."""


def recover_table(
    chain: SerialChain,
    *,
    convention: Convention | str = Convention.STANDARD,
    tolerance: float = TOLERANCE,
    name: str = "robot",
) -> Recovery:
    """Make the Denavit-Hartenberg table of a chain.

    Numbers within the tolerance of a simple value are made simple as long as the whole table stays within it: a large
    share of the tolerance is tried first, then smaller ones.

    Args:
        chain: The chain.
        convention: Standard or modified. Where axes are nearly parallel, rows are Hayati's; of a modified table the
            rows before such a row are then standard ones.
        tolerance: Greatest residual, rad, and m for a reach of up to 1 m, then of the reach.
        name: Of the robot.

    Returns:
        The table with its residual, which can be above the tolerance: compare them.

    Raises:
        ArgumentError: An argument is of a wrong kind.
        Dh2simError: ``convention`` is unknown, or Hayati's, which is not a convention for a whole table.
    """
    instance("chain", chain, SerialChain)
    tolerance = number("tolerance", tolerance)
    convention = member(Convention, convention, "convention")
    if convention is Convention.HAYATI:
        raise Dh2simError("a table is made in the standard or the modified convention")
    reach = bounded_reach(chain)
    scale = reach or 1.0
    best: Recovery | None = None
    for share in (*_SHARES, 0.0):
        amount = max(share * tolerance, _LEAST)
        tolerances = Tolerances(angle=amount, length=amount * scale if reach < 1.0 else amount, reach=scale)
        found = _recover(chain, convention, tolerances, name)
        if best is None or found.residual.largest < best.residual.largest:
            best = found
        if within(found.residual, tolerance, reach):
            found = replace(found, residual=measure_residual(found.spec, chain, CONFIGURATIONS, scale))
            if within(found.residual, _MARGIN * tolerance, reach):
                return found
    assert best is not None
    return best


def within(residual: Residual, tolerance: float, reach: float) -> bool:
    """Whether a residual is small enough; not where it is NaN."""
    return residual.rotation <= tolerance and residual.position <= tolerance * max(1.0, reach)


def bounded_reach(chain: SerialChain) -> float:
    """Return an upper bound of how far the tip can be from the base while sliding joints are at zero, m.

    The way over where the file says that joints are, or the way that the axes alone make, whichever is shorter: a
    file may put joints far along their axes.
    """
    path = arm_path(chain)
    by_axes = path.mounting + path.reach
    return min(chain_reach(chain), by_axes) if by_axes > 0.0 else chain_reach(chain)


def chain_reach(chain: SerialChain) -> float:
    """Return the length of the way from the base over all joints to the tip at coordinate zero, m."""
    place = np.zeros(3)  # of the joint before, in its own link
    lengths = []
    for joint in chain.joints:
        T = joint.T_parent_link
        lengths.append(math.dist(T[:3, :3] @ joint.point + T[:3, 3], place))
        place = joint.point
    lengths.append(math.dist(chain.T_link_tip[:3, 3], place))
    return math.fsum(lengths)


def _recover(chain: SerialChain, convention: Convention, tolerances: Tolerances, name: str) -> Recovery:
    modified = convention is Convention.MODIFIED
    assignment = assign_frames(chain, tolerances, first_link=modified, last_link=not modified)
    if modified and any(part.hayati for part in assignment.links):  # the first row is a distal one then
        assignment = assign_frames(chain, tolerances, first_link=False, last_link=False)
    spec = to_spec(assignment, chain, convention, tolerances, name)
    return Recovery(
        spec=spec,
        assignment=assignment,
        T_link_dh=frames_on_links(assignment, convention),
        residual=measure_residual(spec, chain, _TRIALS, tolerances.reach),
        tolerances=tolerances,
        reach=bounded_reach(chain),
    )
