"""An assignment's product of parts, cut into the rows of a table."""

from __future__ import annotations

from dh2sim.kinematics.assignment.findings import Assignment, JointPart, LinkPart
from dh2sim.kinematics.assignment.simple import simple_angle, simple_angles, simple_length, simple_vector
from dh2sim.kinematics.assignment.tolerances import Tolerances
from dh2sim.kinematics.serial import SerialChain, SerialJoint
from dh2sim.kinematics.transforms import rpy_from_rotation
from dh2sim.robot.spec import BaseSpec, Convention, Pose, RobotSpec, Row
from dh2sim.typing import Array


def proximal_from(assignment: Assignment, convention: Convention) -> int:
    """Return from which row on, counted from 0, rows are modified ones.

    A Hayati row is distal: its link part stands behind its joint. So do those of all rows before it; only rows behind
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
        tool=_pose(assignment.T_dhn_tip, tolerances),
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
