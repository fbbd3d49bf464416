"""From a serial chain to its Denavit-Hartenberg frames."""

from __future__ import annotations

import math
from collections.abc import Set
from functools import partial

import numpy as np

from dh2sim.kinematics.arm_path import ArmPath, arm_path
from dh2sim.kinematics.frame_assignment.lines import Case, Line, angle_about, sine_between
from dh2sim.kinematics.frame_assignment.result import Assignment, JointPart, LinkPart, Slide, Step, Tolerances
from dh2sim.kinematics.frame_assignment.rules import (
    Passage,
    first_frame,
    is_nearly_parallel,
    last_parts,
    lead,
    place_slide,
)
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
from dh2sim.kinematics.transforms import joint_part, link_part, second_twist
from dh2sim.typing import Array, read_only


def assign_frames(chain: SerialChain, tolerances: Tolerances, *, first_link: bool, last_link: bool) -> Assignment:
    """Assign a Denavit-Hartenberg frame to every link of a chain.

    Every step looks at one link only, in the link's own frame, so that errors do not add up along the chain. The z
    axes are the joints' own axes, so that no joint changes its sense. J. Denavit, R. S. Hartenberg, A kinematic
    notation for lower-pair mechanisms based on matrices, J. Applied Mechanics 22, 1955; the cases as in M. W. Spong,
    S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, 2006, section 3.2.3. Free choices: see the enumerations
    in ``findings``.

    Args:
        chain: The chain.
        tolerances: Below what differences count as none.
        first_link: Whether the first row may begin with a link part X_0 (modified rows).
        last_link: Whether the last row may end with a link part X_n (standard rows).

    Returns:
        base · X_0 Z_1 X_1 … Z_n X_n · tool, not rounded.
    """
    path = arm_path(chain)
    hayati: set[int] = set()
    while True:
        assignment = _assigned(chain, path, hayati, tolerances, first_link=first_link, last_link=last_link)
        # a row that starts far along its axis may end too far out: the one before it becomes Hayati's, too
        more = hayati.union(
            *(_up_to(i, assignment) for i in range(1, chain.n) if _is_far(chain, path, assignment, i))
        )
        if more == hayati:
            return assignment
        hayati = more


def _is_far(chain: SerialChain, path: ArmPath, assignment: Assignment, i: int) -> bool:
    """Whether the link part of joint i, counted from 1, starts too far along the joint's axis."""
    return path.is_far_along_axis(i, _height_of(chain.joints[i - 1], assignment.T_link_before[i - 1][:3, 3]))


def _height_of(joint: SerialJoint, point: Array) -> float:
    return float((point - joint.point) @ joint.axis)


def _is_away(path: ArmPath, joint: SerialJoint, i: int, foot: Array, *, start: float, hayati: bool) -> bool:
    return hayati or path.leads_away(i, _height_of(joint, foot), start)


def _up_to(i: int, assignment: Assignment) -> set[int]:
    """Return joint i and the one before it, of those whose axes are nearly parallel to the next."""
    steps = assignment.steps
    return {k for k in (i - 1, i) if k > 0 and is_nearly_parallel(steps[k - 1].angle, steps[k - 1].case)}


def _assigned(
    chain: SerialChain,
    path: ArmPath,
    hayati: Set[int],
    tolerances: Tolerances,
    *,
    first_link: bool,
    last_link: bool,
) -> Assignment:
    """Assign frames; joints in ``hayati``, counted from 1, get a Hayati row in any case."""
    slides: list[Slide] = []
    first = _axis(chain, 0, None, np.zeros(3), path, slides)
    T_base_dh0, X_0, base_rule = first_frame(first, _second(chain), tolerances, first_link=first_link)
    T = T_base_dh0 @ link_transform(X_0)  # where the row at hand begins, in its parent link
    links, joints, steps = [X_0], [], []
    before: list[Array] = []
    behind: list[Array] = []
    for i, joint in enumerate(chain.joints):
        T = _into(joint.T_parent_link, T)
        own = Line(point=joint.point if joint.type.turns else T[:3, 3], direction=joint.axis)
        if i == chain.n - 1:
            Z, X, tip_rule = last_parts(_into(T, chain.T_link_tip), tolerances, last_link=last_link)
            T_before = T @ joint_part(Z.theta, Z.d)
        else:
            following = _axis(chain, i + 1, own, T[:3, 3], path, slides)
            start = _height_of(joint, T[:3, 3])
            passage = lead(
                T,
                own,
                following,
                height=_height(chain, i, T, path),
                is_away=partial(_is_away, path, joint, i + 1, start=start, hayati=i + 1 in hayati),
                tolerances=tolerances,
            )
            Z, X, T_before = _joint_part(T, passage), passage.part, passage.T_link_before
            steps.append(_step(joint, chain.joints[i + 1], own, following, passage))
        T = T_before @ link_transform(X)
        links.append(X)
        joints.append(Z)
        before.append(read_only(T_before))
        behind.append(read_only(T))
    return Assignment(
        T_base_dh0=read_only(T_base_dh0),
        links=tuple(links),
        joints=tuple(joints),
        T_dhn_tip=read_only(_into(T, chain.T_link_tip)),
        T_link_before=tuple(before),
        T_link_behind=tuple(behind),
        base_rule=base_rule,
        slides=tuple(slides),
        steps=tuple(steps),
        tip_rule=tip_rule,
    )


def link_transform(part: LinkPart) -> Array:
    """Return X = Tx(a) Rx(alpha) Ry(beta), shape (4, 4)."""
    return np.asarray(link_part(part.a, part.alpha) @ second_twist(part.beta))


def _axis(
    chain: SerialChain,
    index: int,
    previous: Line | None,
    origin: Array,
    path: ArmPath,
    slides: list[Slide],
) -> Line:
    """Return a joint's axis at coordinate zero in its parent link; a sliding one's place is chosen, and noted."""
    joint = chain.joints[index]
    if joint.type.turns:
        return Line(point=joint.point, direction=joint.axis).moved(joint.T_parent_link)
    line, rule = place_slide(chain, index, previous, origin, path)
    slides.append(Slide(joint=joint.name, rule=rule))
    return line


def _second(chain: SerialChain) -> Line | None:
    """Return the second joint's axis at coordinate zero in the base, as the file places it."""
    if chain.n < 2:
        return None
    joint = chain.joints[1]
    return Line(point=joint.point, direction=joint.axis).moved(chain.joints[0].T_parent_link @ joint.T_parent_link)


def _height(chain: SerialChain, index: int, T: Array, path: ArmPath) -> float | None:
    """Return how far along the axis the next joint is, where a free foot should be there; None: it should not.

    At the base, so that the column's height is in the first row; and before a sliding joint, so that its coordinate
    is all there is of d. Everywhere else d is zero where it can be, and the last of parallel axes takes it all. A
    file may put a joint far along its axis; that is not a place for a frame.
    """
    joint, following = chain.joints[index], chain.joints[index + 1]
    if not joint.type.turns or (index > 0 and following.type.turns):
        return None
    place = following.T_parent_link[:3, :3] @ following.point + following.T_parent_link[:3, 3]
    far = path.is_far_along_axis(index + 1, _height_of(joint, place))
    return None if far else float((place - T[:3, 3]) @ joint.axis)


def _joint_part(T: Array, passage: Passage) -> JointPart:
    before = passage.T_link_before
    z = before[:3, 2]
    d = 0.0 if passage.part.hayati else float((before[:3, 3] - T[:3, 3]) @ z)
    return JointPart(theta=angle_about(z, T[:3, 0], before[:3, 0]), d=d)


def _step(joint: SerialJoint, following: SerialJoint, own: Line, axis: Line, passage: Passage) -> Step:
    cosine, sine = float(own.direction @ axis.direction), sine_between(own, axis)
    return Step(
        joint=joint.name,
        next_joint=following.name,
        case=passage.case,
        antiparallel=cosine < 0.0 and passage.case not in (Case.INTERSECTING, Case.SKEW),
        angle=math.atan2(sine, cosine),
        distance=passage.distance,
        foot_rule=passage.foot_rule,
        sense_rule=passage.sense_rule,
        normal_at=passage.normal_at,
    )


def _into(T_a_b: Array, T_a_c: Array) -> Array:
    """Return T_b_c."""
    R = T_a_b[:3, :3].T
    T = np.eye(4)
    T[:3, :3] = R @ T_a_c[:3, :3]
    T[:3, 3] = R @ (T_a_c[:3, 3] - T_a_b[:3, 3])
    return T
